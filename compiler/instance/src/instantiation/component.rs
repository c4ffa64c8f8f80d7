//! One component: its class resolved, its instance made, variables with their attributes.
//!
//! `outer` components are bound to the `inner` one above them (Modelica 3.6, section 5.4).

use std::rc::Rc;

use hyd_source::{Code, Diagnostic, Reported};
use hyd_syntax::tree::{Argument, ClassBody, ClassKind, Component, Expr, ExprKind, Modification, Name};

use crate::classes::class::ClassId;
use crate::classes::modifier::{Applied, Mods};
use crate::classes::shape::{Shape, ShapeElement};
use crate::instantiation::instance::{InstId, Instance, LocalClass, ScalarType, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;
use crate::values::evaluate::Env;
use crate::values::value::Value;

/// True if `Evaluate = true` stands in an annotation.
fn is_evaluated(annotation: &Modification) -> bool {
    annotation.arguments.iter().any(|argument| match argument {
        Argument::Modify(modify) => {
            let is_named = matches!(modify.target.parts.as_slice(), [only] if only.name.as_ref() == "Evaluate");
            let value = modify.modification.binding.as_ref().map(|value| &value.kind);
            is_named && matches!(value, Some(ExprKind::Boolean(true)))
        }
        _ => false,
    })
}

/// Deepest nesting of components.
const MAX_DEPTH: usize = 100;
/// Where so many instances around a component are of classes with its text, each nested in the next one out, the row is taken to be endless.
const SAME_TEXT: usize = 6;

impl Scopes<'_> {
    pub(crate) fn make(
        &mut self,
        parent: InstId,
        element: &ShapeElement,
        declaration: &Component,
        scope: Scope,
        type_scope: Scope,
        mods: Mods,
    ) -> Result<(), Reported> {
        let name = element.name.clone();
        let absent = match &declaration.condition {
            Some(condition) => !self.condition(condition, scope)?,
            None => false,
        };
        if declaration.prefixes.outer && !absent {
            if !declaration.prefixes.inner {
                self.outer_says_nothing(declaration);
            }
            let inner = self.bind_outer(parent, declaration, type_scope)?;
            self.check_inner(inner, declaration, type_scope)?;
            if let Err(said) = self.check_added(inner, parent, declaration, type_scope) {
                // Only this `outer` element is at fault, not the one that others mean.
                self.instances.edit(parent).by_name.remove(&name);
                return Err(said);
            }
            if !declaration.prefixes.inner {
                return Ok(());
            }
        }
        let inst = self.instances.add(Instance::new(name.clone(), Some(parent), declaration.name.span));
        self.fill(inst, parent, declaration);
        let frames = self.instances[parent].shape.as_ref().map(|shape| shape.frames[element.frame as usize].protected);
        self.instances.edit(inst).protected |= frames.unwrap_or(false);
        self.instances.edit(inst).absent = absent;
        self.instances.edit(parent).children.push(inst);
        if declaration.prefixes.outer && !absent {
            self.instances.edit(parent).own_inner.insert(name, inst);
        } else {
            self.instances.edit(parent).by_name.insert(name, inst);
        }
        if absent {
            return Ok(());
        }
        if let Some(annotation) = &declaration.annotation {
            self.note_connection_rules(inst, annotation);
        }
        let type_of = self.type_of(type_scope, &declaration.class)?;
        for (k, dim) in declaration.dims.iter().enumerate() {
            let size = self.size(dim, k, scope, &mods, &declaration.name.name)?;
            // Those that follow may read it.
            self.instances.edit(inst).dims.push(size);
        }
        match type_of {
            // Only classes that extend it have a constructor.
            TypeOf::Scalar(ScalarType::Object) => {
                let message = "`ExternalObject` is partial and cannot be the class of a component".to_string();
                Err(self.error(Code::PartialClass, declaration.class.span, message))
            }
            TypeOf::Scalar(scalar) => {
                self.make_variable(inst, scalar, &mods, declaration.prefixes.is_final);
                self.check_size(inst)
            }
            TypeOf::Class(local, shape) => {
                let of_type = self.alias_sizes(&local, &shape)?;
                self.instances.edit(inst).dims.extend(of_type);
                self.check_size(inst)?;
                if self.is_made_apart(inst, &local) {
                    return self.make_parts(inst, &local, &shape, &mods, declaration);
                }
                self.make_component(inst, local, shape, mods, declaration)
            }
        }
    }

    pub(crate) fn fill(&mut self, inst: InstId, parent: InstId, declaration: &Component) {
        let (above, protected) = (self.instances[parent].variability, self.instances[parent].protected);
        let final_record = self.instances[parent].final_record;
        let instance = self.instances.edit(inst);
        instance.variability = declaration.variability.min(above);
        instance.protected = declaration.prefixes.protected || protected;
        instance.flow = declaration.flow;
        instance.stream = declaration.stream;
        instance.final_record = final_record;
        instance.direction = declaration.direction;
        instance.inner = declaration.prefixes.inner;
        instance.evaluate = declaration.annotation.as_ref().is_some_and(is_evaluated);
        instance.description = declaration.description.clone();
    }

    /// An `outer` declaration only names the `inner` one: it cannot say anything of it (5.4).
    fn outer_says_nothing(&mut self, declaration: &Component) {
        let modification = &declaration.modification;
        if modification.binding.is_none() && modification.arguments.is_empty() {
            return;
        }
        let message = format!("the `outer` element `{}` cannot have a value or modifiers", declaration.name.name);
        let span = modification.span.unwrap_or(declaration.name.span);
        let diagnostic = Diagnostic::error(Code::Misplaced, message).at(span, "");
        self.table.report(diagnostic.help("they belong to the `inner` declaration"));
    }

    fn bind_outer(&mut self, parent: InstId, declaration: &Component, type_scope: Scope) -> Result<InstId, Reported> {
        let name = &declaration.name.name;
        let mut current = self.instances[parent].parent;
        while let Some(above) = current {
            // The inner component may be declared further down in the text than its user.
            if self.inner_named(above, name).is_none()
                && let Some(k) = self.inner_element(above, name)
            {
                let outer = self.pending.get(&above).cloned().unwrap_or_default();
                self.instantiate_element(above, k, &outer)?;
            }
            if let Some(found) = self.inner_named(above, name) {
                self.instances.edit(parent).by_name.insert(name.clone(), found);
                return Ok(found);
            }
            current = self.instances[above].parent;
        }
        let added = self.add_inner(parent, declaration, type_scope)?;
        self.instances.edit(parent).by_name.insert(name.clone(), added);
        Ok(added)
    }

    /// The `inner` component of that name which an instance has for those inside it.
    fn inner_named(&self, inst: InstId, name: &Name) -> Option<InstId> {
        let instance = &self.instances[inst];
        let found = instance.own_inner.get(name).or_else(|| instance.by_name.get(name));
        found.copied().filter(|&found| self.instances[found].inner && self.instances[found].parent == Some(inst))
    }

    pub(crate) fn inner_element(&self, inst: InstId, name: &Name) -> Option<usize> {
        let shape = self.instances[inst].shape.as_ref()?;
        let k = *shape.by_name.get(name)? as usize;
        let declaration = self.declared(shape, &shape.elements[k])?;
        declaration.prefixes.inner.then_some(k)
    }

    pub(crate) fn condition(&mut self, condition: &Expr, scope: Scope) -> Result<bool, Reported> {
        match self.evaluate(condition, scope, &Env::default())? {
            Value::Boolean(value) => Ok(value),
            other => {
                let message = format!("the condition of a component must be Boolean, not {}", other.type_name());
                Err(self.error(Code::TypeMismatch, condition.span, message))
            }
        }
    }

    /// A component of a class, or a variable of a `type` class.
    pub(crate) fn make_component(
        &mut self,
        inst: InstId,
        local: LocalClass,
        shape: Rc<Shape>,
        mut mods: Mods,
        declaration: &Component,
    ) -> Result<(), Reported> {
        let outside = mods.len();
        mods.extend(local.mods.iter().map(|applied| Applied { of_class: true, ..applied.clone() }));
        let enumeration = self.enumeration(local.class);
        let scalar = match (&shape.builtin, enumeration) {
            (_, Some(enumeration)) => Some(ScalarType::Enumeration(enumeration)),
            (Some(name), None) => Some(ScalarType::of_builtin(name)),
            (None, None) => None,
        };
        self.instances.edit(inst).class = Some(local.class);
        self.instances.edit(inst).context = local.context;
        let def = self.table.class(local.class).def.clone();
        if let Some(scalar) = scalar {
            let scope = self.package_of(&local)?;
            for frame in shape.frames.last().into_iter().flat_map(|f| &f.modifications) {
                let scope = self.scope_of_modifier(scope, frame.0);
                mods.push(Applied::new(frame.1.clone(), scope));
            }
            if matches!(def.kind, ClassKind::Connector) {
                self.instances.edit(inst).kind = ClassKind::Connector;
            }
            self.short_prefixes(inst, &shape);
            self.make_variable(inst, scalar, &mods, declaration.prefixes.is_final);
            return Ok(());
        }
        self.check_class(inst, local.class, declaration)?;
        self.instances.edit(inst).kind = def.kind;
        self.instances.edit(inst).expandable = def.expandable;
        self.instances.edit(inst).final_record |= declaration.prefixes.is_final && def.kind == ClassKind::Record;
        self.take_apart(&local, &mut mods, outside, &shape)?;
        self.instances.edit(inst).shape = Some(shape);
        self.depth += 1;
        let result = self.instantiate_members(inst, &mods, outside);
        self.depth -= 1;
        result
    }

    pub(crate) fn short_prefixes(&mut self, inst: InstId, shape: &Rc<Shape>) {
        for frame in &shape.frames {
            if let ClassBody::Short { direction: Some(direction), .. } = &self.table.class(frame.class).def.body {
                self.instances.edit(inst).direction = Some(*direction);
            }
        }
    }

    /// A class that inherits from one around it has an element of its own text, which has another one, and so on: none of them is the same
    /// class.  The outermost of [`SAME_TEXT`] of them, where a component is of the next.  Redeclarations can end such a row after a few.
    fn inherits_itself(&self, inst: InstId, class: ClassId) -> Option<ClassId> {
        let text = self.table.class(class).def.name.span;
        let (mut inner, mut found, mut above) = (class, 0, self.instances[inst].parent);
        while let Some(around) = above {
            let own = self.instances[around].class;
            if let Some(own) = own.filter(|&own| self.table.class(inner).parent == Some(own))
                && self.table.class(own).def.name.span == text
            {
                (inner, found) = (own, found + 1);
                if found == SAME_TEXT {
                    return Some(inner);
                }
            }
            above = self.instances[around].parent;
        }
        None
    }

    pub(crate) fn check_class(
        &mut self,
        inst: InstId,
        class: ClassId,
        declaration: &Component,
    ) -> Result<(), Reported> {
        let def = self.table.class(class).def.clone();
        let span = declaration.class.span;
        let full = self.table.full_name(class);
        let fault = match def.kind {
            ClassKind::Package | ClassKind::Function => {
                Some((Code::Misplaced, format!("`{full}` is a {} and cannot be a component", def.kind.keyword())))
            }
            ClassKind::Operator => Some((
                Code::OutsideProfile,
                format!("`{full}` is an operator class, which is outside the language profile"),
            )),
            _ if matches!(def.body, ClassBody::DerivativeOf(..) | ClassBody::Enumeration(None)) => {
                Some((Code::OutsideProfile, format!("the form of class `{full}` is outside the language profile")))
            }
            _ if def.partial => {
                Some((Code::PartialClass, format!("`{full}` is partial and cannot be the class of a component")))
            }
            _ => None,
        };
        if let Some((code, message)) = fault {
            self.table.report(Diagnostic::error(code, message).at(span, "").with(def.name.span, "declared here"));
            return Err(Reported);
        }
        let mut current = self.instances[inst].parent;
        while let Some(above) = current {
            if self.instances[above].class == Some(class) {
                let message = format!("`{full}` contains a component of its own class");
                self.table.report(Diagnostic::error(Code::CircularClass, message).at(span, "the cycle closes here"));
                return Err(Reported);
            }
            current = self.instances[above].parent;
        }
        if let Some(outermost) = self.inherits_itself(inst, class) {
            let outer = self.table.full_name(outermost);
            let message =
                format!("`{outer}` contains a component of its own class, which it inherits from a class around it");
            self.table.report(Diagnostic::error(Code::CircularClass, message).at(span, "the cycle closes here"));
            return Err(Reported);
        }
        if self.depth >= MAX_DEPTH {
            let message = format!("components are nested deeper than {MAX_DEPTH} levels");
            return Err(self.error(Code::Limit, span, message));
        }
        Ok(())
    }
}

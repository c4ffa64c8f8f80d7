//! Instantiation: from a class and its modifications to the instance tree.
//!
//! For every component: gather the modifications that speak of it (outermost first), replace its class if it is
//! redeclared, evaluate its condition and sizes, then do the same inside (Modelica 3.6, sections 5.6 and 7).

use std::rc::Rc;
use std::sync::Arc;

use hyd_index::IndexVec;
use hyd_source::{Code, Diagnostic, Reported, Span, did_you_mean};
use hyd_syntax::tree::{ClassBody, ClassKind, Component, Element, Expr, Name, NestedClass, Path, Variability};
use rustc_hash::FxHashMap;

use crate::class::{ClassId, ClassTable, elements};
use crate::evaluate::Env;
use crate::instance::{InstId, Instance, Instances, Known, LocalClass, Primitive, ScalarType, Scope};
use crate::lookup::predefined_enumeration;
use crate::modifier::{Applied, Mods, Redeclare, of_child, redeclaration};
use crate::shape::{Shape, ShapeElement, is_builtin};
use crate::value::{EnumType, Value};

/// Deepest nesting of components.
const MAX_DEPTH: usize = 100;
/// Largest number of elements of one array of components or variables.
const MAX_ELEMENTS: usize = 1 << 27;

/// A value set from outside by instance path.
#[derive(Clone, Debug)]
pub struct Override {
    /// Instance path.
    pub path: String,
    /// The value.
    pub value: Value,
    /// It was needed at translation.
    pub used: bool,
}

/// The instance tree with all that is needed to ask it further questions.
pub struct InstanceTree<'s> {
    /// Classes, texts and messages.
    pub table: ClassTable<'s>,
    /// All instances.
    pub instances: Instances,
    /// The top model.
    pub root: InstId,
    /// Values set from outside.
    pub overrides: Vec<Override>,
    pub(crate) packages: FxHashMap<ClassId, InstId>,
    pub(crate) enumerations: FxHashMap<ClassId, Option<Arc<EnumType>>>,
    depth: usize,
}

/// Instantiates a model.  `Err` gives the table back with its messages.
pub fn instantiate<'s>(
    table: ClassTable<'s>,
    class: ClassId,
    overrides: Vec<Override>,
) -> Result<InstanceTree<'s>, Box<ClassTable<'s>>> {
    let mut tree = InstanceTree {
        table,
        instances: IndexVec::new(),
        root: InstId(0),
        overrides,
        packages: FxHashMap::default(),
        enumerations: FxHashMap::default(),
        depth: 0,
    };
    let def = tree.table.class(class).def.clone();
    if def.partial {
        let message = format!("`{}` is partial and cannot be simulated by itself", tree.table.full_name(class));
        tree.table.report(Diagnostic::error(Code::PartialClass, message).at(def.name.span, "declared partial here"));
        return Err(Box::new(tree.table));
    }
    let Ok(shape) = tree.table.shape(class) else { return Err(Box::new(tree.table)) };
    let root = tree.new_instance("".into(), None, def.name.span);
    tree.root = root;
    let instance = &mut tree.instances[root];
    instance.class = Some(class);
    instance.shape = Some(shape);
    instance.kind = def.kind;
    instance.description = def.description.clone();
    let _ = tree.instantiate_members(root, &Vec::new());
    Ok(tree)
}

/// The class a declaration names, resolved.
enum TypeOf {
    Scalar(ScalarType),
    Class(LocalClass, Rc<Shape>),
}

impl InstanceTree<'_> {
    fn new_instance(&mut self, name: Name, parent: Option<InstId>, span: Span) -> InstId {
        self.instances.push(Instance {
            name,
            parent,
            class: None,
            shape: None,
            kind: ClassKind::Type,
            dims: Vec::new(),
            children: Vec::new(),
            by_name: FxHashMap::default(),
            local_classes: FxHashMap::default(),
            variability: Variability::Continuous,
            flow: false,
            direction: None,
            protected: false,
            inner: false,
            absent: false,
            description: None,
            span,
            primitive: None,
            known: Known::No,
        })
    }

    /// The instance that holds the constants of a package.
    pub(crate) fn package_instance(&mut self, class: ClassId) -> Result<InstId, Reported> {
        if let Some(&known) = self.packages.get(&class) {
            return Ok(known);
        }
        let shape = self.table.shape(class)?;
        let def = self.table.class(class).def.clone();
        let inst = self.new_instance(self.table.full_name(class).into(), None, def.name.span);
        self.instances[inst].class = Some(class);
        self.instances[inst].shape = Some(shape);
        self.instances[inst].kind = ClassKind::Package;
        self.packages.insert(class, inst);
        Ok(inst)
    }

    /// A scope for the text of a class that is not instantiated (a function): its constants and enclosing packages.
    pub fn package_of(&mut self, class: ClassId) -> Result<InstId, Reported> {
        self.package_instance(class)
    }

    /// Makes all components of an instance whose class is set.  Errors are reported; the rest is still made.
    fn instantiate_members(&mut self, inst: InstId, mods: &Mods) -> Result<(), Reported> {
        let Some(shape) = self.instances[inst].shape.clone() else { return Ok(()) };
        self.check_targets(inst, &shape, mods);
        for (k, element) in shape.elements.iter().enumerate() {
            if !element.component {
                self.redeclare_class(inst, &shape, k, mods);
            }
        }
        let mut result = Ok(());
        for (k, element) in shape.elements.iter().enumerate() {
            if element.component && self.instantiate_element(inst, k, mods).is_err() {
                result = Err(Reported);
            }
        }
        result
    }

    /// Every modification must speak of an element.
    fn check_targets(&mut self, inst: InstId, shape: &Rc<Shape>, mods: &Mods) {
        let frames = shape.frames.iter().flat_map(|f| f.modifications.iter().map(|(_, tree)| tree));
        let all: Vec<_> = mods.iter().map(|m| &m.tree).chain(frames).cloned().collect();
        for tree in all {
            for (name, child) in &tree.children {
                if shape.by_name.contains_key(name) || shape.builtin.is_some() {
                    continue;
                }
                let class = self.instances[inst].class.map(|c| self.table.full_name(c)).unwrap_or_default();
                let help = did_you_mean(name, shape.elements.iter().map(|e| e.name.as_ref()));
                let mut diagnostic =
                    Diagnostic::error(Code::UnknownModifier, format!("`{class}` has no element `{name}` to modify"));
                if let Some(span) = child.span {
                    diagnostic = diagnostic.at(span, "names nothing");
                }
                self.table.report(diagnostic.maybe_help(help));
            }
        }
    }

    /// All modifications of element `k`, outermost first: from outside, from `extends` clauses, from the declaration.
    fn mods_of(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize, outer: &Mods) -> Mods {
        let element = &shape.elements[k];
        let array = (!self.instances[inst].dims.is_empty()).then_some(inst);
        let mut mods = of_child(outer, &element.name, array);
        for (frame, tree) in &shape.frames[element.frame as usize].modifications {
            let scope = Scope { inst, frame: *frame };
            let applied = Applied { tree: tree.clone(), scope, spread: Vec::new() };
            mods.extend(of_child(&vec![applied], &element.name, None));
        }
        mods
    }

    fn declared(&self, shape: &Shape, element: &ShapeElement) -> Option<Component> {
        let class = shape.frames[element.frame as usize].class;
        match &elements(&self.table.class(class).def)[element.position as usize] {
            Element::Component(component) => Some(component.clone()),
            _ => None,
        }
    }

    fn redeclare_class(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize, outer: &Mods) {
        let mods = self.mods_of(inst, shape, k, outer);
        let Some((_, applied)) = redeclaration(&mods) else { return };
        let applied = applied.clone();
        let element = &shape.elements[k];
        let owner = shape.frames[element.frame as usize].class;
        let def = self.table.class(owner).def.clone();
        let Element::Class(original) = &elements(&def)[element.position as usize] else { return };
        let Some(Redeclare::Class(new)) = &applied.tree.redeclare else {
            let message = format!("`{}` is a class and is redeclared as a component", element.name);
            self.table.report(
                Diagnostic::error(Code::Redeclaration, message)
                    .at(applied.tree.span.unwrap_or(original.class.span), ""),
            );
            return;
        };
        if !original.prefixes.replaceable {
            self.not_replaceable(&element.name, applied.tree.span, original.class.name.span);
            return;
        }
        if let Ok(local) = self.class_of_redeclare(new, &applied, original) {
            self.instances[inst].local_classes.insert(element.name.clone(), local);
        }
    }

    /// `redeclare model A = B(m)`: class B with modification m in the scope of the redeclaration, then the modification
    /// of the constraining clause.  A long class definition becomes a class of its own in the scope's class.
    fn class_of_redeclare(
        &mut self,
        new: &Arc<NestedClass>,
        applied: &Applied,
        original: &NestedClass,
    ) -> Result<LocalClass, Reported> {
        let scope = applied.scope;
        let mut mods = Mods::new();
        let class = match &new.class.body {
            ClassBody::Short { base, modification, .. } => {
                let tree = Arc::new(crate::modifier::AstMod::from_syntax(modification));
                mods.push(Applied { tree, scope, spread: Vec::new() });
                let found = self.find_class(scope, base)?;
                mods.extend(found.mods);
                found.class
            }
            _ => {
                let parent = self.instances[scope.inst].shape.as_ref().map(|s| s.frames[scope.frame as usize].class);
                self.table.add(new.class.clone(), parent, false)
            }
        };
        if let Some(constraint) = &original.constrained_by {
            let tree = Arc::new(crate::modifier::AstMod::from_syntax(&constraint.modification));
            mods.push(Applied { tree, scope, spread: Vec::new() });
        }
        Ok(LocalClass { class, mods })
    }

    fn not_replaceable(&mut self, name: &str, at: Option<Span>, declared: Span) {
        let message = format!("`{name}` is redeclared but was not declared `replaceable`");
        let mut diagnostic = Diagnostic::error(Code::Redeclaration, message);
        if let Some(span) = at {
            diagnostic = diagnostic.at(span, "redeclared here");
        }
        self.table.report(diagnostic.with(declared, "declared here"));
    }

    /// Makes component `k` of the instance's shape.
    pub(crate) fn instantiate_element(&mut self, inst: InstId, k: usize, outer: &Mods) -> Result<(), Reported> {
        let Some(shape) = self.instances[inst].shape.clone() else { return Ok(()) };
        let element = &shape.elements[k];
        let Some(mut declaration) = self.declared(&shape, element) else { return Ok(()) };
        let original_span = declaration.name.span;
        let own_scope = Scope { inst, frame: element.frame };
        let mut type_scope = own_scope;
        let mut mods = self.mods_of(inst, &shape, k, outer);
        if let Some((position, applied)) = redeclaration(&mods).map(|(p, a)| (p, a.clone())) {
            let Some(Redeclare::Component(new)) = &applied.tree.redeclare else {
                let message = format!("`{}` is a component and is redeclared as a class", element.name);
                self.table.report(
                    Diagnostic::error(Code::Redeclaration, message).at(applied.tree.span.unwrap_or(original_span), ""),
                );
                return Err(Reported);
            };
            if !declaration.prefixes.replaceable {
                self.not_replaceable(&element.name, applied.tree.span, original_span);
                return Err(Reported);
            }
            // 7.3.2: the modification of the constraining clause stays in force, else that of the declaration.
            let kept = match &declaration.constrained_by {
                Some(constraint) => Arc::new(crate::modifier::AstMod::from_syntax(&constraint.modification)),
                None => element.modification.clone(),
            };
            let tree = Arc::new(crate::modifier::AstMod::from_syntax(&new.modification));
            mods.truncate(position);
            mods.push(Applied { tree, scope: applied.scope, spread: applied.spread.clone() });
            mods.push(Applied { tree: kept, scope: own_scope, spread: Vec::new() });
            type_scope = applied.scope;
            declaration = Component {
                prefixes: declaration.prefixes.clone(),
                condition: declaration.condition.clone(),
                dims: if new.dims.is_empty() { declaration.dims.clone() } else { new.dims.clone() },
                description: new.description.clone().or(declaration.description.clone()),
                ..(**new).clone()
            };
        } else {
            mods.push(Applied { tree: element.modification.clone(), scope: own_scope, spread: Vec::new() });
            if let Some(constraint) = &declaration.constrained_by {
                let tree = Arc::new(crate::modifier::AstMod::from_syntax(&constraint.modification));
                mods.push(Applied { tree, scope: own_scope, spread: Vec::new() });
            }
        }
        self.check_final(&element.name, &mods, declaration.prefixes.is_final);
        self.make(inst, element, &declaration, own_scope, type_scope, mods)
    }

    fn check_final(&mut self, name: &str, mods: &Mods, declared_final: bool) {
        let last = mods.len() - 1;
        for (inner, applied) in mods.iter().enumerate().skip(1) {
            let is_final = applied.tree.is_final || (inner == last && declared_final);
            let Some(outer) = mods[..inner].iter().find(|m| m.tree.binding.is_some() || !m.tree.children.is_empty())
            else {
                continue;
            };
            if is_final {
                let message = format!("`{name}` is final and cannot be modified");
                let mut diagnostic = Diagnostic::error(Code::FinalModified, message);
                if let Some(span) = outer.tree.span {
                    diagnostic = diagnostic.at(span, "modified here");
                }
                if let Some(span) = applied.tree.span {
                    diagnostic = diagnostic.with(span, "declared final here");
                }
                self.table.report(diagnostic);
                return;
            }
        }
    }

    fn make(
        &mut self,
        parent: InstId,
        element: &ShapeElement,
        declaration: &Component,
        scope: Scope,
        type_scope: Scope,
        mods: Mods,
    ) -> Result<(), Reported> {
        let name = element.name.clone();
        if declaration.stream {
            let message = format!("`{name}` is a stream variable; stream connectors are outside the language profile");
            self.table.report(Diagnostic::error(Code::OutsideProfile, message).at(declaration.span, ""));
            return Err(Reported);
        }
        if declaration.prefixes.outer && !declaration.prefixes.inner {
            return self.bind_outer(parent, &name, declaration.name.span);
        }
        let absent = match &declaration.condition {
            Some(condition) => !self.condition(condition, scope)?,
            None => false,
        };
        let inst = self.new_instance(name.clone(), Some(parent), declaration.name.span);
        self.fill(inst, parent, declaration);
        self.instances[inst].absent = absent;
        self.instances[parent].children.push(inst);
        self.instances[parent].by_name.insert(name, inst);
        if absent {
            return Ok(());
        }
        let type_of = self.type_of(type_scope, &declaration.class)?;
        let mut dims = self.sizes(&declaration.dims, scope, &mods, &declaration.name.name)?;
        match type_of {
            TypeOf::Scalar(scalar) => {
                self.instances[inst].dims = dims;
                self.make_variable(inst, scalar, &mods, declaration.prefixes.is_final);
                self.check_size(inst)
            }
            TypeOf::Class(local, shape) => {
                dims.extend(self.alias_sizes(&shape, scope)?);
                self.instances[inst].dims = dims;
                self.check_size(inst)?;
                self.make_component(inst, local, shape, mods, declaration)
            }
        }
    }

    fn fill(&mut self, inst: InstId, parent: InstId, declaration: &Component) {
        let (above, protected) = (self.instances[parent].variability, self.instances[parent].protected);
        let instance = &mut self.instances[inst];
        instance.variability = declaration.variability.min(above);
        instance.protected = declaration.prefixes.protected || protected;
        instance.flow = declaration.flow;
        instance.direction = declaration.direction;
        instance.inner = declaration.prefixes.inner;
        instance.description = declaration.description.clone();
    }

    fn bind_outer(&mut self, parent: InstId, name: &Name, span: Span) -> Result<(), Reported> {
        let mut current = self.instances[parent].parent;
        while let Some(above) = current {
            if let Some(&found) = self.instances[above].by_name.get(name)
                && self.instances[found].inner
            {
                self.instances[parent].by_name.insert(name.clone(), found);
                return Ok(());
            }
            current = self.instances[above].parent;
        }
        // The inner component may be declared further down in the text than its user.
        let mut current = self.instances[parent].parent;
        while let Some(above) = current {
            if let Some(k) = self.inner_element(above, name) {
                self.instantiate_element(above, k, &Vec::new())?;
                if let Some(&found) = self.instances[above].by_name.get(name) {
                    self.instances[parent].by_name.insert(name.clone(), found);
                    return Ok(());
                }
            }
            current = self.instances[above].parent;
        }
        let message = format!("no enclosing model declares `inner {name}`");
        self.table.report(Diagnostic::error(Code::UnknownName, message).at(span, "`outer` here"));
        Err(Reported)
    }

    fn inner_element(&self, inst: InstId, name: &Name) -> Option<usize> {
        let shape = self.instances[inst].shape.as_ref()?;
        let k = *shape.by_name.get(name)? as usize;
        let declaration = self.declared(shape, &shape.elements[k])?;
        declaration.prefixes.inner.then_some(k)
    }

    fn condition(&mut self, condition: &Expr, scope: Scope) -> Result<bool, Reported> {
        match self.evaluate(condition, scope, &Env::default())? {
            Value::Boolean(value) => Ok(value),
            other => {
                let message = format!("the condition of a component must be Boolean, not {}", other.type_name());
                self.table.report(Diagnostic::error(Code::TypeMismatch, message).at(condition.span, ""));
                Err(Reported)
            }
        }
    }

    fn type_of(&mut self, scope: Scope, path: &Path) -> Result<TypeOf, Reported> {
        if path.parts.len() == 1 && is_builtin(&path.parts[0].name) {
            let name = &path.parts[0].name;
            return Ok(TypeOf::Scalar(match name.as_ref() {
                "Real" => ScalarType::Real,
                "Integer" => ScalarType::Integer,
                "Boolean" => ScalarType::Boolean,
                "String" => ScalarType::Text,
                other => match predefined_enumeration(other) {
                    Some(enumeration) => ScalarType::Enumeration(enumeration),
                    None => ScalarType::Real,
                },
            }));
        }
        let local = self.find_class(scope, path)?;
        let shape = self.table.shape(local.class)?;
        Ok(TypeOf::Class(local, shape))
    }

    /// Evaluates declared sizes; `:` takes its size from the binding.
    fn sizes(&mut self, dims: &[Expr], scope: Scope, mods: &Mods, name: &str) -> Result<Vec<usize>, Reported> {
        let mut sizes = Vec::with_capacity(dims.len());
        for (k, dim) in dims.iter().enumerate() {
            sizes.push(self.size(dim, k, scope, mods, name)?);
        }
        Ok(sizes)
    }

    fn size(&mut self, dim: &Expr, k: usize, scope: Scope, mods: &Mods, name: &str) -> Result<usize, Reported> {
        if matches!(dim.kind, hyd_syntax::tree::ExprKind::Colon) {
            let Some(applied) = crate::modifier::binding(mods).cloned() else {
                let message = format!("`{name}` has size `:` and no value that gives it a size");
                self.table.report(Diagnostic::error(Code::ArrayShape, message).at(dim.span, ""));
                return Err(Reported);
            };
            let value = self.evaluate_applied(&applied)?;
            let skip: usize = applied.spread.iter().map(|&i| self.instances[i].dims.len()).sum();
            return value.shape().get(skip + k).copied().ok_or_else(|| {
                let message = format!("the value of `{name}` has too few dimensions");
                self.table.report(Diagnostic::error(Code::ArrayShape, message).at(dim.span, ""));
                Reported
            });
        }
        let value = self.evaluate(dim, scope, &Env::default())?;
        let size = match &value {
            Value::Integer(size) => Some(*size),
            Value::Enumeration(..) | Value::Boolean(_) | Value::Real(_) | Value::Text(_) | Value::Array(_) => None,
        };
        match size {
            Some(size) if size >= 0 && (size as usize) <= MAX_ELEMENTS => Ok(size as usize),
            Some(size) => {
                let limit =
                    if size < 0 { "negative".into() } else { format!("above the limit of {MAX_ELEMENTS} elements") };
                let message = format!("the size of `{name}` is {size}, which is {limit}");
                let code = if size < 0 { Code::ArrayShape } else { Code::Limit };
                self.table.report(Diagnostic::error(code, message).at(dim.span, ""));
                Err(Reported)
            }
            None => {
                let message = format!("the size of `{name}` must be an Integer, not {}", value.type_name());
                self.table.report(Diagnostic::error(Code::TypeMismatch, message).at(dim.span, ""));
                Err(Reported)
            }
        }
    }

    /// Sizes that a short class definition adds (`type Vector = Real[3]`).
    fn alias_sizes(&mut self, shape: &Rc<Shape>, scope: Scope) -> Result<Vec<usize>, Reported> {
        let mut sizes = Vec::new();
        for frame in &shape.frames {
            let def = self.table.class(frame.class).def.clone();
            if let ClassBody::Short { dims, .. } = &def.body {
                sizes.extend(self.sizes(dims, scope, &Vec::new(), &def.name.name)?);
            }
        }
        Ok(sizes)
    }

    fn check_size(&mut self, inst: InstId) -> Result<(), Reported> {
        let dims = crate::instance::full_dims(&self.instances, inst);
        let total = dims.iter().try_fold(1usize, |product, &d| product.checked_mul(d)).unwrap_or(usize::MAX);
        if total > MAX_ELEMENTS {
            let (name, span) = (self.instances[inst].name.clone(), self.instances[inst].span);
            let message = format!("`{name}` has more than {MAX_ELEMENTS} elements");
            self.table.report(Diagnostic::error(Code::Limit, message).at(span, ""));
            return Err(Reported);
        }
        Ok(())
    }

    /// A component of a class, or a variable of a `type` class.
    fn make_component(
        &mut self,
        inst: InstId,
        local: LocalClass,
        shape: Rc<Shape>,
        mut mods: Mods,
        declaration: &Component,
    ) -> Result<(), Reported> {
        mods.extend(local.mods.iter().cloned());
        let enumeration = self.enumeration(local.class);
        let scalar = match (&shape.builtin, enumeration) {
            (_, Some(enumeration)) => Some(ScalarType::Enumeration(enumeration)),
            (Some(name), None) => Some(match name.as_ref() {
                "Integer" => ScalarType::Integer,
                "Boolean" => ScalarType::Boolean,
                "String" => ScalarType::Text,
                _ => ScalarType::Real,
            }),
            (None, None) => None,
        };
        self.instances[inst].class = Some(local.class);
        let def = self.table.class(local.class).def.clone();
        if let Some(scalar) = scalar {
            let scope = self.package_instance(local.class)?;
            for frame in shape.frames.last().into_iter().flat_map(|f| &f.modifications) {
                mods.push(Applied {
                    tree: frame.1.clone(),
                    scope: Scope { inst: scope, frame: frame.0 },
                    spread: Vec::new(),
                });
            }
            if matches!(def.kind, ClassKind::Connector) {
                self.instances[inst].kind = ClassKind::Connector;
            }
            self.short_prefixes(inst, &shape);
            self.make_variable(inst, scalar, &mods, declaration.prefixes.is_final);
            return Ok(());
        }
        self.check_class(inst, local.class, declaration)?;
        self.instances[inst].kind = def.kind;
        self.instances[inst].shape = Some(shape);
        self.depth += 1;
        let result = self.instantiate_members(inst, &mods);
        self.depth -= 1;
        result
    }

    fn short_prefixes(&mut self, inst: InstId, shape: &Rc<Shape>) {
        for frame in &shape.frames {
            if let ClassBody::Short { direction: Some(direction), .. } = &self.table.class(frame.class).def.body {
                self.instances[inst].direction = Some(*direction);
            }
        }
    }

    fn check_class(&mut self, inst: InstId, class: ClassId, declaration: &Component) -> Result<(), Reported> {
        let def = self.table.class(class).def.clone();
        let span = declaration.class.span;
        let full = self.table.full_name(class);
        let fault = match def.kind {
            ClassKind::Package | ClassKind::Function => {
                Some((Code::Misplaced, format!("`{full}` is a {} and cannot be a component", kind_name(def.kind))))
            }
            ClassKind::Operator => Some((
                Code::OutsideProfile,
                format!("`{full}` is an operator class, which is outside the language profile"),
            )),
            _ if def.expandable => Some((
                Code::OutsideProfile,
                format!("`{full}` is an expandable connector, which is outside the language profile"),
            )),
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
                self.table.report(Diagnostic::error(Code::CircularClass, message).at(span, "the circle closes here"));
                return Err(Reported);
            }
            current = self.instances[above].parent;
        }
        if self.depth >= MAX_DEPTH {
            let message = format!("components are nested deeper than {MAX_DEPTH} levels");
            self.table.report(Diagnostic::error(Code::Limit, message).at(span, ""));
            return Err(Reported);
        }
        Ok(())
    }

    fn make_variable(&mut self, inst: InstId, scalar: ScalarType, mods: &Mods, is_final: bool) {
        const ATTRIBUTES: &[&str] =
            &["quantity", "unit", "displayUnit", "min", "max", "start", "fixed", "nominal", "unbounded", "stateSelect"];
        let array = (!self.instances[inst].dims.is_empty()).then_some(inst);
        let mut attributes: Vec<(Name, Applied)> = Vec::new();
        for applied in mods {
            for (name, tree) in &applied.tree.children {
                if !ATTRIBUTES.contains(&name.as_ref()) {
                    let message = format!(
                        "`{}` is a {} variable and has no attribute `{name}`",
                        self.instances[inst].name,
                        scalar.name()
                    );
                    let mut diagnostic = Diagnostic::error(Code::UnknownModifier, message);
                    if let Some(span) = tree.span {
                        diagnostic = diagnostic.at(span, "names nothing");
                    }
                    let help = did_you_mean(name, ATTRIBUTES.iter().copied());
                    self.table.report(diagnostic.maybe_help(help));
                    continue;
                }
                if attributes.iter().any(|(known, _)| known == name) {
                    continue;
                }
                let only = vec![applied.clone()];
                if let Some(found) = of_child(&only, name, array).into_iter().next() {
                    attributes.push((name.clone(), found));
                }
            }
        }
        let binding = crate::modifier::binding(mods).cloned();
        let is_final = is_final || binding.as_ref().is_some_and(|b| b.tree.is_final);
        if !matches!(scalar, ScalarType::Real) && self.instances[inst].variability == Variability::Continuous {
            self.instances[inst].variability = Variability::Discrete;
        }
        self.instances[inst].primitive = Some(Primitive { scalar, attributes, binding, is_final });
    }
}

/// The keyword of a class kind.
pub(crate) fn kind_name(kind: ClassKind) -> &'static str {
    match kind {
        ClassKind::Class => "class",
        ClassKind::Model => "model",
        ClassKind::Block => "block",
        ClassKind::Connector => "connector",
        ClassKind::Record => "record",
        ClassKind::Type => "type",
        ClassKind::Package => "package",
        ClassKind::Function => "function",
        ClassKind::Operator => "operator",
    }
}

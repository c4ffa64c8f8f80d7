//! Redeclarations of local classes: which class stands behind a name now, and whether it may.
//!
//! Only what is `replaceable` can be redeclared, the new class must be a subtype of the constraining one, and modifiers of
//! the constraining clause stay in force (Modelica 3.6, section 7.3).

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported};
use hyd_syntax::tree::{ClassBody, ClassKind, Component, Constraint, Element, NestedClass, Path};

use crate::classes::class::{ClassId, ClassTable, elements};
use crate::classes::heir::with_constraint;
use crate::classes::modifier::{Applied, AstMod, Mods, Redeclare, redeclaration};
use crate::classes::shape::{Shape, is_builtin};
use crate::instantiation::instance::{InstId, LocalClass, Scope};
use crate::instantiation::scopes::Scopes;

impl Scopes<'_> {
    /// Notes the class that a redeclaration puts in place of element `k`, a class.
    pub(crate) fn redeclare_class(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize, outer: &Mods) {
        let mods = self.mods_of(inst, shape, k, outer);
        let element = &shape.elements[k];
        let Some((position, applied)) = redeclaration(&mods).map(|(p, a)| (p, a.clone())) else {
            self.modify_class(inst, shape, k, mods);
            return;
        };
        let owner = shape.frames[element.frame as usize].class;
        let def = self.table.class(owner).def.clone();
        let Element::Class(original) = &elements(&def)[element.position as usize] else { return };
        let Some(Redeclare::Class(new)) = &applied.tree.redeclare else {
            let message = format!("`{}` is a class and is redeclared as a component", element.name);
            let span = applied.tree.span.unwrap_or(original.class.span);
            let declared = original.class.name.span;
            self.table
                .report(Diagnostic::error(Code::Redeclaration, message).at(span, "").with(declared, "declared here"));
            return;
        };
        if !original.prefixes.replaceable {
            self.table.not_replaceable(&element.name, applied.tree.span, original.class.name.span);
            return;
        }
        let earlier = mods[position + 1..].iter().find(|m| m.tree.redeclare.is_some() && m.tree.is_final);
        if original.prefixes.is_final || earlier.is_some() {
            let declared = earlier.and_then(|m| m.tree.span).or(Some(original.class.name.span));
            self.final_modified(&element.name, applied.tree.span, declared);
            return;
        }
        let own = Scope { inst, frame: element.frame };
        if let Ok(local) = self.class_of_redeclare(new, &applied, original, own) {
            let wanted = self.constraint_of(own, original);
            if let (Some(wanted), Some(span)) = (wanted, applied.tree.span) {
                let _ = self.table.check_offers(local.class, wanted, span);
            }
            self.instances.edit(inst).local_classes.insert(element.name.clone(), local);
        }
    }

    /// `Density(start = 10)`: a local class keeps its text and takes modifications, which all its components get.
    fn modify_class(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize, mut mods: Mods) {
        mods.retain(|applied| !applied.tree.children.is_empty());
        if mods.is_empty() {
            return;
        }
        let element = &shape.elements[k];
        self.adapt_local_class(inst, shape, k);
        let adapted = self.instances[inst].local_classes.get(&element.name).cloned();
        let by_text = |table: &mut ClassTable<'_>| table.member_class(shape.frames[0].class, &element.name);
        let Some(class) = adapted.as_ref().map(|local| local.class).or_else(|| by_text(&mut self.table)) else {
            return;
        };
        let kind = self.table.class(class).def.kind;
        if matches!(kind, ClassKind::Package | ClassKind::Function) {
            return;
        }
        match adapted {
            Some(adapted) => mods.extend(adapted.mods),
            None => mods.extend(self.kept_of_class(inst, shape, element, class)),
        }
        let package = self.instances[inst].kind == ClassKind::Package;
        let context = (!package).then_some(inst);
        self.instances.edit(inst).local_classes.insert(element.name.clone(), LocalClass { class, mods, context });
    }

    /// The class that a redeclaration of `original` must be a subtype of.
    fn constraint_of(&mut self, scope: Scope, original: &NestedClass) -> Option<ClassId> {
        if let Some(constraint) = &original.constrained_by {
            return self.class_quietly(scope, &constraint.base);
        }
        let shape = self.instances[scope.inst].shape.clone()?;
        self.table.child(shape.frames[scope.frame as usize].class, &original.class.name.name)
    }

    /// The new class of a component must be a subtype of what its declaration asks for.
    pub(crate) fn check_redeclared(
        &mut self,
        own: Scope,
        wanted: &Path,
        applied: &Applied,
        new: &Component,
    ) -> Result<(), Reported> {
        let builtin = |path: &Path| path.parts.len() == 1 && is_builtin(&path.parts[0].name);
        let span = applied.tree.span.unwrap_or(new.span);
        if builtin(wanted) != builtin(&new.class) || builtin(wanted) && wanted.parts[0].name != new.class.parts[0].name
        {
            let text = |path: &Path| path.parts.iter().map(|p| p.name.as_ref()).collect::<Vec<_>>().join(".");
            let (given, asked) = (text(&new.class), text(wanted));
            let kind = |scopes: &mut Self, scope: Scope, path: &Path| {
                let class = scopes.class_quietly(scope, path);
                class.and_then(|c| scopes.table.shape(c).ok()).and_then(|shape| shape.builtin.clone())
            };
            let of = |scopes: &mut Self, scope: Scope, path: &Path| match builtin(path) {
                true => Some(path.parts[0].name.clone()),
                false => kind(scopes, scope, path),
            };
            let (x, y) = (of(self, applied.scope, &new.class), of(self, own, wanted));
            if x == y {
                return Ok(());
            }
            let message = format!("`{}` is `{given}`, but `{asked}` is asked for", new.name.name);
            let diagnostic = Diagnostic::error(Code::Redeclaration, message).at(span, "redeclared here");
            self.table.report(diagnostic.with(wanted.span, "declared here"));
            return Err(Reported);
        }
        match (self.class_quietly(applied.scope, &new.class), self.class_quietly(own, wanted)) {
            (Some(new), Some(wanted)) => self.table.check_offers(new, wanted, span),
            _ => Ok(()),
        }
    }

    /// `redeclare model A = B(m)`: class B with modification m in the scope of the redeclaration, then the modification
    /// of the constraining clause.  Packages, functions and types become classes of their own, because their elements are
    /// used without an instance; so does a long class definition.
    fn class_of_redeclare(
        &mut self,
        new: &Arc<NestedClass>,
        applied: &Applied,
        original: &NestedClass,
        own: Scope,
    ) -> Result<LocalClass, Reported> {
        let scope = applied.scope;
        let shape = self.instances[scope.inst].shape.clone();
        let frames = shape.as_ref().map(|s| (s.frames[0].class, s.frames[scope.frame as usize].class));
        let ClassBody::Short { base, modification, dims, .. } = &new.class.body else {
            let class = self.add_local(new.class.clone(), frames);
            let package = self.instances[scope.inst].kind == ClassKind::Package;
            return Ok(LocalClass { class, mods: Mods::new(), context: (!package).then_some(scope.inst) });
        };
        let builtin = base.parts.len() == 1 && is_builtin(&base.parts[0].name);
        let found = if builtin { None } else { Some(self.find_class(scope, base)?) };
        let constrained = original.constrained_by.as_ref().filter(|c| !c.modification.arguments.is_empty());
        let bare = modification.arguments.is_empty() && constrained.is_none() && dims.is_empty();
        if let (true, Some(found)) = (bare, &found) {
            return Ok(found.clone());
        }
        let of_instances = found.as_ref().is_some_and(|found| {
            use ClassKind::{Block, Class, Connector, Model, Record};
            matches!(self.table.class(found.class).def.kind, Model | Block | Class | Connector | Record)
        });
        match found {
            Some(found) if of_instances => {
                let mut mods = vec![applied_of(AstMod::from_syntax(modification), scope)];
                mods.extend(found.mods);
                mods.extend(constrained.map(|c: &Constraint| applied_of(AstMod::from_syntax(&c.modification), own)));
                Ok(LocalClass { class: found.class, mods, context: found.context })
            }
            found => {
                let class = self.add_local(with_constraint(new, constrained), frames);
                self.table.class_mut(class).base = found.map(|found| found.class);
                let package = self.instances[scope.inst].kind == ClassKind::Package;
                Ok(LocalClass { class, mods: Mods::new(), context: (!package).then_some(scope.inst) })
            }
        }
    }

    /// A class written in a modification that stands in `text`, in an instance of class `members`.
    fn add_local(&mut self, def: Arc<hyd_syntax::tree::ClassDef>, frames: Option<(ClassId, ClassId)>) -> ClassId {
        let class = self.table.add(def, frames.map(|(members, _)| members), false);
        self.table.class_mut(class).written_in = frames.map(|(_, text)| text);
        class
    }
}

pub(crate) fn applied_of(tree: AstMod, scope: Scope) -> Applied {
    Applied::new(Arc::new(tree), scope)
}

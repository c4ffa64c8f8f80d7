//! Components made, and local classes redeclared, when they are first named, so that the order of declarations does not matter.
//!
//! A size or condition may name a component that stands further down in the text (Modelica 3.6, section 4.4.1: elements
//! have no order), and constants of a package are made one by one.  What is named while it is being made itself is a circle.

use std::rc::Rc;

use hyd_source::Reported;
use hyd_syntax::tree::{ClassKind, Name};

use crate::classes::class::ClassTable;
use crate::classes::modifier::{AstMod, Mods};
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, Scope};
use crate::instantiation::scopes::Scopes;

impl Scopes<'_> {
    /// A component of the scope's instance, visible from its frame; made now if its turn has not come yet.
    pub(crate) fn component_of(&mut self, scope: Scope, name: &Name) -> Result<Option<InstId>, Reported> {
        let instance = &self.instances[scope.inst];
        let Some(shape) = instance.shape.clone() else { return Ok(None) };
        if !shape.visible(name, scope.frame).is_some_and(|element| element.component) {
            return Ok(None);
        }
        if let Some(&made) = instance.by_name.get(name) {
            return Ok(Some(made));
        }
        let outer = match self.pending.get(&scope.inst) {
            Some(outer) => outer.clone(),
            None if instance.kind == ClassKind::Package => Mods::new(),
            None => return Ok(None),
        };
        if let Some(&k) = shape.by_name.get(name) {
            (self.make_element)(self, scope.inst, k as usize, &outer)?;
        }
        Ok(self.instances[scope.inst].by_name.get(name).copied())
    }

    /// Redeclares a local class of an instance before it is used, where its turn has not come yet.
    pub(crate) fn redeclare_when_named(&mut self, inst: InstId, shape: &Rc<Shape>, name: &Name) {
        if let Some(&k) = shape.by_name.get(name) {
            self.redeclare_in_time(inst, shape, k as usize);
            self.redeclare_for_function(inst, shape, k as usize);
            self.adapt_local_class(inst, shape, k as usize);
        }
    }

    /// Redeclares element `k` while the classes of an instance are redeclared, once for each: one may be redeclared by another that stands
    /// further down.
    pub(crate) fn redeclare_in_time(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize) {
        let Some((mods, done)) = self.redeclaring.get_mut(&inst) else { return };
        if std::mem::replace(&mut done[k], true) {
            return;
        }
        let mods = mods.clone();
        (self.redeclare)(self, inst, shape, k, &mods);
    }

    /// For a function that is a short definition in an instance: notes the class that its modification redeclares, which may be one that
    /// was redeclared for the instance.
    fn redeclare_for_function(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize) {
        let name = &shape.elements[k].name;
        let instance = &self.instances[inst];
        let is_function = |table: &ClassTable<'_>| table.class(shape.frames[0].class).def.kind == ClassKind::Function;
        if instance.context.is_none() || instance.local_classes.contains_key(name) || !is_function(&self.table) {
            return;
        }
        let said = &shape.frames[shape.elements[k].frame as usize].modifications;
        let redeclares = |tree: &AstMod| tree.children.iter().any(|(n, child)| n == name && child.redeclare.is_some());
        let outside =
            said.iter().any(|(frame, tree)| redeclares(tree) && self.scope_of_modifier(inst, *frame).inst != inst);
        if outside {
            (self.redeclare)(self, inst, shape, k, &Mods::new());
        }
    }
}

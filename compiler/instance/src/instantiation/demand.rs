//! Components made, and local classes redeclared, when they are first named, so that the order of declarations does not matter.
//!
//! A size or condition may name a component that stands further down in the text (Modelica 3.6, section 4.4.1: elements
//! have no order), and constants of a package are made one by one.  What is named while it is being made itself is a circle.

use std::rc::Rc;

use hyd_source::Reported;
use hyd_syntax::tree::{Argument, ClassBody, ClassKind, Element, Name};

use crate::classes::class::{ClassTable, elements};
use crate::classes::modifier::{AstMod, Mods};
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, LocalClass, Scope};
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
            self.rename_for_instance(inst, shape, k as usize);
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

    /// `package N = M` or `package N = P(redeclare package Q = M)` in an instance for which `M` was redeclared: notes the package that is meant
    /// there, while the classes of the instance are redeclared.
    pub(crate) fn rename_for_instance(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize) {
        let element = &shape.elements[k];
        let instance = &self.instances[inst];
        let is_done = !self.redeclaring.contains_key(&inst);
        if is_done || instance.kind == ClassKind::Package || instance.local_classes.contains_key(&element.name) {
            return;
        }
        let owner = self.table.class(shape.frames[element.frame as usize].class).def.clone();
        let Element::Class(nested) = &elements(&owner)[element.position as usize] else { return };
        let ClassBody::Short { base, modification, .. } = &nested.class.body else { return };
        if nested.class.kind != ClassKind::Package || base.global || base.parts[0].name == element.name {
            return;
        }
        let redeclared = modification.arguments.iter().filter_map(|argument| match argument {
            Argument::RedeclareClass { class, .. } => match &class.class.body {
                ClassBody::Short { base, .. } if !base.global => Some(&base.parts[0]),
                _ => None,
            },
            _ => None,
        });
        // Definitions that go in circles have no shape.
        let Some(class) = self.table.member_class(shape.frames[0].class, &element.name) else { return };
        if self.table.shape(class).is_err() {
            return;
        }
        let scope = Scope { inst, frame: element.frame };
        let mut around = Vec::new();
        for named in redeclared.filter(|named| named.name != element.name) {
            if self.is_redeclared_around(scope, &named.name)
                && let Some(meant) = self.first_class(scope, &named.name)
            {
                around.push((named.name.clone(), meant.class));
            }
        }
        if around.is_empty() && !self.is_redeclared_around(scope, &base.parts[0].name) {
            return;
        }
        let Ok(meant) = self.quietly(|scopes| scopes.find_class(scope, base)) else { return };
        let frames = (shape.frames[0].class, shape.frames[element.frame as usize].class);
        let renamed = self.table.add(nested.class.clone(), Some(frames.0), false);
        let added = self.table.class_mut(renamed);
        (added.written_in, added.base, added.around) = (Some(frames.1), Some(meant.class), around);
        let local = LocalClass { class: renamed, mods: Mods::new(), context: Some(inst) };
        self.instances.edit(inst).local_classes.insert(element.name.clone(), local);
    }

    /// True if a class that is visible in the instance of a scope, or in one around it, is another one there than by the text alone.
    fn is_redeclared_around(&mut self, scope: Scope, name: &Name) -> bool {
        let mut at = Some(scope);
        while let Some(scope) = at {
            let Some(shape) = self.instances[scope.inst].shape.clone() else { return false };
            if shape.visible(name, scope.frame).is_some_and(|element| !element.component) {
                self.redeclare_when_named(scope.inst, &shape, name);
                return self.instances[scope.inst].local_classes.contains_key(name);
            }
            let around = self.scope_around(scope.inst, &shape, scope.frame).ok().flatten();
            at = around.filter(|around| self.instances[around.inst].kind != ClassKind::Package);
        }
        false
    }
}

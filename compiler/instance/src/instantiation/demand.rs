//! Components made when they are first named, so that the order of declarations does not matter.
//!
//! A size or condition may name a component that stands further down in the text (Modelica 3.6, section 4.4.1: elements
//! have no order), and constants of a package are made one by one.  What is named while it is being made itself is a circle.

use hyd_source::Reported;
use hyd_syntax::tree::{ClassKind, Name};

use crate::classes::modifier::Mods;
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
}

//! Components made when they are first named, so that the order of declarations does not matter.
//!
//! A size or condition may name a component that stands further down in the text (Modelica 3.6, section 4.4.1: elements
//! have no order), and constants of a package are made one by one.  What is named while it is being made itself is a circle.

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{ClassKind, Name};

use crate::build::InstanceTree;
use crate::instance::{InstId, Known, Scope, path};
use crate::modifier::Mods;

impl InstanceTree<'_> {
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
            self.instantiate_element(scope.inst, k as usize, &outer)?;
        }
        Ok(self.instances[scope.inst].by_name.get(name).copied())
    }

    /// Puts the components of an instance back into the order of the text.
    pub(crate) fn order_children(&mut self, inst: InstId) {
        let Some(shape) = self.instances[inst].shape.clone() else { return };
        let mut children = std::mem::take(&mut self.instances[inst].children);
        children.sort_by_key(|&child| shape.by_name.get(self.declared_name(child)).copied());
        self.instances[inst].children = children;
    }

    /// Notes that a component could not be made, so that its uses give no further messages.
    pub(crate) fn broken(&mut self, parent: InstId, name: &Name, span: Span) {
        let inst = match self.instances[parent].by_name.get(name) {
            Some(&made) => made,
            None => {
                let made = self.new_instance(name.clone(), Some(parent), span);
                self.instances[parent].by_name.insert(name.clone(), made);
                made
            }
        };
        self.instances[inst].known = Known::Failed;
    }

    /// True if a message has been given for the component or one it is in.
    pub fn is_broken(&self, inst: InstId) -> bool {
        let instance = &self.instances[inst];
        instance.primitive.is_none() && instance.known == Known::Failed
    }

    /// A component whose sizes are asked for must be known by now.
    pub(crate) fn want_made(&mut self, inst: InstId, span: Span) -> Result<(), Reported> {
        let instance = &self.instances[inst];
        if instance.primitive.is_some() || instance.shape.is_some() || instance.absent {
            return Ok(());
        }
        if instance.known != Known::Failed {
            let (name, declared) = (path(&self.instances, inst), instance.span);
            let message = format!("the size of `{name}` depends on itself");
            self.table.report(
                Diagnostic::error(Code::CircularParameters, message)
                    .at(span, "the circle closes here")
                    .with(declared, "declared here"),
            );
        }
        Err(Reported)
    }
}

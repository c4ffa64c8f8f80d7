//! The ends of the model itself: public inputs and outputs of the class that is translated.
//!
//! Nothing outside gives such an input a value, so it becomes a parameter with its start value: blocks run by themselves, their
//! inputs can be set and varied, and a linear model has its inputs and outputs (Modelica 3.6, section 4.4.2.2 for the prefixes).
//! A model with physical connectors on its outside is a component that needs a model around it (`component_balance`), so its inputs
//! stay open too.

use hyd_instance::InstId;
use hyd_syntax::tree::{ClassKind, Direction, Variability};

use crate::flatten::Flattener;

impl Flattener<'_, '_> {
    /// Makes the inputs of the model parameters, before variables are made.
    pub(crate) fn settle_inputs_of_the_model(&mut self) {
        let instances = &self.tree.instances;
        let mut children = instances[self.tree.root].children.iter().map(|&c| &instances[c]);
        self.is_component =
            children.any(|c| c.kind == ClassKind::Connector && c.direction.is_none() && !c.protected && !c.absent);
        for child in self.tree.instances[self.tree.root].children.clone() {
            if self.is_input_of_the_model(child) {
                let instance = &mut self.tree.instances[child];
                instance.variability = instance.variability.min(Variability::Parameter);
            }
        }
    }

    /// Which variables are inputs and outputs of the model itself.
    pub(crate) fn note_ends(&mut self) {
        let children = self.tree.instances[self.tree.root].children.iter().copied();
        let of = |direction: Direction| {
            let instances = &self.tree.instances;
            let ends =
                children.clone().filter(|&c| instances[c].direction == Some(direction) && !instances[c].protected);
            ends.filter_map(|c| self.blocks.get(&c).copied()).collect()
        };
        (self.model.inputs, self.model.outputs) = (of(Direction::Input), of(Direction::Output));
    }

    /// Whether it is a public input of the model itself without a value of its own.
    pub(crate) fn is_input_of_the_model(&self, inst: InstId) -> bool {
        let instance = &self.tree.instances[inst];
        let open = instance.primitive.as_ref().is_some_and(|primitive| primitive.binding.is_none());
        let input = instance.direction == Some(Direction::Input) && !instance.protected && !instance.absent;
        open && input && instance.parent == Some(self.tree.root) && !self.is_component
    }
}

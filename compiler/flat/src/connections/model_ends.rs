//! The ends of the model itself: public inputs and outputs of the class that is translated.
//!
//! Nothing outside gives such an input a value, so it becomes a parameter with its start value: blocks run by themselves, their
//! inputs can be set and varied, and a linear model has its inputs and outputs (Modelica 3.6, section 4.4.2.2 for the prefixes).
//! A model with physical connectors on its outside is a component that needs a model around it (`component_balance`), so its inputs
//! stay open too.  An input that is to follow recorded samples stays a variable, `u = recorded(u)`; who runs the model hands over the samples.

use hyd_instance::{InstId, ScalarType};
use hyd_syntax::tree::{ClassKind, Direction, Variability};

use crate::model::{DrivenBlock, Section, VarId};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, CounterId, Kind, SlotKey};

/// Stands for the names of all inputs of the model itself that can follow samples, see [`crate::flatten`].
pub const EVERY_INPUT: &str = "*";

impl Flattener<'_, '_> {
    /// Makes the inputs of the model parameters, before variables are made.
    pub(crate) fn settle_inputs_of_the_model(&mut self) {
        let instances = &self.scopes.instances;
        let mut children = instances[self.tree.root].children.iter().map(|&c| &instances[c]);
        self.is_component =
            children.any(|c| c.kind == ClassKind::Connector && c.direction.is_none() && !c.protected && !c.absent);
        for child in self.scopes.instances[self.tree.root].children.clone() {
            if self.is_input_of_the_model(child) {
                if self.is_to_be_driven(child) {
                    self.driven_instances.push(child);
                    continue;
                }
                let variability = self.scopes.instances[child].variability.min(Variability::Parameter);
                self.scopes.found.variability.insert(child, variability);
            }
        }
    }

    /// Whether it is a continuous input of type Real of which at least one element is to follow recorded samples.
    fn is_to_be_driven(&self, inst: InstId) -> bool {
        let instance = &self.scopes.instances[inst];
        let is_real = instance.primitive.as_ref().is_some_and(|primitive| primitive.scalar == ScalarType::Real);
        let bare = |name: &String| name.split('[').next().is_some_and(|bare| bare == &*instance.name);
        let named = |name: &String| name == EVERY_INPUT || bare(name);
        is_real && instance.variability == Variability::Continuous && self.driven.iter().any(named)
    }

    /// The equations of inputs that follow recorded samples.
    pub(crate) fn drive_inputs(&mut self) {
        for inst in self.driven_instances.clone() {
            let Some(&block) = self.blocks.get(&inst) else { continue };
            let block = &self.model.variables[block];
            let (variable, count, origin) = (block.first, block.count, block.origin.clone());
            if count == 0 {
                continue;
            }
            let first = self.model.driven_inputs();
            self.model.driven.push(DrivenBlock { first, count, variable });
            self.begin_slots();
            let mut slot = |kind: Kind, first: VarId| {
                let slot = self.slots.slot(SlotKey::Variable(kind, first, Affine::counter(CounterId(0))));
                self.model.templates.arena.slot(slot)
            };
            let (input, recorded) = (slot(Kind::Var, variable), slot(Kind::Input, VarId(first)));
            self.emit(Section::Continuous, input, recorded, &[count as usize], &origin);
        }
    }

    /// Which variables are inputs and outputs of the model itself.
    pub(crate) fn note_ends(&mut self) {
        let children = self.scopes.instances[self.tree.root].children.iter().copied();
        let of = |direction: Direction| {
            let instances = &self.scopes.instances;
            let ends =
                children.clone().filter(|&c| instances[c].direction == Some(direction) && !instances[c].protected);
            ends.filter_map(|c| self.blocks.get(&c).copied()).collect()
        };
        (self.model.inputs, self.model.outputs) = (of(Direction::Input), of(Direction::Output));
    }

    /// Whether it is a public input of the model itself without a value of its own.
    pub(crate) fn is_input_of_the_model(&self, inst: InstId) -> bool {
        let instance = &self.scopes.instances[inst];
        let open = instance.primitive.as_ref().is_some_and(|primitive| primitive.binding.is_none());
        let input = instance.direction == Some(Direction::Input) && !instance.protected && !instance.absent;
        open && input && instance.parent == Some(self.tree.root) && !self.is_component
    }
}

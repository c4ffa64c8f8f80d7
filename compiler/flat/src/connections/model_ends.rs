//! The ends of the model itself: public inputs and outputs of the class that is translated, those in its connectors among them.
//!
//! Nothing outside gives such an input a value, so it becomes a parameter with its start value: blocks run by themselves, their
//! inputs can be set and varied, and a linear model has its inputs and outputs (Modelica 3.6, section 4.4.2.2 for the prefixes).
//! A model with physical connectors on its outside is a component that needs a model around it (`component_balance`), so its inputs
//! stay open too.  An input that is to follow recorded samples stays a variable, `u = recorded(u)`; who runs the model hands over the samples.
//! One that is not of type Real is found from a number in the same way, at events: who hands over another number causes one.

use hyd_instance::{InstId, ScalarType};
use hyd_symbolic::{Function, Relation};
use hyd_syntax::tree::{ClassKind, Direction, Variability};
use hyd_system::ValueKind;

use crate::model::{DrivenBlock, Section, VarId};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, CounterId, Kind, SlotKey};

impl Flattener<'_, '_> {
    /// Makes the inputs of the model parameters, before variables are made.
    pub(crate) fn settle_inputs_of_the_model(&mut self) {
        let children = self.scopes.instances[self.tree.root].children.clone();
        self.is_component = children.iter().any(|&child| self.is_physical(child));
        for child in self.ends() {
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

    /// Whether it is a connector of the model itself that is more than a group of inputs and outputs.
    pub(crate) fn is_physical(&self, inst: InstId) -> bool {
        let instance = &self.scopes.instances[inst];
        let is_connector = instance.kind == ClassKind::Connector && !instance.protected && !instance.absent;
        is_connector && instance.direction.is_none() && !self.is_directed(inst)
    }

    /// Whether all that varies in a connector, and is something at all, is input or output.
    fn is_directed(&self, inst: InstId) -> bool {
        let instance = &self.scopes.instances[inst];
        if instance.absent || instance.variability <= Variability::Parameter {
            return true;
        }
        if instance.primitive.is_some() {
            return self.direction_of(inst).is_some();
        }
        let is_group = instance.kind == ClassKind::Connector && !instance.children.is_empty() && !instance.expandable;
        is_group && instance.children.iter().all(|&child| self.is_directed(child))
    }

    /// The variables that can be ends of the model: its own, and those in its connectors.
    fn ends(&self) -> Vec<InstId> {
        let mut found = Vec::new();
        let mut open = self.scopes.instances[self.tree.root].children.clone();
        open.reverse();
        while let Some(inst) = open.pop() {
            let instance = &self.scopes.instances[inst];
            if instance.kind == ClassKind::Connector && instance.primitive.is_none() {
                open.extend(instance.children.iter().rev());
            } else {
                found.push(inst);
            }
        }
        found
    }

    /// Whether it stands in the model itself or in one of its connectors.
    fn is_outside(&self, inst: InstId) -> bool {
        let instances = &self.scopes.instances;
        let mut at = instances[inst].parent;
        while let Some(above) = at.filter(|&above| instances[above].kind == ClassKind::Connector) {
            at = instances[above].parent;
        }
        at == Some(self.tree.root)
    }

    /// Whether at least one element of an input is to be given from outside: those of type Real by their names, all others only with every
    /// input, because samples between which a number goes on mean nothing for them.
    fn is_to_be_driven(&self, inst: InstId) -> bool {
        let instance = &self.scopes.instances[inst];
        let Some(primitive) = &instance.primitive else { return false };
        let every = self.is_for_other_tools();
        match primitive.scalar {
            ScalarType::Real => {
                let parts = self.name_pattern(inst).parts.into_iter();
                let path = parts.map(|(text, _)| text.to_string()).collect::<String>();
                let is_named = || self.driven.iter().any(|name| bare_name(name) == path);
                instance.variability == Variability::Continuous && (every || is_named())
            }
            ScalarType::Integer | ScalarType::Boolean | ScalarType::Enumeration(_) => {
                every && instance.variability >= Variability::Discrete
            }
            ScalarType::Text | ScalarType::Object | ScalarType::Clock => false,
        }
    }

    /// The equations of inputs that follow recorded samples.
    pub(crate) fn drive_inputs(&mut self) {
        for inst in self.driven_instances.clone() {
            let Some(&block) = self.blocks.get(&inst) else { continue };
            let block = &self.model.variables[block];
            let (variable, count, origin) = (block.first, block.count, block.origin.clone());
            let kind = block.kind.clone();
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
            let arena = &mut self.model.templates.arena;
            let (section, value) = match kind {
                ValueKind::Real => (Section::Continuous, recorded),
                ValueKind::Boolean => {
                    let half = arena.constant(0.5);
                    (Section::Discrete, arena.compare(Relation::GreaterEqual, recorded, half))
                }
                ValueKind::Integer | ValueKind::Enumeration(_) => {
                    let half = arena.constant(0.5);
                    let above = arena.add(recorded, half);
                    (Section::Discrete, arena.call1(Function::Floor, above))
                }
            };
            self.emit(section, input, value, &[count as usize], &origin);
        }
    }

    /// Which variables are inputs and outputs of the model itself.
    pub(crate) fn note_ends(&mut self) {
        let of = |direction: Direction| {
            let public = |&end: &InstId| !self.scopes.instances[end].protected;
            let ends = self.ends().into_iter().filter(public).filter(|&end| self.direction_of(end) == Some(direction));
            ends.filter_map(|end| self.blocks.get(&end).copied()).collect()
        };
        (self.model.inputs, self.model.outputs) = (of(Direction::Input), of(Direction::Output));
    }

    /// Whether it is a public input of the model itself without a value of its own.
    pub(crate) fn is_input_of_the_model(&self, inst: InstId) -> bool {
        let instance = &self.scopes.instances[inst];
        let open = instance.primitive.as_ref().is_some_and(|primitive| primitive.binding.is_none());
        let input = self.direction_of(inst) == Some(Direction::Input) && !instance.protected && !instance.absent;
        open && input && self.is_outside(inst) && !self.is_component
    }
}

/// A name without its subscripts.
fn bare_name(name: &str) -> String {
    let mut bare = String::new();
    let mut depth = 0;
    for letter in name.chars() {
        match letter {
            '[' => depth += 1,
            ']' => depth -= 1,
            _ if depth == 0 => bare.push(letter),
            _ => {}
        }
    }
    bare
}

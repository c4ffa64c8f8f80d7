//! Blocks that are units of other tools: classes with `annotation(__hyd(unit(file = "X.fmu")))`, whose variables say by
//! `annotation(__hyd(variable = "name"))` which variable of the unit they are.
//!
//! What the unit computes is given from outside while the model runs, as recorded inputs are, so such a variable gets the equation
//! `y = recorded(y)`; its inputs and parameters are variables of the model like any other.  The unit itself is neither opened nor run
//! here: whoever runs the model reads [`crate::FlatModel::foreign`] and joins both.

use std::sync::Arc;

use hyd_instance::connection_rules::VENDOR;
use hyd_instance::modifier::AstMod;
use hyd_instance::{Env, InstId, ScalarType, Scope, Value};
use hyd_source::{Code, Span};
use hyd_syntax::tree::{Direction, Element, Variability};

use crate::model::ForeignBlock;
use crate::state::flattener::Flattener;

/// The entry of a class that is a unit, and that of its file.
const UNIT: (&str, &str) = ("unit", "file");
/// The entry of a variable of a unit.
const VARIABLE: &str = "variable";

/// What a variable of the text is for the unit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Input,
    Output,
    Parameter,
}

/// A unit whose variables have no blocks yet.
pub(crate) struct Found {
    block: ForeignBlock,
    members: Vec<(InstId, Role, String)>,
}

impl Flattener<'_, '_> {
    /// Looks for units among the instances; what they compute is to be driven.
    pub(crate) fn settle_foreign_blocks(&mut self) {
        let all: Vec<InstId> = self.tree.components.indices().collect();
        let mut units: Vec<(InstId, Found)> = Vec::new();
        for inst in all.iter().copied() {
            if let Some(block) = self.foreign_block(inst) {
                units.push((inst, Found { block, members: Vec::new() }));
            }
        }
        if units.is_empty() {
            return;
        }
        for inst in all {
            let Some((name, span)) = self.foreign_name(inst) else { continue };
            let above = std::iter::successors(Some(inst), |&inst| self.scopes.instances[inst].parent);
            let owner = above.skip(1).find_map(|above| units.iter().position(|(unit, _)| *unit == above));
            let Some(owner) = owner else { continue };
            let Some(role) = self.role_of(inst, span) else { continue };
            if role == Role::Output {
                self.driven_instances.push(inst);
            }
            units[owner].1.members.push((inst, role, name));
        }
        self.foreign = units.into_iter().map(|(_, found)| found).collect();
    }

    /// The unit that an instance is by its class or one that it inherits from.
    fn foreign_block(&mut self, inst: InstId) -> Option<ForeignBlock> {
        let instance = &self.scopes.instances[inst];
        if instance.absent {
            return None;
        }
        let shape = instance.shape.clone()?;
        let noted = (0..shape.frames.len() as u32).find_map(|frame| {
            let annotation = shape.def(&self.scopes.table, frame).annotation.as_ref()?;
            let tree = AstMod::from_syntax(annotation);
            let unit = entry(entry(&tree, VENDOR)?, UNIT.0)?;
            Some((frame, entry(unit, UNIT.1)?.binding.clone()?))
        });
        let (frame, file) = noted?;
        let written_in = self.scopes.table.files.name(shape.def(&self.scopes.table, frame).name.span.file).clone();
        let mut around = std::iter::successors(Some(inst), |&inst| self.scopes.instances[inst].parent);
        if around.any(|inst| !self.scopes.instances[inst].dims.is_empty()) {
            self.error(Code::OutsideProfile, file.span, "a unit of another tool cannot be in an array of components");
            return None;
        }
        let value = self.scopes.evaluate(&file, Scope { inst, frame }, &Env::default()).ok()?;
        let Value::Text(name) = value else {
            self.error(Code::TypeMismatch, file.span, "the file of a unit is a string that is known at translation");
            return None;
        };
        let path = self.path(inst);
        let (inputs, outputs, parameters, declared) = Default::default();
        Some(ForeignBlock { path, file: name, written_in, span: file.span, inputs, outputs, parameters, declared })
    }

    /// The variable of a unit that an instance says it is.
    fn foreign_name(&self, inst: InstId) -> Option<(String, Span)> {
        let instance = &self.scopes.instances[inst];
        instance.primitive.as_ref().filter(|_| !instance.absent)?;
        let shape = self.scopes.instances[instance.parent?].shape.clone()?;
        let element = &shape.elements[*shape.by_name.get(self.scopes.declared_name(inst))? as usize];
        let def = shape.def(&self.scopes.table, element.frame);
        let Some(Element::Component(component)) = hyd_instance::class::elements(def).get(element.position as usize)
        else {
            return None;
        };
        let tree = AstMod::from_syntax(component.annotation.as_ref()?);
        let value = entry(entry(&tree, VENDOR)?, VARIABLE)?.binding.clone()?;
        value.text().map(|name| (name.to_string(), value.span))
    }

    /// True for a variable whose value stands in its own declaration: no modification has set it.
    fn has_its_declared_value(&self, inst: InstId) -> bool {
        let instance = &self.scopes.instances[inst];
        let Some(parent) = instance.parent else { return false };
        let binding = instance.primitive.as_ref().and_then(|primitive| primitive.binding.as_ref());
        let shape = self.scopes.instances[parent].shape.as_ref();
        let frame = shape.and_then(|shape| {
            let position = *shape.by_name.get(self.scopes.declared_name(inst))?;
            Some(shape.elements[position as usize].frame)
        });
        binding.is_some_and(|own| own.scope.inst == parent && Some(own.scope.frame) == frame)
    }

    /// What a variable is for its unit; none after a message.
    fn role_of(&mut self, inst: InstId, span: Span) -> Option<Role> {
        let instance = &self.scopes.instances[inst];
        let scalar = instance.primitive.as_ref().map(|primitive| primitive.scalar.clone());
        if instance.variability <= Variability::Parameter && scalar != Some(ScalarType::Text) {
            return Some(if instance.direction == Some(Direction::Input) { Role::Input } else { Role::Parameter });
        }
        if scalar != Some(ScalarType::Real) || instance.variability != Variability::Continuous {
            let message = "what a unit shares with a model are numbers: parameters, and during a run continuous variables of type Real";
            self.error(Code::OutsideProfile, span, message);
            return None;
        }
        if instance.direction == Some(Direction::Input) {
            return Some(Role::Input);
        }
        let is_given = instance.primitive.as_ref().is_some_and(|primitive| primitive.binding.is_some());
        // A variable with a value of its own is what the unit is given.
        Some(if is_given { Role::Input } else { Role::Output })
    }

    /// The names of the variables of units, once they are declared.
    pub(crate) fn note_foreign_blocks(&mut self) {
        for Found { mut block, members } in std::mem::take(&mut self.foreign) {
            for (inst, role, name) in members {
                let Some(&variable) = self.blocks.get(&inst) else { continue };
                let is_declared = role == Role::Parameter && self.has_its_declared_value(inst);
                let variable = &self.model.variables[variable];
                let list = match role {
                    Role::Input => &mut block.inputs,
                    Role::Output => &mut block.outputs,
                    Role::Parameter => &mut block.parameters,
                };
                let sizes: Vec<u32> = variable.name.parts.last().map(|(_, sizes)| sizes.clone()).unwrap_or_default();
                let own = hyd_system::NamePattern { parts: vec![(name.as_str().into(), sizes)], derivative: false };
                let names = || (0..variable.count as usize).map(|k| variable.name.element(k));
                list.extend(names().enumerate().map(|(k, name)| (name, own.element(k))));
                if is_declared {
                    block.declared.extend(names());
                }
            }
            self.model.foreign.push(block);
        }
    }
}

/// The entry of a modification with this name.
fn entry<'a>(tree: &'a AstMod, name: &str) -> Option<&'a Arc<AstMod>> {
    tree.children.iter().find(|(own, _)| own.as_ref() == name).map(|(_, entry)| entry)
}

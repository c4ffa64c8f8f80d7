//! Which component is at fault where the numbers of equations and unknowns differ.
//!
//! A component must bring as many equations as it has variables of its own plus flows in its connectors plus outputs; the
//! potentials, the inputs and the other equations of its connectors come from outside (Modelica 3.6, section 4.7).  What its own
//! `connect` equations determine counts as brought.  Only counted, nothing is matched: a component that is balanced by number
//! may still be singular.  Discrete variables are not looked at.

use std::sync::Arc;

use hyd_instance::InstId;
use hyd_symbolic::Node;
use hyd_syntax::tree::{ClassKind, Direction};
use hyd_system::Variability;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::model::{BlockId, Imbalance, Section, Target, VariableBlock};
use crate::state::flattener::Flattener;
use crate::state::made::Made;

/// What is needed and given, by component.
type Tally = FxHashMap<InstId, (i64, i64)>;

/// Where a variable counts.
struct Place {
    /// The component it is part of, connectors and records left out.
    owner: InstId,
    /// The connector of the owner that holds it.
    connector: Option<InstId>,
    flow: bool,
    direction: Option<Direction>,
}

impl Flattener<'_, '_> {
    /// Finds the components at fault and the inputs left open; `bindings` equations of declarations stand first, those of
    /// connections behind the `sections`.
    pub(crate) fn balance_components(&mut self, bindings: usize, sections: usize) {
        let continuous = |v: &&crate::model::VariableBlock| v.variability == Variability::Continuous;
        let unknowns: u64 = self.model.variables.raw.iter().filter(continuous).map(|v| u64::from(v.count)).sum();
        let equations = self.model.count(Section::Continuous) as u64;
        let ends = self.ends_of_the_model();
        if unknowns == equations && ends.is_empty() {
            return;
        }
        let mut tally = Tally::default();
        let inputs = self.count_variables(&mut tally);
        self.count_equations((bindings, sections), &inputs, &mut tally);
        let mut faults: Vec<(InstId, (i64, i64))> =
            tally.into_iter().filter(|(_, (needed, given))| needed != given).collect();
        if faults.is_empty() {
            self.model.open_ends = ends;
        }
        if unknowns == equations {
            return;
        }
        faults.retain(|(_, (needed, given))| (needed > given) == (unknowns > equations));
        faults.sort_unstable();
        for (inst, (needed, given)) in faults {
            let instances = &self.scopes.instances;
            let copies = hyd_instance::instance::full_dims(instances, inst).iter().product::<usize>().max(1) as i64;
            let Some(class) = instances[inst].class else { continue };
            let class = self.scopes.table.class(class).def.name.clone();
            let (needed, given) = ((needed / copies) as usize, (given / copies) as usize);
            let component = self.path(inst);
            self.model.imbalances.push(Imbalance {
                component,
                class: class.name.clone(),
                declared: class.span,
                needed,
                given,
            });
        }
    }

    /// Public connectors and inputs of the model itself, which only a model around it could connect.
    fn ends_of_the_model(&self) -> Vec<Arc<str>> {
        let instances = &self.scopes.instances;
        let children = instances[self.tree.root].children.iter().map(|&id| (id, &instances[id]));
        let open = children.filter(|&(id, c)| {
            let given = c.primitive.as_ref().is_some_and(|p| p.binding.is_some());
            let input = c.direction == Some(Direction::Input) && self.is_component;
            !c.protected && !c.absent && !given && (self.is_physical(id) || input)
        });
        open.map(|(_, c)| c.name.clone()).collect()
    }

    /// Counts what is needed; the inputs that count outside.
    fn count_variables(&mut self, tally: &mut Tally) -> FxHashSet<BlockId> {
        let root = self.tree.root;
        let variables: Vec<_> = self.blocks.iter().map(|(&inst, &block)| (block, inst)).collect();
        let mut open = Vec::new();
        let mut inputs = FxHashSet::default();
        for (block, inst) in variables {
            let count = i64::from(self.model.variables[block].count);
            if self.model.variables[block].variability != Variability::Continuous {
                continue;
            }
            let place = self.place_of(inst);
            let parent = self.component_above(place.owner);
            if place.direction == Some(Direction::Input) && place.owner != root {
                inputs.insert(block);
            }
            match (place.connector, place.direction) {
                (_, Some(Direction::Input)) if place.owner == root || self.is_bound(inst) => {}
                (_, Some(Direction::Input)) => {
                    let left = count - self.connected(place.connector.unwrap_or(inst), inst, 0, count);
                    if left > 0 {
                        open.push(block);
                        tally.entry(parent).or_default().0 += left;
                    }
                }
                (None, _) => tally.entry(place.owner).or_default().0 += count,
                (Some(connector), Some(Direction::Output)) => {
                    tally.entry(place.owner).or_default().0 += count - self.connected(connector, inst, 1, count);
                }
                (Some(connector), None) if place.flow => {
                    tally.entry(place.owner).or_default().0 += count - self.connected(connector, inst, 1, count);
                }
                (Some(_), None) => {}
            }
        }
        open.sort_unstable();
        self.model.open_inputs = open;
        // What flows in is determined by connections, like potentials.
        let is_counted = |made| made != Made::InStream;
        let is_made = |v: &&VariableBlock| v.made.is_some_and(is_counted) && v.variability == Variability::Continuous;
        let own = self.model.variables.raw.iter().filter(is_made);
        let made: Vec<(Arc<str>, i64)> = own.map(|v| (v.origin.path.clone(), i64::from(v.count))).collect();
        let paths = self.components_by_path();
        for (path, count) in made {
            // Each has an equation of its own, and the user wrote neither.
            tally.entry(paths.get(&path).copied().unwrap_or(root)).or_default().1 -= count;
        }
        inputs
    }

    fn count_equations(
        &mut self,
        (bindings, sections): (usize, usize),
        inputs: &FxHashSet<BlockId>,
        tally: &mut Tally,
    ) {
        let paths = self.components_by_path();
        for (k, block) in self.model.equations[..sections].iter().enumerate() {
            if block.section != Section::Continuous
                || k < bindings && self.determined(k).is_some_and(|block| inputs.contains(&block))
            {
                continue;
            }
            let Some(&inst) = paths.get(&block.origin.path) else { continue };
            tally.entry(inst).or_default().1 += i64::from(block.count);
        }
    }

    /// The variable that a binding determines.
    fn determined(&self, equation: usize) -> Option<BlockId> {
        let block = &self.model.equations[equation];
        let template = self.model.templates.get(block.template);
        let Node::Slot(slot) = self.model.templates.arena.node(template.left) else { return None };
        let Target::Var(v) = block.operands_of(0, template.arity as usize)[slot.0 as usize].target() else {
            return None;
        };
        Some(self.model.locate(v).0)
    }

    fn place_of(&self, variable: InstId) -> Place {
        let instances = &self.scopes.instances;
        let own = &instances[variable];
        let is_connector = own.kind == ClassKind::Connector;
        let mut place = Place {
            owner: self.tree.root,
            connector: is_connector.then_some(variable),
            flow: own.flow || own.stream,
            direction: own.direction,
        };
        let mut above = own.parent;
        while let Some(inst) = above {
            let instance = &instances[inst];
            match instance.kind {
                ClassKind::Connector => place.connector = Some(inst),
                ClassKind::Record | ClassKind::Type => {}
                _ => {
                    place.owner = inst;
                    break;
                }
            }
            place.flow |= instance.flow;
            place.direction = place.direction.or(instance.direction);
            above = instance.parent;
        }
        place
    }

    /// The component around a component.
    fn component_above(&self, inst: InstId) -> InstId {
        self.scopes.instances[inst].parent.unwrap_or(self.tree.root)
    }

    fn is_bound(&self, variable: InstId) -> bool {
        self.scopes.instances[variable].primitive.as_ref().is_some_and(|p| p.binding.is_some())
    }

    /// How many elements of a variable are connected at a face of the connector that holds it, or of one inside that.
    fn connected(&mut self, connector: InstId, variable: InstId, face: u32, count: i64) -> i64 {
        let mut most = 0;
        let mut at = Some(variable);
        while let Some(inst) = at {
            if let Some((joined, all)) = self.connections.joined(inst, face) {
                most = most.max(if all == 0 { 0 } else { count * joined / all });
            }
            at = if inst == connector { None } else { self.scopes.instances[inst].parent };
        }
        most
    }

    fn components_by_path(&mut self) -> FxHashMap<Arc<str>, InstId> {
        let mut paths = FxHashMap::default();
        for inst in self.tree.components.indices() {
            let path = self.path(inst);
            let mut owner = inst;
            while matches!(
                self.scopes.instances[owner].kind,
                ClassKind::Connector | ClassKind::Record | ClassKind::Type
            ) {
                let Some(parent) = self.scopes.instances[owner].parent else { break };
                owner = parent;
            }
            paths.insert(path, owner);
        }
        paths
    }
}

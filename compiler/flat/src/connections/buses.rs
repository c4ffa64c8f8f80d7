//! Elements of expandable connectors that nothing but buses is connected to (Modelica 3.6, section 9.1.3).
//!
//! A bus may declare more than is connected to it.  Such an element is not part of the model; it stays where buses of several components are
//! joined, and is given the value 0, of which nothing that is connected hears.

use hyd_instance::InstId;
use hyd_symbolic::SlotId;
use hyd_syntax::tree::ClassKind;
use hyd_system::{ValueKind, Variability};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::connections::connect_sets::{Joints, Leaf};
use crate::model::{Operand, Section, Target, VarId};
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// A value for each set of connected elements of buses that nothing else is connected to.
    pub(crate) fn idle_buses(&mut self, sets: &[Vec<Leaf>], joints: &mut Joints) {
        let elements = self.elements_of_buses();
        if elements.is_empty() {
            return;
        }
        let mut parent: FxHashMap<VarId, VarId> = FxHashMap::default();
        let mut used: FxHashSet<VarId> = FxHashSet::default();
        for set in sets {
            for leaf in set {
                if !elements.contains_key(&leaf.variable) {
                    used.insert(leaf.variable);
                }
                let (a, b) = (root(&parent, set[0].variable), root(&parent, leaf.variable));
                if a != b {
                    parent.insert(b.max(a), a.min(b));
                }
            }
        }
        let used: FxHashSet<VarId> = used.into_iter().map(|v| root(&parent, v)).collect();
        let mut all: Vec<(VarId, InstId)> = elements.into_iter().collect();
        all.sort_unstable();
        for (v, inst) in all {
            if root(&parent, v) != v || used.contains(&v) {
                continue;
            }
            let arena = &mut self.model.templates.arena;
            let (slot, zero) = (arena.slot(SlotId(0)), arena.constant(0.0));
            let (block, _) = self.model.locate(v);
            let real = matches!(self.model.variables[block].kind, ValueKind::Real);
            let section = if real { Section::Continuous } else { Section::Discrete };
            let span = self.scopes.instances[inst].span;
            self.add_connection((section, false), (slot, zero), &[Operand::new(Target::Var(v))], span, joints);
        }
    }

    /// The scalars of variables of expandable connectors that no declaration binds.
    fn elements_of_buses(&self) -> FxHashMap<VarId, InstId> {
        let mut found = FxHashMap::default();
        for (&inst, &block) in &self.blocks {
            let variable = &self.model.variables[block];
            let bound =
                self.scopes.instances[inst].primitive.as_ref().is_some_and(|primitive| primitive.binding.is_some());
            if variable.variability > Variability::Parameter && !bound && self.is_part_of_bus(inst) {
                found.extend((0..variable.count).map(|k| (VarId(variable.first.0 + k), inst)));
            }
        }
        found
    }

    fn is_part_of_bus(&self, inst: InstId) -> bool {
        let mut at = inst;
        while let Some(above) = self.scopes.instances[at].parent {
            let instance = &self.scopes.instances[above];
            if instance.kind != ClassKind::Connector && instance.kind != ClassKind::Record {
                return false;
            }
            if instance.expandable {
                return true;
            }
            at = above;
        }
        false
    }
}

fn root(parent: &FxHashMap<VarId, VarId>, mut v: VarId) -> VarId {
    while let Some(&up) = parent.get(&v) {
        v = up;
    }
    v
}

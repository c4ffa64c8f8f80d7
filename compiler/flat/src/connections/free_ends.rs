//! Ends of rigid parts that stay open on purpose: the free end of a shaft, the last wagon of a train, the tip of an arm.
//!
//! Where the potential of an open end follows from that of another end of the same component alone, and that one is connected, both move
//! together, and nothing has to be connected to the open one.  It may lack a connection all the same where there is another open
//! end of its kind in a part of the model that nothing joins with this one: then both are reported.

use hyd_instance::InstId;
use hyd_syntax::tree::{ClassKind, Name};
use hyd_system::Variability;
use rustc_hash::FxHashMap;

use crate::connections::open_ends::OpenEnd;
use crate::model::{Section, Target, VarId};
use crate::state::flattener::Flattener;

/// Sets of things that belong together.
pub(super) struct Sets<K>(FxHashMap<K, K>);

impl<K: Copy + Eq + std::hash::Hash> Sets<K> {
    pub(super) fn find(&mut self, mut k: K) -> K {
        while let Some(&up) = self.0.get(&k).filter(|&&up| up != k) {
            k = up;
        }
        k
    }

    fn join(&mut self, a: K, b: K) {
        let (a, b) = (self.find(a), self.find(b));
        if a != b {
            self.0.insert(a, b);
        }
    }
}

impl Flattener<'_, '_> {
    /// Open ends without those that are free.
    pub(super) fn without_free_ends(&mut self, ends: Vec<OpenEnd>) -> Vec<OpenEnd> {
        if ends.is_empty() {
            return ends;
        }
        let mut ties = self.tied_variables();
        let mut rigid: Vec<bool> = Vec::with_capacity(ends.len());
        for end in &ends {
            rigid.push(end.open.len() == 1 && self.is_rigid(end, &mut ties));
        }
        if !rigid.contains(&true) {
            return ends;
        }
        let mut networks = self.networks();
        let kinds: Vec<Vec<(Name, bool)>> = ends.iter().map(|end| self.kind_of(end.connector)).collect();
        let parts: Vec<InstId> = ends.iter().map(|end| networks.find(end.owner)).collect();
        let stays = |k: usize| {
            let lacks = |other: usize| kinds[other] == kinds[k] && parts[other] != parts[k];
            !rigid[k] || (0..parts.len()).any(lacks)
        };
        let kept: Vec<bool> = (0..ends.len()).map(stays).collect();
        ends.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(end, _)| end).collect()
    }

    /// Variables of which one follows from the other alone.
    fn tied_variables(&self) -> Sets<VarId> {
        let mut ties = Sets(FxHashMap::default());
        let plain = |own: &&crate::model::EquationBlock| matches!(own.section, Section::Continuous | Section::Binding);
        for block in self.model.equations.iter().filter(plain) {
            let arity = self.model.templates.get(block.template).arity as usize;
            for k in 0..block.count as usize {
                let (mut first, mut second, mut others) = (None, None, false);
                for operand in block.operands_of(k, arity) {
                    match operand.target() {
                        Target::Var(v) if self.variable_of(v).variability <= Variability::Parameter => {}
                        Target::Var(v) if first.is_none() || first == Some(v) => first = Some(v),
                        Target::Var(v) if second.is_none() || second == Some(v) => second = Some(v),
                        Target::Const(_) => {}
                        _ => others = true,
                    }
                }
                if let (Some(a), Some(b), false) = (first, second, others) {
                    ties.join(a, b);
                }
            }
        }
        ties
    }

    /// Whether an open end moves with another end of its component, which is connected.
    fn is_rigid(&mut self, end: &OpenEnd, ties: &mut Sets<VarId>) -> bool {
        let kind = self.kind_of(end.connector);
        let siblings: Vec<InstId> = self.scopes.instances[end.owner]
            .children
            .iter()
            .copied()
            .filter(|&other| other != end.connector && self.scopes.instances[other].kind == ClassKind::Connector)
            .filter(|&other| self.kind_of(other) == kind)
            .filter(|&other| {
                let own = self.connections.range(other);
                own.is_some_and(|mut own| own.len() == 1 && own.all(|element| !self.connections.is_open(element)))
            })
            .collect();
        let Some(potential) = self.potential_of(end.connector) else { return false };
        let potential = ties.find(potential);
        siblings.into_iter().any(|other| {
            self.potential_of(other).is_some_and(|own| ties.find(own) == potential)
                || self.graph.relates(&self.scopes.instances, end.connector, other)
        })
    }

    /// The first potential of a connector.
    fn potential_of(&self, connector: InstId) -> Option<VarId> {
        let leaves = self.leaves(connector);
        let own = leaves.iter().find(|leaf| !leaf.flow && !leaf.stream)?;
        self.blocks.get(&own.inst).map(|&block| self.variable(block).first)
    }

    fn kind_of(&self, connector: InstId) -> Vec<(Name, bool)> {
        self.leaves(connector).into_iter().map(|leaf| (leaf.path, leaf.flow)).collect()
    }

    /// Components that connections join, also by way of others.
    pub(super) fn networks(&mut self) -> Sets<InstId> {
        let mut owner = vec![None; self.connections.elements as usize];
        for (inst, elements) in self.connections.ranges() {
            let own = self.scopes.instances[inst].parent;
            elements.for_each(|element| owner[element as usize] = own);
        }
        let mut networks = Sets(FxHashMap::default());
        let (starts, faces) = self.connections.sets();
        for set in starts.windows(2) {
            let mut owners =
                faces[set[0] as usize..set[1] as usize].iter().filter_map(|face| owner[*face as usize / 2]);
            if let Some(first) = owners.next() {
                owners.for_each(|other| networks.join(first, other));
            }
        }
        networks
    }
}

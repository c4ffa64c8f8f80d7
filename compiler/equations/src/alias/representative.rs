//! Which variable of a class of equal ones is kept, and what it inherits.
//!
//! Kept is a state before an algebraic variable, the wish of `stateSelect`, a fixed start before a free one, any start
//! before none, a declared variable before one of the translation, the shorter instance path, the earlier declaration.
//! The kept variable takes over start value, `fixed` and `nominal` from those that go, with the sign (Modelica 3.6,
//! section 8.6, leaves the choice among several non-fixed starts to the tool).

use hyd_flat::{FlatModel, PerElement, Section, StateSelect, Target, VarId};
use hyd_index::IndexVec;

use crate::alias::classes::Classes;
use crate::system::{EqId, EquationSystem, Resolution};

/// Smaller is kept: no state, `stateSelect` from always to never, no fixed start, no start, internal, path depth.
type Rank = (bool, u8, bool, bool, bool, u32, VarId);

/// Enters the aliases into the table, moves attributes, and returns the `Start` equations that no longer count.
pub(crate) fn choose_representatives(system: &mut EquationSystem, classes: &mut Classes) -> Vec<EqId> {
    let ranking = Ranking::new(system);
    let mut best: IndexVec<VarId, Option<Rank>> = IndexVec::filled(None, system.roles.len());
    let mut class_start: IndexVec<VarId, Option<(bool, Rank)>> = IndexVec::filled(None, system.roles.len());
    for v in system.roles.indices().filter(|&v| system.is_own(v)) {
        let (root, _) = classes.find(v);
        let rank = ranking.rank(system, v);
        best[root] = Some(best[root].map_or(rank, |other| other.min(rank)));
        if ranking.start[v].is_some() {
            let start = (!ranking.fixed(system, v), rank);
            class_start[root] = Some(class_start[root].map_or(start, |other| other.min(start)));
        }
    }
    let mut moves = Vec::new();
    for v in system.roles.indices().filter(|&v| system.is_own(v)) {
        let (root, negated) = classes.find(v);
        let kept = best[root].map_or(v, |rank| rank.6);
        if kept != v {
            moves.push((v, kept, negated ^ classes.find(kept).1));
        }
    }
    for &(v, kept, negated) in &moves {
        system.resolution[v] = Resolution::Alias { of: kept, negated };
        system.roles[v] = system.roles[kept];
        if ranking.fixed(system, v) && !ranking.fixed(system, kept) {
            system.fixed_by_others.push(kept);
        }
        inherit(&mut system.flat, &ranking, v, kept);
    }
    let keeps_start = |classes: &mut Classes, v: VarId| {
        let (root, _) = classes.find(v);
        class_start[root].is_none_or(|(_, rank)| rank.6 == v)
    };
    let starts = ranking.start.iter_enumerated().filter_map(|(v, eq)| eq.map(|eq| (v, eq)));
    starts
        .filter(|&(v, _)| matches!(system.resolution[v], Resolution::Value(_)) || !keeps_start(classes, v))
        .map(|(_, eq)| eq)
        .collect()
}

struct Ranking {
    /// Block of each variable.
    block: IndexVec<VarId, u32>,
    /// Path depth of each block.
    depth: Vec<u32>,
    /// The `Start` equation of each variable.
    start: IndexVec<VarId, Option<EqId>>,
}

impl Ranking {
    fn new(system: &EquationSystem) -> Self {
        let flat = &system.flat;
        let mut start = IndexVec::filled(None, system.roles.len());
        for eq in system.equations_in(Section::Start) {
            if let Some(Target::Start(v)) = system.left_operand(eq).map(|operand| operand.target()) {
                start[v] = Some(eq);
            }
        }
        let dots = |text: &str| text.bytes().filter(|&b| b == b'.').count() as u32;
        let depth = flat.variables.iter().map(|b| b.name.parts.iter().map(|(text, _)| dots(text)).sum()).collect();
        Self { block: block_of_variable(flat), depth, start }
    }

    fn element(&self, flat: &FlatModel, v: VarId) -> (usize, usize) {
        let block = self.block[v] as usize;
        (block, (v.0 - flat.variables.raw[block].first.0) as usize)
    }

    fn fixed(&self, system: &EquationSystem, v: VarId) -> bool {
        let (block, k) = self.element(&system.flat, v);
        system.flat.variables.raw[block].fixed.get(k)
    }

    fn rank(&self, system: &EquationSystem, v: VarId) -> Rank {
        let block = &system.flat.variables.raw[self.block[v] as usize];
        let select = StateSelect::Always as u8 - block.state_select_of(v) as u8;
        let (state, start) = (system.roles[v].may_be_state(), self.start[v].is_some());
        (!state, select, !self.fixed(system, v), !start, block.made.is_some(), self.depth[self.block[v] as usize], v)
    }
}

/// The flat model of a system with starts fixed where its text says so, and not where a variable took that over from one that it equals: aliases
/// that are chosen anew would take what was inherited for what was written.
pub(crate) fn fixed_as_written(system: &EquationSystem) -> FlatModel {
    let mut flat = system.flat.clone();
    for &v in &system.fixed_by_others {
        let (block, k) = flat.locate(v);
        let block = &mut flat.variables[block];
        let count = block.count as usize;
        set_element(&mut block.fixed, k, count, false);
    }
    flat
}

/// The block of each scalar variable.
pub(crate) fn block_of_variable(flat: &FlatModel) -> IndexVec<VarId, u32> {
    let mut table = IndexVec::filled(0, flat.scalars as usize);
    for (number, block) in flat.variables.iter().enumerate() {
        for k in 0..block.count {
            table[VarId(block.first.0 + k)] = number as u32;
        }
    }
    table
}

fn inherit(flat: &mut FlatModel, ranking: &Ranking, from: VarId, to: VarId) {
    let ((source, i), (block, k)) = (ranking.element(flat, from), ranking.element(flat, to));
    let (fixed, nominal) = (flat.variables.raw[source].fixed.get(i), flat.variables.raw[source].nominal.get(i));
    let has_start = flat.variables.raw[source].has_start;
    let target = &mut flat.variables.raw[block];
    let count = target.count as usize;
    if fixed && !target.fixed.get(k) {
        set_element(&mut target.fixed, k, count, true);
    }
    if nominal.is_some() && target.nominal.get(k).is_none() {
        set_element(&mut target.nominal, k, count, nominal);
    }
    target.has_start |= has_start;
}

fn set_element<T: Clone>(attribute: &mut PerElement<T>, k: usize, count: usize, value: T) {
    match attribute {
        PerElement::Each(values) => values[k] = value,
        PerElement::All(_) if count == 1 => *attribute = PerElement::All(value),
        PerElement::All(all) => {
            let mut values = vec![all.clone(); count];
            values[k] = value;
            *attribute = PerElement::Each(values);
        }
    }
}

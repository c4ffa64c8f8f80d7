//! Discrete variables that the initial system determines.
//!
//! Discrete variables start at their start values, unless there are more initial conditions than continuous unknowns: then those
//! that are not fixed are unknowns too (Modelica 3.6, section 8.6: `pre(v)` of a variable that is not fixed is an unknown of
//! the initial system).  Such a variable keeps its value until a `when` sets it, so at the start it and its `pre` are one value.
//! An integer or a Boolean cannot be iterated on: it is an unknown only where an initial equation says what it is.  Where another equation gives
//! the variable at the start, its `pre` is a value of its own (`plan/discrete.rs`).

use hyd_flat::{Operand, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::Node;
use hyd_system::ValueKind;

use crate::alias::representative::block_of_variable;
use crate::explain::faults::is_condition;
use crate::incidence::Unknowns;
use crate::initial::redundant::Conditions;
use crate::system::{EqId, EquationSystem, Role};

/// Makes unknowns of the discrete variables in these equations that are not fixed; true if there are any.
pub(crate) fn open_discrete(system: &mut EquationSystem, unknowns: &mut Unknowns, conditions: &Conditions) -> bool {
    let keeps = keep_their_values(system);
    let blocks = block_of_variable(&system.flat);
    let mut said: IndexVec<VarId, bool> = IndexVec::filled(false, system.roles.len());
    for &eq in &conditions.initial {
        if let Some(Target::Var(v) | Target::Pre(v)) = system.left_operand(eq).map(|operand| operand.target()) {
            said[v] = true;
        }
    }
    let is_open = |system: &EquationSystem, v: VarId| {
        let block = &system.flat.variables.raw[blocks[v] as usize];
        let fixed = block.fixed.get((v.0 - block.first.0) as usize);
        keeps[v] && system.roles[v] == Role::Discrete && (block.kind == ValueKind::Real || said[v]) && !fixed
    };
    let mut open = IndexVec::filled(false, system.roles.len());
    for &eq in conditions.initial.iter().chain(&conditions.model) {
        for operand in system.operands_of(system.equations[eq].operands) {
            if let Target::Var(v) | Target::Pre(v) = operand.target() {
                open[v] |= is_open(system, v);
            }
        }
    }
    // Where both are told apart, or the simulation reads the value before, it stays known.
    for &eq in &conditions.initial {
        for v in twice(system, eq) {
            open[v] = false;
        }
    }
    for &eq in &conditions.model {
        for operand in system.operands_of(system.equations[eq].operands) {
            if let Target::Pre(v) = operand.target() {
                open[v] = false;
            }
        }
    }
    for &eq in &conditions.initial {
        read_value(system, eq, &open);
    }
    let found = open.iter_enumerated().filter(|(_, open)| **open);
    found.map(|(v, _)| unknowns.add(Target::Var(v))).count() > 0
}

/// Variables that keep what they were before unless something happens: those that a `when` sets, and those with an equation like it
/// (`if ... else pre(v)`).
pub(crate) fn keep_their_values(system: &EquationSystem) -> IndexVec<VarId, bool> {
    let mut keeps = IndexVec::filled(false, system.roles.len());
    let arena = &system.flat.templates.arena;
    for eq in system.equations_in(Section::Discrete) {
        let Some(Target::Var(v)) = system.left_operand(eq).map(|operand| operand.target()) else { continue };
        let operands = system.operands_of(system.equations[eq].operands);
        let is_of_when = |operand: &Operand| matches!(operand.target(), Target::Var(v) if is_condition(system, v));
        let mut last = system.flat.templates.get(system.equations[eq].template).right;
        while let Node::If(_, _, otherwise) = arena.node(last) {
            last = otherwise;
        }
        let is_kept = matches!(arena.node(last), Node::Slot(slot) if operands[slot.index()].target() == Target::Pre(v));
        let reads = operands.iter().any(|operand| operand.target() == Target::Pre(v));
        keeps[v] |= is_kept || reads && operands.iter().any(is_of_when);
    }
    keeps
}

/// Variables that an equation reads both now and before.
fn twice(system: &EquationSystem, eq: EqId) -> Vec<VarId> {
    let operands = system.operands_of(system.equations[eq].operands);
    let before = operands.iter().filter_map(|operand| match operand.target() {
        Target::Pre(v) => Some(v),
        _ => None,
    });
    before.filter(|&v| operands.iter().any(|operand| operand.target() == Target::Var(v))).collect()
}

/// Lets an initial equation read the value where it reads the value before.
fn read_value(system: &mut EquationSystem, eq: EqId, open: &IndexVec<VarId, bool>) {
    let range = system.equations[eq].operands;
    for operand in &mut system.operands[range.first as usize..(range.first + range.len) as usize] {
        if let Target::Pre(v) = operand.target()
            && open[v]
        {
            *operand = Operand::new(Target::Var(v)).signed(operand.negated());
        }
    }
}

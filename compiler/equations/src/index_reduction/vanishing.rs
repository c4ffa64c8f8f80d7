//! Parameters whose value 0 takes an unknown out of an equation that has to determine it.
//!
//! `R*i = u1 - u2` determines the current, unless `R` is 0: then it says that two voltages are equal, which index reduction can
//! deal with, as long as it is reported.  Where the equations match fewer unknowns without the terms that vanish, those parameters
//! are taken as 0 for good at translation.  A parameter whose 0 changes nothing of that kind remains data.

use hyd_flat::{Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_structure::{Entry, Incidence, decompose, maximum_matching};
use hyd_symbolic::{Node, NodeId, SlotId, partial, slots};
use hyd_system::Settable;

use crate::algebra::{Algebra, Known, is_clocked};
use crate::alias::representative::block_of_variable;
use crate::balance::{simulation_equations, simulation_unknowns};
use crate::incidence::{Pattern, pattern};
use crate::plan::bindings::sort_bindings;
use crate::start_point::StartPoint;
use crate::system::{EqId, EquationSystem, Resolution, Role};

/// The parameters at fault; none if there are none, or if the system is wrong otherwise.
pub(crate) fn vanishing_parameters(system: &mut EquationSystem) -> Vec<VarId> {
    let zero = zero_parameters(system);
    let reads_zero = |system: &EquationSystem, eq: EqId| {
        let operands = system.operands_of(system.equations[eq].operands);
        operands.iter().any(|operand| matches!(operand.target(), Target::Var(v) if zero[v]))
    };
    let rows = simulation_equations(system);
    if !rows.iter().any(|&eq| reads_zero(system, eq)) {
        return Vec::new();
    }
    let mut algebra = Algebra::default();
    let unknowns = simulation_unknowns(system);
    let all = pattern(system, &mut algebra, rows, &unknowns);
    let Ok(bindings) = sort_bindings(system, &mut algebra) else { return Vec::new() };
    let values = StartPoint::of_parameters(system, &bindings.assignments);
    let known = Known::parameters(system);
    let mut dropped: Vec<(Entry, Vec<VarId>)> = Vec::new();
    for row in all.incidence.rows() {
        let eq = all.rows[row.index()];
        if !reads_zero(system, eq) {
            continue;
        }
        for entry in all.incidence.entry_range(row).map(Entry::new) {
            let vanishes = zero_slope(system, &mut algebra, (&known, &values), eq, all.slots[entry]);
            dropped.extend(vanishes.map(|slope| (entry, read_zeros(system, eq, slope, &zero))));
        }
    }
    at_fault(&all, &dropped)
}

/// The zeros behind the entries without which fewer unknowns are matched.
fn at_fault(all: &Pattern, dropped: &[(Entry, Vec<VarId>)]) -> Vec<VarId> {
    if dropped.is_empty() {
        return Vec::new();
    }
    let mut kept = Incidence::new(all.incidence.column_count());
    for row in all.incidence.rows() {
        let stays = |entry: &Entry| dropped.binary_search_by_key(entry, |(entry, _)| *entry).is_err();
        let entries = all.incidence.entries(row).filter(|(entry, _)| stays(entry));
        let pushed = kept.push_row(entries.map(|(_, column)| column));
        pushed.expect("invariant: a part of a row that is sorted");
    }
    let (whole, part) = (maximum_matching(&all.incidence, None), maximum_matching(&kept, None));
    if part.unmatched_rows().count() <= whole.unmatched_rows().count() {
        return Vec::new();
    }
    let over = decompose(&kept, &part).map(|parts| parts.over.rows).unwrap_or_default();
    let inside = |entry: &Entry| over.iter().any(|&row| all.incidence.entry_range(row).contains(&entry.index()));
    let mut found: Vec<VarId> =
        dropped.iter().filter(|(entry, _)| inside(entry)).flat_map(|(_, zeros)| zeros.iter().copied()).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Parameters that a number binds and that are 0, as declared or as set for this translation.
fn zero_parameters(system: &EquationSystem) -> IndexVec<VarId, bool> {
    let blocks = block_of_variable(&system.flat);
    let mut zero = IndexVec::filled(false, system.roles.len());
    for eq in system.equations_in(Section::Binding) {
        let Some(Target::Var(v)) = system.left_operand(eq).map(|operand| operand.target()) else { continue };
        let block = &system.flat.variables.raw[blocks[v] as usize];
        let fixed = block.fixed.get((v.0 - block.first.0) as usize);
        if system.roles[v] != Role::Parameter || block.settable != Settable::Yes || !fixed {
            continue;
        }
        let given = system.flat.given.iter().find(|(set, _)| *set == v).map(|(_, value)| *value);
        zero[v] = given.or_else(|| bound_number(system, eq)) == Some(0.0);
    }
    zero
}

/// The number that a binding gives.
fn bound_number(system: &EquationSystem, eq: EqId) -> Option<f64> {
    let equation = system.equations[eq];
    let (arena, template) = (&system.flat.templates.arena, system.flat.templates.get(equation.template));
    match arena.node(template.right) {
        Node::Slot(slot) => match system.operands_of(equation.operands)[slot.index()].target() {
            Target::Const(c) => Some(system.flat.constants[c]),
            _ => None,
        },
        _ => arena.as_constant(template.right),
    }
}

/// The slope of an equation in a slot, if only parameters decide it and it is 0.
fn zero_slope(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    (known, values): (&Known, &StartPoint),
    eq: EqId,
    slot: SlotId,
) -> Option<NodeId> {
    let equation = system.equations[eq];
    let residual = algebra.facts(&mut system.flat.templates, equation.template).residual;
    let slope = partial(&mut system.flat.templates.arena, residual, slot);
    let operands = system.operands_of(equation.operands);
    let reads = slots(&system.flat.templates.arena, &[slope]);
    let fixed =
        !is_clocked(&system.flat.templates, slope) && reads.iter().all(|slot| known.is_known(operands[slot.index()]));
    (fixed && values.evaluate(system, slope, equation.operands) == 0.0).then_some(slope)
}

fn read_zeros(system: &EquationSystem, eq: EqId, slope: NodeId, zero: &IndexVec<VarId, bool>) -> Vec<VarId> {
    let operands = system.operands_of(system.equations[eq].operands);
    let read = slots(&system.flat.templates.arena, &[slope]).into_iter();
    let read = read.filter_map(|slot| match operands[slot.index()].target() {
        Target::Var(v) if zero[v] => Some(v),
        _ => None,
    });
    read.collect()
}

/// Takes parameters as 0 for good; aliases have to be eliminated once more.
pub(crate) fn fix_at_zero(system: &mut EquationSystem, parameters: &[VarId]) {
    let blocks = block_of_variable(&system.flat);
    let zero = system.flat.constants.push(0.0);
    for &v in parameters {
        system.resolution[v] = Resolution::Value(zero);
        system.roles[v] = Role::Constant;
        system.flat.variables.raw[blocks[v] as usize].settable = Settable::Structural;
        system.reduction.fixed_at_zero.push(v);
    }
}

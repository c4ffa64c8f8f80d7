//! Relations that read discrete variables of the same event without having a part in them.
//!
//! `fire = armed and time >= begin + wait`, where `armed` sets `begin`, means what `begin` is in the same pass (Modelica 3.6, section 8.6: all
//! equations of an event hold together).  A relation that has a part in what it reads, as that of `when time >= next then next = ...`,
//! keeps its value within the pass instead.

use hyd_equations::{Assignment, Role, SortedSystem};
use hyd_flat::{Target, VarId};
use rustc_hash::FxHashSet;

/// Their numbers.
pub(super) fn late_relations(sorted: &SortedSystem) -> Vec<u32> {
    let system = &sorted.system;
    let is_discrete = |v: VarId| system.roles[v] == Role::Discrete;
    let mut late = Vec::new();
    for (k, relation) in (0u32..).zip(&sorted.relations) {
        let operands = system.operands_of(relation.operands);
        let varies = |target: Target| match target {
            Target::Var(v) => system.roles[v].is_continuous(),
            Target::Pre(v) => !is_discrete(v),
            Target::Const(_) => false,
            _ => true,
        };
        if operands.iter().any(|operand| varies(operand.target())) {
            continue;
        }
        let reads: Vec<VarId> = operands
            .iter()
            .filter_map(|operand| match operand.target() {
                Target::Var(v) if is_discrete(v) => Some(v),
                _ => None,
            })
            .collect();
        if !reads.is_empty() && !has_a_part_in(sorted, k, &reads) {
            late.push(k);
        }
    }
    late
}

/// True if one of these discrete variables may follow from a relation within one pass.
fn has_a_part_in(sorted: &SortedSystem, relation: u32, reads: &[VarId]) -> bool {
    let system = &sorted.system;
    let mut moved: FxHashSet<VarId> = FxHashSet::default();
    // What is assigned continuously may depend on all that the relation and the moved variables decide.
    let mut continuous = false;
    loop {
        let mut changed = false;
        let is_moved = |a: &Assignment, moved: &FxHashSet<VarId>, continuous: bool| {
            system.operands_of(a.operands).iter().any(|operand| match operand.target() {
                Target::Held(k) => k == relation,
                Target::Var(v) if system.roles[v] == Role::Discrete => moved.contains(&v) && a.target != Target::Var(v),
                Target::Var(v) => continuous && system.roles[v].is_continuous(),
                Target::Der(_) => continuous,
                _ => false,
            })
        };
        if !continuous {
            let equations = system.equations_in(hyd_flat::Section::Continuous);
            continuous = equations.iter().any(|&eq| {
                system.operands_of(system.equations[eq].operands).iter().any(|operand| match operand.target() {
                    Target::Held(k) => k == relation,
                    Target::Var(v) => moved.contains(&v),
                    _ => false,
                })
            });
            changed |= continuous;
        }
        for a in &sorted.discrete {
            let Target::Var(v) = a.target else { continue };
            if !moved.contains(&v) && is_moved(a, &moved, continuous) {
                moved.insert(v);
                changed = true;
            }
        }
        if reads.iter().any(|v| moved.contains(v)) {
            return true;
        }
        if !changed {
            return false;
        }
    }
}

//! Whether the equations of a block are linear in the unknowns of the block.
//!
//! A block is linear if no slope of its equations with respect to one of its unknowns contains another; conditions and
//! coefficients may change during the run.  For explanations and printed stages; solving makes no difference.

use hyd_flat::Target;
use hyd_index::TypedIndex;
use hyd_symbolic::{contains_slot, partial};

use crate::sorted::{Block, Plan};
use crate::system::{EquationSystem, OperandRange};

/// True if no equation of the block multiplies or otherwise bends the block's own unknowns.
pub(crate) fn is_linear(system: &EquationSystem, plan: &Plan, block: Block<'_>) -> bool {
    let own: Vec<Target> = block_targets(plan, block).collect();
    let mut arena = system.flat.templates.arena.clone();
    let expressions = block.assignments.iter().map(|&a| {
        let a = &plan.assignments[a as usize];
        (a.value, a.operands)
    });
    let rows = block.residuals.iter().map(|&r| {
        let r = &plan.residuals[r as usize];
        (r.value, r.operands)
    });
    expressions.chain(rows).all(|(value, operands): (_, OperandRange)| {
        let operands = system.operands_of(operands);
        let slots = hyd_symbolic::slots(&arena, &[value]);
        let inside: Vec<_> = slots.into_iter().filter(|s| own.contains(&operands[s.index()].target())).collect();
        inside.iter().all(|&slot| {
            let slope = partial(&mut arena, value, slot);
            inside.iter().all(|&other| !contains_slot(&arena, slope, other))
        })
    })
}

/// What a block determines: targets of its assignments, then its unknowns (a state's derivative for a rate).
pub(crate) fn block_targets<'a>(plan: &'a Plan, block: Block<'a>) -> impl Iterator<Item = Target> + use<'a> {
    let unknown = |&u: &u32| match (plan.unknowns[u as usize].differential, plan.unknowns[u as usize].target) {
        (true, Target::Var(v)) => Target::Der(v),
        (_, target) => target,
    };
    let assigned = block.assignments.iter().map(|&a| plan.assignments[a as usize].target);
    assigned.chain(block.unknowns.iter().map(unknown))
}

//! Start values that are numbers and hold at the start (`fixed = true`).

use hyd_flat::{Section, Target, VarId};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::alias::representative::block_of_variable;
use crate::system::EquationSystem;

/// What each variable says of itself, those that were eliminated included.
pub(crate) fn fixed_starts(system: &EquationSystem) -> FxHashMap<VarId, f64> {
    let (flat, arena) = (&system.flat, &system.flat.templates.arena);
    let blocks = block_of_variable(flat);
    let by_others: FxHashSet<VarId> = system.fixed_by_others.iter().copied().collect();
    let says = |v: VarId| {
        let block = &flat.variables.raw[blocks[v] as usize];
        block.fixed.get((v.0 - block.first.0) as usize) && !by_others.contains(&v)
    };
    let mut numbers = FxHashMap::default();
    for block in flat.equations.iter().filter(|block| block.section == Section::Start) {
        let template = flat.templates.get(block.template);
        let Some(value) = arena.as_constant(template.right) else { continue };
        for operand in &block.operands {
            if let Target::Start(v) = operand.target()
                && says(v)
            {
                numbers.insert(v, if operand.negated() { -value } else { value });
            }
        }
    }
    numbers
}

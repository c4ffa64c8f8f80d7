//! Values of parameters before a run, by running the sorted bindings on numbers.
//!
//! The code of a translated model does the same; this serves checks at translation.  What the initial system determines
//! and what depends on it has no value here (NaN).

use hyd_flat::{Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{Evaluator, NodeId, SlotId};
use rustc_hash::FxHashMap;

use crate::sorted::{Assignment, SortedSystem};
use crate::system::{Resolution, Role};

/// The value of every scalar parameter and constant, NaN where none is known; `given` replaces bindings.
pub fn parameter_values(sorted: &SortedSystem, given: &dyn Fn(VarId) -> Option<f64>) -> IndexVec<VarId, f64> {
    let system = &sorted.system;
    let mut values = IndexVec::from_vec(system.roles.indices().map(|v| given(v).unwrap_or(f64::NAN)).collect());
    let mut prepared: FxHashMap<NodeId, Evaluator> = FxHashMap::default();
    for assignment in &sorted.bindings {
        let Target::Var(v) = assignment.target else { continue };
        if given(v).is_some() || !matches!(system.roles[v], Role::Parameter | Role::Constant) {
            continue;
        }
        values[v] = value_of(sorted, assignment, &values, &mut prepared);
    }
    for v in system.resolution.indices() {
        match system.resolution[v] {
            Resolution::Alias { of, negated } if values[v].is_nan() => {
                values[v] = if negated { -values[of] } else { values[of] };
            }
            Resolution::Value(constant) => values[v] = system.flat.constants[constant],
            _ => {}
        }
    }
    values
}

fn value_of(
    sorted: &SortedSystem,
    assignment: &Assignment,
    values: &IndexVec<VarId, f64>,
    prepared: &mut FxHashMap<NodeId, Evaluator>,
) -> f64 {
    let system = &sorted.system;
    let operands = system.operands_of(assignment.operands);
    let slot = |slot: SlotId| {
        let Some(operand) = operands.get(slot.index()) else { return f64::NAN };
        let value = match operand.target() {
            Target::Var(v) => values[v],
            Target::Const(c) => system.flat.constants[c],
            _ => f64::NAN,
        };
        if operand.negated() { -value } else { value }
    };
    let arena = &system.flat.templates.arena;
    let evaluator = prepared.entry(assignment.value).or_insert_with(|| Evaluator::new(arena, &[assignment.value]));
    evaluator.evaluate(slot, f64::NAN, false)[0]
}

//! Parameters that are 0 and that nothing can change once the model is translated.
//!
//! Final parameters, constants and those of `annotation(Evaluate = true)` whose values follow from such ones alone are numbers.  Where one is 0, what it
//! multiplies is not part of the equation (`R*i = u1 - u2` then says that two voltages are equal), and structure has to see that
//! before it decides what determines what.

use hyd_flat::{Operand, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{SlotId, simplify, slots, substitute};
use hyd_system::Settable;

use crate::algebra::Algebra;
use crate::alias::representative::block_of_variable;
use crate::plan::bindings::sort_bindings;
use crate::sorted::Assignment;
use crate::start_point::StartPoint;
use crate::system::{EquationSystem, Resolution, Role};

/// Takes parameters that are 0 for good as the number 0; aliases are eliminated afterwards.
pub(crate) fn take_zeros(system: &mut EquationSystem) {
    let blocks = block_of_variable(&system.flat);
    let settable = |system: &EquationSystem, v: VarId| system.flat.variables.raw[blocks[v] as usize].settable.clone();
    let is_known = |system: &EquationSystem, v: VarId| {
        let block = &system.flat.variables.raw[blocks[v] as usize];
        let fixed = block.fixed.get((v.0 - block.first.0) as usize);
        matches!(system.roles[v], Role::Parameter | Role::Constant) && fixed
    };
    if !system.roles.indices().any(|v| is_known(system, v) && settable(system, v) != Settable::Yes) {
        return;
    }
    // A cycle is reported when all is sorted.
    let Ok(bindings) = sort_bindings(system, &mut Algebra::default()) else { return };
    let behind = behind_structure(system, &bindings.assignments, &|system, v| {
        is_known(system, v) && settable(system, v) == Settable::Structural
    });
    let values = StartPoint::of_parameters(system, &bindings.assignments);
    let mut decided = IndexVec::filled(None, system.roles.len());
    for a in &bindings.assignments {
        let Target::Var(v) = a.target else { continue };
        let is_closed = is_known(system, v) && (settable(system, v) != Settable::Yes || behind[v]);
        if is_closed && follows(system, a, &decided) {
            decided[v] = values.value(v);
        }
    }
    let is_zero = |v: VarId| decided[v] == Some(0.0) && settable(system, v) != Settable::Yes;
    let zeros: Vec<VarId> = system.roles.indices().filter(|&v| is_zero(v)).collect();
    if zeros.is_empty() {
        return;
    }
    fix_what_is_behind(system, &bindings.assignments, &zeros, &blocks);
    let zero = system.flat.constants.push(0.0);
    for v in zeros {
        system.resolution[v] = Resolution::Value(zero);
        system.roles[v] = Role::Constant;
    }
}

/// The parameters that such parameters follow from.
fn behind_structure(
    system: &EquationSystem,
    bindings: &[Assignment],
    is_structural: &dyn Fn(&EquationSystem, VarId) -> bool,
) -> IndexVec<VarId, bool> {
    let mut behind = IndexVec::filled(false, system.roles.len());
    for a in bindings.iter().rev() {
        let Target::Var(v) = a.target else { continue };
        if behind[v] || is_structural(system, v) {
            for operand in system.operands_of(a.operands) {
                if let Target::Var(read) = operand.target() {
                    behind[read] = true;
                }
            }
        }
    }
    behind
}

/// What can be set and has a part in numbers that the translation has made use of, where equations read them, is fixed with them.
pub(crate) fn fix_what_is_behind(
    system: &mut EquationSystem,
    bindings: &[Assignment],
    used: &[VarId],
    blocks: &IndexVec<VarId, u32>,
) {
    let mut read = IndexVec::filled(false, system.roles.len());
    for (eq, equation) in system.equations.iter_enumerated() {
        if system.section(eq) == Section::Continuous {
            for operand in system.operands_of(equation.operands) {
                if let Target::Var(v) = operand.target() {
                    read[v] = true;
                }
            }
        }
    }
    let mut behind = IndexVec::filled(false, system.roles.len());
    for &v in used {
        behind[v] = read[v];
    }
    for a in bindings.iter().rev() {
        let Target::Var(v) = a.target else { continue };
        if behind[v] {
            for operand in system.operands_of(a.operands) {
                if let Target::Var(read) = operand.target() {
                    behind[read] = true;
                }
            }
        }
    }
    for v in system.roles.indices().filter(|&v| behind[v] && system.roles[v] == Role::Parameter) {
        let block = &mut system.flat.variables.raw[blocks[v] as usize];
        if block.settable == Settable::Yes {
            block.settable = Settable::Structural;
            system.reduction.fixed_at_zero.push(v);
        }
    }
}

/// True if nothing but what is decided has a part in a value: a branch that is not taken has none.
fn follows(system: &mut EquationSystem, a: &Assignment, decided: &IndexVec<VarId, Option<f64>>) -> bool {
    let operands: Vec<Operand> = system.operands_of(a.operands).to_vec();
    let number = |slot: SlotId| match operands[slot.index()].target() {
        Target::Const(_) => Some(None),
        Target::Var(v) => decided[v].map(|value| Some(if operands[slot.index()].negated() { -value } else { value })),
        _ => None,
    };
    let arena = &mut system.flat.templates.arena;
    let read = slots(arena, &[a.value]);
    let open = read.iter().filter(|&&slot| number(slot).is_none()).count();
    if open == 0 || open == read.len() {
        return open == 0;
    }
    let mut nodes = vec![None; operands.len()];
    for &slot in &read {
        nodes[slot.index()] = Some(match number(slot) {
            Some(Some(value)) => arena.constant(value),
            _ => arena.slot(slot),
        });
    }
    let rest =
        substitute(arena, a.value, &|slot| nodes[slot.index()].expect("invariant: it is among those that are read"));
    let rest = simplify(arena, rest);
    slots(arena, &[rest]).into_iter().all(|slot| number(slot).is_some())
}

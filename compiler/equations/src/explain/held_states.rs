//! States that an equation holds at one value while another one gives their derivative: a start value written as an equation, or a loop
//! that takes in a node whose value is prescribed.
//!
//! By numbers it is one equation too many, and any of a chain of equations could be the one.  What the user wrote by mistake is nearly
//! always the one that says nothing but a value.

use hyd_flat::{Section, Target, VarId};
use hyd_source::{Code, Diagnostic};

use crate::explain::faults::{list_names, mark_equations, mark_variables, written_text};
use crate::system::{EqId, EquationSystem, Role};

/// Most states that are named.
const MOST: usize = 4;

/// The message for a system with `too_many` equations, if just as many hold a state whose derivative has an equation.
pub(crate) fn held_states(system: &EquationSystem, too_many: usize) -> Option<Diagnostic> {
    if too_many == 0 || too_many > MOST {
        return None;
    }
    let mut held: Vec<(EqId, VarId)> = Vec::new();
    for eq in system.equations_in(Section::Continuous) {
        held.extend(held_by(system, eq).map(|v| (eq, v)));
        if held.len() > too_many {
            return None;
        }
    }
    if held.len() != too_many {
        return None;
    }
    let rates = held.iter().map(|&(_, v)| rate_of(system, v)).collect::<Option<Vec<EqId>>>()?;
    let states: Vec<VarId> = held.iter().map(|&(_, v)| v).collect();
    let texts = list_names(held.iter().map(|&(eq, _)| written_text(system, eq)));
    let names = list_names(states.iter().map(|&v| system.flat.var_name(v)));
    let (say, each, their, start) = match too_many {
        1 => ("says", "is one equation too many", "its derivative", "a start value"),
        _ => ("say", "are too many equations", "their derivatives", "start values"),
    };
    let message = format!("{texts} {say} at all times what {names} is, and {their} has an equation, too: that {each}");
    let equations: Vec<EqId> = held.iter().map(|&(eq, _)| eq).chain(rates).collect();
    let mut marked = mark_equations(Diagnostic::error(Code::Unbalanced, message), system, &equations[..too_many]);
    for &eq in &equations[too_many..] {
        let block = &system.flat.equations[system.equations[eq].block as usize];
        marked = marked.with(block.origin.span, format!("determines {}", written_text(system, eq)));
    }
    let marked = mark_variables(marked, system, &states);
    Some(
        marked
            .help(format!("if it is meant for the start, write it in a section `initial equation`, or as {start} with `fixed = true`"))
            .help(format!("if {names} is prescribed, leave out the equation of {their}; in a loop, let that begin after it")),
    )
}

/// The state whose value an equation says, with parameters and the time alone beside it.
fn held_by(system: &EquationSystem, eq: EqId) -> Option<VarId> {
    let equation = &system.equations[eq];
    if equation.order > 0 || system.flat.equations[equation.block as usize].made {
        return None;
    }
    let mut only = None;
    for operand in system.operands_of(equation.operands) {
        match operand.target() {
            Target::Var(v) if matches!(system.roles[v], Role::Parameter | Role::Constant) => {}
            Target::Var(v) if system.roles[v] == Role::State && only.is_none_or(|known| known == v) => only = Some(v),
            Target::Var(_) | Target::Der(_) => return None,
            _ => {}
        }
    }
    only
}

/// The equation with the derivative of a state.
fn rate_of(system: &EquationSystem, v: VarId) -> Option<EqId> {
    let has = |&eq: &EqId| {
        let operands = system.operands_of(system.equations[eq].operands);
        operands.iter().any(|operand| operand.target() == Target::Der(v))
    };
    system.equations_in(Section::Continuous).into_iter().find(has)
}

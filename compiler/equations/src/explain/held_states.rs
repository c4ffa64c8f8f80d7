//! States that an equation holds at one value while another one gives their derivative: a start value written as an equation, or a loop
//! that takes in a node whose value is prescribed.
//!
//! By numbers it is one equation too many, and any of a chain of equations could be the one.  What the user wrote by mistake is nearly
//! always the one that says nothing but a value.

use hyd_flat::{Section, Target, VarId};
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::{Node, post_order};

use crate::explain::faults::{list_names, mark_equations, mark_variables, written_text};
use crate::system::{EqId, EquationSystem, Role};

/// Most states that are named.
const MOST: usize = 4;

/// The equations that say what a state is, by parameters alone, while its derivative has an equation, too; none if there are not just
/// `too_many` of them.
pub(crate) fn held_states(system: &EquationSystem, too_many: usize) -> Vec<(EqId, VarId)> {
    if too_many == 0 || too_many > MOST {
        return Vec::new();
    }
    let mut held: Vec<(EqId, VarId)> = Vec::new();
    for eq in system.equations_in(Section::Continuous) {
        held.extend(held_by(system, eq).map(|v| (eq, v)));
        if held.len() > too_many {
            return Vec::new();
        }
    }
    if held.len() == too_many { held } else { Vec::new() }
}

/// The message on them, where the system is regular without them.
pub(crate) fn held_message(system: &EquationSystem, held: &[(EqId, VarId)]) -> Option<Diagnostic> {
    let rates = held.iter().map(|&(_, v)| rate_of(system, v)).collect::<Option<Vec<EqId>>>()?;
    let states: Vec<VarId> = held.iter().map(|&(_, v)| v).collect();
    let texts = list_names(held.iter().map(|&(eq, _)| written_text(system, eq)));
    let names = list_names(states.iter().map(|&v| system.flat.var_name(v)));
    let (say, each, their, start) = match held.len() {
        1 => ("says", "is one equation too many", "its derivative", "a start value"),
        _ => ("say", "are too many equations", "their derivatives", "start values"),
    };
    let message = format!("{texts} {say} at all times what {names} is, and {their} has an equation, too: that {each}");
    let own: Vec<EqId> = held.iter().map(|&(eq, _)| eq).collect();
    let mut marked = mark_equations(Diagnostic::error(Code::Unbalanced, message), system, &own);
    for eq in rates {
        let block = &system.flat.equations[system.equations[eq].block as usize];
        marked = marked.with(block.origin.span, written_text(system, eq));
    }
    let marked = mark_variables(marked, system, &states);
    Some(
        marked
            .help(format!(
                "if it is meant for the start, write it in a section `initial equation`, or as {start} with `fixed = true`"
            ))
            .help(format!(
                "if {names} is prescribed, leave out the equation of {their}; where a loop writes that, let the loop start at the next element"
            )),
    )
}

/// The state whose value an equation says, with parameters alone beside it.
fn held_by(system: &EquationSystem, eq: EqId) -> Option<VarId> {
    let equation = &system.equations[eq];
    if equation.order > 0 || system.flat.equations[equation.block as usize].made {
        return None;
    }
    let template = system.flat.templates.get(equation.template);
    let arena = &system.flat.templates.arena;
    // What moves with the time is prescribed on purpose.
    if post_order(arena, &[template.left, template.right]).iter().any(|&node| arena.node(node) == Node::Time) {
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

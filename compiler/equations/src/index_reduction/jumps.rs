//! Equations that jump at events although their derivative is needed.
//!
//! Between the jumps the derivative is right.  At a jump it would be an impulse, which no solution has; it is left out, and the user
//! is warned, because a mass that is moved at once gets no speed by it.  A jump is a discrete real number that changes after the start, or a branch
//! that gives way to another one while neither of them varies with time; corners, whose branches meet, are none.  What is multiplied by
//! something that varies may vanish where it jumps (`w*w*sign(w)`), and is not looked at.

use hyd_flat::{Operand, Section, Target, VarId};
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::{Arena, Node, NodeId, post_order};
use hyd_system::ValueKind;
use rustc_hash::FxHashSet;

use crate::explain::faults::{equation_span, mark_equations};
use crate::system::{EqId, EquationSystem, Role};

/// A warning for each place in the text with such an equation.
pub(super) fn jumps(system: &EquationSystem, differentiated: &[(EqId, u32)]) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut places = FxHashSet::default();
    for &(eq, _) in differentiated.iter().filter(|&&(eq, order)| order > 0 && is_jumping(system, eq)) {
        if !places.insert(equation_span(system, eq)) {
            continue;
        }
        let what = match system.left_operand(eq).map(|operand| operand.target()) {
            Some(Target::Var(v)) => format!("`{}`", system.flat.var_name(v)),
            _ => "one side of this equation".to_string(),
        };
        let message = format!("{what} jumps, and its derivative is asked for: it is taken as if there were no jump");
        let help = "make it smooth, by a ramp or by a filter of as many orders as derivatives are needed; or let `reinit` set the state at the jump";
        let warning = Diagnostic::warning(Code::JumpDifferentiated, message).help(help);
        found.push(mark_equations(warning, system, &[eq]));
    }
    found
}

fn is_jumping(system: &EquationSystem, eq: EqId) -> bool {
    let equation = system.equations[eq];
    let operands = system.operands_of(equation.operands);
    let templates = &system.flat.templates;
    let (arena, template) = (&templates.arena, templates.get(equation.template));
    let mut stack = vec![template.left, template.right];
    let mut seen = FxHashSet::default();
    while let Some(id) = stack.pop() {
        if !seen.insert(id) {
            continue;
        }
        match arena.node(id) {
            Node::Slot(slot) if is_discrete_number(system, operands[slot.index()]) => return true,
            Node::If(condition, then, otherwise) => {
                let is_still = |id| !varies(system, arena, id, operands);
                if then != otherwise
                    && is_still(then)
                    && is_still(otherwise)
                    && changes(system, arena, condition, operands)
                {
                    return true;
                }
                stack.extend([then, otherwise]);
            }
            Node::Mul(a, b) | Node::Div(a, b) => {
                let is_still = |id| !varies(system, arena, id, operands);
                stack.extend([(a, b), (b, a)].into_iter().filter(|&(_, other)| is_still(other)).map(|(own, _)| own));
            }
            // What is only true or false is asked by branches alone.
            Node::Event(..) | Node::Compare(..) | Node::Not(_) | Node::And(..) | Node::Or(..) => {}
            node => stack.extend(node.operands()),
        }
    }
    false
}

/// A real number that events change, those at the start aside.
fn is_discrete_number(system: &EquationSystem, operand: Operand) -> bool {
    let Target::Var(v) = operand.target() else { return false };
    system.roles[v] == Role::Discrete
        && system.flat.variables[system.flat.locate(v).0].kind == ValueKind::Real
        && !is_set_at_the_start_only(system, v)
}

/// True for `v = if initial() then ... else pre(v)`.
fn is_set_at_the_start_only(system: &EquationSystem, v: VarId) -> bool {
    let arena = &system.flat.templates.arena;
    let sets = |&eq: &EqId| system.left_operand(eq).is_some_and(|operand| operand.target() == Target::Var(v));
    let defining = system.equations_in(Section::Discrete).into_iter().find(sets);
    defining.is_some_and(|eq| match arena.node(system.flat.templates.get(system.equations[eq].template).right) {
        Node::If(condition, ..) => matches!(arena.node(condition), Node::Initial),
        _ => false,
    })
}

/// True if a value changes between events.
fn varies(system: &EquationSystem, arena: &Arena, value: NodeId, operands: &[Operand]) -> bool {
    post_order(arena, &[value]).into_iter().any(|id| match arena.node(id) {
        Node::Time => true,
        Node::Slot(slot) => match operands[slot.index()].target() {
            Target::Var(v) => system.roles[v].is_continuous(),
            Target::Der(_) | Target::Delayed(_) | Target::DelayedRate(_) | Target::Input(_) | Target::InputRate(_) => {
                true
            }
            _ => false,
        },
        _ => false,
    })
}

/// True if a condition changes during a run.
fn changes(system: &EquationSystem, arena: &Arena, condition: NodeId, operands: &[Operand]) -> bool {
    let is_discrete = |operand: &Operand| match operand.target() {
        Target::Var(v) => system.roles[v] == Role::Discrete,
        Target::Held(_) => true,
        _ => false,
    };
    varies(system, arena, condition, operands)
        || post_order(arena, &[condition])
            .into_iter()
            .any(|id| matches!(arena.node(id), Node::Slot(slot) if is_discrete(&operands[slot.index()])))
}

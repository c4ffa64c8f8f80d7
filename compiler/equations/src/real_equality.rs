//! Continuous numbers that are compared for equality where that is meant to cause an event.
//!
//! Looked at are states and the time, in what decides about a `when` and in Boolean variables: of other variables it is not known that they vary
//! between events.  Two numbers that vary are equal at single instants at most, and rounding decides whether a step of the solver meets one: no event can be looked
//! for (Modelica 3.6, section 3.5, allows `==` and `<>` of real numbers in functions only).

use std::collections::BTreeSet;

use hyd_flat::{Section, Target};
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{Node, Relation, post_order};
use hyd_system::ValueKind;

use crate::explain::faults::equation_span;
use crate::system::{EquationSystem, Role};

/// A warning for each discrete equation and each `when` with such a condition; the relations of the system still stand in its expressions.
pub(crate) fn real_equalities(system: &EquationSystem) -> Vec<Diagnostic> {
    let arena = &system.flat.templates.arena;
    let mut places: BTreeSet<Span> = BTreeSet::new();
    for eq in system.equations.indices() {
        // Among continuous equations it guards a quotient: `if x == 0 then 1 else sin(x)/x`.
        if system.section(eq) != Section::Discrete {
            continue;
        }
        let is_truth = |operand: hyd_flat::Operand| match operand.target() {
            Target::Var(v) => system.flat.variables[system.flat.locate(v).0].kind == ValueKind::Boolean,
            _ => false,
        };
        if !system.left_operand(eq).is_some_and(is_truth) {
            continue;
        }
        let equation = system.equations[eq];
        let template = system.flat.templates.get(equation.template);
        let operands = system.operands_of(equation.operands);
        let varies = |id| match arena.node(id) {
            Node::Time => true,
            Node::Slot(slot) => match operands[slot.index()].target() {
                Target::Var(v) => system.roles[v] == Role::State,
                Target::Der(_) => true,
                _ => false,
            },
            _ => false,
        };
        // What is compared are numbers, not what is true of them.
        let is_number = |id| {
            !matches!(
                arena.node(id),
                Node::Event(..) | Node::Compare(..) | Node::Not(_) | Node::And(..) | Node::Or(..) | Node::If(..)
            )
        };
        let mut stack = vec![template.right];
        while let Some(id) = stack.pop() {
            match arena.node(id) {
                Node::Event(Relation::Equal | Relation::NotEqual, a, b)
                | Node::Compare(Relation::Equal | Relation::NotEqual, a, b)
                    if is_number(a) && is_number(b) && post_order(arena, &[a, b]).into_iter().any(varies) =>
                {
                    places.insert(equation_span(system, eq));
                }
                Node::Not(a) => stack.push(a),
                Node::And(a, b) | Node::Or(a, b) => stack.extend([a, b]),
                _ => {}
            }
        }
    }
    let warning = |span: Span| {
        let message =
            "numbers that vary continuously are compared for equality: no event is found where they are equal";
        Diagnostic::warning(Code::RealEquality, message)
            .at(span, "")
            .help("say from which side the value is reached: `>=` or `<=` for `==`, which is true from then on")
    };
    places.into_iter().map(warning).collect()
}

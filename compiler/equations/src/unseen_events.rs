//! Conditions of time alone whose events can only be looked for at the steps of the solver.
//!
//! A relation of time alone is enclosed over intervals of time, so that no event between two steps is lost
//! (`hyd_payload::ahead`).  Of a function that is compiled nothing is known between two points, and no step size follows from time: a
//! change that lasts less than a step may be passed over.  The user is warned, because nothing in the results would show it.

use std::collections::BTreeSet;

use hyd_flat::Target;
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{Arena, Node, NodeId, SlotId, post_order, slots};
use rustc_hash::FxHashMap;

use crate::algebra::Known;
use crate::explain::faults::equation_span;
use crate::relations::is_fixed_between_events;
use crate::sorted::{EventRelation, Plan, Trigger};
use crate::system::{EquationSystem, OperandRange};

/// What a value that depends on nothing but time and data needs.
#[derive(Clone, Copy, Default)]
struct Need {
    time: bool,
    compiled: bool,
}

/// A warning for each place in the text with such a condition.
pub(crate) fn unseen_events(
    system: &EquationSystem,
    relations: &[EventRelation],
    plan: &Plan,
    known: &Known,
) -> Vec<Diagnostic> {
    let mut needs = Needs { system, known, nodes: FxHashMap::default(), assigned: FxHashMap::default() };
    if !relations.iter().any(|relation| relation.trigger == Trigger::State) {
        return Vec::new();
    }
    for a in &plan.assignments {
        if let Some(need) = needs.of(a.value, a.operands) {
            needs.assigned.insert(a.target, need);
        }
    }
    let mut places: BTreeSet<Span> = BTreeSet::new();
    for relation in relations.iter().filter(|relation| relation.trigger == Trigger::State) {
        if needs.of(relation.root, relation.operands).is_some_and(|need| need.time && need.compiled) {
            places.insert(equation_span(system, relation.equation));
        }
    }
    let warning = |span: Span| {
        let message =
            "this condition depends on time through a compiled function: a change between two steps may be missed";
        Diagnostic::warning(Code::UnseenEvents, message).at(span, "").help(
            "a function without loops becomes an expression, whose events are never missed; use `sample` for periodic events",
        )
    };
    places.into_iter().map(warning).collect()
}

struct Needs<'a> {
    system: &'a EquationSystem,
    known: &'a Known,
    /// Of expressions themselves, and the slots that they read.
    nodes: FxHashMap<NodeId, (Need, std::rc::Rc<[SlotId]>)>,
    assigned: FxHashMap<Target, Need>,
}

impl Needs<'_> {
    /// None of a value that depends on states, on unknowns or on the past.
    fn of(&mut self, value: NodeId, operands: OperandRange) -> Option<Need> {
        let arena = &self.system.flat.templates.arena;
        let (mut need, used) =
            self.nodes.entry(value).or_insert_with(|| (own(arena, value), slots(arena, &[value]).into())).clone();
        let operands = self.system.operands_of(operands);
        for operand in used.iter().map(|slot| operands[slot.index()]) {
            if self.known.is_known(operand) || is_fixed_between_events(self.system, operand) {
                continue;
            }
            let inner = self.assigned.get(&operand.target())?;
            need.time |= inner.time;
            need.compiled |= inner.compiled;
        }
        Some(need)
    }
}

fn own(arena: &Arena, value: NodeId) -> Need {
    let mut need = Need::default();
    for id in post_order(arena, &[value]) {
        match arena.node(id) {
            Node::Apply(..) => need.compiled = true,
            Node::Time => need.time = true,
            _ => {}
        }
    }
    need
}

//! What occurs in an expression, and how much of it there is.
//!
//! Incidence, variability and cost are questions about the set of nodes below a root.  Each is one walk over the
//! post-order; a node that is used twice counts once, as in generated code.  Occurrence is of the text: in `0*x`
//! interned without simplification `x` still occurs.

use crate::node::{Arena, Node, NodeId, SlotId};
use crate::order::post_order;
use hyd_system::math::Function;

/// The slots below the roots in order of first occurrence, left to right.
pub fn slots(arena: &Arena, roots: &[NodeId]) -> Vec<SlotId> {
    let slot = |id| match arena.node(id) {
        Node::Slot(slot) => Some(slot),
        _ => None,
    };
    post_order(arena, roots).into_iter().filter_map(slot).collect()
}

/// True if a node below `root` (itself included) satisfies the predicate.
pub fn contains(arena: &Arena, root: NodeId, predicate: impl Fn(Node) -> bool) -> bool {
    post_order(arena, &[root]).into_iter().any(|id| predicate(arena.node(id)))
}

/// True if the slot occurs.
pub fn contains_slot(arena: &Arena, root: NodeId, slot: SlotId) -> bool {
    contains(arena, root, |node| node == Node::Slot(slot))
}

/// True if time occurs.
pub fn contains_time(arena: &Arena, root: NodeId) -> bool {
    contains(arena, root, |node| node == Node::Time)
}

/// True if `initial()` occurs.
pub fn contains_initial(arena: &Arena, root: NodeId) -> bool {
    contains(arena, root, |node| node == Node::Initial)
}

/// True if `homotopy` occurs.
pub fn contains_homotopy(arena: &Arena, root: NodeId) -> bool {
    contains(arena, root, |node| node == Node::Homotopy)
}

/// True if a relation occurs that causes events.
pub fn contains_event(arena: &Arena, root: NodeId) -> bool {
    contains(arena, root, |node| matches!(node, Node::Event(..)))
}

/// Number of different nodes below the roots, leaves included.
pub fn size(arena: &Arena, roots: &[NodeId]) -> usize {
    post_order(arena, roots).len()
}

/// Rough cost of one evaluation, in additions: leaves are free, a division or root counts 5, a transcendental
/// function 20 (orders of magnitude of current processors, Fog 2022, "Instruction tables").
pub fn cost(arena: &Arena, roots: &[NodeId]) -> u64 {
    post_order(arena, roots).into_iter().map(|id| weight(arena.node(id))).sum()
}

fn weight(node: Node) -> u64 {
    match node {
        Node::Const(_) | Node::Slot(_) | Node::Time | Node::Initial | Node::Homotopy => 0,
        Node::Pair(..) => 0,
        Node::Apply(..) => 200,
        Node::Div(..) => 5,
        Node::Call1(function, _) | Node::Call2(function, ..) => match function {
            Function::Abs | Function::Sign | Function::Min | Function::Max | Function::Floor | Function::Ceil => 1,
            Function::Sqrt | Function::Div => 5,
            Function::Mod | Function::Rem => 7,
            _ => 20,
        },
        _ => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::Relation;

    #[test]
    fn slots_come_in_reading_order() {
        let mut arena = Arena::new();
        let [a, b, c] = [0, 1, 2].map(|k| arena.slot(SlotId(k)));
        let product = arena.mul(c, a);
        let sum = arena.add(product, b);
        assert_eq!(slots(&arena, &[sum, a]), [SlotId(2), SlotId(0), SlotId(1)]);
        assert_eq!(slots(&arena, &[b, sum]), [SlotId(1), SlotId(2), SlotId(0)]);
        assert!(contains_slot(&arena, sum, SlotId(1)) && !contains_slot(&arena, product, SlotId(1)));
        assert_eq!((size(&arena, &[sum]), cost(&arena, &[sum])), (5, 2));
    }

    #[test]
    fn time_initial_and_events_are_found() {
        let mut arena = Arena::new();
        let (time, initial) = (arena.intern(Node::Time), arena.intern(Node::Initial));
        let one = arena.constant(1.0);
        let event = arena.event(Relation::Less, time, one);
        let literal = arena.compare(Relation::Less, time, one);
        assert!(contains_time(&arena, event) && contains_event(&arena, event) && !contains_event(&arena, literal));
        assert!(contains_initial(&arena, initial) && !contains_initial(&arena, event));
    }
}

//! Putting expressions in place of others, and the canonical numbering of slots.
//!
//! A rewrite rebuilds an expression from its leaves up with the simplifying constructors; each node is visited once, so
//! shared subexpressions stay shared.  Two equations that differ only in the numbers of their slots become the same
//! template when slots are numbered in the order of first occurrence (the linear case of de Bruijn 1972).

use crate::node::{Arena, Node, NodeId, SlotId, Template};
use crate::occurs::slots;
use crate::order::{post_order, post_order_down_to};
use crate::simplify::simplify;
use rustc_hash::FxHashMap;

/// Rewrites an expression bottom-up: `replace` sees each operation on operands already rewritten and returns what
/// takes its place, or none to keep it.
///
/// Called once per different node below `root`, in post-order.
pub fn rewrite(arena: &mut Arena, root: NodeId, mut replace: impl FnMut(&mut Arena, Node) -> Option<NodeId>) -> NodeId {
    let mut new: FxHashMap<NodeId, NodeId> = FxHashMap::default();
    for id in post_order(arena, &[root]) {
        let old = arena.node(id);
        let node = old.map(|operand| new[&operand]);
        let result = match replace(arena, node) {
            Some(result) => result,
            None if node == old => id,
            None => arena.build(node),
        };
        new.insert(id, result);
    }
    new[&root]
}

/// Puts others in place of whole subexpressions of `root`, but not of `root` itself.
pub fn replace_below(arena: &mut Arena, root: NodeId, others: &FxHashMap<NodeId, NodeId>) -> NodeId {
    let mut new: FxHashMap<NodeId, NodeId> = FxHashMap::default();
    for id in post_order_down_to(arena, &[root], |id| id != root && others.contains_key(&id)) {
        let old = arena.node(id);
        let result = match others.get(&id) {
            Some(&other) if id != root => other,
            _ => {
                let node = old.map(|operand| new[&operand]);
                if node == old { id } else { arena.build(node) }
            }
        };
        new.insert(id, result);
    }
    new[&root]
}

/// Puts `value(slot)` in place of every slot, all at once.
pub fn substitute(arena: &mut Arena, root: NodeId, value: &dyn Fn(SlotId) -> NodeId) -> NodeId {
    rewrite(arena, root, |_, node| match node {
        Node::Slot(slot) => Some(value(slot)),
        _ => None,
    })
}

/// Puts `value` in place of one slot.
pub fn substitute_one(arena: &mut Arena, root: NodeId, slot: SlotId, value: NodeId) -> NodeId {
    rewrite(arena, root, |_, node| (node == Node::Slot(slot)).then_some(value))
}

/// Gives every slot a new number; the structure stays exactly as it is.
pub fn renumber(arena: &mut Arena, root: NodeId, number: &dyn Fn(SlotId) -> SlotId) -> NodeId {
    rewrite(arena, root, |arena, node| {
        Some(match node {
            Node::Slot(slot) => arena.slot(number(slot)),
            _ => arena.intern(node),
        })
    })
}

/// The template of `left = right`: simplified, with slots numbered in the order of first occurrence.
///
/// The list gives for each slot of the template the slot it had before; slots that vanish in simplification are absent.
/// Equal structures get the same template.
pub fn canonical(arena: &mut Arena, left: NodeId, right: NodeId) -> (Template, Vec<SlotId>) {
    let (left, right) = (simplify(arena, left), simplify(arena, right));
    let old = slots(arena, &[left, right]);
    let number: FxHashMap<SlotId, SlotId> = old.iter().enumerate().map(|(k, &slot)| (slot, SlotId(k as u32))).collect();
    let arity = old.len() as u32;
    let left = renumber(arena, left, &|slot| number[&slot]);
    let right = renumber(arena, right, &|slot| number[&slot]);
    (Template { left, right, arity }, old)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{Relation, Templates};

    #[test]
    fn equal_structures_get_the_same_template() {
        let mut templates = Templates::new();
        let mut make = |p: u32, q: u32, r: u32| {
            let arena = &mut templates.arena;
            let [p, q, r] = [p, q, r].map(|k| arena.slot(SlotId(k)));
            let product = arena.mul(q, r);
            let (template, old) = canonical(arena, p, product);
            (templates.intern(template), template.arity, old)
        };
        let first = make(7, 3, 9);
        let second = make(0, 1, 2);
        let third = make(4, 5, 5);
        assert_eq!(first, (second.0, 3, vec![SlotId(7), SlotId(3), SlotId(9)]));
        assert_ne!(third.0, first.0);
        assert_eq!((third.1, third.2), (2, vec![SlotId(4), SlotId(5)]));
    }

    #[test]
    fn whole_subexpressions_are_replaced_but_not_the_root() {
        let mut arena = Arena::new();
        let [a, b, v] = [0, 1, 2].map(|k| arena.slot(SlotId(k)));
        let sum = arena.add(a, b);
        let (root, wanted) = (arena.mul(sum, sum), arena.mul(v, v));
        let others = [(sum, v), (root, a)].into_iter().collect();
        assert_eq!(replace_below(&mut arena, root, &others), wanted);
        assert_eq!(replace_below(&mut arena, sum, &others), sum);
    }

    #[test]
    fn vanished_slots_are_not_listed() {
        let mut arena = Arena::new();
        let [a, b] = [0, 1].map(|k| arena.slot(SlotId(k)));
        let zero = arena.constant(0.0);
        let nothing = arena.intern(Node::Mul(zero, a));
        let (template, old) = canonical(&mut arena, nothing, b);
        assert_eq!((template.left, template.arity, old), (zero, 1, vec![SlotId(1)]));
    }

    #[test]
    fn substitution_is_simultaneous_and_simplifies() {
        let mut arena = Arena::new();
        let [a, b] = [0, 1].map(|k| arena.slot(SlotId(k)));
        let difference = arena.sub(a, b);
        let swapped = substitute(&mut arena, difference, &|slot| if slot == SlotId(0) { b } else { a });
        assert_eq!(arena.node(swapped), Node::Sub(b, a));
        let zero = substitute_one(&mut arena, difference, SlotId(0), b);
        assert_eq!(arena.as_constant(zero), Some(0.0));
    }

    #[test]
    fn events_can_be_taken_out() {
        let mut arena = Arena::new();
        let [a, b] = [0, 1].map(|k| arena.slot(SlotId(k)));
        let event = arena.event(Relation::Less, a, b);
        let root = arena.select(event, a, b);
        let mut found = Vec::new();
        let new = rewrite(&mut arena, root, |arena, node| {
            matches!(node, Node::Event(..)).then(|| {
                found.push(node);
                arena.slot(SlotId(9))
            })
        });
        let switch = arena.slot(SlotId(9));
        assert_eq!((arena.node(new), found), (Node::If(switch, a, b), vec![Node::Event(Relation::Less, a, b)]));
    }
}

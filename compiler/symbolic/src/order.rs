//! The order in which the nodes of an expression are worked on.
//!
//! Every pass of this crate is a loop over a post-order: each node once, operands before the node that uses them, left
//! before right (depth-first search, Tarjan 1972).  The search keeps its own stack, so a sum of ten thousand terms is
//! no deeper for the machine than a sum of two.

use crate::node::{Arena, NodeId};
use rustc_hash::FxHashSet;

/// All nodes below `roots`, each once, operands first; leaves appear in the order of first occurrence in the text.
pub fn post_order(arena: &Arena, roots: &[NodeId]) -> Vec<NodeId> {
    post_order_down_to(arena, roots, |_| false)
}

/// The same without what is only below nodes that `ends` holds for.
pub(crate) fn post_order_down_to(arena: &Arena, roots: &[NodeId], ends: impl Fn(NodeId) -> bool) -> Vec<NodeId> {
    enum Step {
        Enter(NodeId),
        Leave(NodeId),
    }
    let mut order = Vec::new();
    let mut seen = FxHashSet::default();
    let mut stack: Vec<Step> = roots.iter().rev().map(|&root| Step::Enter(root)).collect();
    while let Some(step) = stack.pop() {
        match step {
            Step::Leave(id) => order.push(id),
            Step::Enter(id) if seen.insert(id) => {
                stack.push(Step::Leave(id));
                if ends(id) {
                    continue;
                }
                let first = stack.len();
                stack.extend(arena.node(id).operands().map(Step::Enter));
                stack[first..].reverse();
            }
            Step::Enter(_) => {}
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{Node, SlotId};

    #[test]
    fn operands_come_first_and_left_comes_before_right() {
        let mut arena = Arena::new();
        let b = arena.slot(SlotId(1));
        let a = arena.slot(SlotId(0));
        let sum = arena.intern(Node::Add(a, b));
        let product = arena.intern(Node::Mul(sum, a));
        assert_eq!(post_order(&arena, &[product]), vec![a, b, sum, product]);
    }
}

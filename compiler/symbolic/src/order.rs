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
    let mut order = Vec::with_capacity(roots.len());
    let mut seen = Seen { few: [NodeId(0); FEW], count: 0, many: FxHashSet::default() };
    let mut stack: Vec<Step> = Vec::with_capacity(FEW.max(roots.len()));
    stack.extend(roots.iter().rev().map(|&root| Step::Enter(root)));
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

/// Most expressions are smaller, and for them a search is cheaper than a table.
const FEW: usize = 16;

/// Nodes that have been met.
struct Seen {
    few: [NodeId; FEW],
    count: usize,
    many: FxHashSet<NodeId>,
}

impl Seen {
    /// Whether it is met for the first time.
    fn insert(&mut self, id: NodeId) -> bool {
        if self.count < FEW {
            let first = !self.few[..self.count].contains(&id);
            if first {
                self.few[self.count] = id;
                self.count += 1;
            }
            return first;
        }
        if self.many.is_empty() {
            self.many.extend(self.few);
        }
        self.many.insert(id)
    }
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

    /// Shared nodes come once, in expressions of any size.
    #[test]
    fn each_node_comes_once() {
        for length in [1, FEW - 2, FEW - 1, FEW, FEW + 1, 1000] {
            let mut arena = Arena::new();
            let leaf = arena.slot(SlotId(0));
            let mut sum = leaf;
            let mut expected = vec![leaf];
            for _ in 0..length {
                let square = arena.intern(Node::Mul(sum, sum));
                sum = arena.intern(Node::Add(square, leaf));
                expected.extend([square, sum]);
            }
            assert_eq!(post_order(&arena, &[sum, leaf, sum]), expected, "{length}");
        }
    }
}

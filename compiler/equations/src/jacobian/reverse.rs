//! All partial derivatives of a wide expression in one sweep.
//!
//! Differentiating by each slot in turn costs the size of the expression each time; a sum over an array of N elements
//! would cost N^2.  Reverse accumulation (Griewank and Walther 2008, "Evaluating Derivatives", section 3.2) visits each
//! node once, from the result to the leaves, and adds up what each contributes.  Narrow expressions are differentiated
//! forwards instead, which reads better.

use hyd_index::TypedIndex;
use hyd_symbolic::{Arena, BodyId, Node, NodeId, SlotId, gradient, partial, post_order, substitute};
use rustc_hash::FxHashMap;

/// Expressions over more slots are differentiated backwards.
pub(crate) const WIDE: usize = 48;

/// The partial derivatives of a value by its slots, some of them zero, in any order; `slots` is an upper bound of their
/// number.
pub(crate) fn partials(arena: &mut Arena, value: NodeId, slots: usize) -> Vec<(SlotId, NodeId)> {
    if slots <= WIDE { gradient(arena, value) } else { accumulate(arena, value, slots) }
}

fn accumulate(arena: &mut Arena, value: NodeId, slots: usize) -> Vec<(SlotId, NodeId)> {
    let order = post_order(arena, &[value]);
    let mut adjoint: FxHashMap<NodeId, NodeId> = FxHashMap::default();
    adjoint.insert(value, arena.constant(1.0));
    let mut found = Vec::new();
    for &id in order.iter().rev() {
        let Some(&own) = adjoint.get(&id) else { continue };
        let node = arena.node(id);
        if let Node::Slot(slot) = node {
            found.push((slot, own));
        }
        for (operand, factor) in local_partials(arena, node, slots) {
            if arena.is(factor, 0.0) {
                continue;
            }
            let term = arena.mul(own, factor);
            let sum = match adjoint.get(&operand) {
                Some(&before) => arena.add(before, term),
                None => term,
            };
            adjoint.insert(operand, sum);
        }
    }
    found
}

/// The derivative of one operation by each of its operands; an operand that stands there twice is listed twice.
fn local_partials(arena: &mut Arena, node: Node, slots: usize) -> Vec<(NodeId, NodeId)> {
    let one = arena.constant(1.0);
    let minus = arena.constant(-1.0);
    match node {
        Node::Add(a, b) => vec![(a, one), (b, one)],
        Node::Sub(a, b) => vec![(a, one), (b, minus)],
        Node::Neg(a) => vec![(a, minus)],
        Node::Mul(a, b) => vec![(a, b), (b, a)],
        Node::Pair(..) => Vec::new(),
        Node::Apply(body, output, list) => call_partials(arena, body, output, list, slots),
        _ => {
            // The operation on fresh slots, differentiated and then put back onto its operands.
            let operands: Vec<NodeId> = node.operands().collect();
            let fresh: Vec<SlotId> = (0..operands.len()).map(|k| SlotId::new(slots + k)).collect();
            let mut next = fresh.iter();
            let probe = node.map(|operand| match next.next() {
                Some(&slot) => arena.slot(slot),
                None => operand,
            });
            let probe = arena.intern(probe);
            let back = |slot: SlotId| operands[slot.index() - slots];
            let derivative = |arena: &mut Arena, slot| {
                let derivative = partial(arena, probe, slot);
                substitute(arena, derivative, &back)
            };
            fresh.iter().map(|&slot| (back(slot), derivative(arena, slot))).collect()
        }
    }
}

/// The derivative of a call by each of its arguments, each argument once.
fn call_partials(arena: &mut Arena, body: BodyId, output: u32, list: NodeId, slots: usize) -> Vec<(NodeId, NodeId)> {
    let arguments = arena.arguments(list);
    let fresh: Vec<NodeId> = (0..arguments.len()).map(|k| arena.slot(SlotId::new(slots + k))).collect();
    let list = arena.argument_list(&fresh);
    let probe = arena.intern(Node::Apply(body, output, list));
    let mut found = Vec::new();
    for (k, &argument) in arguments.iter().enumerate() {
        let derivative = partial(arena, probe, SlotId::new(slots + k));
        let back = |slot: SlotId| arguments[slot.index() - slots];
        found.push((argument, substitute(arena, derivative, &back)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyd_symbolic::{Function, Relation, eval};

    #[test]
    fn both_directions_agree() {
        let mut arena = Arena::new();
        let x: Vec<NodeId> = (0..4).map(|k| arena.slot(SlotId(k))).collect();
        let product = arena.mul(x[0], x[1]);
        let quotient = arena.div(product, x[2]);
        let root = arena.call1(Function::Sqrt, quotient);
        let power = arena.call2(Function::Pow, x[3], root);
        let larger = arena.call2(Function::Max, power, x[0]);
        let above = arena.compare(Relation::Greater, x[1], x[2]);
        let choice = arena.select(above, larger, quotient);
        let difference = arena.sub(choice, root);
        let value = arena.add(difference, product);
        let mut backwards = accumulate(&mut arena, value, 4);
        backwards.sort_unstable_by_key(|&(slot, _)| slot);
        let forwards = gradient(&mut arena, value);
        for values in [[1.5, 2.0, 0.7, 1.2], [0.4, 0.3, 0.9, 2.0]] {
            let at = |arena: &Arena, id| eval(arena, id, |slot| values[slot.index()], 0.0, false);
            for &(slot, derivative) in &forwards {
                let other = backwards.iter().find(|(s, _)| *s == slot).map_or(0.0, |&(_, id)| at(&arena, id));
                let expected = at(&arena, derivative);
                assert!((expected - other).abs() < 1e-12 * expected.abs().max(1.0), "{slot}: {expected} {other}");
            }
        }
    }
}

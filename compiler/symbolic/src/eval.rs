//! The value of an expression.
//!
//! An expression becomes a tape: its nodes in post-order, operands given by their position on the tape, so that one
//! pass from front to back leaves the value of every node (Griewank and Walther 2008, "Evaluating Derivatives",
//! section 2.2).  The elementary functions are those of [`hyd_system::math`], the same that generated code calls.
//! Both branches of an `if` are computed and one is taken.  This is the reference for tests and the tool for
//! constants; simulations run on generated code.

use crate::machine::Machine;
use crate::node::{Arena, Node, NodeId, Relation, SlotId};
use crate::order::post_order;
use hyd_index::TypedIndex;
use hyd_system::math::Function;
use rustc_hash::FxHashMap;

/// The value of one expression; see [`Evaluator`] for repeated use.  NaN and infinities come out as they arise.
pub fn eval(arena: &Arena, root: NodeId, slots: impl Fn(SlotId) -> f64, time: f64, initial: bool) -> f64 {
    Evaluator::new(arena, &[root]).evaluate(slots, time, initial)[0]
}

/// Some expressions prepared for repeated evaluation, which then allocates nothing.
#[derive(Clone, Debug)]
pub struct Evaluator {
    /// Operations in post-order; their operands are positions on this tape, not nodes of the arena.
    tape: Vec<Node>,
    values: Vec<f64>,
    roots: Vec<usize>,
    results: Vec<f64>,
    machine: Machine,
}

impl Evaluator {
    /// Prepares the expressions; common subexpressions are computed once.
    pub fn new(arena: &Arena, roots: &[NodeId]) -> Self {
        let order = post_order(arena, roots);
        let position: FxHashMap<NodeId, usize> = order.iter().enumerate().map(|(k, &id)| (id, k)).collect();
        let tape: Vec<Node> =
            order.iter().map(|&id| arena.node(id).map(|operand| NodeId::new(position[&operand]))).collect();
        let values = vec![0.0; tape.len()];
        let roots: Vec<usize> = roots.iter().map(|root| position[root]).collect();
        let results = vec![0.0; roots.len()];
        Self { machine: Machine::of(arena, &tape), tape, values, roots, results }
    }

    /// The values of the expressions, in the order given to [`Evaluator::new`].
    ///
    /// `time` in s; `initial` is the value of `initial()`.
    pub fn evaluate(&mut self, slots: impl Fn(SlotId) -> f64, time: f64, initial: bool) -> &[f64] {
        for (k, &node) in self.tape.iter().enumerate() {
            self.values[k] = match node {
                Node::Const(number) => number.value(),
                Node::Slot(slot) => slots(slot),
                Node::Time => time,
                Node::Initial => truth(initial),
                Node::Homotopy => 1.0,
                Node::Apply(body, output, list) => self.machine.apply(&self.tape, &self.values, (body, output, list)),
                operation => operate(operation, |id| self.values[id.index()]),
            };
        }
        for (result, &root) in self.results.iter_mut().zip(&self.roots) {
            *result = self.values[root];
        }
        &self.results
    }
}

/// The value of one operation from the values of its operands; leaves other than numbers and calls of compiled functions
/// have none (NaN).  Generated code agrees to the last bit.
pub fn operate(node: Node, value: impl Fn(NodeId) -> f64) -> f64 {
    let holds = |id| value(id) != 0.0;
    match node {
        Node::Const(number) => number.value(),
        Node::Slot(_) | Node::Time | Node::Initial | Node::Homotopy | Node::Pair(..) | Node::Apply(..) => f64::NAN,
        Node::Neg(a) => -value(a),
        Node::Not(a) => truth(!holds(a)),
        Node::Add(a, b) => value(a) + value(b),
        Node::Sub(a, b) => value(a) - value(b),
        Node::Mul(a, b) => value(a) * value(b),
        Node::Div(a, b) => value(a) / value(b),
        Node::And(a, b) => truth(holds(a) && holds(b)),
        Node::Or(a, b) => truth(holds(a) || holds(b)),
        Node::Compare(relation, a, b) | Node::Event(relation, a, b) => truth(relation.holds(value(a), value(b))),
        Node::If(c, a, b) => value(if holds(c) { a } else { b }),
        Node::Call1(function, a) => function.apply(value(a), 0.0),
        Node::Call2(function, a, b) => signed_zero(function, value(a), value(b)),
    }
}

/// `min` and `max` as the machine instruction has them: -0 is below +0 (the language leaves it open).
fn signed_zero(function: Function, a: f64, b: f64) -> f64 {
    match function {
        Function::Min if a == 0.0 && b == 0.0 => {
            if a.is_sign_negative() || b.is_sign_negative() {
                -0.0
            } else {
                0.0
            }
        }
        Function::Max if a == 0.0 && b == 0.0 => {
            if a.is_sign_negative() && b.is_sign_negative() {
                -0.0
            } else {
                0.0
            }
        }
        _ => function.apply(a, b),
    }
}

impl Relation {
    /// True if `a` stands in this relation to `b`; with NaN only `<>` holds.
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Relation::Less => a < b,
            Relation::LessEqual => a <= b,
            Relation::Greater => a > b,
            Relation::GreaterEqual => a >= b,
            Relation::Equal => a == b,
            Relation::NotEqual => a != b,
        }
    }
}

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_node_has_its_value() {
        let mut arena = Arena::new();
        let (x, time, start) = (arena.slot(SlotId(0)), arena.intern(Node::Time), arena.intern(Node::Initial));
        let below = arena.intern(Node::Event(Relation::Less, x, time));
        let both = arena.intern(Node::And(below, start));
        let power = arena.intern(Node::Call2(Function::Pow, x, time));
        let minus = arena.intern(Node::Neg(power));
        let root = arena.intern(Node::If(both, power, minus));
        let mut evaluator = Evaluator::new(&arena, &[root, both]);
        assert_eq!(evaluator.evaluate(|_| 2.0, 3.0, true), [8.0, 1.0]);
        assert_eq!(evaluator.evaluate(|_| 2.0, 3.0, false), [-8.0, 0.0]);
        assert_eq!(evaluator.evaluate(|_| 3.0, 2.0, true), [-9.0, 0.0]);
    }

    #[test]
    fn a_sum_of_a_hundred_thousand_terms_needs_no_deep_stack() {
        let mut arena = Arena::new();
        let x = arena.slot(SlotId(0));
        let mut sum = x;
        for _ in 1..100_000 {
            sum = arena.intern(Node::Add(sum, x));
        }
        assert_eq!(eval(&arena, sum, |_| 0.5, 0.0, false), 50_000.0);
    }
}

//! Constructors that simplify: the way to build expressions.
//!
//! Each looks only at its operands, which are simplified already, and applies identities that hold exactly in IEEE 754
//! arithmetic for finite values (`x + 0`, `x*1`, `--x`) or that every Modelica tool takes for granted (`x*0 = 0`,
//! `x - x = 0`, `x^2 = x*x`).  Signs move outwards, numbers to the front of products.  Numbers are folded with the
//! functions of the simulation, but never into NaN or infinity: such an operation stays, and the run reports it.
//! Sums and products are not reassociated: that would change rounding.

use crate::eval::operate;
use crate::machine::Machine;
use crate::node::{Arena, BodyId, Node, NodeId, Relation};
use crate::order::post_order;
use hyd_system::math::Function;
use rustc_hash::FxHashMap;

/// Rebuilds an expression with the simplifying constructors, for expressions that were interned as they stood.
pub fn simplify(arena: &mut Arena, root: NodeId) -> NodeId {
    let mut new: FxHashMap<NodeId, NodeId> = FxHashMap::default();
    for id in post_order(arena, &[root]) {
        let node = arena.node(id).map(|operand| new[&operand]);
        new.insert(id, arena.build(node));
    }
    new[&root]
}

impl Arena {
    /// The operation, simplified; operands should be simplified already.
    pub fn build(&mut self, node: Node) -> NodeId {
        match node {
            Node::Const(_) | Node::Slot(_) | Node::Time | Node::Initial | Node::Homotopy => self.intern(node),
            Node::Neg(a) => self.neg(a),
            Node::Not(a) => self.not(a),
            Node::Add(a, b) => self.add(a, b),
            Node::Sub(a, b) => self.sub(a, b),
            Node::Mul(a, b) => self.mul(a, b),
            Node::Div(a, b) => self.div(a, b),
            Node::And(a, b) => self.and(a, b),
            Node::Or(a, b) => self.or(a, b),
            Node::Compare(relation, a, b) => self.compare(relation, a, b),
            Node::Event(relation, a, b) => self.event(relation, a, b),
            Node::If(c, a, b) => self.select(c, a, b),
            Node::Call1(function, a) => self.call1(function, a),
            Node::Call2(function, a, b) => self.call2(function, a, b),
            Node::Pair(..) => self.intern(node),
            Node::Apply(body, output, list) => self.apply(body, output, list),
        }
    }

    /// An output of a compiled function; computed at once where all arguments are numbers.
    pub fn apply(&mut self, body: BodyId, output: u32, list: NodeId) -> NodeId {
        let arguments = self.arguments(list);
        let known: Option<Vec<f64>> = arguments.iter().map(|&id| self.as_constant(id)).collect();
        if let Some(known) = known
            && let Ok(results) = Machine::new(self, &[body]).call(body, &known)
            && let Some(value) = results.get(output as usize).filter(|value| value.is_finite())
        {
            return self.constant(*value);
        }
        self.intern(Node::Apply(body, output, list))
    }

    /// `a + b`
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if self.is(a, 0.0) {
            return b;
        }
        if self.is(b, 0.0) {
            return a;
        }
        let node = Node::Add(a, b);
        if self.all_constant(node) {
            return self.fold(node);
        }
        if let Some(positive) = self.without_minus(b) {
            return self.sub(a, positive);
        }
        if let Some(positive) = self.without_minus(a) {
            return self.sub(b, positive);
        }
        self.intern(node)
    }

    /// `a - b`
    pub fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == b {
            return self.constant(0.0);
        }
        if self.is(b, 0.0) {
            return a;
        }
        if self.is(a, 0.0) {
            return self.neg(b);
        }
        let node = Node::Sub(a, b);
        if self.all_constant(node) {
            return self.fold(node);
        }
        if let Some(positive) = self.without_minus(b) {
            return self.add(a, positive);
        }
        self.intern(node)
    }

    /// `a * b`
    pub fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let node = Node::Mul(a, b);
        match (self.as_constant(a), self.as_constant(b)) {
            (Some(_), Some(_)) => self.fold(node),
            (None, Some(_)) => self.mul(b, a),
            (Some(factor), None) => self.scale(factor, b),
            (None, None) => match (self.without_minus(a), self.without_minus(b)) {
                (None, None) => self.intern(node),
                (Some(a), Some(b)) => self.mul(a, b),
                (positive_a, positive_b) => {
                    let product = self.mul(positive_a.unwrap_or(a), positive_b.unwrap_or(b));
                    self.neg(product)
                }
            },
        }
    }

    /// `factor * b` for `b` not a number.
    fn scale(&mut self, factor: f64, b: NodeId) -> NodeId {
        if factor == 0.0 {
            return self.constant(0.0);
        }
        if factor == 1.0 {
            return b;
        }
        if factor == -1.0 {
            return self.neg(b);
        }
        if let Some(positive) = self.without_minus(b) {
            let factor = self.constant(-factor);
            return self.mul(factor, positive);
        }
        let factor = self.constant(factor);
        self.intern(Node::Mul(factor, b))
    }

    /// `a / b`
    pub fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if self.is(b, 1.0) {
            return a;
        }
        if self.is(a, 0.0) && !self.is(b, 0.0) {
            return a;
        }
        let node = Node::Div(a, b);
        if self.all_constant(node) {
            return self.fold(node);
        }
        if let Some(positive) = self.without_minus(b) {
            let quotient = self.div(a, positive);
            return self.neg(quotient);
        }
        if self.as_constant(a).is_none()
            && let Some(positive) = self.without_minus(a)
        {
            let quotient = self.div(positive, b);
            return self.neg(quotient);
        }
        self.intern(node)
    }

    /// `-a`
    pub fn neg(&mut self, a: NodeId) -> NodeId {
        match self.node(a) {
            Node::Sub(x, y) => self.sub(y, x),
            Node::Mul(x, y) | Node::Div(x, y) if self.as_constant(x).is_some() => {
                let x = self.neg(x);
                match self.node(a) {
                    Node::Mul(..) => self.mul(x, y),
                    _ => self.div(x, y),
                }
            }
            Node::Neg(x) => x,
            Node::Const(number) => self.constant(-number.value()),
            _ => self.intern(Node::Neg(a)),
        }
    }

    /// `a ^ b`
    pub fn pow(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let node = Node::Call2(Function::Pow, a, b);
        if self.all_constant(node) {
            return self.fold(node);
        }
        if self.is(a, 1.0) {
            return a;
        }
        match self.as_constant(b) {
            Some(0.0) => self.constant(1.0),
            Some(1.0) => a,
            Some(2.0) => self.mul(a, a),
            Some(3.0) => {
                let square = self.mul(a, a);
                self.mul(square, a)
            }
            Some(4.0) => {
                let square = self.mul(a, a);
                self.mul(square, square)
            }
            Some(0.5) => self.call1(Function::Sqrt, a),
            Some(-1.0) => {
                let one = self.constant(1.0);
                self.div(one, a)
            }
            _ => self.intern(node),
        }
    }

    /// A function of one argument.
    pub fn call1(&mut self, function: Function, a: NodeId) -> NodeId {
        debug_assert_eq!(function.arity(), 1, "invariant: {} takes two arguments", function.name());
        let node = Node::Call1(function, a);
        if self.all_constant(node) {
            return self.fold(node);
        }
        if function == Function::Abs {
            if let Node::Call1(Function::Abs, _) = self.node(a) {
                return a;
            }
            if let Some(positive) = self.without_minus(a) {
                return self.call1(Function::Abs, positive);
            }
        }
        self.intern(node)
    }

    /// A function of two arguments.
    pub fn call2(&mut self, function: Function, a: NodeId, b: NodeId) -> NodeId {
        debug_assert_eq!(function.arity(), 2, "invariant: {} takes one argument", function.name());
        if function == Function::Pow {
            return self.pow(a, b);
        }
        let node = Node::Call2(function, a, b);
        if self.all_constant(node) {
            return self.fold(node);
        }
        if a == b && matches!(function, Function::Min | Function::Max) {
            return a;
        }
        self.intern(node)
    }

    /// `not a`
    pub fn not(&mut self, a: NodeId) -> NodeId {
        match self.node(a) {
            Node::Const(_) => self.fold(Node::Not(a)),
            Node::Not(x) => x,
            // NaN is unequal to everything, so these two are opposites; `<` and `>=` are not.
            Node::Compare(Relation::Equal, x, y) => self.compare(Relation::NotEqual, x, y),
            Node::Compare(Relation::NotEqual, x, y) => self.compare(Relation::Equal, x, y),
            _ => self.intern(Node::Not(a)),
        }
    }

    /// `a and b`
    pub fn and(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let node = Node::And(a, b);
        match (self.as_constant(a), self.as_constant(b)) {
            (Some(_), Some(_)) => self.fold(node),
            (Some(0.0), _) | (_, Some(0.0)) => self.constant(0.0),
            (Some(_), _) => b,
            (_, Some(_)) => a,
            _ if a == b => a,
            _ => self.intern(node),
        }
    }

    /// `a or b`
    pub fn or(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let node = Node::Or(a, b);
        match (self.as_constant(a), self.as_constant(b)) {
            (Some(_), Some(_)) => self.fold(node),
            (Some(0.0), _) => b,
            (_, Some(0.0)) => a,
            (Some(_), _) | (_, Some(_)) => self.constant(1.0),
            _ if a == b => a,
            _ => self.intern(node),
        }
    }

    /// A relation evaluated literally.
    pub fn compare(&mut self, relation: Relation, a: NodeId, b: NodeId) -> NodeId {
        self.relate(Node::Compare(relation, a, b), relation, a == b)
    }

    /// A relation whose change of truth is an event.
    pub fn event(&mut self, relation: Relation, a: NodeId, b: NodeId) -> NodeId {
        self.relate(Node::Event(relation, a, b), relation, a == b)
    }

    fn relate(&mut self, node: Node, relation: Relation, same: bool) -> NodeId {
        if self.all_constant(node) {
            return self.fold(node);
        }
        // Nothing is below or above itself, not even NaN; `x == x` is left, because NaN differs from itself.
        if same && matches!(relation, Relation::Less | Relation::Greater) {
            return self.constant(0.0);
        }
        self.intern(node)
    }

    /// `if c then a else b`
    pub fn select(&mut self, c: NodeId, a: NodeId, b: NodeId) -> NodeId {
        if let Some(truth) = self.as_constant(c) {
            return if truth != 0.0 { a } else { b };
        }
        if a == b {
            return a;
        }
        match self.node(c) {
            Node::Not(opposite) => self.select(opposite, b, a),
            _ => self.intern(Node::If(c, a, b)),
        }
    }

    /// True if the node is this number.
    pub fn is(&self, id: NodeId, value: f64) -> bool {
        self.as_constant(id) == Some(value)
    }

    fn all_constant(&self, node: Node) -> bool {
        node.operands().all(|operand| self.as_constant(operand).is_some())
    }

    /// The number an operation on numbers yields; the operation itself where that is not finite.
    fn fold(&mut self, node: Node) -> NodeId {
        let value = operate(node, |id| self.as_constant(id).unwrap_or(f64::NAN));
        if value.is_finite() { self.constant(value) } else { self.intern(node) }
    }

    /// `x` for an operation that reads as `-x`: a negation, a negative number, or a product or quotient led by one.
    fn without_minus(&mut self, id: NodeId) -> Option<NodeId> {
        let leads = |arena: &Arena, x| arena.as_constant(x).is_some_and(|value| value < 0.0);
        match self.node(id) {
            Node::Neg(x) => Some(x),
            Node::Const(_) if leads(self, id) => Some(self.neg(id)),
            Node::Mul(x, _) | Node::Div(x, _) if leads(self, x) => Some(self.neg(id)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::SlotId;
    use crate::print::print;

    /// The simplified expression of slots x, y and the numbers 0, 1 as text.
    fn shown(make: impl Fn(&mut Arena, NodeId, NodeId) -> NodeId) -> String {
        let mut arena = Arena::new();
        let [x, y] = [0, 1].map(|k| arena.slot(SlotId(k)));
        let root = make(&mut arena, x, y);
        print(&arena, root, &|slot| ["x", "y"][slot.0 as usize].to_string())
    }

    /// `operation(x, number)` and `operation(number, x)` as text.
    fn with_number(number: f64, operation: fn(&mut Arena, NodeId, NodeId) -> NodeId) -> [String; 2] {
        let first = shown(|m, x, _| {
            let number = m.constant(number);
            operation(m, x, number)
        });
        let second = shown(|m, x, _| {
            let number = m.constant(number);
            operation(m, number, x)
        });
        [first, second]
    }

    #[test]
    fn neutral_and_absorbing_numbers_vanish() {
        assert_eq!(with_number(0.0, Arena::add), ["x", "x"]);
        assert_eq!(with_number(0.0, Arena::sub), ["x", "-x"]);
        assert_eq!(with_number(0.0, Arena::mul), ["0", "0"]);
        assert_eq!(with_number(1.0, Arena::mul), ["x", "x"]);
        assert_eq!(with_number(-1.0, Arena::mul), ["-x", "-x"]);
        assert_eq!(with_number(0.0, Arena::div), ["x/0", "0"]);
        assert_eq!(with_number(1.0, Arena::div), ["x", "1/x"]);
        assert_eq!(with_number(-2.0, Arena::div), ["-x/2", "-2/x"]);
        assert_eq!(with_number(-2.0, Arena::add), ["x - 2", "x - 2"]);
        assert_eq!(with_number(0.0, Arena::and), ["0", "0"]);
        assert_eq!(with_number(1.0, Arena::and), ["x", "x"]);
        assert_eq!(with_number(0.0, Arena::or), ["x", "x"]);
        assert_eq!(with_number(1.0, Arena::or), ["1", "1"]);
    }

    #[test]
    fn powers_become_products_and_roots() {
        let powers = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 0.5, -1.0].map(|n| with_number(n, Arena::pow)[0].clone());
        assert_eq!(powers, ["1", "x", "x*x", "x*x*x", "x*x*(x*x)", "x^5", "sqrt(x)", "1/x"]);
        assert_eq!(with_number(1.0, Arena::pow)[1], "1");
    }

    #[test]
    fn signs_move_outwards() {
        let minus = |operation: fn(&mut Arena, NodeId, NodeId) -> NodeId| {
            let left = shown(|m, x, y| {
                let x = m.neg(x);
                operation(m, x, y)
            });
            let right = shown(|m, x, y| {
                let y = m.neg(y);
                operation(m, x, y)
            });
            let both = shown(|m, x, y| {
                let (x, y) = (m.neg(x), m.neg(y));
                operation(m, x, y)
            });
            [left, right, both]
        };
        assert_eq!(minus(Arena::add), ["y - x", "x - y", "-x - y"]);
        assert_eq!(minus(Arena::sub), ["-x - y", "x + y", "y - x"]);
        assert_eq!(minus(Arena::mul), ["-x*y", "-x*y", "x*y"]);
        assert_eq!(minus(Arena::div), ["-x/y", "-x/y", "x/y"]);
        let difference = shown(|m, x, y| {
            let difference = m.sub(x, y);
            m.neg(difference)
        });
        let scaled = shown(|m, x, y| {
            let three = m.constant(-3.0);
            let scaled = m.mul(x, three);
            m.sub(y, scaled)
        });
        assert_eq!((difference.as_str(), scaled.as_str()), ("y - x", "y + 3*x"));
    }

    #[test]
    fn numbers_fold_only_to_finite_values() {
        let folded = |function, a: f64| {
            shown(|m, _, _| {
                let a = m.constant(a);
                m.call1(function, a)
            })
        };
        assert_eq!([folded(Function::Sqrt, 9.0), folded(Function::Log, 1.0)], ["3", "0"]);
        assert_eq!([folded(Function::Sqrt, -9.0), folded(Function::Log, 0.0)], ["sqrt(-9)", "log(0)"]);
        let zero_by_zero = shown(|m, _, _| {
            let zero = m.constant(0.0);
            m.div(zero, zero)
        });
        let overflow = shown(|m, _, _| {
            let large = m.constant(1e300);
            m.mul(large, large)
        });
        assert_eq!((zero_by_zero.as_str(), overflow.as_str()), ("0/0", "1e300*1e300"));
    }

    #[test]
    fn relations_mind_values_that_are_not_numbers() {
        let not = |relation| {
            shown(|m, x, y| {
                let relation = m.compare(relation, x, y);
                m.not(relation)
            })
        };
        let same = |relation| shown(|m, x, _| m.compare(relation, x, x));
        assert_eq!([not(Relation::Equal), not(Relation::NotEqual)], ["noEvent(x <> y)", "noEvent(x == y)"]);
        assert_eq!(not(Relation::Less), "not noEvent(x < y)");
        assert_eq!([same(Relation::Less), same(Relation::LessEqual)], ["0", "noEvent(x <= x)"]);
    }

    #[test]
    fn choices_that_are_none_vanish() {
        let swapped = shown(|m, x, y| {
            let not = m.not(x);
            m.select(not, x, y)
        });
        assert_eq!([shown(|m, x, y| m.select(x, y, y)), swapped], ["y", "if x then y else x"]);
        let fixed = shown(|m, x, y| {
            let (one, two) = (m.constant(1.0), m.constant(2.0));
            let condition = m.event(Relation::Less, one, two);
            m.select(condition, x, y)
        });
        assert_eq!(fixed, "x");
    }
}

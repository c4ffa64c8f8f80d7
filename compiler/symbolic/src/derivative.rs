//! Derivatives, by the rules of the textbook.
//!
//! One forward sweep over the post-order carries for each node its derivative, or nothing where that is zero
//! (Griewank and Walther 2008, chapter 3.1, with expressions in place of numbers).  The function value is reused
//! where the rule allows (`tanh' = 1 - tanh^2`, `sqrt' = 0.5/sqrt`), so value and derivative share subexpressions.
//! Piecewise functions are differentiated piece by piece: relations, `sign`, `floor`, `ceil` and `div` have
//! derivative 0, `if` keeps its condition, and on an edge `min` and `max` take the side of the first argument.

use crate::node::{Arena, Node, NodeId, Relation, SlotId};
use crate::order::post_order;
use hyd_system::math::Function;
use rustc_hash::{FxHashMap, FxHashSet};

/// The partial derivative with respect to what stands in `slot`.
pub fn partial(arena: &mut Arena, root: NodeId, slot: SlotId) -> NodeId {
    let one = arena.constant(1.0);
    tangent(arena, root, |leaf| (leaf == Node::Slot(slot)).then_some(one))
}

/// The partial derivative with respect to time, all slots held.
pub fn partial_time(arena: &mut Arena, root: NodeId) -> NodeId {
    let one = arena.constant(1.0);
    tangent(arena, root, |leaf| (leaf == Node::Time).then_some(one))
}

/// What the slots do while an expression is differentiated.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Along {
    /// They move along a solution of the model, each with its own rate.
    Time,
    /// Any of them may move while the others are held.
    Any,
}

/// The derivative along a direction: `seed` gives the derivative of each slot and of time, nothing meaning 0.
pub fn tangent(arena: &mut Arena, root: NodeId, seed: impl FnMut(Node) -> Option<NodeId>) -> NodeId {
    along(arena, root, Along::Any, seed)
}

/// The total derivative with respect to time: `seed` gives the rate of each slot in a solution of the model, and 1 for time.
///
/// Other than along any direction, a derivative that the author of a function gives may count on what the model says of the
/// rates of some arguments (`noDerivative`, Modelica 3.6, section 12.7.1).
pub fn time_derivative(arena: &mut Arena, root: NodeId, seed: impl FnMut(Node) -> Option<NodeId>) -> NodeId {
    along(arena, root, Along::Time, seed)
}

fn along(arena: &mut Arena, root: NodeId, along: Along, seed: impl FnMut(Node) -> Option<NodeId>) -> NodeId {
    let order = post_order(arena, &[root]);
    match sweep(arena, &order, along, seed) {
        Some(derivative) => derivative,
        None => arena.constant(0.0),
    }
}

/// The partial derivatives with respect to all slots that occur, in order of first occurrence.
///
/// Terms of a sum are differentiated apart, so that a long sum over many slots costs no more than its terms do.
/// Derivatives that are 0 everywhere are listed too.
pub fn gradient(arena: &mut Arena, root: NodeId) -> Vec<(SlotId, NodeId)> {
    let mut list: Vec<(SlotId, NodeId)> = Vec::new();
    let mut place: FxHashMap<SlotId, usize> = FxHashMap::default();
    let zero = arena.constant(0.0);
    let one = arena.constant(1.0);
    for (term, negative) in terms(arena, root) {
        let order = post_order(arena, &[term]);
        let slots: Vec<SlotId> = order.iter().filter_map(|&id| slot_of(arena, id)).collect();
        for slot in slots {
            let derivative =
                sweep(arena, &order, Along::Any, |leaf| (leaf == Node::Slot(slot)).then_some(one)).unwrap_or(zero);
            let at = *place.entry(slot).or_insert_with(|| {
                list.push((slot, zero));
                list.len() - 1
            });
            let sum = list[at].1;
            list[at].1 = if negative { arena.sub(sum, derivative) } else { arena.add(sum, derivative) };
        }
    }
    list
}

fn slot_of(arena: &Arena, id: NodeId) -> Option<SlotId> {
    match arena.node(id) {
        Node::Slot(slot) => Some(slot),
        _ => None,
    }
}

/// The terms of a sum with their signs (true: subtracted), left to right.
///
/// A sum with a shared partial sum is not taken apart, because its terms could be exponentially many.
fn terms(arena: &Arena, root: NodeId) -> Vec<(NodeId, bool)> {
    let mut terms = Vec::new();
    let mut sums = FxHashSet::default();
    let mut stack = vec![(root, false)];
    while let Some((id, negative)) = stack.pop() {
        let node = arena.node(id);
        if !matches!(node, Node::Add(..) | Node::Sub(..) | Node::Neg(_)) {
            terms.push((id, negative));
            continue;
        }
        if !sums.insert(id) {
            return vec![(root, false)];
        }
        match node {
            Node::Add(a, b) => stack.extend([(b, negative), (a, negative)]),
            Node::Sub(a, b) => stack.extend([(b, !negative), (a, negative)]),
            Node::Neg(a) => stack.push((a, !negative)),
            _ => {}
        }
    }
    terms
}

/// Derivative of the last node of a post-order; none if it is zero.
fn sweep(
    arena: &mut Arena,
    order: &[NodeId],
    along: Along,
    mut seed: impl FnMut(Node) -> Option<NodeId>,
) -> Option<NodeId> {
    let mut known: FxHashMap<NodeId, NodeId> = FxHashMap::default();
    for &id in order {
        let derivative = match arena.node(id) {
            leaf @ (Node::Slot(_) | Node::Time) => seed(leaf),
            node if node.operands().any(|operand| known.contains_key(&operand)) => {
                derive(arena, (id, node), along, |operand| known.get(&operand).copied())
            }
            _ => None,
        };
        if let Some(derivative) = derivative.filter(|&derivative| !arena.is(derivative, 0.0)) {
            known.insert(id, derivative);
        }
    }
    known.get(order.last()?).copied()
}

/// Derivative of the operation `node` with id `id`, from the derivatives `d` of its operands.
fn derive(
    arena: &mut Arena,
    (id, node): (NodeId, Node),
    along: Along,
    d: impl Fn(NodeId) -> Option<NodeId>,
) -> Option<NodeId> {
    match node {
        Node::Neg(a) => d(a).map(|da| arena.neg(da)),
        Node::Add(a, b) => plus(arena, d(a), d(b)),
        Node::Sub(a, b) => minus(arena, d(a), d(b)),
        Node::Mul(a, b) => product(arena, (a, d(a)), (b, d(b))),
        Node::Div(a, b) => match (d(a), shifted_exponential(arena, b)) {
            (None, Some((k, u))) => d(u).map(|du| logistic(arena, id, (k, u), du)),
            (da, _) => quotient(arena, id, (a, da), (b, d(b))),
        },
        Node::If(c, a, b) => branches(arena, c, d(a), d(b)),
        Node::Call1(function, a) => {
            let inner = d(a)?;
            let outer = slope(arena, function, id, a)?;
            Some(if function == Function::Sqrt { steep_chain(arena, outer, inner) } else { chain(arena, outer, inner) })
        }
        Node::Call2(function, a, b) => slope2(arena, function, id, (a, d(a)), (b, d(b))),
        Node::Not(_) | Node::And(..) | Node::Or(..) | Node::Compare(..) | Node::Event(..) => None,
        // Marks that an argument varies; calls look at the arguments one by one.
        Node::Pair(..) => Some(id),
        Node::Apply(body, output, list) => {
            let arguments = arena.arguments(list);
            let rates: Vec<Option<NodeId>> = arguments.iter().map(|&argument| d(argument)).collect();
            crate::body_derivative::apply(arena, (body, output), along, &arguments, &rates)
        }
        Node::Const(_) | Node::Slot(_) | Node::Time | Node::Initial | Node::Homotopy => None,
    }
}

fn plus(arena: &mut Arena, a: Option<NodeId>, b: Option<NodeId>) -> Option<NodeId> {
    match (a, b) {
        (Some(a), Some(b)) => Some(arena.add(a, b)),
        _ => a.or(b),
    }
}

fn minus(arena: &mut Arena, a: Option<NodeId>, b: Option<NodeId>) -> Option<NodeId> {
    match (a, b) {
        (Some(a), Some(b)) => Some(arena.sub(a, b)),
        (None, Some(b)) => Some(arena.neg(b)),
        _ => a,
    }
}

/// Chain rule: outer derivative times inner one.
fn chain(arena: &mut Arena, outer: NodeId, inner: NodeId) -> NodeId {
    arena.mul(outer, inner)
}

/// The same where the outer derivative may be infinite: nothing where the inner one is zero over a stretch, as for
/// `sqrt(max(x, 0))` below zero, and not the product of the two, which is not a number.
fn steep_chain(arena: &mut Arena, outer: NodeId, inner: NodeId) -> NodeId {
    let product = chain(arena, outer, inner);
    let is_piecewise = post_order(arena, &[inner]).iter().any(|&id| matches!(arena.node(id), Node::If(..)));
    if !is_piecewise {
        return product;
    }
    let zero = arena.constant(0.0);
    let is_flat = arena.compare(Relation::Equal, inner, zero);
    arena.select(is_flat, zero, product)
}

/// An operand with its derivative.
type Operand = (NodeId, Option<NodeId>);

fn product(arena: &mut Arena, (a, da): Operand, (b, db): Operand) -> Option<NodeId> {
    if a == b {
        let two = arena.constant(2.0);
        let outer = arena.mul(two, a);
        return da.map(|da| chain(arena, outer, da));
    }
    let left = da.map(|da| arena.mul(da, b));
    let right = db.map(|db| arena.mul(a, db));
    plus(arena, left, right)
}

/// `k` and `u` of `k + exp(u)`.
fn shifted_exponential(arena: &Arena, id: NodeId) -> Option<(NodeId, NodeId)> {
    let Node::Add(a, b) = arena.node(id) else { return None };
    let power = |id: NodeId| match arena.node(id) {
        Node::Call1(Function::Exp, u) => Some(u),
        _ => None,
    };
    let is_positive = |k: NodeId| arena.as_constant(k).is_some_and(|k| k > 0.0 && k.is_finite());
    match (power(a), power(b)) {
        (Some(u), None) if is_positive(b) => Some((b, u)),
        (None, Some(u)) if is_positive(a) => Some((a, u)),
        _ => None,
    }
}

/// `(a/(k + exp(u)))' = -(a/(k + exp(u))) u'/(1 + k exp(-u))` for a constant `a`: the quotient of `exp(u)` and `k + exp(u)`
/// is finite where the two are not, as in regularised signs `2/(1 + exp(-x/x0)) - 1` far from zero.
fn logistic(arena: &mut Arena, id: NodeId, (k, u): (NodeId, NodeId), du: NodeId) -> NodeId {
    let down = arena.neg(u);
    let fading = arena.call1(Function::Exp, down);
    let (one, scaled) = (arena.constant(1.0), arena.mul(k, fading));
    let bound = arena.add(one, scaled);
    let product = arena.mul(id, du);
    let slope = arena.div(product, bound);
    arena.neg(slope)
}

/// `(a/b)' = (a' - (a/b) b')/b`
fn quotient(arena: &mut Arena, id: NodeId, (_, da): Operand, (b, db): Operand) -> Option<NodeId> {
    let shrink = db.map(|db| arena.mul(id, db));
    let numerator = minus(arena, da, shrink)?;
    Some(arena.div(numerator, b))
}

fn branches(arena: &mut Arena, c: NodeId, da: Option<NodeId>, db: Option<NodeId>) -> Option<NodeId> {
    let zero = arena.constant(0.0);
    Some(arena.select(c, da.unwrap_or(zero), db.unwrap_or(zero)))
}

/// Derivative of a function of one argument at `a`; `id` is the function value.  None for steps.
fn slope(arena: &mut Arena, function: Function, id: NodeId, a: NodeId) -> Option<NodeId> {
    let one = arena.constant(1.0);
    let slope = match function {
        Function::Sin => arena.call1(Function::Cos, a),
        Function::Cos => {
            let sine = arena.call1(Function::Sin, a);
            arena.neg(sine)
        }
        Function::Tan => {
            let square = arena.mul(id, id);
            arena.add(one, square)
        }
        Function::Asin | Function::Acos => {
            let square = arena.mul(a, a);
            let rest = arena.sub(one, square);
            let root = arena.call1(Function::Sqrt, rest);
            let slope = arena.div(one, root);
            if function == Function::Asin { slope } else { arena.neg(slope) }
        }
        Function::Atan => {
            let square = arena.mul(a, a);
            let sum = arena.add(one, square);
            arena.div(one, sum)
        }
        Function::Sinh => arena.call1(Function::Cosh, a),
        Function::Cosh => arena.call1(Function::Sinh, a),
        Function::Tanh => {
            let square = arena.mul(id, id);
            arena.sub(one, square)
        }
        Function::Exp => id,
        Function::Log => arena.div(one, a),
        Function::Log10 => {
            let inverse = arena.constant(std::f64::consts::LOG10_E);
            arena.div(inverse, a)
        }
        Function::Sqrt => {
            let half = arena.constant(0.5);
            arena.div(half, id)
        }
        Function::Abs => arena.call1(Function::Sign, a),
        // The others are steps here; functions of two arguments have their rules in `slope2`.
        _ => return None,
    };
    Some(slope)
}

/// Derivative of a function of two arguments with value `id`.
fn slope2(arena: &mut Arena, function: Function, id: NodeId, (a, da): Operand, (b, db): Operand) -> Option<NodeId> {
    match function {
        Function::Pow => power(arena, id, (a, da), (b, db)),
        Function::Atan2 => {
            // atan2(y, x)' = (x y' - y x')/(x^2 + y^2)
            let gain = da.map(|da| arena.mul(b, da));
            let loss = db.map(|db| arena.mul(a, db));
            let numerator = minus(arena, gain, loss)?;
            let (yy, xx) = (arena.mul(a, a), arena.mul(b, b));
            let denominator = arena.add(xx, yy);
            Some(arena.div(numerator, denominator))
        }
        Function::Min | Function::Max => {
            let relation = if function == Function::Min { Relation::LessEqual } else { Relation::GreaterEqual };
            let first = arena.compare(relation, a, b);
            branches(arena, first, da, db)
        }
        // x - q y with q a step function of x/y.
        Function::Mod | Function::Rem => {
            let shrink = db.map(|db| {
                let quotient = whole_quotient(arena, function, a, b);
                arena.mul(quotient, db)
            });
            minus(arena, da, shrink)
        }
        _ => None,
    }
}

/// The integer q in `mod(a, b) = a - q b` or `rem(a, b) = a - q b`.
fn whole_quotient(arena: &mut Arena, function: Function, a: NodeId, b: NodeId) -> NodeId {
    if function == Function::Rem {
        return arena.call2(Function::Div, a, b);
    }
    let quotient = arena.div(a, b);
    arena.call1(Function::Floor, quotient)
}

/// `(u^v)' = v u^(v-1) u' + u^v log(u) v'`, the second term 0 up to `u = 0`: `0^v` is 0 for all positive `v`, and below zero only
/// integers `v` give a value, so that `v` stands still there.
fn power(arena: &mut Arena, id: NodeId, (u, du): Operand, (v, dv): Operand) -> Option<NodeId> {
    let base = du.map(|du| {
        let one = arena.constant(1.0);
        let less = arena.sub(v, one);
        let reduced = arena.pow(u, less);
        let outer = arena.mul(v, reduced);
        let is_steep = arena.as_constant(v).is_some_and(|exponent| exponent < 1.0);
        if is_steep { steep_chain(arena, outer, du) } else { chain(arena, outer, du) }
    });
    let exponent = dv.map(|dv| {
        let zero = arena.constant(0.0);
        let has_log = arena.compare(Relation::Greater, u, zero);
        let log = arena.call1(Function::Log, u);
        let outer = arena.mul(id, log);
        let outer = arena.select(has_log, outer, zero);
        chain(arena, outer, dv)
    });
    plus(arena, base, exponent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::print::print;

    /// A root of what is cut off has no slope where that is cut off, and none of `inf*0`.
    #[test]
    fn flat_stretches_below_a_root_are_flat() {
        let mut arena = Arena::new();
        let (x, zero) = (arena.slot(SlotId(0)), arena.constant(0.0));
        let cut = arena.call2(Function::Max, x, zero);
        let two = arena.constant(2.0);
        let twice = arena.mul(two, cut);
        let exponent = arena.constant(0.3);
        for root in [arena.call1(Function::Sqrt, twice), arena.pow(cut, exponent)] {
            let slope = partial(&mut arena, root, SlotId(0));
            let at = |value: f64| crate::eval(&arena, slope, |_| value, 0.0, false);
            assert_eq!(at(-0.5), 0.0);
            let difference = |value: f64| crate::eval(&arena, root, |_| value, 0.0, false);
            let expected = (difference(2.0 + 1e-6) - difference(2.0 - 1e-6)) / 2e-6;
            assert!((at(2.0) - expected).abs() < 1e-8, "{} {expected}", at(2.0));
        }
    }

    /// Far from zero the exponential has no value, but the quotient by it and its slope have.
    #[test]
    fn a_regularised_sign_has_slopes_everywhere() {
        let mut arena = Arena::new();
        let x = arena.slot(SlotId(0));
        let (one, two, scale) = (arena.constant(1.0), arena.constant(2.0), arena.constant(-10.0));
        let inner = arena.mul(scale, x);
        let power = arena.call1(Function::Exp, inner);
        let sum = arena.add(one, power);
        let sign = arena.div(two, sum);
        let slope = partial(&mut arena, sign, SlotId(0));
        let at = |node, value: f64| crate::eval(&arena, node, |_| value, 0.0, false);
        for far in [-80.0, 80.0] {
            assert_eq!(at(slope, far), 0.0);
        }
        for near in [-0.3, 0.0, 0.05] {
            let difference = (at(sign, near + 1e-6) - at(sign, near - 1e-6)) / 2e-6;
            assert!((at(slope, near) - difference).abs() < 1e-8, "{near}: {} {difference}", at(slope, near));
        }
    }

    fn name(slot: SlotId) -> String {
        ["x", "y", "dx", "dy"][slot.0 as usize].to_string()
    }

    /// d/dx as text.
    fn slope_of(make: impl Fn(&mut Arena, NodeId, NodeId) -> NodeId) -> String {
        let mut arena = Arena::new();
        let [x, y] = [0, 1].map(|k| arena.slot(SlotId(k)));
        let root = make(&mut arena, x, y);
        let derivative = partial(&mut arena, root, SlotId(0));
        print(&arena, derivative, &name)
    }

    #[test]
    fn functions_of_one_argument_follow_the_tables() {
        // Abramowitz and Stegun 1964, sections 4.1.46, 4.2.5, 4.3.105, 4.4.52 and 4.5.71 and following.
        let table = [
            (Function::Sin, "cos(x)"),
            (Function::Cos, "-sin(x)"),
            (Function::Tan, "1 + tan(x)*tan(x)"),
            (Function::Asin, "1/sqrt(1 - x*x)"),
            (Function::Acos, "-1/sqrt(1 - x*x)"),
            (Function::Atan, "1/(1 + x*x)"),
            (Function::Sinh, "cosh(x)"),
            (Function::Cosh, "sinh(x)"),
            (Function::Tanh, "1 - tanh(x)*tanh(x)"),
            (Function::Exp, "exp(x)"),
            (Function::Log, "1/x"),
            (Function::Log10, "0.4342944819032518/x"),
            (Function::Sqrt, "0.5/sqrt(x)"),
            (Function::Abs, "sign(x)"),
            (Function::Sign, "0"),
            (Function::Floor, "0"),
            (Function::Ceil, "0"),
        ];
        for (function, expected) in table {
            assert_eq!(slope_of(|m, x, _| m.call1(function, x)), expected, "{}", function.name());
        }
    }

    #[test]
    fn functions_of_two_arguments_follow_the_tables() {
        let table = [
            (Function::Atan2, "y/(y*y + x*x)", "-y/(x*x + y*y)"),
            (Function::Min, "if noEvent(x <= y) then 1 else 0", "if noEvent(y <= x) then 0 else 1"),
            (Function::Max, "if noEvent(x >= y) then 1 else 0", "if noEvent(y >= x) then 0 else 1"),
            (Function::Pow, "y*x^(y - 1)", "if noEvent(y > 0) then y^x*log(y) else 0"),
            (Function::Div, "0", "0"),
            (Function::Mod, "1", "-floor(y/x)"),
            (Function::Rem, "1", "-div(y, x)"),
        ];
        for (function, first, second) in table {
            assert_eq!(slope_of(|m, x, y| m.call2(function, x, y)), first, "{}", function.name());
            assert_eq!(slope_of(|m, x, y| m.call2(function, y, x)), second, "{}", function.name());
        }
    }

    #[test]
    fn arithmetic_reuses_what_is_there() {
        assert_eq!(slope_of(|m, x, y| m.mul(x, y)), "y");
        assert_eq!(slope_of(|m, x, _| m.mul(x, x)), "2*x");
        assert_eq!(slope_of(|m, x, y| m.div(y, x)), "-y/x/x");
        assert_eq!(slope_of(|m, _, y| m.mul(y, y)), "0");
        let choice = slope_of(|m, x, y| {
            let below = m.event(Relation::Less, x, y);
            let product = m.mul(x, y);
            m.select(below, product, y)
        });
        assert_eq!(choice, "if x < y then y else 0");
        let fifth = slope_of(|m, x, _| {
            let five = m.constant(5.0);
            m.pow(x, five)
        });
        assert_eq!(fifth, "5*(x*x*(x*x))");
    }

    #[test]
    fn the_total_time_derivative_of_a_pendulum_constraint() {
        // d/dt (x^2 + y^2 - time) = 2 x dx + 2 y dy - 1
        let mut arena = Arena::new();
        let [x, y, dx, dy] = [0, 1, 2, 3].map(|k| arena.slot(SlotId(k)));
        let (xx, yy, time) = (arena.mul(x, x), arena.mul(y, y), arena.intern(Node::Time));
        let sum = arena.add(xx, yy);
        let constraint = arena.sub(sum, time);
        let one = arena.constant(1.0);
        let rate = tangent(&mut arena, constraint, |leaf| match leaf {
            Node::Slot(SlotId(0)) => Some(dx),
            Node::Slot(SlotId(1)) => Some(dy),
            Node::Time => Some(one),
            _ => None,
        });
        assert_eq!(print(&arena, rate, &name), "2*x*dx + 2*y*dy - 1");
        let held = partial_time(&mut arena, constraint);
        assert_eq!(print(&arena, held, &name), "-1");
    }
}

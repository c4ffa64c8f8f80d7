//! Expressions as readable text in Modelica syntax, with no more parentheses than the structure needs.
//!
//! Every construct has a rank in the grammar (Modelica 3.6, appendix A.2.7); an operand is parenthesised where its
//! rank is below what its place asks for.  Sums and products associate to the left, so `a + (b + c)` keeps its
//! parentheses and the text means the same rounding.  Relations that cause no event read `noEvent(a < b)`.  The
//! printer works off a list of pieces instead of calling itself, and stops with `...` after [`LONGEST_TEXT`] bytes,
//! because an expression with shared parts can be exponentially longer as text.

use crate::node::{Arena, Node, NodeId, Relation, SlotId, Template};
use hyd_system::math::Function;
use rustc_hash::FxHashMap;

/// Text longer than this (in bytes) is cut.
pub const LONGEST_TEXT: usize = 1 << 20;

/// The expression as text; `name` gives what stands in a slot, parenthesised if it is not a single name or call.
pub fn print(arena: &Arena, root: NodeId, name: &dyn Fn(SlotId) -> String) -> String {
    let mut text = String::new();
    let mut todo = vec![Piece::Operand(root, Rank::Expression)];
    while let Some(piece) = todo.pop() {
        match piece {
            Piece::Text(piece) => text.push_str(piece),
            Piece::Owned(piece) => text.push_str(&piece),
            Piece::Operand(id, least) => expand(arena, id, least, name, &mut text, &mut todo),
        }
        if text.len() > LONGEST_TEXT {
            text.push_str("...");
            break;
        }
    }
    text
}

/// The expression as text where some slots read the negative of what they name: signs are merged into the operations
/// around them (`a - b` instead of `a + (-b)`).  With `flip`, the negative of the expression.
pub fn print_signed(
    arena: &Arena,
    root: NodeId,
    name: &dyn Fn(SlotId) -> String,
    negated: &dyn Fn(SlotId) -> bool,
    flip: bool,
) -> String {
    if !flip && !crate::slots(arena, &[root]).into_iter().any(negated) {
        return print(arena, root, name);
    }
    let mut scratch = Arena::new();
    scratch.bodies = arena.bodies.clone();
    let mut copied: FxHashMap<NodeId, NodeId> = FxHashMap::default();
    let mut last = scratch.constant(0.0);
    for id in crate::post_order(arena, &[root]) {
        last = match arena.node(id) {
            Node::Slot(slot) if negated(slot) => {
                let plain = scratch.slot(slot);
                scratch.neg(plain)
            }
            // The scratch table knows no compiled functions, only their names.
            node @ (Node::Pair(..) | Node::Apply(..)) => scratch.intern(node.map(|operand| copied[&operand])),
            node => scratch.build(node.map(|operand| copied[&operand])),
        };
        copied.insert(id, last);
    }
    let root = if flip { scratch.neg(last) } else { last };
    print(&scratch, root, name)
}

/// The equation as text, `left = right`.
pub fn print_template(arena: &Arena, template: &Template, name: &dyn Fn(SlotId) -> String) -> String {
    // An `if` on the left would swallow the rest of the line.
    let left = match arena.node(template.left) {
        Node::If(..) => format!("({})", print(arena, template.left, name)),
        _ => print(arena, template.left, name),
    };
    format!("{left} = {}", print(arena, template.right, name))
}

/// A number as text that reads back as the same number: `3`, `0.25`, `1e-6`, `2.5e8`.
pub fn format_number(value: f64) -> String {
    let scientific = format!("{value:e}");
    let exponent = scientific.split_once('e').and_then(|(_, digits)| digits.parse::<i32>().ok());
    match exponent {
        Some(-4..=5) => format!("{value}"),
        // Infinite values and NaN have no exponent and no literal either.
        None => format!("{value}"),
        _ => scientific,
    }
}

/// Ranks of the grammar, loosest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    Expression,
    Disjunction,
    Conjunction,
    Negation,
    Relation,
    Sum,
    Product,
    Power,
    Primary,
}

/// What is still to be printed.
enum Piece {
    Text(&'static str),
    Owned(String),
    /// An operand in a place that asks for at least this rank.
    Operand(NodeId, Rank),
}

/// Prints a leaf, or puts the pieces of an operation on the list.
fn expand(
    arena: &Arena,
    id: NodeId,
    least: Rank,
    name: &dyn Fn(SlotId) -> String,
    text: &mut String,
    todo: &mut Vec<Piece>,
) {
    let parenthesised = rank(arena, id) < least;
    if parenthesised {
        text.push('(');
        todo.push(Piece::Text(")"));
    }
    match arena.node(id) {
        Node::Const(number) => text.push_str(&format_number(number.value())),
        Node::Slot(slot) => text.push_str(&name(slot)),
        Node::Apply(body, output, list) => {
            let body = arena.body(body);
            text.push_str(&body.name);
            text.push('(');
            let result = body.outputs.get(output as usize).filter(|_| output > 0);
            todo.push(Piece::Owned(result.map_or_else(|| ")".into(), |o| format!(").{}", o.name))));
            todo.push(Piece::Operand(list, Rank::Expression));
        }
        node => {
            let first = todo.len();
            pieces(arena, node, todo);
            todo[first..].reverse();
        }
    }
}

/// The rank of a construct.  A leading minus makes a product a sum: `-2*x` cannot be a factor.
fn rank(arena: &Arena, id: NodeId) -> Rank {
    let negative = |id| arena.as_constant(id).is_some_and(|value| value < 0.0);
    match arena.node(id) {
        Node::If(..) => Rank::Expression,
        Node::Or(..) => Rank::Disjunction,
        Node::And(..) => Rank::Conjunction,
        Node::Not(_) => Rank::Negation,
        Node::Event(..) => Rank::Relation,
        Node::Add(..) | Node::Sub(..) | Node::Neg(_) => Rank::Sum,
        Node::Const(_) if negative(id) => Rank::Sum,
        Node::Mul(a, _) | Node::Div(a, _) if negative(a) => Rank::Sum,
        Node::Mul(..) | Node::Div(..) => Rank::Product,
        Node::Call2(Function::Pow, ..) => Rank::Power,
        _ => Rank::Primary,
    }
}

/// The pieces of an operation, in reading order.
fn pieces(arena: &Arena, node: Node, list: &mut Vec<Piece>) {
    use Piece::{Operand, Text};
    // A number needs no parentheses in front of a product, not even a negative one.
    let factor = |a| Operand(a, if arena.as_constant(a).is_some() { Rank::Expression } else { Rank::Product });
    match node {
        Node::Neg(a) => list.extend([Text("-"), Operand(a, Rank::Product)]),
        Node::Not(a) => list.extend([Text("not "), Operand(a, Rank::Relation)]),
        Node::Add(a, b) => list.extend([Operand(a, Rank::Sum), Text(" + "), Operand(b, Rank::Product)]),
        Node::Sub(a, b) => list.extend([Operand(a, Rank::Sum), Text(" - "), Operand(b, Rank::Product)]),
        Node::Mul(a, b) => list.extend([factor(a), Text("*"), Operand(b, Rank::Power)]),
        Node::Div(a, b) => list.extend([factor(a), Text("/"), Operand(b, Rank::Power)]),
        Node::And(a, b) => list.extend([Operand(a, Rank::Conjunction), Text(" and "), Operand(b, Rank::Negation)]),
        Node::Or(a, b) => list.extend([Operand(a, Rank::Disjunction), Text(" or "), Operand(b, Rank::Conjunction)]),
        Node::Event(relation, a, b) => related(relation, a, b, list),
        Node::Compare(relation, a, b) => {
            list.push(Text("noEvent("));
            related(relation, a, b, list);
            list.push(Text(")"));
        }
        Node::If(c, a, b) => list.extend([
            Text("if "),
            Operand(c, Rank::Disjunction),
            Text(" then "),
            Operand(a, Rank::Disjunction),
            Text(" else "),
            Operand(b, Rank::Expression),
        ]),
        Node::Call2(Function::Pow, a, b) => {
            list.extend([Operand(a, Rank::Primary), Text("^"), Operand(b, Rank::Primary)]);
        }
        Node::Call1(function, a) => {
            list.extend([Text(function.name()), Text("("), Operand(a, Rank::Expression), Text(")")]);
        }
        Node::Call2(function, a, b) => {
            list.extend([Text(function.name()), Text("("), Operand(a, Rank::Expression)]);
            list.extend([Text(", "), Operand(b, Rank::Expression), Text(")")]);
        }
        Node::Time => list.push(Text("time")),
        Node::Initial => list.push(Text("initial()")),
        Node::Homotopy => list.push(Text("homotopy()")),
        Node::Pair(a, b) => list.extend([Operand(a, Rank::Expression), Text(", "), Operand(b, Rank::Expression)]),
        Node::Const(_) | Node::Slot(_) | Node::Apply(..) => {}
    }
}

fn related(relation: Relation, a: NodeId, b: NodeId, list: &mut Vec<Piece>) {
    list.extend([Piece::Operand(a, Rank::Sum), Piece::Text(relation.symbol()), Piece::Operand(b, Rank::Sum)]);
}

impl Relation {
    /// The operator between spaces.
    fn symbol(self) -> &'static str {
        match self {
            Relation::Less => " < ",
            Relation::LessEqual => " <= ",
            Relation::Greater => " > ",
            Relation::GreaterEqual => " >= ",
            Relation::Equal => " == ",
            Relation::NotEqual => " <> ",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prints an expression over slots named a, b, c, d.
    fn printed(make: impl Fn(&mut Arena, [NodeId; 4]) -> NodeId) -> String {
        let mut arena = Arena::new();
        let slots = [0, 1, 2, 3].map(|k| arena.slot(SlotId(k)));
        let root = make(&mut arena, slots);
        print(&arena, root, &|slot| ["a", "b", "c", "d"][slot.0 as usize].to_string())
    }

    #[test]
    fn signs_of_slots_merge_into_the_operations() {
        let mut arena = Arena::new();
        let [a, b] = [0, 1].map(|k| arena.slot(SlotId(k)));
        let sum = arena.intern(Node::Add(a, b));
        let minus = arena.intern(Node::Neg(b));
        let name = |slot: SlotId| ["a", "b"][slot.0 as usize].to_string();
        assert_eq!(print_signed(&arena, sum, &name, &|slot| slot == SlotId(1), false), "a - b");
        assert_eq!(print_signed(&arena, minus, &name, &|_| true, false), "b");
        assert_eq!(print_signed(&arena, sum, &name, &|slot| slot == SlotId(1), true), "b - a");
    }

    #[test]
    fn sums_and_products_have_the_parentheses_they_need() {
        let both = |outer: fn(NodeId, NodeId) -> Node, inner: fn(NodeId, NodeId) -> Node| {
            let left = printed(|m, [a, b, c, _]| {
                let first = m.intern(inner(a, b));
                m.intern(outer(first, c))
            });
            let right = printed(|m, [a, b, c, _]| {
                let second = m.intern(inner(b, c));
                m.intern(outer(a, second))
            });
            format!("{left}; {right}")
        };
        assert_eq!(both(Node::Add, Node::Sub), "a - b + c; a + (b - c)");
        assert_eq!(both(Node::Sub, Node::Add), "a + b - c; a - (b + c)");
        assert_eq!(both(Node::Mul, Node::Add), "(a + b)*c; a*(b + c)");
        assert_eq!(both(Node::Div, Node::Mul), "a*b/c; a/(b*c)");
        assert_eq!(both(Node::Add, Node::Mul), "a*b + c; a + b*c");
        let power: fn(NodeId, NodeId) -> Node = |a, b| Node::Call2(Function::Pow, a, b);
        assert_eq!(both(power, Node::Add), "(a + b)^c; a^(b + c)");
        assert_eq!(both(power, power), "(a^b)^c; a^(b^c)");
        assert_eq!(both(Node::Mul, power), "a^b*c; a*b^c");
    }

    #[test]
    fn a_minus_stands_only_in_front_of_a_sum() {
        let minus = printed(|m, [a, b, c, _]| {
            let negative = m.intern(Node::Neg(a));
            let product = m.intern(Node::Mul(b, negative));
            let sum = m.intern(Node::Add(negative, product));
            let minus_sum = m.intern(Node::Neg(sum));
            let product = m.intern(Node::Mul(c, b));
            let minus_product = m.intern(Node::Neg(product));
            m.intern(Node::Sub(minus_product, minus_sum))
        });
        assert_eq!(minus, "-c*b - (-(-a + b*(-a)))");
        let numbers = printed(|m, [a, b, ..]| {
            let two = m.constant(-2.0);
            let scaled = m.intern(Node::Mul(two, a));
            let twice = m.intern(Node::Mul(b, scaled));
            let power = m.intern(Node::Call2(Function::Pow, two, two));
            let sum = m.intern(Node::Add(scaled, twice));
            m.intern(Node::Sub(sum, power))
        });
        assert_eq!(numbers, "-2*a + b*(-2*a) - (-2)^(-2)");
    }

    #[test]
    fn logic_and_conditions_read_as_modelica() {
        let text = printed(|m, [a, b, c, d]| {
            let below = m.event(Relation::Less, a, b);
            let other = m.event(Relation::NotEqual, c, d);
            let not = m.intern(Node::Not(below));
            let start = m.intern(Node::Initial);
            let either = m.intern(Node::Or(not, other));
            let both = m.intern(Node::And(either, start));
            let inner = m.select(below, a, b);
            let literal = m.compare(Relation::GreaterEqual, inner, d);
            let outer = m.select(literal, inner, inner);
            let sum = m.add(outer, c);
            m.select(both, sum, inner)
        });
        let expected =
            "if (not a < b or c <> d) and initial() then (if a < b then a else b) + c else if a < b then a else b";
        assert_eq!(text, expected);
        let text = printed(|m, [a, b, c, _]| {
            let sum = m.add(a, b);
            let literal = m.compare(Relation::GreaterEqual, sum, c);
            let time = m.intern(Node::Time);
            let sine = m.call1(Function::Sin, time);
            let most = m.call2(Function::Max, sine, literal);
            m.intern(Node::Not(most))
        });
        assert_eq!(text, "not max(sin(time), noEvent(a + b >= c))");
    }

    #[test]
    fn numbers_read_back_as_the_same_number() {
        let cases = [
            (3.0, "3"),
            (0.0, "0"),
            (-0.25, "-0.25"),
            (1e-6, "1e-6"),
            (2.5e8, "2.5e8"),
            (101_325.0, "101325"),
            (0.1 + 0.2, "0.30000000000000004"),
            (1e5, "100000"),
            (-1e300, "-1e300"),
        ];
        for (value, text) in cases {
            assert_eq!((format_number(value).as_str(), text.parse()), (text, Ok(value)));
        }
    }

    #[test]
    fn equations_and_overlong_text() {
        let mut arena = Arena::new();
        let mut x = arena.slot(SlotId(0));
        let one = arena.constant(1.0);
        let choice = arena.intern(Node::If(x, one, x));
        let template = Template { left: choice, right: x, arity: 1 };
        let name = |_: SlotId| "v.x".to_string();
        assert_eq!(print_template(&arena, &template, &name), "(if v.x then 1 else v.x) = v.x");
        for _ in 0..100 {
            x = arena.mul(x, x);
        }
        let text = print(&arena, x, &name);
        assert!(text.ends_with("...") && text.len() < LONGEST_TEXT + 16);
    }
}

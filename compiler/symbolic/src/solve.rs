//! Isolating a slot in an equation that is linear in it.
//!
//! A slot that occurs once is freed by undoing the operations around it one after the other, which keeps the terms
//! as the author wrote them.  Otherwise both sides are written as `coefficient * slot + offset` (the affine case of
//! symbolic pre-processing, Cellier and Kofman 2006, "Continuous System Simulation", section 7.2) and the quotient
//! of the differences is the value.  Conditions must not depend on the slot, and the branches of an `if` must agree
//! on the coefficient.  Expressions divided by are reported: whether they may vanish is for the caller to judge.

use crate::node::{Arena, Node, NodeId, SlotId};
use crate::order::post_order;
use hyd_system::math::Function;
use rustc_hash::FxHashMap;

/// What a slot is equal to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Solution {
    /// The value; free of the slot.
    pub value: NodeId,
    /// Expressions that were divided by and must not vanish; numbers other than 0 are not listed.
    pub divisors: Vec<NodeId>,
}

/// Solves `left = right` for a slot; none where the equation is not linear in it or does not contain it.
pub fn solve_for(arena: &mut Arena, left: NodeId, right: NodeId, slot: SlotId) -> Option<Solution> {
    solve(arena, (left, right), slot, false)
}

/// As [`solve_for`], also where the slot occurs once, in what a number is divided by or in a logarithm: `a = 2/x` gives `x = 2/a`, and
/// `a = log(x)` gives `x = exp(a)`.
pub fn isolate(arena: &mut Arena, left: NodeId, right: NodeId, slot: SlotId) -> Option<Solution> {
    solve(arena, (left, right), slot, true)
}

fn solve(arena: &mut Arena, (left, right): (NodeId, NodeId), slot: SlotId, inverts: bool) -> Option<Solution> {
    let order = post_order(arena, &[left, right]);
    let uses = uses(arena, &order, slot);
    let count = |id: NodeId| uses.get(&id).copied().unwrap_or(0);
    match (count(left), count(right)) {
        (0, 0) => None,
        (1, 0) => peel(arena, left, right, &uses, inverts),
        (0, 1) => peel(arena, right, left, &uses, inverts),
        _ => collect(arena, &order, left, right, slot),
    }
}

/// How often a slot occurs in each node written out as a tree (saturating); nodes without it are left out.
fn uses(arena: &Arena, order: &[NodeId], slot: SlotId) -> FxHashMap<NodeId, u32> {
    let mut uses: FxHashMap<NodeId, u32> = FxHashMap::default();
    for &id in order {
        let node = arena.node(id);
        let below =
            node.operands().filter_map(|operand| uses.get(&operand)).fold(0, |sum: u32, &n| sum.saturating_add(n));
        let count = if node == Node::Slot(slot) { 1 } else { below };
        if count > 0 {
            uses.insert(id, count);
        }
    }
    uses
}

/// Solves `target = other` for the slot that occurs once in `target`, by inverting one operation after the other.
/// With `inverts` a quotient by what the slot is in is one of them, and so is a logarithm.
fn peel(
    arena: &mut Arena,
    target: NodeId,
    other: NodeId,
    uses: &FxHashMap<NodeId, u32>,
    inverts: bool,
) -> Option<Solution> {
    let (mut target, mut value, mut divisors) = (target, other, Vec::new());
    loop {
        target = match arena.node(target) {
            Node::Slot(_) => return Some(Solution { value, divisors }),
            Node::Neg(a) => {
                value = arena.neg(value);
                a
            }
            Node::Add(a, b) => {
                let (inside, outside) = if uses.contains_key(&a) { (a, b) } else { (b, a) };
                value = arena.sub(value, outside);
                inside
            }
            Node::Sub(a, b) if uses.contains_key(&a) => {
                value = arena.add(value, b);
                a
            }
            Node::Sub(a, b) => {
                value = arena.sub(a, value);
                b
            }
            Node::Mul(a, b) => {
                let (inside, factor) = if uses.contains_key(&a) { (a, b) } else { (b, a) };
                value = divide(arena, value, factor, &mut divisors)?;
                inside
            }
            Node::Div(a, b) if uses.contains_key(&a) => {
                value = arena.mul(value, b);
                a
            }
            // With another dividend, which may become 0, the solution would be 0, and nothing can be divided by it.
            Node::Div(a, b) if inverts && arena.as_constant(a).is_some_and(|number| number != 0.0) => {
                value = divide(arena, a, value, &mut divisors)?;
                b
            }
            // Both have one inverse, which has a value everywhere.
            Node::Call1(Function::Log, a) if inverts => {
                value = arena.call1(Function::Exp, value);
                a
            }
            Node::Call1(Function::Log10, a) if inverts => {
                let ten = arena.constant(10.0);
                value = arena.pow(ten, value);
                a
            }
            _ => return None,
        }
    }
}

/// `value / factor`, noting the factor; none for a factor of 0 or one that is not finite.
fn divide(arena: &mut Arena, value: NodeId, factor: NodeId, divisors: &mut Vec<NodeId>) -> Option<NodeId> {
    match arena.as_constant(factor) {
        Some(number) if number == 0.0 || !number.is_finite() => return None,
        Some(_) => {}
        None => divisors.push(factor),
    }
    Some(arena.div(value, factor))
}

/// An expression as `coefficient * slot + offset`.
#[derive(Clone, Copy)]
struct Affine {
    coefficient: NodeId,
    offset: NodeId,
}

/// Solves for a slot that occurs more than once.
fn collect(arena: &mut Arena, order: &[NodeId], left: NodeId, right: NodeId, slot: SlotId) -> Option<Solution> {
    let mut forms: FxHashMap<NodeId, Affine> = FxHashMap::default();
    for &id in order {
        let node = arena.node(id);
        if node == Node::Slot(slot) {
            let (coefficient, offset) = (arena.constant(1.0), arena.constant(0.0));
            forms.insert(id, Affine { coefficient, offset });
        } else if node.operands().any(|operand| forms.contains_key(&operand)) {
            let form = affine(arena, node, |operand| forms.get(&operand).copied())?;
            forms.insert(id, form);
        }
    }
    let zero = arena.constant(0.0);
    let form = |id| forms.get(&id).copied().unwrap_or(Affine { coefficient: zero, offset: id });
    let (left, right) = (form(left), form(right));
    let coefficient = arena.sub(left.coefficient, right.coefficient);
    let difference = arena.sub(right.offset, left.offset);
    let mut divisors = Vec::new();
    let value = divide(arena, difference, coefficient, &mut divisors)?;
    Some(Solution { value, divisors })
}

/// The affine form of an operation with at least one operand that contains the slot; none if it is not linear.
fn affine(arena: &mut Arena, node: Node, form: impl Fn(NodeId) -> Option<Affine>) -> Option<Affine> {
    let zero = arena.constant(0.0);
    let whole = |id| form(id).unwrap_or(Affine { coefficient: zero, offset: id });
    match node {
        Node::Neg(a) => {
            let a = form(a)?;
            Some(Affine { coefficient: arena.neg(a.coefficient), offset: arena.neg(a.offset) })
        }
        Node::Add(a, b) => {
            let (a, b) = (whole(a), whole(b));
            let coefficient = arena.add(a.coefficient, b.coefficient);
            Some(Affine { coefficient, offset: arena.add(a.offset, b.offset) })
        }
        Node::Sub(a, b) => {
            let (a, b) = (whole(a), whole(b));
            let coefficient = arena.sub(a.coefficient, b.coefficient);
            Some(Affine { coefficient, offset: arena.sub(a.offset, b.offset) })
        }
        Node::Mul(a, b) => {
            let (factor, inside) = match (form(a), form(b)) {
                (None, Some(inside)) => (a, inside),
                (Some(inside), None) => (b, inside),
                _ => return None,
            };
            let coefficient = arena.mul(factor, inside.coefficient);
            Some(Affine { coefficient, offset: arena.mul(factor, inside.offset) })
        }
        Node::Div(a, b) if form(b).is_none() => {
            let a = form(a)?;
            let coefficient = arena.div(a.coefficient, b);
            Some(Affine { coefficient, offset: arena.div(a.offset, b) })
        }
        Node::If(c, a, b) if form(c).is_none() => {
            let (a, b) = (form(a)?, form(b)?);
            let same = a.coefficient == b.coefficient;
            same.then(|| Affine { coefficient: a.coefficient, offset: arena.select(c, a.offset, b.offset) })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::Relation;
    use crate::print::print;

    /// Solves over slots named a, b, x, y for x; the printed value and divisors.
    fn solved(make: impl Fn(&mut Arena, [NodeId; 4]) -> (NodeId, NodeId)) -> Option<String> {
        let mut arena = Arena::new();
        let slots = [0, 1, 2, 3].map(|k| arena.slot(SlotId(k)));
        let (left, right) = make(&mut arena, slots);
        let solution = solve_for(&mut arena, left, right, SlotId(2))?;
        let name = |slot: SlotId| ["a", "b", "x", "y"][slot.0 as usize].to_string();
        let mut text = print(&arena, solution.value, &name);
        for divisor in solution.divisors {
            text = format!("{text} | {}", print(&arena, divisor, &name));
        }
        Some(text)
    }

    #[test]
    fn one_occurrence_is_freed_as_written() {
        let text = solved(|m, [a, b, x, y]| {
            let ax = m.mul(a, x);
            (m.add(ax, b), y)
        });
        assert_eq!(text.as_deref(), Some("(y - b)/a | a"));
        let text = solved(|m, [_, b, x, y]| {
            let two = m.constant(2.0);
            let half = m.div(x, two);
            (y, m.sub(b, half))
        });
        assert_eq!(text.as_deref(), Some("2*(b - y)"));
        assert_eq!(solved(|m, [a, _, x, y]| (m.div(a, x), y)), None);
        assert_eq!(solved(|m, [_, _, x, y]| (m.call1(Function::Sign, x), y)), None);
        assert_eq!(solved(|_, [a, b, _, _]| (a, b)), None);
    }

    #[test]
    fn several_occurrences_are_collected() {
        let text = solved(|m, [a, b, x, _]| {
            let ax = m.mul(a, x);
            let bx = m.mul(b, x);
            (ax, m.add(bx, b))
        });
        assert_eq!(text.as_deref(), Some("b/(a - b) | a - b"));
        let text = solved(|m, [_, _, x, y]| {
            let two = m.constant(2.0);
            let twice = m.mul(two, x);
            (m.add(twice, x), y)
        });
        assert_eq!(text.as_deref(), Some("y/3"));
        assert_eq!(solved(|m, [_, _, x, y]| (m.mul(x, x), y)), None);
        assert_eq!(solved(|m, [_, _, x, y]| (m.add(x, y), x)), None);
    }

    #[test]
    fn branches_must_agree_on_the_coefficient() {
        let choose = |m: &mut Arena, c: NodeId, p: NodeId, q: NodeId| {
            let zero = m.constant(0.0);
            let positive = m.event(Relation::Greater, c, zero);
            m.select(positive, p, q)
        };
        let text = solved(|m, [a, b, x, y]| {
            let (p, q) = (m.add(x, a), m.add(x, b));
            (choose(m, y, p, q), y)
        });
        assert_eq!(text.as_deref(), Some("y - (if y > 0 then a else b)"));
        let one_sided = solved(|m, [a, _, x, y]| (choose(m, y, x, a), y));
        let different = solved(|m, [a, b, x, y]| {
            let (p, q) = (m.mul(a, x), m.mul(b, x));
            (choose(m, y, p, q), y)
        });
        let in_condition = solved(|m, [a, b, x, y]| (choose(m, x, a, b), y));
        assert_eq!((one_sided, different, in_condition), (None, None, None));
    }
}

//! Equations so simple that they name a variable rather than determine it: `a = b`, `a = -b`, `a = 3`.
//!
//! Connections produce them by the thousand, in many spellings (`a + b = 0`, `0 = a - b`, `2*a = 2*b`).  Both sides are
//! gathered into one sum of numbers times slots; two slots with coefficients of equal size are an alias, one slot is
//! a constant.  Anything longer than a handful of operations is not looked at.

use crate::node::{Arena, Node, NodeId, SlotId, Template};

/// More operations than this are not gathered: every sensible spelling of an alias is shorter.
const LONGEST: usize = 16;

/// Two slots that the equation makes equal, or opposite (true): `first = second` or `first = -second`.
///
/// The slots come in the order of the text; slots that cancel, as `c` in `a + c = b + c`, do not count.
pub fn alias(arena: &Arena, template: &Template) -> Option<(SlotId, SlotId, bool)> {
    let sum = Sum::of(arena, template)?;
    match *sum.terms {
        [(first, p), (second, q)] if sum.constant == 0.0 && p.abs() == q.abs() => Some((first, second, p == q)),
        _ => None,
    }
}

/// The slot that the equation fixes to a number, with that number.
pub fn constant_value(arena: &Arena, template: &Template) -> Option<(SlotId, f64)> {
    let sum = Sum::of(arena, template)?;
    match *sum.terms {
        [(slot, coefficient)] => {
            let value = -sum.constant / coefficient;
            // Adding 0 turns -0 into 0.
            value.is_finite().then_some((slot, value + 0.0))
        }
        _ => None,
    }
}

/// `left - right` as numbers times slots plus a number; coefficients are finite and not 0.
struct Sum {
    terms: Vec<(SlotId, f64)>,
    constant: f64,
}

impl Sum {
    fn of(arena: &Arena, template: &Template) -> Option<Self> {
        let mut sum = Self { terms: Vec::new(), constant: 0.0 };
        let mut stack = vec![(template.right, -1.0), (template.left, 1.0)];
        let mut steps = 0;
        while let Some((id, factor)) = stack.pop() {
            steps += 1;
            if steps > LONGEST {
                return None;
            }
            sum.gather(arena, id, factor, &mut stack)?;
        }
        sum.terms.retain(|&(_, coefficient)| coefficient != 0.0);
        sum.terms.iter().all(|(_, coefficient)| coefficient.is_finite()).then_some(sum)
    }

    /// Adds `factor` times a node, or puts its operands on the stack; none if it is not linear in slots.
    fn gather(&mut self, arena: &Arena, id: NodeId, factor: f64, stack: &mut Vec<(NodeId, f64)>) -> Option<()> {
        match arena.node(id) {
            Node::Const(number) => self.constant += factor * number.value(),
            Node::Slot(slot) => match self.terms.iter_mut().find(|(known, _)| *known == slot) {
                Some((_, coefficient)) => *coefficient += factor,
                None => self.terms.push((slot, factor)),
            },
            Node::Neg(a) => stack.push((a, -factor)),
            Node::Add(a, b) => stack.extend([(b, factor), (a, factor)]),
            Node::Sub(a, b) => stack.extend([(b, -factor), (a, factor)]),
            Node::Mul(a, b) => match (arena.as_constant(a), arena.as_constant(b)) {
                (Some(number), _) => stack.push((b, factor * number)),
                (None, Some(number)) => stack.push((a, factor * number)),
                (None, None) => return None,
            },
            Node::Div(a, b) => stack.push((a, factor / arena.as_constant(b)?)),
            _ => return None,
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All spellings, interned as they stand.
    fn template(make: impl Fn(&mut Arena, NodeId, NodeId, NodeId) -> (NodeId, NodeId)) -> (Arena, Template) {
        let mut arena = Arena::new();
        let [a, b] = [0, 1].map(|k| arena.slot(SlotId(k)));
        let zero = arena.constant(0.0);
        let (left, right) = make(&mut arena, a, b, zero);
        (arena, Template { left, right, arity: 2 })
    }

    fn found(make: impl Fn(&mut Arena, NodeId, NodeId, NodeId) -> (NodeId, NodeId)) -> Option<(SlotId, SlotId, bool)> {
        let (arena, template) = template(make);
        alias(&arena, &template)
    }

    #[test]
    fn every_spelling_of_an_alias_is_seen() {
        let (a, b) = (SlotId(0), SlotId(1));
        assert_eq!(found(|_, a, b, _| (a, b)), Some((a, b, false)));
        assert_eq!(found(|m, a, b, _| (a, m.intern(Node::Neg(b)))), Some((a, b, true)));
        assert_eq!(found(|m, a, b, zero| (m.intern(Node::Add(a, b)), zero)), Some((a, b, true)));
        assert_eq!(found(|m, a, b, zero| (zero, m.intern(Node::Sub(a, b)))), Some((a, b, false)));
        let negative_sum = found(|m, a, b, zero| {
            let minus = m.intern(Node::Neg(a));
            (m.intern(Node::Sub(minus, b)), zero)
        });
        assert_eq!(negative_sum, Some((a, b, true)));
        let doubled = found(|m, a, b, _| {
            let two = m.constant(2.0);
            (m.intern(Node::Mul(a, two)), m.intern(Node::Mul(two, b)))
        });
        assert_eq!(doubled, Some((a, b, false)));
    }

    #[test]
    fn other_equations_are_not_aliases() {
        assert_eq!(found(|m, a, b, _| (a, m.intern(Node::Mul(a, b)))), None);
        assert_eq!(found(|_, a, _, zero| (a, zero)), None);
        let shifted = found(|m, a, b, _| {
            let one = m.constant(1.0);
            (a, m.intern(Node::Add(b, one)))
        });
        let scaled = found(|m, a, b, _| {
            let two = m.constant(2.0);
            (a, m.intern(Node::Mul(two, b)))
        });
        assert_eq!((shifted, scaled), (None, None));
    }

    #[test]
    fn constants_are_seen() {
        let value = |number: f64, spell: fn(&mut Arena, NodeId, NodeId) -> (NodeId, NodeId)| {
            let (arena, template) = template(|m, a, _, _| {
                let number = m.constant(number);
                spell(m, a, number)
            });
            constant_value(&arena, &template)
        };
        assert_eq!(value(3.0, |_, a, n| (a, n)), Some((SlotId(0), 3.0)));
        assert_eq!(value(3.0, |m, a, n| (m.intern(Node::Neg(a)), n)), Some((SlotId(0), -3.0)));
        assert_eq!(value(0.0, |_, a, n| (n, a)), Some((SlotId(0), 0.0)));
        assert_eq!(value(4.0, |m, a, n| (m.intern(Node::Mul(n, a)), n)), Some((SlotId(0), 1.0)));
        assert_eq!(value(4.0, |_, a, _| (a, a)), None);
        assert_eq!(value(0.0, |m, a, n| (m.intern(Node::Div(a, n)), n)), None);
    }
}

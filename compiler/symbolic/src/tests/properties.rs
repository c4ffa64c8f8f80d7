//! Properties that must hold for every expression, on random ones.
//!
//! Derivatives are compared with central differences, simplified expressions with the same expressions as they
//! stood, solutions by putting them back into the equation.  Points where a value is not finite, or where the
//! differences of two step widths disagree (a kink or jump is near), are passed over; each test checks that enough
//! points were left.

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::cell::Cell;

use crate::{
    Arena, Evaluator, Function, Node, NodeId, Relation, SlotId, alias, canonical, constant_value, contains_slot, eval,
    gradient, partial, post_order, print, renumber, rewrite, simplify, slots, solve_for, substitute_one,
};

const SLOTS: u32 = 4;

/// A random expression as a program for a stack machine: an operation and a number per step.
type Program = Vec<(u8, f64)>;

fn programs(longest: usize) -> impl Strategy<Value = Program> {
    prop::collection::vec((any::<u8>(), -3.0..3.0), 1..longest)
}

fn points() -> impl Strategy<Value = [f64; SLOTS as usize]> {
    [-3.0..3.0f64, 0.1..3.0, -1.0..1.0, -3.0..3.0]
}

/// Runs the program; `make` interns or simplifies.
fn run(arena: &mut Arena, program: &Program, make: fn(&mut Arena, Node) -> NodeId) -> NodeId {
    let mut stack: Vec<NodeId> = Vec::new();
    for &(code, number) in program {
        let node =
            if code < 90 || stack.len() < 2 { leaf(code, number) } else { operation(arena, code, make, &mut stack) };
        let id = make(arena, node);
        stack.push(id);
    }
    let first = stack[0];
    stack[1..].iter().fold(first, |sum, &term| make(arena, Node::Add(sum, term)))
}

fn leaf(code: u8, number: f64) -> Node {
    match code % 8 {
        0 => Node::Const(crate::Number::new(number)),
        // Small integers trigger the identities.
        1 | 2 => Node::Const(crate::Number::new(number.round())),
        3 => Node::Time,
        _ => Node::Slot(SlotId(u32::from(code) % SLOTS)),
    }
}

fn operation(arena: &mut Arena, code: u8, make: fn(&mut Arena, Node) -> NodeId, stack: &mut Vec<NodeId>) -> Node {
    let mut pop = || stack.pop().expect("two operands are there");
    let functions = Function::ALL.len() as u8;
    let function = Function::ALL[(code % functions) as usize];
    match code {
        90..=104 => Node::Neg(pop()),
        105..=124 => Node::Add(pop(), pop()),
        125..=144 => Node::Sub(pop(), pop()),
        145..=169 => Node::Mul(pop(), pop()),
        170..=184 => Node::Div(pop(), pop()),
        185..=199 => {
            let (a, b) = (pop(), pop());
            let condition = condition(arena, code, make, a, b);
            Node::If(condition, a, b)
        }
        _ if function.arity() == 1 => Node::Call1(function, pop()),
        _ => Node::Call2(function, pop(), pop()),
    }
}

fn condition(arena: &mut Arena, code: u8, make: fn(&mut Arena, Node) -> NodeId, a: NodeId, b: NodeId) -> NodeId {
    let relations = [Relation::Less, Relation::LessEqual, Relation::Greater, Relation::GreaterEqual, Relation::Equal];
    let relation = relations[code as usize % relations.len()];
    let event = make(arena, Node::Event(relation, a, b));
    let literal = make(arena, Node::Compare(Relation::NotEqual, a, b));
    match code % 4 {
        0 => event,
        1 => make(arena, Node::Not(literal)),
        2 => make(arena, Node::And(event, literal)),
        _ => make(arena, Node::Or(literal, event)),
    }
}

/// Checks a property on many cases; it returns whether the case said anything, and a third of them must.
fn check<S: Strategy>(cases: u32, strategy: &S, property: impl Fn(S::Value) -> Result<bool, TestCaseError>) {
    let telling = Cell::new(0u32);
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    // The same cases on every run, so that a failure is a change of the code.
    let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let outcome = TestRunner::new_with_rng(config, random).run(strategy, |value| {
        telling.set(telling.get() + u32::from(property(value)?));
        Ok(())
    });
    if let Err(failure) = outcome {
        panic!("{failure}");
    }
    assert!(telling.get() > cases / 3, "only {} of {cases} cases said anything", telling.get());
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * (1.0 + a.abs().max(b.abs()))
}

fn name(slot: SlotId) -> String {
    slot.to_string()
}

#[test]
fn simplification_keeps_values_and_is_final() {
    check(4000, &(programs(30), points()), |(program, point)| {
        let mut arena = Arena::new();
        let raw = run(&mut arena, &program, |arena, node| arena.intern(node));
        let simple = simplify(&mut arena, raw);
        prop_assert_eq!(simplify(&mut arena, simple), simple, "{}", print(&arena, simple, &name));
        prop_assert_eq!(run(&mut arena, &program, Arena::build), simple);
        let roots: Vec<NodeId> = [raw, simple].into_iter().chain(post_order(&arena, &[raw])).collect();
        let mut evaluator = Evaluator::new(&arena, &roots);
        let values = evaluator.evaluate(|slot| point[slot.0 as usize], 0.7, false);
        let (before, after) = (values[0], values[1]);
        if values[2..].iter().any(|value| !value.is_finite()) {
            return Ok(false);
        }
        // All identities but those of powers are exact, except for the sign of zero, on which atan2 depends.
        if !program.iter().any(|step| uses_sign_of_zero_or_power(step.0)) {
            prop_assert!(near(before, after, 1e-12), "{before} {after} {}", print(&arena, raw, &name));
        }
        Ok(true)
    });
}

fn uses_sign_of_zero_or_power(code: u8) -> bool {
    let function = Function::ALL[code as usize % Function::ALL.len()];
    code >= 200 && matches!(function, Function::Pow | Function::Atan2)
}

/// Central difference, none where it cannot be trusted: two step widths disagree (curvature, a kink or a jump), or a
/// tiny step sees another slope (a staircase finer than the others).
fn difference(f: impl Fn(f64) -> f64, x: f64) -> Option<f64> {
    let h = 1e-4;
    let slope = |h: f64| (f(x + h) - f(x - h)) / (2.0 * h);
    let (wide, narrow) = (slope(2.0 * h), slope(h));
    let trusted = near(wide, narrow, 1e-6) && near(slope(0.01 * h), narrow, 1e-3) && f(x).abs() < 1e5;
    trusted.then_some((4.0 * narrow - wide) / 3.0)
}

#[test]
fn derivatives_agree_with_central_differences() {
    let without_value = Cell::new(0);
    check(6000, &(programs(14), points()), |(program, point)| {
        let mut arena = Arena::new();
        let root = run(&mut arena, &program, Arena::build);
        let gradient = gradient(&mut arena, root);
        prop_assert_eq!(gradient.iter().map(|entry| entry.0).collect::<Vec<_>>(), slots(&arena, &[root]));
        let mut told = false;
        for (slot, derivative) in gradient {
            let apart = partial(&mut arena, root, slot);
            let at = |x: f64| {
                let value = |s: SlotId| if s == slot { x } else { point[s.0 as usize] };
                eval(&arena, root, value, 0.7, false)
            };
            let Some(expected) = difference(at, point[slot.0 as usize]) else { continue };
            let mut evaluator = Evaluator::new(&arena, &[derivative, apart]);
            let values = evaluator.evaluate(|s| point[s.0 as usize], 0.7, false).to_vec();
            if values.iter().any(|value| value.is_nan()) {
                without_value.set(without_value.get() + 1);
                continue;
            }
            let text = print(&arena, root, &name);
            prop_assert!(near(values[0], expected, 1e-5), "d/d{slot} {text}: {} for {expected}", values[0]);
            prop_assert!(near(values[1], expected, 1e-5), "d/d{slot} {text}: {} for {expected}", values[1]);
            told = true;
        }
        Ok(told)
    });
    // 0 times an infinite slope, as in if c then a^b else 0 on the unused branch of a product.
    assert!(without_value.get() < 30, "{} derivatives without a value", without_value.get());
}

#[test]
fn solutions_solve_their_equation() {
    // Equations a*x + b = c*x + d with random a, b, c, d free of x, wrapped at random.
    let unknown = SlotId(SLOTS);
    let parts = (programs(6), programs(6), programs(6), programs(6), 0u8..4);
    check(3000, &(parts, points()), |((a, b, c, d, wrap), point)| {
        let mut arena = Arena::new();
        let x = arena.slot(unknown);
        let [a, b, c, d] = [a, b, c, d].map(|program| run(&mut arena, &program, Arena::build));
        let ax = arena.mul(a, x);
        let left = arena.add(ax, b);
        let right = match wrap {
            0 => d,
            1 => {
                let cx = arena.div(x, c);
                arena.sub(d, cx)
            }
            2 => {
                let cx = arena.mul(x, c);
                let sum = arena.sub(d, cx);
                arena.neg(sum)
            }
            _ => {
                let one = arena.constant(1.0);
                let positive = arena.event(Relation::Greater, c, one);
                let (p, q) = (arena.add(x, c), arena.add(d, x));
                arena.select(positive, p, q)
            }
        };
        let Some(solution) = solve_for(&mut arena, left, right, unknown) else { return Ok(false) };
        prop_assert!(!contains_slot(&arena, solution.value, unknown));
        let residual = arena.sub(left, right);
        let at_solution = substitute_one(&mut arena, residual, unknown, solution.value);
        let left_part = substitute_one(&mut arena, ax, unknown, solution.value);
        let roots: Vec<NodeId> =
            [at_solution, left_part, right, solution.value].into_iter().chain(solution.divisors).collect();
        let mut evaluator = Evaluator::new(&arena, &roots);
        let values = evaluator.evaluate(|s| point.get(s.0 as usize).copied().unwrap_or(1.0), 0.7, false);
        let scale = values[1..].iter().fold(1.0f64, |largest, value| largest.max(value.abs()));
        if values.iter().any(|value| !value.is_finite())
            || values[4..].iter().any(|value| value.abs() < 1e-3)
            || scale > 1e6
        {
            return Ok(false);
        }
        prop_assert!(values[0].abs() <= 1e-9 * scale, "{} in {}", values[0], print(&arena, residual, &name));
        Ok(true)
    });
}

#[test]
fn nonlinear_equations_are_not_solved() {
    // Whatever contains x below a function, a relation or a product with itself has no solution here.
    let mut arena = Arena::new();
    let (x, y) = (arena.slot(SlotId(0)), arena.slot(SlotId(1)));
    for &function in Function::ALL {
        let call = match function.arity() {
            1 => arena.call1(function, x),
            _ => arena.call2(function, x, y),
        };
        let sum = arena.add(call, x);
        assert_eq!(solve_for(&mut arena, call, y, SlotId(0)), None);
        assert_eq!(solve_for(&mut arena, sum, y, SlotId(0)), None);
    }
}

#[test]
fn templates_do_not_depend_on_slot_numbers() {
    check(2000, &(programs(20), programs(20), 1u32..50), |(left, right, shift)| {
        let mut arena = Arena::new();
        let left = run(&mut arena, &left, |arena, node| arena.intern(node));
        let right = run(&mut arena, &right, |arena, node| arena.intern(node));
        let (template, old) = canonical(&mut arena, left, right);
        let move_slot = |slot: SlotId| SlotId((SLOTS - slot.0) * 7 + shift);
        let (left, right) = (renumber(&mut arena, left, &move_slot), renumber(&mut arena, right, &move_slot));
        let (moved, moved_old) = canonical(&mut arena, left, right);
        prop_assert_eq!(template, moved);
        prop_assert_eq!(old.iter().map(|&slot| move_slot(slot)).collect::<Vec<_>>(), moved_old);
        let numbered: Vec<SlotId> = (0..template.arity).map(SlotId).collect();
        prop_assert_eq!(slots(&arena, &[template.left, template.right]), numbered);
        // An alias or a constant must agree with solving.
        if let Some((slot, value)) = constant_value(&arena, &template) {
            let solution = solve_for(&mut arena, template.left, template.right, slot).expect("linear");
            prop_assert!(near(eval(&arena, solution.value, |_| 0.5, 0.0, false), value, 1e-12));
        }
        if let Some((first, second, negated)) = alias(&arena, &template) {
            let solution = solve_for(&mut arena, template.left, template.right, first).expect("linear");
            let value = eval(&arena, solution.value, |s| if s == second { 2.5 } else { 0.0 }, 0.0, false);
            let expected = if negated { -2.5 } else { 2.5 };
            prop_assert!(near(value, expected, 1e-12));
        }
        Ok(true)
    });
}

#[test]
fn long_sums_need_neither_stack_nor_time() {
    let mut arena = Arena::new();
    let count = 20_000;
    let mut sum = arena.constant(1.0);
    for k in 0..count {
        let x = arena.slot(SlotId(k));
        let square = arena.mul(x, x);
        sum = arena.add(sum, square);
    }
    let list = gradient(&mut arena, sum);
    assert_eq!(list.len(), count as usize);
    assert_eq!(print(&arena, list[7].1, &name), "2*s7");
    let kept = rewrite(&mut arena, sum, |_, _| None);
    assert_eq!(kept, sum);
    let last = arena.slot(SlotId(count));
    let right = arena.add(sum, last);
    assert!(solve_for(&mut arena, last, right, SlotId(0)).is_none());
    assert!(print(&arena, sum, &name).ends_with("s19999*s19999"));
}

//! Events, parameters, initial systems and messages of compiled systems built by hand.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

use hyd_equations::{Resolution, Role};
use hyd_flat::{Operand, Target};
use hyd_symbolic::{Function, Node, Relation};
use hyd_system::{CheckKind, DaeSystem, EventChange, EventPhase, ParameterError, Place, Settable};

use super::support::{self, Maker};
use crate::{Backend, Instance, Options};

fn forms() -> [Options; 3] {
    let form = |straight_nodes, backend| Options { straight_nodes, backend };
    [form(4000, Backend::Native), form(0, Backend::Native), form(0, Backend::Vm)]
}

/// 0.1 + 0.7 rounds so that minus 0.7 it is below 0.1: the comparison `time - 0.7 >= 0.1` is false at its own instant.
const LATE: f64 = 0.1 + 0.7;

/// A bouncing ball with a counter, a clock of period `0.25` and a relation that rounds badly at its instant.
fn ball() -> Maker {
    let mut m = Maker::new();
    let (x, v) = (m.scalar("x", Role::State), m.scalar("v", Role::State));
    let [contact, count, late, tick, next] =
        ["contact", "count", "late", "tick", "next"].map(|name| m.scalar(name, Role::Discrete));
    m.start(x, 1.0);
    m.start(next, 0.25);
    let below = m.relation(Relation::Less, |e| {
        let (x, zero) = (e.var(x), e.c(0.0));
        (x, zero, None)
    });
    let after = m.relation(Relation::GreaterEqual, |e| {
        let (t, shift, at) = (e.time(), e.c(0.7), e.number(0.1));
        let left = e.sub(t, shift);
        let instant = e.add(at, shift);
        (left, at, Some(instant))
    });
    let clock = m.relation(Relation::GreaterEqual, |e| {
        let (t, next) = (e.time(), e.pre(next));
        (t, next, Some(next))
    });
    for (variable, relation) in [(contact, below), (late, after), (tick, clock)] {
        m.discrete(variable, 0, |e| e.held(relation));
    }
    let edge = |e: &mut support::Expression<'_>, b| {
        let (now, before) = (e.var(b), e.pre(b));
        let not = e.arena.not(before);
        e.arena.and(now, not)
    };
    m.discrete(count, 1, |e| {
        let (fires, old, one) = (edge(e, contact), e.pre(count), e.c(1.0));
        let more = e.add(old, one);
        e.arena.select(fires, more, old)
    });
    m.discrete(next, 1, |e| {
        let (fires, old, step) = (edge(e, tick), e.pre(next), e.c(0.25));
        let more = e.add(old, step);
        e.arena.select(fires, more, old)
    });
    m.reinit(v, |e| {
        let (fires, v, factor) = (edge(e, contact), e.var(v), e.c(-0.8));
        let back = e.mul(factor, v);
        e.arena.select(fires, back, v)
    });
    m.check("too low", CheckKind::Assert, |e| {
        let (x, limit) = (e.var(x), e.c(-1.0));
        e.compare(Relation::Greater, x, limit)
    });
    m.check("three bounces", CheckKind::Terminate, |e| {
        let (count, limit) = (e.var(count), e.c(3.0));
        e.compare(Relation::GreaterEqual, count, limit)
    });
    m.solve(x, true, "der(x) = v", |e| {
        let (rate, v) = (e.der(x), e.var(v));
        e.sub(rate, v)
    });
    m.solve(v, true, "der(v) = -9.81", |e| {
        let (rate, g) = (e.der(v), e.c(9.81));
        e.add(rate, g)
    });
    m.assign_initially(Target::Var(x), 0, |e| e.start(x));
    m.assign_initially(Target::Var(v), 0, |e| e.start(v));
    m.assign_initially(Target::Der(x), 1, |e| e.var(v));
    m.assign_initially(Target::Der(v), 1, |e| e.c(-9.81));
    m
}

fn start(system: &mut Instance) -> (Vec<f64>, Vec<f64>) {
    let (mut y, mut yp) = (vec![9.0; 2], vec![9.0; 2]);
    system.bind(0.0).unwrap();
    system.initial_guess(0.0, &mut []).unwrap();
    system.initial_store(0.0, &[], &mut y, &mut yp).unwrap();
    let change = system.event_pass(EventPhase::Initial, 0.0, &mut y, &yp).unwrap();
    assert_eq!(change, EventChange::default());
    (y, yp)
}

fn output(system: &mut Instance, name: &str, y: &[f64], yp: &[f64]) -> f64 {
    let mut row = vec![0.0; system.structure().outputs];
    system.outputs(0.0, y, yp, &mut row);
    let tables = system.tables().clone();
    let (variable, k) = tables.find(name).unwrap();
    let source = variable.sources[k];
    let Place::Output(index) = source.place else { panic!("{name} is not an output") };
    if source.negated { -row[index as usize] } else { row[index as usize] }
}

#[test]
fn the_initial_store_gives_states_and_rates() {
    for options in forms() {
        let mut system = ball().compile(&options);
        let (y, yp) = start(&mut system);
        assert_eq!((y, yp), (vec![1.0, 0.0], vec![0.0, -9.81]));
        let mut nominals = [0.0; 2];
        system.nominals(&mut nominals);
        assert_eq!(nominals, [10.0; 2]);
    }
}

#[test]
fn a_state_event_fires_once_and_bounces() {
    for options in forms() {
        let mut system = ball().compile(&options);
        let (_, yp) = start(&mut system);
        let mut y = vec![-1e-9, -3.0];
        let (mut root, mut held) = ([0.0], [true]);
        system.roots(0.4, &y, &yp, &mut root);
        system.held(&mut held);
        assert_eq!((root, held), ([1e-9], [false]));
        let change = system.event_pass(EventPhase::First, 0.1, &mut y, &yp).unwrap();
        assert!(change.changed && change.reinitialised && change.terminated.is_none());
        assert_eq!(y, [-1e-9, -0.8 * -3.0]);
        assert_eq!(output(&mut system, "count", &y, &yp), 1.0);
        let change = system.event_pass(EventPhase::Iterate, 0.1, &mut y, &yp).unwrap();
        assert_eq!(change, EventChange::default());
        assert_eq!(y[1], 2.4000000000000004);
        system.held(&mut held);
        assert!(held[0]);
        // Up and down again, three times in all.
        for bounce in 2..=3 {
            y = vec![0.5, 1.0];
            assert!(system.event_pass(EventPhase::First, 0.1, &mut y, &yp).unwrap().changed);
            assert!(!system.event_pass(EventPhase::Iterate, 0.1, &mut y, &yp).unwrap().changed);
            y = vec![-0.5, -1.0];
            let change = system.event_pass(EventPhase::First, 0.1, &mut y, &yp).unwrap();
            assert_eq!(change.terminated, (bounce == 3).then(|| "three bounces".to_string()));
            assert_eq!(output(&mut system, "count", &y, &yp), f64::from(bounce));
        }
    }
}

#[test]
fn time_events_come_in_order_and_hold_at_their_instant() {
    for options in forms() {
        let mut system = ball().compile(&options);
        let (mut y, yp) = start(&mut system);
        const { assert!(LATE - 0.7 < 0.1) };
        let mut t = 0.0;
        let mut instants = Vec::new();
        while t < 0.9 {
            t = system.next_time_event(t).t;
            instants.push(t);
            assert!(system.event_pass(EventPhase::First, t, &mut y, &yp).unwrap().changed);
            let mut passes = 0;
            while system.event_pass(EventPhase::Iterate, t, &mut y, &yp).unwrap().changed {
                passes += 1;
                assert!(passes < 5);
            }
            assert_eq!(output(&mut system, "late", &y, &yp), f64::from(u8::from(t >= LATE)));
            assert_eq!(output(&mut system, "tick", &y, &yp), 0.0);
        }
        assert_eq!(instants, [0.25, 0.5, 0.75, LATE, 1.0]);
    }
}

#[test]
fn assertions_name_message_and_line() {
    let mut system = ball().compile(&Options::default());
    let (_, yp) = start(&mut system);
    let mut reports = Vec::new();
    system.assertions(0.0, &[-0.9, 0.0], &yp, &mut reports);
    assert!(reports.is_empty());
    system.assertions(0.0, &[-1.5, 0.0], &yp, &mut reports);
    assert_eq!(reports.len(), 1);
    assert_eq!(
        (reports[0].message.as_str(), reports[0].error, reports[0].file.as_ref()),
        ("too low", true, "test.hyd")
    );
    assert!(reports[0].line > 1);
    let root = &system.tables().roots[0];
    assert_eq!(root.text.as_ref(), "x < 0");
}

/// `p2 = 2*p1`, `k` without value in the text, `n` an integer; unknown `x` with `x = p2`.
fn parameters() -> Maker {
    let mut m = Maker::new();
    let [p1, p2, k] = ["p1", "p2", "k"].map(|name| m.scalar(name, Role::Parameter));
    let x = m.scalar("x", Role::Algebraic);
    m.sorted.system.flat.variables.raw[2].kind = hyd_system::ValueKind::Integer;
    m.bind(p1, 0, |e| e.number(1.5));
    m.bind(p2, 1, |e| {
        let (p1, two) = (e.var(p1), e.c(2.0));
        e.mul(p1, two)
    });
    m.solve(x, false, "x = p2 + k", |e| {
        let (x, p2, k) = (e.var(x), e.var(p2), e.var(k));
        let sum = e.add(p2, k);
        e.sub(x, sum)
    });
    m.assign_initially(Target::Var(x), 0, |e| e.c(0.0));
    m
}

#[test]
fn given_parameters_win_over_bindings_and_move_dependent_ones() {
    for options in forms() {
        let mut system = parameters().compile(&options);
        system.bind(0.0).unwrap();
        assert_eq!(system.parameters(), [1.5, 3.0, 0.0]);
        system.set_parameter(0, 4.0).unwrap();
        assert_eq!(system.parameters(), [1.5, 3.0, 0.0], "takes effect with bind");
        system.bind(0.0).unwrap();
        assert_eq!(system.parameters(), [4.0, 8.0, 0.0]);
        system.set_parameter(1, 7.0).unwrap();
        system.set_parameter(0, 5.0).unwrap();
        system.set_parameter(2, 2.0).unwrap();
        system.bind(0.0).unwrap();
        assert_eq!(system.parameters(), [5.0, 7.0, 2.0]);
        let mut out = [0.0];
        system.residual(0.0, &[10.0], &[0.0], &mut out);
        assert_eq!(out, [1.0]);
        assert_eq!(system.set_parameter(2, 0.5), Err(ParameterError::BadValue));
        assert_eq!(system.set_parameter(0, f64::NAN), Err(ParameterError::BadValue));
        assert_eq!(system.set_parameter(3, 1.0), Err(ParameterError::NotSettable));
    }
}

#[test]
fn a_parameter_without_finite_value_is_named() {
    let mut m = parameters();
    let p1 = hyd_flat::VarId(0);
    m.bind(hyd_flat::VarId(2), 1, |e| {
        let p1 = e.var(p1);
        let (one, shift) = (e.c(1.0), e.c(1.5));
        let zero = e.sub(p1, shift);
        e.div(one, zero)
    });
    let mut system = m.compile(&Options::default());
    let failure = system.bind(0.0).unwrap_err();
    assert_eq!((failure.variable.as_deref(), failure.reason.as_str()), (Some("k"), "division by zero (1.5 - 1.5)"));
    system.set_parameter(0, 2.0).unwrap();
    system.bind(0.0).unwrap();
}

/// `z` solves `x + y = 3`, `x - y = q`, with the parameter `q` solved for by `x*q = 2`; simulated is `x` alone.
fn initial() -> Maker {
    let mut m = Maker::new();
    let x = m.scalar("x", Role::State);
    let y = m.scalar("y", Role::Algebraic);
    let q = m.scalar("q", Role::Parameter);
    m.start(x, 2.0);
    m.assign(y, 0, "y = 3 - x", |e| {
        let (x, three) = (e.var(x), e.c(3.0));
        e.sub(three, x)
    });
    m.solve(x, true, "der(x) = q*y", |e| {
        let (rate, q, y) = (e.der(x), e.var(q), e.var(y));
        let right = e.mul(q, y);
        e.sub(rate, right)
    });
    m.assign_initially(Target::Var(y), 0, |e| {
        let (x, three) = (e.var(x), e.c(3.0));
        e.sub(three, x)
    });
    m.assign_initially(Target::Der(x), 1, |e| {
        let (q, y) = (e.var(q), e.var(y));
        e.mul(q, y)
    });
    m.solve_initially(Target::Var(x), |e| {
        let (x, y, q) = (e.var(x), e.var(y), e.var(q));
        let difference = e.sub(x, y);
        e.sub(difference, q)
    });
    m.solve_initially(Target::Var(q), |e| {
        let (x, q, two) = (e.var(x), e.var(q), e.c(2.0));
        let product = e.mul(x, q);
        e.sub(product, two)
    });
    m
}

#[test]
fn the_initial_system_solves_for_parameters_too() {
    for options in forms() {
        let mut system = initial().compile(&options);
        system.bind(0.0).unwrap();
        let mut z = [0.0; 2];
        system.initial_guess(0.0, &mut z).unwrap();
        assert_eq!(z, [2.0, 0.0]);
        assert_eq!(system.set_parameter(0, 1.0), Err(ParameterError::NotSettable));
        assert_eq!(system.tables().variables[2].settable, Settable::No);
        // x - (3 - x) - q and x q - 2; their derivatives by (x, q), columns first.
        let (mut g, mut values) = ([0.0; 2], [0.0; 4]);
        system.initial_residual(0.0, &[2.0, 0.5], &mut g).unwrap();
        system.initial_jacobian(0.0, &[2.0, 0.5], &mut values).unwrap();
        assert_eq!((g, values), ([0.5, -1.0], [2.0, 0.5, -1.0, 2.0]));
        let (mut y, mut yp) = ([0.0], [0.0]);
        system.initial_store(0.0, &[2.0, 1.0], &mut y, &mut yp).unwrap();
        assert_eq!((y, yp), ([2.0], [1.0]));
        assert_eq!(system.parameters(), [1.0]);
        let mut out = [0.0];
        system.residual(0.0, &y, &yp, &mut out);
        assert_eq!(out, [0.0]);
    }
}

#[test]
fn the_faulty_equation_is_found_with_its_reason() {
    for options in forms() {
        let mut m = Maker::new();
        let (x, a) = (m.scalar("x", Role::State), m.scalar("a", Role::Algebraic));
        let twin = m.scalar("twin", Role::Algebraic);
        m.sorted.system.resolution[twin] = Resolution::Alias { of: a, negated: true };
        m.assign(a, 0, "a = log(x - 1)", |e| {
            let (x, one) = (e.var(x), e.c(1.0));
            let shifted = e.sub(x, one);
            e.call(Function::Log, shifted)
        });
        m.solve(x, true, "der(x) = a/x", |e| {
            let (rate, a, x) = (e.der(x), e.read(Operand::new(Target::Var(twin)).negate()), e.var(x));
            let right = e.arena.intern(Node::Div(a, x));
            e.sub(rate, right)
        });
        m.assign_initially(Target::Var(x), 0, |e| e.start(x));
        m.assign_initially(Target::Der(x), 0, |e| e.c(0.0));
        let mut system = m.compile(&options);
        system.bind(0.0).unwrap();
        assert_eq!(system.diagnose(0.0, &[3.0], &[0.0]), None);
        let failure = system.diagnose(0.0, &[-1.0], &[0.0]).unwrap();
        let text = |k: Option<u32>| system.tables().equations[k.unwrap() as usize].text.to_string();
        assert_eq!(text(failure.equation), "a = log(x - 1)");
        assert_eq!((failure.variable.as_deref(), failure.reason.as_str()), (Some("a"), "logarithm of -2"));
        assert_eq!(output(&mut system, "twin", &[3.0], &[0.0]), -(2.0f64.ln()));
    }
}

#[test]
fn a_slope_without_value_is_found_in_the_jacobian() {
    for options in forms() {
        let mut m = Maker::new();
        let (x, y) = (m.scalar("x", Role::State), m.scalar("y", Role::State));
        m.solve(x, true, "der(x) = 1", |e| {
            let (rate, one) = (e.der(x), e.c(1.0));
            e.sub(rate, one)
        });
        m.solve(y, true, "der(y) = sqrt(x)", |e| {
            let (rate, x) = (e.der(y), e.var(x));
            let root = e.call(Function::Sqrt, x);
            e.sub(rate, root)
        });
        let mut system = m.compile(&options);
        system.bind(0.0).unwrap();
        assert_eq!(system.diagnose(0.0, &[4.0, 0.0], &[0.0; 2]), None);
        let failure = system.diagnose(0.0, &[0.0, 0.0], &[0.0; 2]).unwrap();
        let text = &system.tables().equations[failure.equation.unwrap() as usize].text;
        assert_eq!((text.as_ref(), failure.variable.as_deref()), ("der(y) = sqrt(x)", Some("y")));
        assert_eq!(failure.reason, "in its derivative: division by zero (sqrt(0))");
    }
}

/// E0501: an inconsistent system gives a message, not a panic.
#[test]
fn a_reset_of_what_is_no_state_makes_no_code() {
    for options in forms() {
        let mut m = Maker::new();
        let y = m.scalar("y", Role::Algebraic);
        m.assign(y, 0, "y = time", |e| e.time());
        m.reinit(y, |e| e.c(0.0));
        let said = m.model(&options).map(|_| ()).unwrap_err();
        assert_eq!(said.code.number(), "E0501");
        assert_eq!(said.message, "no code could be generated for `Test`: `reinit` of a variable that is not a state");
    }
}

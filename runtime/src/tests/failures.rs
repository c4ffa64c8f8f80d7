//! Runs that cannot go on: each names the time, the variable or relation and the place in the text.
#![allow(clippy::unwrap_used)]

use std::cell::Cell;

use hyd_results::{Discard, RowKind, Sink, Trajectory};
use hyd_system::{DaeSystem, LoopError};

use super::systems::hybrid::{Chatterer, Loop, Scalar, Vanishing};
use super::systems::smooth::Decay;
use super::systems::varied::Varied;
use super::systems::{Hand, Model};
use crate::{Cause, OptionError, Options, Simulator, SolveError, Stage, simulate};

fn fails(model: impl Model, stop: f64) -> SolveError {
    let options = Options::new(0.0, stop);
    let error = simulate(&mut Hand::new(model), &options, &mut Discard, &|| false).unwrap_err();
    println!("{error}");
    error
}

fn scalar(start: f64, value: fn(f64) -> f64, slope: fn(f64) -> f64) -> Scalar {
    Scalar { start, value, slope, assertion: |_, _| None }
}

#[test]
fn blow_up_collapses_the_step() {
    // x' = x^2, x(0) = 1: x = 1/(1 - t).
    let error = fails(scalar(1.0, |x| x * x, |x| 2.0 * x), 2.0);
    let time = error.time().unwrap();
    assert!((time - 1.0).abs() < 1e-3, "{time}");
    let SolveError::StepTooSmall(report) = &error else { panic!("{error}") };
    assert!(report.place.values[0].1 > 1e3);
    assert_eq!(report.place.values[0].0, "x");
}

#[test]
fn not_a_number_is_traced_to_its_equation() {
    // x' = -1/sqrt(x) from 1: x^(3/2) = 1 - 1.5 t, zero at t = 2/3 and no number after it.
    let error = fails(scalar(1.0, |x| -1.0 / x.sqrt(), |x| 0.5 / (x * x.sqrt())), 2.0);
    assert!((error.time().unwrap() - 2.0 / 3.0).abs() < 1e-3);
    // A root of negative x right from the start.
    let error = fails(scalar(-1.0, |x| x.sqrt(), |x| 0.5 / x.sqrt()), 2.0);
    let text = error.to_string();
    assert!(text.contains("not a number in the computation of x"), "{text}");
    assert!(text.contains("model.hyd:1"), "{text}");
}

#[test]
fn not_a_number_during_the_run() {
    let error = fails(scalar(1.0, |x| if x > 0.5 { -1.0 } else { f64::NAN }, |_| 0.0), 2.0);
    let SolveError::NotFinite(report) = &error else { panic!("{error}") };
    assert!((report.time - 0.5).abs() < 1e-6);
    assert_eq!(report.place.evaluation.as_ref().unwrap().variable.as_deref(), Some("x"));
    assert_eq!(report.place.equation.as_ref().unwrap().line, 1);
}

#[test]
fn an_infinite_derivative_is_named() {
    // Not at a point alone, beside which there are slopes.
    let error = fails(scalar(0.0, |x| x.abs().sqrt(), |_| f64::INFINITY), 1.0);
    let SolveError::NotFinite(report) = &error else { panic!("{error}") };
    assert_eq!(report.place.variable.as_deref(), Some("x"));
    assert!(error.to_string().contains("the derivative with respect to x is not finite"), "{error}");
}

#[test]
fn a_vanishing_coefficient_is_named() {
    for (model, at, stage) in
        [(Vanishing::new(0.0, 0.0), 0.0, Stage::Start), (Vanishing::new(1.0, 0.0), 0.5, Stage::Event)]
    {
        let error = fails(model, 1.0);
        let SolveError::Inconsistent { time, cause: Cause::Singular, place, stage: found } = &error else {
            panic!("{error}")
        };
        assert!((time - at).abs() < 1e-9 && *found == stage);
        assert_eq!(place.variable.as_deref(), Some("w"));
        assert_eq!(place.equation.as_ref().unwrap().text.as_ref(), "equation of w");
    }
}

#[test]
fn chattering_is_reported_with_its_relation() {
    let error = fails(Chatterer::new(), 1.0);
    let SolveError::Chattering { time, relations, .. } = &error else { panic!("{error}") };
    assert!((time - 0.25).abs() < 1e-6);
    assert_eq!(relations[0].text.as_ref(), "x > 0");
}

#[test]
fn an_endless_event_iteration_is_reported() {
    let error = fails(Loop { size: 1.0, flip: false, late: false }, 2.0);
    let SolveError::EventLoop { time, relations, .. } = &error else { panic!("{error}") };
    assert!((time - 1.0).abs() < 1e-9);
    let texts: Vec<&str> = relations.iter().map(|r| r.text.as_ref()).collect();
    assert_eq!(texts, ["not flip"]);
}

#[test]
fn passes_that_switch_nothing_but_rounding_have_settled() {
    let mut system = Hand::new(Loop { size: 1e-15, flip: false, late: false });
    let summary = simulate(&mut system, &Options::new(0.0, 2.0), &mut Discard, &|| false).unwrap();
    assert_eq!(summary.time, 2.0);
    // Either truth gives the same solution, and what is compared is equal within half of the tolerance, 1e-6.
    let mut system = Hand::new(Loop { size: 4e-7, flip: false, late: false });
    assert_eq!(simulate(&mut system, &Options::new(0.0, 2.0), &mut Discard, &|| false).unwrap().time, 2.0);
    // What is compared differs by more.
    let error = fails(Loop { size: 1e-6, flip: false, late: false }, 2.0);
    assert!(matches!(&error, SolveError::EventLoop { .. }), "{error}");
}

#[test]
fn assertions_stop_or_warn() {
    let grow = |assertion| Scalar { start: 0.0, value: |_| 1.0, slope: |_| 0.0, assertion };
    let error = fails(grow(|_, x| (x > 0.5).then_some(("too far", true))), 1.0);
    assert!(matches!(&error, SolveError::Assertion { time, .. } if (0.5..0.503).contains(time)), "{error}");
    assert!(error.to_string().contains("too far\n  at model.hyd:200"));
    let mut system = Hand::new(grow(|_, x| (x > 0.5).then_some(("far", false))));
    let summary = simulate(&mut system, &Options::new(0.0, 1.0), &mut Discard, &|| false).unwrap();
    assert_eq!(summary.warnings.len(), 1);
    assert_eq!(summary.warnings[0].report.message, "far");
    // One warning per time that the assertion ceases to hold, with the number of points and the last of them.
    let mut system = Hand::new(grow(|t, _| (t % 0.5 > 0.3).then_some(("far", false))));
    let options = Options { intervals: 100, ..Options::new(0.0, 1.2) };
    let summary = simulate(&mut system, &options, &mut Discard, &|| false).unwrap();
    let spells: Vec<(bool, bool)> = summary.warnings.iter().map(|w| (w.points > 10, w.until < w.time + 0.2)).collect();
    assert_eq!(spells, [(true, true); 2], "{:?}", summary.warnings);
}

#[test]
fn an_interrupt_leaves_whole_rows() {
    let calls = Cell::new(0);
    let stop = || {
        calls.set(calls.get() + 1);
        calls.get() > 20
    };
    let mut run = Trajectory::new();
    let error = simulate(&mut Hand::new(Decay), &Options::new(0.0, 50.0), &mut run, &stop).unwrap_err();
    let SolveError::Interrupted { time } = error else { panic!("{error}") };
    assert!(!run.is_empty() && *run.times().last().unwrap() <= time);
}

/// Exponential decay whose values are doubted after the start.
struct Doubted(bool);

impl Model for Doubted {
    fn names(&self) -> Vec<String> {
        Decay.names()
    }
    fn start(&self) -> Vec<f64> {
        Decay.start()
    }
    fn residual(&self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        Decay.residual(t, y, yp, out);
    }
    fn jacobian(&self, t: f64, y: &[f64], yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        Decay.jacobian(t, y, yp, state, rate);
    }
    fn loop_error(&self, t: f64) -> Option<LoopError> {
        (self.0 && t > 0.0).then_some(LoopError { row: 0, residual: 1.0, rounding: 1.0 })
    }
}

#[test]
fn a_run_that_is_refused_leaves_room_for_the_next() {
    let mut system = Hand::new(Doubted(true));
    let mut simulation = Simulator::new(system.structure());
    let options = Options::new(0.0, 1.0);
    let error = simulation.run(&mut system, &options, &mut Discard, &|| false).unwrap_err();
    assert!(matches!(error, SolveError::Rounding { .. }), "{error}");
    system.model.0 = false;
    let mut run = Trajectory::new();
    simulation.run(&mut system, &options, &mut run, &|| false).unwrap();
    let mut fresh = Trajectory::new();
    simulate(&mut system, &options, &mut fresh, &|| false).unwrap();
    let rows = |run: &Trajectory| -> Vec<Vec<f64>> { (0..run.len()).map(|k| run.row(k).to_vec()).collect() };
    assert!(run.len() > 2);
    assert_eq!(rows(&run), rows(&fresh));
}

#[test]
fn a_run_that_failed_leaves_nothing_behind() {
    // With parameters above 3 a rate has no value in the end.
    let options = Options { intervals: 7, ..Options::new(0.0, 1.0).with_tolerance(1e-3) };
    let mut system = Hand::new(Varied::new());
    let mut used = Simulator::new(system.structure());
    let mut run = |simulator: &mut Simulator, parameter: f64| {
        system.set_parameter(0, parameter).unwrap();
        let outcome = simulator.run(&mut system, &options, &mut Discard, &|| false);
        (outcome.is_ok(), *simulator.statistics())
    };
    for k in 0..20 {
        assert!(!run(&mut used, 3.1 + 0.01 * f64::from(k)).0);
        let parameter = 0.3 + 0.1 * f64::from(k);
        let fresh = run(&mut Simulator::new(Hand::new(Varied::new()).structure()), parameter);
        assert_eq!(run(&mut used, parameter), fresh, "with {parameter}");
    }
}

#[test]
fn limits_and_options_are_checked() {
    let few = Options { max_steps: 5, ..Options::new(0.0, 50.0) };
    let error = simulate(&mut Hand::new(Decay), &few, &mut Discard, &|| false).unwrap_err();
    assert!(matches!(error, SolveError::TooManySteps { steps: 5, .. }));
    let error = simulate(&mut Hand::new(Decay), &Options::new(1.0, 0.0), &mut Discard, &|| false).unwrap_err();
    assert!(matches!(error, SolveError::Option(OptionError::Times { .. })));
}

#[test]
fn a_run_that_stands_still_is_given_up_long_before_the_limit_of_steps() {
    // A state that is held where its rate changes its sign, without an event.
    let error = fails(scalar(0.5, |x| if x > 0.0 { -1.0 } else { 1.0 }, |_| 0.0), 1.0);
    let SolveError::TooManySteps { time, steps, .. } = &error else { panic!("{error}") };
    assert!(*steps < 1_000_000 && (0.5..0.6).contains(time), "{error}");
}

#[test]
fn a_sink_that_fails_ends_the_run() {
    struct Full(u32);
    impl Sink for Full {
        fn begin(&mut self, _: &std::sync::Arc<hyd_system::Tables>, _: &[f64]) -> std::io::Result<()> {
            Ok(())
        }
        fn row(&mut self, _: f64, _: &[f64], _: RowKind) -> std::io::Result<()> {
            self.0 += 1;
            if self.0 > 10 { Err(std::io::ErrorKind::StorageFull.into()) } else { Ok(()) }
        }
    }
    let error = simulate(&mut Hand::new(Decay), &Options::new(0.0, 5.0), &mut Full(0), &|| false).unwrap_err();
    assert!(matches!(&error, SolveError::Sink { time, .. } if (*time - 0.1).abs() < 1e-12), "{error}");
}

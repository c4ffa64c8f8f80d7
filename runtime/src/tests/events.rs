//! Events: times and values against closed forms, rows before and after, and runs that end by themselves.
#![allow(clippy::unwrap_used)]

use hyd_results::{RowKind, Side, Trajectory};
use hyd_system::DaeSystem;

use super::systems::drive::Drive;
use super::systems::hybrid::{AlgebraicSwitch, Ball, Clock, SwitchedRc, Touch};
use super::systems::{Hand, Model};
use crate::{Options, Simulator, SolveError, Solver, Summary, simulate};

fn run(model: impl Model, options: &Options) -> (Trajectory, Summary) {
    let mut trajectory = Trajectory::new();
    let summary = simulate(&mut Hand::new(model), options, &mut trajectory, &|| false).unwrap();
    println!("{}", summary.statistics);
    (trajectory, summary)
}

/// Times at which a row before an event stands.
fn event_times(run: &Trajectory) -> Vec<f64> {
    let rows = run.times().iter().zip(run.kinds());
    rows.filter(|(_, kind)| **kind == RowKind::BeforeEvent).map(|(&t, _)| t).collect()
}

#[test]
fn bounces_come_when_the_parabolas_say() {
    let (e, fall) = (0.8, (2.0f64 / Ball::GRAVITY).sqrt());
    let (run, summary) = run(Ball::new(e, 100.0), &Options::new(0.0, 3.0).with_tolerance(1e-8));
    // Bounce k at fall (1 + 2 e + 2 e^2 + ...); the flight after it takes 2 e^(k+1) fall.
    let mut expected = Vec::new();
    let (mut t, mut flight) = (fall, 2.0 * e * fall);
    while t < 3.0 {
        expected.push(t);
        t += flight;
        flight *= e;
    }
    let count = run.series("count").unwrap();
    for (k, &t) in expected.iter().enumerate() {
        let before = count.value(t - 1e-6, Side::Before);
        let after = count.value(t + 1e-6, Side::After);
        assert_eq!((before, after), (k as f64, k as f64 + 1.0), "bounce {} at {t}", k + 1);
    }
    let first = event_times(&run)[0];
    assert!((first - fall).abs() < 1e-8, "first bounce at {first} instead of {fall}");
    let height = run.series("h").unwrap();
    let top = expected[0] + e * fall;
    // Linear interpolation between rows 6 ms apart: up to g dt^2 / 8.
    assert!((height.value(top, Side::After) - e * e).abs() < 1e-4);
    // Leaving the floor is not a second event.
    assert_eq!(summary.statistics.state_events, expected.len() as u64);
    assert!(height.values().iter().all(|&h| h > -1e-8));
}

/// Steps of up to 20 ms, output points 2 ms apart: relations that hold for 4 ms, 2 ms and 20 us are all seen, on and off.
#[test]
fn a_relation_that_changes_back_within_a_step_is_seen() {
    for solver in [Solver::Bdf, Solver::Esdirk, Solver::Auto] {
        for width in [2e-3, 1e-3, 1e-5] {
            let (run, summary) = run(Touch::new(width), &Options { solver, ..Options::new(0.0, 1.0) });
            assert_eq!(run.last("count"), Some(1.0), "{width}, {solver:?}");
            let times = event_times(&run);
            assert_eq!(times.len(), 2, "{width}, {solver:?}: {times:?}");
            assert!((times[0] - (0.5 - width)).abs() < 1e-10 && (times[1] - (0.5 + width)).abs() < 1e-10, "{times:?}");
            assert_eq!(summary.statistics.state_events, 2);
        }
    }
}

/// Bounces with restitution 0.5 end at fall (1 + 2 + 1 + 1/2 + ...) / 1 = 3 fall: the run stops there and names the relation.
#[test]
fn a_ball_does_not_fall_through_its_floor() {
    let fall = (2.0f64 / Ball::GRAVITY).sqrt();
    let mut rows = Trajectory::new();
    let outcome = simulate(&mut Hand::new(Ball::new(0.5, 1e9)), &Options::new(0.0, 3.0), &mut rows, &|| false);
    let error = outcome.unwrap_err();
    let SolveError::Chattering { time, accumulating: true, relations, .. } = &error else { panic!("{error}") };
    assert!((time - 3.0 * fall).abs() < 1e-6, "{time} instead of {}", 3.0 * fall);
    assert_eq!(relations[0].text.as_ref(), "h <= 0");
    assert!(error.to_string().contains("events accumulate"), "{error}");
    assert!(rows.series("h").unwrap().values().iter().all(|&h| h > -1e-9));
}

#[test]
fn terminate_ends_the_run_with_its_event() {
    let (run, summary) = run(Ball::new(0.5, 2.0), &Options::new(0.0, 3.0).with_tolerance(1e-9));
    let fall = (2.0f64 / Ball::GRAVITY).sqrt();
    assert_eq!(summary.terminated.as_deref(), Some("enough"));
    assert!((summary.time - 2.0 * fall).abs() < 1e-8);
    assert_eq!(run.times().last(), Some(&summary.time));
    assert_eq!(run.kinds().last(), Some(&RowKind::AfterEvent));
    assert_eq!(run.last("count"), Some(2.0));
}

#[test]
fn square_wave_is_met_at_its_edges() {
    let exact = SwitchedRc::new(0.1, 0.25);
    let (run, summary) = run(SwitchedRc::new(0.1, 0.25), &Options::new(0.0, 2.1).with_tolerance(1e-8));
    assert_eq!(summary.statistics.time_events, 8);
    assert_eq!(event_times(&run), [0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0]);
    let u = run.series("u").unwrap();
    for (k, &t) in run.times().iter().enumerate() {
        assert!((u.at(k) - exact.exact(t)).abs() < 1e-7, "u({t})");
    }
    // The rate jumps in the doubled rows, the voltage does not.
    let slope = run.series("der(u)").unwrap();
    let k = run.times().iter().position(|&t| t == 0.25).unwrap();
    assert_eq!(run.times()[k + 1], 0.25);
    assert!((slope.at(k + 1) - slope.at(k) + 10.0).abs() < 1e-5);
    assert_eq!(u.at(k), u.at(k + 1));
    // 501 output points, of which 0.25, 0.5, ... fall between the grid of 4.2 ms except where they coincide.
    let coincide =
        (0..=500).filter(|k| [0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0].contains(&(2.1 * f64::from(*k) / 500.0)));
    assert_eq!(run.len(), 501 + 16 - coincide.count());
}

#[test]
fn an_algebraic_unknown_triggers_and_jumps() {
    let (run, summary) = run(AlgebraicSwitch { above: false }, &Options::new(0.0, 1.0));
    assert_eq!(summary.statistics.state_events, 1);
    let times = event_times(&run);
    assert!((times[0] - 0.5).abs() < 1e-9);
    let w = run.series("w").unwrap();
    assert!((w.value(times[0], Side::Before)).abs() < 1e-9);
    assert!((w.value(times[0], Side::After) - 1.0).abs() < 1e-9);
    assert!((w.value(1.0, Side::After) - 2.0).abs() < 1e-9);
}

#[test]
fn a_simulator_repeats_a_run_to_the_last_bit() {
    let mut system = Hand::new(Ball::new(0.8, 20.0));
    let mut simulator = Simulator::new(system.structure());
    let options = Options::new(0.0, 2.0);
    let (mut first, mut second) = (Trajectory::new(), Trajectory::new());
    simulator.run(&mut system, &options, &mut first, &|| false).unwrap();
    simulator.run(&mut system, &options, &mut second, &|| false).unwrap();
    assert_eq!(first.times(), second.times());
    assert!((0..first.len()).all(|k| first.row(k) == second.row(k)));
}

#[test]
fn a_system_without_unknowns_still_has_events() {
    let options = Options { intervals: 7, ..Options::new(0.0, 3.5) };
    let (run, summary) = run(Clock(0.0), &options);
    assert_eq!(summary.statistics.time_events, 3);
    let rows: Vec<(f64, f64)> = run.times().iter().copied().zip(run.series("seconds").unwrap().values()).collect();
    let doubled = |k: f64| [(k, k - 1.0), (k, k)];
    let mut expected = vec![(0.0, 0.0), (0.5, 0.0)];
    for k in [1.0, 2.0, 3.0] {
        expected.extend(doubled(k));
        expected.push((k + 0.5, k));
    }
    assert_eq!(rows, expected);
}

#[test]
fn a_valve_drive_converges_with_the_tolerance() {
    let at = |tolerance| run(Drive::new(1e-3, 12e-3), &Options::new(0.0, 0.03).with_tolerance(tolerance));
    let (fine, _) = at(1e-11);
    for (tolerance, steps) in [(1e-6, 2500), (1e-8, 6000)] {
        let (coarse, summary) = at(tolerance);
        assert_eq!((summary.statistics.time_events, coarse.len()), (2, fine.len()));
        assert!(summary.statistics.steps < steps && summary.statistics.convergence_failures < 20);
        for (name, nominal) in [("u_C", 10.0), ("lambda", 0.05), ("x", 1e-4), ("p", 1e7), ("y", 1e-2)] {
            let (a, b) = (coarse.series(name).unwrap(), fine.series(name).unwrap());
            let worst = (0..fine.len()).map(|k| (a.at(k) - b.at(k)).abs()).fold(0.0, f64::max);
            // The contacts magnify what has gathered on the way to them by some two decades.
            assert!(worst < 2e3 * tolerance * nominal, "{name} at {tolerance:e}: {worst:e}");
        }
    }
}

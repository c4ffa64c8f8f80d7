//! Accuracy on smooth systems with closed-form solutions: errors follow the tolerance, constraints hold in every row.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

use hyd_results::Trajectory;

use super::systems::smooth::{Decay, Heat, Line, LinearDae, Oscillator};
use super::systems::{Hand, Model};
use crate::{Options, Statistics, simulate};

fn run(model: impl Model, options: &Options) -> (Trajectory, Statistics) {
    let mut trajectory = Trajectory::new();
    let summary = simulate(&mut Hand::new(model), options, &mut trajectory, &|| false).unwrap();
    (trajectory, summary.statistics)
}

/// Largest deviation of a variable from its exact course.
fn deviation(run: &Trajectory, name: &str, exact: impl Fn(f64) -> f64) -> f64 {
    let values = run.series(name).unwrap().values();
    run.times().iter().zip(values).map(|(&t, v)| (v - exact(t)).abs()).fold(0.0, f64::max)
}

#[test]
fn decay_follows_the_tolerance() {
    let mut last = f64::INFINITY;
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let (run, statistics) = run(Decay, &Options::new(0.0, 5.0).with_tolerance(tolerance));
        let error = deviation(&run, "x", |t| (-t).exp());
        println!("{tolerance:e}: {error:.2e}, {} steps {} residuals", statistics.steps, statistics.residuals);
        assert!(error < 30.0 * tolerance, "{error} at {tolerance}");
        assert!(error < 0.2 * last);
        assert!(deviation(&run, "der(x)", |t| -(-t).exp()) < 30.0 * tolerance);
        assert_eq!(run.len(), 501);
        last = error;
    }
}

#[test]
fn oscillator_follows_the_tolerance() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let (run, statistics) = run(Oscillator, &Options::new(0.0, 20.0).with_tolerance(tolerance));
        let error = deviation(&run, "x", f64::cos);
        println!("{tolerance:e}: {error:.2e}, {} steps", statistics.steps);
        // Three periods without damping: local errors add up over some 200 steps.
        assert!(error < 300.0 * tolerance, "{error} at {tolerance}");
    }
}

#[test]
fn linear_dae_starts_consistent_and_keeps_its_constraint() {
    for tolerance in [1e-5, 1e-8] {
        let (run, _) = run(LinearDae, &Options::new(0.0, 4.0).with_tolerance(tolerance));
        assert!((run.row(0)[1] + 1.0).abs() < 1e-12, "z(0) = sin 0 - x(0)");
        assert!(deviation(&run, "x", |t| LinearDae::exact(t)[0]) < 50.0 * tolerance);
        assert!(deviation(&run, "z", |t| LinearDae::exact(t)[1]) < 50.0 * tolerance);
        for (k, &t) in run.times().iter().enumerate() {
            let row = run.row(k);
            assert!((row[0] + row[1] - t.sin()).abs() < 1e-12, "constraint at {t}");
        }
    }
}

#[test]
fn algebraic_unknowns_can_be_left_out_of_the_error_test() {
    let tested = Options::new(0.0, 4.0).with_tolerance(1e-7);
    let suppressed = Options { suppress_algebraic: true, ..tested.clone() };
    let (run_tested, _) = run(LinearDae, &tested);
    let (run_suppressed, _) = run(LinearDae, &suppressed);
    for run in [run_tested, run_suppressed] {
        assert!(deviation(&run, "x", |t| LinearDae::exact(t)[0]) < 5e-6);
        assert!(deviation(&run, "z", |t| LinearDae::exact(t)[1]) < 5e-6);
    }
}

#[test]
fn a_lower_order_costs_more_steps() {
    let full = Options::new(0.0, 5.0);
    let low = Options { max_order: 2, ..full.clone() };
    let (_, five) = run(Decay, &full);
    let (run, two) = run(Decay, &low);
    assert!(two.steps > five.steps && two.steps_by_order[2..] == [0, 0, 0]);
    assert!(deviation(&run, "x", |t| (-t).exp()) < 1e-4);
}

#[test]
fn heat_conduction_in_two_thousand_points() {
    let heat = Heat(2000);
    let (rate, middle) = (heat.rate(), heat.start()[999]);
    let options = Options { intervals: 10, ..Options::new(0.0, 0.2).with_tolerance(1e-6) };
    let (run, statistics) = run(heat, &options);
    println!("{statistics}");
    assert!(deviation(&run, "T1000", |t| middle * (-rate * t).exp()) < 5e-5);
    assert!(statistics.steps < 300 && statistics.factorisations < 100);
}

#[test]
fn a_pressure_line_comes_to_rest() {
    // The slowest wave of a closed line decays with half the friction: exp(-12) is left of it at t = 24.
    let line = || Line { cells: 50, friction: 1.0, tau: 0.2 };
    for max_order in [5, 2] {
        let options = Options { intervals: 1, max_order, ..Options::new(0.0, 24.0).with_tolerance(1e-6) };
        let (run, statistics) = run(line(), &options);
        println!("{statistics}");
        for k in [1, 25, 50] {
            let p = run.last(&format!("p{k}")).unwrap();
            assert!((p - 1.0).abs() < 5e-5, "p{k} = {p}");
        }
    }
}

#[test]
fn every_step_gives_a_row_per_step() {
    let options = Options { every_step: true, ..Options::new(0.0, 1.0) };
    let (run, statistics) = run(Decay, &options);
    assert_eq!(run.len() as u64, statistics.steps + 1);
    assert_eq!(run.times().last(), Some(&1.0));
}

/// There is always a row at the start, and one at the stop time only where it is listed.
#[test]
fn listed_points_are_the_rows() {
    for (times, rows) in [
        (vec![0.3, 0.7], vec![0.0, 0.3, 0.7]),
        (vec![0.0, 0.3, 1.0], vec![0.0, 0.3, 1.0]),
        (vec![0.3, 2.0], vec![0.0, 0.3]),
    ] {
        let (run, _) = run(Decay, &Options { times, ..Options::new(0.0, 1.0) });
        assert_eq!(run.times(), rows);
    }
}

#[test]
fn a_run_of_no_length_has_one_row() {
    let (run, statistics) = run(LinearDae, &Options::new(2.0, 2.0));
    assert_eq!((run.len(), statistics.steps), (1, 0));
}

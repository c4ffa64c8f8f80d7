//! The one-step method by itself, and the choice between the methods: orders, stiff problems, waves.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

use hyd_results::Trajectory;

use super::systems::smooth::{LinearDae, Oscillator};
use super::systems::stiff::{Hires, Robertson, VanDerPol};
use super::systems::waves::Cord;
use super::systems::{Hand, Model};
use crate::{Method, Options, Solver, Summary, simulate};

fn run(model: impl Model, options: &Options) -> (Trajectory, Summary) {
    let mut trajectory = Trajectory::new();
    let summary = simulate(&mut Hand::new(model), options, &mut trajectory, &|| false).unwrap();
    (trajectory, summary)
}

fn deviation(run: &Trajectory, name: &str, exact: impl Fn(f64) -> f64) -> f64 {
    let values = run.series(name).unwrap().values();
    run.times().iter().zip(values).map(|(&t, v)| (v - exact(t)).abs()).fold(0.0, f64::max)
}

fn esdirk(stop: f64, tolerance: f64) -> Options {
    Options { solver: Solver::Esdirk, ..Options::new(0.0, stop).with_tolerance(tolerance) }
}

/// Steps of fixed size: halving them divides the error by 2^4, at the steps and (333 output points) between them.
#[test]
fn the_one_step_method_and_its_dense_output_have_order_four() {
    let error = |h: f64, intervals: usize| {
        let options = Options { initial_step: Some(h), max_step: Some(h), intervals, ..esdirk(4.0, 1e-2) };
        let (run, summary) = run(Oscillator, &options);
        assert_eq!(summary.statistics.steps, (4.0 / h).round() as u64);
        deviation(&run, "x", f64::cos)
    };
    for intervals in [10, 333] {
        let ratios = [0.1, 0.05].map(|h| error(h, intervals) / error(0.5 * h, intervals));
        println!("{intervals} intervals: error ratios {ratios:?}");
        assert!(ratios.iter().all(|ratio| (14.0..19.0).contains(ratio)), "{ratios:?}");
    }
}

#[test]
fn constraints_and_algebraic_unknowns_follow_the_tolerance() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let (run, _) = run(LinearDae, &esdirk(4.0, tolerance));
        assert!(deviation(&run, "x", |t| LinearDae::exact(t)[0]) < 10.0 * tolerance);
        assert!(deviation(&run, "z", |t| LinearDae::exact(t)[1]) < 10.0 * tolerance);
    }
}

/// End values published in Hairer, Wanner 1996 and the test set of Mazzia, Magherini 2008, as in the tests of BDF.
#[test]
fn stiff_problems_end_where_published() {
    let end = |model: &mut dyn FnMut(&Options) -> (Trajectory, Summary), stop: f64, tolerance: f64| {
        let options = Options { intervals: 1, max_step: Some(stop), ..esdirk(stop, tolerance) };
        let (run, summary) = model(&options);
        println!("{}", summary.statistics);
        assert_eq!(summary.statistics.steps, summary.statistics.one_step_steps);
        run.row(run.len() - 1).to_vec()
    };
    let close = |value: f64, reference: f64, relative: f64| {
        assert!((value / reference - 1.0).abs() < relative, "{value:e} against {reference:e}");
    };
    let y = end(&mut |options| run(VanDerPol, options), 2.0, 1e-8);
    close(y[0], 1.706_167_732_170_483, 1e-5);
    close(y[1], -0.892_809_701_024_797_5, 1e-5);
    let y = end(&mut |options| run(Robertson { nominals: [1.0, 1e-5, 1.0] }, options), 40.0, 1e-6);
    close(y[0], 0.7158, 1e-4);
    close(y[1], 9.1855e-6, 1e-4);
    let y = end(&mut |options| run(Hires, options), 321.8122, 1e-6);
    close(y[0], 0.737_131_257_332_567e-3, 1e-3);
    close(y[7], 0.285_000_160_481_495e-2, 1e-3);
}

/// A string of more points has higher frequencies, which carry nothing: steps must not become more with them.
#[test]
fn steps_on_a_string_do_not_depend_on_its_points() {
    let mut counts = Vec::new();
    for n in [50, 200, 800] {
        let cord = Cord(n);
        let omega = cord.frequency();
        let (run, summary) = run(cord, &Options { intervals: 100, ..Options::new(0.0, 10.0).with_tolerance(1e-5) });
        let middle = (std::f64::consts::PI * (n / 2) as f64 / (n + 1) as f64).sin();
        let error = deviation(&run, &format!("y{}", n / 2), |t| middle * (omega * t).cos());
        let used: Vec<Method> = summary.phases.iter().map(|phase| phase.method).collect();
        println!("{n} points: error {error:.1e}, {used:?}, {}", summary.statistics);
        assert!(error < 3e-3, "{error}");
        assert!(n < 200 || used.contains(&Method::Esdirk));
        counts.push(summary.statistics.steps);
    }
    let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
    assert!(most < &(2 * least), "{counts:?}");
}

/// BDF alone lowers its order where the high orders crawl, and is then several times as fast.
#[test]
fn bdf_lowers_its_order_by_itself() {
    let options = Options { intervals: 100, solver: Solver::Bdf, ..Options::new(0.0, 10.0).with_tolerance(1e-4) };
    let (_, summary) = run(Cord(800), &options);
    println!("{:?}\n{}", summary.phases, summary.statistics);
    assert!(summary.phases.iter().any(|phase| phase.method == Method::BdfLowOrder));
    assert_eq!(summary.statistics.one_step_steps, 0);
}

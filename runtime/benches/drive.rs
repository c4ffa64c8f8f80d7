//! Time of one run of the seven-state valve drive over 30 ms with two events, by tolerance, and of stiff reference problems.
//!
//! `cargo bench -p hyd-runtime`.  Prints the best of many runs and the solver's counters; the work space is reused, as in a sweep.

#[path = "../src/tests/systems/mod.rs"]
mod systems;

use std::time::Instant;

use hyd_results::{Discard, Trajectory};
use hyd_runtime::{Options, Simulator};
use hyd_system::DaeSystem;
use systems::drive::Drive;
use systems::smooth::Line;
use systems::stiff::{Hires, VanDerPol};
use systems::{Hand, Model};

fn time(name: &str, model: impl Model, options: &Options) {
    let mut system = Hand::new(model);
    let mut simulator = Simulator::new(system.structure());
    let mut best = f64::INFINITY;
    for _ in 0..10 {
        let start = Instant::now();
        simulator.run(&mut system, options, &mut Discard, &|| false).expect("the bench problems have solutions");
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{name}, tolerance {:e}: {:.3} ms\n{}\n", options.tolerance, 1e3 * best, simulator.statistics());
}

/// Largest deviation of each unknown from a run at tolerance 1e-12, in nominal values.
fn accuracy(tolerance: f64) {
    let run = |tolerance| {
        let mut trajectory = Trajectory::new();
        let mut system = Hand::new(Drive::new(1e-3, 12e-3));
        let options = Options::new(0.0, 0.03).with_tolerance(tolerance);
        Simulator::new(system.structure())
            .run(&mut system, &options, &mut trajectory, &|| false)
            .expect("the bench problems have solutions");
        trajectory
    };
    let (coarse, fine) = (run(tolerance), run(1e-12));
    let nominals = Drive::new(0.0, 0.0).nominals();
    print!("drive at {tolerance:e} against 1e-12:");
    for (k, nominal) in nominals.iter().enumerate() {
        let worst = (0..fine.len()).map(|row| (coarse.row(row)[k] - fine.row(row)[k]).abs()).fold(0.0, f64::max);
        print!(" {:.1e}", worst / nominal);
    }
    println!();
}

fn main() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        accuracy(tolerance);
        time("drive", Drive::new(1e-3, 12e-3), &Options::new(0.0, 0.03).with_tolerance(tolerance));
    }
    let options = Options { intervals: 1, max_step: Some(2.0), ..Options::new(0.0, 2.0) };
    time("Van der Pol", VanDerPol, &options);
    let options = Options { intervals: 1, max_step: Some(400.0), ..Options::new(0.0, 321.8122) };
    time("HIRES", Hires, &options);
    for max_order in [5, 2] {
        let options = Options { intervals: 10, max_order, ..Options::new(0.0, 20.0).with_tolerance(1e-5) };
        time(&format!("line, order {max_order}"), Line { cells: 200, friction: 1.0, tau: 0.5 }, &options);
    }
}

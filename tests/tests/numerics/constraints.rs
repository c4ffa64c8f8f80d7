//! Constraints between states at every output point: a pendulum in Cartesian coordinates that turns over, at coarse tolerance.
//!
//! Between steps of the solver states are interpolated; everything that follows from them is solved for again there, so the
//! length is exact in every row although the solution itself is not.  Compared with the length, and with the angle that solves
//! the equation of the pendulum in the same run.

use hyd_runtime::{Options, Solver};
use hyd_tests::runs::{Run, on_grid, run};

const MODEL: &str = "tests/language/index_reduction/pendulum_over_the_top.hyd";

fn largest(run: &Run, name: &str) -> f64 {
    run.values(name).iter().map(|value| value.abs()).fold(0.0, f64::max)
}

#[test]
fn the_length_holds_at_every_output_point_whatever_the_tolerance() {
    for tolerance in [1e-3, 1e-4, 1e-7] {
        let run = run(MODEL, &[], &on_grid(20.0, 2000, tolerance));
        assert_eq!(run.rows.len(), 2001);
        assert!(largest(&run, "length") <= 1e-10, "{tolerance:e}: {:e}", largest(&run, "length"));
        assert!(largest(&run, "along") <= 1e-9, "{tolerance:e}: {:e}", largest(&run, "along"));
        // Fifteen revolutions, two changes on each level in each.
        let choices = run.summary.statistics.state_choices;
        assert!((30..=140).contains(&choices), "{choices} changes of states");
    }
}

#[test]
fn the_length_holds_at_the_points_of_the_solver() {
    let options = Options { every_step: true, ..on_grid(20.0, 1, 1e-4) };
    let run = run(MODEL, &[], &options);
    assert!(run.rows.len() > 500 && largest(&run, "length") <= 1e-10, "{:e}", largest(&run, "length"));
}

#[test]
fn the_error_of_many_revolutions_shrinks_with_the_tolerance() {
    let error = |tolerance: f64| {
        let run = run(MODEL, &[], &on_grid(20.0, 100, tolerance));
        let energy = run.values("energy").iter().map(|energy| (energy - 14.69).abs()).fold(0.0, f64::max);
        energy.max(largest(&run, "dx")).max(largest(&run, "dy"))
    };
    let errors = [1e-6, 1e-8, 1e-10].map(error);
    assert!(errors[0] < 2e-2 && errors[1] < 5e-4 && errors[2] < 1e-5, "{errors:?}");
}

/// A one-step method begins with the rates of the new states, which were formal ones before.
#[test]
fn the_one_step_method_goes_on_with_other_states() {
    let error = |tolerance: f64| {
        let options = Options { solver: Solver::Esdirk, ..on_grid(20.0, 100, tolerance) };
        let run = run(MODEL, &[], &options);
        let statistics = &run.summary.statistics;
        assert!(statistics.state_choices >= 30 && largest(&run, "length") <= 1e-10, "{tolerance:e}");
        let most = 400.0 * (1e-2 / tolerance).powf(0.25);
        assert!((statistics.steps as f64) < most, "{tolerance:e}: {} steps", statistics.steps);
        largest(&run, "dx").max(largest(&run, "dy"))
    };
    let errors = [1e-3, 1e-5, 1e-7, 1e-9].map(error);
    assert!(errors[1] < 0.5 && errors[2] < 5e-3 && errors[3] < 5e-5, "{errors:?}");
}

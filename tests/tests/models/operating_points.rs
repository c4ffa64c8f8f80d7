//! The compiled drive against a right-hand side written by hand, at the corners of the operating range.
//!
//! Supply 8 and 20 MPa, 24 and 36 V, 680 and 2200 uF.  The hand-written drive (`hyd_tests::drive_equations`) is
//! integrated by the pair of Dormand and Prince at 1e-11, and again at 1e-10 to know its own error: the two must agree
//! to a fifth of the limits. Limits are those of the stored solutions, but for u_C: where the magnet barely beats the
//! oil (20 MPa, 24 V, 680 uF) the motion, and by its voltage the circuit, answers small errors most strongly, so three
//! times as much is allowed.  The speeds, which turn within microseconds at a contact, may be off as far as 1e-8 m of
//! position allow.

use hyd_results::Trajectory;
use hyd_runtime::simulate;
use hyd_tests::drive_equations::{Experiment, NAMES, STATES, inductance};
use hyd_tests::reference::verdict;
use hyd_tests::runs::{Run, instance, on_grid, translated};

const STOP: f64 = 0.04;
const INTERVALS: usize = 800;

/// Limit of each state, in its unit.
const LIMITS: [f64; STATES] = [3e-5, 2e-7, 2e-8, 1e-3, 1e-7, 1e-3, 1e4];

fn column(values: &[[f64; STATES]], k: usize) -> Vec<f64> {
    values.iter().map(|row| row[k]).collect()
}

/// Report on all states that are further apart than `share` of the limits.
fn report(times: &[f64], actual: &dyn Fn(usize) -> Vec<f64>, expected: &[[f64; STATES]], share: f64) -> String {
    let state = |k: usize| verdict(NAMES[k], times, &actual(k), &column(expected, k), share * LIMITS[k]);
    (0..STATES).map(state).collect()
}

#[test]
fn corners_of_the_operating_range() {
    let file = "models/single_acting_drive/drive.hyd";
    let compilation = translated(file, &[]);
    let options = on_grid(STOP, INTERVALS, 1e-8);
    let mut opened = 0;
    for p0 in [8e6, 20e6] {
        for u0 in [24.0, 36.0] {
            for c in [680e-6, 2200e-6] {
                let experiment = Experiment { p0, u0, c, t_off: 10e-3 };
                let (times, expected) = experiment.solve(STOP, INTERVALS, 1e-11);
                let (_, coarse) = experiment.solve(STOP, INTERVALS, 1e-10);
                let own = report(&times, &|k| column(&coarse, k), &expected, 0.2);
                assert!(own.is_empty(), "{experiment:?}: the reference disagrees with itself\n{own}");
                let texts = [p0, u0, c].map(|value| value.to_string());
                let set = [("p0", &*texts[0]), ("U0", &*texts[1]), ("C", &*texts[2])];
                let mut system = instance(&compilation, &set);
                let mut rows = Trajectory::new();
                let summary = simulate(&mut system, &options, &mut rows, &|| false);
                let summary = summary.unwrap_or_else(|error| panic!("{experiment:?}: {error}"));
                let run = Run { rows, summary };
                assert_eq!(run.rows.len(), times.len());
                let actual = |k: usize| states(&run, k);
                let text = report(&times, &actual, &expected, 1.0);
                assert!(text.is_empty(), "{experiment:?}:\n{text}");
                opened += usize::from(expected.iter().any(|row| row[4] > 7e-3));
            }
        }
    }
    // The corners are worth something only if the valve moves in them.
    assert!(opened >= 6, "the valve opens at {opened} of 8 corners only");
}

/// State `k` of the hand-written drive from a run of the model.
fn states(run: &Run, k: usize) -> Vec<f64> {
    match NAMES[k] {
        "lambda" => run.values("i").iter().zip(run.values("x")).map(|(i, x)| i * inductance(x).0).collect(),
        name => run.values(name),
    }
}

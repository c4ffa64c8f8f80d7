//! The start: the initial system against closed forms, with relations that change while it is solved, and its failures.
#![allow(clippy::unwrap_used)]

use hyd_results::{Discard, Trajectory};

use super::systems::Hand;
use super::systems::hybrid::Tank;
use crate::{Cause, Options, SolveError, simulate};

fn start(inflow: f64, guess: f64) -> Vec<f64> {
    let mut run = Trajectory::new();
    simulate(&mut Hand::new(Tank::new(inflow, guess)), &Options::new(0.0, 1.0), &mut run, &|| false).unwrap();
    // A steady state stays where it is.
    let last = run.row(run.len() - 1);
    assert!(run.row(0).iter().zip(last).all(|(a, b)| (a - b).abs() < 1e-9));
    run.row(0).to_vec()
}

#[test]
fn steady_state_is_found_from_near_and_far() {
    // sqrt(x) = inflow.  From 100 the undamped method would step to negative levels.
    for guess in [0.3, 0.01, 100.0] {
        let row = start(0.6, guess);
        assert!((row[0] - 0.36).abs() < 1e-9, "{row:?}");
        assert!((row[1] - 0.6).abs() < 1e-9 && row[2].abs() < 1e-9);
    }
}

#[test]
fn a_relation_that_changes_at_the_start_is_solved_again() {
    // Without overflow the level would be 9; with it 2 sqrt(x) = 3.
    let row = start(3.0, 0.5);
    assert!((row[0] - 2.25).abs() < 1e-9, "{row:?}");
}

#[test]
fn a_start_without_solution_names_equation_and_variable() {
    let mut system = Hand::new(Tank::new(-1.0, 0.5));
    let error = simulate(&mut system, &Options::new(0.0, 1.0), &mut Discard, &|| false).unwrap_err();
    println!("{error}");
    let SolveError::Initial { cause, place, .. } = &error else { panic!("{error}") };
    assert!(matches!(cause, Cause::NoConvergence | Cause::NotFinite));
    assert_eq!(place.equation.as_ref().unwrap().text.as_ref(), "equation of x");
}

//! Initial plans: fixed starts, initial equations, free parameters, states left open.

use hyd_flat::{Section, Target};
use hyd_source::Code;

use super::execute::{Random, Run, solve};
use super::model::Model;
use super::plans::{check_jacobian, sorted};
use crate::{SortedSystem, sort};

/// Solves the initial plan from a random guess and checks continuous and initial equations.
fn check_initial<'a>(model: &Model, sorted: &'a SortedSystem, seed: u64) -> Run<'a> {
    let mut run = Run::new(sorted);
    run.initial = true;
    run.randomize(sorted, &sorted.initial, &mut Random(seed));
    assert!(solve(&mut run, &sorted.initial), "no solution");
    for section in [Section::Continuous, Section::Initial, Section::Binding] {
        for violation in run.violations(&model.flat, section) {
            assert!(violation.abs() < 1e-8, "violated by {violation}\n{sorted}");
        }
    }
    run
}

#[test]
fn an_explicit_system_with_fixed_states_needs_no_solver() {
    let model = Model::new(&["fixed x = 1.5", "fixed v = -1", "real f"], &["der(x) = v", "2*der(v) = f", "f = -x*x"]);
    let sorted = sorted(&model);
    assert!(sorted.initial.unknowns.is_empty(), "{sorted}");
    let run = check_initial(&model, &sorted, 1);
    assert_eq!(run.values[&Target::Der(model.var("v"))], -1.125);
}

#[test]
fn steady_state_by_initial_equations() {
    let model = Model::new(&["real x = 1", "real y = 1"], &["der(x) = 4 - x*y", "der(y) = x - y"])
        .with(Section::Initial, &["der(x) = 0", "der(y) = 0"]);
    let sorted = sorted(&model);
    let run = check_initial(&model, &sorted, 3);
    assert!((run.values[&Target::Var(model.var("x"))] - 2.0).abs() < 1e-8);
    check_jacobian(&sorted, true, 4);
}

#[test]
fn a_free_parameter_and_what_depends_on_it_are_solved_for() {
    let model = Model::new(
        &["free k = 1", "param area = 2*k", "fixed h = 4", "real q"],
        &["der(h) = 3 - q", "q = area*sqrt(h)"],
    )
    .with(Section::Initial, &["der(h) = 0"]);
    let sorted = sorted(&model);
    let run = check_initial(&model, &sorted, 2);
    assert!((run.values[&Target::Var(model.var("k"))] - 0.75).abs() < 1e-8, "{sorted}");
    let found = |name| {
        let target = Target::Var(model.var(name));
        let plan = &sorted.initial;
        plan.unknowns.iter().any(|u| u.target == target) || plan.assignments.iter().any(|a| a.target == target)
    };
    assert!(found("k") && found("area"));
    assert!(sorted.bindings.iter().all(|b| b.target != Target::Var(model.var("area"))));
    check_jacobian(&sorted, true, 9);
}

#[test]
fn open_states_take_their_starts_by_preference() {
    // One initial equation for two states: the one with a start value takes it.
    let model = Model::new(&["real x", "real y = 3"], &["der(x) = -x", "der(y) = x - y"])
        .with(Section::Initial, &["x + y = 5"]);
    let outcome = sort(model.flat.clone());
    let sorted = outcome.value.expect("sorted");
    assert_eq!(outcome.diagnostics.len(), 1);
    assert_eq!(outcome.diagnostics[0].code, Code::Chosen);
    assert!(outcome.diagnostics[0].message.contains("`y`") && !outcome.diagnostics[0].message.contains("`x`"));
    let run = check_initial(&model, &sorted, 2);
    assert_eq!(run.values[&Target::Var(model.var("x"))], 2.0);
}

#[test]
fn a_fixed_algebraic_variable_determines_a_state() {
    let model = Model::new(&["real x", "fixed y = 9"], &["der(x) = -x", "y = x*x*x + x - 1"]);
    let sorted = sorted(&model);
    let run = check_initial(&model, &sorted, 2);
    assert!((run.values[&Target::Var(model.var("x"))] - 2.0).abs() < 1e-8);
}

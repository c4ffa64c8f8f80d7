//! Index reduction: which states remain, and values against analytic solutions.
#![allow(clippy::disallowed_methods)]

use hyd_flat::{Section, StateSelect, Target};

use super::execute::{Random, Run, solve};
use super::model::Model;
use super::plans::sorted;
use crate::{Role, SortedSystem, build_system, print_system, reduce_index, sort};

fn states(sorted: &SortedSystem) -> Vec<String> {
    let system = &sorted.system;
    let own = system.roles.indices().filter(|&v| system.is_own(v) && system.roles[v] == Role::State);
    own.map(|v| system.flat.var_name(v)).collect()
}

fn candidates(sorted: &SortedSystem) -> Vec<String> {
    let system = &sorted.system;
    let own = system.roles.indices().filter(|&v| system.is_own(v) && system.roles[v] == Role::Candidate);
    own.map(|v| system.flat.var_name(v)).collect()
}

/// The initial system solved, with what the user wrote checked.
fn solved<'a>(model: &Model, sorted: &'a SortedSystem) -> Run<'a> {
    let mut run = Run::new(sorted);
    run.initial = true;
    run.randomize(sorted, &sorted.initial, &mut Random(7));
    for unknown in &sorted.initial.unknowns {
        if let Target::Var(v) = unknown.target
            && let Some(&start) = run.values.get(&Target::Start(v))
        {
            run.values.insert(unknown.target, start);
        }
    }
    assert!(solve(&mut run, &sorted.initial), "no solution\n{sorted}");
    for violation in run.violations(&model.flat, Section::Initial) {
        assert!(violation.abs() < 1e-8, "violated by {violation}\n{sorted}");
    }
    run
}

fn value(run: &Run<'_>, model: &Model, name: &str) -> f64 {
    let v = model.var(name);
    run.values[&Target::Var(v)]
}

fn pendulum(declarations: [&str; 5]) -> Model {
    let mut all = vec!["param L = 1", "param g = 9.81"];
    all.extend(declarations);
    let equations = ["der(x) = vx", "der(y) = vy", "der(vx) = -F*x/L", "der(vy) = -F*y/L - g", "x*x + y*y = L*L"];
    Model::new(&all, &equations)
}

#[test]
fn the_pendulum_starts_with_the_tension_of_the_textbook() {
    // At rest at angle a from the vertical the tension per mass is g cos(a); moving with speed v it is g cos(a) + v^2/L.
    let model = pendulum(["fixed x = 0.6", "real y = -0.8", "fixed vx = 0.8", "real vy", "real F"]);
    let sorted = sorted(&model);
    assert!(states(&sorted).is_empty());
    assert_eq!(candidates(&sorted), ["x", "y", "vx", "vy"]);
    let run = solved(&model, &sorted);
    let expected = [("y", -0.8), ("vy", 0.6), ("F", 9.81 * 0.8 + 1.0)];
    for (name, expected) in expected {
        let found = value(&run, &model, name);
        assert!((found - expected).abs() < 1e-9, "{name}: {found} instead of {expected}");
    }
}

/// Gives variables of a model their `stateSelect`.
fn select(model: &mut Model, wishes: &[(&str, StateSelect)]) {
    for block in model.flat.variables.raw.iter_mut() {
        let name = block.name.element(0);
        if let Some(&(_, select)) = wishes.iter().find(|wish| wish.0 == name) {
            block.state_select = hyd_flat::PerElement::All(select);
        }
    }
}

#[test]
fn coordinates_that_must_be_states_leave_no_choice() {
    let always = [("y", StateSelect::Always), ("vy", StateSelect::Always)];
    let mut model = pendulum(["real x = 0.6", "real y = -0.8", "real vx", "real vy", "real F"]);
    select(&mut model, &always);
    let sorted = sorted(&model);
    assert_eq!((states(&sorted), candidates(&sorted).len()), (vec!["y".to_string(), "vy".to_string()], 0));
}

#[test]
fn wishes_weigh_but_do_not_decide_where_pivots_vary() {
    let mut model = pendulum(["real x = 0.6", "real y = -0.8", "real vx", "real vy", "real F"]);
    select(&mut model, &[("y", StateSelect::Prefer), ("vy", StateSelect::Prefer), ("x", StateSelect::Avoid)]);
    let sorted = sorted(&model);
    assert_eq!(candidates(&sorted), ["x", "y", "vx", "vy"]);
    let weights = |names: [&str; 2]| -> Vec<f64> {
        let wanted = names.map(|name| model.var(name));
        let set = sorted.selections.iter().find(|set| set.candidates.iter().any(|c| c.variable == wanted[0]));
        let set = set.expect("a set of both");
        let of = |v| set.candidates.iter().find(|c| c.variable == v).expect("in one set").weight;
        wanted.map(of).to_vec()
    };
    assert_eq!((weights(["x", "y"]), weights(["vx", "vy"])), (vec![5.0, 0.2], vec![1.0, 0.2]));
}

/// A crank whose rod end slides: the position of the slider follows by a constant pivot, of the angles one is free.
#[test]
fn constant_pivots_are_taken_for_the_whole_run() {
    let model = Model::new(
        &["fixed a = 0.3", "real b = 0.1", "real s = 3", "fixed w = 1", "real u", "real f", "real g"],
        &[
            "der(a) = w",
            "der(b) = u",
            "der(w) = f*cos(a) - g*sin(a)",
            "der(u) = 3*f*cos(b) - 3*g*sin(b)",
            "sin(a) = 3*sin(b)",
            "s = cos(a) + 3*cos(b)",
            "g = s - 3 + time",
        ],
    );
    let sorted = sorted(&model);
    assert_eq!(candidates(&sorted), ["a", "b", "w", "u"]);
    assert!(sorted.selections.iter().all(|set| set.open.len() == 1 && set.states() == 1), "{sorted}");
}

#[test]
fn a_driven_state_is_differentiated_as_often_as_its_chain_is_long() {
    // x = sin(2 t), v = x', a = v', j = a': index 4 in the force at the end; values at t = 0.3 by differentiation on paper.
    let model = Model::new(
        &["real x", "real v", "real a", "real f"],
        &["x = sin(2*time)", "der(x) = v", "der(v) = a", "der(a) = f"],
    );
    let sorted = sorted(&model);
    assert!(states(&sorted).is_empty(), "{sorted}");
    let run = solved(&model, &sorted);
    let t: f64 = 0.6;
    let expected = [("x", t.sin()), ("v", 2.0 * t.cos()), ("a", -4.0 * t.sin()), ("f", -8.0 * t.cos())];
    for (name, expected) in expected {
        assert!((value(&run, &model, name) - expected).abs() < 1e-9, "{name}");
    }
}

#[test]
fn two_capacitors_in_parallel_share_one_state() {
    // v1 = 3 v2 and i1 + i2 = i: der(v1) = i1, 2 der(v2) = i2 give der(v1) = i/(1 + 2/3).
    let model = Model::new(
        &["fixed v1 = 3", "real v2", "real i1", "real i2"],
        &["der(v1) = i1", "2*der(v2) = i2", "v1 = 3*v2", "i1 + i2 = cos(time)"],
    );
    let sorted = sorted(&model);
    assert_eq!(states(&sorted), ["v1"]);
    let run = solved(&model, &sorted);
    assert!((value(&run, &model, "i1") - 0.3_f64.cos() / (1.0 + 2.0 / 3.0)).abs() < 1e-12);
    assert!((value(&run, &model, "v2") - 1.0).abs() < 1e-12);
}

#[test]
fn dependent_combinations_are_recognised_by_number() {
    // By structure any two of three could follow from the two constraints; x2 and x3 alone cannot (their columns are
    // dependent).
    let model = Model::new(
        &["real x1 = 1", "real x2 = 1", "fixed x3 = 1", "real f", "real g"],
        &["der(x1) = f", "der(x2) = f + g", "der(x3) = g - x3", "x1 + x2 + x3 = 3", "x1 + 2*x2 + 2*x3 = 5"],
    );
    assert_eq!(states(&sorted(&model)), ["x3"]);
    let text = print_system(&reduce_index(build_system(model.flat)).value.expect("regular"));
    assert!(text.contains("no longer states (2)\n  x1\n  x2\n"), "{text}");
    assert!(text.contains("dummy derivatives (2)\n  der(x1)\n  der(x2)\n"), "{text}");
    assert!(text.contains("differentiated equations (2)\n"), "{text}");
}

#[test]
fn loops_share_the_differentiated_template() {
    let count = 50;
    let names: Vec<String> =
        (0..count).flat_map(|k| [format!("real a{k} = 1"), format!("real b{k}"), format!("real f{k}")]).collect();
    let equations: Vec<String> = (0..count)
        .flat_map(|k| {
            [format!("der(a{k}) = f{k}"), format!("der(b{k}) = -f{k} + time"), format!("a{k} = b{k}*b{k}*b{k}")]
        })
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let equations: Vec<&str> = equations.iter().map(String::as_str).collect();
    let model = Model::new(&names, &equations);
    let before = build_system(model.flat.clone()).flat.templates.len();
    let after = reduce_index(build_system(model.flat.clone())).value.expect("regular");
    assert!(after.flat.templates.len() <= before + 6, "{before} to {}", after.flat.templates.len());
    assert_eq!(sort(model.flat).value.map(|sorted| states(&sorted).len()), Some(count));
}

#[test]
fn surplus_fixed_starts_are_tolerated_if_they_fit() {
    let fits = pendulum(["fixed x = 0.6", "fixed y = -0.8", "fixed vx = 0.8", "fixed vy = 0.6", "real F"]);
    let outcome = sort(fits.flat.clone());
    assert!(outcome.value.is_some(), "{:?}", outcome.diagnostics);
    let notes: Vec<&str> = outcome.diagnostics.iter().map(|d| d.message.as_str()).collect();
    assert!(notes.iter().any(|note| note.contains("only checked") && note.contains("`vy`")), "{notes:?}");
    // With a length that may be set, whether starts fit is known in the run only.
    let later = pendulum(["fixed x = 0.6", "fixed y = -0.9", "fixed vx = 0.8", "real vy", "real F"]);
    let sorted = sort(later.flat).value.expect("may fit");
    assert_eq!(sorted.redundant.len(), 1);
    let equations = ["der(x) = vx", "der(y) = vy", "der(vx) = -F*x", "der(vy) = -F*y - 9.81", "x*x + y*y = 1"];
    let wrong = Model::new(&["fixed x = 0.6", "fixed y = -0.9", "fixed vx = 0.8", "real vy", "real F"], &equations);
    let outcome = sort(wrong.flat);
    assert!(outcome.value.is_none());
    let message = &outcome.diagnostics.last().expect("a message").message;
    assert!(message.contains("`x`") && message.contains("`y`"), "{message}");
}

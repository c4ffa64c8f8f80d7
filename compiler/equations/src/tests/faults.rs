//! Structural faults are refused with the names of the part at fault.

use hyd_flat::Section;
use hyd_source::{Code, Diagnostic};

use super::model::Model;
use crate::sort;

fn fault(model: Model) -> Diagnostic {
    let outcome = sort(model.flat);
    assert!(outcome.value.is_none(), "accepted");
    outcome.diagnostics.into_iter().last().expect("a message")
}

/// Everything the user reads.
fn text(diagnostic: &Diagnostic) -> String {
    let labels = diagnostic.labels.iter().map(|label| label.message.as_str());
    let notes = diagnostic.notes.iter().map(String::as_str);
    [diagnostic.message.as_str()].into_iter().chain(notes).chain(labels).collect::<Vec<_>>().join("\n")
}

#[test]
fn an_unknown_fixed_twice_is_named_and_so_are_those_left_open() {
    let model = Model::new(
        &["real fixedTwice", "real left", "real right", "real other"],
        &["fixedTwice = sin(time)", "2*fixedTwice = cos(time)", "left + right = fixedTwice", "der(other) = left"],
    );
    let fault = fault(model);
    assert_eq!(fault.code, Code::Singular);
    let text = text(&fault);
    assert!(text.contains("2 equations for only 1 unknown, `fixedTwice`"), "{text}");
    assert!(text.contains("`left`") && text.contains("`right`"), "{text}");
    assert!(text.contains("2*fixedTwice = cos(time)"), "{text}");
    assert!(!fault.labels.is_empty());
}

#[test]
fn a_missing_equation_is_counted_and_its_unknowns_named() {
    let model = Model::new(&["real a", "real b", "real c", "real d"], &["a = sin(time)", "b + c = 2*a*a", "d = a"]);
    let fault = fault(model);
    assert_eq!(fault.code, Code::Unbalanced);
    assert!(fault.message.contains("3 equations for 4 unknowns"), "{}", fault.message);
    let text = text(&fault);
    assert!(text.contains("`b`, `c`") && !text.contains("`a`"), "{text}");
}

#[test]
fn redundant_aliases_and_second_values_are_singular() {
    let loops = Model::new(&["real a", "real b", "real c"], &["a = b", "b = c", "c = a"]);
    let found = fault(loops);
    assert_eq!(found.code, Code::Singular);
    assert!(text(&found).contains("`c = a`"), "{}", text(&found));
    let twice = fault(Model::new(&["real a", "real b"], &["a = 1", "a = 2"]));
    assert!(text(&twice).contains("a = 2") && text(&twice).contains("`b`"), "{}", text(&twice));
}

#[test]
fn cycles_of_parameters_are_named() {
    let model = Model::new(&["param a = 1", "param b = c + a", "param c = 2*d", "param d = b", "param e = b"], &[]);
    let fault = fault(model);
    assert_eq!(fault.code, Code::CircularParameters);
    assert!(fault.message.contains("`b`, `c`, `d`") && !fault.message.contains("`e`"), "{}", fault.message);
}

#[test]
fn too_many_initial_conditions_are_named() {
    let model = Model::new(&["fixed x = 1", "fixed y = 2"], &["der(x) = -x", "der(y) = x"])
        .with(Section::Initial, &["x = 2*y"]);
    let fault = fault(model);
    assert_eq!(fault.code, Code::InitialUnbalanced);
    let text = text(&fault);
    assert!(text.contains("x = 2*y") && text.contains("`x`"), "{text}");
}

#[test]
fn free_parameters_without_a_condition_take_their_start() {
    let model = Model::new(&["free p = 4", "fixed x = 1"], &["der(x) = p - x"]);
    let outcome = sort(model.flat);
    assert!(outcome.value.is_some(), "{:?}", outcome.diagnostics);
    assert_eq!(outcome.diagnostics[0].code, Code::Chosen);
}

#[test]
fn equal_variables_fixed_at_different_values_are_named() {
    let equations = ["b = -a", "der(a) = b"];
    let found = fault(Model::new(&["fixed a = 1", "fixed b = 2"], &equations));
    assert_eq!(found.code, Code::InitialUnbalanced);
    assert!(found.message.contains("`a` and `b`"), "{}", found.message);
    assert!(sort(Model::new(&["fixed a = 1", "fixed b = -1"], &equations).flat).value.is_some());
    // A start that is not fixed is only a guess.
    assert!(sort(Model::new(&["fixed a = 1", "real b = 5"], &equations).flat).value.is_some());
}

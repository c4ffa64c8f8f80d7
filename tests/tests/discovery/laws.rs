//! Laws that no library holds, found in plain models and written as text.

use serde_json::Value;

use crate::plain::{Bench, Rates, SWING, answer};

/// Coefficients within four standard errors of the truth.
fn has(report: &Value, wanted: &[(&str, f64)]) {
    assert_eq!(report["status"], "law", "{report:#}");
    let mut terms: Vec<&Value> = report["law"]["terms"].as_array().expect("a list").iter().collect();
    terms.sort_by_key(|own| own["shape"].as_str().map(String::from));
    let shapes: Vec<&str> = terms.iter().filter_map(|own| own["shape"].as_str()).collect();
    assert_eq!(shapes, wanted.iter().map(|own| own.0).collect::<Vec<_>>(), "{:#}", report["law"]);
    for (own, (shape, truth)) in terms.iter().zip(wanted) {
        let number = |key: &str| own[key].as_f64().expect("a number");
        let (value, error) = (number("coefficient"), number("stderr"));
        assert!((value - truth).abs() < 4.0 * error && error < 0.1 * truth.abs(), "{shape}: {value} +- {error}");
    }
    let gap = |key: &str| report["gap"]["heldout"][key].as_f64().expect("a number");
    assert!(gap("before") > 1.2 && gap("after") < 1.1, "{:#}", report["gap"]);
}

/// Friction that grows towards one side belongs to no library.
#[test]
fn a_product_of_two_variables() {
    let rates: Rates = |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1] - 0.5 * x[0] * x[1]) / 2.0];
    let report = answer(&Bench { name: "product", rates, ..SWING });
    has(&report, &[("x*v", -0.5)]);
    let law = &report["law"];
    assert_eq!((&law["class"], &law["text"], &law["line"]), (&"Proposed".into(), &"Proposed.hyd".into(), &10.into()));
    assert!(law["rivals"].as_array().is_some_and(|rivals| !rivals.is_empty()), "{law:#}");
}

/// Neither of two terms explains the record by itself; names that the law would take are the model's.
#[test]
fn two_terms_in_a_model_that_has_the_names() {
    let model = SWING.model.replace(
        "  Real x(",
        "  parameter Real c_1 = 3;\n  parameter Real Proposed = 1;\n  parameter Real further = 1;\n  Real x(",
    );
    let rates: Rates = |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1] - 0.5 * x[0] * x[1] - 8.0 * x[0].powi(3)) / 2.0];
    let without = &["Hyd.Effects.Mechanics"];
    let report =
        answer(&Bench { name: "two-terms", model: Box::leak(model.into_boxed_str()), rates, without, ..SWING });
    has(&report, &[("x*v", -0.5), ("x*x*x", -8.0)]);
    assert!(report["law"]["class"] != "Proposed", "{:#}", report["law"]);
}

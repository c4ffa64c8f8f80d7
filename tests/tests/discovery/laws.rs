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
    let without = &["Hyd.Effects"];
    let report =
        answer(&Bench { name: "two-terms", model: Box::leak(model.into_boxed_str()), rates, without, ..SWING });
    has(&report, &[("x*v", -0.5), ("x*x*x", -8.0)]);
    assert!(report["law"]["class"] != "Proposed", "{:#}", report["law"]);
}

/// A force that follows nothing in the model is not a law; its course over time is told.
#[test]
fn what_nothing_explains_is_told_over_time() {
    let force = |t: f64| 2.0 * (5.0 * t).sin() * (-0.3 * t).exp();
    let rates: Rates = |x, _| {
        let t = x[2];
        let force = 2.0 * (5.0 * t).sin() * (-0.3 * t).exp();
        vec![x[1], (-80.0 * x[0] - 0.6 * x[1] + force) / 2.0, 1.0]
    };
    let report = answer(&Bench { name: "driven", rates, without: &["Hyd.Effects"], ..SWING });
    assert_eq!((&report["status"], &report["law"]), (&"unknown".into(), &Value::Null), "{report:#}");
    let missing = &report["missing"];
    assert_eq!(missing["equation"], "m*der(v) = -k*x - d*v", "{missing:#}");
    let shots = missing["shots"].as_array().expect("a list");
    assert!(shots.len() >= 3);
    for shot in shots {
        let list = |key: &str| -> Vec<f64> {
            shot[key].as_array().expect("a list").iter().filter_map(Value::as_f64).collect()
        };
        let (times, values, errors) = (list("time"), list("value"), list("stderr"));
        let off: Vec<f64> = times.iter().zip(&values).map(|(&t, value)| value - force(t)).collect();
        // Nuisances of 2 % of a spring's 40 N may take a part of it, which the errors say.
        let beyond = |limit: f64| off.iter().zip(&errors).filter(|(off, error)| off.abs() > limit * **error).count();
        assert!(beyond(3.0) <= times.len() / 10, "{} of {}: {off:?} {errors:?}", beyond(3.0), times.len());
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let truth: Vec<f64> = times.iter().map(|&t| force(t)).collect();
        let alike = product(&truth, &values) / (product(&truth, &truth) * product(&values, &values)).sqrt();
        assert!(alike > 0.9, "{alike}: {times:?} {values:?}");
    }
}

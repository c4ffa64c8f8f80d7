//! Laws that no library holds, found in plain models and written as text.

use std::fs;

use serde_json::Value;

use crate::plain::{Bench, Rates, SWING, answer, answer_in};
use crate::{hyd, json};

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

/// The only term of a law with memory, within four standard errors of the truth, and the first number of its form.
fn remembers(report: &Value, (coefficient, number): (f64, (&str, f64)), equations: &[&str]) {
    assert_eq!(report["status"], "law", "{report:#}");
    let law = &report["law"];
    let near = |own: &Value, key: &str, truth: f64| {
        let (value, error) = (own[key].as_f64().expect("a number"), own["stderr"].as_f64().expect("a number"));
        assert!((value - truth).abs() < 4.0 * error && error < 0.1 * truth.abs(), "{value} +- {error}: {law:#}");
    };
    near(&law["terms"][0], "coefficient", coefficient);
    let own = &law["memory"]["numbers"][0];
    assert_eq!(own["name"], number.0, "{law:#}");
    near(own, "value", number.1);
    assert_eq!(law["memory"]["equations"], serde_json::json!(equations), "{law:#}");
    // What the records leave open beside the law is little, and told.
    let shots = report["missing"]["shots"].as_array().expect("a list");
    assert!(shots.len() >= 3, "{:#}", report["missing"]);
    for shot in shots {
        let list = |key: &str| -> Vec<f64> {
            shot[key].as_array().expect("a list").iter().filter_map(Value::as_f64).collect()
        };
        let (free, law, errors) = (list("value"), list("law"), list("stderr"));
        let beyond =
            free.iter().zip(&law).zip(&errors).filter(|((free, law), error)| (**free - **law).abs() > 4.0 * **error);
        assert!(beyond.count() <= law.len() / 10 && law.len() == free.len(), "{free:?} {law:?} {errors:?}");
        let largest = law.iter().fold(0.0_f64, |most, own| most.max(own.abs()));
        assert!(errors.iter().all(|error| *error < 0.3 * largest), "{errors:?} of {largest}");
    }
    let gap = |key: &str| report["gap"]["heldout"][key].as_f64().expect("a number");
    assert!(gap("before") > 1.2 && gap("after") < 1.1, "{:#}", report["gap"]);
}

/// A mass of 0.2 kg that hangs at the other one by a spring.
#[test]
fn what_swings_along_has_states_of_its_own() {
    let rates: Rates = |x, _| {
        // Distance and speed of the second mass.
        let [w, d, c] = [15.0, 0.1, 45.0];
        let acceleration = -w * w * x[2] - 2.0 * d * w * x[3];
        vec![x[1], (-80.0 * x[0] - 0.6 * x[1] + c * x[2]) / 2.0, x[3] - x[1], acceleration]
    };
    let report = answer(&Bench { name: "absorber", rates, without: &["Hyd.Effects"], ..SWING });
    remembers(&report, (-45.0, ("w_1", 15.0)), &["der(z_1) = r_1", "der(r_1) = w_1*w_1*(x - z_1) - 2*D_1*w_1*r_1"]);
}

/// A damper in series with a spring.
#[test]
fn what_relaxes_has_a_state_of_its_own() {
    let rates: Rates = |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1] - 3.0 * x[2]) / 2.0, (x[1] - x[2]) / 0.15];
    let bench = Bench { name: "relaxation", rates, without: &["Hyd.Effects"], ..SWING };
    let (report, folder) = answer_in(&bench);
    remembers(&report, (-3.0, ("T_1", 0.15)), &["T_1*der(z_1) = v - z_1"]);
    // As an effect of a library it is named like any other.
    let libraries = folder.join("libraries");
    fs::create_dir_all(&libraries).expect("made");
    fs::copy(folder.join("report/Proposed.hyd"), libraries.join("Proposed.hyd")).expect("written");
    let again = ["discover", "study.toml", "--bench", "set.json", "--library", "libraries", "--report", "again"];
    let found = hyd(&folder, &again);
    assert_eq!(found.code, Some(0), "{}{}", found.stdout, found.stderr);
    let report = json(&fs::read_to_string(folder.join("again/report.json")).expect("written"));
    let id = &report["effects"][0]["id"];
    assert_eq!((&report["status"], id), (&"named".into(), &"proposed_law".into()), "{report:#}");
    let _ = fs::remove_dir_all(&folder);
}

/// Friction that builds up over a way of 20 mm.
#[test]
fn hysteresis_has_a_state_of_its_own() {
    let rates: Rates =
        |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1] - 2.0 * x[2]) / 2.0, (x[1] - x[1].abs() * x[2]) / 0.02];
    let report = answer(&Bench { name: "hysteresis", rates, without: &["Hyd.Effects"], ..SWING });
    remembers(&report, (-2.0, ("L_1", 0.02)), &["L_1*der(z_1) = v - noEvent(abs(v))*z_1"]);
}

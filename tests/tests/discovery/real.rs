//! Records of real machines as they stand in `tests/real`.
//!
//! The folders of effects are written in small letters, the packages in them with a capital, as people do.

use std::fs;

use hyd_tests::models::root;

use super::{folder, hyd, json};

/// What is answered to a bench of `tests/real`, and the effects that are named.
fn answer(bench: &str) -> (serde_json::Value, Vec<String>, String) {
    let place = root().join("tests/real").join(bench);
    let own = |name: &str| place.join(name).display().to_string();
    let folder = folder(bench);
    let (study, set) = (own("bench.toml"), own("set.json"));
    let library = place.display().to_string();
    let found = hyd(&folder, &["discover", &study, "--bench", &set, "--library", &library, "--report", "report"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
    let effects = report["effects"].as_array().expect("a list");
    let named = effects.iter().filter_map(|own| own["id"].as_str()).map(str::to_string).collect();
    let _ = fs::remove_dir_all(&folder);
    (report, named, found.stdout + &found.stderr)
}

/// Names what the literature says is missing (`tests/real/literature.json`, written before the first run), and what is named holds on shots that
/// were not fitted.
fn agrees_with_the_literature(bench: &str) {
    let (report, mut named, words) = answer(bench);
    assert_eq!(report["status"], "named", "{words}");
    // A range that the record itself shows is no candidate of the search.
    if report["disturbed"]["clipped"].as_array().is_some_and(|clipped| !clipped.is_empty()) {
        named.push("sensor_saturation".into());
    }
    let text = fs::read_to_string(root().join("tests/real/literature.json")).expect("there");
    let literature = json(&text);
    for part in literature[bench]["missing"].as_array().expect("a list") {
        let any = part["any_of"].as_array().expect("a list");
        assert!(any.iter().any(|id| named.iter().any(|own| id == own)), "{any:?} {named:?}");
    }
    let gap = |when: &str| report["gap"]["heldout"][when].as_f64().expect("a number");
    assert!(gap("after") < 0.6 * gap("before"), "{words}");
}

#[test]
fn balls_of_a_real_camera_have_drag() {
    agrees_with_the_literature("balls");
}

#[test]
fn real_tanks_run_over() {
    agrees_with_the_literature("tanks");
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn a_real_positioning_system_rubs() {
    agrees_with_the_literature("positioning");
}

/// Resistance and dielectric absorption of the bank explain its sagging voltage equally well, until it is found that the winding warms up and
/// that the coil is another one with a tube in it.  Numbers are those of a fit of all shots with these three effects by
/// `scipy.optimize.least_squares` in equations written independently: 0.0368 Ohm, 8.1e-4 per joule, 0.104.
#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn a_tie_is_decided_by_what_else_is_missing() {
    let (report, mut named, words) = answer("kicker");
    assert_eq!(report["status"], "named", "{words}");
    named.sort();
    assert_eq!(named, ["bank_resistance", "tube_inductance", "winding_heating"], "{words}");
    // Why the other one was not named is said where the two were alike.
    let candidates = report["candidates"].as_array().expect("a list");
    let alike = candidates.iter().find(|own| own["id"] == "dielectric_absorption").expect("a candidate");
    let verdict = alike["verdict"].as_str().expect("a string");
    assert!(
        verdict.starts_with("with the other effects in the model, bank_resistance explains more, by "),
        "{verdict}"
    );
    let size = |id: &str| {
        let effects = report["effects"].as_array().expect("a list");
        let own = effects.iter().find(|own| own["id"] == id).expect("named");
        let parameters = own["parameters"].as_object().expect("an object");
        let (_, number) = parameters.iter().next().expect("a size");
        number["value"].as_f64().expect("a number")
    };
    for (id, value) in [("bank_resistance", 0.0368), ("winding_heating", 8.1e-4), ("tube_inductance", 0.104)] {
        assert!((size(id) / value - 1.0).abs() < 0.1, "{id}: {}", size(id));
    }
}

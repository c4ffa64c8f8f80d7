//! Records of real machines as they stand in `tests/real`: balls dropped from a bridge and filmed, a bank of capacitors fired into a coil.
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

#[test]
fn balls_of_a_real_camera_have_drag() {
    let (report, named, words) = answer("balls");
    assert_eq!(report["status"], "named", "{words}");
    assert!(named.iter().any(|own| own == "linear_drag" || own == "quadratic_drag"), "{named:?}");
}

/// Resistance and dielectric absorption of the bank explain its sagging voltage equally well, until it is found that the winding warms up and
/// that the coil is another one with a tube in it.  Numbers are those of a fit of all shots with these three effects by
/// `scipy.optimize.least_squares` in equations written down anew: 0.0368 Ohm, 8.1e-4 per joule, 0.104.
#[test]
fn a_tie_is_decided_by_what_else_is_missing() {
    let (report, mut named, words) = answer("kicker");
    assert_eq!(report["status"], "named", "{words}");
    named.sort();
    assert_eq!(named, ["bank_resistance", "tube_inductance", "winding_heating"], "{words}");
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

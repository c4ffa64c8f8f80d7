//! The recorded sets of another simulator with the whole library and nothing but defaults: each must get the answer that
//! `tests/data/bench/answers.json` holds, with values of the drawn size, and the shots that were held out must be met.
//!
//! A quarter of the samples is kept: which effects compete is what is guarded here, and a name is the harder to give the fewer samples
//! there are.

use std::fs;

use serde_json::Value;

use super::{folder, hyd, json, study, thinned};

/// One sample of so many is kept.
const EVERY: usize = 4;

/// Largest ratio of what is left on unseen shots to noise.
const MET: f64 = 1.1;

/// Standard errors by which an estimate may differ from what was drawn, and the largest standard error, by that.
const ERRORS: (f64, f64) = (4.0, 0.1);

/// What is found in a set: its status, the effects, and some of their numbers: effect, name, value that was drawn.
/// Returns the report.
fn answers(set: &str, status: &str, effects: &[&str], sizes: &[(&str, &str, f64)]) -> Value {
    let folder = folder(set);
    let bench = thinned(&folder, &format!("bench/{set}"), EVERY);
    let found = hyd(&folder, &["discover", &study(), "--bench", &bench, "--report", "."]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report.json")).expect("written"));
    let named = report["effects"].as_array().expect("a list");
    let ids: Vec<&str> = named.iter().filter_map(|effect| effect["id"].as_str()).collect();
    assert_eq!((report["status"].as_str(), &ids[..]), (Some(status), effects), "{set}: {}", found.stdout);
    for part in ["train", "heldout"] {
        let after = report["gap"][part]["after"].as_f64().expect("a number");
        assert!(after <= MET, "{set}, {part}: {after}");
    }
    check_texts(&fs::read_to_string(folder.join("report.html")).expect("written"), &report);
    for &(id, name, drawn) in sizes {
        let effect = named.iter().find(|effect| effect["id"] == id).expect("named above");
        let number = |key: &str| effect["parameters"][name][key].as_f64().expect("a number");
        let (value, error) = (number("value"), number("stderr"));
        let words = format!("{set}, {id}.{name}: {value:e} +- {error:e} instead of {drawn:e}");
        assert!((value - drawn).abs() <= ERRORS.0 * error && error <= ERRORS.1 * drawn, "{words}");
    }
    report
}

/// Each line that the report points at is in the text that its page shows under that name, and is not empty.
pub(super) fn check_texts(page: &str, report: &Value) {
    let begin = page.find("\"texts\":").expect("texts") + "\"texts\":".len();
    let mut values = serde_json::Deserializer::from_str(&page[begin..]).into_iter::<Value>();
    let texts = values.next().expect("a value").expect("a list");
    let texts: Vec<(&str, &str)> = texts
        .as_array()
        .expect("a list")
        .iter()
        .map(|own| (own["name"].as_str().expect("a name"), own["text"].as_str().expect("a text")))
        .collect();
    for (k, (name, _)) in texts.iter().enumerate() {
        assert!(texts[..k].iter().all(|(other, _)| other != name), "{name} twice");
    }
    let lists = ["effects", "location", "proposed"].into_iter().filter_map(|key| report[key].as_array()).flatten();
    let places = lists.filter_map(|own| Some((own["file"].as_str()?, own["line"].as_u64()?)));
    let places: Vec<_> = places.collect();
    assert!(!places.is_empty() || report["effects"].as_array().is_some_and(Vec::is_empty), "no effect has a place");
    for (file, line) in places {
        let (_, text) = texts.iter().find(|(name, _)| *name == file).unwrap_or_else(|| panic!("{file} is shown"));
        let shown = text.lines().nth(line as usize - 1).unwrap_or_else(|| panic!("{file} has {line} lines"));
        assert!(!shown.trim().is_empty(), "{file}:{line}");
    }
}

#[test]
fn nothing_is_missing() {
    answers("B01", "adequate", &[], &[]);
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn waves_in_the_supply_line() {
    answers("B02", "named", &["supply_line"], &[("supply_line", "l", 1.2), ("supply_line", "V_g", 0.3e-3)]);
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn dry_friction() {
    answers("B04", "named", &["piston_friction"], &[("piston_friction", "F_c", 70.0)]);
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn eddy_currents() {
    answers("B05", "named", &["eddy_currents"], &[("eddy_currents", "g_e", 1.0 / 18.0)]);
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn a_late_trigger() {
    let report = answers("B06", "sensor", &["trigger_delay"], &[("trigger_delay", "t_d", 0.35e-3)]);
    // A delay of every shot cannot be told from the mean of what the trigger scatters by, 10 us a shot.
    let shots = report["shots"]["train"].as_array().expect("a list").len() as f64;
    let error = report["effects"][0]["parameters"]["t_d"]["stderr"].as_f64().expect("a number");
    assert!(error > 0.98e-5 / shots.sqrt() && error < 1.1e-5 / shots.sqrt(), "{error:e} with {shots} shots");
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn air_in_the_oil() {
    answers("B07", "named", &["entrained_air"], &[("entrained_air", "alpha", 0.08)]);
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn the_inductance_of_the_gap() {
    answers("B08", "named", &["variable_inductance"], &[]);
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn waves_and_dry_friction() {
    let sizes = [("supply_line", "l", 1.8), ("piston_friction", "F_c", 55.0)];
    answers("B09", "named", &["supply_line", "piston_friction"], &sizes);
}

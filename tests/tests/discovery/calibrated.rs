//! The threshold of names from searches of sets on which nothing is missing.

use std::fs;

use crate::{OWN_LIBRARY, folder, hyd, json, study_with, thinned};

/// By chance the cost drops by less than a name needs anyway, so that the leak is still named; a threshold that is kept beside the
/// study is asked for by later searches of the same set, and a leak that does not reach it has no name.
#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn a_threshold_is_kept_with_the_study() {
    let folder = folder("calibrated");
    fs::create_dir_all(folder.join("libraries/Workshop")).expect("made");
    fs::write(folder.join("libraries/Workshop/package.hyd"), OWN_LIBRARY).expect("written");
    study_with(&folder, "without = [\"Hyd.Effects\"]", &[]);
    let set = thinned(&folder, "bench/B03", 4);
    let arguments =
        ["discover", "study.toml", "--bench", &set, "--library", "libraries", "--report", "report", "--json"];
    let found = hyd(&folder, &[&arguments[..], &["--calibrate", "2"]].concat());
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&found.stdout);
    assert_eq!((&report["status"], &report["needed"]), (&"named".into(), &25.0.into()), "{report:#}");
    let kept = folder.join("study.calibration.json");
    let mut calibration = json(&fs::read_to_string(&kept).expect("kept"));
    let drops: Vec<f64> =
        calibration["cost_drops"].as_array().expect("a list").iter().filter_map(|own| own.as_f64()).collect();
    assert!(drops.len() == 2 && drops.iter().all(|drop| (0.0..25.0).contains(drop)), "{drops:?}");
    calibration["cost_drops"] = [1e9, 1e9].into();
    fs::write(&kept, calibration.to_string()).expect("written");
    let found = hyd(&folder, &arguments);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&found.stdout);
    assert_eq!((&report["status"], &report["needed"]), (&"unknown".into(), &1e9.into()), "{report:#}");
    let _ = fs::remove_dir_all(&folder);
}

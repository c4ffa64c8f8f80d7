//! The drive as a unit of which nobody sees the equations, on a recorded set of another simulator: it is fitted as its text is.
//!
//! The set is one of `recorded`, with a quarter of its samples.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hyd_tests::models::root;
use serde_json::Value;

use super::{folder, json, study, thinned};

/// One sample of so many is kept.
const EVERY: usize = 4;

/// The library that the command puts into units.
fn library() -> PathBuf {
    let name = if cfg!(target_vendor = "apple") { "libhyd_unit.dylib" } else { "libhyd_unit.so" };
    Path::new(env!("CARGO_BIN_EXE_hyd-under-test")).with_file_name("deps").join(name)
}

fn hyd(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
    command
        .args(arguments)
        .current_dir(folder)
        .env("HYD_UNIT", library())
        .env_remove("HYD_LIBRARY")
        .env_remove("MODELICAPATH");
    let output = command.output().expect("runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The study of the drive with another file in place of its text, which has one model.
fn study_of(file: &str, class: &str) -> String {
    let text = fs::read_to_string(study()).expect("readable");
    let (before, rest) = text.split_once("[models]").expect("models");
    let (_, after) = rest.split_once("\n[").expect("more tables");
    format!("{}[models]\nnominal = \"{class}\"\n\n[{after}", before.replace("drive.hyd", file))
}

/// A folder with the unit of the drive and its study.
fn drive(name: &str) -> PathBuf {
    let folder = folder(name);
    let model = root().join("models/single_acting_drive/drive.hyd").display().to_string();
    hyd(&folder, &["build", &model, "--fmu", "3.0", "-o", "drive.fmu"]);
    fs::write(folder.join("study.toml"), study_of("drive.fmu", "SingleActingDrive.Drive")).expect("written");
    folder
}

/// Fits a unit and its text to the same shots: as good, with the same numbers.
#[test]
fn the_unit_of_the_drive_is_fitted_as_its_text() {
    let folder = drive("unit-fitted");
    let bench = thinned(&folder, "bench/B01", EVERY);
    let [unit, text] =
        ["study.toml", &study()].map(|study| json(&hyd(&folder, &["fit", study, "--bench", &bench, "--json"])));
    let cost = |own: &Value| own["cost"].as_f64().expect("a number");
    assert!((cost(&unit) / cost(&text) - 1.0).abs() < 1e-4, "{} and {}", cost(&unit), cost(&text));
    let unknowns = |own: &Value| own["unknowns"].as_array().expect("a list").clone();
    for (own, wanted) in unknowns(&unit).iter().zip(unknowns(&text)) {
        assert_eq!(own["name"], wanted["name"]);
        let number = |own: &Value, key: &str| own[key].as_f64().expect("a number");
        let (away, error) = ((number(own, "sd") - number(&wanted, "sd")).abs(), number(&wanted, "sd_error"));
        assert!(away < 0.2 * error, "{}: {away} of {error}", own["name"]);
        let ratio = number(own, "sd_error") / error;
        assert!((0.98..1.02).contains(&ratio), "{}: {ratio}", own["name"]);
    }
}

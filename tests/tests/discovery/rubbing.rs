//! A machine of one's own, a mass on a spring that rubs, against its closed form: a mass that slides dry swings half a
//! period at a time about a place that friction shifts against the motion (Den Hartog, Mechanical Vibrations (1956),
//! 8.8; here with a damper too).

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::recorded::check_texts;
use crate::{Draws, folder, hyd, json};

const MASS: f64 = 0.5;
const STIFFNESS: f64 = 2e5;
const DAMPING: f64 = 10.0;
const FRICTION: f64 = 40.0;
const NOISE: f64 = 5e-5;

/// Position at a time after the release from `from` at rest.
fn position(from: f64, time: f64) -> f64 {
    let decay = DAMPING / (2.0 * MASS);
    let omega = (STIFFNESS / MASS - decay * decay).sqrt();
    let half = std::f64::consts::PI / omega;
    let (mut turn, mut since) = (from, time);
    loop {
        if turn.abs() * STIFFNESS <= FRICTION {
            return turn;
        }
        let centre = turn.signum() * FRICTION / STIFFNESS;
        let swing = |t: f64| {
            centre + (turn - centre) * (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin())
        };
        if since <= half {
            return swing(since);
        }
        (turn, since) = (swing(half), since - half);
    }
}

/// Model, study, and a bench of five shots whose records begin `late` after the release (s).  Returns the mean square
/// of each shot's noise.
fn write(folder: &Path, late: f64, run: &str) -> Vec<f64> {
    let model = "model Swing
  import Hyd.Translational.Components.*;
  parameter Hyd.Units.Position x0 = 5e-3;
  parameter Hyd.Units.DampingConstant b = 10;
  parameter Hyd.Units.SpringConstant k = 2e5;
  parameter Hyd.Units.Mass m = 0.5;
  Mass mass(m = m, s(start = x0, fixed = true), v(start = 0, fixed = true));
  HousingSpring spring(k = k);
  HousingDamper damper(d = b);
  replaceable Hyd.Places.NoForce rubbing constrainedby Hyd.Places.PartialForce
    annotation(__hyd(place(id = \"valve_force\")));
equation
  connect(spring.flange, mass.flange);
  connect(damper.flange, mass.flange);
  connect(rubbing.flange, mass.flange);
end Swing;
";
    fs::write(folder.join("swing.hyd"), model).expect("written");
    let study = format!(
        "file = \"swing.hyd\"\n[models]\ndefault = \"Swing\"\n[channels]\nx_m = {{ variable = \"mass.s\", noise = {NOISE} }}\n\
         [conditions]\nx0 = \"x0_m\"\n[nuisances]\nb = \"b\"\nk = \"k\"\nm = \"m\"\n{run}"
    );
    fs::write(folder.join("study.toml"), study).expect("written");
    let mut draws = Draws(11);
    let (mut shots, mut squares) = (Vec::new(), Vec::new());
    for (shot, from) in [4e-3, 8e-3, 12e-3, 6e-3, 10e-3].into_iter().enumerate() {
        let mut text = String::from("time_s,x_m\n");
        let mut sum = 0.0;
        for k in 0..1600 {
            let (t, noise) = (late + 2.5e-5 * f64::from(k), draws.normal());
            let _ = writeln!(text, "{t:.6},{:.8}", position(from, t) + NOISE * noise);
            sum += noise * noise;
        }
        squares.push(sum / 1600.0);
        fs::write(folder.join(format!("s{shot}.csv")), text).expect("written");
        shots.push(format!("{{\"file\": \"s{shot}.csv\", \"x0_m\": {from}}}"));
    }
    let tolerance = "\"parameter_tolerance_1sigma\": {\"b\": 0.3, \"k\": 0.02, \"m\": 0.01}";
    let set = format!("{{{tolerance}, \"experiments\": [{}]}}", shots.join(", "));
    fs::write(folder.join("set.json"), set).expect("written");
    squares
}

/// Friction is named, with its size, although the damper could be off far enough to imitate much of it; and the first
/// sample need not be that of the release.
#[test]
fn a_mass_that_rubs_is_found_from_its_closed_form() {
    for late in [2.5e-5, 1.3e-3] {
        let folder = folder(&format!("rubbing-{late}"));
        let squares = write(&folder, late, "");
        let found = hyd(&folder, &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
        assert_eq!(found.code, Some(0), "{}", found.stderr);
        let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
        assert_eq!((&report["status"], &report["effects"][0]["id"]), (&"named".into(), &"piston_friction".into()));
        // The place is in the model of one's own, and what stood there before is in the library.
        let places = report["location"].as_array().expect("a list");
        for file in ["swing.hyd", "<built-in>/Hyd/Places/NoForce.hyd"] {
            assert!(places.iter().any(|place| place["file"] == file), "{file}: {places:?}");
        }
        check_texts(&fs::read_to_string(folder.join("report/report.html")).expect("written"), &report);
        let size = &report["effects"][0]["parameters"]["F_c"];
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        let (value, error) = (number(&size["value"]), number(&size["stderr"]));
        assert!((value - FRICTION).abs() < 4.0 * error && error < 1.0, "{value} +- {error} instead of {FRICTION}");
        for part in ["train", "heldout"] {
            let (gap, shots) = (&report["gap"][part], report["shots"][part].as_array().expect("a list"));
            let noise = shots.iter().map(|shot| squares[shot.as_u64().expect("a number") as usize - 1]);
            let noise = (noise.sum::<f64>() / shots.len() as f64).sqrt();
            assert!(number(&gap["before"]) > 3.0, "{part}: {gap}");
            assert!((number(&gap["after"]) - noise).abs() < 0.01, "{part}: {gap}, the noise is {noise}");
        }
        let _ = fs::remove_dir_all(&folder);
    }
}

/// A clock that counts from elsewhere: the model that is written begins where the shots did.
#[test]
fn a_clock_that_counts_from_elsewhere_is_told_by_the_study() {
    let folder = folder("rubbing-clock");
    write(&folder, 0.0, "[run]\nstart = 100\n");
    for shot in 0..5 {
        let path = folder.join(format!("s{shot}.csv"));
        let text = fs::read_to_string(&path).expect("written");
        let later = |line: &str| match line.split_once(',') {
            Some((time, rest)) => time.parse().map_or(line.to_string(), |t: f64| format!("{:.6},{rest}", t + 100.0)),
            None => line.to_string(),
        };
        fs::write(&path, text.lines().map(later).collect::<Vec<_>>().join("\n")).expect("written");
    }
    let found = hyd(&folder, &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
    assert_eq!(report["effects"][0]["id"], "piston_friction", "{}", found.stdout);
    let arguments = ["simulate", "discovered.hyd", "--result", "run.csv", "--variables", "^mass[.]s$"];
    let run = hyd(&folder.join("report"), &arguments);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let table = fs::read_to_string(folder.join("report/run.csv")).expect("written");
    assert!(table.lines().nth(1).is_some_and(|line| line.starts_with("100,")), "{}", &table[..100]);
    let _ = fs::remove_dir_all(&folder);
}

/// The trigger of a shot that was held out is not fitted: it is not among the results, and has no interval.
#[test]
fn what_was_not_fitted_is_not_listed() {
    let folder = folder("rubbing-held-out");
    write(&folder, 0.0, "[shots]\ntrigger_jitter = 2e-5\nhold_out = [1, 4]\n");
    let arguments = ["fit", "study.toml", "--bench", "set.json"];
    let fitted = hyd(&folder, &arguments);
    assert_eq!(fitted.code, Some(0), "{}", fitted.stderr);
    let listed =
        |text: &str| (1..=5).filter(|shot| text.contains(&format!("trigger (shot {shot})"))).collect::<Vec<_>>();
    assert_eq!(listed(&fitted.stdout), [2, 3, 5], "{}", fitted.stdout);
    let report = json(&hyd(&folder, &[&arguments[..], &["--json"]].concat()).stdout);
    for unknown in report["unknowns"].as_array().expect("a list") {
        let number = |key: &str| unknown[key].as_f64().expect("a number");
        let held_out = ["trigger (shot 1)", "trigger (shot 4)"].contains(&unknown["name"].as_str().expect("a name"));
        assert_eq!(unknown["fitted"], !held_out, "{unknown}");
        // Nothing but its prior is known of it.
        assert_eq!(number("sd").abs() < 1e-9 && (number("sd_error") - 1.0).abs() < 1e-9, held_out, "{unknown}");
    }
    for (name, code) in [("trigger (shot 2)", 0), ("trigger (shot 4)", 2)] {
        let outcome = hyd(&folder, &[&arguments[..], &["--profile", name]].concat());
        assert_eq!(outcome.code, Some(code), "{name}: {}{}", outcome.stdout, outcome.stderr);
        let message = "error: `trigger (shot 4)` is not fitted: its shot is held out\n";
        assert!(code == 0 || outcome.stderr == message, "{}", outcome.stderr);
    }
    let unknown = hyd(&folder, &[&arguments[..], &["--profile", "nothing"]].concat());
    assert_eq!(listed(&unknown.stderr), [2, 3, 5], "{}", unknown.stderr);
    let _ = fs::remove_dir_all(&folder);
}

/// Nothing to compare is not an answer.
#[test]
fn shots_that_are_masked_throughout_are_refused() {
    let folder = folder("rubbing-masked");
    write(&folder, 0.0, "[shots]\nmasks = [{ from = 0 }]\n");
    let outcome = hyd(&folder, &["fit", "study.toml", "--bench", "set.json"]);
    assert_eq!(outcome.code, Some(1), "{}{}", outcome.stdout, outcome.stderr);
    assert!(outcome.stderr.contains("no sample of the shots that are fitted counts"), "{}", outcome.stderr);
    let _ = fs::remove_dir_all(&folder);
}

#[test]
fn runs_that_begin_after_the_first_sample_are_refused() {
    let folder = folder("rubbing-start");
    write(&folder, 2.5e-5, "[run]\nstart = 1e-3\n");
    let outcome = hyd(&folder, &["fit", "study.toml", "--bench", "set.json"]);
    assert_eq!(outcome.code, Some(1), "{}{}", outcome.stdout, outcome.stderr);
    assert!(outcome.stderr.contains("shot 1: runs begin at 0.001 s, after the first sample"), "{}", outcome.stderr);
    write(&folder, 2.5e-5, "[run]\nstart = -1e3\n");
    let outcome = hyd(&folder, &["fit", "study.toml", "--bench", "set.json"]);
    assert_eq!(outcome.code, Some(1), "{}{}", outcome.stdout, outcome.stderr);
    assert!(outcome.stderr.contains("more than 200000"), "{}", outcome.stderr);
    let _ = fs::remove_dir_all(&folder);
}

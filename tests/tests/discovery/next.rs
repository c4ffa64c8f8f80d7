//! The next shot: what a search leaves open is settled by the shot that is proposed, made by the closed form of the truth.
//!
//! A mass that a damper slows, with a drag by the square of its speed that the model lacks: from `m dv/dt = -b v - c v^2` follows
//! `v = b v0 e/(b + c v0 (1 - e))` with `e = exp(-b t/m)`.  Over the narrow speeds of the shots that were made, the drag looks like any other
//! friction.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::{Draws, folder, hyd, json};

const NOISE: f64 = 8e-3;

/// Model, study and a set of shots from these speeds.
fn write(folder: &Path, speeds: &[f64], limits: &str) {
    write_with(folder, speeds, (0.2, NOISE, 0.0), limits);
}

/// The same with another coefficient of the drag, another noise, and a sensor of which the offset is known within a tolerance.
fn write_with(folder: &Path, speeds: &[f64], (c, noise, offset): (f64, f64, f64), limits: &str) {
    let model = "model Coast
  parameter Real m(unit = \"kg\") = 2;
  parameter Real b(unit = \"N.s/m\") = 0.5;
  parameter Real v0(unit = \"m/s\") = 1;
  Real v(unit = \"m/s\", start = v0, fixed = true);
equation
  m*der(v) = -b*v;
end Coast;
";
    fs::write(folder.join("coast.mo"), model).expect("written");
    let study = format!(
        "file = \"coast.mo\"\n[models]\ndefault = \"Coast\"\n[channels]\nv = {{ variable = \"v\", noise = {noise}, offset = {offset} }}\n\
         [conditions]\nv0 = \"v0_m_s\"\n[nuisances]\nm = \"m\"\nb = \"b\"\n{limits}"
    );
    fs::write(folder.join("study.toml"), study).expect("written");
    let (m, b) = (2.0, 0.5);
    let mut shots = Vec::new();
    for (shot, v0) in speeds.iter().enumerate() {
        let mut draws = Draws(40 + shot as u64);
        let mut text = String::from("time_s,v\n");
        for k in 0..=200 {
            let t = 1e-3 * f64::from(k);
            let e = (-b * t / m).exp();
            let _ = writeln!(text, "{t:.6},{:.9e}", b * v0 * e / (b + c * v0 * (1.0 - e)) + noise * draws.normal());
        }
        fs::write(folder.join(format!("s{shot}.csv")), text).expect("written");
        shots.push(format!("{{\"file\": \"s{shot}.csv\", \"v0_m_s\": {v0}}}"));
    }
    let tolerance = "\"parameter_tolerance_1sigma\": {\"m\": 0.01, \"b\": 0.02}";
    fs::write(folder.join("set.json"), format!("{{{tolerance}, \"experiments\": [{}]}}", shots.join(", ")))
        .expect("written");
}

const SPEEDS: [f64; 4] = [1.0, 1.06, 0.95, 1.02];

fn next(folder: &Path, more: &[&str]) -> Value {
    let common = ["next", "study.toml", "--bench", "set.json", "--json"];
    let found = hyd(folder, &[&common, more].concat());
    assert_eq!(found.code, Some(0), "{}{}", found.stdout, found.stderr);
    json(&found.stdout)
}

fn discovered(folder: &Path) -> Value {
    let found = hyd(folder, &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
    assert_eq!(found.code, Some(0), "{}{}", found.stdout, found.stderr);
    json(&fs::read_to_string(folder.join("report/report.json")).expect("written"))
}

#[test]
fn the_proposed_shot_names_what_was_ambiguous() {
    let folder = folder("next");
    write(&folder, &SPEEDS, "");
    let proposed = next(&folder, &["--vary", "v0=0.2:3", "--report", "next"]);
    assert_eq!((&proposed["status"], &proposed["aim"]), (&"ambiguous".into(), &"tell apart".into()), "{proposed:#}");
    let rivals: Vec<&str> = proposed["models"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    assert!(rivals.contains(&"quadratic_drag of v") && rivals.len() > 1, "{rivals:?}");
    let speed = proposed["shots"][0]["conditions"]["v0_m_s"].as_f64().expect("a number");
    assert!(!(0.5..2.0).contains(&speed), "far from the shots that were made: {speed}");
    // Friction and a force look alike as long as the mass moves one way.
    let never = proposed["never"].as_array().expect("a list");
    assert!(never.iter().all(|words| words.as_str().is_some_and(|words| words.contains("offset_force"))), "{never:?}");
    let made: Vec<f64> = (0..SPEEDS.len()).filter_map(|k| proposed["made"][k]["values"][0].as_f64()).collect();
    assert_eq!(made, SPEEDS, "the map has the shots that were made: {}", proposed["made"]);
    let page = fs::read_to_string(folder.join("next/next.html")).expect("written");
    assert!(page.contains("\"against\":\"quadratic_drag of v\""));
    // Fits to the record with the drag say by how much the rivals are refuted; the search on the set with that shot agrees.
    let evidence = proposed["shots"][0]["evidence"].as_array().expect("a list");
    let of = |own: &&Value| own["if"] == "quadratic_drag of v";
    let least = evidence.iter().filter(of).filter_map(|own| own["fitted"].as_f64()).fold(f64::INFINITY, f64::min);
    assert!(least > 100.0 && least.is_finite(), "{proposed:#}");
    write(&folder, &[&SPEEDS[..], &[speed]].concat(), "");
    let report = discovered(&folder);
    assert_eq!(report["status"], "named", "{report:#}");
    assert_eq!(report["effects"][0]["id"], "quadratic_drag");
    // What is named is to be known better: the interval that is foretold for one more shot comes true.
    let error = |report: &Value| report["effects"][0]["parameters"]["c"]["stderr"].as_f64().expect("a number");
    let before = error(&report);
    let proposed = next(&folder, &["--vary", "v0=0.2:3"]);
    assert_eq!(proposed["aim"], "narrow", "{proposed:#}");
    let foretold = proposed["shots"][0]["narrows"][0]["interval_times"].as_f64().expect("a number");
    let again = proposed["shots"][0]["conditions"]["v0_m_s"].as_f64().expect("a number");
    write(&folder, &[&SPEEDS[..], &[speed, again]].concat(), "[shots]\nhold_out = [4]\n");
    let after = error(&discovered(&folder));
    assert!(foretold < 0.97 && (after / before / foretold - 1.0).abs() < 0.02, "{before} {after} {foretold}");
    let _ = fs::remove_dir_all(&folder);
}

/// Where nothing is missing, effects that the shots could not show are to show.  By how much the cost drops with a drag in all shots, the
/// proposed one among them, follows here from the closed form: `d'd - g'(I + J'J)^-1 g` with the change `d` by the drag and the
/// derivatives `J` by mass, damping and the offset of the sensor, in standard deviations.
#[test]
fn what_could_have_hidden_shows_as_much_as_is_foretold() {
    let folder = folder("next-hidden");
    let (speeds, noise, offset) = ([0.05, 0.06, 0.04, 0.055], 2e-3, 0.02);
    write_with(&folder, &speeds, (1e-9, noise, offset), "[shots]\nhold_out = [1]\n");
    let proposed = next(&folder, &["--vary", "v0=0.03:0.2"]);
    assert_eq!((&proposed["status"], &proposed["aim"]), (&"adequate".into(), &"reveal".into()), "{proposed:#}");
    let shot = &proposed["shots"][0];
    let speed = shot["conditions"]["v0_m_s"].as_f64().expect("a number");
    let evidence = shot["evidence"].as_array().expect("a list");
    let drag = evidence.iter().find(|own| own["if"] == "quadratic_drag of v").unwrap_or_else(|| panic!("{proposed:#}"));
    let (size, foretold) = (drag["size"].as_f64().expect("a size"), drag["expected"].as_f64().expect("a number"));
    let (m, b) = (2.0, 0.5);
    // Rows of the normal equations with the change as their last column, and the square of the change.
    let (mut rows, mut square) = ([[0.0; 4]; 3], 0.0);
    (0..3).for_each(|k| rows[k][k] = 1.0);
    for v0 in speeds[1..].iter().copied().chain([speed]) {
        for k in 0..=200 {
            let t = 1e-3 * f64::from(k);
            let e = (-b * t / m).exp();
            let (without, with) = (v0 * e, b * v0 * e / (b + size * v0 * (1.0 - e)));
            let rate = b * t / m * without;
            let own = [0.01 * rate, -0.02 * rate, offset, with - without].map(|change| change / noise);
            square += own[3] * own[3];
            (0..3).for_each(|i| (0..4).for_each(|k| rows[i][k] += own[i] * own[k]));
        }
    }
    let pulls = [rows[0][3], rows[1][3], rows[2][3]];
    for i in 0..3 {
        for other in (0..3).filter(|&other| other != i) {
            let factor = rows[other][i] / rows[i][i];
            (0..4).for_each(|k| rows[other][k] -= factor * rows[i][k]);
        }
    }
    let exact = square - (0..3).map(|k| pulls[k] * rows[k][3] / rows[k][k]).sum::<f64>();
    assert!(speed > 0.15 && exact > 20.0 && (foretold / exact - 1.0).abs() < 0.05, "{speed} {foretold} {exact}");
    // An offset within its tolerance hides everywhere, whatever the shots together say, and that is told.
    let never = proposed["never"].to_string();
    assert!(never.contains("offset of v") && !never.contains("quadratic_drag"), "{never}");
    let _ = fs::remove_dir_all(&folder);
}

#[test]
fn a_bench_is_not_asked_for_what_it_cannot_do() {
    let folder = folder("next-limits");
    let limits = "[limits]\ncost = \"v0_m_s\"\n[limits.settings.v0_m_s]\nmax = 2.5\nstep = 0.25\n[limits.channels.v]\nmin = 0.6\n\
                  [[limits.forbidden]]\nv0_m_s = { above = 1.6, below = 2.1 }\n";
    write(&folder, &SPEEDS, limits);
    let proposed = next(&folder, &["--vary", "v0=0.2:3", "--shots", "2"]);
    assert!(proposed["beyond"].as_u64() > Some(0) && proposed["forbidden"].as_u64() > Some(0), "{proposed:#}");
    for point in proposed["points"].as_array().expect("a list") {
        let speed = point["values"][0].as_f64().expect("a number");
        let is_set = (speed / 0.25).fract() == 0.0 && (0.6..=2.5).contains(&speed);
        assert!(is_set && !(speed > 1.6 && speed < 2.1), "{speed}");
    }
    assert_eq!(proposed["shots"].as_array().map(Vec::len), Some(2));

    let refused = |limits: &str, vary: &str, words: &[&str]| {
        write(&folder, &SPEEDS, limits);
        let found = hyd(&folder, &["next", "study.toml", "--bench", "set.json", "--vary", vary]);
        assert!(
            found.code != Some(0) && words.iter().all(|part| found.stderr.contains(part)),
            "{words:?} {}",
            found.stderr
        );
    };
    refused("", "v1=1:2", &["no condition `v1`", "v0_m_s"]);
    refused("", "v0=2:1", &["not a range"]);
    refused("", "v0", &["NAME=LOW:HIGH"]);
    refused("[limits.settings.v0_m_s]\nmax = 1\n", "v0=1:2", &["line 11", "cannot vary"]);
    refused("[limits.settings.v0_ms]\nmax = 1\n", "v0=1:2", &["line 11", "`v0_ms`", "v0_m_s"]);
    refused("[limits.channels.w]\nmax = 1\n", "v0=1:2", &["line 11", "`w`"]);
    refused("[limits.channels.v]\nmax = 0.1\n", "v0=1:2", &["leaves what `[limits.channels]`"]);
    refused("[[limits.forbidden]]\nv0_m_s = { above = 0 }\n", "v0=1:2", &["forbid all points"]);
    refused("[limits]\ncost = \"v0_m_s - 9\"\n", "v0=1:2", &["line 12", "a cost is positive"]);
    refused("[limits]\ncost = \"1 + p0\"\n", "v0=1:2", &["line 12", "no condition `p0`"]);
    refused("[limits.settings.v0_m_s]\nstep = 0\n", "v0=1:2", &["line 12", "must be a positive number"]);
    let _ = fs::remove_dir_all(&folder);
}

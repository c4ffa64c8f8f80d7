//! Something slow that a model lacks looks like drift of the measuring chains: it is named beside hum, and doubted where two channels share it.
//!
//! A capacitor is charged by a constant current for 0.3 s and leaks; the truth is the solution of its linear equation.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use crate::{Draws, folder, hyd, json};

/// Capacity (F), leak (S), end of the current (s).
const TRUTH: (f64, f64, f64) = (1e-3, 3e-5, 0.3);

const MODEL: &str = "model Capacitor\n  parameter Real C(unit = \"F\") = 1e-3;\n  input Real i(unit = \"A\");\n  \
                     Real v(unit = \"V\", start = 0, fixed = true);\nequation\n  C*der(v) = i;\nend Capacitor;\n";

/// The set of four shots, with hum of so many volts and a study that begins with these words.
fn bench(name: &str, hum: f64, first: &str) -> PathBuf {
    let folder = folder(name);
    let mut draws = Draws(11);
    let mut files = Vec::new();
    for (shot, (current, phase)) in [(0.02, 0.4), (0.03, 2.0), (0.045, 4.1), (0.06, 5.5)].into_iter().enumerate() {
        let (c, g, end) = TRUTH;
        let mut table = "t,amp,v,q\n".to_string();
        for k in 0..=1000 {
            let t = 1e-3 * f64::from(k);
            let charged = current / g * (1.0 - (-g / c * t.min(end)).exp());
            let v = charged * (-g / c * (t - end).max(0.0)).exp();
            let wave = hum * (std::f64::consts::TAU * 50.0 * t + phase).sin();
            let amp = if t < end { current } else { 0.0 };
            let [of_v, of_q] = [0.02, 2e-5].map(|sigma| sigma * draws.normal());
            writeln!(table, "{t:.3},{amp},{:.5},{:.8}", v + wave + of_v, c * v + of_q).expect("a string");
        }
        let file = format!("shot_{shot}.csv");
        fs::write(folder.join(&file), table).expect("written");
        files.push(format!("{{\"file\": \"{file}\"}}"));
    }
    fs::write(folder.join("set.json"), format!("{{\"experiments\": [{}]}}", files.join(", "))).expect("written");
    fs::write(folder.join("m.hyd"), MODEL).expect("written");
    let study = format!(
        "file = \"m.hyd\"\n{first}[models]\ndefault = \"Capacitor\"\n[channels]\nv = {{ variable = \"v\", unit = \"V\", noise = 0.02 }}\n\
         q = {{ variable = \"C*v\", unit = \"C\", noise = 2e-5 }}\n[inputs]\ni = {{ column = \"amp\", unit = \"A\", hold = \"zero\" }}\n\
         [nuisances]\nC = {{ parameter = \"C\", relative = 0.02 }}\n[shots]\ntime = \"t\"\n"
    );
    fs::write(folder.join("study.toml"), study).expect("written");
    folder
}

/// Hum explains far more than the leak does; a ramp in every shot would explain the leak, too, and may not come along with the hum.
#[test]
fn a_leak_is_named_beside_hum_and_is_not_drift() {
    let folder = bench("leak_and_hum", 0.6, "");
    let found = hyd(&folder, &["discover", "study.toml", "--bench", "set.json", "--report", "."]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report.json")).expect("written"));
    assert_eq!(report["status"], "named", "{}", found.stdout);
    assert!(
        found.stdout.contains("shunt_resistance of v") && found.stdout.contains("hum of 50 Hz in v"),
        "{}",
        found.stdout
    );
    assert!(!found.stdout.contains("drift in"), "{}", found.stdout);
    let size = found.stdout.lines().find_map(|line| line.trim().strip_prefix("shunt_resistance.G ")).expect("a size");
    let value: f64 = size.split_whitespace().next().expect("a number").parse().expect("a number");
    assert!((value / TRUTH.1 - 1.0).abs() < 0.1, "{size}");
}

/// Without an effect to name, both channels are found to drift; that they do so alike is said.
#[test]
fn channels_that_drift_alike_are_doubted() {
    let folder = bench("drift_alike", 0.0, "without = [\"Hyd.Effects\"]\n");
    let found = hyd(&folder, &["discover", "study.toml", "--bench", "set.json", "--report", "."]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let both = ["v and q drift alike", "q and v drift alike"];
    assert!(both.iter().any(|words| found.stdout.contains(words)), "{}", found.stdout);
}

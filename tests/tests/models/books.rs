//! Books of energy and of oil over random values: what is stored, put in and lost must add up, whatever the parameters.
//!
//! A case is a model of `tests/books` with the variables `balance` (zero) and `through` (what has passed, to compare with).  Lines
//! `// random: NAME = LOW .. HIGH` say which parameters are drawn, evenly by their logarithm.  The draws are the same in every run.

use std::path::Path;

use hyd_tests::models::root;
use hyd_tests::runs::{on_grid, run};

const DRAWS: usize = 8;
/// Share of what has passed that may be missing, at a tolerance of 1e-9.
const SHARE: f64 = 2e-7;

/// Random numbers: xorshift after Marsaglia, "Xorshift RNGs", J. Stat. Software 8 (2003).
struct Random(u64);

impl Random {
    /// Evenly in 0 to 1.
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Names and ranges of the parameters that are drawn.
fn ranges(text: &str) -> Vec<(String, f64, f64)> {
    let lines = text.lines().filter_map(|line| line.trim().strip_prefix("// random: "));
    let range = |line: &str| {
        let (name, range) = line.split_once(" = ")?;
        let (low, high) = range.split_once(" .. ")?;
        Some((name.to_string(), low.parse().ok()?, high.parse().ok()?))
    };
    lines.map(|line| range(line).unwrap_or_else(|| panic!("`{line}` is not a range"))).collect()
}

fn stop(text: &str) -> f64 {
    let after = text.split_once("StopTime = ").expect("a stop time").1;
    after.split_once(')').expect("an end").0.parse().expect("a number")
}

fn check(file: &Path, random: &mut Random) -> String {
    let text = std::fs::read_to_string(file).expect("readable");
    let ranges = ranges(&text);
    assert!(ranges.len() >= 3, "{}: too few parameters are drawn", file.display());
    let path = file.strip_prefix(root()).expect("below the root").display().to_string();
    let mut report = String::new();
    for _ in 0..DRAWS {
        let draw =
            |(name, low, high): &(String, f64, f64), u: f64| (name.clone(), (low * (high / low).powf(u)).to_string());
        let drawn: Vec<(String, String)> = ranges.iter().map(|range| draw(range, random.unit())).collect();
        let set: Vec<(&str, &str)> = drawn.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        let run = run(&path, &set, &on_grid(stop(&text), 100, 1e-9));
        let through = run.values("through").into_iter().fold(0.0, f64::max);
        let balance = run.values("balance").into_iter().map(f64::abs).fold(0.0, f64::max);
        if through <= 0.0 || balance.is_nan() || balance > SHARE * through {
            report += &format!("{path}: {balance:.3e} of {through:.3e} missing with {set:?}\n");
        }
    }
    report
}

#[test]
fn books_close_at_random_operating_points() {
    let folder = root().join("tests/books");
    let mut files: Vec<_> =
        std::fs::read_dir(folder).expect("the folder exists").map(|entry| entry.expect("listed").path()).collect();
    files.sort();
    assert!(files.len() >= 10);
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let report: String = files.iter().map(|file| check(file, &mut random)).collect();
    assert!(report.is_empty(), "{report}");
}

/// What keeps no books: ends and sources are where oil and energy come from, a face of pressure leaves its small flow out.
const OUTSIDE: [&str; 5] = ["package", "Ground", "Plug", "CompensatedPump", "PressureFace"];

/// A component inside of another one is on its books.
const INSIDE: [(&str, &str); 3] = [
    ("Piston", "DoubleActingCylinder"),
    ("ReversedPiston", "DoubleActingCylinder"),
    ("Chamber", "DoubleActingCylinder"),
];

#[test]
fn every_hydraulic_and_magnetic_component_is_on_some_book() {
    let texts: String = std::fs::read_dir(root().join("tests/books"))
        .expect("the folder exists")
        .map(|entry| std::fs::read_to_string(entry.expect("listed").path()).expect("readable"))
        .collect();
    let words: Vec<&str> = texts.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    let mut missing = Vec::new();
    for domain in ["Hydraulic", "Magnetic"] {
        let folder = root().join("stdlib/Hyd").join(domain).join("Components");
        for entry in std::fs::read_dir(folder).expect("the folder exists") {
            let file = entry.expect("listed").file_name().into_string().expect("text");
            let Some(name) = file.strip_suffix(".hyd") else { continue };
            let name = INSIDE.iter().find(|(part, _)| *part == name).map_or(name, |(_, whole)| whole);
            if !OUTSIDE.contains(&name) && !words.contains(&name) {
                missing.push(name.to_string());
            }
        }
    }
    assert!(missing.is_empty(), "on no book: {missing:?}");
}

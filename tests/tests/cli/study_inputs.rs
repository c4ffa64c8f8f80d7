//! `[inputs]` of studies: fits of models that are driven by columns of the shots' tables, and what is said of columns that do not fit.
//!
//! The tables hold the exact solution of a first-order lag under a polygon or steps, `T x' = K u - x`, with noise from a fixed sequence.

use std::fmt::Write as _;

#[cfg(unix)]
use crate::process::command;
use crate::process::{Outcome, Scratch, run};

/// The truth, and the samples of a shot.
const T: f64 = 0.55;
const K: f64 = 1.3;
const SAMPLES: usize = 201;
const STEP: f64 = 0.02;
/// Standard deviation of the noise.
const NOISE: f64 = 1e-4;

const MODEL: &str = "model M
  input Real u(unit = \"V\"); input Boolean b(start = false);
  parameter Real T = 0.5;
  parameter Real K = 1;
  Real x(start = 0, fixed = true);
equation
  T*der(x) = K*u - x;
end M;
";
const STUDY: &str = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\nx = { variable = \"x\" }\n[inputs]\n\
    u = { column = \"volt_mV\", unit = \"mV\", scale = 1e3, offset = 50 }\n[nuisances]\nT = \"T\"\nK = \"K\"\n[shots]\n\
    time = \"t_ms\"\ntime_scale = 1e-3\n";
const SET: &str = "{\"noise_std\": {\"x\": 1e-4}, \"parameter_tolerance_1sigma\": {\"T\": 0.3, \"K\": 0.3},\n\
    \"experiments\": [{\"file\": \"s1.csv\"}, {\"file\": \"s2.csv\"}, {\"file\": \"s3.csv\"}]}";

/// Numbers between -1 and 1 (Park, Miller 1988).
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 as f64 / 1_073_741_823.5 - 1.0
    }
}

/// A shot whose input changes every few samples; `held`: in steps.  It acts `lag` samples later than it is recorded.
fn table(shot: usize, held: bool, lag: usize) -> String {
    let mut draws = Draws(20_261 + shot as u64);
    let mut level = 0.0;
    let input: Vec<f64> = (0..SAMPLES)
        .map(|k| {
            if k % (10 + shot) == 0 {
                level = draws.next();
            }
            level
        })
        .collect();
    let acting = |k: usize| input[k.saturating_sub(lag)];
    let mut text = String::from("t_ms,volt_mV,x,other\n");
    let mut x = 0.0;
    for (k, own) in input.iter().enumerate() {
        if k > 0 {
            let (a, b) = (K * acting(k - 1), K * acting(k));
            let s = if held { 0.0 } else { (b - a) / STEP };
            x = a + s * STEP - s * T + (x - a + s * T) * (-STEP / T).exp();
        }
        // The sum of twelve uniform numbers is all but normal.
        let noise = NOISE * (0..12).map(|_| draws.next()).sum::<f64>() / 2.0;
        writeln!(text, "{},{},{},{k}", 1e3 * STEP * k as f64, 1e3 * own + 50.0, x + noise).unwrap();
    }
    text
}

fn folder(held: bool, lag: usize) -> Scratch {
    let folder = Scratch::new();
    folder.write("m.hyd", MODEL);
    folder.write("st.toml", STUDY);
    folder.write("set.json", SET);
    (1..4).for_each(|shot| folder.write(&format!("s{shot}.csv"), table(shot, held, lag)));
    folder
}

fn fit(folder: &Scratch, more: &[&str]) -> Outcome {
    run(folder.path(), &[&["fit", "st.toml", "--bench", "set.json"], more].concat())
}

/// What a fit makes of the truth: relative errors of T and K, and the gap.
fn errors(folder: &Scratch) -> ([f64; 2], f64) {
    let outcome = fit(folder, &["--json"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let json: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let value = |name: &str, nominal: f64| {
        let unknown = json["unknowns"].as_array().unwrap().iter().find(|unknown| unknown["name"] == name).unwrap();
        nominal * unknown["value"].as_f64().unwrap()
    };
    let found = [value("T", 0.5) / T - 1.0, value("K", 1.0) / K - 1.0];
    (found.map(f64::abs), json["gap"]["train"]["all"].as_f64().unwrap())
}

#[test]
fn a_fit_finds_the_parameters_behind_recorded_inputs() {
    for (held, lag) in [(false, 0), (true, 0), (false, 3), (true, 3)] {
        let folder = folder(held, lag);
        let hold = if held { "zero" } else { "linear" };
        let study = format!("offset = 50, hold = \"{hold}\", lag = {} }}", STEP * lag as f64);
        folder.write("st.toml", STUDY.replace("offset = 50 }", &study));
        let (found, gap) = errors(&folder);
        assert!(found.iter().all(|error| *error < 1e-3), "{hold} {lag}: {found:?}");
        assert!((gap - 1.0).abs() < 0.1, "{hold} {lag}: gap {gap}");
        if lag > 0 {
            // Without the lag nothing fits.
            folder.write("st.toml", STUDY.replace("offset = 50 }", &format!("offset = 50, hold = \"{hold}\" }}")));
            assert!(errors(&folder).1 > 10.0);
        }
    }
}

/// A unit of the model in place of its text, through which derivatives are carried by further instances.
#[cfg(unix)]
#[test]
fn a_fit_of_a_unit_finds_the_parameters() {
    for (version, held) in [("2.0", false), ("3.0", true)] {
        let folder = folder(held, 0);
        let build = ["build", "m.hyd", "--fmu", version, "-o", "m.fmu"];
        let made = command(folder.path(), &build).env("HYD_UNIT", crate::unit_client::library()).output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        let hold = format!("offset = 50, hold = \"{}\" }}", if held { "zero" } else { "linear" });
        let study = STUDY.replace("offset = 50 }", &hold).replace("m.hyd", "m.fmu");
        folder.write("st.toml", &study);
        let (found, gap) = errors(&folder);
        assert!(found.iter().all(|error| *error < 1e-3), "{version}: {found:?}");
        assert!((gap - 1.0).abs() < 0.1, "{version}: gap {gap}");
        // What a unit does not have is said with the study's own words.
        for (old, new, said) in [
            ("variable = \"x\"", "variable = \"xx\"", "the unit has no variable `xx`"),
            ("T = \"T\"", "T = \"x\"", "`x` is not a parameter that can be set"),
            ("u = {", "w = {", "the model has no input `w`"),
            ("default = \"M\"", "default = \"N\"", "it is a unit of the model `M`, and the study names `N`"),
        ] {
            folder.write("st.toml", study.replacen(old, new, 1));
            let outcome = fit(&folder, &[]);
            assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
            assert!(outcome.stderr.contains(said), "`{said}` is not in {}", outcome.stderr);
        }
    }
}

/// The truth lies a hundred standard deviations away: nothing goes farther than twelve, which is said.
#[test]
fn what_ends_at_the_limit_is_said() {
    let folder = folder(false, 0);
    folder.write("set.json", SET.replace("\"T\": 0.3", "\"T\": 0.001"));
    folder.write("st.toml", format!("without = [\"Hyd.Effects\"]\n{STUDY}"));
    let outcome = fit(&folder, &[]);
    let marked =
        |name: &str| outcome.stdout.lines().find(|line| line.trim_start().starts_with(name)).unwrap().to_string();
    assert!(marked("T ").ends_with("  (at the limit)") && !marked("K ").contains("limit"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("farther than 12 standard deviations"), "{}", outcome.stdout);
    let json: serde_json::Value = serde_json::from_str(&fit(&folder, &["--json"]).stdout).unwrap();
    let held = json["unknowns"].as_array().unwrap().iter().filter(|own| own["at_limit"] == true);
    assert_eq!(held.map(|own| own["name"].as_str().unwrap()).collect::<Vec<_>>(), ["T"]);
    let found = run(folder.path(), &["discover", "st.toml", "--bench", "set.json", "--report", "r"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let line = "  at the limit of 12 standard deviations, held there: T\n";
    let report: serde_json::Value = serde_json::from_str(&folder.read("r/report.json")).unwrap();
    assert!(found.stdout.contains(line) == (report["at_limit"] == serde_json::json!(["T"])), "{}", found.stdout);
    let base = &report["parameters"].as_array().unwrap().iter().find(|own| own["name"] == "T").unwrap()["before"];
    assert_eq!(base["at_limit"], true, "{report:#}");
}

/// A minimum so narrow and curved that no fit converges: its values are shown, and the command fails like a solver.
#[test]
fn a_fit_that_does_not_converge_fails_and_shows_its_values() {
    let folder = Scratch::new();
    let model = "model M\n  parameter Real a = -4; parameter Real b = -64;\n  Real x = b - a*a*a + sin(time);\n  Real y = a + cos(time);\nend M;\n";
    folder.write("m.hyd", model);
    let mut table = String::from("t,x,y\n");
    for k in 0..40 {
        let t = 0.1 * f64::from(k);
        writeln!(table, "{t},{},{}", t.sin(), 5.0 + t.cos()).unwrap();
    }
    folder.write("s.csv", table);
    folder.write("set.json", "{\"noise_std\": {\"x\": 1e-4, \"y\": 0.1}, \"experiments\": [{\"file\": \"s.csv\"}]}");
    folder.write(
        "st.toml",
        "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\nx = { variable = \"x\" }\ny = { variable = \"y\" }\n[nuisances]\n\
         a = { parameter = \"a\", absolute = 2 }\nb = { parameter = \"b\", absolute = 84 }\n[shots]\ntime = \"t\"\ntime_tolerance = 0.01\n",
    );
    for (more, shown) in [(&[][..], "what may be off"), (&["--json"], "\"converged\":false")] {
        let outcome = fit(&folder, more);
        assert_eq!(outcome.code, Some(3), "{}{}", outcome.stdout, outcome.stderr);
        let is_said = outcome.stderr.starts_with("error: the fit has not converged");
        assert!(is_said && outcome.stdout.contains(shown), "{}{}", outcome.stdout, outcome.stderr);
    }
    // Without the bend it does.
    folder.write("m.hyd", model.replace("a*a*a", "a"));
    let outcome = fit(&folder, &["--json"]);
    assert!(outcome.code == Some(0) && outcome.stdout.contains("\"converged\":true"), "{}", outcome.stdout);
}

#[test]
fn one_thread_and_two_give_the_same_fit() {
    let folder = folder(true, 0);
    folder.write("st.toml", STUDY.replace("offset = 50 }", "offset = 50, hold = \"zero\" }"));
    let fitted = |threads: &str| {
        let json = fit(&folder, &["--json", "--threads", threads]).stdout;
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        (json["unknowns"].clone(), json["gap"].clone(), json["misfit"].clone())
    };
    assert_eq!(fitted("1"), fitted("2"));
}

#[test]
fn a_search_runs_on_recorded_inputs() {
    let folder = folder(false, 0);
    let outcome = run(folder.path(), &["discover", "st.toml", "--bench", "set.json", "--report", "r"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(outcome.stdout.contains("adequate: nothing is missing"), "{}", outcome.stdout);
}

#[test]
fn what_does_not_fit_is_said_with_its_line() {
    let whole = "u = { column = \"volt_mV\", unit = \"mV\", scale = 1e3, offset = 50 }";
    let studies = [
        (
            "v = { column = \"volt_mV\" }",
            "error: line 7 of the study: the model has no input `v` of type Real at its top; it has: u",
        ),
        (
            "b = { column = \"volt_mV\" }",
            "error: line 7 of the study: the model has no input `b` of type Real at its top; declared as `input Real b`, without an \
             equation for it, it can follow a column",
        ),
        (
            "K = { column = \"volt_mV\" }",
            "the model has no input `K` of type Real at its top; declared as `input Real K`",
        ),
        (
            "u = { column = \"volt\" }",
            "error: `s1.csv`: there is no column `volt` for the input `u` (line 7 of the study)",
        ),
        ("u = { column = \"t_ms\" }", "error: `st.toml`: line 7: the input `u` follows `t_ms`, the column of times"),
        ("u = { column = \"x\", hold = \"cubic\" }", "line 7: `hold` is `cubic`, and must be linear, zero or smooth"),
        ("u = { column = \"x\", scale = 0 }", "line 7: input `u`: the scale 0 must be a number but zero"),
        ("u = { column = \"x\", lag = nan }", "line 7: input `u`: `lag` must be a number"),
        ("u = { column = \"x\", lag = 9 }", "`s1.csv`: the input `u` lags by 9 s, longer than the record"),
        ("u = { column = \"x\", gain = 9 }", "line 7: unknown field `gain`"),
    ];
    let shared = folder(false, 0);
    for (line, expected) in studies {
        shared.write("st.toml", STUDY.replace(whole, line));
        let outcome = fit(&shared, &[]);
        assert_eq!(outcome.code, Some(1), "{line}: {}", outcome.stderr);
        assert!(outcome.stderr.contains(expected), "{line}: {}", outcome.stderr);
    }
    // Gaps, in the field of the input alone: single ones are filled.
    let gap = |lines: &[usize]| {
        let text = table(1, false, 0);
        let without = |(k, line): (usize, &str)| {
            let mut fields: Vec<&str> = line.split(',').collect();
            if lines.contains(&(k + 1)) {
                fields[1] = "";
            }
            fields.join(",") + "\n"
        };
        text.lines().enumerate().map(without).collect::<String>()
    };
    for (lines, code, expected) in [
        (
            &[5][..],
            0,
            "`s1.csv`: line 5, column `volt_mV` of the input `u`: a sample is missing and filled from the neighbours",
        ),
        (&[2], 1, "`s1.csv`: line 2, column `volt_mV` of the input `u`: the first sample is missing"),
        (&[202], 1, "`s1.csv`: line 202, column `volt_mV` of the input `u`: the last sample is missing"),
        (&[7, 8, 9], 1, "`s1.csv`: line 7, column `volt_mV` of the input `u`: 3 samples in a row are missing"),
    ] {
        let folder = folder(false, 0);
        folder.write("s1.csv", gap(lines));
        let outcome = fit(&folder, &[]);
        assert_eq!(outcome.code, Some(code), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(expected), "{lines:?}: {}", outcome.stderr);
    }
}

#[test]
fn an_input_that_nothing_drives_is_told() {
    let folder = folder(false, 0);
    let (before, after) = STUDY.split_once("[inputs]\n").unwrap();
    let (_, after) = after.split_once('\n').unwrap();
    folder.write("st.toml", format!("{before}{after}"));
    let outcome = fit(&folder, &[]);
    let expected = "`u` is an input of the model without a column in `[inputs]` of the study: it keeps its start value in all shots";
    assert!(outcome.stderr.contains(expected) && !outcome.stderr.contains("`b`"), "{}", outcome.stderr);
}

#[test]
fn inputs_that_the_equations_cannot_use_are_refused() {
    let folder = folder(false, 0);
    folder.write("m.hyd", "model M\n  input Real u; parameter Real T = 1; parameter Real K = 1;\n  Real x; Real v;\nequation\n  x = K*u; der(x) = v*T;\nend M;\n");
    folder.write("st.toml", STUDY.replace("offset = 50 }", "offset = 50, hold = \"zero\" }"));
    let outcome = fit(&folder, &[]);
    let expected = "line 7 of the study: the equations need the derivative of the input `u`";
    assert!(outcome.code == Some(1) && outcome.stderr.contains(expected), "{}", outcome.stderr);
    folder.write("m.hyd", "model M\n  input Real u[2]; parameter Real T = 1; parameter Real K = 1;\n  Real x = K*u[1] + T*u[2];\nend M;\n");
    folder.write("st.toml", STUDY.replace("u = {", "\"u[2]\" = {"));
    let outcome = fit(&folder, &[]);
    let expected = "line 7 of the study: the input `u` is recorded in part: `u[1]` has no column";
    assert!(outcome.code == Some(1) && outcome.stderr.contains(expected), "{}", outcome.stderr);
}

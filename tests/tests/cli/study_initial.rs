//! `[initial]` and `windows` of studies: fits whose shots begin in a state of their own, and what is said of states that cannot.
//!
//! The record is the exact solution of a damped oscillator set free, `x = a exp(-d t) cos(w t + p)`, with noise from a fixed sequence.

use std::fmt::Write as _;

use crate::process::{Outcome, Scratch, run};

/// The truth: damping (1/s), angular frequency (rad/s), amplitude and phase.
const D: f64 = 0.11;
const W: f64 = 6.0;
const A: f64 = 0.8;
const P: f64 = 0.4;
/// Samples, their distance (s), and the standard deviation of their noise.
const SAMPLES: usize = 1600;
const STEP: f64 = 0.01;
const NOISE: f64 = 1e-3;

const MODEL: &str = "model M
  parameter Real k = 30;
  parameter Real c = 0.5;
  Real x(start = 0, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(x) = v;
  der(v) = -k*x - c*v;
end M;
";
const STUDY: &str = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\nx_mm = { variable = \"x\", scale = 1e3 }\n[initial]\n\
    x = { value = \"first_x_mm\", absolute = 0.02 }\nv = { value = \"slope_x_mm\", absolute = 1 }\n[nuisances]\n\
    k = { parameter = \"k\", relative = 0.5 }\nc = { parameter = \"c\", relative = 2 }\n";
const SET: &str = "{\"noise_std\": {\"x_mm\": 1}, \"experiments\": [{\"file\": \"s.csv\"}]}";

fn folder() -> Scratch {
    let folder = Scratch::new();
    let mut state = 20_261_u64;
    let mut draw = || {
        state = state * 48_271 % 2_147_483_647;
        state as f64 / 2_147_483_647.0
    };
    let mut text = String::from("time_s,x_mm\n");
    for k in 0..SAMPLES {
        let t = STEP * k as f64;
        let noise = NOISE * ((0..12).map(|_| draw()).sum::<f64>() - 6.0);
        writeln!(text, "{t},{}", 1e3 * (A * (-D * t).exp() * (W * t + P).cos() + noise)).unwrap();
    }
    folder.write("m.hyd", MODEL);
    folder.write("st.toml", STUDY);
    folder.write("set.json", SET);
    folder.write("s.csv", text);
    folder
}

fn fit(folder: &Scratch) -> Outcome {
    run(folder.path(), &["fit", "st.toml", "--bench", "set.json", "--json"])
}

/// Relative errors of stiffness and damping, the gaps of fitted and held-out shots, and what the fit says beside.
fn errors(folder: &Scratch) -> ([f64; 2], [f64; 2], String) {
    let (found, json, said) = fitted(folder);
    let gap = ["train", "heldout"].map(|key| json["gap"][key]["all"].as_f64().unwrap());
    (found, gap, said)
}

/// The same where no shot is held out.
fn errors_of_all(folder: &Scratch) -> ([f64; 2], f64, String) {
    let (found, json, said) = fitted(folder);
    (found, json["gap"]["train"]["all"].as_f64().unwrap(), said)
}

fn fitted(folder: &Scratch) -> ([f64; 2], serde_json::Value, String) {
    let outcome = fit(folder);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let json: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let value = |name: &str, nominal: f64| {
        let unknown = json["unknowns"].as_array().unwrap().iter().find(|unknown| unknown["name"] == name).unwrap();
        nominal * unknown["value"].as_f64().unwrap()
    };
    let found = [value("k", 30.0) / (W * W + D * D) - 1.0, value("c", 0.5) / (2.0 * D) - 1.0];
    (found.map(f64::abs), json, outcome.stderr)
}

#[test]
fn one_record_is_cut_into_windows_with_states_of_their_own() {
    let folder = folder();
    let (found, gap, said) = errors(&folder);
    assert!(said.contains("`s.csv` is cut into 8 windows, the shots 1 to 8, of about 1.99 s"), "{said}");
    assert!(found[0] < 1e-3 && found[1] < 0.03, "{found:?}");
    assert!(gap.iter().all(|gap| (gap - 1.0).abs() < 0.06), "{gap:?}");
    assert!(said.contains("which take up what changes slowly over several of them"), "{said}");
    assert!(!said.contains("each of them as the model says") && !said.contains("the formula has to undo it"), "{said}");
    // The clock counts from elsewhere: the states are those of the first sample, and not of 0.
    let late = |line: &str| match line.split_once(',') {
        Some((t, x)) => t.parse::<f64>().map_or(format!("{line}\n"), |t| format!("{},{x}\n", t + 3.0)),
        None => String::new(),
    };
    let table = folder.read("s.csv");
    folder.write("s.csv", table.lines().map(late).collect::<String>());
    folder.write("st.toml", format!("{STUDY}[shots]\nwindows = 1\n"));
    let (found, gap, _) = errors_of_all(&folder);
    assert!(found[0] < 1e-3 && found[1] < 0.03 && (gap - 1.0).abs() < 0.06, "{found:?} {gap}");
    folder.write("s.csv", table);
    // Held out are windows all along the record, whose states are found by their own samples.
    folder.write("st.toml", format!("{STUDY}[shots]\nwindows = 3\nhold_out = [2]\n"));
    let (found, gap, said) = errors(&folder);
    assert!(said.contains("is cut into 3 windows"), "{said}");
    assert!(found[0] < 1e-3 && found[1] < 0.03 && gap.iter().all(|gap| (gap - 1.0).abs() < 0.06), "{found:?} {gap:?}");
}

/// The same record, with the states as the elements of an array.
#[test]
fn elements_of_an_array_begin_all_or_none() {
    let folder = folder();
    let model = MODEL.replace(
        "  Real x(start = 0, fixed = true);\n  Real v(start = 0, fixed = true);",
        "  Real s[2](each start = 0, each fixed = true);",
    );
    let model =
        model.replace("der(x) = v", "der(s[1]) = s[2]").replace("der(v) = -k*x - c*v", "der(s[2]) = -k*s[1] - c*s[2]");
    folder.write("m.hyd", model);
    let study = STUDY.replace("variable = \"x\"", "variable = \"s[1]\"").replace("\nx = ", "\n\"s[1]\" = ");
    let whole = study.replace("\nv = ", "\n\"s[2]\" = ");
    folder.write("st.toml", &whole);
    let (found, gap, _) = errors(&folder);
    assert!(found[0] < 1e-3 && found[1] < 0.03, "{found:?}");
    assert!(gap.iter().all(|gap| (gap - 1.0).abs() < 0.06), "{gap:?}");
    folder.write(
        "st.toml",
        study.replace("v = { value = \"slope_x_mm\", absolute = 1 }\n", "").replace("s[1]\" =", "s[2]\" ="),
    );
    let said = fit(&folder).stderr;
    let expected = "`s[2]` is an element of the array `s`, of which all elements must begin somewhere: 1 of 2 do";
    assert!(said.contains(expected), "{said}");
    folder.write(
        "st.toml",
        whole.replace("\"s[2]\" = { value = \"slope_x_mm\", absolute = 1 }", "\"s[2]\" = { at_rest = true }"),
    );
    let said = fit(&folder).stderr;
    assert!(said.contains("of the array `s` all elements are at rest at the beginning, or none is"), "{said}");
    folder.write("st.toml", study.replace("s[1]\" =", "s[i]\" ="));
    assert!(fit(&folder).stderr.contains("`s[i]` is not the name of a variable"));
}

#[test]
fn states_that_nobody_sets_and_starts_of_other_quantities_are_said() {
    let folder = folder();
    folder.write("st.toml", STUDY.replace("v = { value = \"slope_x_mm\", absolute = 1 }\n", ""));
    let said = fit(&folder).stderr;
    assert!(said.contains("the record is cut into windows, and `v` begins each of them as the model says"), "{said}");
    folder.write("st.toml", STUDY.replace("variable = \"x\"", "variable = \"x + 0.1\""));
    let said = fit(&folder).stderr;
    let expected = "line 7 of the study: the state `x` begins at `first_x_mm`, but that channel shows `x + 0.1`: if the two differ";
    assert!(said.contains(expected), "{said}");
}

/// The speed is read 40 times a second by a clock of its own, beside the position; or there is no column of times at all.
#[test]
fn channels_have_clocks_of_their_own_or_a_rate() {
    let folder = folder();
    let table = folder.read("s.csv");
    let speed = |k: usize| {
        let t = 0.025 * k as f64;
        -A * (-D * t).exp() * (D * (W * t + P).cos() + W * (W * t + P).sin())
    };
    let side_by_side = |(k, line): (usize, &str)| match k {
        0 => format!("{line},slow,v\n"),
        k if k <= 640 => {
            format!("{line},{},{}\n", 0.025 * (k - 1) as f64, speed(k - 1) + 1e-3 * f64::from(k as u32 % 5) - 2e-3)
        }
        _ => format!("{line},,\n"),
    };
    folder.write("s.csv", table.lines().enumerate().map(side_by_side).collect::<String>());
    let both = STUDY.replace("x_mm = {", "v = { variable = \"v\", time = \"slow\", noise = 1.42e-3 }\nx_mm = {");
    folder.write("st.toml", &both);
    let (found, gap, _) = errors(&folder);
    assert!(found[0] < 1e-3 && found[1] < 0.03, "{found:?}");
    assert!(gap.iter().all(|gap| (gap - 1.0).abs() < 0.06), "{gap:?}");
    // Read by the clock of the position the speed would be another one.
    folder.write("st.toml", both.replace("time = \"slow\", ", ""));
    assert!(errors(&folder).1[0] > 10.0);
    folder.write("st.toml", both.replace("\"slow\"", "\"slo\""));
    let outcome = fit(&folder);
    let expected = "there is no column `slo` of times; there are: time_s, x_mm, slow, v; did you mean `slow`?";
    assert!(outcome.code == Some(1) && outcome.stderr.contains(expected), "{}", outcome.stderr);
    let bare: String = table.lines().map(|line| line.split_once(',').unwrap().1.to_string() + "\n").collect();
    folder.write("s.csv", bare);
    folder.write("st.toml", format!("{STUDY}[shots]\nrate = 100\n"));
    let (found, gap, _) = errors(&folder);
    assert!(found[0] < 1e-3 && found[1] < 0.03 && (gap[0] - 1.0).abs() < 0.06, "{found:?} {gap:?}");
    // One of eight windows masked: its samples are gone, the others are fitted as before.
    folder.write(
        "st.toml",
        format!("{STUDY}[shots]\nrate = 100\nmasks = [{{ shots = [4], from = 0 }}, {{ shots = [9], from = 0 }}]\n"),
    );
    let (_, _, said) = errors(&folder);
    assert!(said.matches("the mask leaves out no sample of any shot").count() == 1, "{said}");
}

#[test]
fn a_state_at_rest_begins_where_its_derivative_is_zero() {
    let folder = folder();
    // The same record as the way from where a constant force holds it: the spring is relaxed by `x0` at the first sample.
    folder.write(
        "m.hyd",
        MODEL.replace(
            "equation",
            "  parameter Real F = 0; Real z(start = 5, fixed = true);\nequation\n  der(z) = F - z;",
        ),
    );
    folder.write(
        "st.toml",
        format!(
            "{}[conditions]\nF = \"force\"\n",
            STUDY
                .replace("[nuisances]", "z = { at_rest = true }\n[nuisances]")
                .replace("x_mm = {", "z = { variable = \"z\", noise = 1e-3 }\nx_mm = {")
        ),
    );
    folder.write("set.json", SET.replace("\"s.csv\"", "\"s.csv\", \"force\": 2.5"));
    let table = std::fs::read_to_string(folder.path().join("s.csv")).unwrap();
    let table: String = table.lines().enumerate().fold(String::new(), |mut text, (k, line)| {
        let z = if k == 0 { "z".to_string() } else { (2.5 + 1e-3 * f64::from(k as u32 % 7) - 3e-3).to_string() };
        writeln!(text, "{line},{z}").unwrap();
        text
    });
    folder.write("s.csv", table);
    let (_, gap, _) = errors(&folder);
    assert!(gap[0] < 2.5, "{gap:?}");
}

#[test]
fn what_does_not_fit_is_said_with_its_line() {
    let folder = folder();
    for (old, new, expected) in [
        ("first_x_mm", "first_y", "line 7 of the study: shot 1: the formula `first_y` cannot be evaluated"),
        (
            "x = { value = \"first_x_mm\", absolute = 0.02 }",
            "x = { value = \"first_x_mm\", absolut = 1 }",
            "line 7: unknown field `absolut`",
        ),
        (
            "x = { value = \"first_x_mm\", absolute = 0.02 }",
            "x = { at_rest = true, value = \"1\" }",
            "line 7: `x` begins at a `value` or `at_rest = true`",
        ),
        (
            "x = { value = \"first_x_mm\", absolute = 0.02 }",
            "\"x[2]\" = \"1\"",
            "line 7: `x[2]` is an element of the array `x`",
        ),
        ("x = { value = \"first_x_mm\", absolute = 0.02 }", "y = \"1\"", "`y`"),
        (
            "[nuisances]",
            "[shots]\nwindows = 100\n[nuisances]",
            "line 10 of the study: `s.csv` has 1600 rows, too few for 100 windows of at least 20",
        ),
        (
            "[nuisances]",
            "[shots]\nrate = 5\ntime = \"t\"\n[nuisances]",
            "line 10: `rate` is for tables without a column of times",
        ),
        ("[nuisances]", "[shots]\nwindows = 0\n[nuisances]", "line 10: `windows` is 0, and must be 1 to 10000"),
        (
            "[nuisances]",
            "[run]\nstart = 0\n[shots]\nwindows = 4\n[nuisances]",
            "line 10: a window begins with its first sample",
        ),
    ] {
        folder.write("st.toml", STUDY.replace(old, new));
        let outcome = fit(&folder);
        assert!(
            outcome.code == Some(1) && outcome.stderr.contains(expected),
            "{new}: {:?}\n{}",
            outcome.code,
            outcome.stderr
        );
    }
}

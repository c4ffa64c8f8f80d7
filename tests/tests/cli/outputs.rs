//! Results that cannot be written, readers that go away, and Ctrl-C: never half a file under a whole one's name.

use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::process::{Scratch, assert_no_panic, command, run, wait};

const DECAY: &str = "model Decay\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -x;\nend Decay;\n";
/// Takes as long as one likes: 160 periods in a second.
const OSCILLATOR: &str = "model Oscillator\n  Real x(start = 1, fixed = true);\n  Real y(start = 0, fixed = true);\n\
                          equation\n  der(x) = 1e3*y;\n  der(y) = -1e3*x;\nend Oscillator;\n";

fn decay() -> Scratch {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    folder
}

/// Simulates with `option` and expects the exit code, and a message that names the place; nothing may be left behind.
#[track_caller]
fn refused(option: &str, place: &str, code: i32) {
    let folder = decay();
    let outcome = run(folder.path(), &["simulate", "decay.hyd", option, place]);
    assert_no_panic(&outcome);
    assert_eq!(outcome.code, Some(code), "{}", outcome.stderr);
    assert!(outcome.stderr.contains(&format!("`{place}`")), "{}", outcome.stderr);
    assert_eq!(folder.names(), ["decay.hyd"]);
    assert_eq!(folder.read("decay.hyd"), DECAY);
}

#[test]
fn places_that_cannot_be_written_are_named() {
    refused("--result", "none/r.csv", 1);
    refused("--result", "decay.hyd/r.csv", 1);
    refused("--result", ".", 1);
    refused("--plot", "none/p.svg", 1);
    refused("--plot", "decay.hyd/p.png", 1);
    refused("--plot", "p.jpg", 2);
    refused("--result", "r.xyz", 2);
}

#[test]
fn a_result_never_replaces_the_model() {
    refused("--result", "decay.hyd", 2);
    refused("--result", "./decay.hyd", 2);
    refused("--result", "other.mo", 2);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    refused("--result", "/dev/full", 1);
    let folder = decay();
    for arguments in [&["simulate", "decay.hyd"][..], &["equations", "decay.hyd", "--stage", "flat"], &["explain"]] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = command(folder.path(), arguments).stdout(full).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(said.contains("cannot write to standard output"), "{said}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let folder = decay();
    for arguments in [&["simulate", "decay.hyd"][..], &["equations", "decay.hyd", "--stage", "flat"], &["explain"]] {
        let mut child =
            command(folder.path(), arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let status = wait(&mut child, arguments);
        let output = child.wait_with_output().unwrap();
        assert_eq!(status.code(), Some(0), "{arguments:?}");
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{arguments:?}");
    }
}

#[test]
fn a_run_that_fails_keeps_what_it_computed_under_another_name() {
    let folder = Scratch::new();
    folder.write("r.csv", "older results\n");
    folder.write(
        "escape.hyd",
        "model Escape\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = x^2;\nend Escape;\n",
    );
    let outcome = run(folder.path(), &["simulate", "escape.hyd", "--stop", "2", "--result", "r.csv"]);
    assert_eq!(outcome.code, Some(3), "{}", outcome.stderr);
    assert_eq!(folder.names(), ["escape.hyd", "r.csv", "r.partial.csv"]);
    assert_eq!(folder.read("r.csv"), "older results\n");
    let rows = rows(&folder.read("r.partial.csv"));
    // x = 1/(1 - t)
    for (t, x) in rows.iter().filter(|(t, _)| *t < 0.9) {
        assert!((x * (1.0 - t) - 1.0).abs() < 1e-3, "{t} {x}");
    }
    assert!(rows.last().unwrap().0 > 0.9);
}

/// Of the variables of the translation only unknowns: each derivative once, no sums of sums.
#[test]
fn a_summary_says_how_much_it_leaves_out() {
    let folder = Scratch::new();
    folder.write(
        "m.hyd",
        "model M\n  Real x[100];\nequation\n  for k in 1:100 loop\n    x[k] = k*time;\n  end for;\nend M;\n",
    );
    let said = |rest: &[&str]| run(folder.path(), &[&["simulate", "m.hyd"], rest].concat()).stdout;
    let few = said(&[]);
    assert!(few.ends_with("x[100]             100\n  ... and 97 more; `--variables REGEX` chooses\n"), "{few}");
    assert!(!said(&["--variables", "x"]).contains("more"));
}

#[test]
fn a_result_has_the_columns_of_the_text() {
    let folder = Scratch::new();
    let sum = "  Real s;\n  Real p[100];\n";
    for (name, declared, equations, expected) in [
        ("order", "", "  der(der(x)) = -x;\n", "time,x,der(x),der(der(x))"),
        (
            "reduced",
            "  Real v;\n  Real a;\n",
            "  der(x) = v;\n  der(v) = a;\n  x = cos(time);\n",
            "time,x,v,a,der(x),der(v),der(der(x))",
        ),
        // The derivative is differentiated by the text, and freed by the reduction of the index.
        ("twice", "  Real h;\n", "  x = sin(time) + 1;\n  h = der(der(x^2));\n", "time,x,h,der(x),der(der(x))"),
        ("sum", sum, "  der(x) = -s;\n  p = (1:100)*x;\n  s = sum(p);\n", "time,x,s,der(x)"),
    ] {
        let model = format!("model M\n  Real x(start = 1, fixed = true);\n{declared}equation\n{equations}end M;\n");
        folder.write("m.hyd", model);
        let result = run(folder.path(), &["simulate", "m.hyd", "--intervals", "1", "--result", "r.csv"]);
        assert_eq!(result.code, Some(0), "{name}: {}", result.stderr);
        let text = folder.read("r.csv");
        let columns = text.lines().next().unwrap().split(',').filter(|column| !column.starts_with("p["));
        assert_eq!(columns.collect::<Vec<_>>().join(","), expected, "{name}");
        let (_, summary) = result.stdout.split_once("values at 1 s").unwrap();
        let mut shown: Vec<&str> = summary.lines().filter_map(|line| line.split_whitespace().next()).collect();
        let all = shown.len();
        shown.sort_unstable();
        shown.dedup();
        assert_eq!(shown.len(), all, "{name}: {summary}");
    }
}

#[test]
fn formats_hold_the_same_values_and_compare_says_so() {
    let folder = decay();
    for name in ["r.csv", "r.mat", "r.parquet"] {
        let outcome = run(folder.path(), &["simulate", "decay.hyd", "--result", name]);
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    }
    let other = shifted(&folder);
    for (a, b) in [("r.csv", "r.mat"), ("r.mat", "r.parquet"), ("r.parquet", "r.csv")] {
        let same = run(folder.path(), &["compare", a, b, "--tolerance", "0"]);
        assert_eq!((same.code, same.stderr.as_str()), (Some(0), ""), "{}", same.stdout);
        // `y` does not change: a constant in MAT, a column elsewhere.
        assert!(same.stdout.starts_with("variable"), "{}", same.stdout);
        assert!(!same.stdout.contains("only in") && same.stdout.contains("2 variables compared"), "{}", same.stdout);
    }
    folder.write("text.parquet", "no Parquet file");
    let broken = run(folder.path(), &["compare", "text.parquet", "r.csv"]);
    assert!(broken.code == Some(1) && broken.stderr.contains("`text.parquet`: "), "{}", broken.stderr);
    let different = run(folder.path(), &["compare", "r.mat", &other, "--json"]);
    assert_eq!(different.code, Some(1), "{}", different.stderr);
    let found: serde_json::Value = serde_json::from_str(&different.stdout).unwrap();
    let worst = &found["variables"][0];
    // 1.01 exp(-t) against exp(-t): at most 0.01, at the start; the window of time takes 1e-4 of it away.
    assert_eq!((worst["name"].as_str(), worst["time"].as_f64()), (Some("x"), Some(0.0)));
    assert!((worst["deviation"].as_f64().unwrap() - 0.01).abs() < 2e-4, "{worst}");
    let nothing = run(folder.path(), &["compare", "r.csv", "decay.hyd"]);
    assert_eq!(nothing.code, Some(1));
}

/// The same result with all values of `x` one percent larger.
fn shifted(folder: &Scratch) -> String {
    let text = folder.read("r.csv");
    let lines = text.lines().enumerate().map(|(k, line)| {
        let cells: Vec<f64> = line.split(',').filter_map(|cell| cell.parse().ok()).collect();
        if k == 0 { line.to_string() } else { format!("{},{},{}", cells[0], 1.01 * cells[1], 1.01 * cells[2]) }
    });
    folder.write("shifted.csv", lines.collect::<Vec<_>>().join("\n"));
    "shifted.csv".to_string()
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_whole_rows() {
    let folder = Scratch::new();
    folder.write("oscillator.hyd", OSCILLATOR);
    let arguments = ["simulate", "oscillator.hyd", "--stop", "1e7", "--intervals", "100000000", "--result", "r.csv"];
    let mut child = command(folder.path(), &arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until(|| folder.names().iter().any(|name| name.ends_with(".part")));
    std::thread::sleep(Duration::from_millis(500));
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    assert_eq!(wait(&mut child, &arguments).code(), Some(3));
    assert_eq!(folder.names(), ["oscillator.hyd", "r.partial.csv"]);
    let text = folder.read("r.partial.csv");
    assert!(text.ends_with('\n'));
    let rows = rows(&text);
    assert!(rows.len() > 2 && rows.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    assert!(rows[0] == (0.0, 1.0), "{:?}", rows[0]);
    let said = String::from_utf8(child.wait_with_output().unwrap().stderr).unwrap();
    assert!(said.contains("interrupted"), "{said}");
}

fn wait_until(mut done: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !done() {
        assert!(begin.elapsed() < Duration::from_secs(60), "nothing happens");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Time and first variable of every row; every row must be complete.
fn rows(text: &str) -> Vec<(f64, f64)> {
    let columns = text.lines().next().unwrap().split(',').count();
    let row = |line: &str| {
        let values: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(values.len(), columns, "{line}");
        (values[0], values[1])
    };
    text.lines().skip(1).map(row).collect()
}

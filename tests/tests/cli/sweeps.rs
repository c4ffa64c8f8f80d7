//! Many runs: the same numbers as single runs, however they are cut into shards, killed and begun again.

use std::process::Stdio;
use std::time::Duration;

use hyd_frames::{Cells, Frame};

use crate::process::{Scratch, assert_no_panic, command, run};

/// x(1) = a exp(-b); escapes before the end where b < -1 (x' = x^2 then).
const MODEL: &str = "model Decay\n  parameter Real a = 1;\n  parameter Real b = 1;\n  parameter Integer n = 2;\n  \
                     Real x(start = a, fixed = true);\n  Real y[n];\nequation\n  der(x) = if b < -1 then x^2*4 else -b*x;\n  \
                     for k in 1:n loop\n    y[k] = k*x;\n  end for;\nend Decay;\n";

fn folder() -> Scratch {
    let folder = Scratch::new();
    folder.write("decay.hyd", MODEL);
    folder
}

fn sweep(folder: &Scratch, arguments: &[&str]) -> String {
    let (stdout, stderr) = said(folder, arguments);
    assert_eq!(stderr, "");
    stdout
}

/// What a sweep of which not all runs fail says.
fn said(folder: &Scratch, arguments: &[&str]) -> (String, String) {
    let outcome = run(folder.path(), &[&["sweep", "decay.hyd"], arguments].concat());
    assert_no_panic(&outcome);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    (outcome.stdout, outcome.stderr)
}

fn numbers(frame: &Frame, name: &str) -> Vec<f64> {
    match frame.column(name) {
        Some(Cells::Numbers(values)) => values.clone(),
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn a_member_is_what_a_single_run_gives() {
    let folder = folder();
    sweep(&folder, &["--vary", "a=1:2:3", "--vary", "b=0.5,1", "--rows", "--intervals", "5", "--result", "s"]);
    let members = Frame::read(&folder.path().join("s/members.parquet")).unwrap();
    assert_eq!(numbers(&members, "a"), [1.0, 1.0, 1.5, 1.5, 2.0, 2.0]);
    assert_eq!(numbers(&members, "b"), [0.5, 1.0, 0.5, 1.0, 0.5, 1.0]);
    let closed = |(a, b): (f64, f64)| a * (-b).exp();
    let ends = numbers(&members, "a").into_iter().zip(numbers(&members, "b")).map(closed);
    for (x, expected) in numbers(&members, "x").into_iter().zip(ends) {
        assert!((x - expected).abs() < 1e-5, "{x} {expected}");
    }
    let single = ["simulate", "decay.hyd", "--set", "a=1.5", "--set", "b=1", "--intervals", "5", "--result", "r.csv"];
    assert_eq!(run(folder.path(), &single).code, Some(0));
    let rows = Frame::read(&folder.path().join("s/rows.parquet")).unwrap();
    let Some(Cells::Wholes(of)) = rows.column("member") else { panic!() };
    let text = folder.read("r.csv");
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let table: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    for (k, name) in names.iter().enumerate() {
        let all = numbers(&rows, name);
        let own: Vec<f64> = all.iter().zip(of).filter(|(_, member)| **member == 3).map(|(value, _)| *value).collect();
        assert_eq!(own, table.iter().map(|row| row[k]).collect::<Vec<_>>(), "{name}");
    }
}

#[test]
fn shards_and_interruptions_change_nothing() {
    let folder = folder();
    let varied = ["--vary", "a=uniform(1, 2)", "--vary", "b=normal(1, 0.2)", "--samples", "150", "--seed", "5"];
    let with = |rest: &[&'static str]| [&varied[..], rest].concat();
    sweep(&folder, &with(&["--result", "whole"]));
    let whole = std::fs::read(folder.path().join("whole/members.parquet")).unwrap();

    for shard in ["2/3", "0/3", "1/3"] {
        sweep(&folder, &[&with(&["--result", "parts", "--threads", "1", "--shard"])[..], &[shard]].concat());
    }
    let merged = run(folder.path(), &["sweep", "merge", "parts"]);
    assert_eq!(merged.code, Some(0), "{}", merged.stderr);
    assert!(std::fs::read(folder.path().join("parts/members.parquet")).unwrap() == whole);

    // Killed at some moment, then begun again: the same file, and what was done is not done twice.
    let arguments = [&["sweep", "decay.hyd"], &with(&["--result", "killed", "--threads", "1"])[..]].concat();
    for pause in [20, 60, 100] {
        let mut child = command(folder.path(), &arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(pause));
        let _ = child.kill();
        child.wait().unwrap();
    }
    sweep(&folder, &with(&["--result", "killed"]));
    assert!(std::fs::read(folder.path().join("killed/members.parquet")).unwrap() == whole);
    let again = sweep(&folder, &with(&["--result", "killed"]));
    assert!(again.starts_with("150 of 150 runs done, 150 of them before; 0 failed\n"), "{again}");
}

#[test]
fn a_member_that_fails_is_a_row_that_says_so() {
    let folder = folder();
    let (counted, reason) = said(&folder, &["--vary", "b=1,-2,2", "--result", "s"]);
    assert!(counted.starts_with("3 of 3 runs done; 1 failed\n"), "{counted}");
    assert!(reason.starts_with("warning: 1 run failed\nnote: member 1: "), "{reason}");
    let members = Frame::read(&folder.path().join("s/members.parquet")).unwrap();
    let Some(Cells::Texts(status)) = members.column("status") else { panic!() };
    assert_eq!(status, &["done", "failed", "done"]);
    // x' = 4 x^2 from 1 escapes at t = 1/4.
    let times = numbers(&members, "time");
    assert!((times[1] - 0.25).abs() < 1e-3 && times[2] == 1.0, "{times:?}");
}

/// What `--set` refuses fails a run, with the same words: a listed value, a drawn one, and one that follows from what varies.
#[test]
fn a_value_outside_its_limits_fails_its_run() {
    let folder = Scratch::new();
    let text = "model Limited\n  type Mode = enumeration(slow, fast, off);\n  parameter Real k(min = 0) = 1;\n  \
                parameter Real m(max = 10) = 2*k;\n  parameter Mode e(max = Mode.fast) = Mode.slow;\n  \
                Real x(start = 1, fixed = true);\nequation\n  der(x) = -(k + m + (if e == Mode.fast then 1 else 0))*x;\n\
                end Limited;\n";
    folder.write("limited.hyd", text);
    let messages = |vary: &str, rest: &[&str]| {
        let arguments = [&["sweep", "limited.hyd", "--vary", vary, "--result", "s"], rest].concat();
        let outcome = run(folder.path(), &arguments);
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        let members = Frame::read(&folder.path().join("s/members.parquet")).unwrap();
        std::fs::remove_dir_all(folder.path().join("s")).unwrap();
        match members.column("message") {
            Some(Cells::Texts(messages)) => messages.clone(),
            other => panic!("{other:?}"),
        }
    };
    let cases = [
        ("k=-5,5,6", ["`k` is -5, below its `min` 0", "", "`m` is 12, above its `max` 10"]),
        ("e=1,2,3", ["", "", "`e` is `off`, above its `max` `fast`"]),
        ("e=slow,fast,off", ["", "", "`e` is `off`, above its `max` `fast`"]),
    ];
    for (vary, expected) in cases {
        assert_eq!(messages(vary, &[]), expected, "{vary}");
    }
    let drawn = messages("k=uniform(-1, 1)", &["--samples", "10"]);
    assert_eq!(drawn.iter().filter(|message| message.contains("below its `min` 0")).count(), 5, "{drawn:?}");
}

/// Where all runs fail, model or plan are wrong: who asks the exit code must see it, now and when the folder is called again.
/// What a member's equations leave open stands beside its results.
#[test]
fn variables_left_open_are_named_for_each_member() {
    let folder = Scratch::new();
    let pipe = "model Pipe\n  parameter Real idle = 1;\n  Real m = if time < idle then 0 else 2;\n  Real h(start = 2);\n\
                equation\n  m*(h - 3) = 0;\nend Pipe;\n";
    folder.write("pipe.hyd", pipe);
    let outcome = run(folder.path(), &["sweep", "pipe.hyd", "--vary", "idle=0,0.5", "--result", "s"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let members = Frame::read(&folder.path().join("s/members.parquet")).unwrap();
    let Some(Cells::Texts(messages)) = members.column("message") else { panic!("no messages") };
    assert_eq!(messages[0], "");
    assert!(messages[1].starts_with("`h` is not determined from t = 0 s to 0.5 s"), "{}", messages[1]);
}

#[test]
fn a_sweep_of_which_every_run_fails_is_an_error_with_its_reasons() {
    let folder = Scratch::new();
    let text = "model Limited\n  parameter Real k(min = 0) = 1;\n  Real x(start = 1, fixed = true);\nequation\n  \
                der(x) = -k*x;\nend Limited;\n";
    folder.write("limited.hyd", text);
    let all = "error: all 2 runs failed\nnote: 2 such as member 0: `k` is -1, below its `min` 0\n";
    for counted in ["2 of 2 runs done; 2 failed\n", "2 of 2 runs done, 2 of them before; 2 failed\n"] {
        let outcome = run(folder.path(), &["sweep", "limited.hyd", "--vary", "k=-1,-2", "--result", "s"]);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(1), all));
        assert!(outcome.stdout.starts_with(counted), "{}", outcome.stdout);
    }
    let outcome = run(folder.path(), &["sweep", "limited.hyd", "--vary", "k=-1,-2", "--result", "s", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let failures = serde_json::json!([{"count": 2, "member": 0, "message": "`k` is -1, below its `min` 0"}]);
    assert_eq!((outcome.code, &summary["failures"]), (Some(1), &failures));
    let outcome = run(folder.path(), &["sweep", "limited.hyd", "--vary", "k=-1,2,-3", "--result", "t"]);
    let some = "warning: 2 runs failed\nnote: 2 such as member 0: `k` is -1, below its `min` 0\n";
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), some));
}

/// Values have the names that the model gives them; what lies between two names is not a value.
#[test]
fn enumerations_and_truth_values_are_varied_by_name() {
    let folder = Scratch::new();
    let text = "model Named\n  type Mode = enumeration(slow, fast);\n  parameter Mode e = Mode.slow;\n  parameter Boolean on = true;\n  \
                Real x = (if e == Mode.fast then 10 else 1) + (if on then 2 else 0);\nend Named;\n";
    folder.write("named.hyd", text);
    let swept = |vary: &[&str]| run(folder.path(), &[&["sweep", "named.hyd", "--result", "s"], vary].concat());
    let outcome = swept(&["--vary", "e=fast, slow", "--vary", "on=false,true"]);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""));
    let members = Frame::read(&folder.path().join("s/members.parquet")).unwrap();
    assert_eq!(numbers(&members, "x"), [10.0, 12.0, 1.0, 3.0]);
    assert_eq!(numbers(&members, "e"), [2.0, 2.0, 1.0, 1.0]);
    std::fs::remove_dir_all(folder.path().join("s")).unwrap();
    let refused = [
        ("e=slow,warm", "error: values of `e`: `warm`: it is one of slow, fast\n"),
        ("e=1:2:2", "error: values of `e`: an enumeration takes neither grid nor distribution; list: slow,fast\n"),
        ("on=0:1:2", "error: values of `on`: a Boolean takes neither grid nor distribution; list: true,false\n"),
    ];
    for (vary, message) in refused {
        let outcome = swept(&["--vary", vary]);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(2), message));
        assert_eq!(folder.names(), ["named.hyd"]);
    }
}

#[test]
fn a_plan_says_the_same_as_the_options() {
    let folder = folder();
    folder.write(
        "plan.toml",
        "model = \"decay.hyd\"\nstop = 0.5\n[set]\na = \"3\"\n[[vary]]\nparameter = \"b\"\nvalues = \"0:1:4\"\n",
    );
    let outcome = run(folder.path(), &["sweep", "plan.toml", "--result", "by_plan"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    sweep(&folder, &["--set", "a=3", "--stop", "0.5", "--vary", "b=0:1:4", "--result", "by_options"]);
    let read = |name: &str| std::fs::read(folder.path().join(name).join("members.parquet")).unwrap();
    assert!(read("by_plan") == read("by_options"));
}

/// A file of parameters overrides the plan, and is overridden by what is set or varied one by one.
#[test]
fn a_sweep_takes_a_file_of_parameters() {
    let folder = folder();
    folder.write("p.toml", "a = 3.0\nb = 0.25\n");
    folder.write(
        "plan.toml",
        "model = \"decay.hyd\"\nset = { a = \"7\" }\nvary = [{ parameter = \"b\", values = \"0,1\" }]\n",
    );
    let ends = |arguments: &[&str], result: &str| {
        let all =
            [&["sweep"], arguments, &["--parameters", "p.toml", "--variables", "^x$", "--result", result]].concat();
        let outcome = run(folder.path(), &all);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""));
        numbers(&Frame::read(&folder.path().join(result).join("members.parquet")).unwrap(), "x")
    };
    let near = |found: &[f64], expected: &[f64]| {
        found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4)
    };
    let fell = |a: f64, b: f64| a * (-b).exp();
    let own = ends(&["decay.hyd", "--vary", "b=0,1"], "own");
    assert!(near(&own, &[3.0, fell(3.0, 1.0)]), "{own:?}");
    let own = ends(&["decay.hyd", "--vary", "a=1,2"], "of_the_file");
    assert!(near(&own, &[fell(1.0, 0.25), fell(2.0, 0.25)]), "{own:?}");
    let own = ends(&["decay.hyd", "--vary", "b=0,1", "--set", "a=2"], "set");
    assert!(near(&own, &[2.0, fell(2.0, 1.0)]), "{own:?}");
    let own = ends(&["plan.toml"], "plan");
    assert!(near(&own, &[3.0, fell(3.0, 1.0)]), "{own:?}");
    let outcome =
        run(folder.path(), &["sweep", "decay.hyd", "--vary", "b=0,1", "--parameters", "q.toml", "--result", "q"]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("q.toml"), "{}", outcome.stderr);
}

#[test]
fn what_cannot_be_done_is_refused_and_leaves_nothing() {
    let cases: [(&[&str], i32, &str); 10] = [
        (&["--vary", "a=1", "--variables", "^z"], 2, "error: no variable of the model matches `^z`"),
        (
            &["--vary", "a=1:5"],
            2,
            "error: `a` is drawn from a distribution; say how many samples, or write `1:5:COUNT`",
        ),
        (&["--vary", "a=1:5", "--samples", "0"], 2, "error: 0 samples make no run"),
        (&["--vary", "c=1:2:3"], 1, "error: the model has no parameter `c`"),
        (&["--vary", "n=1,2"], 1, "error: `n` cannot be varied: it decides sizes or structure"),
        (&["--vary", "x=1,2"], 1, "error: `x` cannot be varied: it is a variable, not a parameter"),
        (&["--vary", "a=uniform(0, 1)"], 2, "error: `a` is drawn from a distribution; say how many samples"),
        (&["--vary", "a=1", "--vary", "a=2"], 2, "error: `a` is varied twice"),
        (&["--vary", "a=1:2:x"], 2, "error: values of `a`: the count in `1:2:x`"),
        (&[], 2, "error: nothing is varied"),
    ];
    for (arguments, code, message) in cases {
        let folder = folder();
        let outcome = run(folder.path(), &[&["sweep", "decay.hyd", "--result", "s"], arguments].concat());
        assert_eq!(outcome.code, Some(code), "{}", outcome.stderr);
        assert!(outcome.stderr.starts_with(message), "{}", outcome.stderr);
        assert_eq!(folder.names(), ["decay.hyd"]);
    }
    let folder = folder();
    sweep(&folder, &["--vary", "a=1,2", "--result", "s"]);
    let other = run(folder.path(), &["sweep", "decay.hyd", "--vary", "a=1,3", "--result", "s"]);
    assert_eq!(other.code, Some(1));
    assert!(other.stderr.contains("holds another sweep"), "{}", other.stderr);
}

/// The chain `(2 + a)*x[i] - x[i - 1] - x[i + 1] = (a + 1)*exp(-t)`, solved by elimination from both ends' zeros.
fn chain(n: usize, a: f64, t: f64) -> Vec<f64> {
    let (mut pivots, mut rights) = (vec![2.0 + a], vec![(a + 1.0) * (-t).exp()]);
    for k in 1..n {
        pivots.push(2.0 + a - 1.0 / pivots[k - 1]);
        rights.push((a + 1.0) * (-t).exp() + rights[k - 1] / pivots[k - 1]);
    }
    let mut x = vec![0.0; n];
    for k in (0..n).rev() {
        x[k] = (rights[k] + x.get(k + 1).copied().unwrap_or(0.0)) / pivots[k];
    }
    x
}

/// Members whose loop becomes a recurrence that grows are run again with the loop whole, on whatever thread and in whatever share; the
/// user is told once.
#[test]
fn a_member_whose_loop_lets_errors_grow_is_run_again() {
    let folder = Scratch::new();
    let text = hyd_tests::models::text_of("tests/cases/networks/late.hyd");
    let text = text.replace("parameter Integer n = 60;", "parameter Integer n = 60;\n  parameter Real large = 1000;");
    folder.write("late.hyd", text.replace("then 1000", "then large"));
    let swept = |name: &str, rest: &[&str]| {
        let all =
            [&["sweep", "late.hyd", "--vary", "large=0,1000,0.5,400", "--rows", "--intervals", "4"], rest].concat();
        let outcome = run(folder.path(), &[&all[..], &["--result", name]].concat());
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        outcome
    };
    let outcome = swept("s", &["--json"]);
    let said = "warning: a loop of equations could not be solved one variable after the other in 2 runs, which were done again with all variables of \
                the loops as unknowns of the solver\n";
    assert_eq!(outcome.stderr, said);
    let summary: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!((&summary["failed"], &summary["whole_loops"]), (&0.into(), &2.into()));
    let members = Frame::read(&folder.path().join("s/members.parquet")).unwrap();
    let rows = Frame::read(&folder.path().join("s/rows.parquet")).unwrap();
    let Some(Cells::Wholes(of)) = rows.column("member") else { panic!() };
    // Output points at 0, 0.25, .., 1 and two rows at the event.
    let counts: Vec<usize> = (0..4).map(|k| of.iter().filter(|&&member| member == k).count()).collect();
    assert!(counts.iter().all(|&count| count == counts[0]), "{counts:?}");
    for (member, a) in [0.0, 1000.0, 0.5, 400.0].into_iter().enumerate() {
        for (k, expected) in chain(60, a, 1.0).into_iter().enumerate() {
            let found = numbers(&members, &format!("x[{}]", k + 1))[member];
            assert!((found / expected - 1.0).abs() < 1e-5, "large = {a}, x[{}]: {found} instead of {expected}", k + 1);
        }
    }
    swept("t", &["--threads", "1"]);
    for file in ["members.parquet", "rows.parquet"] {
        let read = |name: &str| std::fs::read(folder.path().join(name).join(file)).unwrap();
        assert!(read("s") == read("t"), "{file}");
    }
}

/// A damped oscillator: x = exp(-d t) cos(w t) with w = 10, x(0) = 1 and x'(0) = -d; and what becomes true at 0.7 s.
const MEASURED: &str = "model Measured\n  parameter Real d = 0.5;\n  Real x(start = 1, fixed = true, unit = \"m\");\n  Real v;\n  \
                        Boolean late;\ninitial equation\n  v = -d*x;\nequation\n  der(x) = v;\n  \
                        der(v) = -2*d*v - (100 + d^2)*x;\n  late = time > 0.7;\nend Measured;\n";

#[test]
fn runs_are_measured_within_their_steps() {
    let folder = Scratch::new();
    folder.write("m.hyd", MEASURED);
    let asked =
        ["max(x)", "min(x)", "when(x < -0.5)", "when(x > 2)", "integral(x)", "when(late)", "max(x) - min(x)", "2*d"];
    let mut arguments = vec!["sweep", "m.hyd", "--vary", "d=0.5,1", "--tolerance", "1e-8", "--result", "s"];
    asked.iter().for_each(|text| arguments.extend(["--measure", text]));
    let outcome = run(folder.path(), &arguments);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{}", outcome.stderr);
    let members = Frame::read(&folder.path().join("s/members.parquet")).unwrap();
    let names: Vec<&str> = members.columns.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names[..5], ["member", "d", "status", "message", "time"]);
    assert_eq!(names[5..13], asked);
    for (k, d) in [0.5f64, 1.0].into_iter().enumerate() {
        let w = 10.0;
        let x = |t: f64| (-d * t).exp() * (w * t).cos();
        // x' = 0 where tan(w t) = -d/w: the first lowest point.
        let lowest = x((std::f64::consts::PI - (d / w).atan()) / w);
        // The first instant of x = -0.5, by halving between the zero and the lowest point.
        let (mut from, mut to) = (0.15f64, 0.3f64);
        (0..60).for_each(|_| {
            let middle = 0.5 * (from + to);
            if x(middle) > -0.5 { from = middle } else { to = middle }
        });
        // The integral of exp(-d t) cos(w t) over 1 s.
        let integral = (d + (-d).exp() * (w * w.sin() - d * w.cos())) / (d * d + w * w);
        let expected = [1.0, lowest, to, f64::NAN, integral, 0.7, 1.0 - lowest, 2.0 * d];
        for (name, expected) in asked.iter().zip(expected) {
            let value = numbers(&members, name)[k];
            assert!(
                (value - expected).abs() < 1e-6 || value.is_nan() && expected.is_nan(),
                "{name}: {value} {expected}"
            );
        }
    }
    let units = &members.metadata.iter().find(|(key, _)| key == "units").unwrap().1;
    let units: serde_json::Value = serde_json::from_str(units).unwrap();
    assert_eq!((&units["x"], &units["max(x)"], &units["when(x > 2)"]), (&"m".into(), &"m".into(), &"s".into()));
}

/// Of states alone nothing is evaluated within steps; they have the bits that they have beside other measures.
#[test]
fn measures_of_states_are_the_same_alone_and_beside_others() {
    let folder = Scratch::new();
    folder.write("m.hyd", MEASURED);
    let asked = ["max(x)", "min(v)", "when(x < -0.5)", "rms(x - 2*v)"];
    let measured = |result: &str, more: &[&str]| {
        let mut arguments = vec!["sweep", "m.hyd", "--vary", "d=0.5,1,2", "--result", result];
        asked.iter().chain(more).for_each(|text| arguments.extend(["--measure", text]));
        let outcome = run(folder.path(), &arguments);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{}", outcome.stderr);
        let members = Frame::read(&folder.path().join(result).join("members.parquet")).unwrap();
        asked.map(|name| numbers(&members, name).iter().map(|value| value.to_bits()).collect::<Vec<_>>())
    };
    assert_eq!(measured("alone", &[]), measured("beside", &["max(der(v))", "when(late)"]));
}

/// Measures cost no rows: those that are kept are the same with and without, and the folder knows what it holds.
#[test]
fn measures_leave_rows_alone_and_slips_are_refused() {
    let folder = Scratch::new();
    folder.write("m.hyd", MEASURED);
    let sweep = |rest: &[&str]| run(folder.path(), &[&["sweep", "m.hyd", "--vary", "d=0.5", "--rows"], rest].concat());
    assert_eq!(sweep(&["--result", "a", "--intervals", "7"]).code, Some(0));
    assert_eq!(sweep(&["--result", "b", "--intervals", "7", "--measure", "max(x)"]).code, Some(0));
    let rows = |name: &str| Frame::read(&folder.path().join(name).join("rows.parquet")).unwrap();
    let (a, b) = (rows("a"), rows("b"));
    assert_eq!(numbers(&a, "time"), numbers(&b, "time"));
    for (x, y) in numbers(&a, "x").iter().zip(numbers(&b, "x")) {
        assert!((x - y).abs() < 1e-9, "{x} {y}");
    }
    let other = sweep(&["--result", "a", "--intervals", "7", "--measure", "max(x)"]);
    assert!(other.code == Some(1) && other.stderr.contains("holds another sweep"), "{}", other.stderr);
    for (text, said) in [
        ("max(y)", "error: measure `max(y)`: the model has no variable `y`\n"),
        ("when(x)", "error: measure `when(x)`: `when` takes a condition, such as `y > 1`, or a Boolean variable\n"),
        ("max(x", "error: measure `max(x`: `)` is missing at the end\n"),
    ] {
        let refused = sweep(&["--result", "c", "--measure", text]);
        assert_eq!((refused.code, refused.stderr.as_str()), (Some(2), said));
    }
    assert!(!folder.path().join("c").exists());
}

/// Rows of a sweep are a family of curves with units and the values that were varied.
#[test]
fn rows_of_a_sweep_are_drawn_as_a_family() {
    let folder = Scratch::new();
    folder.write("m.hyd", MEASURED);
    let swept = run(folder.path(), &["sweep", "m.hyd", "--vary", "d=0.5:2:7", "--rows", "--result", "s"]);
    assert_eq!(swept.code, Some(0), "{}", swept.stderr);
    let drawn = run(folder.path(), &["plot", "s/rows.parquet", "--variables", "^(x|v)$"]);
    assert_eq!((drawn.code, drawn.stdout.as_str()), (Some(0), "picture in s/rows.svg\n"), "{}", drawn.stderr);
    let picture = folder.read("s/rows.svg");
    // Of seven members the legend names five; each variable has its panel with its unit.
    for label in ["d = 0.5<", "d = 2<", "[m]"] {
        assert!(picture.contains(label), "{label}");
    }
    assert_eq!(picture.matches("d = ").count(), 5);
    let compared = run(folder.path(), &["compare", "s/rows.parquet", "s/rows.parquet"]);
    assert_eq!(compared.code, Some(1));
    assert!(compared.stderr.contains("it holds the rows of a sweep, not one run"), "{}", compared.stderr);
}

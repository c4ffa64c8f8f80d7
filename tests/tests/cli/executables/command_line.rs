//! The command line of executables: help, parameters, files, habits of other tools, sweeps, refusals.

use std::fs;

use hyd_frames::{Cells, Frame};
use hyd_results::Table;

use super::scratch::{Scratch, messages, printed};

/// Decay with a known solution, sizes that are fixed at translation, limits.
const DECAY: &str = "model Decay \"Exponential decay\"
  parameter Real k(unit = \"1/s\", min = 0) = 1 \"Rate\";
  parameter Real x0 = 1 \"Start\";
  final parameter Real half = log(2)/k;
  parameter Boolean on = true;
  parameter Integer n = 2;
  parameter Real a[n] = fill(0, n);
  Real x(start = x0, fixed = true);
equation
  der(x) = if on then -k*x + sum(a) else 0;
  annotation(experiment(StopTime = 2, Tolerance = 1e-10));
end Decay;
";

fn built() -> Scratch {
    let scratch = Scratch::new();
    fs::write(scratch.file("decay.hyd"), DECAY).unwrap();
    let output = scratch.hyd(&["build", "decay.hyd", "-o", "decay"]);
    assert!(output.status.success(), "{}", messages(&output));
    fs::remove_file(scratch.file("decay.hyd")).unwrap();
    scratch
}

fn last(scratch: &Scratch, file: &str) -> (f64, f64) {
    let table = Table::read(&scratch.file(file)).unwrap();
    (*table.times.last().unwrap(), *table.column("x").unwrap().last().unwrap())
}

#[test]
fn options_and_habits_set_what_they_say() {
    let scratch = built();
    fs::write(scratch.file("p.toml"), "k = 2.0\nx0 = 3\na = [1, 1]\n").unwrap();
    // x' = -k x + s from x0: x = s/k + (x0 - s/k) exp(-k t).
    let x = |k: f64, x0: f64, s: f64, t: f64| s / k + (x0 - s / k) * (-k * t).exp();
    let cases: [(&[&str], f64, f64); 7] = [
        (&["--result", "r.csv"], 2.0, x(1.0, 1.0, 0.0, 2.0)),
        (&["--result", "r.csv", "--set", "k=0.5", "--stop", "1"], 1.0, x(0.5, 1.0, 0.0, 1.0)),
        (&["--result", "r.csv", "--parameters", "p.toml"], 2.0, x(2.0, 3.0, 2.0, 2.0)),
        (&["--result", "r.csv", "--parameters", "p.toml", "--set", "x0=5"], 2.0, x(2.0, 5.0, 2.0, 2.0)),
        (&["-r=r.csv", "-override", "k=3,x0=2,stopTime=0.5"], 0.5, x(3.0, 2.0, 0.0, 0.5)),
        (&["-r", "r.csv", "-stopTime=1", "-tolerance=1e-11", "-override=a[1]=4"], 1.0, x(1.0, 1.0, 4.0, 1.0)),
        (&["--result", "r.csv", "--set", "on=false"], 2.0, 1.0),
    ];
    for (arguments, time, value) in cases {
        let output = scratch.bare("decay", arguments);
        assert!(output.status.success(), "{arguments:?}: {}", messages(&output));
        let (end, found) = last(&scratch, "r.csv");
        assert_eq!(end, time);
        assert!((found - value).abs() < 1e-8 * value.abs(), "{arguments:?}: {found} instead of {value}");
    }
}

#[test]
fn help_lists_parameters_with_units_values_and_limits() {
    let scratch = built();
    let help = printed(&scratch.bare("decay", &["--help"]));
    assert!(help.starts_with("Simulates the model Decay: Exponential decay\n"), "{help}");
    let list = &help[help.find("Parameters (").unwrap()..];
    let wanted = "Parameters (--set NAME=VALUE):
  k     1 1/s  >= 0  Rate
  x0    1            Start
  on    true
  a[2]  0

Fixed when the executable was built, because they decide sizes or structure:
  n
";
    assert!(list.starts_with(wanted), "{list}");
    let version = printed(&scratch.bare("decay", &["--version"]));
    assert!(version.starts_with("Decay (texts ") && version.ends_with(&format!("hyd {}\n", env!("CARGO_PKG_VERSION"))));
    let json = printed(&scratch.bare("decay", &["--json"]));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((json["status"].as_str(), json["model"].as_str()), (Some("done"), Some("Decay")));
}

#[test]
fn what_cannot_be_set_is_refused_with_the_reason() {
    let scratch = built();
    let cases: [(&[&str], i32, &str); 8] = [
        (&["--set", "n=3"], 1, "error: `n` cannot be set: it decides sizes or structure"),
        (&["--set", "half=3"], 1, "error: `half` cannot be set: it is final"),
        (&["--set", "x=3"], 1, "error: `x` cannot be set: it is a variable"),
        (&["--set", "kk=3"], 1, "error: the model has no parameter `kk`; did you mean `k`?"),
        (&["--set", "k=-1"], 1, "error: `k` is -1, below its `min` 0"),
        (&["--set", "k=abc"], 1, "error: `k=abc`: it is a Real and needs a finite number"),
        (&["--stop", "-1"], 2, "error: "),
        (&["-stepSize=1"], 2, "error: `-stepSize` is not known here"),
    ];
    for (arguments, code, message) in cases {
        let output = scratch.bare("decay", arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", messages(&output));
        assert!(messages(&output).starts_with(message), "{arguments:?}: {}", messages(&output));
    }
}

#[test]
fn values_set_at_the_build_are_the_defaults() {
    let scratch = Scratch::new();
    fs::write(scratch.file("decay.hyd"), DECAY).unwrap();
    let output = scratch.hyd(&["build", "decay.hyd", "-o", "decay", "--set", "n=3", "--set", "k=2"]);
    assert!(output.status.success(), "{}", messages(&output));
    for (arguments, value) in [(&[][..], 2.0), (&["--set", "k=1"], 1.0)] {
        let output = scratch.bare("decay", &[&["--result", "r.csv"], arguments].concat());
        assert!(output.status.success(), "{}", messages(&output));
        let (_, found) = last(&scratch, "r.csv");
        assert!((found - f64::exp(-2.0 * value)).abs() < 1e-8, "{found}");
    }
    assert!(printed(&scratch.bare("decay", &["--help"])).contains("a[3]"));
}

/// Shards run by the executable are parts of the sweep that `hyd` runs, to the byte.
#[test]
fn shards_of_an_executable_are_those_of_hyd() {
    let scratch = built();
    fs::write(scratch.file("decay.hyd"), DECAY).unwrap();
    let plan =
        "model = \"decay.hyd\"\nsamples = 70\nseed = 3\n[[vary]]\nparameter = \"k\"\nvalues = \"uniform(0.5, 2)\"\n";
    fs::write(scratch.file("plan.toml"), plan).unwrap();
    let output = scratch.hyd(&["sweep", "plan.toml", "--result", "own"]);
    assert!(output.status.success(), "{}", messages(&output));
    fs::remove_file(scratch.file("decay.hyd")).unwrap();
    for shard in ["0/2", "1/2"] {
        let output = scratch.bare("decay", &["sweep", "plan.toml", "--shard", shard, "--result", "exe"]);
        assert!(output.status.success(), "{}", messages(&output));
    }
    let read = |folder: &str| fs::read(scratch.file(folder).join("members.parquet")).unwrap();
    assert!(read("own") == read("exe"));
    let output = scratch.bare("decay", &["sweep", "--vary", "n=1,2", "--result", "no"]);
    assert!(messages(&output).contains("`n` cannot be varied: it decides sizes or structure"), "{}", messages(&output));
}

/// A value outside its limits fails its run and no other, a listed one and one that follows from what varies; with the
/// bytes of `hyd`.
#[test]
fn limits_hold_in_sweeps_of_an_executable() {
    let scratch = Scratch::new();
    let text = DECAY.replace("Real x0 = 1", "Real x0(max = 10) = 2*k");
    fs::write(scratch.file("decay.hyd"), text).unwrap();
    assert!(scratch.hyd(&["build", "decay.hyd", "-o", "decay"]).status.success());
    let vary = ["--vary", "k=-5,5,6"];
    let by_hyd = scratch.hyd(&[&["sweep", "decay.hyd"], &vary[..], &["--result", "own"]].concat());
    assert!(by_hyd.status.success(), "{}", messages(&by_hyd));
    let output = scratch.bare("decay", &[&["sweep"], &vary[..], &["--result", "exe"]].concat());
    assert!(output.status.success(), "{}", messages(&output));
    assert!(printed(&output).contains("2 failed"), "{}", printed(&output));
    assert!(messages(&output).starts_with("warning: 2 runs failed\nnote: member 0: "), "{}", messages(&output));
    let members = Frame::read(&scratch.file("exe/members.parquet")).unwrap();
    let Some(Cells::Texts(said)) = members.column("message") else { panic!("no messages") };
    assert_eq!(said, &["`k` is -5, below its `min` 0", "", "`x0` is 12, above its `max` 10"]);
    let read = |folder: &str| fs::read(scratch.file(folder).join("members.parquet")).unwrap();
    assert!(read("own") == read("exe"));
    let output = scratch.bare("decay", &["sweep", "--vary", "k=-1,-2", "--result", "none"]);
    assert_eq!(output.status.code(), Some(1));
    let said = messages(&output);
    assert!(said.contains("all 2 runs failed\nnote: 2 such as member 0: `k` is -1, below its `min` 0"), "{said}");
}

/// A value that holds for all runs is refused before the first of them, as where there is one run only.
#[test]
fn fixed_values_outside_their_limits_are_refused_before_a_sweep() {
    let scratch = built();
    let plan = "[set]\nk = \"-1\"\n[[vary]]\nparameter = \"x0\"\nvalues = \"1,2\"\n";
    fs::write(scratch.file("plan.toml"), plan).unwrap();
    for arguments in [&["plan.toml"][..], &["--set", "k=-1", "--vary", "x0=1,2"]] {
        let output = scratch.bare("decay", &[&["sweep"], arguments, &["--result", "s"]].concat());
        assert_eq!(
            (output.status.code(), messages(&output).as_str()),
            (Some(1), "error: `k` is -1, below its `min` 0\n")
        );
        assert!(!scratch.file("s").exists());
    }
}

#[test]
fn a_failed_run_names_equation_and_place() {
    let scratch = Scratch::new();
    let text = "model M\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -1/sqrt(x);\n  annotation(experiment(StopTime = 2));\nend M;\n";
    fs::write(scratch.file("m.hyd"), text).unwrap();
    assert!(scratch.hyd(&["build", "m.hyd", "-o", "m"]).status.success());
    let output = scratch.bare("m", &["--result", "r.csv"]);
    assert_eq!(output.status.code(), Some(3));
    let said = messages(&output);
    assert!(said.contains("m.hyd:4") && said.contains("results up to there are in r.partial.csv"), "{said}");
}

/// Without a compiler a run whose loop lets rounding errors grow ends; what is said of it helps.
#[test]
fn loops_whose_errors_grow_are_made_whole_by_another_build() {
    let scratch = Scratch::new();
    let text = hyd_tests::models::text_of("tests/cases/networks/late.hyd");
    let text = text.replace("parameter Integer n = 60;", "parameter Integer n = 60;\n  parameter Real large = 1000;");
    fs::write(scratch.file("late.hyd"), text.replace("then 1000", "then large")).unwrap();
    let advice = "a loop of equations may be one that cannot be solved one variable after the other with these values of the parameters; an executable \
                  made by `hyd build --whole-loops` takes all variables of the loops as unknowns of the solver";
    assert!(scratch.hyd(&["build", "late.hyd", "-o", "torn"]).status.success());
    let output = scratch.bare("torn", &["--result", "r.csv"]);
    let said = messages(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(
        said.contains("rounding errors grow along a loop") && said.contains(&format!("\nnote: {advice}\n")),
        "{said}"
    );
    let vary = ["sweep", "--vary", "large=0,1000", "--result", "s"];
    let output = scratch.bare("torn", &vary);
    let said = messages(&output);
    assert!(
        said.starts_with("warning: 1 run failed\n") && said.ends_with(&format!("note: 1 run: {advice}\n")),
        "{said}"
    );
    // As advised.
    assert!(scratch.hyd(&["build", "late.hyd", "-o", "whole", "--whole-loops"]).status.success());
    let output = scratch.bare("whole", &["--result", "r.csv"]);
    assert_eq!((output.status.code(), messages(&output).as_str()), (Some(0), ""));
    let table = Table::read(&scratch.file("r.csv")).unwrap();
    let last = |name: &str| *table.column(name).unwrap().last().unwrap();
    assert!((last("x[31]") / last("u") - 1.001).abs() < 1e-9);
    fs::remove_dir_all(scratch.file("s")).unwrap();
    let output = scratch.bare("whole", &vary);
    assert_eq!((output.status.code(), messages(&output).as_str()), (Some(0), ""));
    // What fails for another reason is no matter of loops.
    let decay = built();
    let output = decay.bare("decay", &["--max-steps", "1"]);
    assert!(output.status.code() == Some(3) && !messages(&output).contains("whole-loops"), "{}", messages(&output));
}

/// Where the start alone shows that a loop must be whole, the build finds that out and says it; so it is with units.
#[test]
fn loops_that_the_start_needs_whole_are_built_so() {
    let scratch = Scratch::new();
    let text = hyd_tests::models::text_of("tests/cases/networks/late.hyd");
    fs::write(scratch.file("late.hyd"), text.replace("time > 0.5", "time > -1")).unwrap();
    let note = "note: at the start a loop of equations cannot be solved one variable after the other: built as `--whole-loops` does, with all variables \
                of the loops as unknowns of the solver\n";
    let output = scratch.hyd(&["build", "late.hyd", "-o", "late"]);
    assert_eq!((output.status.code(), messages(&output).as_str()), (Some(0), note));
    let output = scratch.bare("late", &["--result", "r.csv"]);
    assert_eq!((output.status.code(), messages(&output).as_str()), (Some(0), ""));
    let table = Table::read(&scratch.file("r.csv")).unwrap();
    let last = |name: &str| *table.column(name).unwrap().last().unwrap();
    assert!((last("x[31]") / last("u") - 1.001).abs() < 1e-9);
    let output = scratch.hyd(&["build", "late.hyd", "--fmu", "3.0", "-o", "late.fmu"]);
    assert!(output.status.success() && messages(&output).starts_with(note), "{}", messages(&output));
    // What the start does not show, and what was asked for, is said by nobody.
    for (model, options) in [(text.clone(), &[][..]), (text.replace("time > 0.5", "time > -1"), &["--whole-loops"][..])]
    {
        fs::write(scratch.file("late.hyd"), model).unwrap();
        let output = scratch.hyd(&[&["build", "late.hyd", "-o", "late"], options].concat());
        assert_eq!((output.status.code(), messages(&output).as_str()), (Some(0), ""));
    }
}

/// Reading a file of parameters takes many times its length in memory.
#[test]
fn a_file_of_parameters_has_a_limit() {
    let scratch = built();
    let line = "k = 2.0\n";
    for (size, code) in [(4 << 20, Some(0)), ((4 << 20) + 1, Some(1))] {
        fs::write(scratch.file("p.toml"), format!("{line}#{}", " ".repeat(size - line.len() - 1))).unwrap();
        let output = scratch.bare("decay", &["--parameters", "p.toml"]);
        assert_eq!(output.status.code(), code, "{}", messages(&output));
    }
    let said = messages(&scratch.bare("decay", &["--parameters", "p.toml"]));
    assert_eq!(said, "error: `p.toml`: it is longer than 4 MB, as no file of parameters is\n");
}

#[test]
fn recorded_inputs_come_from_a_table() {
    let scratch = Scratch::new();
    let text = "model M\n  input Real u;\n  input Real w;\n  Real x(start = 0, fixed = true);\nequation\n  der(x) = u - x + w;\nend M;\n";
    fs::write(scratch.file("m.hyd"), text).unwrap();
    fs::write(scratch.file("d.csv"), "time,u\n0,1\n3,1\n").unwrap();
    let refused = scratch.hyd(&["build", "m.hyd", "--input", "v", "-o", "m"]);
    assert!(
        messages(&refused).contains("the model has no input `v` of type Real at its top"),
        "{}",
        messages(&refused)
    );
    let output = scratch.hyd(&["build", "m.hyd", "--input", "u", "-o", "m"]);
    assert!(output.status.success(), "{}", messages(&output));
    let output = scratch.bare("m", &["--result", "r.csv"]);
    let needed = "the inputs u are recorded: --input DATA.csv is needed";
    assert!(output.status.code() == Some(2) && messages(&output).contains(needed), "{}", messages(&output));
    // The other input stays a parameter.
    let output = scratch.bare("m", &["--input", "d.csv", "--set", "w=1", "--result", "r.csv"]);
    assert!(output.status.success(), "{}", messages(&output));
    let (end, x) = last(&scratch, "r.csv");
    assert!(end == 3.0 && (x - 2.0 * (1.0 - f64::exp(-3.0))).abs() < 1e-5, "{end} {x}");
    let output = scratch.bare("m", &["sweep", "--vary", "w=0,1", "--input", "d.csv", "--result", "s"]);
    assert!(output.status.success(), "{}", messages(&output));
}

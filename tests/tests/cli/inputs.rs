//! `--input DATA.csv` of `hyd simulate`, `hyd sweep` and executables: what is read, and what is said of tables that do not fit.

use hyd_frames::{Cells, Frame};

use crate::process::{Scratch, run};

const MODEL: &str = "model M
  input Real u(unit = \"V\"); input Real volt;
  input Boolean b(start = false);
  parameter Real T = 0.5;
  Real x(start = 0, fixed = true);
equation
  T*der(x) = u + volt - x;
end M;
";

fn with(table: &str, arguments: &[&str]) -> (Option<i32>, String) {
    let scratch = Scratch::new();
    scratch.write("m.hyd", MODEL);
    scratch.write("d.csv", table);
    let outcome = run(scratch.path(), &[&["simulate", "m.hyd", "--input", "d.csv"], arguments].concat());
    (outcome.code, outcome.stderr)
}

#[test]
fn tables_that_do_not_fit_are_refused_with_their_lines() {
    let cases: [(&str, &[&str], &str); 14] = [
        ("t,u,volt\n0,0,0\n1,1,1\n", &[], "`d.csv`: there is no column `time`"),
        ("time;u;volt\n0;0;0\n1;1;1\n", &[], "there is no column `time`; fields are separated by commas"),
        ("time,a\n0,0\n1,1\n", &[], "none of its columns is an input of the model; its inputs: `u`, `volt`"),
        ("time,u,u\n0,0,1\n1,1,1\n", &[], "the column `u` stands twice in the header"),
        (
            "time,u\n0,0\n0.5,1\n0.5,2\n1,1\n",
            &[],
            "line 4: the time 0.5 s does not come after 0.5 s; times must ascend",
        ),
        ("time,u\n0,0\n1\n", &[], "line 3 has 1 fields, and the header 2"),
        ("time,u\n0,0\nx,1\n", &[], "line 3, column `time`: `x` is not a time"),
        ("time,u\n0,0\n0.5,abc\n1,1\n", &[], "line 3, column `u` holds no number"),
        ("time,u\n0,\n0.5,1\n1,1\n", &[], "line 2, column `u`: the first sample is missing"),
        ("time,u\n0,0\n0.5,1\n1,NaN\n", &[], "line 4, column `u`: the last sample is missing"),
        ("time,u\n0,0\n0.2,\n0.4,NA\n1,1\n", &[], "line 3, column `u`: 2 samples in a row are missing"),
        (
            "time,u\n0,0\n1,1\n",
            &["--stop", "2"],
            "it ends at 1 s (line 3), and the run at 2 s; `--stop 1` ends the run there",
        ),
        ("time,u\n-1,0\n-0.5,1\n", &[], "it ends at -0.5 s"),
        ("time,b,u\n0,0,0\n1,1,1\n", &["--hold", "cubic"], "--hold: `cubic` is not linear, zero or smooth"),
    ];
    for (table, arguments, expected) in cases {
        let (code, said) = with(table, arguments);
        assert!(code == Some(1) || code == Some(2), "{table}: {code:?} {said}");
        assert!(said.contains(expected), "{table}: {said}");
    }
}

#[test]
fn a_model_that_ends_before_its_table_is_told() {
    let folder = Scratch::new();
    folder.write("m.hyd", "model M\n  input Real u;\n  Real x(start = 0, fixed = true);\nequation\n  der(x) = u;\n  annotation(experiment(StopTime = 1));\nend M;\n");
    folder.write("t.csv", "time,u\n0,1\n3,1\n");
    let said = |more: &[&str]| {
        let outcome = run(folder.path(), &[&["simulate", "m.hyd", "--input", "t.csv"], more].concat());
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        outcome.stderr
    };
    let expected = "it goes on to 3 s, and the model ends the run at 1 s; `--stop 3` runs all of it";
    assert!(said(&[]).contains(expected), "{}", said(&[]));
    assert_eq!((said(&["--stop", "1"]), said(&["--stop", "3"])), (String::new(), String::new()));
}

#[test]
fn what_stays_unused_or_is_filled_is_said() {
    let (code, said) = with("time,u,volts,b\n0,0,0,0\n0.5,,0,0\n1,1,0,0\n", &[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("the columns `volts`, `b` are not inputs of the model and are not used"), "{said}");
    assert!(said.contains("did you mean `volt`?"), "{said}");
    assert!(said.contains("line 3, column `u`: a sample is missing and filled from the neighbours"), "{said}");
    let (code, said) = with("time,u,volt\n0,0,0\n1,1,0\n", &["--hold", "x=zero"]);
    assert!(code == Some(2) && said.contains("--hold: `x` is not a recorded input of the model"), "{said}");
}

#[test]
fn a_run_goes_to_the_end_of_the_table_and_holds_as_asked() {
    let scratch = Scratch::new();
    scratch.write("m.hyd", MODEL);
    // The sum of both is 1 from the start to 2 s, held or linear.
    scratch.write("d.csv", "volt,time,u\n0,0,1\n1,1,0\n0,2,1\n");
    let simulate = |more: &[&str]| {
        let arguments = ["simulate", "m.hyd", "--input", "d.csv", "--result", "r.csv", "--intervals", "2"];
        let outcome = run(scratch.path(), &[&arguments, more].concat());
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        let text = scratch.read("r.csv");
        let last: Vec<f64> = text.lines().last().unwrap().split(',').map(|field| field.parse().unwrap()).collect();
        let at = text.lines().next().unwrap().split(',').position(|name| name == "x").unwrap();
        (last[0], last[at])
    };
    let exact = 1.0 - f64::exp(-4.0);
    for more in [&[][..], &["--hold", "zero"], &["--hold", "smooth"], &["--backend", "vm"]] {
        let (end, x) = simulate(more);
        assert!(end == 2.0 && (x - exact).abs() < 1e-5, "{more:?}: {end} {x}");
    }
    // u held at 1 and then 0, volt linear up to 1 and down again.
    let (_, x) = simulate(&["--hold", "u=zero"]);
    let ramp = |a: f64, s: f64, x: f64| a + s - 0.5 * s + (x - a + 0.5 * s) * f64::exp(-2.0);
    let exact = ramp(1.0, -1.0, ramp(1.0, 1.0, 0.0));
    assert!((x - exact).abs() < 1e-5, "{x} {exact}");
}

/// Held values jump at every sample.  Where samples come as often as output points there is one row for each, with the value from then on, and
/// one more where the model does something at a jump; where they are far apart each jump has a row before it and one after it.
#[test]
fn dense_samples_have_no_rows_of_their_own() {
    let scratch = Scratch::new();
    let model = "model M\n  input Real u;\n  Real x(start = 0, fixed = true);\n  discrete Real n(start = 0, fixed = true);\nequation\n  \
        der(x) = u - x;\n  when u > 50 then\n    n = pre(n) + 1;\n  end when;\nend M;\n";
    scratch.write("m.hyd", model);
    let held = |k: usize| if k == 60 { 100.0 } else { (k % 3) as f64 };
    let table: String = (0..=100).map(|k| format!("{},{}\n", k as f64 / 8.0, held(k))).collect();
    scratch.write("d.csv", format!("time,u\n{table}"));
    let rows = |intervals: &str| -> Vec<[f64; 4]> {
        let arguments = ["simulate", "m.hyd", "--input", "d.csv", "--hold", "zero", "--tolerance", "1e-9"];
        let outcome = run(scratch.path(), &[&arguments[..], &["--result", "r.csv", "--intervals", intervals]].concat());
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        let text = scratch.read("r.csv");
        let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let at = ["time", "u", "x", "n"].map(|name| names.iter().position(|own| *own == name).unwrap());
        let numbers = |line: &str| -> Vec<f64> { line.split(',').map(|field| field.parse().unwrap()).collect() };
        text.lines().skip(1).map(|line| at.map(|column| numbers(line)[column])).collect()
    };
    let count = |rows: &[[f64; 4]], k: usize| rows.iter().filter(|row| (row[0] * 8.0 - k as f64).abs() < 1e-9).count();
    let dense = rows("100");
    let of = |range: std::ops::Range<usize>| -> Vec<usize> { range.map(|k| count(&dense, k)).collect() };
    assert_eq!((of(1..17), of(17..100)), (vec![2; 16], vec![1; 83]));
    let mut x = 0.0;
    for k in 0..100 {
        let own = dense.iter().rfind(|row| (row[0] * 8.0 - k as f64).abs() < 1e-9).unwrap();
        assert_eq!((own[1], own[3]), (held(k), if k < 60 { 0.0 } else { 1.0 }), "{k}");
        assert!((own[2] - x).abs() < 1e-6, "{k}: {} {x}", own[2]);
        x = held(k) + (x - held(k)) * f64::exp(-0.125);
    }
    let sparse = rows("1000");
    assert!((1..100).all(|k| count(&sparse, k) == 2));
}

#[test]
fn many_runs_read_one_table_and_know_another_one() {
    let scratch = Scratch::new();
    scratch.write("m.hyd", MODEL);
    scratch.write("d.csv", "time,u\n0,1\n2,1\n");
    let arguments = ["sweep", "m.hyd", "--vary", "T=0.5,1", "--input", "d.csv", "--result", "s"];
    let outcome = run(scratch.path(), &arguments);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let frame = Frame::read(&scratch.path().join("s/members.parquet")).unwrap();
    let Some(Cells::Numbers(x)) = frame.column("x") else { panic!("{frame:?}") };
    assert!((x[0] - (1.0 - f64::exp(-4.0))).abs() < 1e-5 && (x[1] - (1.0 - f64::exp(-2.0))).abs() < 1e-5, "{x:?}");
    // Another table is another sweep, which the folder does not hold.
    scratch.write("d.csv", "time,u\n0,1\n2,2\n");
    let outcome = run(scratch.path(), &arguments);
    assert_ne!(outcome.code, Some(0), "{}", outcome.stdout);
}

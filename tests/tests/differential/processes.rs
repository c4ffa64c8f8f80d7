//! A few models through whole programs: `hyd build` against `hyd simulate`, `hyd sweep` against single runs.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use hyd_differential::evaluate::evaluate;
use hyd_differential::generate::model;
use hyd_differential::model::{Expr, Id, Model, Role};
use hyd_differential::print::{Form, column, text};
use hyd_frames::{Cells, Frame};

/// Allowed difference between the solver and the direct evaluation, relative to 1 and the value.
const ALLOWED: f64 = 1e-5;

/// A folder of its own, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("hyd-differential-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Scratch(path)
    }

    fn run(&self, program: &Path, arguments: &[&str]) {
        let mut command = Command::new(program);
        command
            .current_dir(&self.0)
            .env_remove("HYD_LIBRARY")
            .env_remove("MODELICAPATH")
            .env("NO_COLOR", "1")
            .args(arguments);
        command.env("HYD_LAUNCHER", env!("CARGO_BIN_EXE_hyd-launcher-under-test"));
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {said}\n{}", self.read("m.hyd"));
    }

    fn hyd(&self, arguments: &[&str]) {
        self.run(Path::new(env!("CARGO_BIN_EXE_hyd-under-test")), arguments);
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // What stays behind in the folder of temporary files harms nobody.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The first models from a seed on that are clear and of which this is true.
fn clear_models(first: u64, count: usize, wanted: &dyn Fn(&Model) -> bool) -> Vec<(u64, Model)> {
    let all = (first..).map(|seed| (seed, model(seed)));
    all.filter(|(_, m)| wanted(m) && evaluate(m, &[0.0, m.stop]).is_ok()).take(count).collect()
}

/// Every executable gives the bytes of the command.
pub(crate) fn executables(first: u64, count: usize) {
    for (seed, model) in clear_models(first, count, &|_| true) {
        let scratch = Scratch::new();
        std::fs::write(scratch.0.join("m.hyd"), text(&model, Form::default())).unwrap();
        let stop = format!("{}", model.stop);
        scratch.hyd(&["build", "m.hyd", "-o", "m"]);
        scratch.hyd(&["simulate", "m.hyd", "--stop", &stop, "--result", "own.csv"]);
        scratch.run(&scratch.0.join("m"), &["--stop", &stop, "--result", "exe.csv"]);
        assert!(scratch.read("own.csv") == scratch.read("exe.csv"), "seed {seed}\n{}", scratch.read("m.hyd"));
    }
}

/// A parameter that is a plain number.
fn parameter(model: &Model) -> Option<(Id, f64)> {
    let of = |id: usize| match (&model.variables[id].role, &model.variables[id].value, model.variables[id].owner) {
        (Role::Parameter, Some(Expr::Number(value)), None) => Some((id, *value)),
        _ => None,
    };
    (0..model.variables.len()).find_map(of)
}

/// The last row of a CSV file by the names of its columns.
fn last_row(csv: &str) -> Vec<(String, f64)> {
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let names = reader.headers().unwrap().clone();
    let last = reader.records().last().unwrap().unwrap();
    names.iter().zip(&last).map(|(name, cell)| (name.to_string(), cell.parse().unwrap())).collect()
}

/// Every member of a sweep is what a single run gives, and both are what direct evaluation says.
pub(crate) fn sweeps(first: u64, count: usize) {
    for (seed, model) in clear_models(first, count, &|m| parameter(m).is_some()) {
        let Some((id, value)) = parameter(&model) else { continue };
        let values = [value, value + 0.125, value * 1.5];
        let scratch = Scratch::new();
        std::fs::write(scratch.0.join("m.hyd"), text(&model, Form::default())).unwrap();
        let name = column(&model, Form::default(), id, 0);
        let stop = format!("{}", model.stop);
        let vary = format!("{name}={}", values.map(|v| v.to_string()).join(","));
        let common = ["--stop", &stop, "--tolerance", "1e-9", "--intervals", "1"];
        scratch.hyd(&[&["sweep", "m.hyd", "--vary", &vary, "--result", "s"][..], &common].concat());
        let members = Frame::read(&scratch.0.join("s/members.parquet")).unwrap();
        for (k, value) in values.into_iter().enumerate() {
            let set = format!("{name}={value}");
            scratch.hyd(&[&["simulate", "m.hyd", "--set", &set, "--result", "r.csv"][..], &common].concat());
            let single = last_row(&scratch.read("r.csv"));
            for (name, value) in single.iter().filter(|(name, _)| name != "time") {
                let Some(Cells::Numbers(cells)) = members.column(name) else { continue };
                assert!(
                    cells[k] == *value,
                    "seed {seed}, {set}: `{name}` is {} and {value}\n{}",
                    cells[k],
                    scratch.read("m.hyd")
                );
            }
            let mut other = model.clone();
            other.variables[id].value = Some(Expr::Number(value));
            let Ok(expected) = evaluate(&other, &[0.0, other.stop]) else { continue };
            if expected.is_near_event(other.stop) {
                continue;
            }
            for (id, variable) in other.variables.iter().enumerate() {
                for element in 0..variable.count() {
                    let name = column(&other, Form::default(), id, element);
                    let Some((_, value)) = single.iter().find(|(n, _)| *n == name) else { continue };
                    let right = expected.rows[1][id][element];
                    let close = (value - right).abs() <= ALLOWED * (1.0 + right.abs());
                    assert!(
                        close,
                        "seed {seed}, {set}: `{name}` is {value}, directly {right}\n{}",
                        scratch.read("m.hyd")
                    );
                }
            }
        }
    }
}

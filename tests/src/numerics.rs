//! Reference problems with published end values: `tests/numerics/NAME.hyd` with `NAME.json` beside it.
//!
//! The sidecar holds `source`, `values` (variable and value at the end of the model's experiment), and where needed `scale`
//! (variables whose value is zero against that number), `others` (digits that the BDF of SciPy 1.17 reaches around 1e-4, 1e-6 and
//! 1e-8 with the same weights, medians from `tests/outside/work_precision.py`; the reason in `because`), `open` (why it fails so far).  Digits are
//! `-log10 max |y_i - reference_i| / max(|reference_i|, scale_i)`, the "significant correct digits" of F. Mazzia and C. Magherini,
//! Test Set for Initial Value Problem Solvers, release 2.4 (2008).

use hyd::clock::cpu_seconds;
use hyd_compiler::{Compilation, Goal, Options, compile};
use hyd_results::{Side, Trajectory};
use hyd_runtime::{Statistics, simulate};
use serde_json::Value as Json;

use crate::models::{messages, root, text_of};
use crate::runs::{instance, on_grid};

/// A problem.
pub struct Problem {
    /// Name of the files.
    pub name: String,
    /// Variable, value at the end, and the size its error is set against.
    values: Vec<(String, f64, f64)>,
    /// Digits that a program by others with formulas of the same kind reaches at 1e-4, 1e-6, 1e-8, where that is little.
    pub others: Option<Vec<f64>>,
    /// Why it fails so far.
    pub open: Option<String>,
}

/// What a run reached.
pub struct Outcome {
    /// Significant correct digits of the worst variable.
    pub digits: f64,
    /// That variable.
    pub worst: String,
    /// Counters of the solver.
    pub statistics: Statistics,
    /// CPU seconds of the run.
    pub seconds: f64,
}

/// What where steps happen to fall decides is a matter of chance: tolerances around the one that is asked for, of which
/// the median counts.
const AROUND: [f64; 5] = [0.98, 0.99, 1.0, 1.01, 1.02];

/// Digits beyond which published values in double precision say nothing.
pub const MOST_DIGITS: f64 = 11.0;

/// All problems by name.
pub fn problems() -> Vec<Problem> {
    let list = std::fs::read_dir(root().join("tests/numerics")).expect("the folder exists");
    let mut paths: Vec<_> = list.map(|entry| entry.expect("listed").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    let read = |path: &std::path::PathBuf| {
        let name = path.file_stem().expect("a file").to_string_lossy().into_owned();
        let text = std::fs::read_to_string(path).expect("readable");
        problem(name, &serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    };
    paths.iter().map(read).collect()
}

fn problem(name: String, data: &Json) -> Problem {
    assert!(data["source"].is_string(), "{name}: where do the values come from?");
    assert!(data["others"].is_null() || data["because"].is_string(), "{name}: why are digits lost?");
    let values = data["values"].as_object().unwrap_or_else(|| panic!("{name} has no values"));
    let entry = |(variable, value): (&String, &Json)| {
        let value = value.as_f64().unwrap_or_else(|| panic!("{name}: `{variable}` is not a number"));
        (variable.clone(), value, data["scale"][variable].as_f64().unwrap_or(value.abs()))
    };
    Problem {
        values: values.iter().map(entry).collect(),
        others: data["others"].as_array().map(|list| list.iter().filter_map(Json::as_f64).collect()),
        open: data["open"].as_str().map(String::from),
        name,
    }
}

impl Problem {
    /// The model as code; the messages if it has errors.
    pub fn translate(&self) -> Result<Compilation, String> {
        let file = format!("tests/numerics/{}.hyd", self.name);
        let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: cpu_seconds };
        let compilation = compile(&mut hyd::LibraryPath::new(), &file, &text_of(&file), &options);
        if compilation.has_errors() { Err(messages(&compilation)) } else { Ok(compilation) }
    }

    /// Median of the digits at tolerances around this one; the solver's message if it gives up at one of them.
    pub fn median(&self, compilation: &Compilation, tolerance: f64) -> Result<Outcome, String> {
        let runs: Result<Vec<_>, _> = AROUND.iter().map(|part| self.run(compilation, part * tolerance)).collect();
        let mut runs = runs?;
        runs.sort_by(|a, b| a.digits.total_cmp(&b.digits));
        Ok(runs.swap_remove(AROUND.len() / 2))
    }

    /// Runs to the end of the model's experiment and compares; the solver's message if it gives up.
    pub fn run(&self, compilation: &Compilation, tolerance: f64) -> Result<Outcome, String> {
        let stop =
            compilation.flat.as_ref().and_then(|flat| flat.experiment.stop).expect("the model says where it ends");
        let mut system = instance(compilation, &[]);
        let mut rows = Trajectory::new();
        let start = cpu_seconds();
        let summary = simulate(&mut system, &on_grid(stop, 1, tolerance), &mut rows, &|| false);
        let summary = summary.map_err(|error| error.to_string())?;
        let seconds = cpu_seconds() - start;
        let mut worst = (f64::INFINITY, "");
        for (variable, reference, scale) in &self.values {
            let series = rows.series(variable).unwrap_or_else(|| panic!("{} has no `{variable}`", self.name));
            let error = (series.value(stop, Side::After) - reference).abs() / scale;
            let digits = if error.is_finite() { -error.max(1e-16).log10() } else { f64::NEG_INFINITY };
            if digits < worst.0 {
                worst = (digits, variable);
            }
        }
        Ok(Outcome { digits: worst.0, worst: worst.1.to_string(), statistics: summary.statistics, seconds })
    }
}

//! Runs of compiled models on a grid of output points.
//!
//! Parameters that the compiler did not use (`Compilation::set_at_translation`) are set on the system as run-time data, as
//! the command does it.  Rows of events are off: a grid point is one row, whatever happens there.

use hyd_compiler::{Compilation, Goal, Instance};
use hyd_results::{Side, Trajectory};
use hyd_runtime::{Options, Summary, simulate};

use crate::models::{compile_file, messages};

/// A finished run.
pub struct Run {
    /// The rows.
    pub rows: Trajectory,
    /// What it has cost.
    pub summary: Summary,
}

impl Run {
    /// All values of a variable; panics with the name if there is none.
    pub fn values(&self, name: &str) -> Vec<f64> {
        let series = self.rows.series(name);
        series.unwrap_or_else(|| panic!("{} has no variable `{name}`", self.rows.tables().model)).values()
    }

    /// Value of a variable at a time (s), linear between rows.
    pub fn value(&self, name: &str, time: f64) -> f64 {
        let series = self.rows.series(name);
        series
            .unwrap_or_else(|| panic!("{} has no variable `{name}`", self.rows.tables().model))
            .value(time, Side::After)
    }
}

/// A compilation that came to code; panics with the messages otherwise.
pub fn translated(file: &str, set: &[(&str, &str)]) -> Compilation {
    let compilation = compile_file(file, set, Goal::Run);
    assert!(!compilation.has_errors() && compilation.model.is_some(), "{file}:\n{}", messages(&compilation));
    compilation
}

/// An instance of a compilation with the remaining parameters set.
pub fn instance(compilation: &Compilation, set: &[(&str, &str)]) -> Instance {
    let mut system = compilation.model.as_ref().expect("translated").instantiate();
    let set: Vec<(String, String)> = set.iter().map(|(name, text)| (name.to_string(), text.to_string())).collect();
    hyd_run::parameters::apply(&mut system, &set, &compilation.set_at_translation)
        .unwrap_or_else(|why| panic!("{why}"));
    system
}

/// Options of a run from 0 to `stop` (s) with `intervals` output intervals and without rows of events.
pub fn on_grid(stop: f64, intervals: usize, tolerance: f64) -> Options {
    Options { intervals, event_rows: false, ..Options::new(0.0, stop).with_tolerance(tolerance) }
}

/// Compiles a file and runs it.
pub fn run(file: &str, set: &[(&str, &str)], options: &Options) -> Run {
    let compilation = translated(file, set);
    let mut system = instance(&compilation, set);
    let mut rows = Trajectory::new();
    let result = simulate(&mut system, options, &mut rows, &|| false);
    let summary = result.unwrap_or_else(|error| panic!("{file}: {error}"));
    Run { rows, summary }
}

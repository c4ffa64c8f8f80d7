//! The ways in which a text is computed: machine code, the interpreter, a payload that was written and read again.

use std::sync::Arc;

use hyd_compiler::{Compilation, Goal, Options, Severity, compile};
use hyd_payload::{Backend, Loaded, format};
use hyd_results::{Side, Trajectory};
use hyd_runtime::{Options as RunOptions, simulate};
use hyd_system::DaeSystem;
use hyd_tests::models::messages;

/// Tolerance of the solver.
const TOLERANCE: f64 = 1e-9;

/// Settings by name, as `--set` takes them.
pub(crate) type Settings = [(String, String)];

/// What a way gives, or the message that comes instead, its kind first.
pub(crate) type Answer = Result<Rows, String>;

/// A run at the instants asked for.
pub(crate) struct Rows {
    trajectory: Trajectory,
    times: Vec<f64>,
}

impl Rows {
    /// A variable at all instants.
    pub(crate) fn values(&self, name: &str) -> Option<Vec<f64>> {
        let series = self.trajectory.series(name)?;
        Some(self.times.iter().map(|t| series.value(*t, Side::After)).collect())
    }

    /// All numbers, bit by bit.
    pub(crate) fn bits(&self) -> Vec<u64> {
        (0..self.trajectory.len()).flat_map(|k| self.trajectory.row(k).to_vec()).map(f64::to_bits).collect()
    }
}

/// A translated text.
pub(crate) struct Translated {
    compilation: Compilation,
    set: Vec<(String, String)>,
}

/// Where the model runs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Way {
    /// Machine code in this process.
    Native,
    /// The interpreter.
    Interpreted,
    /// Machine code out of the bytes that `hyd build` writes.
    Read,
}

/// Translates a text; settings that decide sizes act here.
pub(crate) fn translate(text: &str, set: &Settings) -> Result<Translated, String> {
    let options = Options { model: None, set: set.to_vec(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut hyd::LibraryPath::new(), "m.hyd", text, &options);
    if compilation.model.is_none() || compilation.has_errors() {
        let first = compilation.diagnostics.iter().find(|d| d.severity == Severity::Error);
        let code = first.map_or_else(|| "without a code".to_string(), |d| d.code.to_string());
        return Err(format!("refused {code}\n{}", messages(&compilation)));
    }
    Ok(Translated { compilation, set: set.to_vec() })
}

impl Translated {
    /// Runs it up to the last of these instants.
    pub(crate) fn run(&self, way: Way, times: &[f64]) -> Answer {
        let model = self.compilation.model.as_ref().ok_or("refused: no code")?;
        let fault = |error: String| format!("fails to load\n{error}");
        let mut system: Box<dyn DaeSystem> = match way {
            Way::Native => Box::new(model.instantiate()),
            Way::Interpreted => Box::new(model.on(Backend::Vm).map_err(|e| fault(e.to_string()))?.instantiate()),
            Way::Read => {
                let read = format::read(&format::write(model.payload()), true).map_err(|e| fault(e.to_string()))?;
                let loaded = Loaded::new(read, Backend::Native).map_err(|e| fault(e.to_string()))?;
                Box::new(Arc::new(loaded).instantiate())
            }
        };
        hyd_run::parameters::apply(&mut *system, &self.set, &self.compilation.set_at_translation)
            .map_err(|error| format!("set\n{error}"))?;
        let stop = times.last().copied().unwrap_or(1.0);
        let inner = times.iter().copied().filter(|t| *t > 0.0).collect();
        let plain = RunOptions::new(0.0, stop).with_tolerance(TOLERANCE);
        let options = RunOptions { times: inner, event_rows: false, ..plain };
        let mut trajectory = Trajectory::new();
        simulate(&mut *system, &options, &mut trajectory, &|| false).map_err(|e| format!("fails\n{e}"))?;
        Ok(Rows { trajectory, times: times.to_vec() })
    }
}

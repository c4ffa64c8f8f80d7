//! Options of a run from Python's keywords: the same names, defaults and limits as the command line has.

use std::num::NonZeroU64;
use std::path::PathBuf;

use hyd_run::{BackendName, Failure, InputArguments, Names, RunArguments, Solver};
use pyo3::prelude::*;

/// Keywords; none: as the model or the command line has it.
#[derive(FromPyObject, Clone, Debug)]
#[pyo3(from_item_all)]
pub(crate) struct RunOptions {
    start: Option<f64>,
    stop: Option<f64>,
    tolerance: Option<f64>,
    intervals: Option<i64>,
    every_step: bool,
    max_steps: Option<i64>,
    solver: Option<String>,
    variables: Option<String>,
    backend: Option<String>,
    result: Option<PathBuf>,
}

impl RunOptions {
    /// The options as the command line has them; `sensitivity`: parameters by which derivatives are wanted.
    ///
    /// # Errors
    /// Wrong usage: a word that is not known, a number that cannot be meant.
    pub(crate) fn arguments(&self, sensitivity: Vec<String>) -> Result<RunArguments, Failure> {
        let wrong = |sentence: String| Err(Failure::Usage(sentence));
        let solver = match self.solver.as_deref() {
            None | Some("auto") => Solver::Auto,
            Some("bdf") => Solver::Bdf,
            Some("esdirk") => Solver::Esdirk,
            Some(other) => return wrong(format!("solver: `{other}` is not auto, bdf or esdirk")),
        };
        let backend = match self.backend.as_deref() {
            None | Some("native") => BackendName::Native,
            Some("vm") => BackendName::Vm,
            Some(other) => return wrong(format!("backend: `{other}` is not native or vm")),
        };
        let intervals = match self.intervals {
            None => None,
            Some(_) if self.every_step => return wrong("intervals and every_step exclude each other".to_string()),
            Some(count) => match usize::try_from(count) {
                Ok(count) => Some(count),
                Err(_) => return wrong(format!("intervals: {count} is not a number of intervals")),
            },
        };
        let max_steps = match self.max_steps {
            None => None,
            Some(count) => match u64::try_from(count).ok().and_then(NonZeroU64::new) {
                Some(count) => Some(count),
                None => return wrong(format!("max_steps: {count} is not a number of steps")),
            },
        };
        Ok(RunArguments {
            start: self.start,
            stop: self.stop,
            tolerance: self.tolerance,
            intervals,
            every_step: self.every_step,
            max_steps,
            solver,
            inputs: InputArguments::default(),
            result: self.result.clone(),
            variables: self.variables.clone(),
            sensitivity: Some(Names(sensitivity)).filter(|names| !names.0.is_empty()),
            backend,
            profile: false,
            json: false,
        })
    }
}

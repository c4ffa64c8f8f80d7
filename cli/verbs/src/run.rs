//! One run of a translated model; one that ends because rounding errors grow along a torn loop is done again with the loops whole.

use std::sync::Arc;

use hyd_compiler::{Compilation, CompiledModel, FlatModel};
use hyd_results::Sink;
use hyd_run::{
    Beside, DONE_AGAIN, Facts, Failure, InputTable, Outcome, RunArguments, WHOLE_LOOPS, options, parameters,
};
use hyd_runtime::{Options, SolveError};
use hyd_system::{DaeSystem, significant};

use crate::Joined;

/// What is run, and how.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// The model, translated without errors.
    pub compilation: &'a Compilation,
    /// All parameters that are set; those that the translation took are not set again.
    pub set: &'a [(String, String)],
    /// Units of other tools that are blocks of the model.
    pub units: Option<&'a Joined>,
    /// Recorded inputs, which the translation knew of.
    pub table: Option<&'a InputTable>,
    /// Options.
    pub arguments: &'a RunArguments,
    /// All values of the shown variables are needed, not only the last.
    pub drawn: bool,
    /// Nobody looks at what `--variables` leaves out, the sink neither.
    pub only_shown: bool,
    /// Seconds of CPU time until the model was translated.
    pub translate_s: f64,
    /// Shows on a terminal how far the run has come.
    pub progress: bool,
}

impl Run<'_> {
    /// Runs the model; gives how it ended, and the sink with the rows of the run that counts.  `whole`: the model with whole loops, if there
    /// is one.  `stop` is asked after every step.
    ///
    /// # Errors
    /// Wrong usage, or a result file that cannot be written; that the solver gave up stands in the outcome.
    pub fn simulate<S: Sink>(
        &self,
        whole: &dyn Fn() -> Option<Arc<CompiledModel>>,
        sink: &dyn Fn() -> S,
        stop: &dyn Fn() -> bool,
    ) -> Result<(Outcome, S), Failure> {
        let model = self.compilation.model.as_ref();
        let model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
        let mut rows = sink();
        let outcome = self.once(model, Vec::new(), &mut rows, stop)?;
        if outcome.result.as_ref().is_err_and(SolveError::may_be_of_loops)
            && let Some(whole) = whole()
        {
            let mut other = sink();
            let said = vec![format!("{WHOLE_LOOPS}; the run was {DONE_AGAIN}")];
            let again = self.once(&whole, said, &mut other, stop)?;
            if again.result.is_ok() {
                return Ok((again, other));
            }
        }
        Ok((outcome, rows))
    }

    /// One run; `warnings` are reported in addition to its own.
    fn once(
        &self,
        model: &CompiledModel,
        mut warnings: Vec<String>,
        into: &mut dyn Sink,
        stop: &dyn Fn() -> bool,
    ) -> Result<Outcome, Failure> {
        let Run { compilation, arguments, table, .. } = *self;
        let model = model.on(arguments.backend.backend()).map_err(Failure::Fault)?;
        let text = model.instantiate();
        let mut system: Box<dyn DaeSystem> = match self.units {
            None => Box::new(text),
            Some(units) => {
                warnings.extend(units.notes());
                let mut whole = units.join(Box::new(text))?;
                let experiment = InputTable::experiment(table, &model.payload().experiment, arguments.start);
                let times = options(arguments, &experiment)?;
                whole.expect(times.tolerance, times.stop);
                Box::new(whole)
            }
        };
        let system = &mut *system;
        parameters::apply(system, self.set, &compilation.set_at_translation).map_err(Failure::Fault)?;
        let code = model.statistics();
        warnings.extend(model.fallback().map(|reason| format!("the code is interpreted: {reason}")));
        let experiment = InputTable::experiment(table, &model.payload().experiment, arguments.start);
        let options = options(arguments, &experiment)?;
        if let Some(table) = table {
            let known = compilation.flat.as_deref().map(FlatModel::real_inputs).unwrap_or_default();
            warnings.extend(table.recorded(system, (options.start, options.stop), &known)?.warnings);
            warnings.extend(table.left_over(arguments.stop, options.stop));
        }
        let facts = Facts {
            model: compilation.model_name.as_deref().unwrap_or_default().to_string(),
            templates: code.templates,
            code_bytes: code.code_bytes,
            translate_s: self.translate_s,
            warnings,
            unit: None,
        };
        let (drawn, only_shown, progress) = (self.drawn, self.only_shown, self.progress);
        let beside = Beside { drawn, into: Some(into), only_shown, stop, progress };
        let mut outcome = hyd_run::simulate(system, arguments, &options, facts, beside)?;
        if arguments.stop.is_none() && experiment.stop.is_none() {
            outcome.summary.warnings.extend(ends_too_early(system, &options, &outcome));
        }
        Ok(outcome)
    }
}

/// An event after so many lengths of a run is never meant to come.
const NEVER: f64 = 1000.0;

/// What to say of a run that ends where runs end by default, before anything has happened in it.
fn ends_too_early(system: &mut dyn DaeSystem, options: &Options, outcome: &Outcome) -> Option<String> {
    if outcome.result.is_err() || outcome.summary.counters.events() > 0 {
        return None;
    }
    let first = system.next_time_event(options.start);
    // An event that is not meant to come is set far away.
    let is_near = first.t - options.start < NEVER * (options.stop - options.start);
    let is_after = first.t.is_finite() && first.t > options.stop && is_near && !first.is_input;
    is_after.then(|| {
        let (stop, first) = (significant(options.stop), significant(first.t));
        format!(
            "no event has come when the run ends at {stop} s, where runs end by default: the first event is at {first} s; \
             add `annotation(experiment(StopTime = ...))` to the model, or give `--stop`"
        )
    })
}

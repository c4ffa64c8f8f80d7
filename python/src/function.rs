//! A model as a function of some of its parameters, with exact derivatives.
//!
//! Evaluators (a system and a simulator with their work space) are kept from call to call; a call takes one that is free, so that threads do not wait for
//! each other.

use std::sync::{Arc, Mutex};

use hyd_compiler::{CompiledModel, Instance};
use hyd_run::parameters;
use hyd_run::{Failure, Solver};
use hyd_runtime::{EvaluationError, Functional, ModelFunction, Options, SolveError};
use hyd_system::{DaeSystem, Place};
use hyd_verbs::run_diagnostic;
use pyo3::prelude::*;

use crate::array::Array;
use crate::messages::{Message, exception, failed, rejected, stopped};
use crate::signals::Signals;
use crate::translated::Translated;

/// Evaluators that are kept for later calls; as many threads as that hardly ever call one function at a time.
const MOST_FREE: usize = 64;

/// What is mapped to what, and how it is run.
#[derive(FromPyObject, Clone, Debug)]
#[pyo3(from_item_all)]
pub(crate) struct Wanted {
    outputs: Vec<String>,
    parameters: Vec<String>,
    /// Times (s); none: the stop time alone.
    at: Option<Vec<f64>>,
    start: Option<f64>,
    stop: Option<f64>,
    tolerance: Option<f64>,
    solver: Option<String>,
}

impl Wanted {
    /// Names of the arguments.
    pub(crate) fn parameters(&self) -> &[String] {
        &self.parameters
    }
}

/// `hyd.Function` below its documentation.
#[pyclass(frozen, module = "hyd._hyd")]
pub(crate) struct Function {
    translated: Arc<Translated>,
    set: Vec<(String, String)>,
    wanted: Functional,
    free: Mutex<Vec<ModelFunction<Instance>>>,
    /// The same with whole loops, for values with which rounding errors grow.
    whole: Mutex<Vec<ModelFunction<Instance>>>,
}

/// Values, and derivatives where they are wanted.
type Response = (Vec<f64>, Vec<f64>);

impl Function {
    pub(crate) fn new(
        py: Python<'_>,
        translated: Arc<Translated>,
        set: Vec<(String, String)>,
        wanted: Wanted,
    ) -> PyResult<Self> {
        let experiment = translated.model().payload().experiment;
        let start = wanted.start.or(experiment.start).unwrap_or(0.0);
        let stop = wanted.stop.or(experiment.stop).unwrap_or(start + 1.0);
        let mut options = Options::new(start, stop);
        options.tolerance = wanted.tolerance.or(experiment.tolerance).unwrap_or(options.tolerance);
        let usage = |sentence: String| failed(py, &Failure::Usage(sentence), &[]);
        options.solver = match wanted.solver.as_deref() {
            None => hyd_runtime::Solver::Auto,
            Some(word) if word == Solver::Auto.name() => hyd_runtime::Solver::Auto,
            Some(word) if word == Solver::Bdf.name() => hyd_runtime::Solver::Bdf,
            Some(word) if word == Solver::Esdirk.name() => hyd_runtime::Solver::Esdirk,
            Some(word) => return Err(usage(format!("solver: `{word}` is not auto, bdf or esdirk"))),
        };
        options.check().map_err(|error| usage(error.to_string()))?;
        let times = wanted.at.unwrap_or_else(|| vec![stop]);
        let wanted = Functional { parameters: wanted.parameters, outputs: wanted.outputs, times, options };
        let (free, whole) = Default::default();
        let mut own = Self { translated, set, wanted, free, whole };
        if let Some(outside) = own.translated.outside(&own.set, start) {
            return Err(rejected(py, &[outside]));
        }
        // What is wrong with names is said now.
        let first = own.evaluator(own.translated.model()).map_err(usage)?;
        own.free = Mutex::new(vec![first]);
        Ok(own)
    }

    fn evaluator(&self, model: &CompiledModel) -> Result<ModelFunction<Instance>, String> {
        let mut system = model.instantiate();
        parameters::apply(&mut system, &self.set, &self.translated.compilation.set_at_translation)?;
        ModelFunction::new(system, self.wanted.clone()).map_err(|error| error.to_string())
    }

    /// One evaluation by an evaluator of a pool, to which it returns.
    fn by(
        &self,
        pool: &Mutex<Vec<ModelFunction<Instance>>>,
        model: &CompiledModel,
        (values, derived): (&[f64], bool),
        stop: &dyn Fn() -> bool,
    ) -> Result<Response, EvaluationError> {
        // Nobody waits here: a process that was forked while a thread held the lock would wait for ever.
        let known = pool.try_lock().ok().and_then(|mut free| free.pop());
        let made = || self.evaluator(model).expect("invariant: the first evaluator was made of the same names");
        let mut evaluator = known.unwrap_or_else(made);
        let response = match derived {
            true => evaluator.evaluate_with_derivatives(values, stop),
            false => evaluator.evaluate(values, stop),
        };
        let response = response.map(|own| (own.values().to_vec(), own.derivatives().to_vec()));
        if let Ok(mut free) = pool.try_lock()
            && free.len() < MOST_FREE
        {
            free.push(evaluator);
        }
        response
    }

    fn evaluate(&self, py: Python<'_>, values: &[f64], derived: bool) -> PyResult<Response> {
        let (response, caught) = py.detach(|| {
            let signals = Signals::new();
            let stop = || signals.stop();
            let wanted = (values, derived);
            let mut response = self.by(&self.free, self.translated.model(), wanted, &stop);
            let rounding = matches!(&response, Err(EvaluationError::Run(error)) if error.may_be_of_loops());
            if rounding
                && let Some(whole) = self.translated.whole()
                && let Ok(again) = self.by(&self.whole, &whole, wanted, &stop)
            {
                response = Ok(again);
            }
            (response, signals.caught())
        });
        if let Some(caught) = caught {
            return Err(stopped(py, caught, None, &[], None));
        }
        response.map_err(|error| match error {
            EvaluationError::Run(error) => {
                let (files, flat) = (&self.translated.compilation.files, self.translated.compilation.flat.as_deref());
                let kind = if matches!(*error, SolveError::Assertion { .. }) { "model" } else { "run" };
                exception(py, kind, None, &[Message::of(files, &run_diagnostic(&error, files, flat, None))], None)
            }
            other => failed(py, &Failure::Usage(other.to_string()), &[]),
        })
    }
}

#[pymethods]
impl Function {
    /// Times of the results (s).
    #[getter]
    fn at(&self) -> Vec<f64> {
        self.wanted.times.clone()
    }

    /// Values that the parameters have when nobody says otherwise.
    fn start(&self, py: Python<'_>) -> PyResult<Vec<f64>> {
        let mut system = self.translated.model().instantiate();
        let set = parameters::apply(&mut system, &self.set, &self.translated.compilation.set_at_translation);
        set.map_err(|sentence| failed(py, &Failure::Fault(sentence), &[]))?;
        // Where a binding has no value its parameter has none.
        let _ = system.bind(self.wanted.options.start);
        let tables = system.tables().clone();
        let value = |name: &String| {
            let found = tables.find(name).map(|(variable, element)| variable.sources[element]);
            match found.map(|source| (source.place, source.negated)) {
                Some((Place::Parameter(k), negated)) => {
                    let value = system.parameters()[k as usize];
                    if negated { -value } else { value }
                }
                _ => f64::NAN,
            }
        };
        Ok(self.wanted.parameters.iter().map(value).collect())
    }

    /// Values: a row for each time, a column for each output.
    fn values(&self, py: Python<'_>, values: Vec<f64>) -> PyResult<Array> {
        let (response, _) = self.evaluate(py, &values, false)?;
        Ok(Array::new(response, vec![self.wanted.times.len(), self.wanted.outputs.len()]))
    }

    /// Values, and their derivatives by the parameters.
    fn values_and_derivatives(&self, py: Python<'_>, values: Vec<f64>) -> PyResult<(Array, Array)> {
        let (response, derivatives) = self.evaluate(py, &values, true)?;
        let (times, outputs, parameters) =
            (self.wanted.times.len(), self.wanted.outputs.len(), self.wanted.parameters.len());
        Ok((Array::new(response, vec![times, outputs]), Array::new(derivatives, vec![times, outputs, parameters])))
    }
}

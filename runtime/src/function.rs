//! A model as a function: parameter values to outputs at given times, with derivatives by the parameters.
//!
//! [`ModelFunction`] binds a system, a [`Simulator`] and a choice of parameters, outputs and times once, and is evaluated
//! again and again: what fits and other searches run on.  It keeps everything in memory and its work space from run to run;
//! it can be sent to a thread, and many of them can stand on clones of one compiled model.  The derivatives are forward
//! sensitivities, not differences.
//!
//! ```
//! # use hyd_runtime::{EvaluationError, Functional, ModelFunction, Options};
//! # fn example(system: impl hyd_system::DaeSystem) -> Result<(), EvaluationError> {
//! let wanted = Functional {
//!     parameters: vec!["mass.m".into(), "spring.k".into()],
//!     outputs: vec!["x".into()],
//!     times: vec![0.1, 0.2, 0.3],
//!     options: Options::new(0.0, 0.3).with_tolerance(1e-7),
//! };
//! let mut function = ModelFunction::new(system, wanted)?;
//! for mass in [1.0, 1.1] {
//!     let response = function.evaluate_with_derivatives(&[mass, 400.0], &|| false)?;
//!     println!("{} {}", response.value(2, 0), response.derivative(2, 0, 1));
//! }
//! # Ok(())
//! # }
//! ```

use std::fmt;
use std::io;
use std::sync::Arc;

use hyd_results::{RowKind, Sink};
use hyd_system::{DaeSystem, ParameterError, Place, Settable, Source, Tables};

use crate::{OptionError, Options, Simulator, SolveError, Summary};

/// What a [`ModelFunction`] maps to what.
#[derive(Clone, PartialEq, Debug)]
pub struct Functional {
    /// Full names of the parameters that are the arguments.
    pub parameters: Vec<String>,
    /// Full names of the variables that are the results.
    pub outputs: Vec<String>,
    /// Times of the results (s), ascending, not before the start of the run; the last one ends it.  At an event the values are those after it.
    pub times: Vec<f64>,
    /// Start time, tolerance and limits.  Stop time, output points, rows at events and sensitivities follow from the above.
    pub options: Options,
}

/// Results of one evaluation, kept until the next one.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Response {
    outputs: usize,
    parameters: usize,
    reached: usize,
    values: Vec<f64>,
    derivatives: Vec<f64>,
}

impl Response {
    /// Number of times reached: all of them, unless the model ended its run (`terminate`).
    pub fn reached(&self) -> usize {
        self.reached
    }

    /// Values time by time, the outputs of one time side by side.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Derivatives time by time, output by output, those by all parameters side by side; empty if not asked for.
    pub fn derivatives(&self) -> &[f64] {
        &self.derivatives
    }

    /// Output `output` at time `time`, both counted as in the [`Functional`].
    pub fn value(&self, time: usize, output: usize) -> f64 {
        self.values[time * self.outputs + output]
    }

    /// Derivative of `value(time, output)` by parameter `parameter`.
    pub fn derivative(&self, time: usize, output: usize, parameter: usize) -> f64 {
        self.derivatives[(time * self.outputs + output) * self.parameters + parameter]
    }
}

/// Why there is no result.
#[derive(Debug)]
pub enum EvaluationError {
    /// A time is not finite, or not after the one before.
    Times {
        /// Position of the time.
        position: usize,
    },
    /// There is no variable of this name.
    Output {
        /// The name.
        name: String,
    },
    /// An argument cannot be varied.
    Argument(OptionError),
    /// A value is not finite or not of its parameter's type.
    Value {
        /// Name of the parameter.
        name: String,
        /// The value.
        value: f64,
    },
    /// The number of values is not that of the parameters.
    Count {
        /// Number of parameters.
        wanted: usize,
        /// Number of values.
        given: usize,
    },
    /// The run failed.
    Run(Box<SolveError>),
}

impl fmt::Display for EvaluationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EvaluationError::Times { position } => {
                write!(f, "time {} must be a number greater than the one before it", position + 1)
            }
            EvaluationError::Output { name } => write!(f, "there is no variable `{name}`"),
            EvaluationError::Argument(error) => error.fmt(f),
            EvaluationError::Value { name, value } => write!(f, "`{name}` cannot be set to {value}"),
            EvaluationError::Count { wanted, given } => write!(f, "{given} values for {wanted} parameters"),
            EvaluationError::Run(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for EvaluationError {}

impl From<OptionError> for EvaluationError {
    fn from(error: OptionError) -> Self {
        EvaluationError::Argument(error)
    }
}

impl From<SolveError> for EvaluationError {
    fn from(error: SolveError) -> Self {
        EvaluationError::Run(Box::new(error))
    }
}

/// A system to be run for many values of some of its parameters.
pub struct ModelFunction<S> {
    system: S,
    simulator: Simulator,
    names: Vec<String>,
    /// Position of each parameter in `DaeSystem::parameters`, and true if the variable is its negative.
    arguments: Vec<(usize, bool)>,
    plain: Options,
    derived: Options,
    collector: Collector,
}

impl<S: DaeSystem> ModelFunction<S> {
    /// Prepares evaluations of a system.  Parameters that are not arguments keep the values that they have in it.
    ///
    /// # Errors
    /// A name that is not known or cannot be varied, or times out of order.
    pub fn new(system: S, wanted: Functional) -> Result<Self, EvaluationError> {
        let Functional { parameters: names, outputs, times, options } = wanted;
        let mut last = options.start;
        for (position, &t) in times.iter().enumerate() {
            if !t.is_finite() || t < last || (position > 0 && t == last) {
                return Err(EvaluationError::Times { position });
            }
            last = t;
        }
        let tables = Arc::clone(system.tables());
        let arguments = names.iter().map(|name| argument(&tables, name)).collect::<Result<_, _>>()?;
        let find = |name: &String| {
            let found = tables.find(name).and_then(|(variable, element)| variable.sources.get(element).copied());
            found.ok_or_else(|| EvaluationError::Output { name: name.clone() })
        };
        let sources: Vec<Source> = outputs.iter().map(find).collect::<Result<_, _>>()?;
        let plain = Options { stop: last, event_rows: true, every_step: false, sensitivity: Vec::new(), ..options };
        let plain = Options { times: times.clone(), ..plain };
        let read = |source: &Source| match source.place {
            Place::Output(k) => Some(k),
            Place::Parameter(_) | Place::Constant(_) => None,
        };
        let read: Vec<u32> = sources.iter().filter_map(read).collect();
        let plain = Options { needed_outputs: Some(read.clone()), ..plain };
        let derived = Options { sensitivity: names.clone(), derived_outputs: Some(read), ..plain.clone() };
        let (row, parameters) = (system.structure().outputs, system.parameters().len());
        let response = Response { outputs: sources.len(), parameters: names.len(), ..Response::default() };
        let collector = Collector { sources, times, row, constants: Vec::new(), parameters, next: 0, response };
        Ok(Self { simulator: Simulator::new(system.structure()), system, names, arguments, plain, derived, collector })
    }

    /// The system, for instance to set other parameters.
    pub fn system_mut(&mut self) -> &mut S {
        &mut self.system
    }

    /// The outputs at these parameter values.  `stop` is asked after every step; true gives up.
    ///
    /// # Errors
    /// A value that cannot be set, or how the run failed.
    pub fn evaluate(&mut self, values: &[f64], stop: &dyn Fn() -> bool) -> Result<&Response, EvaluationError> {
        self.run(values, false, stop)
    }

    /// The outputs at these parameter values, and their derivatives by the parameters.
    ///
    /// # Errors
    /// As [`ModelFunction::evaluate`]; also when the system has no derivatives with respect to a parameter.
    pub fn evaluate_with_derivatives(
        &mut self,
        values: &[f64],
        stop: &dyn Fn() -> bool,
    ) -> Result<&Response, EvaluationError> {
        self.run(values, true, stop)
    }

    /// The results of the last evaluation.
    pub fn response(&self) -> &Response {
        &self.collector.response
    }

    /// What the last evaluation has cost.
    pub fn statistics(&self) -> &crate::Statistics {
        self.simulator.statistics()
    }

    fn run(&mut self, values: &[f64], derived: bool, stop: &dyn Fn() -> bool) -> Result<&Response, EvaluationError> {
        if values.len() != self.arguments.len() {
            return Err(EvaluationError::Count { wanted: self.arguments.len(), given: values.len() });
        }
        for ((&(index, negated), name), &value) in self.arguments.iter().zip(&self.names).zip(values) {
            let set = self.system.set_parameter(index, if negated { -value } else { value });
            set.map_err(|error| match error {
                ParameterError::BadValue => EvaluationError::Value { name: name.clone(), value },
                ParameterError::NotSettable => EvaluationError::Argument(refusal(name, "it cannot be set")),
            })?;
        }
        let options = if derived && !self.names.is_empty() { &self.derived } else { &self.plain };
        self.collector.begin_run(derived);
        let _: Summary = self.simulator.run(&mut self.system, options, &mut self.collector, stop)?;
        Ok(&self.collector.response)
    }
}

/// Where the value of a parameter is set.
fn argument(tables: &Tables, name: &str) -> Result<(usize, bool), OptionError> {
    let found = tables.find(name).ok_or_else(|| refusal(name, "there is no parameter of this name"))?;
    let (variable, element) = found;
    match (&variable.settable, variable.sources.get(element)) {
        (Settable::Structural, _) => Err(refusal(name, "it decides sizes or structure")),
        (Settable::Yes, Some(Source { place: Place::Parameter(index), negated })) => Ok((*index as usize, *negated)),
        _ => Err(refusal(name, "it is not a parameter that can be set")),
    }
}

fn refusal(name: &str, reason: &str) -> OptionError {
    OptionError::Sensitivity { name: name.to_string(), reason: reason.to_string() }
}

/// Takes the rows at the wanted times.
struct Collector {
    sources: Vec<Source>,
    times: Vec<f64>,
    /// Number of values in a row, and of parameters, without derivatives.
    row: usize,
    parameters: usize,
    /// Values that are constant in time, as the run hands them over.
    constants: Vec<f64>,
    next: usize,
    response: Response,
}

impl Collector {
    fn begin_run(&mut self, derived: bool) {
        self.next = 0;
        let response = &mut self.response;
        response.reached = 0;
        let values = self.times.len() * self.sources.len();
        response.values.clear();
        response.values.resize(values, f64::NAN);
        response.derivatives.clear();
        response.derivatives.resize(if derived { values * response.parameters } else { 0 }, f64::NAN);
    }
}

impl Sink for Collector {
    fn begin(&mut self, _tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.constants.clear();
        self.constants.extend_from_slice(parameters);
        Ok(())
    }

    fn row(&mut self, t: f64, row: &[f64], kind: RowKind) -> io::Result<()> {
        // Values at the time of an event are those after it.
        let is_after = kind == RowKind::AfterEvent && self.next > 0 && self.times[self.next - 1] == t;
        let time = if is_after { self.next - 1 } else { self.next };
        if self.times.get(time) != Some(&t) {
            return Ok(());
        }
        let count = self.response.parameters;
        let first = time * self.sources.len();
        for (position, source) in (first..).zip(&self.sources) {
            let (list, k, behind) = match source.place {
                Place::Output(k) => (row, k as usize, self.row),
                Place::Parameter(k) => (self.constants.as_slice(), k as usize, self.parameters),
                Place::Constant(value) => {
                    self.response.values[position] = if source.negated { -value } else { value };
                    if !self.response.derivatives.is_empty() {
                        self.response.derivatives[position * count..(position + 1) * count].fill(0.0);
                    }
                    continue;
                }
            };
            let sign = if source.negated { -1.0 } else { 1.0 };
            self.response.values[position] = sign * list[k];
            if !self.response.derivatives.is_empty() {
                let target = &mut self.response.derivatives[position * count..(position + 1) * count];
                let first = behind + k * count;
                for (target, value) in target.iter_mut().zip(&list[first..first + count]) {
                    *target = sign * value;
                }
            }
        }
        self.next = time + 1;
        self.response.reached = self.next;
        Ok(())
    }
}

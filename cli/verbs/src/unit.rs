//! A unit of another tool (`X.fmu`) run like a model: its parameters and inputs by name, its results in the same files.

use std::path::Path;
use std::sync::Arc;

use hyd_fmi_import::{Exchange, Fault, Host, StepOptions, StepRun, Stepping, Unit, Version};
use hyd_run::{
    Beside, Counters, Facts, Failure, InputTable, Outcome, Ran, RunArguments, Sizes, UnitUse, options, parameters,
    record,
};
use hyd_runtime::{Options, SolveError, Stage, Statistics, Summary, Warning};
use hyd_system::given::{Given, string};
use hyd_system::{AssertionReport, DaeSystem, EvalFailure, InputSite, Tables};

use crate::clock;

/// The ending of the files of units.
const ENDING: &str = "fmu";

/// The two kinds of use of a unit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// The unit gives rates, and the solver of this program integrates.
    ModelExchange,
    /// The unit integrates by itself from one communication point to the next.
    CoSimulation,
}

/// A unit and how it is to be run.
pub struct UnitRun<'a> {
    /// The file.
    pub file: &'a Path,
    /// Which kind of use; none: model exchange where the unit offers it.
    pub kind: Option<Kind>,
    /// Distance of communication points (s); none: as the unit proposes, else the output interval.
    pub step: Option<f64>,
    /// How its process is begun.
    pub host: &'a Host,
    /// Parameters that are set.
    pub set: &'a [(String, String)],
    /// Recorded inputs.
    pub table: Option<&'a InputTable>,
    /// Options of the run.
    pub arguments: &'a RunArguments,
    /// All values of the shown variables are needed, not only the last.
    pub drawn: bool,
}

/// What names of start values end with.
const START: &str = ".start";

/// True if a file is a unit by its name.
pub fn is_unit(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING))
}

/// What both kinds of use take parameters by.
trait Settable {
    fn tables(&self) -> Arc<Tables>;
    fn set_number(&mut self, index: usize, value: f64) -> bool;
    fn set_text(&mut self, name: &str, text: &str) -> bool;
    fn begin_with(&mut self, name: &str, value: f64) -> bool;
    fn outside(&self) -> Option<String>;
}

impl Settable for Exchange {
    fn tables(&self) -> Arc<Tables> {
        Arc::clone(DaeSystem::tables(self))
    }
    fn set_number(&mut self, index: usize, value: f64) -> bool {
        self.set_parameter(index, value).is_ok()
    }
    fn set_text(&mut self, name: &str, text: &str) -> bool {
        Exchange::set_text(self, name, text).is_some()
    }
    fn begin_with(&mut self, name: &str, value: f64) -> bool {
        Exchange::begin_with(self, name, value).is_some()
    }
    fn outside(&self) -> Option<String> {
        Exchange::outside(self)
    }
}

impl Settable for Stepping {
    fn tables(&self) -> Arc<Tables> {
        Arc::clone(Stepping::tables(self))
    }
    fn set_number(&mut self, index: usize, value: f64) -> bool {
        self.set_parameter(index, value).is_ok()
    }
    fn set_text(&mut self, name: &str, text: &str) -> bool {
        Stepping::set_text(self, name, text).is_some()
    }
    fn begin_with(&mut self, name: &str, value: f64) -> bool {
        Stepping::begin_with(self, name, value).is_some()
    }
    fn outside(&self) -> Option<String> {
        Stepping::outside(self)
    }
}

/// What came of a run.
pub struct UnitOutcome {
    /// As of any run.
    pub outcome: Outcome,
    /// Why the unit cannot be used any more, if that is what ended the run.
    pub fault: Option<Fault>,
}

impl UnitRun<'_> {
    /// Runs the unit.
    ///
    /// # Errors
    /// Wrong usage, a unit that cannot be read, a result file that cannot be written; that the run failed stands in the outcome.
    pub fn simulate(&self, stop: &dyn Fn() -> bool) -> Result<UnitOutcome, Failure> {
        let begin = clock::cpu_seconds();
        let unit = Unit::open(self.file).map_err(fault)?;
        let kind = self.chosen(&unit)?;
        let driven = self.table.map(InputTable::names).unwrap_or_default();
        let beside = Beside { drawn: self.drawn, into: None, only_shown: true, stop, progress: true };
        match kind {
            Kind::ModelExchange => self.exchange(&unit, &driven, begin, beside),
            Kind::CoSimulation => self.stepping(&unit, &driven, begin, beside),
        }
    }

    fn chosen(&self, unit: &Unit) -> Result<Kind, Failure> {
        let (exchange, stepping) = (unit.description.exchange.is_some(), unit.description.stepping.is_some());
        let kind = self.kind.unwrap_or(if exchange { Kind::ModelExchange } else { Kind::CoSimulation });
        let lacks = |what: &str, has: &str| {
            Err(Failure::Usage(format!("--as: `{}` is not for {what}, only for {has}", unit.file)))
        };
        match kind {
            Kind::ModelExchange if !exchange => lacks("model exchange", "co-simulation"),
            Kind::CoSimulation if !stepping => lacks("co-simulation", "model exchange"),
            Kind::ModelExchange if self.step.is_some() => Err(Failure::Usage(
                "--step is the distance of communication points of co-simulation; in model exchange the solver chooses its steps \
                 (`--as co-simulation`)"
                    .to_string(),
            )),
            _ => Ok(kind),
        }
    }

    /// Times, tolerance and output; the unit's proposals come behind what the command line says.
    fn options(&self, unit: &Unit, interval: Option<f64>) -> Result<Options, Failure> {
        let proposed = unit.description.experiment;
        let experiment = hyd_payload::Experiment {
            start: proposed.start,
            stop: proposed.stop,
            tolerance: proposed.tolerance,
            interval,
        };
        options(self.arguments, &InputTable::experiment(self.table, &experiment, self.arguments.start))
    }

    /// Sets parameters; refuses values outside of their limits.
    fn set(&self, unit: &Unit, system: &mut dyn Settable) -> Result<(), Failure> {
        let mut numbers = Vec::new();
        for (name, text) in self.set {
            let named = |name: &str| unit.description.variables.iter().find(|variable| *variable.name == *name);
            let variable = named(name);
            if let (None, Some(state)) = (variable, name.strip_suffix(START)) {
                let value = text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
                let value =
                    value.ok_or_else(|| Failure::Fault(format!("`{name}={text}`: it needs a finite number")))?;
                if named(state).is_some() {
                    if !system.begin_with(state, value) {
                        return Err(Failure::Fault(format!("the unit finds the start of `{state}` by itself")));
                    }
                    continue;
                }
            }
            if variable.is_some_and(|own| unit.description.is_start_free(own)) {
                return Err(Failure::Fault(format!(
                    "`{name}` cannot be set: it is a variable, not a parameter; `--set {name}{START}={text}` sets its start value"
                )));
            }
            let is_text = variable.is_some_and(|v| v.kind == hyd_fmi_import::Kind::Text);
            let is_parameter = variable.is_some_and(|v| v.causality == hyd_fmi_import::Causality::Parameter);
            match (is_text, is_parameter) {
                (true, true) => {
                    let given = Given::read(text).map_err(|why| Failure::Fault(format!("`{name}={text}`: {why}")))?;
                    let leaves = given.leaves();
                    let [leaf] = leaves.as_slice() else {
                        return Err(Failure::Fault(format!("`{name}={text}`: it is not an array")));
                    };
                    if !system.set_text(name, &string(leaf)) {
                        return Err(Failure::Fault(format!("`{name}` is an array of texts, which cannot be set")));
                    }
                }
                (true, false) => {
                    return Err(Failure::Fault(format!("`{name}` cannot be set: it is a variable, not a parameter")));
                }
                _ => numbers.push((name.clone(), text.clone())),
            }
        }
        let tables = system.tables();
        for (index, value) in parameters::changes(&tables, &numbers, &[]).map_err(Failure::Fault)? {
            if !system.set_number(index as usize, value) {
                return Err(Failure::Fault(format!("a parameter of `{}` cannot be set to {value}", unit.file)));
            }
        }
        system.outside().map_or(Ok(()), |sentence| Err(Failure::Fault(sentence)))
    }

    fn facts(&self, unit: &Unit, kind: Kind, step: Option<f64>, begin: f64, warnings: Vec<String>) -> Facts {
        let description = &unit.description;
        let used = UnitUse {
            file: unit.file.clone(),
            version: if description.version == Version::Two { "2.0" } else { "3.0" },
            tool: description.tool.clone(),
            kind: if kind == Kind::ModelExchange { "model-exchange" } else { "co-simulation" },
            step,
            own_process: true,
            calls: 0,
        };
        Facts {
            model: description.model.to_string(),
            translate_s: clock::cpu_seconds() - begin,
            warnings,
            unit: Some(used),
            ..Facts::default()
        }
    }

    fn exchange(&self, unit: &Unit, driven: &[String], begin: f64, beside: Beside<'_>) -> Result<UnitOutcome, Failure> {
        if let Some(names) = self.arguments.sensitivity.as_ref().filter(|names| !names.0.is_empty()) {
            return Err(Failure::Usage(format!(
                "--sensitivity {}: derivatives by parameters are not known for a unit of another tool",
                names.0.join(",")
            )));
        }
        let options = self.options(unit, unit.description.experiment.step)?;
        let mut system = Exchange::new(unit, self.host, driven).map_err(fault)?;
        system.expect(options.tolerance, options.stop);
        let mut warnings = [unit.notes.as_slice(), system.notes()].concat();
        self.set(unit, &mut system)?;
        if let Some(table) = self.table {
            warnings.extend(table.recorded(&mut system, (options.start, options.stop), &known(unit))?.warnings);
            warnings.extend(table.left_over(self.arguments.stop, options.stop));
        }
        let facts = self.facts(unit, Kind::ModelExchange, None, begin, warnings);
        let mut outcome = hyd_run::simulate(&mut system, self.arguments, &options, facts, beside)?;
        if let Some(used) = &mut outcome.summary.unit {
            used.calls = system.counts().calls;
            used.own_process = system.is_apart();
        }
        let fault = system.fault().cloned();
        Ok(UnitOutcome { outcome, fault })
    }

    fn stepping(&self, unit: &Unit, driven: &[String], begin: f64, beside: Beside<'_>) -> Result<UnitOutcome, Failure> {
        self.refuse_solver_options()?;
        let proposed = unit.description.experiment.step;
        let mut options = self.options(unit, proposed)?;
        let span = options.stop - options.start;
        let step = match self.step {
            Some(step) if !(step.is_finite() && step > 0.0) => {
                return Err(Failure::Usage(format!("--step {step}: the step must be a positive number")));
            }
            Some(step) => step,
            None => match proposed.filter(|_| self.arguments.intervals.is_none()) {
                Some(step) => step,
                None => span / options.intervals as f64,
            },
        };
        let mut system = Stepping::new(unit, self.host, driven).map_err(fault)?;
        let times = StepOptions { start: options.start, stop: options.stop, step, tolerance: options.tolerance };
        let count = system.count(&times).map_err(Failure::Usage)?;
        let every = self.every(count)?;
        options.intervals = usize::try_from(count.div_ceil(every)).unwrap_or(usize::MAX).max(1);
        let mut warnings = [unit.notes.as_slice(), system.notes()].concat();
        self.set(unit, &mut system)?;
        if let Some(table) = self.table {
            let sites: Vec<InputSite> = system.inputs().to_vec();
            let mut set = |input: usize, series: &_| system.set_input(input, series);
            let recorded = table.recorded_by(&sites, &mut set, (options.start, options.stop), &known(unit))?;
            warnings.extend(recorded.warnings);
            warnings.extend(table.left_over(self.arguments.stop, options.stop));
        }
        let facts = self.facts(unit, Kind::CoSimulation, Some(step), begin, warnings);
        let sizes = Sizes { tables: Settable::tables(&system), states: 0, unknowns: 0 };
        let mut lost = None;
        let outcome = record(&sizes, self.arguments, &options, facts, beside, &mut |sink, stop| {
            let run = system.run(&times, (count, every), sink, stop);
            let statistics = Statistics { steps: system.steps, ..Statistics::default() };
            let outcome = ended(run, system.time, &statistics, &mut lost);
            let warnings = hyd_run::warning_texts(&repeated(&system.said));
            let (methods, jumps) = Default::default();
            Ran {
                outcome,
                warnings,
                counters: Counters::from(&statistics),
                methods,
                jumps,
                profile: None,
                rescue: None,
            }
        });
        let mut outcome = outcome?;
        if let Some(used) = &mut outcome.summary.unit {
            used.calls = system.counts().calls;
        }
        Ok(UnitOutcome { outcome, fault: lost })
    }

    /// Rows for every so many steps.
    fn every(&self, count: u64) -> Result<u64, Failure> {
        let Some(intervals) = self.arguments.intervals.filter(|_| self.step.is_some()) else { return Ok(1) };
        match u64::try_from(intervals).ok().filter(|intervals| *intervals > 0 && count.is_multiple_of(*intervals)) {
            Some(intervals) => Ok((count / intervals).max(1)),
            None => Err(Failure::Usage(format!(
                "--intervals {intervals}: rows are those of communication points, and the run has {count} of them, which is not a multiple"
            ))),
        }
    }

    fn refuse_solver_options(&self) -> Result<(), Failure> {
        let arguments = self.arguments;
        let given = [
            ("--solver", !matches!(arguments.solver, hyd_run::Solver::Auto)),
            ("--sensitivity", arguments.sensitivity.as_ref().is_some_and(|names| !names.0.is_empty())),
            ("--max-steps", arguments.max_steps.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((option, _)) => Err(Failure::Usage(format!(
                "{option} is for the solver of hyd, and in co-simulation the unit brings its own"
            ))),
            None => Ok(()),
        }
    }
}

/// What a unit said, once each.
fn repeated(said: &[(f64, AssertionReport)]) -> Vec<Warning> {
    let mut list: Vec<Warning> = Vec::new();
    for (time, report) in said {
        match list.iter_mut().find(|known| known.report == *report) {
            Some(known) => (known.until, known.points) = (*time, known.points + 1),
            None => list.push(Warning { time: *time, until: *time, points: 1, report: report.clone() }),
        }
    }
    list
}

fn ended(run: StepRun, time: f64, statistics: &Statistics, lost: &mut Option<Fault>) -> Result<Summary, SolveError> {
    let summary = |terminated: Option<String>| Summary {
        rescue: None,
        undetermined: Vec::new(),
        time,
        statistics: *statistics,
        warnings: Vec::new(),
        jumps: Vec::new(),
        phases: Vec::new(),
        terminated,
    };
    match run {
        StepRun::Done => Ok(summary(None)),
        StepRun::Terminated => Ok(summary(Some("the unit ends the run".to_string()))),
        StepRun::Interrupted => Err(SolveError::Interrupted { time }),
        StepRun::Sink(error) => Err(SolveError::Sink { time, error }),
        StepRun::Failed(fault) => {
            let failure = EvalFailure { reason: fault.to_string(), ..EvalFailure::default() };
            *lost = Some(fault);
            let stage = if statistics.steps == 0 { Stage::Start } else { Stage::Step };
            Err(SolveError::Evaluation { stage, time, failure: Box::new(failure), equation: None })
        }
    }
}

fn fault(fault: Fault) -> Failure {
    Failure::Fault(fault.to_string())
}

/// Names of the inputs that a table may have.
fn known(unit: &Unit) -> Vec<String> {
    let variables = unit.description.variables.iter();
    let inputs = variables.filter(|variable| variable.causality == hyd_fmi_import::Causality::Input);
    inputs.map(|variable| variable.name.to_string()).collect()
}

//! One run of a system: options, result file, summary, messages.
//!
//! Times and tolerance come from the command line, else from the model's `experiment` annotation, else 1 s and 1e-6.  A result
//! file is whole or absent: a run that fails, or that Ctrl-C stops, leaves what it computed as `F.partial.csv`, and what stood in
//! `F.csv` stays.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_frames::{RunStream, is_parquet};
use hyd_payload::Experiment;
use hyd_results::{Column, Format, ResultFile, Sink, Tee, columns};
use hyd_runtime::{Options, Rescue, Simulator, SolveError, Summary};
use hyd_system::{DaeSystem, Place, Structure, Tables, VariableInfo};

use crate::arguments::{MessageFormat, RunArguments, Solver};
use crate::recorder::Recorder;
use crate::run_profile::RunProfile;
use crate::run_summary::{Counters, FinalValues, MethodUse, RunSummary, Status, UnitUse};
use crate::selection::{MOST_CURVES, Selection, Shown};
use crate::target::check_target;
use crate::{Failure, clock, interrupt, output};

/// Jumps that are reported one by one.
const MOST_JUMPS: usize = 5;
/// Values beyond this (in SI units) are no quantity of a machine.
const LARGE: f64 = 1e30;
/// From so many rows on a run says that they are many.
const MANY_ROWS: usize = 5_000_000;
/// Values of a run from which on code for a part of them, half a millisecond, is worth making.
const WORTH_CODE: usize = 200_000;
/// Steps that a run is expected to take.
const USUAL_STEPS: usize = 1000;
/// Warnings that are reported one by one.
const MOST_WARNINGS: usize = 20;

/// What the summary says of a model besides its run.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Name of the model.
    pub model: String,
    /// Different expressions.
    pub templates: usize,
    /// Bytes of machine code, 0 when interpreted.
    pub code_bytes: usize,
    /// CPU seconds until the system was ready.
    pub translate_s: f64,
    /// What the user should know of the code.
    pub warnings: Vec<String>,
    /// The model is a unit of another tool.
    pub unit: Option<UnitUse>,
}

/// How a run ended.
pub struct Outcome {
    /// What is said of it.
    pub summary: RunSummary,
    /// What the solver says.
    pub result: Result<Summary, SolveError>,
    /// The values of the shown variables.
    pub recorder: Recorder,
    /// How initial values were found where the start values do not lead to them.
    pub rescue: Option<Rescue>,
}

/// What goes with a run beside its options.
pub struct Beside<'a> {
    /// All values of the shown variables are needed, not only the last.
    pub drawn: bool,
    /// Also gets all rows.
    pub into: Option<&'a mut dyn Sink>,
    /// Nobody looks at what `--variables` leaves out, so it need not be evaluated.
    pub only_shown: bool,
    /// Asked after every step; true ends the run.
    pub stop: &'a dyn Fn() -> bool,
    /// Shows on a terminal how far the run has come.
    pub progress: bool,
}

impl Beside<'_> {
    /// A run of a command: Ctrl-C ends it, and a terminal shows how far it has come.
    pub fn command(drawn: bool) -> Self {
        interrupt::listen();
        Self { drawn, into: None, only_shown: true, stop: &interrupt::requested, progress: true }
    }
}

/// What is run: names, and sizes for the summary.
pub struct Sizes {
    /// Names and places.
    pub tables: Arc<Tables>,
    /// Number of states.
    pub states: usize,
    /// Number of unknowns.
    pub unknowns: usize,
}

/// What whoever runs something says of the run.
pub struct Ran {
    /// How it ended.
    pub outcome: Result<Summary, SolveError>,
    /// What the user should know of it.
    pub warnings: Vec<String>,
    /// Its counters.
    pub counters: Counters,
    /// Methods used from when on.
    pub methods: Vec<MethodUse>,
    /// Where loops of equations went over to another of their solutions.
    pub jumps: Vec<String>,
    /// Where its time went, if that was asked for.
    pub profile: Option<RunProfile>,
    /// How initial values were found where the start values do not lead to them; its sentence is among the warnings.
    pub rescue: Option<Rescue>,
}

/// Runs something: rows go to the sink, and the question whether to stop is asked on the way.
pub type Running<'a> = dyn FnMut(&mut dyn Sink, &dyn Fn() -> bool) -> Ran + 'a;

/// Runs a system.
///
/// # Errors
/// Wrong usage, or a result file that cannot be written; that the solver gave up stands in the outcome.
pub fn simulate(
    system: &mut dyn DaeSystem,
    arguments: &RunArguments,
    options: &Options,
    facts: Facts,
    beside: Beside<'_>,
) -> Result<Outcome, Failure> {
    let structure = system.structure();
    let sizes = Sizes {
        tables: Arc::clone(system.tables()),
        states: structure.differential.iter().filter(|&&state| state).count(),
        unknowns: structure.unknowns,
    };
    let (needed, derived) = match beside.only_shown {
        true => needed_outputs(arguments, options, (&sizes.tables, structure.outputs))?,
        false => (None, None),
    };
    let options = &Options { needed_outputs: needed, derived_outputs: derived, ..options.clone() };
    record(&sizes, arguments, options, facts, beside, &mut |sink, stop| {
        let mut simulator = Simulator::new(system.structure());
        if arguments.profile {
            simulator.profile_with(clock::wall_seconds);
        }
        let outcome = simulator.run(system, options, sink, stop);
        Ran {
            outcome,
            warnings: warnings(arguments, &simulator, system.structure()),
            counters: Counters::from(simulator.statistics()),
            methods: simulator.phases().iter().map(MethodUse::from).collect(),
            jumps: simulator.jumps().iter().map(ToString::to_string).collect(),
            profile: simulator.profile().map(|found| RunProfile::new(found, system.tables(), simulator.statistics())),
            rescue: simulator.rescue().cloned(),
        }
    })
}

/// Lets `run` run what it is about, with result file, progress and summary.
///
/// # Errors
/// As [`simulate`].
pub fn record(
    sizes: &Sizes,
    arguments: &RunArguments,
    options: &Options,
    facts: Facts,
    beside: Beside<'_>,
    run: &mut Running<'_>,
) -> Result<Outcome, Failure> {
    let Beside { drawn, into, stop, progress, .. } = beside;
    let selection = Selection::new(arguments.variables.as_deref())?;
    let shown = shown(arguments, &selection, &sizes.tables, drawn)?;
    let left_out = selection.left_out(&sizes.tables, shown.len());
    let mut recorder = Recorder::new(shown, drawn, (options.start, options.stop), progress);
    recorder.file = result_file(arguments.result.as_deref(), &selection)?;
    let begin = clock::cpu_seconds();
    let ran = match into {
        Some(into) => run(&mut Tee(into, &mut recorder), stop),
        None => run(&mut recorder, stop),
    };
    let simulate_s = clock::cpu_seconds() - begin;
    recorder.end();

    let outcome = ran.outcome;
    let status = status(&outcome);
    let result = match (recorder.file.take(), &arguments.result) {
        (Some(file), Some(path)) => close(file, path, status)?,
        _ => None,
    };
    let many = many_rows(options);
    let last = recorder.last_values();
    let grown = grown(&last).filter(|_| outcome.is_ok()).into_iter().collect();
    // A run that failed for them says why.
    let unknown = recorder.unknown_derivatives().filter(|_| outcome.is_ok()).into_iter().collect();
    let summary = RunSummary {
        status,
        message: message(&outcome),
        model: facts.model,
        unit: facts.unit,
        start: options.start,
        stop: options.stop,
        time: time_reached(&outcome, options),
        tolerance: options.tolerance,
        solver: arguments.solver.name(),
        methods: ran.methods,
        states: sizes.states,
        unknowns: sizes.unknowns,
        templates: facts.templates,
        code_bytes: facts.code_bytes,
        translate_s: facts.translate_s,
        simulate_s,
        counters: ran.counters,
        warnings: [facts.warnings, ran.warnings, many, grown, unknown].concat(),
        jumps: ran.jumps,
        result: result.map(|path| path.display().to_string()),
        plot: None,
        profile_page: None,
        told: None,
        profile: ran.profile,
        final_values: FinalValues(last),
        left_out,
    };
    Ok(Outcome { summary, result: outcome, recorder, rescue: ran.rescue })
}

/// What the user should know of a run that did not fail for it.
fn warnings(arguments: &RunArguments, simulator: &Simulator, structure: &Structure) -> Vec<String> {
    let mut list: Vec<String> = simulator.rescue().map(ToString::to_string).into_iter().collect();
    list.extend(warning_texts(simulator.warnings()));
    let open = simulator.undetermined();
    list.extend(open.iter().take(MOST_WARNINGS).map(ToString::to_string));
    if let Some(more @ 1..) = open.len().checked_sub(MOST_WARNINGS) {
        list.push(format!("{more} more groups of variables are not determined at times"));
    }
    if matches!(arguments.solver, Solver::Bdf) && !structure.delays.is_empty() {
        let reason = "the model has delays, and kinks of the recorded past shorten the steps of `--solver bdf`";
        list.push(format!("{reason}; `auto` takes the one-step method"));
    }
    list
}

/// What is said where a value at the end is larger than anything that is measured; of a state if one is that large.
fn grown(last: &[(String, f64, String)]) -> Option<String> {
    let large: Vec<&(String, f64, String)> = last.iter().filter(|(_, value, _)| value.abs() > LARGE).collect();
    let is_state = |name: &str| last.iter().any(|(other, ..)| *other == format!("der({name})"));
    let (name, value, unit) = large.iter().find(|(name, ..)| is_state(name)).or(large.first())?;
    let space = if unit.is_empty() { "" } else { " " };
    Some(format!(
        "`{name}` is {value:.3e}{space}{unit} at the end: it grows without bound, as it does where a feedback, a force or a flow has the \
         wrong sign"
    ))
}

/// What is said of more rows than anybody reads: they may take far longer than the run.
fn many_rows(options: &Options) -> Vec<String> {
    if options.every_step || options.intervals < MANY_ROWS {
        return Vec::new();
    }
    let interval = (options.stop - options.start) / options.intervals as f64;
    let sentence = format!(
        "an output interval of {interval:.3e} s makes {} rows, which may take most of the time; `--intervals 500` makes fewer, and \
         `Interval` of the model's `experiment` says how many by itself",
        options.intervals.saturating_add(1)
    );
    vec![sentence]
}

/// What can be refused before any work.  `model`: the model's text, if there is one.
///
/// # Errors
/// Wrong usage.
pub fn check_usage(arguments: &RunArguments, model: Option<&Path>) -> Result<(), Failure> {
    if let Some(path) = &arguments.result {
        check_target("--result", path, model.as_slice())?;
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        if !matches!(extension.as_str(), "" | "csv" | "mat" | "parquet") {
            let path = path.display();
            return Err(Failure::Usage(format!("--result `{path}`: results end in .csv, .mat or .parquet")));
        }
    }
    Selection::new(arguments.variables.as_deref()).map(|_| ())
}

/// Times, tolerance and output of a run.
///
/// # Errors
/// Wrong usage.
pub fn options(arguments: &RunArguments, experiment: &Experiment) -> Result<Options, Failure> {
    let start = arguments.start.or(experiment.start).unwrap_or(0.0);
    let stop = arguments.stop.or(experiment.stop).unwrap_or(start + 1.0);
    let mut options = Options::new(start, stop);
    options.tolerance = arguments.tolerance.or(experiment.tolerance).unwrap_or(options.tolerance);
    options.intervals = arguments.intervals.or(stated_intervals(experiment, start, stop)).unwrap_or(options.intervals);
    options.every_step = arguments.every_step;
    options.rescue = true;
    options.max_steps = arguments.max_steps.map_or(options.max_steps, std::num::NonZeroU64::get);
    options.solver = match arguments.solver {
        Solver::Auto => hyd_runtime::Solver::Auto,
        Solver::Bdf => hyd_runtime::Solver::Bdf,
        Solver::Esdirk => hyd_runtime::Solver::Esdirk,
    };
    options.sensitivity = arguments.sensitivity.clone().unwrap_or_default().0;
    options.check().map_err(|error| Failure::Usage(error.to_string()))?;
    Ok(options)
}

/// The number of output intervals by the model's `experiment` annotation.
pub(crate) fn stated_intervals(experiment: &Experiment, start: f64, stop: f64) -> Option<usize> {
    let interval = experiment.interval.filter(|interval| *interval > 0.0)?;
    // Too many, also more than the type holds, are refused when the run begins.
    Some(((stop - start) / interval).round().max(1.0) as usize)
}

fn shown(arguments: &RunArguments, selection: &Selection, tables: &Tables, drawn: bool) -> Result<Vec<Shown>, Failure> {
    let shown = selection.shown(tables);
    if let Some(pattern) = arguments.variables.as_deref().filter(|_| shown.is_empty()) {
        return Err(Failure::Usage(format!("no variable of the model matches `{pattern}`")));
    }
    if drawn && shown.len() > MOST_CURVES {
        let count = shown.len();
        return Err(Failure::Usage(format!("{count} variables match, and a picture holds {MOST_CURVES} curves")));
    }
    Ok(shown)
}

/// Positions in a row; none: all.
type Positions = Option<Vec<u32>>;

/// The outputs that rows need, and those whose derivatives they need, where `--variables` leaves others out.
fn needed_outputs(
    arguments: &RunArguments,
    options: &Options,
    (tables, outputs): (&Tables, usize),
) -> Result<(Positions, Positions), Failure> {
    let rows = if options.every_step { USUAL_STEPS } else { options.intervals };
    let is_much = rows.saturating_mul(outputs) >= WORTH_CODE;
    if arguments.variables.is_none() || (options.sensitivity.is_empty() && !is_much) {
        return Ok((None, None));
    }
    let selection = Selection::new(arguments.variables.as_deref())?;
    let of = |keep: &dyn Fn(&str) -> bool| {
        let kept = columns(tables, |_, name| keep(name));
        let place = |column: &Column| if let Place::Output(k) = column.source.place { Some(k) } else { None };
        kept.iter().filter_map(place).collect::<Vec<u32>>()
    };
    if options.sensitivity.is_empty() {
        return Ok((Some(of(&|name| selection.matches(name))), None));
    }
    let by = |name: &str| options.sensitivity.iter().any(|p| selection.matches(&format!("d({name})/d({p})")));
    Ok((None, Some(of(&by))))
}

/// Opens the file of `--result` in the format of its name.
fn result_file(path: Option<&Path>, selection: &Selection) -> Result<Option<ResultFile>, Failure> {
    let Some(path) = path else { return Ok(None) };
    let selection = selection.clone();
    let all = Format::of(path) == Format::Mat;
    let keep = move |variable: &VariableInfo, name: &str| match all {
        true => selection.keeps_everything(variable, name),
        false => selection.keeps(variable, name),
    };
    let opened = match is_parquet(path) {
        true => ResultFile::with(path, |file| Ok(Box::new(RunStream::new(file, path, keep)))),
        false => ResultFile::create(path, keep),
    };
    opened.map(Some).map_err(|error| unwritable(path, &error))
}

/// Gives the file its name; says which, or `None` if there is nothing worth keeping.
fn close(file: ResultFile, path: &Path, status: Status) -> Result<Option<PathBuf>, Failure> {
    let closed = match status {
        Status::Done | Status::Terminated => file.complete(),
        Status::Interrupted | Status::Failed => file.partial(),
    };
    closed.map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::Fault(format!("`{}` cannot be written: {error}", path.display()))
}

fn status(outcome: &Result<Summary, SolveError>) -> Status {
    match outcome {
        Ok(Summary { terminated: Some(_), .. }) => Status::Terminated,
        Ok(_) => Status::Done,
        Err(SolveError::Interrupted { .. }) => Status::Interrupted,
        Err(_) => Status::Failed,
    }
}

fn message(outcome: &Result<Summary, SolveError>) -> Option<String> {
    match outcome {
        Ok(summary) => summary.terminated.clone(),
        Err(error) => Some(error.to_string()),
    }
}

fn time_reached(outcome: &Result<Summary, SolveError>, options: &Options) -> f64 {
    match outcome {
        Ok(summary) => summary.time,
        Err(error) => error.time().unwrap_or(options.start),
    }
}

/// Sentences for warnings of a run, and one for all beyond the first few.
pub fn warning_texts(warnings: &[hyd_runtime::Warning]) -> Vec<String> {
    let mut list: Vec<String> = warnings.iter().take(MOST_WARNINGS).map(warning_text).collect();
    if let Some(more @ 1..) = warnings.len().checked_sub(MOST_WARNINGS) {
        list.push(format!("{more} more like these"));
    }
    list
}

fn warning_text(warning: &hyd_runtime::Warning) -> String {
    let report = &warning.report;
    let further = match warning.points {
        0 | 1 => String::new(),
        points => format!(", and until t = {} s, {points} points", warning.until),
    };
    let place = match report.line {
        0 => String::new(),
        line => format!(" ({}:{line})", report.file),
    };
    format!("at t = {} s: {}{place}{further}", warning.time, report.message)
}

/// Prints warnings, notes and the summary.
///
/// # Errors
/// When standard output cannot be written.
pub fn tell(summary: &RunSummary, json: bool, format: MessageFormat) -> Result<(), Failure> {
    let is_told = |warning: &&String| summary.told.as_ref() == Some(*warning);
    for warning in summary.warnings.iter().filter(|warning| !is_told(warning)) {
        output::sentence("warning", warning, format);
    }
    for jump in summary.jumps.iter().take(MOST_JUMPS) {
        output::sentence("note", jump, format);
    }
    if let Some(more @ 1..) = summary.jumps.len().checked_sub(MOST_JUMPS) {
        output::sentence("note", &format!("{more} more jumps to other solutions"), format);
    }
    if json {
        output::print(&summary.json())
    } else if summary.status != Status::Failed {
        output::print(&summary.text())
    } else {
        Ok(())
    }
}

/// The failure of a run; `explain` prints why the solver gave up, and gets where results up to there are.
pub fn finish(summary: &RunSummary, error: SolveError, explain: &dyn Fn(&SolveError, Option<String>)) -> Failure {
    let kept = match (&summary.result, summary.status) {
        (Some(path), Status::Failed) => Some(format!("results up to there are in {path}")),
        _ => None,
    };
    match error {
        SolveError::Option(_) => return Failure::Usage(error.to_string()),
        SolveError::Interrupted { .. } => return Failure::Solver(error.to_string()),
        SolveError::Sink { .. } => return Failure::Fault(error.to_string()),
        _ => {}
    }
    explain(&error, kept);
    match error {
        SolveError::Assertion { .. } => Failure::Reported,
        _ => Failure::SolverReported,
    }
}

//! Runs of a translated model under the conditions of shots: many at once, on all cores.
//!
//! A [`Machine`] keeps one system and one simulator per thread and uses them run after run.  A run gives the channels at
//! the times of the shot ([`Grid`]).  A run in which rounding errors grow
//! along a torn loop is done again by a machine with whole loops, which is translated when it is needed first.

pub(crate) mod foreign;
pub(crate) mod grid;
pub(crate) mod span;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use hyd_compiler::{ForeignBlock, did_you_mean};
use hyd_runtime::{Options, Simulator};
use hyd_system::{DaeSystem, Place, Settable, Source, Tables, ValueKind};

use crate::bench::recorded::ShotInputs;
use crate::machine::foreign::{Foreign, joined};
use crate::machine::grid::{Derivatives, Grid, Limit};
use crate::machine::span::Span;
use crate::variant::translated::{ChannelNames, Translated};
use crate::{Fault, Watch};

/// Steps after which a run is given up, in all and by output interval if that is more: many times as many as one takes
/// whose numbers make sense.
const MOST_STEPS: (u64, u64) = (40_000, 20);
/// Part of a parameter by which it is changed for a difference of runs of a unit, and the tolerance of such runs: errors of a run, as far as they
/// differ at all between neighbours, are a ten thousandth of a derivative times its parameter.
const DIFFERENCE: f64 = 1e-3;
const DIFFERENCE_TOLERANCE: f64 = 1e-7;
/// Relative tolerance of runs with delays: their errors stay below 0.06 standard deviations of the noise of recorded sets.
const WAVE_TOLERANCE: f64 = 3e-5;

/// Where a parameter stands, and with which sign.
#[derive(Clone, Debug)]
pub struct ParameterPlace {
    name: String,
    index: usize,
    negated: bool,
}

impl ParameterPlace {
    /// The full name of the parameter.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Both are one parameter, whatever it is called.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.index == other.index
    }
}

/// Channels at the output points of a run, or why it failed.
pub(crate) type Answer = Result<Vec<Vec<f64>>, Fault>;

/// Channels at the output points and their derivatives.
type Derived = (Vec<Vec<f64>>, Derivatives);

/// Channels and their derivatives, or why the run failed.
pub(crate) type DerivedAnswer = Result<Derived, Fault>;

/// A run to be made.
#[derive(Clone, Debug)]
pub struct Job {
    /// Times: position of the shot, whose recorded inputs drive the run.
    pub span: usize,
    /// Parameter values.
    pub values: Vec<f64>,
    /// Positions in the list of places of the parameters by which derivatives are wanted.
    pub derived: Vec<usize>,
}

/// A translated model, ready to be run many times.
pub struct Machine {
    tables: Arc<Tables>,
    nominal: Vec<f64>,
    channels: Vec<Source>,
    tolerance: f64,
    delays: bool,
    limits: Vec<Limit>,
    workers: Vec<Mutex<Worker>>,
    /// Recorded inputs by shot.
    inputs: Arc<ShotInputs>,
    origin: Origin,
    /// The same with whole loops, if there is one.
    whole: OnceLock<Option<Box<Machine>>>,
    /// Of all machines of a setup.
    watch: Watch,
}

/// Where the systems of a machine come from: a text, and whoever runs the units of other tools in it.
struct Origin {
    translated: Translated,
    joiner: Option<Foreign>,
}

struct Worker {
    system: Box<dyn DaeSystem>,
    simulator: Simulator,
    grid: Grid,
}

impl Machine {
    /// A machine of `threads` threads for a model whose channels are the variables that `variant` adds; `watch` counts its runs.
    ///
    /// # Errors
    /// When the model cannot be bound.
    pub(crate) fn new(
        translated: Translated,
        (channels, inputs): (usize, Arc<ShotInputs>),
        tolerance: f64,
        (threads, watch): (usize, &Watch),
        joiner: Option<&Foreign>,
    ) -> Result<Self, Fault> {
        let model = translated.model.clone();
        let tables = model.instantiate().tables().clone();
        let limits = model.payload().parameters.limits.iter().filter_map(|limit| {
            let variable = tables.variables.get(limit.variable as usize)?;
            let source = *variable.sources.get(limit.element as usize)?;
            let (name, kind) = (variable.name.element(limit.element as usize), variable.kind.clone());
            Some(Limit { name, kind, source, range: (limit.min, limit.max) })
        });
        let limits: Vec<Limit> = limits.collect();
        let mut sources = Vec::new();
        for k in 0..channels {
            let name = translated.channels.of(k);
            let found = tables.find(&name).and_then(|(variable, element)| variable.sources.get(element).copied());
            sources.push(found.ok_or_else(|| Fault::new(format!("the model has lost channel {k}")))?);
        }
        let blocks = translated.blocks.clone();
        let make = || joined(Box::new(model.instantiate()), &blocks, joiner);
        let origin = Origin { translated, joiner: joiner.cloned() };
        let mut system = make()?;
        let tables = system.tables().clone();
        inputs.hand_over(&mut *system, 0)?;
        let bound = system.bind(0.0);
        bound.map_err(|failure| Fault::run(format!("the model cannot start: {}", failure.reason)))?;
        let nominal = system.parameters().to_vec();
        let delays = !system.structure().delays.is_empty();
        let worker = |system: Box<dyn DaeSystem>| {
            let simulator = Simulator::new(system.structure());
            let numbers = (system.structure().outputs, system.parameters().len());
            let grid = Grid::new(sources.clone(), limits.clone(), numbers);
            Mutex::new(Worker { system, simulator, grid })
        };
        // Systems with units are dear: each has a process of its own.
        let others = (1..threads.max(1)).map(|_| make());
        let systems = std::iter::once(Ok(system)).chain(others);
        let workers = systems.map(|made| made.map(worker)).collect::<Result<Vec<_>, Fault>>()?;
        Ok(Self {
            tables,
            nominal,
            channels: sources.clone(),
            tolerance,
            delays,
            workers,
            limits: limits.clone(),
            inputs,
            origin,
            whole: OnceLock::new(),
            watch: watch.clone(),
        })
    }

    /// Names and places of the model.
    pub fn tables(&self) -> &Arc<Tables> {
        &self.tables
    }

    /// Units of other tools in the model.
    pub fn blocks(&self) -> &[ForeignBlock] {
        &self.origin.translated.blocks
    }

    /// How the variables of the channels are called.
    pub fn channel_names(&self) -> &ChannelNames {
        &self.origin.translated.channels
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.workers.len()
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.channels.len()
    }

    /// Where a parameter stands, and the value it has in the model.
    ///
    /// # Errors
    /// When there is none of this name or it cannot be set.
    pub fn parameter(&self, name: &str) -> Result<(ParameterPlace, f64), Fault> {
        // A unit may have names that a text can only quote.
        let found = self.tables.find(name).or_else(|| self.tables.find(&format!("'{name}'")));
        let (variable, element) = found.ok_or_else(|| self.unknown(name))?;
        match (variable.sources.get(element), &variable.settable) {
            (Some(Source { place: Place::Parameter(index), negated }), Settable::Yes) => {
                let value = self.nominal[*index as usize];
                let name = variable.name.element(element);
                let place = ParameterPlace { name, index: *index as usize, negated: *negated };
                Ok((place, if *negated { -value } else { value }))
            }
            _ => Err(Fault::new(format!(
                "`{name}` is not a parameter that can be set: it is final, follows from others or decides sizes"
            ))),
        }
    }

    /// The unit of a parameter; empty where it has none.
    pub fn unit(&self, place: &ParameterPlace) -> Arc<str> {
        self.tables.find(&place.name).map_or_else(|| "".into(), |(variable, _)| variable.unit.clone())
    }

    /// How values of a parameter are to be read.
    pub(crate) fn kind(&self, place: &ParameterPlace) -> ValueKind {
        self.tables.find(&place.name).map_or(ValueKind::Real, |(variable, _)| variable.kind.clone())
    }

    /// What a parameter may be.
    pub(crate) fn range(&self, place: &ParameterPlace) -> (f64, f64) {
        self.limits
            .iter()
            .find(|limit| limit.name == place.name)
            .map_or((f64::NEG_INFINITY, f64::INFINITY), |own| own.range)
    }

    fn unknown(&self, name: &str) -> Fault {
        let settable = self.tables.variables.iter().filter(|variable| variable.settable == Settable::Yes);
        let names: Vec<String> =
            settable.flat_map(|variable| (0..variable.sources.len()).map(|k| variable.name.element(k))).collect();
        let hint = did_you_mean(name, names.iter().map(String::as_str));
        let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
        Fault::new(format!("the model has no parameter `{name}`{hint}"))
    }

    /// Makes the runs; the answer to each is its channels at the output points, or why it failed.
    pub fn run(&self, spans: &[Span], places: &[ParameterPlace], jobs: &[Job]) -> Vec<Answer> {
        let answers = self.run_derived(spans, places, jobs);
        answers.into_iter().map(|answer| answer.map(|(values, _)| values)).collect()
    }

    /// False for models with delays, whose runs are many times as long as others.
    pub fn is_fast(&self) -> bool {
        !self.delays
    }

    /// Makes the runs and carries derivatives along where jobs want some.
    pub fn run_derived(&self, spans: &[Span], places: &[ParameterPlace], jobs: &[Job]) -> Vec<DerivedAnswer> {
        let next = AtomicUsize::new(0);
        let answers: Vec<Mutex<Option<DerivedAnswer>>> = jobs.iter().map(|_| Mutex::new(None)).collect();
        self.watch.runs.fetch_add(jobs.len(), Ordering::Relaxed);
        std::thread::scope(|scope| {
            let (next, answers) = (&next, &answers);
            for (thread, worker) in self.workers.iter().enumerate().take(jobs.len()) {
                scope.spawn(move || {
                    let mut worker = worker.lock().unwrap_or_else(PoisonError::into_inner);
                    while let Some(k) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&k| k < jobs.len()) {
                        let answer = self.one((&mut worker, thread), &spans[jobs[k].span], places, &jobs[k]);
                        *answers[k].lock().unwrap_or_else(PoisonError::into_inner) = Some(answer);
                    }
                });
            }
        });
        let given = answers.into_iter().map(|answer| answer.into_inner().unwrap_or_else(PoisonError::into_inner));
        given.map(|answer| answer.unwrap_or_else(|| Err(Fault::run("a run was not made")))).collect()
    }

    /// One run, with whole loops where those that are torn are the reason that it fails.
    fn one(
        &self,
        (worker, thread): (&mut Worker, usize),
        span: &Span,
        places: &[ParameterPlace],
        job: &Job,
    ) -> DerivedAnswer {
        let (fault, rounding) = match self.attempt(worker, span, places, job) {
            Ok(answer) => return Ok(answer),
            Err(failed) => failed,
        };
        let whole = if rounding { self.whole() } else { None };
        let again = whole.and_then(|whole| whole.again(thread, span, places, job));
        if again.is_some() {
            self.watch.whole_loops.fetch_add(1, Ordering::Relaxed);
        }
        again.ok_or(fault)
    }

    /// The machine with whole loops.
    fn whole(&self) -> Option<&Machine> {
        let make = || {
            let translated = self.origin.translated.with_whole_loops()?;
            let counts = (self.workers.len(), &self.watch);
            let channels = (self.channels.len(), self.inputs.clone());
            Machine::new(translated, channels, self.tolerance, counts, self.origin.joiner.as_ref()).ok().map(Box::new)
        };
        self.whole.get_or_init(make).as_deref()
    }

    /// A run of another machine once more, whose places may be others; none if it fails here, too.
    fn again(&self, thread: usize, span: &Span, places: &[ParameterPlace], job: &Job) -> Option<Derived> {
        let own = places.iter().map(|place| self.parameter(&place.name).ok().map(|(place, _)| place));
        let own = own.collect::<Option<Vec<_>>>()?;
        let mut worker = self.workers.get(thread)?.lock().unwrap_or_else(PoisonError::into_inner);
        self.attempt(&mut worker, span, &own, job).ok()
    }

    /// One run; if it fails, why, and whether that may be the rounding of torn loops.
    fn attempt(
        &self,
        worker: &mut Worker,
        span: &Span,
        places: &[ParameterPlace],
        job: &Job,
    ) -> Result<Derived, (Fault, bool)> {
        let is_apart = !self.blocks().is_empty();
        let is_carried = worker.system.tangents().is_some();
        let finer = self.tolerance.min(DIFFERENCE_TOLERANCE);
        if is_carried || job.derived.is_empty() || !is_apart {
            let tolerance = if is_apart && !is_carried { finer } else { self.tolerance };
            let ran = self.run_once(worker, span, places, (&job.values, job.span), &job.derived, tolerance);
            let is_known = |(_, by): &Derived| by.iter().flatten().flatten().all(|value| value.is_finite());
            // What the twins of a unit cannot say, differences of runs can.
            if job.derived.is_empty() || !is_apart || ran.as_ref().is_ok_and(is_known) {
                return ran;
            }
        }
        // Differences over steps to both sides, which cancel what is even in the step; runs are as much more exact as the steps are small.
        let mut values = job.values.clone();
        let (at, _) = self.run_once(worker, span, places, (&values, job.span), &[], finer)?;
        let mut derivatives = Vec::with_capacity(job.derived.len());
        for &place in &job.derived {
            let value = values[place];
            let (low, high) = self.range(&places[place]);
            let away = if value == 0.0 { DIFFERENCE } else { DIFFERENCE * value.abs() };
            let (before, after) = ((value - away).max(low), (value + away).min(high));
            let mut run = |changed: f64| {
                values[place] = changed;
                let ran = self.run_once(worker, span, places, (&values, job.span), &[], finer);
                values[place] = value;
                ran.map(|(channels, _)| channels)
            };
            let (left, right) = (run(before)?, run(after)?);
            let slope = |(a, b): (&f64, &f64)| (b - a) / (after - before);
            let of = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(slope).collect::<Vec<f64>>();
            derivatives.push(left.iter().zip(&right).map(of).collect());
        }
        Ok((at, derivatives))
    }

    /// One run of one system.
    fn run_once(
        &self,
        worker: &mut Worker,
        span: &Span,
        places: &[ParameterPlace],
        (values, shot): (&[f64], usize),
        derived: &[usize],
        tolerance: f64,
    ) -> Result<Derived, (Fault, bool)> {
        let Worker { system, simulator, grid } = worker;
        let system = &mut **system;
        self.inputs.hand_over(system, shot).map_err(|fault| (fault, false))?;
        for (place, &value) in places.iter().zip(values) {
            let value = if place.negated { -value } else { value };
            if system.set_parameter(place.index, value).is_err() {
                return Err((Fault::run(format!("a parameter cannot have the value {value}")), false));
            }
        }
        // Waves that run to and fro in delay lines keep the steps short; they are compared with noise, not with each other.
        let waves = self.delays;
        let tolerance = if waves { tolerance.max(WAVE_TOLERANCE) } else { tolerance };
        let mut options = Options::new(span.start, span.stop).with_tolerance(tolerance);
        options.suppress_algebraic = waves;
        options.intervals = span.intervals;
        options.sensitivity = derived.iter().map(|&place| places[place].name.clone()).collect();
        (options.needed_outputs, options.derived_outputs) = (Some(grid.outputs()), Some(grid.outputs()));
        grid.prepare(span, derived.len());
        options.max_steps = MOST_STEPS.0.max(MOST_STEPS.1 * span.intervals as u64);
        let ended = simulator.run(system, &options, grid, &|| self.watch.stopped());
        if let Err(error) = ended {
            return Err(match grid.refused() {
                Some(outside) => (Fault::new(outside), false),
                None => (Fault::run(error.to_string()), error.may_be_rounding()),
            });
        }
        let Some((values, mut derivatives)) = grid.taken() else {
            return Err((Fault::run("the model ended the run"), false));
        };
        for (by, &place) in derivatives.iter_mut().zip(derived) {
            if places[place].negated {
                by.iter_mut().flatten().for_each(|value| *value = -*value);
            }
        }
        Ok((values, derivatives))
    }
}

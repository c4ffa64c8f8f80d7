//! The run: start, step, look for events, write rows, until the stop time.
//!
//! [`Simulator`] owns all work space for systems of one structure and is used for run after run; the system, the sink and the
//! options come with each run.  The loop does no I/O itself and reads no clock.

use std::sync::Arc;

use hyd_results::{RowKind, Sink};
use hyd_system::{AssertionReport, DaeSystem, EventPhase, Instants, Structure};

use crate::course::Course;
use crate::delay::{DelayWork, Delaying, Recorder};
use crate::error::SolveError;
use crate::events::chatter::Chatter;
use crate::events::iteration::settle;
use crate::events::roots::RootWatch;
use crate::first_step::{FirstStep, FirstSteps};
use crate::initial::consistent::Consistency;
use crate::initial::rescue::Rescue;
use crate::initial::{InitialSystem, Start};
use crate::integrator::{Integrator, MethodPhase};
use crate::output::Output;
use crate::problem::Problem;
use crate::profile::{Profile, Seconds};
use crate::sensitivity::{EventSource, Sensitivity};
use crate::weights::Weights;
use crate::{Options, Statistics};

mod choosing;
mod jump;
mod onward;
mod reach;
mod stall;

use choosing::Choosing;
pub use jump::Jump;
pub use onward::{Onward, Reached};
use stall::Stall;

/// Without a stated limit a step is at most this part of the run, with and without state events to be seen.
const MOST_OF_RUN_WITH_ROOTS: f64 = 0.02;
const MOST_OF_RUN: f64 = 0.1;
/// Part of the run in which nominal changes are expected at the start.
const START_SCALE: f64 = 1e-3;

/// An assertion of level warning that did not hold.
#[derive(Clone, PartialEq, Debug)]
pub struct Warning {
    /// Time at which it ceased to hold (s).
    pub time: f64,
    /// Last of the points at which it did not, without one in between at which it did (s).
    pub until: f64,
    /// Number of these points.
    pub points: u64,
    /// The assertion.
    pub report: AssertionReport,
}

/// A run that came to its end.
#[derive(Clone, PartialEq, Debug)]
pub struct Summary {
    /// Time reached (s): the stop time, or that of `terminate`.
    pub time: f64,
    /// What the run has cost.
    pub statistics: Statistics,
    /// Assertions of level warning that did not hold, in the order of time.
    pub warnings: Vec<Warning>,
    /// Where loops of equations went over to another of their solutions.
    pub jumps: Vec<Jump>,
    /// Which methods were used from when on.
    pub phases: Vec<MethodPhase>,
    /// How initial values were found, if the start values did not lead to them.
    pub rescue: Option<Rescue>,
    /// Message of `terminate`, if that ended the run.
    pub terminated: Option<String>,
}

/// The integrator with its work space for systems of one structure.
pub struct Simulator {
    integrator: Integrator,
    weights: Weights,
    consistency: Consistency,
    initial: InitialSystem,
    roots: RootWatch,
    output: Output,
    first_step: FirstStep,
    delays: DelayWork,
    point: Point,
    /// The start of the run (s) and the values there.
    started: f64,
    origin: Point,
    /// Unknowns that are states, now or at times; and those that are states now.
    differential: Vec<bool>,
    states: Vec<bool>,
    choosing: Choosing,
    /// Present in runs that ask for sensitivities, and kept for the next one that does.
    sensitivity: Option<Box<Sensitivity>>,
    kept: Option<Box<Sensitivity>>,
    jumps: Vec<Jump>,
    statistics: Statistics,
    /// The clock of runs that are to say where their time goes, and what the last one says.
    clock: Option<fn() -> f64>,
    profile: Option<Box<Profile>>,
}

/// Values at a start or an event.
#[derive(Clone, Default)]
struct Point {
    y: Vec<f64>,
    yp: Vec<f64>,
}

/// Everything that a run depends on; derivatives do not go along, because a run that is copied has none.
impl Clone for Simulator {
    fn clone(&self) -> Self {
        Self {
            integrator: self.integrator.clone(),
            weights: self.weights.clone(),
            consistency: self.consistency.clone(),
            initial: self.initial.clone(),
            roots: self.roots.clone(),
            output: self.output.clone(),
            first_step: self.first_step.clone(),
            delays: self.delays.clone(),
            point: self.point.clone(),
            started: self.started,
            origin: self.origin.clone(),
            differential: self.differential.clone(),
            states: self.states.clone(),
            choosing: self.choosing,
            sensitivity: None,
            kept: None,
            jumps: self.jumps.clone(),
            statistics: self.statistics,
            clock: self.clock,
            profile: None,
        }
    }
}

/// What a run keeps beside the work space.
struct Run<'a, 'b> {
    problem: &'a mut Problem<'b>,
    options: &'a Options,
    sink: &'a mut dyn Sink,
    stop: &'a dyn Fn() -> bool,
    chatter: Chatter,
    time_event: f64,
    /// No relation of time alone changes before (s).
    unchanged_until: f64,
    /// Time of the last event, at first the start (s): time events are looked for after it.
    last_event: f64,
    /// No step leads beyond (s): what holds there is not known yet.
    horizon: f64,
    terminated: Option<String>,
}

/// What a step has led to, in time order; values of an event stand in `point`.
enum Arrival {
    /// A time (s) with nothing to do.
    Plain(f64),
    /// An event that waits.
    Event(Found),
}

/// An event at a time (s).
#[derive(Clone, Copy)]
struct Found {
    t: f64,
    source: EventSource,
    /// The system has asked for it at the end of a step: steps lead on whatever it does.
    is_asked: bool,
}

impl Run<'_, '_> {
    fn span(&self) -> f64 {
        self.options.stop - self.options.start
    }

    fn limit(&self) -> f64 {
        self.time_event.min(self.options.stop).min(self.horizon)
    }

    /// Notes that an event, or the start, has been settled at `t` (s).
    fn settled(&mut self, t: f64) {
        self.last_event = t;
        self.unchanged_until = t;
        self.find_time_event();
    }

    /// Looks for the next time event.  What coincides with the end of the run happens at it; what happens right after the end does
    /// not happen.
    fn find_time_event(&mut self) {
        let next = self.problem.system.next_time_event(self.last_event);
        let (stop, instants) = (self.options.stop, Instants::of_run(self.options.start));
        let at_stop = if next.right_after { f64::INFINITY } else { stop };
        self.time_event = if instants.same(next.t, stop) { at_stop } else { next.t };
    }
}

/// Adds the time since `begin` to a part of the profile, if there is one.
fn spend(problem: &mut Problem<'_>, begin: Option<f64>, part: impl FnOnce(&mut Seconds) -> &mut f64) {
    if let (Some(begin), Some(profile)) = (begin, &mut problem.profile) {
        let now = profile.now();
        *part(&mut profile.seconds) += now - begin;
    }
}

/// Runs a system once; see [`Simulator`] for many runs.
pub fn simulate(
    system: &mut dyn DaeSystem,
    options: &Options,
    sink: &mut dyn Sink,
    stop: &dyn Fn() -> bool,
) -> Result<Summary, SolveError> {
    let mut simulator = Simulator::new(system.structure());
    simulator.run(system, options, sink, stop)
}

impl Simulator {
    /// Work space for systems of this structure.
    pub fn new(structure: &Structure) -> Self {
        let n = structure.unknowns;
        Self {
            integrator: Integrator::new(structure),
            weights: Weights::new(n),
            consistency: Consistency::new(structure),
            initial: InitialSystem::new(structure),
            roots: RootWatch::new(structure),
            output: Output::new(structure),
            first_step: FirstStep::new(n),
            delays: DelayWork::new(structure),
            point: Point { y: vec![0.0; n], yp: vec![0.0; n] },
            started: 0.0,
            origin: Point { y: vec![0.0; n], yp: vec![0.0; n] },
            differential: structure.differential.clone(),
            states: structure.differential.clone(),
            choosing: Choosing::new(),
            sensitivity: None,
            kept: None,
            jumps: Vec::new(),
            statistics: Statistics::default(),
            clock: None,
            profile: None,
        }
    }

    /// Lets the following runs count who keeps their steps short and where their time goes, on this clock (seconds since any
    /// origin).
    pub fn profile_with(&mut self, clock: fn() -> f64) {
        self.clock = Some(clock);
    }

    /// Where the time of the last run went, if it was to be counted.
    pub fn profile(&self) -> Option<&Profile> {
        self.profile.as_deref()
    }

    /// What the last run has cost, however it ended.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Warnings of the last run, however it ended.
    pub fn warnings(&self) -> &[Warning] {
        &self.output.warnings
    }

    /// Jumps of the last run, however it ended.
    pub fn jumps(&self) -> &[Jump] {
        &self.jumps
    }

    /// How the last run found its initial values, if its start values did not lead to them.
    pub fn rescue(&self) -> Option<&Rescue> {
        self.initial.rescued()
    }

    /// Methods used in the last run, however it ended.
    pub fn phases(&self) -> &[MethodPhase] {
        self.integrator.phases()
    }

    /// Runs the system from start to stop and hands rows to the sink.  `stop` is asked after every step; true ends the run with
    /// [`SolveError::Interrupted`].  Parameters set before take effect.  The system must have the structure given to `new`.
    pub fn run(
        &mut self,
        system: &mut dyn DaeSystem,
        options: &Options,
        sink: &mut dyn Sink,
        stop: &dyn Fn() -> bool,
    ) -> Result<Summary, SolveError> {
        options.check()?;
        let kept = self.sensitivity.take().or(self.kept.take());
        match options.sensitivity.as_slice() {
            [] => self.kept = kept,
            names => {
                let wanted = options.derived_outputs.as_deref();
                self.sensitivity = Some(Sensitivity::prepare(kept, system, names, wanted)?);
            }
        }
        self.jumps.clear();
        let mut delays = std::mem::take(&mut self.delays);
        delays.restart(options.tolerance);
        let sizes = (system.structure().unknowns, system.structure().roots);
        let profile = self.clock.map(|clock| Box::new(Profile::new(clock, sizes.0, sizes.1)));
        let system = Delaying::new(system, &mut delays);
        let mut problem = Problem { system, statistics: Statistics::default(), profile };
        let begun = problem.now();
        self.output.restart(options, self.sensitivity.as_ref().map_or(0, |s| s.extra_outputs()));
        let mut run = Run {
            problem: &mut problem,
            options,
            sink,
            stop,
            chatter: Chatter::default(),
            time_event: f64::INFINITY,
            last_event: options.start,
            unchanged_until: options.start,
            horizon: f64::INFINITY,
            terminated: None,
        };
        let result = self.begin(&mut run);
        spend(run.problem, begun, |seconds| &mut seconds.start);
        let result = result.and_then(|()| self.advance(&mut run));
        let result = self.finish_rows(&mut run, result);
        let terminated = run.terminated;
        spend(&mut problem, begun, |seconds| &mut seconds.total);
        self.statistics = problem.statistics;
        self.profile = problem.profile;
        self.delays = delays;
        let time = result?;
        let (warnings, phases) = (self.output.warnings.clone(), self.integrator.phases().to_vec());
        let jumps = self.jumps.clone();
        let rescue = self.rescue().cloned();
        Ok(Summary { time, statistics: self.statistics, warnings, jumps, phases, rescue, terminated })
    }

    /// Writes the rows that still wait for their derivatives, as far as a run that failed has them.
    fn finish_rows(&mut self, run: &mut Run<'_, '_>, result: Result<f64, SolveError>) -> Result<f64, SolveError> {
        let Some(sensitivity) = &mut self.sensitivity else { return result };
        let reached = sensitivity.reach(run.problem);
        let written = self.output.flush(run.problem, run.sink, sensitivity);
        result.and_then(|time| reached.and(written).map(|()| time))
    }

    /// Values at the start, the first row, and the integrator made ready.
    fn begin(&mut self, run: &mut Run<'_, '_>) -> Result<(), SolveError> {
        let (t, span) = (run.options.start, run.span());
        let bound = run.problem.system.bind(t);
        bound.map_err(|failure| SolveError::evaluation(crate::Stage::Start, t, failure, run.problem))?;
        run.problem.system.nominals(&mut self.weights.nominals);
        let suppress = run.options.suppress_algebraic;
        self.weights.set_differential(&self.differential);
        self.weights.configure(run.options.tolerance, self.differential.iter().map(|&d| d || !suppress));
        self.consistency.reset(&self.weights.nominals);
        self.consistency.read_states(run.problem);
        let share = if run.problem.system.structure().roots > 0 { MOST_OF_RUN_WITH_ROOTS } else { MOST_OF_RUN };
        let max_step = run.options.max_step.unwrap_or(share * span);
        let (solver, max_order) = (run.options.solver, run.options.max_order);
        self.integrator.configure((solver, max_order), (t, max_step, 1e-15 * span), &self.weights.nominals);
        let time_scale = if span > 0.0 { START_SCALE * span } else { 1.0 };
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.begin(run.problem, t, run.options.tolerance, &self.weights.nominals);
        }
        let (weights, consistency) = (&self.weights, &mut self.consistency);
        let (rescue, sensitivity) = (run.options.rescue, self.sensitivity.as_deref_mut());
        let mut start = Start { t, time_scale, weights, rescue, consistency, sensitivity };
        let Point { y, yp } = &mut self.point;
        run.terminated = self.initial.start(run.problem, &mut start, y, yp)?;
        // What `initial()` kept from firing, such as the first sample at the start, happens now.
        let at = (EventPhase::Started, t, time_scale);
        let sensitivity = self.sensitivity.as_deref_mut();
        let outcome = settle(run.problem, &mut self.consistency, &self.weights, at, (y, yp), sensitivity)?;
        run.terminated = run.terminated.take().or(outcome.terminated);
        let begun = match &mut self.sensitivity {
            Some(sensitivity) => {
                // The event may have changed discrete variables and with them rates.
                sensitivity.consistent(run.problem, (crate::Stage::Start, t), y, yp)?;
                {
                    let tables = Arc::clone(sensitivity.tables());
                    run.sink.begin(&tables, sensitivity.parameters(&mut run.problem.system))
                }
            }
            None => run.sink.begin(run.problem.system.tables(), run.problem.system.parameters()),
        };
        begun.map_err(|error| SolveError::Sink { time: t, error })?;
        let sensitivity = self.sensitivity.as_deref_mut();
        self.output.row(run.problem, run.sink, t, (y, yp), RowKind::Normal, sensitivity)?;
        self.output.assertions(run.problem, t, (y, yp))?;
        self.started = t;
        self.origin.y.copy_from_slice(y);
        self.origin.yp.copy_from_slice(yp);
        self.restart(run, t);
        match run.options.sensitivity.first() {
            Some(name) if run.problem.system.has_vanished_delay() => {
                let reason =
                    "a `delay` has a delay time of zero, and derivatives cannot be carried through it".to_string();
                Err(crate::OptionError::Sensitivity { name: name.clone(), reason }.into())
            }
            _ => Ok(()),
        }
    }

    /// From the values in `point` at `t`: next time event, first step, integrator and root functions.
    fn restart(&mut self, run: &mut Run<'_, '_>, t: f64) {
        run.problem.system.begin_segment(t, &self.point.y, &self.point.yp);
        run.settled(t);
        if t >= run.options.stop {
            return;
        }
        // Another event may follow at the same time; it begins with these values, too.
        let rest = if run.limit() > t { run.limit() - t } else { run.options.stop - t };
        self.weights.update(&self.point.y);
        self.consistency.choose_states(run.problem, t, &self.point.y, &self.point.yp);
        self.states.copy_from_slice(self.consistency.states());
        self.choosing = Choosing::new();
        let smallest = 16.0 * self.integrator.smallest_step(t);
        let mut first = match run.options.initial_step {
            Some(h) => FirstSteps { first_order: h, fourth_order: h },
            None => self.first_step.estimate(
                run.problem,
                &mut self.consistency,
                &self.weights,
                (t, rest, run.options.tolerance, smallest),
                (&self.point.y, &mut self.point.yp, &self.states),
            ),
        };
        if run.options.initial_step.is_none() && run.problem.system.has_only_crossed() {
            // Where only a wave comes back nothing has become faster than before, and a step that is too long is refused.
            first.fourth_order = first.fourth_order.max(self.integrator.step_and_most().0);
        }
        let structure = run.problem.system.structure();
        self.integrator.restart(structure, t, (&self.point.y, &self.point.yp, &self.states), first);
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.restart(run.problem, t, &self.point.y, &self.point.yp);
        }
        self.roots.restart(run.problem, t, &self.point.y, &self.point.yp);
    }

    /// The loop over steps; returns the time reached.
    fn advance(&mut self, run: &mut Run<'_, '_>) -> Result<f64, SolveError> {
        let mut t = run.options.start;
        let mut stall = Stall::new(t);
        while t < run.options.stop && run.terminated.is_none() {
            if (run.stop)() {
                return Err(SolveError::Interrupted { time: t });
            }
            self.go_on(run, t, &mut stall)?;
            match self.at_limit(run, t) {
                Some(Arrival::Plain(end)) => {
                    t = end;
                    let Point { y, yp } = &self.point;
                    match &mut self.sensitivity {
                        Some(sensitivity) => sensitivity.wait(t, (y, yp)),
                        None => self.output.row(run.problem, run.sink, t, (y, yp), RowKind::Normal, None)?,
                    }
                }
                Some(Arrival::Event(found)) => t = self.pass(run, found)?,
                None => {
                    t = match self.step(run)? {
                        Arrival::Plain(t) => t,
                        Arrival::Event(found) => self.pass(run, found)?,
                    }
                }
            }
        }
        Ok(t)
    }

    /// An error where the run will not come to its end with the steps that it may do.
    fn go_on(&self, run: &mut Run<'_, '_>, t: f64, stall: &mut Stall) -> Result<(), SolveError> {
        let (statistics, most) = (&run.problem.statistics, run.options.max_steps);
        if statistics.steps < most && !stall.stands(statistics, (t, run.options.stop), most) {
            return Ok(());
        }
        let (steps, step) = (run.problem.statistics.steps, self.integrator.step_size());
        let unknown = self.integrator.dominant(&self.weights);
        let error = SolveError::too_many_steps((t, steps, step), unknown, self.integrator.y(), run.problem);
        Err(self.with_course(error, run.problem))
    }

    /// The error with the values at the start of the run, before its last step and at the end of that.
    fn with_course(&self, error: SolveError, problem: &mut Problem<'_>) -> SolveError {
        let (before, n) = (self.integrator.t_before(), self.origin.y.len());
        let (mut y, mut yp) = (vec![0.0; n], vec![0.0; n]);
        self.integrator.at(before, &mut y, &mut yp);
        let start = (self.started, self.origin.y.as_slice(), self.origin.yp.as_slice());
        let points = [start, (before, &y, &yp), (self.integrator.t(), self.integrator.y(), self.integrator.yp())];
        error.with_course(Course::new(problem, &points))
    }

    /// Whether `t` is closer to the next limit than a step can be, and so the same instant: what is there.
    fn at_limit(&mut self, run: &mut Run<'_, '_>, t: f64) -> Option<Arrival> {
        if run.limit() - t > 16.0 * self.integrator.smallest_step(t) {
            return None;
        }
        let t = run.limit();
        self.point.y.copy_from_slice(self.integrator.y());
        self.point.yp.copy_from_slice(self.integrator.yp());
        if t != run.time_event {
            return Some(Arrival::Plain(t));
        }
        run.problem.statistics.time_events += 1;
        Some(Arrival::Event(Found { t, source: EventSource::Time, is_asked: false }))
    }

    /// Goes through an event; returns its time (s).
    fn pass(&mut self, run: &mut Run<'_, '_>, found: Found) -> Result<f64, SolveError> {
        let begin = run.problem.now();
        let outcome = self.event(run, found).map(|()| found.t);
        spend(run.problem, begin, |seconds| &mut seconds.events);
        outcome
    }

    /// One step with what it passes but an event, which is found: rows, assertions.
    fn step(&mut self, run: &mut Run<'_, '_>) -> Result<Arrival, SolveError> {
        let from = self.integrator.t();
        let limit = self.reach(run, from);
        let failures = run.problem.statistics.convergence_failures;
        let begin = run.problem.now();
        let stepped = self.integrator.step(run.problem, &mut self.weights, limit);
        spend(run.problem, begin, |seconds| &mut seconds.steps);
        if let Some(profile) = run.problem.profile.as_mut().filter(|_| stepped.is_ok()) {
            profile.limit(self.integrator.dominant(&self.weights));
        }
        if let Err(failure) = stepped {
            if let Some(t) = self.jump(run, &failure, (from, limit))? {
                return Ok(Arrival::Plain(t));
            }
            let attempt = self.integrator.last_attempt();
            let error = SolveError::step(failure, from, attempt, self.integrator.y(), run.problem);
            return Err(self.with_course(error, run.problem));
        }
        let (past, consistency, weights) = (&self.integrator, &mut self.consistency, &self.weights);
        let mut recorder = Recorder { problem: run.problem, past, consistency, weights };
        if recorder.record_step() && self.integrator.t() < run.time_event {
            run.find_time_event();
        }
        let spacing = run.span() / run.options.intervals as f64;
        let past = (&self.integrator, &mut self.consistency, &self.weights);
        let state_event = self.roots.check(run.problem, past.0, past.1, past.2, spacing);
        let t = state_event.unwrap_or(self.integrator.t());
        let is_event = state_event.is_some() || t >= run.time_event;
        let past = (&self.integrator, &mut self.consistency, &self.weights);
        let sensitivity = self.sensitivity.as_deref_mut();
        self.output.grid(run.problem, run.sink, (run.options, run.stop), past, (t, !is_event), sensitivity)?;
        if let Some(sensitivity) = &mut self.sensitivity {
            let located = (self.roots.y.as_slice(), self.roots.yp.as_slice());
            let values = if state_event.is_some() { located } else { (self.integrator.y(), self.integrator.yp()) };
            sensitivity.follow(run.problem, t, values)?;
            self.output.flush(run.problem, run.sink, sensitivity)?;
        }
        if !is_event {
            self.output.assertions(run.problem, t, (self.integrator.y(), self.integrator.yp()))?;
            let told = run.problem.system.completed(t, self.integrator.y());
            if told.map_err(|failure| SolveError::evaluation(crate::Stage::Step, t, failure, run.problem))? {
                run.problem.statistics.state_events += 1;
                self.point.y.copy_from_slice(self.integrator.y());
                self.point.yp.copy_from_slice(self.integrator.yp());
                return Ok(Arrival::Event(Found { t, source: EventSource::Time, is_asked: true }));
            }
            if self.choosing.is_due(t, run.problem.statistics.convergence_failures > failures) {
                let judged = self.consistency.choose_states(run.problem, t, self.integrator.y(), self.integrator.yp());
                self.choosing.note(t, judged);
                if judged.changed {
                    run.problem.statistics.state_choices += 1;
                    let Point { y, yp } = &mut self.point;
                    y.copy_from_slice(self.integrator.y());
                    yp.copy_from_slice(self.integrator.yp());
                    if self.integrator.begins_with_rates() {
                        self.consistency.refine(run.problem, (t, self.integrator.step_size()), &self.weights, y, yp);
                    }
                    self.integrator.set_states(y, yp, self.consistency.states());
                }
            }
            return Ok(Arrival::Plain(t));
        }
        let Point { y, yp } = &mut self.point;
        let mut source = EventSource::Time;
        if state_event.is_some() {
            source = EventSource::Root(self.roots.fired.iter().position(|&fired| fired).unwrap_or(0));
            run.problem.statistics.state_events += 1;
            if let Some(profile) = &mut run.problem.profile {
                profile.fire(&self.roots.fired);
            }
            y.copy_from_slice(&self.roots.y);
            yp.copy_from_slice(&self.roots.yp);
        }
        if t >= run.time_event {
            run.problem.statistics.time_events += 1;
            if state_event.is_none() {
                y.copy_from_slice(self.integrator.y());
                yp.copy_from_slice(self.integrator.yp());
                self.consistency.refine(run.problem, (t, self.integrator.step_size()), &self.weights, y, yp);
            }
        }
        Ok(Arrival::Event(Found { t, source, is_asked: false }))
    }

    /// The event at `t` on the values in `point`: rows around it, and a new beginning after it.
    fn event(&mut self, run: &mut Run<'_, '_>, found: Found) -> Result<(), SolveError> {
        let Found { t, source, is_asked } = found;
        let span = run.span();
        let Point { y, yp } = &mut self.point;
        if !is_asked {
            run.chatter.note((t, span), &self.roots.fired, run.problem, (y, yp))?;
        }
        let rows = run.options.event_rows || run.options.every_step;
        // A second event at the same time begins where the one before has left off, with its row.
        let begun = t == run.last_event;
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.reach(run.problem)?;
            self.output.flush(run.problem, run.sink, sensitivity)?;
            sensitivity.arrive(run.problem, t, y, yp)?;
        }
        if rows && !begun {
            self.consistency.project(run.problem, (t, self.integrator.step_size()), &self.weights, y, yp);
            let sensitivity = self.sensitivity.as_deref_mut();
            self.output.row(run.problem, run.sink, t, (y, yp), RowKind::BeforeEvent, sensitivity)?;
        }
        self.output.assertions(run.problem, t, (y, yp))?;
        let at = (EventPhase::First, t, self.integrator.step_size());
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.shift(run.problem, t, (y, yp), source);
        }
        let sensitivity = self.sensitivity.as_deref_mut();
        let outcome = settle(run.problem, &mut self.consistency, &self.weights, at, (y, yp), sensitivity)?;
        run.terminated = outcome.terminated.or(run.terminated.take());
        let place = (t, self.integrator.step_size());
        if outcome.reinitialised && self.roots.turn_back(run.problem, place, (y, yp, self.consistency.states())) {
            let sensitivity = self.sensitivity.as_deref_mut();
            let outcome = settle(run.problem, &mut self.consistency, &self.weights, at, (y, yp), sensitivity)?;
            run.terminated = outcome.terminated.or(run.terminated.take());
        }
        let mut changed = outcome.changed;
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.depart(run.problem, t, y, yp)?;
            changed |= sensitivity.changed;
        }
        if rows {
            let sensitivity = self.sensitivity.as_deref_mut();
            self.output.row(run.problem, run.sink, t, (y, yp), RowKind::AfterEvent, sensitivity)?;
            self.output.skip_to(run.options, t);
        }
        self.output.assertions(run.problem, t, (y, yp))?;
        if changed || t != self.integrator.t() {
            self.restart(run, t);
        } else {
            // Nothing that the integrator sees has changed: it keeps its past.
            run.settled(t);
            self.roots.restart(run.problem, t, &self.point.y, &self.point.yp);
        }
        Ok(())
    }
}

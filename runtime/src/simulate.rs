//! The run: start, step, look for events, write rows, until the stop time.
//!
//! [`Simulator`] owns all work space for systems of one structure and is used for run after run; the system, the sink and the
//! options come with each run.  A run begins ([`begin`]), steps ([`steps`]) and goes through events ([`event`]).  The loop does no I/O itself
//! and reads no clock.

use hyd_results::Sink;
use hyd_system::{AssertionReport, DaeSystem, Instants, Structure};

use crate::course::Recent;
use crate::delay::{DelayWork, Delaying};
use crate::error::SolveError;
use crate::events::chatter::Chatter;
use crate::events::roots::RootWatch;
use crate::first_step::FirstStep;
use crate::initial::InitialSystem;
use crate::initial::consistent::Consistency;
use crate::initial::rescue::Rescue;
use crate::integrator::{Integrator, MethodPhase};
use crate::output::Output;
use crate::problem::Problem;
use crate::profile::{Profile, Seconds};
use crate::sensitivity::{EventSource, Sensitivity};
use crate::undetermined::{OpenUnknowns, Undetermined};
use crate::weights::Weights;
use crate::{Options, Statistics};

mod begin;
mod choosing;
mod dense_input;
mod event;
mod jump;
mod onward;
mod reach;
mod stall;
mod steps;

use choosing::Choosing;
use dense_input::DenseInput;
pub use jump::Jump;
pub use onward::{Onward, Reached};
use stall::Stall;

/// An assertion of level warning that did not hold.
#[derive(Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
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
    /// What equations that depend on each other left open.
    pub undetermined: Vec<Undetermined>,
    /// Message of `terminate`, if that ended the run.
    pub terminated: Option<String>,
}

/// The integrator with its work space for systems of one structure.
#[derive(serde::Serialize, serde::Deserialize)]
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
    /// The last points of steps, for messages.
    recent: Recent,
    /// Unknowns that are states, now or at times; and those that are states now.
    differential: Vec<bool>,
    states: Vec<bool>,
    choosing: Choosing,
    /// Present in runs that ask for sensitivities, and kept for the next one that does.
    #[serde(skip)]
    sensitivity: Option<Box<Sensitivity>>,
    #[serde(skip)]
    kept: Option<Box<Sensitivity>>,
    jumps: Vec<Jump>,
    statistics: Statistics,
    undetermined: Vec<Undetermined>,
    /// The clock of runs that are to say where their time goes, and what the last one says.
    #[serde(skip)]
    clock: Option<fn() -> f64>,
    #[serde(skip)]
    profile: Option<Box<Profile>>,
}

/// Values at a start or an event.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
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
            recent: self.recent.clone(),
            differential: self.differential.clone(),
            states: self.states.clone(),
            choosing: self.choosing,
            sensitivity: None,
            kept: None,
            jumps: self.jumps.clone(),
            statistics: self.statistics,
            undetermined: self.undetermined.clone(),
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
    /// Nothing but recorded inputs taking up their next values happens at it.
    is_input: bool,
    inputs: DenseInput,
    /// The last event has no rows.
    is_bare: bool,
    /// The assertions at the ends of steps beyond this point (s) are left to the caller.
    checked_to: f64,
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
#[derive(Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Found {
    t: f64,
    source: EventSource,
    /// The system has asked for it at the end of a step: steps lead on whatever it does.
    is_asked: bool,
    /// Nothing but recorded inputs taking up their next values.
    is_input: bool,
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
        self.is_input = next.is_input;
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
            recent: Recent::default(),
            differential: structure.differential.clone(),
            states: structure.differential.clone(),
            choosing: Choosing::new(),
            sensitivity: None,
            kept: None,
            jumps: Vec::new(),
            statistics: Statistics::default(),
            undetermined: Vec::new(),
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

    /// What equations that depend on each other left open in the last run, however it ended.
    pub fn undetermined(&self) -> &[Undetermined] {
        &self.undetermined
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
        let mut problem = Problem { system, statistics: Statistics::default(), profile, open: OpenUnknowns::default() };
        let begun = problem.now();
        let extra = self.sensitivity.as_ref().map_or(0, |s| s.extra_outputs());
        self.output.restart(options, &mut problem.system, extra);
        let mut run = Run {
            problem: &mut problem,
            options,
            sink,
            stop,
            chatter: Chatter::default(),
            time_event: f64::INFINITY,
            is_input: false,
            inputs: DenseInput::NONE,
            is_bare: false,
            checked_to: f64::INFINITY,
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
        if let Some(profile) = &mut self.profile {
            profile.sizes = self.weights.sizes.to_vec();
        }
        self.undetermined = problem.open.together();
        self.delays = delays;
        let time = result?;
        let (warnings, phases) = (self.output.warnings.clone(), self.integrator.phases().to_vec());
        let jumps = self.jumps.clone();
        let rescue = self.rescue().cloned();
        let undetermined = self.undetermined.clone();
        Ok(Summary { time, statistics: self.statistics, warnings, jumps, phases, rescue, undetermined, terminated })
    }

    /// Writes the rows that still wait for their derivatives, as far as a run that failed has them.
    fn finish_rows(&mut self, run: &mut Run<'_, '_>, result: Result<f64, SolveError>) -> Result<f64, SolveError> {
        let Some(sensitivity) = &mut self.sensitivity else { return result };
        let reached = sensitivity.reach(run.problem);
        let written = self.output.flush(run.problem, run.sink, sensitivity);
        result.and_then(|time| reached.and(written).map(|()| time))
    }
}

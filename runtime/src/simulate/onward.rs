//! A run that goes on at its caller's pace: step by step, to points that are named one after the other.
//!
//! The same steps, events and values as [`Simulator::run`], with the caller between them.  A step may lead beyond the point that
//! was asked for; values there come from the integrator's dense output, as rows of results do.  An event that a step has found waits
//! until the caller has come to it, and happens when he says so.  Where inputs, or parameters, have changed from outside the run
//! starts over with consistent values, without forgetting what it knows of the past of delays.  [`Clone`] keeps everything that the run
//! depends on, so a copy goes on with the same bits.

use hyd_results::Discard;
use hyd_system::{DaeSystem, EventPhase, Structure};

use super::{Arrival, Found, Point, Run, Simulator, Stall};
use crate::delay::Delaying;
use crate::error::{SolveError, Stage};
use crate::events::chatter::Chatter;
use crate::events::iteration::{Instant, settle};
use crate::loops::judge;
use crate::output::check_outputs;
use crate::problem::Problem;
use crate::undetermined::{OpenUnknowns, Undetermined};
use crate::{Options, Statistics, Warning};

/// How far a run has come.
#[derive(Clone, PartialEq, Debug)]
pub enum Reached {
    /// The point that was asked for: all that happens up to it has happened.
    Point,
    /// A time before it (s), at the end of a step.
    Step(f64),
    /// An event at this time (s), not after the point, waits for [`Onward::event`].
    Event(f64),
    /// The model has ended the run: its message.
    Terminated(String),
}

/// A run in work.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub struct Onward {
    simulator: Simulator,
    options: Options,
    progress: Progress,
    /// The newest point (s); steps go on from there.
    t: f64,
    waiting: Option<Found>,
    stall: Stall,
    /// The newest point lies beyond the one that was asked for, and its assertions are still to be checked: what holds at a point is not
    /// decided by what happens after it.
    unchecked: bool,
    /// Values at the point that was shown last.
    shown: Point,
}

/// What lasts from one step to the next beside the work space.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct Progress {
    chatter: Chatter,
    time_event: f64,
    unchanged_until: f64,
    last_event: f64,
    terminated: Option<String>,
    open: OpenUnknowns,
}

impl Onward {
    /// Work space for systems of this structure.  Rows and derivatives among the options are left out of account.
    pub fn new(structure: &Structure, options: Options) -> Self {
        let n = structure.unknowns;
        let options = Options {
            event_rows: false,
            every_step: false,
            within_steps: false,
            // No row is asked for.
            times: vec![f64::MAX],
            sensitivity: Vec::new(),
            ..options
        };
        Self {
            simulator: Simulator::new(structure),
            progress: Progress::default(),
            t: options.start,
            waiting: None,
            stall: Stall::new(options.start),
            unchecked: false,
            shown: Point { y: vec![0.0; n], yp: vec![0.0; n] },
            options,
        }
    }

    /// The start: parameters, consistent values, the events of the start.
    ///
    /// # Errors
    /// As [`Simulator::run`].
    pub fn begin(&mut self, system: &mut dyn DaeSystem) -> Result<(), SolveError> {
        self.options.check()?;
        let start = self.options.start;
        self.simulator.jumps.clear();
        self.simulator.statistics = Statistics::default();
        self.simulator.delays.restart(self.options.tolerance);
        let mut delays = std::mem::take(&mut self.simulator.delays);
        self.simulator.output.restart(&self.options, &mut Delaying::new(system, &mut delays), 0);
        self.simulator.delays = delays;
        let never = Progress { time_event: f64::INFINITY, ..Progress::default() };
        self.progress = Progress { last_event: start, unchanged_until: start, ..never };
        (self.t, self.waiting, self.stall) = (start, None, Stall::new(start));
        self.unchecked = false;
        self.within(system, f64::INFINITY, |simulator, run| simulator.begin(run))
    }

    /// One step towards `to` (s), if it has not come there yet; `beyond`: what holds after `to` is known, so the step may lead beyond it.
    ///
    /// # Errors
    /// As [`Simulator::run`]; the run is at an end then.
    pub fn advance(&mut self, system: &mut dyn DaeSystem, to: f64, beyond: bool) -> Result<Reached, SolveError> {
        if self.unchecked && to >= self.t {
            self.unchecked = false;
            self.check(system, self.t)?;
        }
        if let Some(reached) = self.reached(to) {
            return self.judged(system, to, reached);
        }
        self.reach_to(system, to);
        let horizon = if beyond { f64::INFINITY } else { to };
        let (t, mut stall) = (self.t, self.stall);
        let arrival = self.within(system, horizon, |simulator, run| {
            run.checked_to = to;
            simulator.go_on(run, t, &mut stall)?;
            match simulator.at_limit(run, t) {
                Some(arrival) => Ok(arrival),
                None => simulator.step(run),
            }
        });
        self.stall = stall;
        match arrival? {
            Arrival::Plain(t) => (self.t, self.unchecked) = (t, t > to),
            Arrival::Event(found) => (self.t, self.waiting) = (found.t, Some(found)),
        }
        let reached = self.reached(to).unwrap_or(Reached::Step(self.t));
        self.judged(system, to, reached)
    }

    /// What was reached, with the assertions checked there: those of a point within a step are those of an output point.
    fn judged(&mut self, system: &mut dyn DaeSystem, to: f64, reached: Reached) -> Result<Reached, SolveError> {
        if matches!(reached, Reached::Point) && to < self.t {
            self.check(system, to)?;
        }
        Ok(reached)
    }

    /// The assertions at a point within the last step (s).
    fn check(&mut self, system: &mut dyn DaeSystem, at: f64) -> Result<(), SolveError> {
        // The point of the simulator is that of an event that may wait.
        let mut shown = std::mem::take(&mut self.shown);
        let found = self.within(system, f64::INFINITY, |simulator, run| {
            simulator.show(run, at, &mut shown);
            simulator.output.assertions(run.problem, at, (&shown.y, &shown.yp))
        });
        self.shown = shown;
        found
    }

    fn reached(&self, to: f64) -> Option<Reached> {
        if let Some(message) = &self.progress.terminated {
            return Some(Reached::Terminated(message.clone()));
        }
        match self.waiting {
            Some(found) if found.t <= to => Some(Reached::Event(found.t)),
            Some(_) => Some(Reached::Point),
            None => (self.t >= to).then_some(Reached::Point),
        }
    }

    /// The event that waits.
    ///
    /// # Errors
    /// As [`Simulator::run`].
    pub fn event(&mut self, system: &mut dyn DaeSystem) -> Result<(), SolveError> {
        let Some(found) = self.waiting.take() else { return Ok(()) };
        self.t = found.t;
        self.within(system, f64::INFINITY, |simulator, run| simulator.pass(run, found).map(|_| ()))
    }

    /// Inputs or parameters have changed at `at` (s), which lies within the last step: consistent values there, the events that follow from
    /// them, and a new beginning.
    ///
    /// # Errors
    /// As [`Simulator::run`].
    pub fn disturb(&mut self, system: &mut dyn DaeSystem, at: f64) -> Result<(), SolveError> {
        (self.t, self.waiting, self.unchecked) = (at, None, false);
        self.within(system, f64::INFINITY, |simulator, run| {
            let mut point = std::mem::take(&mut simulator.point);
            simulator.look_up(at, &mut point);
            let Point { y, yp } = &mut point;
            let place = (at, simulator.integrator.step_size());
            let solved = simulator.consistency.solve(run.problem, place, &simulator.weights, y, yp);
            let result = match solved {
                Err(fault) => {
                    let attempt = simulator.consistency.last_attempt();
                    Err(SolveError::inconsistent(Stage::Event, at, fault, attempt, run.problem))
                }
                Ok(()) => judge(run.problem, (Stage::Event, at), (y, yp)).and_then(|()| {
                    let (t, time_scale) = place;
                    let first = Instant { first: EventPhase::First, t, time_scale, span: run.span() };
                    settle(run.problem, &mut simulator.consistency, &simulator.weights, first, (y, yp), None)
                }),
            };
            simulator.point = point;
            run.terminated = result?.terminated.or(run.terminated.take());
            simulator.output.assertions(run.problem, at, (&simulator.point.y, &simulator.point.yp))?;
            simulator.restart(run, at, false);
            Ok(())
        })
    }

    /// All recorded variables at `at` (s), which lies within the last step, as [`DaeSystem::outputs`] orders them.
    ///
    /// # Errors
    /// One of them is not finite.
    pub fn outputs(&mut self, system: &mut dyn DaeSystem, at: f64, row: &mut [f64]) -> Result<(), SolveError> {
        let mut shown = std::mem::take(&mut self.shown);
        let found = self.within(system, f64::INFINITY, |simulator, run| {
            simulator.show(run, at, &mut shown);
            let Point { y, yp } = &shown;
            run.problem.system.outputs(at, y, yp, row);
            check_outputs(run.problem, at, (y, yp), row)
        });
        self.shown = shown;
        found
    }

    /// Unknowns and rates at the point that was shown last.
    pub fn shown(&self) -> (&[f64], &[f64]) {
        (&self.shown.y, &self.shown.yp)
    }

    /// The newest point (s): the end of the last step, or an event that waits.
    pub fn time(&self) -> f64 {
        self.t
    }

    /// The next time event that is known (s); infinity if there is none.
    pub fn next_time_event(&self) -> f64 {
        self.progress.time_event
    }

    /// What the run has cost so far.
    pub fn statistics(&self) -> &Statistics {
        &self.simulator.statistics
    }

    /// Assertions of level warning that did not hold, so far.
    pub fn warnings(&self) -> &[Warning] {
        &self.simulator.output.warnings
    }

    /// True if equations that depend on each other have left something open.
    pub fn leaves_open(&self) -> bool {
        !self.progress.open.is_empty()
    }

    /// What they have left open so far.
    pub fn undetermined(&self) -> Vec<Undetermined> {
        self.progress.open.together()
    }

    /// What the run was asked for.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Nobody has said where the run ends: it goes on for as long again.
    fn reach_to(&mut self, system: &mut dyn DaeSystem, to: f64) {
        let Options { start, stop, intervals, .. } = &mut self.options;
        if to <= *stop {
            return;
        }
        let factor = ((to - *start) / (*stop - *start).max(f64::MIN_POSITIVE)).ceil().clamp(2.0, 1e6);
        *intervals = ((*intervals as f64 * factor) as usize).min(1_000_000_000);
        *stop = (*start + factor * (*stop - *start)).max(to + (to - *start));
        self.within(system, f64::INFINITY, |_, run| run.find_time_event());
    }

    fn within<R>(
        &mut self,
        system: &mut dyn DaeSystem,
        horizon: f64,
        work: impl FnOnce(&mut Simulator, &mut Run<'_, '_>) -> R,
    ) -> R {
        let mut delays = std::mem::take(&mut self.simulator.delays);
        let statistics = self.simulator.statistics;
        let progress = std::mem::take(&mut self.progress);
        let system = Delaying::new(system, &mut delays);
        let mut problem = Problem { system, statistics, profile: None, open: progress.open };
        let mut run = Run {
            problem: &mut problem,
            options: &self.options,
            sink: &mut Discard,
            stop: &|| false,
            chatter: progress.chatter,
            time_event: progress.time_event,
            // There are no rows.
            is_input: false,
            inputs: super::DenseInput::NONE,
            is_bare: false,
            checked_to: f64::INFINITY,
            unchanged_until: progress.unchanged_until,
            last_event: progress.last_event,
            horizon,
            terminated: progress.terminated,
        };
        let result = work(&mut self.simulator, &mut run);
        let Run { chatter, time_event, unchanged_until, last_event, terminated, .. } = run;
        let open = std::mem::take(&mut problem.open);
        self.progress = Progress { chatter, time_event, unchanged_until, last_event, terminated, open };
        self.simulator.statistics = problem.statistics;
        self.simulator.delays = delays;
        result
    }
}

impl Simulator {
    /// A point within the last step (s) with consistent values, as rows have them.
    fn show(&mut self, run: &mut Run<'_, '_>, at: f64, point: &mut Point) {
        self.look_up(at, point);
        let place = (at, self.integrator.step_size());
        self.consistency.project(run.problem, place, &self.weights, &mut point.y, &mut point.yp);
    }

    /// Unknowns and rates within the last step.
    fn look_up(&self, at: f64, point: &mut Point) {
        let t = self.integrator.t();
        if (at - t).abs() <= 16.0 * self.integrator.smallest_step(t) || at < self.integrator.t_before() {
            point.y.copy_from_slice(self.integrator.y());
            point.yp.copy_from_slice(self.integrator.yp());
        } else {
            self.integrator.at(at, &mut point.y, &mut point.yp);
        }
    }
}

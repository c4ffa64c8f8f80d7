//! The loop over steps: each with the rows, assertions and events that it passes.

use hyd_results::RowKind;

use super::{Arrival, Found, Point, Run, Simulator, Stall, spend};
use crate::course::Course;
use crate::delay::Recorder;
use crate::error::{Near, SolveError};
use crate::linearize::OperatingPoint;
use crate::local_mode::LocalMode;
use crate::sensitivity::EventSource;
use crate::vanishing::Vanishing;

/// Errors allowed to be no larger than this part of a value are lost in the rounding of its equations.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

impl Simulator {
    /// The loop over steps; returns the time reached.
    pub(super) fn advance(&mut self, run: &mut Run<'_, '_>) -> Result<f64, SolveError> {
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
    pub(super) fn go_on(&self, run: &mut Run<'_, '_>, t: f64, stall: &mut Stall) -> Result<(), SolveError> {
        let (statistics, most) = (&run.problem.statistics, run.options.max_steps);
        if statistics.steps < most && !stall.stands(statistics, (t, run.options.stop), most) {
            return Ok(());
        }
        let (steps, step) = (run.problem.statistics.steps, self.integrator.step_size());
        let unknown = self.integrator.dominant(&self.weights);
        let error = SolveError::too_many_steps((t, steps, step), unknown, self.integrator.y(), run.problem);
        Err(self.with_course(error, run))
    }

    /// The error with the values at the start of the run and at some of its last steps, and with what the equations say there.
    pub(super) fn with_course(&self, error: SolveError, run: &mut Run<'_, '_>) -> SolveError {
        let start = (self.started, self.origin.y.as_slice(), self.origin.yp.as_slice());
        let last = (self.integrator.t(), self.integrator.y(), self.integrator.yp());
        let mut points = vec![start];
        points.extend(self.recent.points().filter(|point| point.0 > start.0 && point.0 < last.0));
        points.push(last);
        let course = Course::new(run.problem, &points);
        let point = |(t, y, yp): (f64, &[f64], &[f64])| (t, y.to_vec(), yp.to_vec());
        let (first, last) = (point(start), point(last));
        let near = self.near(&error, run, &first, &last);
        error.with_course(course, near)
    }

    /// What the equations at the last point say of an error.
    fn near(
        &self,
        error: &SolveError,
        run: &mut Run<'_, '_>,
        first: &(f64, Vec<f64>, Vec<f64>),
        last: &(f64, Vec<f64>, Vec<f64>),
    ) -> Near {
        let unknown = error.unknown();
        let span = run.span();
        let step = match self.integrator.t() - self.integrator.t_before() {
            step if step > 0.0 => step,
            _ => self.integrator.step_size(),
        };
        let begin = OperatingPoint { t: first.0, y: &first.1, yp: &first.2 };
        let end = OperatingPoint { t: last.0, y: &last.1, yp: &last.2 };
        let nominals: &[f64] = &self.weights.nominals;
        let mode = match error {
            SolveError::StepTooSmall(_) | SolveError::NoConvergence(_) | SolveError::TooManySteps { .. } => {
                LocalMode::new(run.problem.system.inner(), end, nominals, unknown)
            }
            _ => None,
        };
        let vanishing = match error {
            SolveError::NoConvergence(_) | SolveError::Singular(_) => {
                Vanishing::new(run.problem.system.inner(), begin, end, nominals)
            }
            _ => None,
        };
        let below_rounding = unknown.and_then(|k| {
            let size =
                self.recent.points().map(|(_, y, _)| y[k].abs()).fold(first.1[k].abs().max(last.1[k].abs()), f64::max);
            let own = self.weights.sizes[k];
            let allowed = run.options.tolerance * (last.1[k].abs() + own);
            let name = run.problem.system.tables().unknown_name(k);
            (allowed < ROUNDING * size).then_some((name, own, size))
        });
        Near { mode, vanishing, below_rounding, span, step }
    }

    /// Whether `t` is closer to the next limit than a step can be, and so the same instant: what is there.
    pub(super) fn at_limit(&mut self, run: &mut Run<'_, '_>, t: f64) -> Option<Arrival> {
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
        Some(Arrival::Event(Found { t, source: EventSource::Time, is_asked: false, is_input: run.is_input }))
    }

    /// Goes through an event; returns its time (s).
    pub(super) fn pass(&mut self, run: &mut Run<'_, '_>, found: Found) -> Result<f64, SolveError> {
        let begin = run.problem.now();
        let outcome = self.event(run, found).map(|()| found.t);
        spend(run.problem, begin, |seconds| &mut seconds.events);
        outcome
    }

    /// One step with what it passes but an event, which is found: rows, assertions.
    pub(super) fn step(&mut self, run: &mut Run<'_, '_>) -> Result<Arrival, SolveError> {
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
            return Err(self.with_course(error, run));
        }
        self.recent.note(self.integrator.t(), self.integrator.y(), self.integrator.yp());
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
            if t <= run.checked_to {
                self.output.assertions(run.problem, t, (self.integrator.y(), self.integrator.yp()))?;
            }
            let told = run.problem.system.completed(t, self.integrator.y());
            if told.map_err(|failure| SolveError::evaluation(crate::Stage::Step, t, failure, run.problem))? {
                run.problem.statistics.state_events += 1;
                self.point.y.copy_from_slice(self.integrator.y());
                self.point.yp.copy_from_slice(self.integrator.yp());
                return Ok(Arrival::Event(Found { t, source: EventSource::Time, is_asked: true, is_input: false }));
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
        Ok(Arrival::Event(Found { t, source, is_asked: false, is_input: run.is_input && state_event.is_none() }))
    }
}

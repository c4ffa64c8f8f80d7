//! Where a run begins, at the start and behind every event: consistent values, the first step, root functions.

use std::sync::Arc;

use hyd_results::RowKind;
use hyd_system::EventPhase;

use super::{Choosing, Point, Run, Simulator};
use crate::error::SolveError;
use crate::events::iteration::{Instant, settle};
use crate::first_step::FirstSteps;
use crate::initial::Start;

/// Without a stated limit a step is at most this part of the run, with and without state events to be seen.
const MOST_OF_RUN_WITH_ROOTS: f64 = 0.02;
const MOST_OF_RUN: f64 = 0.1;
/// Part of the run in which nominal changes are expected at the start.
const START_SCALE: f64 = 1e-3;

impl Simulator {
    /// Values at the start, the first row, and the integrator made ready.
    pub(super) fn begin(&mut self, run: &mut Run<'_, '_>) -> Result<(), SolveError> {
        let (t, span) = (run.options.start, run.span());
        let bound = run.problem.system.bind(t);
        bound.map_err(|failure| SolveError::evaluation(crate::Stage::Start, t, failure, run.problem))?;
        run.problem.system.nominals(&mut self.weights.nominals);
        let suppress = run.options.suppress_algebraic;
        self.weights.set_differential(&self.differential);
        let mut tested = vec![true; self.differential.len()];
        run.problem.system.tested(&mut tested);
        let included = self.differential.iter().zip(&tested).map(|(&d, &tested)| tested && (d || !suppress));
        self.weights.configure(run.options.tolerance, included);
        self.weights.learn(&run.problem.system.structure().sizes);
        self.consistency.reset(&self.weights.nominals);
        self.consistency.read_states(run.problem);
        self.roots.reset();
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
        self.initial.note_open(run.problem, t);
        // What `initial()` kept from firing, such as the first sample at the start, happens now.
        let at = Instant { first: EventPhase::Started, t, time_scale, span: run.span() };
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
        self.recent.clear();
        self.origin.y.copy_from_slice(y);
        self.origin.yp.copy_from_slice(yp);
        self.restart(run, t, false);
        match run.options.sensitivity.first() {
            Some(name) if run.problem.system.has_vanished_delay() => {
                let reason =
                    "a `delay` has a delay time of zero, and derivatives cannot be carried through it".to_string();
                Err(crate::OptionError::Sensitivity { name: name.clone(), reason }.into())
            }
            _ => Ok(()),
        }
    }

    /// From the values in `point` at `t`: next time event, first step, integrator and root functions.  `by_inputs`: nothing but recorded
    /// inputs have jumped.
    pub(super) fn restart(&mut self, run: &mut Run<'_, '_>, t: f64, by_inputs: bool) {
        run.problem.system.begin_segment(t, &self.point.y, &self.point.yp);
        self.consistency.rank_open(run.problem, t, &self.weights, &self.point.y, &self.point.yp);
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
        // Where samples come close to each other the step that led to one leads on from there; too long, it is refused.
        let pace = if by_inputs { self.integrator.pace_of_samples().map(|h| h.max(smallest)) } else { None };
        let mut first = match run.options.initial_step.or(pace) {
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
        // What BDF begins with has no curve between the ends of its step.
        self.integrator.begin_straight(run.chatter.is_close() || self.roots.is_futile());
        self.integrator.restart(structure, t, (&self.point.y, &self.point.yp, &self.states), first);
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.restart(run.problem, t, &self.point.y, &self.point.yp);
        }
        self.roots.restart(run.problem, t, &self.point.y, &self.point.yp);
    }
}

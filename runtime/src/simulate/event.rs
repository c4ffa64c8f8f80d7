//! One event: rows around it, what it changes, and the way on.

use hyd_results::RowKind;
use hyd_system::EventPhase;

use super::{Found, Point, Run, Simulator};
use crate::error::SolveError;
use crate::events::effect::Before;
use crate::events::iteration::{Instant, settle};

impl Simulator {
    /// The event at `t` on the values in `point`: rows around it, and a new beginning after it.
    pub(super) fn event(&mut self, run: &mut Run<'_, '_>, found: Found) -> Result<(), SolveError> {
        let Found { t, source, is_asked, is_input } = found;
        let span = run.span();
        let Point { y, yp } = &mut self.point;
        if !is_asked {
            run.chatter.note((t, span), &self.roots.fired, run.problem, (y, yp))?;
        }
        let before = (!is_asked && run.chatter.is_close()).then(|| Before::new(run.problem, t, (y, yp)));
        let rows = run.options.event_rows || run.options.every_step;
        // A second event at the same time begins where the one before has left off, with its row.
        let begun = t == run.last_event && !run.is_bare;
        run.is_bare = is_input && run.inputs.jump(t, run.options.output_interval()) && !run.options.every_step;
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.reach(run.problem)?;
            self.output.flush(run.problem, run.sink, sensitivity)?;
            sensitivity.arrive(run.problem, t, y, yp)?;
        }
        if rows && !begun && !run.is_bare {
            self.consistency.project(run.problem, (t, self.integrator.step_size()), &self.weights, y, yp);
            let sensitivity = self.sensitivity.as_deref_mut();
            self.output.row(run.problem, run.sink, t, (y, yp), RowKind::BeforeEvent, sensitivity)?;
        }
        self.output.assertions(run.problem, t, (y, yp))?;
        let at = Instant { first: EventPhase::First, t, time_scale: self.integrator.step_size(), span };
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
        let (mut changed, mut by_inputs) = (outcome.changed, outcome.by_inputs);
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.depart(run.problem, t, y, yp)?;
            changed |= sensitivity.changed;
            by_inputs &= !sensitivity.changed;
        }
        // What changes by a jump of an input is shown; an output point at its time shows the value from then on.
        run.is_bare &= !changed || by_inputs;
        if rows && (!run.is_bare || self.output.is_due(run.options, t)) {
            let sensitivity = self.sensitivity.as_deref_mut();
            self.output.row(run.problem, run.sink, t, (y, yp), RowKind::AfterEvent, sensitivity)?;
            self.output.skip_to(run.options, t);
        }
        self.output.assertions(run.problem, t, (y, yp))?;
        if changed || t != self.integrator.t() {
            self.restart(run, t, by_inputs);
        } else {
            // Nothing that the integrator sees has changed: it keeps its past.
            run.settled(t);
            self.roots.restart(run.problem, t, &self.point.y, &self.point.yp);
        }
        if let Some(before) = before
            && !outcome.reinitialised
        {
            let after = (&self.point.y[..], &self.point.yp[..]);
            self.roots.ignore_rounding(before.effect(run.problem, &self.weights, (t, span), after));
        }
        if !is_asked && !outcome.reinitialised && (!outcome.changed || run.chatter.is_close()) {
            let (place, values) = ((t, self.integrator.step_size()), (&self.point.y[..], &self.point.yp[..]));
            self.roots.measure_rounding(run.problem, &mut self.consistency, &self.weights, place, values);
        }
        Ok(())
    }
}

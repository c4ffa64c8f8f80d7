//! How far a step may lead: to the next time event, as far as relations of time stay what they are, not over a pulse of a recorded
//! input, and for the one-step method not beyond the shortest delay and to where pieces of the past end.

use super::{Run, Simulator};

/// Steps of the smallest size that are taken at least, so that instants close to each other do not stop a run.
const LEAST: f64 = 32.0;

impl Simulator {
    /// The time (s) to which a step from `from` may lead.
    pub(super) fn reach(&mut self, run: &mut Run<'_, '_>, from: f64) -> f64 {
        let least = from + LEAST * self.integrator.smallest_step(from);
        let mut limit = run.limit().min(from + run.problem.system.longest_step());
        if run.problem.system.has_inputs() {
            limit = limit.min(run.problem.system.input_reach(from).max(least));
            self.integrator.note_samples(run.problem.system.samples_passed(from));
        }
        if run.unchanged_until <= from {
            run.unchanged_until = run.problem.system.unchanged_until(from, run.limit());
        }
        if run.unchanged_until < run.limit() {
            limit = limit.min(run.unchanged_until.max(least));
        }
        if let Some(shortest) = run.problem.system.shortest_delay() {
            self.integrator.note_delay(shortest);
            if self.integrator.is_one_step() {
                limit = limit.min(from + shortest);
                let end = run.problem.system.end_of_step(from, self.integrator.step_and_most());
                limit = limit.min(end.map_or(limit, |end| end.max(least)));
            }
        }
        limit
    }
}

//! Inputs that follow recorded samples: their values stand in the data area, and every entry point brings them to its time.
//!
//! A held value (hold zero), and the slope of a straight line where equations read it, jump at samples.  Such a jump is a time event,
//! and the sample that counts is data that changes in the event alone, as held relations do: however an instant rounds, an
//! evaluation sees one side of it.  All else is a continuous function of time.

use std::sync::Arc;

use hyd_system::{EvalFailure, Hold, InputError, Instants, Series, TimeEvent};

use crate::follower::{Follower, Line};
use crate::instance::Instance;

impl Instance {
    /// See [`hyd_system::Inputs::set_input`].
    pub(crate) fn follow(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        let site = self.loaded.model.structure.inputs.get(input).ok_or(InputError::Unknown)?;
        if site.differentiated && series.hold() == Hold::Zero {
            return Err(InputError::NoDerivative);
        }
        let stepwise = series.hold() == Hold::Zero || site.differentiated && series.hold() == Hold::Linear;
        self.memory.inputs[input] = Follower { series: Some(series.clone()), stepwise, ..Follower::default() };
        Ok(())
    }

    /// Lets an input (position in [`hyd_system::Structure::inputs`]) follow the straight line through `value` at `from` (s) from now on;
    /// nothing else is needed where that is known to be no event.  False if there is no such input.
    pub fn hold_input(&mut self, input: usize, value: f64, (slope, from): (f64, f64)) -> bool {
        let Some(follower) = self.memory.inputs.get_mut(input) else { return false };
        *follower = Follower { line: Some(Line { value, slope, from }), ..Follower::default() };
        true
    }

    /// The line that an input follows, if [`Instance::hold_input`] has said one: value, slope, and time of the value (s).
    pub fn line_of_input(&self, input: usize) -> Option<(f64, f64, f64)> {
        let line = self.memory.inputs.get(input)?.line?;
        Some((line.value, line.slope, line.from))
    }

    /// Value of an input at the time of the last evaluation.
    pub fn input_value(&self, input: usize) -> Option<f64> {
        let range = &self.loaded.model.area.inputs;
        self.memory.data[range.start as usize..range.end as usize].get(input).copied()
    }

    /// Begins a run at `t0` (s): the samples that count there.
    pub(crate) fn start_inputs(&mut self, t0: f64) -> Result<(), EvalFailure> {
        let instants = Instants::of_run(t0);
        for (site, follower) in self.loaded.model.structure.inputs.iter().zip(&mut self.memory.inputs) {
            if follower.line.is_some() {
                continue;
            }
            let Some(series) = &follower.series else {
                let reason = format!("the input `{}` has no samples", site.name);
                return Err(EvalFailure { variable: Some(site.name.to_string()), reason, ..EvalFailure::default() });
            };
            follower.sample = series.interval(t0, 0);
            while follower.stepwise
                && series.times().get(follower.sample + 1).is_some_and(|&time| instants.has_come(time, t0))
            {
                follower.sample += 1;
            }
        }
        Ok(())
    }

    /// Slope and second derivative of an input at the time of the last evaluation.
    pub fn input_slope(&self, input: usize) -> (f64, f64) {
        self.memory.inputs.get(input).map_or((0.0, 0.0), |follower| (follower.slope, follower.curvature))
    }

    /// See [`hyd_system::Inputs::input_reach`].
    pub(crate) fn reach_of_inputs(&self, t: f64) -> f64 {
        let reach = |follower: &Follower| match &follower.series {
            Some(series) if !follower.stepwise => series.reach(series.interval(t, follower.sample), t),
            _ => f64::INFINITY,
        };
        self.memory.inputs.iter().map(reach).fold(f64::INFINITY, f64::min)
    }

    /// See [`hyd_system::Inputs::samples_passed`].
    pub(crate) fn passed_samples(&self, t: f64) -> u64 {
        let passed = |follower: &Follower| match &follower.series {
            Some(_) if follower.stepwise => follower.sample as u64,
            Some(series) => series.interval(t, follower.sample) as u64,
            None => 0,
        };
        self.memory.inputs.iter().map(passed).max().unwrap_or(0)
    }

    /// The earlier of a time event and the next jump of an input after `t` (s).
    pub(crate) fn or_jump_of_input(&self, next: TimeEvent, t: f64) -> TimeEvent {
        let instants = self.memory.clock.instants;
        let mut next = next;
        for time in self.memory.inputs.iter().filter_map(Follower::next_break) {
            // What coincides happens at the system's own instant.
            if instants.lies_ahead(time, t) && instants.lies_ahead(next.t, time) {
                next = TimeEvent::of_input(time);
            }
        }
        next
    }

    /// Lets the samples count whose time has come at `t` (s); true if a value or slope has jumped.
    pub(crate) fn pass_samples(&mut self, t: f64) -> bool {
        let instants = self.memory.clock.instants;
        let mut jumped = false;
        for follower in self.memory.inputs.iter_mut().filter(|follower| follower.stepwise) {
            let Some(series) = &follower.series else { continue };
            let before = follower.sample;
            while series.times().get(follower.sample + 1).is_some_and(|&time| instants.has_come(time, t)) {
                follower.sample += 1;
            }
            jumped |= series.next_break(before).is_some_and(|k| k <= follower.sample);
        }
        if jumped {
            self.move_inputs(t);
        }
        jumped
    }
}

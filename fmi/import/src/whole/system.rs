//! The contract of a system, for a text with units in it: every question goes to the text, the units, or both.

use std::sync::Arc;

use hyd_system::{
    AssertionReport, DaeSystem, Delays, EvalFailure, EventChange, EventPhase, Excerpt, Homotopy, InputError, Inputs,
    ParameterError, Series, StateChoice, StateChoices, Steps, Structure, Switches, Tables, Tangents, TimeEvent,
    TornLoops,
};

use super::start::differs;
use super::{Whole, earlier};

impl DaeSystem for Whole {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn tables(&self) -> &Arc<Tables> {
        &self.tables
    }

    fn parameters(&self) -> &[f64] {
        self.text.parameters()
    }

    fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        self.text.set_parameter(index, value)?;
        self.set.insert(index);
        Ok(())
    }

    fn bind(&mut self, t0: f64) -> Result<(), EvalFailure> {
        self.carry_nothing();
        self.bind_all(t0)
    }

    fn nominals(&self, out: &mut [f64]) {
        self.text.nominals(&mut out[..self.sizes.unknowns]);
        for part in &self.parts {
            part.unit.nominals(&mut out[part.x.clone()]);
            out[part.y.clone()].copy_from_slice(&part.nominals.0);
            out[part.w.clone()].copy_from_slice(&part.nominals.1);
        }
    }

    fn tested(&self, out: &mut [bool]) {
        out[..self.sizes.first].fill(true);
        self.text.tested(&mut out[..self.sizes.unknowns]);
        out[self.sizes.first..].fill(false);
    }

    fn initial_nominals(&self, out: &mut [f64]) {
        let (m, first) = (self.sizes.initial, self.sizes.first);
        self.text.initial_nominals(&mut out[..m]);
        for part in &self.parts {
            out[part.y.start - first + m..part.y.end - first + m].copy_from_slice(&part.nominals.0);
            out[part.w.start - first + m..part.w.end - first + m].copy_from_slice(&part.nominals.1);
        }
    }

    fn initial_guess(&mut self, t0: f64, z: &mut [f64]) -> Result<(), EvalFailure> {
        let (m, first) = (self.sizes.initial, self.sizes.first);
        self.text.initial_guess(t0, &mut z[..m])?;
        z[m..].copy_from_slice(&self.started[first..]);
        Ok(())
    }

    fn initial_residual(&mut self, t0: f64, z: &[f64], out: &mut [f64]) -> Result<(), EvalFailure> {
        self.initial_rows(t0, z, out)
    }

    fn initial_jacobian(&mut self, t0: f64, z: &[f64], values: &mut [f64]) -> Result<(), EvalFailure> {
        self.initial_values(t0, z, values)
    }

    fn initial_store(&mut self, t0: f64, z: &[f64], y: &mut [f64], yp: &mut [f64]) -> Result<(), EvalFailure> {
        self.store(t0, z, y, yp)
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let n = self.sizes.unknowns;
        self.tell_text(y);
        self.text.residual(t, &y[..n], &yp[..n], &mut out[..n]);
        for part in &mut self.parts {
            part.watch(t, y);
            for (at, rate) in part.x.clone().zip(&part.rates) {
                out[at] = yp[at] - rate;
            }
            for (&(_, place), at) in part.reads.iter().zip(part.y.clone()) {
                out[at] = y[at] - part.watched[place];
            }
        }
        if self.parts.iter().all(|part| part.gives.is_empty()) {
            return;
        }
        self.text_row(t, &y[..n], &yp[..n]);
        for part in &self.parts {
            for (&(source, _, _), at) in part.gives.iter().zip(part.w.clone()) {
                out[at] = y[at] - self.given(source, &self.row);
            }
        }
    }

    fn jacobian(&mut self, t: f64, y: &[f64], yp: &[f64], state_values: &mut [f64], rate_values: &mut [f64]) {
        self.jacobian_values(t, (y, yp), (state_values, rate_values), None);
    }

    fn roots(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let n = self.sizes.unknowns;
        let (units, text) = out.split_at_mut(self.sizes.indicators);
        let mut first = 0;
        for part in &mut self.parts {
            let last = first + part.unit.structure().roots;
            part.tell(y);
            part.unit.roots(t, &y[part.x.clone()], &[], &mut units[first..last]);
            first = last;
        }
        self.tell_text(y);
        self.text.roots(t, &y[..n], &yp[..n], text);
    }

    fn held(&self, out: &mut [bool]) {
        let (units, text) = out.split_at_mut(self.sizes.indicators);
        let mut first = 0;
        for part in &self.parts {
            let last = first + part.unit.structure().roots;
            part.unit.held(&mut units[first..last]);
            first = last;
        }
        self.text.held(text);
    }

    fn next_time_event(&mut self, t: f64) -> TimeEvent {
        let mut next = self.text.next_time_event(t);
        for part in &mut self.parts {
            next = earlier(next, part.unit.next_time_event(t), t, self.instants);
        }
        next
    }

    fn unchanged_until(&mut self, t: f64, until: f64) -> f64 {
        self.text.unchanged_until(t, until)
    }

    fn event_pass(&mut self, phase: EventPhase, t: f64, y: &mut [f64], yp: &[f64]) -> Result<EventChange, EvalFailure> {
        let n = self.sizes.unknowns;
        self.tell_text(y);
        let mut change = self.text.event_pass(phase, t, &mut y[..n], &yp[..n])?;
        for part in &mut self.parts {
            let own = match phase {
                EventPhase::Initial => part.unit.event_pass(phase, t, &mut y[part.x.clone()], &[])?,
                EventPhase::First => part.event(t, y)?,
                // What it is given may have jumped with what the text has changed.
                EventPhase::Iterate | EventPhase::Started if part.is_unsettled(t, y) => part.event(t, y)?,
                EventPhase::Iterate | EventPhase::Started | EventPhase::Repeat => continue,
            };
            part.passed = (phase != EventPhase::Initial).then_some(own.reinitialised);
            change.by_inputs &= !own.changed;
            change.changed |= own.changed;
            change.reinitialised |= own.reinitialised;
            change.terminated = change.terminated.or(own.terminated);
        }
        Ok(change)
    }

    fn outputs(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let (n, row) = (self.sizes.unknowns, self.sizes.row);
        // What is read is computed here, and not what the solver has found to its tolerance.
        for part in &mut self.parts {
            part.watch(t, y);
        }
        if let Some(inputs) = self.text.inputs() {
            for part in &self.parts {
                for &(input, place) in &part.reads {
                    // The position was found in the list of the inputs.
                    let _ = inputs.give_input(input, part.watched[place]);
                }
            }
        }
        self.text.outputs(t, &y[..n], &yp[..n], &mut out[..row]);
        out[row..].copy_from_slice(&y[n..self.sizes.first]);
    }

    fn find_excerpt(&mut self, _wanted: &[u32]) -> Option<Excerpt> {
        None
    }

    fn excerpt(&mut self, _number: usize, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.outputs(t, y, yp, out);
    }

    fn assertions(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut Vec<AssertionReport>) {
        let n = self.sizes.unknowns;
        self.tell_text(y);
        self.text.assertions(t, &y[..n], &yp[..n], out);
        for part in &mut self.parts {
            part.unit.assertions(t, &y[part.x.clone()], &[], out);
        }
    }

    fn diagnose(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<EvalFailure> {
        let n = self.sizes.unknowns;
        if let Some(reason) = self.why_lost() {
            let reason = format!("derivatives by parameters are not known: {reason}");
            return Some(EvalFailure { reason, ..EvalFailure::default() });
        }
        for part in &mut self.parts {
            part.tell(y);
            if let Some(failure) = part.unit.diagnose(t, &y[part.x.clone()], &[]) {
                return Some(failure);
            }
        }
        self.tell_text(y);
        self.text.diagnose(t, &y[..n], &yp[..n])
    }

    fn diagnose_initial(&mut self, t0: f64, z: &[f64]) -> Option<EvalFailure> {
        if let Some(failure) = self.parts.iter_mut().find_map(|part| part.unit.diagnose_initial(t0, &[])) {
            return Some(failure);
        }
        self.tell_initial(z);
        self.text.diagnose_initial(t0, &z[..self.sizes.initial])
    }

    fn homotopy(&mut self) -> Option<&mut dyn Homotopy> {
        self.text.homotopy()
    }

    fn torn_loops(&mut self) -> Option<&mut dyn TornLoops> {
        None
    }

    fn switches(&mut self) -> Option<&mut dyn Switches> {
        if self.text.switches().is_some() { Some(self) } else { None }
    }

    fn state_choices(&mut self) -> Option<&mut dyn StateChoices> {
        if self.text.state_choices().is_some() { Some(self) } else { None }
    }

    fn delays(&mut self) -> Option<&mut dyn Delays> {
        if self.structure.delays.is_empty() { None } else { Some(self) }
    }

    fn inputs(&mut self) -> Option<&mut dyn Inputs> {
        if self.open.is_empty() { None } else { Some(self) }
    }

    fn steps(&mut self) -> Option<&mut dyn Steps> {
        let is_told = self.text.steps().is_some() || self.parts.iter_mut().any(|part| part.unit.steps().is_some());
        if is_told { Some(self) } else { None }
    }

    fn tangents(&mut self) -> Option<&mut dyn Tangents> {
        if self.has_tangents() { Some(self) } else { None }
    }
}

impl super::Part {
    /// An event of the unit, which may write into its states.
    fn event(&mut self, t: f64, y: &mut [f64]) -> Result<EventChange, EvalFailure> {
        self.tell(y);
        self.settled.copy_from_slice(&y[self.w.clone()]);
        self.unit.event_pass(EventPhase::First, t, &mut y[self.x.clone()], &[])
    }

    /// What it is given is not what it was at its last event, or its indicators are on another side.
    fn is_unsettled(&mut self, t: f64, y: &[f64]) -> bool {
        let now = &y[self.w.clone()];
        if now.iter().zip(&self.settled).any(|(now, then)| differs(*now, *then)) {
            return true;
        }
        let count = self.unit.structure().roots;
        let (mut values, mut held) = (vec![0.0; count], vec![false; count]);
        self.tell(y);
        self.unit.roots(t, &y[self.x.clone()], &[], &mut values);
        self.unit.held(&mut held);
        values.iter().zip(&held).any(|(value, held)| (*value > 0.0) != *held)
    }
}

impl Inputs for Whole {
    fn set_input(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        let own = *self.open.get(input).ok_or(InputError::Unknown)?;
        self.text.inputs().ok_or(InputError::Unknown)?.set_input(own, series)
    }

    fn give_input(&mut self, input: usize, value: f64) -> Result<(), InputError> {
        let own = *self.open.get(input).ok_or(InputError::Unknown)?;
        self.text.inputs().ok_or(InputError::Unknown)?.give_input(own, value)
    }

    fn input_reach(&mut self, t: f64) -> f64 {
        self.text.inputs().map_or(f64::INFINITY, |inputs| inputs.input_reach(t))
    }

    fn samples_passed(&mut self, t: f64) -> u64 {
        self.text.inputs().map_or(0, |inputs| inputs.samples_passed(t))
    }
}

impl Steps for Whole {
    fn completed(&mut self, t: f64, y: &[f64]) -> Result<bool, EvalFailure> {
        let n = self.sizes.unknowns;
        let mut event = match self.text.steps() {
            Some(steps) => steps.completed(t, &y[..n])?,
            None => false,
        };
        if self.is_carrying() {
            self.compare_at_step(t, y);
        }
        for part in &mut self.parts {
            part.tell(y);
            if let Some(steps) = part.unit.steps() {
                event |= steps.completed(t, &y[part.x.clone()])?;
            }
        }
        if event && self.is_carrying() {
            // Its instant is that of a step, which says nothing of how it moves.
            self.lose("the unit asks for an event at a step");
        }
        Ok(event)
    }
}

impl Delays for Whole {
    fn delay_bounds(&mut self, out: &mut [f64]) {
        if let Some(delays) = self.text.delays() {
            delays.delay_bounds(out);
        }
    }

    fn delay_points(&mut self, t: f64, y: &[f64], yp: &[f64], sources: &mut [f64], times: &mut [f64]) {
        let n = self.sizes.unknowns;
        self.tell_text(y);
        if let Some(delays) = self.text.delays() {
            delays.delay_points(t, &y[..n], &yp[..n], sources, times);
        }
    }

    fn set_delayed(&mut self, values: &[f64], rates: &[f64], times: &[f64]) {
        if let Some(delays) = self.text.delays() {
            delays.set_delayed(values, rates, times);
        }
    }
}

impl Switches for Whole {
    fn switch(&mut self, t: f64, y: &[f64], yp: &[f64]) -> bool {
        let n = self.sizes.unknowns;
        self.tell_text(y);
        self.text.switches().is_some_and(|switches| switches.switch(t, &y[..n], &yp[..n]))
    }

    fn switched(&mut self) -> Vec<f64> {
        self.text.switches().map_or_else(Vec::new, |switches| switches.switched())
    }

    fn switch_back(&mut self, kept: &[f64]) {
        if let Some(switches) = self.text.switches() {
            switches.switch_back(kept);
        }
    }
}

impl StateChoices for Whole {
    fn states(&mut self, out: &mut [bool]) {
        out.copy_from_slice(&self.structure.differential);
        self.text.states(&mut out[..self.sizes.unknowns]);
    }

    fn choose_states(&mut self, t: f64, y: &[f64], yp: &[f64]) -> StateChoice {
        let n = self.sizes.unknowns;
        self.tell_text(y);
        self.text.state_choices().map_or_else(StateChoice::default, |own| own.choose_states(t, &y[..n], &yp[..n]))
    }
}

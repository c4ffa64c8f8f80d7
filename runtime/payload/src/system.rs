//! The contract with the solver: an instance of a compiled model as [`DaeSystem`].
//!
//! Every entry point writes time and the `initial()` flag and runs what answers it.  Nothing of the crate calls back to here.

use std::sync::Arc;

use hyd_system::{
    AssertionReport, DaeSystem, Delays, EvalFailure, EventChange, EventPhase, Excerpt, Homotopy, InputError, Inputs,
    LoopError, ParameterError, Series, StateChoice, StateChoices, Steps, Structure, Switches, Tables, Tangents,
    TimeEvent, TornLoops,
};

use crate::clock::Clock;
use crate::instance::{Instance, Point};
use crate::program::HOMOTOPY;
use crate::selection::CandidateSet;

impl DaeSystem for Instance {
    fn structure(&self) -> &Structure {
        &self.loaded.model.structure
    }

    fn tables(&self) -> &Arc<Tables> {
        &self.loaded.model.tables
    }

    fn parameters(&self) -> &[f64] {
        let range = &self.loaded.model.area.parameters;
        &self.memory.data[range.start as usize..range.end as usize]
    }

    fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        self.give(index, value)
    }

    fn bind(&mut self, t0: f64) -> Result<(), EvalFailure> {
        self.reset();
        self.memory.repetitions = 0;
        self.memory.clock = Clock::of_run(t0);
        self.start_inputs(t0)?;
        self.set_time(t0, true);
        let routine = self.loaded.model.routines.bind;
        self.run(routine, Point::NOWHERE, &mut [], &mut []);
        if let Some(failure) = self.bind_failure(routine, Point::NOWHERE) {
            return Err(failure);
        }
        self.start_discrete();
        self.memory.choices = self.loaded.model.candidates.iter().map(CandidateSet::first_choice).collect();
        self.write_choices();
        Ok(())
    }

    fn nominals(&self, out: &mut [f64]) {
        out.copy_from_slice(&self.loaded.model.nominals);
    }

    fn tested(&self, out: &mut [bool]) {
        out.copy_from_slice(&self.loaded.model.tested);
    }

    fn initial_nominals(&self, out: &mut [f64]) {
        out.copy_from_slice(&self.loaded.model.initial_nominals);
    }

    fn initial_guess(&mut self, t0: f64, z: &mut [f64]) -> Result<(), EvalFailure> {
        self.set_time(t0, true);
        for (value, start) in z.iter_mut().zip(&self.loaded.model.initial.guess) {
            *value = start.map_or(0.0, |index| self.memory.data[index as usize]);
        }
        self.guess_relations(z);
        self.decide_known(z);
        Ok(())
    }

    fn initial_residual(&mut self, t0: f64, z: &[f64], out: &mut [f64]) -> Result<(), EvalFailure> {
        self.set_time(t0, true);
        let routine = self.loaded.model.routines.initial.residual;
        self.run(routine, Point { unknown: z, rate: &[] }, out, &mut []);
        Ok(())
    }

    fn initial_jacobian(&mut self, t0: f64, z: &[f64], values: &mut [f64]) -> Result<(), EvalFailure> {
        self.set_time(t0, true);
        self.run_jacobian(true, Point { unknown: z, rate: &[] }, values, &mut []);
        Ok(())
    }

    fn initial_store(&mut self, t0: f64, z: &[f64], y: &mut [f64], yp: &mut [f64]) -> Result<(), EvalFailure> {
        self.set_time(t0, true);
        let loaded = self.loaded.clone();
        self.run(loaded.model.routines.initial.assign, Point { unknown: z, rate: &[] }, &mut [], &mut []);
        self.take_over(z, y, yp);
        self.take_values(z);
        self.start_late(z)?;
        self.start_delayed(z);
        if !y.iter().chain(yp.iter()).all(|value| value.is_finite()) {
            return Err(self.initial_failure(z));
        }
        self.memory.contradiction = self.violated_condition(z);
        Ok(())
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.set_time(t, false);
        self.run(self.loaded.model.routines.simulation.residual, Point { unknown: y, rate: yp }, out, &mut []);
    }

    fn jacobian(&mut self, t: f64, y: &[f64], yp: &[f64], state_values: &mut [f64], rate_values: &mut [f64]) {
        self.set_time(t, false);
        self.run_jacobian(false, Point { unknown: y, rate: yp }, state_values, rate_values);
    }

    fn roots(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.set_time(t, false);
        self.run(self.loaded.model.routines.simulation.extra, Point { unknown: y, rate: yp }, out, &mut []);
    }

    fn held(&self, out: &mut [bool]) {
        let first = self.loaded.model.area.held.start;
        for (truth, &relation) in out.iter_mut().zip(&self.loaded.model.routines.events.rooted) {
            *truth = self.memory.data[(first + relation) as usize] != 0.0;
        }
    }

    fn next_time_event(&mut self, t: f64) -> TimeEvent {
        let next = self.following_instant(t);
        self.or_jump_of_input(next, t)
    }

    fn unchanged_until(&mut self, t: f64, until: f64) -> f64 {
        self.first_change_of_time(t, until)
    }

    fn event_pass(&mut self, phase: EventPhase, t: f64, y: &mut [f64], yp: &[f64]) -> Result<EventChange, EvalFailure> {
        self.pass(phase, t, y, yp)
    }

    fn outputs(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.set_time(t, false);
        self.output_row(Point { unknown: y, rate: yp }, out);
    }

    fn find_excerpt(&mut self, wanted: &[u32]) -> Option<Excerpt> {
        Instance::find_excerpt(self, wanted)
    }

    fn excerpt(&mut self, number: usize, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.set_time(t, false);
        self.fill_excerpt(number, Point { unknown: y, rate: yp }, out);
    }

    fn assertions(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut Vec<AssertionReport>) {
        self.set_time(t, false);
        self.failed_assertions(y, yp, out);
    }

    fn diagnose(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<EvalFailure> {
        self.set_time(t, false);
        self.find_failure(false, Point { unknown: y, rate: yp })
    }

    fn diagnose_initial(&mut self, t0: f64, z: &[f64]) -> Option<EvalFailure> {
        self.set_time(t0, true);
        self.find_failure(true, Point { unknown: z, rate: &[] })
    }

    fn homotopy(&mut self) -> Option<&mut dyn Homotopy> {
        if self.loaded.model.initial.homotopy { Some(self) } else { None }
    }

    fn torn_loops(&mut self) -> Option<&mut dyn TornLoops> {
        if self.loaded.model.has_torn_loops() { Some(self) } else { None }
    }

    fn switches(&mut self) -> Option<&mut dyn Switches> {
        if self.loaded.model.area.held.is_empty() { None } else { Some(self) }
    }

    fn state_choices(&mut self) -> Option<&mut dyn StateChoices> {
        if self.loaded.model.candidates.is_empty() { None } else { Some(self) }
    }

    fn delays(&mut self) -> Option<&mut dyn Delays> {
        if self.loaded.model.delays.is_empty() { None } else { Some(self) }
    }

    fn inputs(&mut self) -> Option<&mut dyn Inputs> {
        if self.loaded.model.structure.inputs.is_empty() { None } else { Some(self) }
    }

    fn steps(&mut self) -> Option<&mut dyn Steps> {
        None
    }

    fn tangents(&mut self) -> Option<&mut dyn Tangents> {
        // How these start values move with what the start finds is not carried along; others do not move.
        (!self.loaded.model.initial.late_reals).then_some(self)
    }
}

impl Homotopy for Instance {
    fn set_homotopy(&mut self, share: f64) {
        self.memory.data[HOMOTOPY as usize] = share;
    }
}

impl TornLoops for Instance {
    fn loop_error(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<LoopError> {
        self.set_time(t, false);
        self.worst_loop(false, Point { unknown: y, rate: yp })
    }

    fn initial_loop_error(&mut self, t0: f64, z: &[f64]) -> Option<LoopError> {
        self.set_time(t0, true);
        self.worst_loop(true, Point { unknown: z, rate: &[] })
    }
}

impl Switches for Instance {
    fn switch(&mut self, t: f64, y: &[f64], yp: &[f64]) -> bool {
        self.switch_at(t, Point { unknown: y, rate: yp })
    }

    fn switched(&mut self) -> Vec<f64> {
        self.truths_and_values().map(|index| self.memory.data[index]).collect()
    }

    fn switch_back(&mut self, kept: &[f64]) {
        for (index, &value) in self.truths_and_values().zip(kept) {
            self.memory.data[index] = value;
        }
    }
}

impl StateChoices for Instance {
    fn states(&mut self, out: &mut [bool]) {
        out.copy_from_slice(&self.loaded.model.structure.differential);
        for (set, choice) in self.loaded.model.candidates.iter().zip(&self.memory.choices) {
            set.mark(choice, out);
        }
    }

    fn choose_states(&mut self, t: f64, y: &[f64], yp: &[f64]) -> StateChoice {
        self.set_time(t, false);
        let loaded = self.loaded.clone();
        let point = Point { unknown: y, rate: yp };
        self.run(loaded.model.routines.simulation.assign, point, &mut [], &mut []);
        self.run_own(loaded.model.routines.events.pivots, point);
        let mut first = 0;
        let mut all = StateChoice::default();
        for (set, choice) in loaded.model.candidates.iter().zip(&mut self.memory.choices) {
            let judged = set.judge(&self.memory.out[first..first + set.entries.len()], choice);
            all = StateChoice { changed: all.changed | judged.changed, room: all.room.min(judged.room) };
            first += set.entries.len();
        }
        if all.changed {
            self.write_choices();
        }
        all
    }
}

impl Delays for Instance {
    fn delay_bounds(&mut self, out: &mut [f64]) {
        self.bounds_of_delays(out);
    }

    fn delay_points(&mut self, t: f64, y: &[f64], yp: &[f64], sources: &mut [f64], times: &mut [f64]) {
        self.set_time(t, false);
        self.points_of_delays(Point { unknown: y, rate: yp }, sources, times);
    }

    fn set_delayed(&mut self, values: &[f64], rates: &[f64], times: &[f64]) {
        self.take_delayed(values, rates, times);
    }
}

impl Inputs for Instance {
    fn set_input(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        self.follow(input, series)
    }

    fn give_input(&mut self, input: usize, value: f64) -> Result<(), InputError> {
        if self.hold_input(input, value, (0.0, 0.0)) { Ok(()) } else { Err(InputError::Unknown) }
    }

    fn input_reach(&mut self, t: f64) -> f64 {
        self.reach_of_inputs(t)
    }

    fn samples_passed(&mut self, t: f64) -> u64 {
        self.passed_samples(t)
    }
}

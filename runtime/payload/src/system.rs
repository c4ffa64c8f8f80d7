//! An instance of a compiled model: its own memory over loaded code.
//!
//! Every entry point writes time and the `initial()` flag and runs one routine; vectors of the solver are passed to the
//! code as they are.  Nothing is allocated between `bind` and the end of a run, except for messages.

use std::sync::Arc;

use hyd_system::{
    AssertionReport, DaeSystem, EvalFailure, EventChange, EventPhase, InputError, LoopError, ParameterError, Series,
    StateChoice, Structure, Tables, TimeEvent, ValueKind,
};

use crate::ahead::Search;
use crate::engine::Engine;
use crate::input::Follower;
use crate::memory::Memory;
use crate::model::Loaded;
use crate::program::{Area, HOMOTOPY, INITIAL, Place, RoutineId, TIME};
use crate::routines::{JacobianForm, PlanRoutines};
use crate::selection::{CandidateSet, Choice};
use crate::timed::Clock;
use crate::vm::Registers;

/// An instance of a compiled model.  [`Clone`] gives a further instance in the same condition for another thread.
#[derive(Clone, Debug)]
pub struct Instance {
    pub(crate) loaded: Arc<Loaded>,
    pub(crate) memory: Own,
}

/// Memory of one instance.
#[derive(Clone, Debug)]
pub(crate) struct Own {
    /// The data area.
    pub data: Vec<f64>,
    /// Assigned variables of the simulation or of the initial system, whichever ran last.
    pub work: Vec<f64>,
    /// Results of event routines, in three thirds.
    pub out: Vec<f64>,
    /// Discrete values and relations before a pass.
    pub before: Vec<f64>,
    /// Discrete values before a round of a pass.
    pub last: Vec<f64>,
    scratch: Vec<f64>,
    /// Which candidates are states, per set.
    choices: Vec<Choice>,
    registers: Registers,
    /// Work space of the search for changes of relations of time alone.
    pub search: Search,
    /// On which side of the last time event the run stands.
    pub clock: Clock,
    /// The last pass of the event iteration has left `reinit` to its repetition.
    pub reinit_waits: bool,
    /// How often the last pass has been repeated.
    pub repetitions: u32,
    /// An initial condition that does not hold with the last solution of the initial system.
    pub contradiction: Option<EvalFailure>,
    /// Inputs that follow recorded samples.
    pub inputs: Vec<Follower>,
}

/// The vectors of the solver that a routine sees.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a> {
    /// Unknowns.
    pub unknown: &'a [f64],
    /// Their derivatives.
    pub rate: &'a [f64],
}

impl Point<'_> {
    /// For routines that read neither.
    pub const NOWHERE: Point<'static> = Point { unknown: &[], rate: &[] };
}

impl Instance {
    pub(crate) fn new(loaded: Arc<Loaded>) -> Self {
        let layout = &loaded.model.area;
        let mut data = vec![0.0; layout.length as usize];
        for &(index, value) in &layout.preset {
            data[index as usize] = value;
        }
        let work = loaded.model.rows.iter().map(|trace| trace.equations.len()).max().unwrap_or(0);
        let events = &loaded.model.routines.events;
        let pivots = loaded.model.candidates.iter().map(|set| set.entries.len()).sum();
        let checks = loaded.model.checks.iter().map(|check| 1 + check.values.1 as usize).sum();
        let starts = layout.held.len() + 2 * loaded.model.initial.checked.len();
        let sizes = [starts, events.timed.len(), events.by_time.len(), events.reinit_unknowns.len(), checks, pivots];
        let memory = Own {
            data,
            work: vec![0.0; work],
            out: vec![0.0; 3 * sizes.into_iter().max().unwrap_or(0)],
            before: vec![0.0; layout.discrete.len() + layout.held.len()],
            last: vec![0.0; layout.discrete.len()],
            scratch: vec![0.0; scratch_length(&loaded)],
            choices: loaded.model.candidates.iter().map(CandidateSet::first_choice).collect(),
            registers: loaded.engine.registers(),
            search: Search::default(),
            clock: Clock::default(),
            reinit_waits: false,
            repetitions: 0,
            contradiction: None,
            inputs: vec![Follower::default(); loaded.model.structure.inputs.len()],
        };
        let mut instance = Self { loaded, memory };
        for k in 0..instance.loaded.model.parameters.preset.len() {
            let (index, value) = instance.loaded.model.parameters.preset[k];
            // What the compiler has checked is settable; a value that is not changes nothing.
            let _ = instance.set_parameter(index as usize, value);
        }
        instance
    }

    /// The model that this is an instance of.
    pub fn loaded(&self) -> &Arc<Loaded> {
        &self.loaded
    }

    /// The assigned variables as the last routine left them.
    pub fn assigned(&self) -> &[f64] {
        &self.memory.work
    }

    /// Results of the last [`Instance::run_own`].
    pub fn results(&self) -> &[f64] {
        &self.memory.out
    }

    /// Writes the time (s) and the value of `initial()`.
    pub fn set_time(&mut self, t: f64, initial: bool) {
        self.memory.data[TIME as usize] = t;
        self.memory.data[INITIAL as usize] = f64::from(u8::from(initial));
        if !self.memory.inputs.is_empty() {
            self.move_inputs(t);
        }
    }

    /// Runs a routine of another program over the data of this one.
    pub fn run_on(
        &mut self,
        (engine, routine, registers): (&Engine, RoutineId, &mut Registers),
        point: Point<'_>,
        out: &mut [f64],
        out2: &mut [f64],
    ) {
        let Own { data, work, .. } = &mut self.memory;
        let mut memory = Memory { data, unknown: point.unknown, rate: point.rate, work, out, out2 };
        engine.run(routine, &mut memory, registers);
    }

    /// Runs a routine with results in the given slices.
    pub fn run(&mut self, routine: RoutineId, point: Point<'_>, out: &mut [f64], out2: &mut [f64]) {
        let Own { data, work, registers, .. } = &mut self.memory;
        let mut memory = Memory { data, unknown: point.unknown, rate: point.rate, work, out, out2 };
        self.loaded.engine.run(routine, &mut memory, registers);
    }

    /// Runs a routine with results in [`Instance::results`].
    pub fn run_own(&mut self, routine: RoutineId, point: Point<'_>) {
        let mut out = std::mem::take(&mut self.memory.out);
        self.run(routine, point, &mut out, &mut []);
        self.memory.out = out;
    }

    /// Values of the Jacobians of the simulation or of the initial system; time has been set.
    pub fn run_jacobian(&mut self, initial: bool, point: Point<'_>, state: &mut [f64], rate: &mut [f64]) {
        let loaded = self.loaded.clone();
        let code: &PlanRoutines =
            if initial { &loaded.model.routines.initial } else { &loaded.model.routines.simulation };
        match &code.jacobian {
            JacobianForm::Entries(routine) => self.run(*routine, point, state, rate),
            JacobianForm::Partials(routine, accumulation, _) => {
                let mut scratch = std::mem::take(&mut self.memory.scratch);
                accumulation.begin(&mut scratch[..accumulation.length]);
                self.run(*routine, point, &mut scratch, &mut []);
                accumulation.run(&mut scratch[..accumulation.length], state, rate);
                self.memory.scratch = scratch;
            }
        }
    }

    fn read(&self, place: Place, z: &[f64]) -> f64 {
        let index = place.index as usize;
        match place.area {
            Area::Data => self.memory.data[index],
            Area::Unknown => z[index],
            Area::Work => self.memory.work[index],
            _ => 0.0,
        }
    }

    /// Restores everything but the given parameters to its value before `bind`.
    fn reset(&mut self) {
        let layout = &self.loaded.model.area;
        let first_given = layout.parameters.end as usize;
        let given = first_given..first_given + 2 * layout.given.iter().flatten().count();
        let kept: Vec<f64> = self.memory.data[given.clone()].to_vec();
        self.memory.data.fill(0.0);
        self.memory.data[given].copy_from_slice(&kept);
        for &(index, value) in &layout.preset {
            self.memory.data[index as usize] = value;
        }
        for &(index, given) in &self.loaded.model.parameters.unbound {
            self.memory.data[index as usize] = self.memory.data[given.value as usize];
        }
    }

    /// Puts the choices of states where the equations read them.
    fn write_choices(&mut self) {
        let range = self.loaded.model.area.chosen.clone();
        let chosen = &mut self.memory.data[range.start as usize..range.end as usize];
        for (set, choice) in self.loaded.model.candidates.iter().zip(&self.memory.choices) {
            set.write(choice, chosen);
        }
    }
}

fn scratch_length(loaded: &Loaded) -> usize {
    let length = |code: &PlanRoutines| match &code.jacobian {
        JacobianForm::Partials(_, accumulation, _) => accumulation.length,
        JacobianForm::Entries(_) => 0,
    };
    length(&loaded.model.routines.simulation).max(length(&loaded.model.routines.initial))
}

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
        let given = self.loaded.model.area.given.get(index).copied().flatten();
        let given = given.ok_or(ParameterError::NotSettable)?;
        if !fits(&self.loaded.model.parameters.kinds[index], value) {
            return Err(ParameterError::BadValue);
        }
        self.memory.data[given.flag as usize] = 1.0;
        self.memory.data[given.value as usize] = value;
        Ok(())
    }

    fn bind(&mut self, t0: f64) -> Result<(), EvalFailure> {
        self.reset();
        self.memory.repetitions = 0;
        self.memory.clock = Clock::of_run(t0);
        self.start_inputs(t0)?;
        self.set_time(t0, true);
        let routine = self.loaded.model.routines.bind;
        self.run(routine, Point::NOWHERE, &mut [], &mut []);
        if let Some(failure) = self.bind_failure(routine) {
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

    fn initial_nominals(&self, out: &mut [f64]) {
        out.copy_from_slice(&self.loaded.model.initial_nominals);
    }

    fn initial_guess(&mut self, t0: f64, z: &mut [f64]) -> Result<(), EvalFailure> {
        self.set_time(t0, true);
        for (value, start) in z.iter_mut().zip(&self.loaded.model.initial.guess) {
            *value = start.map_or(0.0, |index| self.memory.data[index as usize]);
        }
        self.guess_relations(z);
        Ok(())
    }

    fn has_homotopy(&self) -> bool {
        self.loaded.model.initial.homotopy
    }

    fn set_homotopy(&mut self, share: f64) {
        self.memory.data[HOMOTOPY as usize] = share;
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
        let transfer = &loaded.model.initial;
        for (value, place) in y.iter_mut().zip(&transfer.states) {
            *value = place.map_or(0.0, |place| self.read(place, z));
        }
        for (value, place) in yp.iter_mut().zip(&transfer.rates) {
            *value = place.map_or(0.0, |place| self.read(place, z));
        }
        for &(from, to) in &transfer.values {
            self.memory.data[to as usize] = self.read(from, z);
        }
        self.start_late()?;
        self.start_delayed(z);
        if !y.iter().chain(yp.iter()).all(|value| value.is_finite()) {
            return Err(self.initial_failure(z));
        }
        self.memory.contradiction = self.violated_condition(z);
        Ok(())
    }

    fn loop_error(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<LoopError> {
        self.set_time(t, false);
        self.worst_loop(false, Point { unknown: y, rate: yp })
    }

    fn initial_loop_error(&mut self, t0: f64, z: &[f64]) -> Option<LoopError> {
        self.set_time(t0, true);
        self.worst_loop(true, Point { unknown: z, rate: &[] })
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.set_time(t, false);
        self.run(self.loaded.model.routines.simulation.residual, Point { unknown: y, rate: yp }, out, &mut []);
    }

    fn jacobian(&mut self, t: f64, y: &[f64], yp: &[f64], state_values: &mut [f64], rate_values: &mut [f64]) {
        self.set_time(t, false);
        self.run_jacobian(false, Point { unknown: y, rate: yp }, state_values, rate_values);
    }

    fn states(&self, out: &mut [bool]) {
        out.copy_from_slice(&self.loaded.model.structure.differential);
        for (set, choice) in self.loaded.model.candidates.iter().zip(&self.memory.choices) {
            set.mark(choice, out);
        }
    }

    fn choose_states(&mut self, t: f64, y: &[f64], yp: &[f64]) -> StateChoice {
        if self.loaded.model.candidates.is_empty() {
            return StateChoice::default();
        }
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
        self.run(self.loaded.model.routines.simulation.assign, Point { unknown: y, rate: yp }, &mut [], &mut []);
        let row = &self.loaded.model.row;
        let (assigned, rest) = out.split_at_mut(row.assigned as usize);
        assigned.copy_from_slice(&self.memory.work[..row.assigned as usize]);
        let (unknowns, rest) = rest.split_at_mut(y.len());
        unknowns.copy_from_slice(y);
        let (rates, discrete) = rest.split_at_mut(row.states.len());
        for (value, &state) in rates.iter_mut().zip(&row.states) {
            *value = yp[state as usize];
        }
        let range = &self.loaded.model.area.discrete;
        discrete.copy_from_slice(&self.memory.data[range.start as usize..range.end as usize]);
    }

    fn assertions(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut Vec<AssertionReport>) {
        self.set_time(t, false);
        self.failed_assertions(y, yp, out);
    }

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

    fn set_input(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        self.follow(input, series)
    }

    fn input_reach(&mut self, t: f64) -> f64 {
        self.reach_of_inputs(t)
    }

    fn diagnose(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<EvalFailure> {
        self.set_time(t, false);
        self.find_failure(false, Point { unknown: y, rate: yp })
    }

    fn diagnose_initial(&mut self, t0: f64, z: &[f64]) -> Option<EvalFailure> {
        self.set_time(t0, true);
        self.find_failure(true, Point { unknown: z, rate: &[] })
    }
}

/// True if the parameter of this type may take the value.
fn fits(kind: &ValueKind, value: f64) -> bool {
    value.is_finite()
        && match kind {
            ValueKind::Real => true,
            ValueKind::Integer => value.fract() == 0.0,
            ValueKind::Boolean => value == 0.0 || value == 1.0,
            ValueKind::Enumeration(literals) => value.fract() == 0.0 && value >= 1.0 && value <= literals.len() as f64,
        }
}

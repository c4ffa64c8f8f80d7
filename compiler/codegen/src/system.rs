//! An instance of a compiled model: its own memory over shared code.
//!
//! Every entry point writes time and the `initial()` flag and runs one routine; vectors of the solver are passed to the
//! code as they are.  Nothing is allocated between `bind` and the end of a run, except for messages.

use std::sync::Arc;

use hyd_flat::Target;
use hyd_system::{
    AssertionReport, DaeSystem, EvalFailure, EventChange, EventPhase, ParameterError, Structure, Tables, Tangents,
};

use crate::layout::Place;
use crate::lower::plan::{JacobianCode, PlanCode};
use crate::memory::Memory;
use crate::model::{CompiledModel, Shared, fits};
use crate::program::{Area, HOMOTOPY, INITIAL, RoutineId, TIME};
use crate::selection::{CandidateSet, Choice};
use crate::tangent::TangentMemory;
use crate::vm::Registers;

/// A fixed start value may differ from what follows from others by this, relative to both or to 1.
const SAME_START: f64 = 1e-6;

/// An instance of a compiled model.  [`Clone`] gives a further instance in the same condition for another thread.
#[derive(Clone, Debug)]
pub struct CompiledSystem {
    pub(crate) shared: Arc<Shared>,
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
    /// An initial condition that does not hold with the last solution of the initial system.
    pub contradiction: Option<EvalFailure>,
    /// Present once directions are set.
    pub tangents: Option<Box<TangentMemory>>,
}

/// The vectors of the solver that a routine sees.
#[derive(Clone, Copy)]
pub(crate) struct Point<'a> {
    pub unknown: &'a [f64],
    pub rate: &'a [f64],
}

impl CompiledSystem {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        let layout = &shared.lowered.layout;
        let mut data = vec![0.0; layout.data as usize];
        for &(index, value) in &layout.preset {
            data[index as usize] = value;
        }
        let work = shared.origins.plans.iter().map(|trace| trace.equations.len()).max().unwrap_or(0);
        let events = &shared.lowered.events;
        let pivots = shared.candidates.iter().map(CandidateSet::entries).sum();
        let checks = shared.checks.iter().map(|check| 1 + check.values).sum();
        let starts = layout.held.len() + 2 * shared.initial.checked.len();
        let sizes = [starts, events.timed.len(), events.reinit_unknowns.len(), checks, pivots];
        let memory = Own {
            data,
            work: vec![0.0; work],
            out: vec![0.0; 3 * sizes.into_iter().max().unwrap_or(0)],
            before: vec![0.0; layout.discrete.len() + layout.held.len()],
            last: vec![0.0; layout.discrete.len()],
            scratch: vec![0.0; scratch_length(&shared)],
            choices: shared.candidates.iter().map(CandidateSet::first_choice).collect(),
            registers: shared.engine.registers(),
            tangents: None,
            contradiction: None,
        };
        Self { shared, memory }
    }

    /// The model that this is an instance of.
    pub fn model(&self) -> CompiledModel {
        CompiledModel { shared: self.shared.clone() }
    }

    pub(crate) fn set_time(&mut self, t: f64, initial: bool) {
        self.memory.data[TIME as usize] = t;
        self.memory.data[INITIAL as usize] = f64::from(u8::from(initial));
    }

    /// Runs a routine with results in the given slice.
    pub(crate) fn run(&mut self, routine: RoutineId, point: Point<'_>, out: &mut [f64], out2: &mut [f64]) {
        let Own { data, work, registers, .. } = &mut self.memory;
        let mut memory = Memory { data, unknown: point.unknown, rate: point.rate, work, out, out2 };
        self.shared.engine.run(routine, &mut memory, registers);
    }

    /// Runs a routine with results in `memory.out`.
    pub(crate) fn run_own(&mut self, routine: RoutineId, point: Point<'_>) {
        let mut out = std::mem::take(&mut self.memory.out);
        self.run(routine, point, &mut out, &mut []);
        self.memory.out = out;
    }

    pub(crate) fn run_jacobian(&mut self, initial: bool, point: Point<'_>, state: &mut [f64], rate: &mut [f64]) {
        let shared = self.shared.clone();
        let code: &PlanCode = if initial { &shared.lowered.initial } else { &shared.lowered.simulation };
        match &code.jacobian {
            JacobianCode::Entries(routine) => self.run(*routine, point, state, rate),
            JacobianCode::Partials(routine, accumulation, _) => {
                let mut scratch = std::mem::take(&mut self.memory.scratch);
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

    /// Truth of the relations at the guess, so that the initial system starts on the likely branches.
    fn guess_relations(&mut self, z: &[f64]) {
        let (held, routine) = (self.shared.lowered.layout.held.clone(), self.shared.lowered.initial.extra);
        if held.is_empty() {
            return;
        }
        // A second round, because assigned variables may depend on relations.
        for _ in 0..2 {
            self.run_own(routine, Point { unknown: z, rate: &[] });
            for (k, index) in held.clone().enumerate() {
                let truth = self.memory.out[k];
                self.memory.data[index as usize] = if truth.is_finite() { truth } else { 0.0 };
            }
        }
    }

    /// Restores everything but the given parameters to its value before `bind`.
    fn reset(&mut self) {
        let layout = &self.shared.lowered.layout;
        let first_given = layout.parameters.end as usize;
        let given = first_given..first_given + 2 * layout.given.iter().flatten().count();
        let kept: Vec<f64> = self.memory.data[given.clone()].to_vec();
        self.memory.data.fill(0.0);
        self.memory.data[given].copy_from_slice(&kept);
        for &(index, value) in &layout.preset {
            self.memory.data[index as usize] = value;
        }
        for &(index, given) in &self.shared.parameters.unbound {
            self.memory.data[index as usize] = self.memory.data[given.value as usize];
        }
    }

    /// Puts the choices of states where the equations read them.
    fn write_choices(&mut self) {
        let range = self.shared.lowered.layout.chosen.clone();
        let chosen = &mut self.memory.data[range.start as usize..range.end as usize];
        for (set, choice) in self.shared.candidates.iter().zip(&self.memory.choices) {
            set.write(choice, chosen);
        }
    }

    /// Initial conditions that follow from others must hold; the first one that does not.
    fn violated_condition(&mut self, z: &[f64]) -> Option<EvalFailure> {
        let shared = self.shared.clone();
        let checked = &shared.initial.checked;
        if checked.is_empty() {
            return None;
        }
        self.run_own(shared.lowered.initial.extra, Point { unknown: z, rate: &[] });
        let sides = &self.memory.out[shared.lowered.layout.held.len()..];
        let violated = |side: &[f64]| {
            let [value, wanted] = [side[0], side[1]];
            let near = (value - wanted).abs() <= SAME_START * value.abs().max(wanted.abs()).max(1.0);
            (!near).then_some((value, wanted))
        };
        checked.iter().zip(sides.chunks_exact(2)).find_map(|(condition, sides)| {
            let (left, right) = violated(sides)?;
            let name = condition.start_of.map(|v| shared.origins.target_name(Target::Var(v)));
            let reason = match name {
                Some(_) => {
                    format!("its fixed start value {right} contradicts the other initial conditions, which give {left}")
                }
                None => format!(
                    "the initial equation `{}` contradicts the other conditions, which give {left} on its left and \
                     {right} on its right side",
                    condition.text
                ),
            };
            let equation = Some(condition.equation).filter(|_| name.is_none());
            Some(EvalFailure { equation, variable: name, reason })
        })
    }

    /// Discrete variables and their `pre` start at their start values.
    fn start_discrete(&mut self) {
        let shared = self.shared.clone();
        let layout = &shared.lowered.layout;
        for (k, &v) in layout.discrete_vars.iter().enumerate() {
            let start = layout.start(v).map_or(0.0, |index| self.memory.data[index as usize]);
            self.memory.data[layout.discrete.start as usize + k] = start;
            self.memory.data[layout.pre.start as usize + k] = start;
        }
    }
}

fn scratch_length(shared: &Shared) -> usize {
    let length = |code: &PlanCode| match &code.jacobian {
        JacobianCode::Partials(_, accumulation, _) => accumulation.length,
        JacobianCode::Entries(_) => 0,
    };
    length(&shared.lowered.simulation).max(length(&shared.lowered.initial))
}

impl DaeSystem for CompiledSystem {
    fn structure(&self) -> &Structure {
        &self.shared.structure
    }

    fn tables(&self) -> &Arc<Tables> {
        &self.shared.tables
    }

    fn parameters(&self) -> &[f64] {
        let range = &self.shared.lowered.layout.parameters;
        &self.memory.data[range.start as usize..range.end as usize]
    }

    fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        let given = self.shared.lowered.layout.given.get(index).copied().flatten();
        let given = given.ok_or(ParameterError::NotSettable)?;
        if !fits(&self.shared.parameters.kinds[index], value) {
            return Err(ParameterError::BadValue);
        }
        self.memory.data[given.flag as usize] = 1.0;
        self.memory.data[given.value as usize] = value;
        Ok(())
    }

    fn bind(&mut self, t0: f64) -> Result<(), EvalFailure> {
        self.reset();
        self.set_time(t0, true);
        let routine = self.shared.lowered.bind;
        self.run(routine, Point { unknown: &[], rate: &[] }, &mut [], &mut []);
        if let Some(failure) = self.bind_failure() {
            return Err(failure);
        }
        self.start_discrete();
        self.memory.choices = self.shared.candidates.iter().map(CandidateSet::first_choice).collect();
        self.write_choices();
        Ok(())
    }

    fn nominals(&self, out: &mut [f64]) {
        out.copy_from_slice(&self.shared.nominals);
    }

    fn initial_nominals(&self, out: &mut [f64]) {
        out.copy_from_slice(&self.shared.initial_nominals);
    }

    fn initial_guess(&mut self, t0: f64, z: &mut [f64]) -> Result<(), EvalFailure> {
        self.set_time(t0, true);
        for (value, start) in z.iter_mut().zip(&self.shared.initial.guess) {
            *value = start.map_or(0.0, |index| self.memory.data[index as usize]);
        }
        self.guess_relations(z);
        Ok(())
    }

    fn has_homotopy(&self) -> bool {
        self.shared.initial.homotopy
    }

    fn set_homotopy(&mut self, share: f64) {
        self.memory.data[HOMOTOPY as usize] = share;
    }

    fn initial_residual(&mut self, t0: f64, z: &[f64], out: &mut [f64]) -> Result<(), EvalFailure> {
        self.set_time(t0, true);
        let routine = self.shared.lowered.initial.residual;
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
        let shared = self.shared.clone();
        self.run(shared.lowered.initial.assign, Point { unknown: z, rate: &[] }, &mut [], &mut []);
        let transfer = &shared.initial;
        for (value, place) in y.iter_mut().zip(&transfer.states) {
            *value = place.map_or(0.0, |place| self.read(place, z));
        }
        for (value, place) in yp.iter_mut().zip(&transfer.rates) {
            *value = place.map_or(0.0, |place| self.read(place, z));
        }
        for &(from, to) in &transfer.values {
            self.memory.data[to as usize] = self.read(from, z);
        }
        self.start_delayed(z);
        if !y.iter().chain(yp.iter()).all(|value| value.is_finite()) {
            return Err(self.initial_failure(z));
        }
        self.memory.contradiction = self.violated_condition(z);
        Ok(())
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.set_time(t, false);
        self.run(self.shared.lowered.simulation.residual, Point { unknown: y, rate: yp }, out, &mut []);
    }

    fn jacobian(&mut self, t: f64, y: &[f64], yp: &[f64], state_values: &mut [f64], rate_values: &mut [f64]) {
        self.set_time(t, false);
        self.run_jacobian(false, Point { unknown: y, rate: yp }, state_values, rate_values);
    }

    fn states(&self, out: &mut [bool]) {
        out.copy_from_slice(&self.shared.structure.differential);
        for (set, choice) in self.shared.candidates.iter().zip(&self.memory.choices) {
            set.mark(choice, out);
        }
    }

    fn choose_states(&mut self, t: f64, y: &[f64], yp: &[f64]) -> bool {
        if self.shared.candidates.is_empty() {
            return false;
        }
        self.set_time(t, false);
        let shared = self.shared.clone();
        let point = Point { unknown: y, rate: yp };
        self.run(shared.lowered.simulation.assign, point, &mut [], &mut []);
        self.run_own(shared.lowered.events.pivots, point);
        let mut first = 0;
        let mut changed = false;
        for (set, choice) in shared.candidates.iter().zip(&mut self.memory.choices) {
            changed |= set.judge(&self.memory.out[first..first + set.entries()], choice);
            first += set.entries();
        }
        if changed {
            self.write_choices();
        }
        changed
    }

    fn roots(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.set_time(t, false);
        self.run(self.shared.lowered.simulation.extra, Point { unknown: y, rate: yp }, out, &mut []);
    }

    fn held(&self, out: &mut [bool]) {
        let first = self.shared.lowered.layout.held.start;
        for (truth, &relation) in out.iter_mut().zip(&self.shared.lowered.events.rooted) {
            *truth = self.memory.data[(first + relation) as usize] != 0.0;
        }
    }

    fn next_time_event(&mut self, t: f64) -> f64 {
        self.following_instant(t)
    }

    fn event_pass(&mut self, phase: EventPhase, t: f64, y: &mut [f64], yp: &[f64]) -> Result<EventChange, EvalFailure> {
        self.pass(phase, t, y, yp)
    }

    fn outputs(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.set_time(t, false);
        self.run(self.shared.lowered.simulation.assign, Point { unknown: y, rate: yp }, &mut [], &mut []);
        let row = &self.shared.row;
        let (assigned, rest) = out.split_at_mut(row.assigned as usize);
        assigned.copy_from_slice(&self.memory.work[..row.assigned as usize]);
        let (unknowns, rest) = rest.split_at_mut(y.len());
        unknowns.copy_from_slice(y);
        let (rates, discrete) = rest.split_at_mut(row.states.len());
        for (value, &state) in rates.iter_mut().zip(&row.states) {
            *value = yp[state as usize];
        }
        let range = &self.shared.lowered.layout.discrete;
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

    fn diagnose(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<EvalFailure> {
        self.set_time(t, false);
        self.find_failure(false, Point { unknown: y, rate: yp })
    }

    fn diagnose_initial(&mut self, t0: f64, z: &[f64]) -> Option<EvalFailure> {
        self.set_time(t0, true);
        self.find_failure(true, Point { unknown: z, rate: &[] })
    }

    fn tangents(&mut self) -> Option<&mut dyn Tangents> {
        Some(self)
    }
}

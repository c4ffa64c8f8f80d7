//! An instance of a compiled model: its own memory over loaded code.
//!
//! Time and the `initial()` flag are written, then a routine runs; vectors of the solver are passed to the code as they are.  Nothing
//! is allocated between `bind` and the end of a run, except for messages.  What the solver asks for beyond routines stands in files
//! of its own, each an `impl Instance` that calls only what stands here: `start`, `events`, `timed`, `ahead`, `input`, `delay`,
//! `backward_error`, `diagnose`, `excerpt`; `system` puts them together.

use std::sync::Arc;

use hyd_system::{AssertionReport, EvalFailure, ParameterError, ValueKind};

use crate::clock::Clock;
use crate::engine::Engine;
use crate::excerpt::ExcerptCode;
use crate::follower::Follower;
use crate::loaded::Loaded;
use crate::memory::Memory;
use crate::program::{Area, INITIAL, Place, RoutineId, TIME};
use crate::routines::{JacobianForm, PlanRoutines};
use crate::search::Search;
use crate::selection::{CandidateSet, Choice};
use crate::tangent::memory::TangentMemory;
use crate::vm::Registers;

/// An instance of a compiled model.  [`Clone`] gives a further instance in the same condition for another thread.
#[derive(Clone, Debug)]
pub struct Instance {
    pub(crate) loaded: Arc<Loaded>,
    pub(crate) memory: Own,
    /// Present once directions are set.
    pub(crate) tangents: Option<Box<TangentMemory>>,
    /// The excerpts of outputs that were asked for, by their numbers, with work space of the interpreter.
    pub(crate) excerpts: Vec<(Arc<ExcerptCode>, Registers)>,
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
    pub choices: Vec<Choice>,
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
    /// Start values that were found late have changed since the last pass of the start.
    pub late_changed: bool,
    /// Assertions of `when`s that have failed at the last event, by number among the checks, until they are asked for.
    pub failed: Vec<(usize, AssertionReport)>,
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

impl Loaded {
    /// An instance with its own memory.
    pub fn instantiate(self: &Arc<Self>) -> Instance {
        Instance::new(self.clone())
    }
}

impl Instance {
    fn new(loaded: Arc<Loaded>) -> Self {
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
            late_changed: false,
            failed: Vec::new(),
            inputs: vec![Follower::default(); loaded.model.structure.inputs.len()],
        };
        let mut instance = Self { loaded, memory, tangents: None, excerpts: Vec::new() };
        for k in 0..instance.loaded.model.parameters.preset.len() {
            let (index, value) = instance.loaded.model.parameters.preset[k];
            // What the compiler has checked is settable; a value that is not changes nothing.
            let _ = instance.give(index as usize, value);
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

    /// Fills a row of outputs at a point of the simulation: assigned variables, unknowns, rates of states, discrete variables.
    pub(crate) fn output_row(&mut self, point: Point<'_>, out: &mut [f64]) {
        self.run(self.loaded.model.routines.simulation.assign, point, &mut [], &mut []);
        let row = &self.loaded.model.row;
        let (assigned, rest) = out.split_at_mut(row.assigned as usize);
        assigned.copy_from_slice(&self.memory.work[..row.assigned as usize]);
        let (unknowns, rest) = rest.split_at_mut(point.unknown.len());
        unknowns.copy_from_slice(point.unknown);
        let (rates, discrete) = rest.split_at_mut(row.states.len());
        for (value, &state) in rates.iter_mut().zip(&row.states) {
            *value = point.rate[state as usize];
        }
        let range = &self.loaded.model.area.discrete;
        discrete.copy_from_slice(&self.memory.data[range.start as usize..range.end as usize]);
    }

    /// Brings the inputs to a time (s).
    #[inline(never)]
    pub(crate) fn move_inputs(&mut self, t: f64) {
        let area = &self.loaded.model.area;
        let (first, first_rate) = (area.inputs.start as usize, area.input_rates.start as usize);
        for (k, follower) in self.memory.inputs.iter_mut().enumerate() {
            (self.memory.data[first + k], self.memory.data[first_rate + k]) = follower.move_to(t);
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

    /// See [`hyd_system::DaeSystem::set_parameter`].
    pub(crate) fn give(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        let given = self.loaded.model.area.given.get(index).copied().flatten();
        let given = given.ok_or(ParameterError::NotSettable)?;
        if !fits(&self.loaded.model.parameters.kinds[index], value) {
            return Err(ParameterError::BadValue);
        }
        self.memory.data[given.flag as usize] = 1.0;
        self.memory.data[given.value as usize] = value;
        Ok(())
    }

    /// The value at a place in the data, the unknowns of the initial system or the assigned variables.
    pub(crate) fn read(&self, place: Place, z: &[f64]) -> f64 {
        let index = place.index as usize;
        match place.area {
            Area::Data => self.memory.data[index],
            Area::Unknown => z[index],
            Area::Work => self.memory.work[index],
            _ => 0.0,
        }
    }

    /// Restores everything but the given parameters to its value before `bind`.
    pub(crate) fn reset(&mut self) {
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
    pub(crate) fn write_choices(&mut self) {
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

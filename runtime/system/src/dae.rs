//! The trait that solvers solve, and the data it speaks in.

use std::sync::Arc;

use crate::{Delays, Homotopy, Inputs, Series, StateChoices, Steps, Switches, Tables, Tangents, TornLoops};

/// A sparse pattern in compressed columns; rows within a column ascend.
#[derive(Clone, PartialEq, Eq, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Pattern {
    /// Number of rows.
    pub rows: usize,
    /// Start of each column in `row_indices`, plus the total: `columns + 1` entries.
    pub column_starts: Vec<u32>,
    /// Row of each entry.
    pub row_indices: Vec<u32>,
}

impl Pattern {
    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.column_starts.len().saturating_sub(1)
    }

    /// Number of entries.
    pub fn entries(&self) -> usize {
        self.row_indices.len()
    }

    /// A full pattern, columns first.
    pub fn dense(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            column_starts: (0..=columns).map(|c| (c * rows) as u32).collect(),
            row_indices: (0..columns).flat_map(|_| 0..rows as u32).collect(),
        }
    }

    /// The pattern of the given (row, column) pairs; duplicates are merged.
    pub fn from_pairs(rows: usize, columns: usize, pairs: &[(u32, u32)]) -> Self {
        let mut sorted: Vec<(u32, u32)> = pairs.iter().map(|&(r, c)| (c, r)).collect();
        sorted.sort_unstable();
        sorted.dedup();
        let mut column_starts = vec![0u32; columns + 1];
        for &(c, _) in &sorted {
            column_starts[c as usize + 1] += 1;
        }
        for c in 0..columns {
            column_starts[c + 1] += column_starts[c];
        }
        Self { rows, column_starts, row_indices: sorted.into_iter().map(|(_, r)| r).collect() }
    }

    /// Entries of one column as a range into `row_indices`.
    pub fn column(&self, c: usize) -> std::ops::Range<usize> {
        self.column_starts[c] as usize..self.column_starts[c + 1] as usize
    }
}

/// Sizes and patterns that do not change during a run.
#[derive(Clone, Debug, Default)]
pub struct Structure {
    /// Number `n` of unknowns and of residual rows.
    pub unknowns: usize,
    /// Per unknown: its derivative occurs (a state, or a candidate, see [`StateChoices::states`]); the others are algebraic.
    pub differential: Vec<bool>,
    /// States whose size nothing states: the solver learns it.
    pub sizes: Vec<LearnedSize>,
    /// Pattern of dF/dy, n by n.
    pub state_pattern: Pattern,
    /// Pattern of dF/dy', n by n.
    pub rate_pattern: Pattern,
    /// Number of root functions.
    pub roots: usize,
    /// Length of the row that `outputs` fills.
    pub outputs: usize,
    /// The initial system.
    pub initial: InitialStructure,
    /// Delay sites: values of the past that the equations read.  The last root functions belong to the sites with varying
    /// delay time, one each in order; the solver computes them, `roots` and `held` leave them as they are.
    pub delays: Vec<DelaySite>,
    /// Inputs that follow recorded samples.
    pub inputs: Vec<InputSite>,
}

/// A state without a nominal value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LearnedSize {
    /// The unknown.
    pub unknown: u32,
    /// States of one group have one size: the elements of an array are of one kind, and some of them may still be at rest.
    pub group: u32,
}

/// An input of the model that follows recorded samples.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct InputSite {
    /// Its full name.
    pub name: Arc<str>,
    /// The equations read its derivative, too.
    pub differentiated: bool,
}

/// Why an input cannot follow a series.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum InputError {
    /// There is no such input.
    Unknown,
    /// The equations need the derivative of the input, and a held value has none.
    NoDerivative,
}

/// A value of the past that the equations read, `source(t - delay time)`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize, serde::Deserialize)]
pub struct DelaySite {
    /// The delay time may change during the run; otherwise it is fixed by the parameters.
    pub varying: bool,
}

/// Sizes of the initial system `G(z) = 0`, square.
#[derive(Clone, Debug, Default)]
pub struct InitialStructure {
    /// Number of unknowns and rows (0: the start is explicit).
    pub unknowns: usize,
    /// Pattern of dG/dz.
    pub pattern: Pattern,
}

/// Outputs that can be evaluated without the others.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Excerpt {
    /// For [`DaeSystem::excerpt`].
    pub number: usize,
    /// Which unknowns are read for them.
    pub unknowns: Vec<u32>,
    /// Derivatives of unknowns are read, too.
    pub rates: bool,
}

/// What came of judging a choice of states, see [`StateChoices::choose_states`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct StateChoice {
    /// Other unknowns are states now.
    pub changed: bool,
    /// How far the choice is from being changed: logarithm of the factor by which another one may still become better, infinite
    /// where there is nothing to choose.
    pub room: f64,
}

impl Default for StateChoice {
    /// Nothing to choose.
    fn default() -> Self {
        Self { changed: false, room: f64::INFINITY }
    }
}

/// An evaluation that has no finite value.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct EvalFailure {
    /// Index into `Tables::equations`, if known.
    pub equation: Option<u32>,
    /// What it determines, in the user's words, if known.
    pub variable: Option<String>,
    /// What happened, in words: "division by zero", "logarithm of -1", "not a number".
    pub reason: String,
    /// What a condition at the start contradicts; none of an evaluation that has no value.
    pub contradicts: Option<Contradicted>,
    /// What it was computed from, where that is known: parameters, states, the time, discrete variables.
    pub reads: Vec<Reading>,
    /// The equations are those of another tool, so that nothing can be proposed on how they are written.
    pub is_foreign: bool,
}

/// Why a value of a function that nothing has set is not a number.
pub const UNSET: &str = "a variable of a function has no value, because no statement on the way through it has set one";

impl EvalFailure {
    /// True where a function left a variable without a value.
    pub fn is_unset(&self) -> bool {
        self.reason.contains(UNSET)
    }
}

/// What a condition at the start contradicts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Contradicted {
    /// The equations of the model, whatever the start values are.
    Model,
    /// Conditions that the reason names.
    Named,
    /// Other conditions.
    Others,
}

/// A value that was read.
#[derive(Clone, PartialEq, Debug)]
pub struct Reading {
    /// Name of the variable or parameter.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit; empty where it has none.
    pub unit: String,
}

/// What is checked beside the equations of a model.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum CheckKind {
    /// `assert`: its condition has to hold at every point that is accepted.
    Assert,
    /// `assert` in a `when`: it fails at the event at which its condition is true.
    AssertOnce,
    /// `terminate`: ends the run at the event at which its condition is true.
    Terminate,
}

/// An `assert` that does not hold.
#[derive(Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub struct AssertionReport {
    /// The user's message.
    pub message: String,
    /// True for level error (the run stops), false for level warning.
    pub error: bool,
    /// File name.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
}

/// A parameter that cannot be set.
#[derive(Clone, PartialEq, Debug)]
pub enum ParameterError {
    /// The index is not that of a settable parameter.
    NotSettable,
    /// The value is not finite or not of the parameter's type.
    BadValue,
}

/// How far an equation that closes a loop is from holding, at values that solve the system as well as the solver can.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LoopError {
    /// The residual row.
    pub row: usize,
    /// Its residual beside the size of its terms, with every variable at least as large as its nominal value.
    pub residual: f64,
    /// Bound of the rounding error that the variables computed before have brought into it, beside the size of its terms.
    pub rounding: f64,
}

impl LoopError {
    /// The smaller of the two: only both together say that rounding errors grow.
    pub fn smaller(&self) -> f64 {
        self.residual.min(self.rounding)
    }
}

/// Which pass of the event iteration is asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum EventPhase {
    /// At the start: `initial()` is true; `pre` of discrete variables are their start values.
    Initial,
    /// Once the start has settled: `initial()` is false now, and what it held back may happen; `pre(v)` is the value at
    /// the start.
    Started,
    /// First pass at an event: `pre(v)` becomes the value just before the event, for all variables.
    First,
    /// A further pass at the same instant: `pre(v)` becomes the value of the last pass.
    Iterate,
    /// The last pass once more with the solution of the continuous part that it has led to, see [`EventChange::unsettled`]: `pre(v)`
    /// and relations stay.
    Repeat,
}

/// Result of one pass of the event iteration.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct EventChange {
    /// A relation or a discrete variable changed in this pass: solve the continuous part again and iterate.
    pub changed: bool,
    /// It is nothing but recorded inputs that have jumped.
    pub by_inputs: bool,
    /// `reinit` wrote into `y`.
    pub reinitialised: bool,
    /// `terminate` was called: its message.
    pub terminated: Option<String>,
    /// Discrete equations or `reinit` read unknowns that follow from what has just changed: solve the continuous part, then ask for
    /// [`EventPhase::Repeat`].  `reinit` and `terminate` wait for it.
    pub unsettled: bool,
}

/// When the next time event is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TimeEvent {
    /// The time (s); infinity if there is none.
    pub t: f64,
    /// It happens right after this time, as `time > 1` does at 1 s: after all else that happens at that time, and not at all at
    /// the end of the run.
    pub right_after: bool,
    /// Nothing happens but that recorded inputs take up their next values.
    pub is_input: bool,
}

impl TimeEvent {
    /// There is none.
    pub const NEVER: Self = Self::at(f64::INFINITY);

    /// At a time (s).
    pub const fn at(t: f64) -> Self {
        Self { t, right_after: false, is_input: false }
    }

    /// At a time (s) at which recorded inputs take up their next values and nothing else happens.
    pub const fn of_input(t: f64) -> Self {
        Self { is_input: true, ..Self::at(t) }
    }
}

/// A hybrid system `F(t, y, y') = 0`.
///
/// Relations that can cause events keep their truth value during integration (the residual is smooth between events) and
/// change only in [`DaeSystem::event_pass`].  All methods take `&mut self` because an implementation owns its work space;
/// no method may allocate during integration.
pub trait DaeSystem: Send {
    /// Sizes and patterns.
    fn structure(&self) -> &Structure;

    /// Names and places.
    fn tables(&self) -> &Arc<Tables>;

    /// Values of all parameters, dependent ones included, as of the last `bind`.
    fn parameters(&self) -> &[f64];

    /// Sets parameter `index` (position in `parameters`) for the following runs; takes effect with `bind`.
    fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError>;

    /// Computes dependent parameters and start values, resets relations and discrete variables.  Call before each run.
    fn bind(&mut self, t0: f64) -> Result<(), EvalFailure>;

    /// Size of each unknown for error weights, n values > 0 (the `nominal` attribute, 1 if not stated).
    fn nominals(&self, out: &mut [f64]);

    /// Unknowns whose errors decide about steps.  Others only carry values that follow from these at the same instant, such as what one part
    /// of a system hands to another.
    fn tested(&self, out: &mut [bool]);

    /// Size of each initial unknown for convergence tests, values > 0 (1 where nothing is known).
    fn initial_nominals(&self, out: &mut [f64]);

    /// First guess of the initial unknowns `z` (start values).  Relations are what they are there, and discrete variables that follow from
    /// what is known have their values afterwards.
    fn initial_guess(&mut self, t0: f64, z: &mut [f64]) -> Result<(), EvalFailure>;

    /// Residual G(z) of the initial system.
    fn initial_residual(&mut self, t0: f64, z: &[f64], out: &mut [f64]) -> Result<(), EvalFailure>;

    /// Values of dG/dz on its pattern.
    fn initial_jacobian(&mut self, t0: f64, z: &[f64], values: &mut [f64]) -> Result<(), EvalFailure>;

    /// Translates a solution of the initial system into `y` and `y'` (also parameters solved for at the start).
    fn initial_store(&mut self, t0: f64, z: &[f64], y: &mut [f64], yp: &mut [f64]) -> Result<(), EvalFailure>;

    /// Residual F(t, y, y'), n values.  Values may come out non-finite; the solver checks and asks `diagnose`.
    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]);

    /// Values of dF/dy and dF/dy' on their patterns.
    fn jacobian(&mut self, t: f64, y: &[f64], yp: &[f64], state_values: &mut [f64], rate_values: &mut [f64]);

    /// Root functions: an event happens where the sign of one changes against its held relation.
    /// The held relation is true iff the value is on its positive side: value > 0 (`>`/`<`) or >= 0 after normalisation;
    /// implementations make `out[k] > 0` mean "true".
    fn roots(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]);

    /// Truth of each relation behind the roots as held now, in the order of `roots`.
    fn held(&self, out: &mut [bool]);

    /// The first time event after that at `t`, given the current discrete state; `t` is the start or the time of the last event.
    fn next_time_event(&mut self, t: f64) -> TimeEvent;

    /// How far after `t`, at most to `until`, the solver may step without passing over a change of relations that depend on time alone.
    /// Where that is before `until` a relation has just changed, or the question must be asked again from there.
    fn unchanged_until(&mut self, t: f64, until: f64) -> f64;

    /// One pass of the event iteration at fixed `t`: recomputes relations and discrete equations, runs `when` and `reinit`.
    fn event_pass(&mut self, phase: EventPhase, t: f64, y: &mut [f64], yp: &[f64]) -> Result<EventChange, EvalFailure>;

    /// All recorded variables at a point, in the order that `Tables` says.
    fn outputs(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]);

    /// Prepares to evaluate some outputs (positions in a row, in ascending order) without the others; the number holds as long as the
    /// system does.  None where that would save nothing.
    fn find_excerpt(&mut self, wanted: &[u32]) -> Option<Excerpt>;

    /// The outputs of an excerpt at a point, to their positions in a row, with the bits of [`DaeSystem::outputs`]; the others are left as they are.
    fn excerpt(&mut self, number: usize, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]);

    /// Appends the assertions that do not hold at this point.
    fn assertions(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut Vec<AssertionReport>);

    /// Finds the equation that makes an evaluation non-finite (slow, for messages).
    fn diagnose(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<EvalFailure>;

    /// The same for the initial system.
    fn diagnose_initial(&mut self, t0: f64, z: &[f64]) -> Option<EvalFailure>;

    /// Simplified forms of the initial equations; none where `homotopy` does not occur.
    fn homotopy(&mut self) -> Option<&mut dyn Homotopy>;

    /// Loops whose variables are computed one after the other; none where there are no such loops.
    fn torn_loops(&mut self) -> Option<&mut dyn TornLoops>;

    /// Relations that can be found together with the unknowns that they decide on; none without relations.
    fn switches(&mut self) -> Option<&mut dyn Switches>;

    /// Sets of candidates of which only some are states at a time; none where the states are those of
    /// [`Structure::differential`] always.
    fn state_choices(&mut self) -> Option<&mut dyn StateChoices>;

    /// Values of the past; none where [`Structure::delays`] is empty.
    fn delays(&mut self) -> Option<&mut dyn Delays>;

    /// Inputs that follow recorded samples; none where [`Structure::inputs`] is empty.
    fn inputs(&mut self) -> Option<&mut dyn Inputs>;

    /// To be told of every step; none where nothing follows from it.
    fn steps(&mut self) -> Option<&mut dyn Steps>;

    /// Derivatives of all evaluations along directions, for sensitivities; none where the system has no derivatives.
    fn tangents(&mut self) -> Option<&mut dyn Tangents>;
}

impl dyn DaeSystem + '_ {
    /// Which unknowns are states at present.
    pub fn states(&mut self, out: &mut [bool]) {
        match self.state_choices() {
            Some(choices) => choices.states(out),
            None => out.copy_from_slice(&self.structure().differential),
        }
    }

    /// See [`Inputs::set_input`].
    ///
    /// # Errors
    /// Why it cannot; a system without inputs has no such input.
    pub fn set_input(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        self.inputs().ok_or(InputError::Unknown)?.set_input(input, series)
    }
}

//! Which routine does what, and where the data of a model stand: the calling convention of a model.

use std::ops::Range;

use hyd_system::Pattern;

use crate::accumulation::{Accumulation, PartialRows};
use crate::names::Name;
use crate::program::{Place, RoutineId};

/// Routines of a model.
#[derive(Clone, PartialEq, Debug)]
pub struct Routines {
    /// Parameters and start values.
    pub bind: RoutineId,
    /// Start values of discrete variables that wait for what is found at the start; after `assign` of the initial system.
    pub late_starts: RoutineId,
    /// The simulation; its further rows are the root functions.
    pub simulation: PlanRoutines,
    /// The initial system; its further rows are the truths of all relations, then both sides of each condition that is checked.
    pub initial: PlanRoutines,
    /// Routines of events.
    pub events: EventRoutines,
}

/// The routines of a plan.
#[derive(Clone, PartialEq, Debug)]
pub struct PlanRoutines {
    /// Computes all assigned variables into the work area.
    pub assign: RoutineId,
    /// Residuals to `Out`.
    pub residual: RoutineId,
    /// Residuals that close torn loops to `Out`, one after the other, from assigned variables as they stand in the work area.
    pub closing: RoutineId,
    /// Which residuals these are.
    pub closing_rows: Vec<u32>,
    /// Nominal values of the assigned variables; empty without torn loops.
    pub assigned_nominals: Vec<f64>,
    /// Jacobian.
    pub jacobian: JacobianForm,
    /// Further rows to `Out`.
    pub extra: RoutineId,
    /// Pattern of dF/dy (or dG/dz).
    pub state_pattern: Pattern,
    /// Pattern of dF/dy'.
    pub rate_pattern: Pattern,
}

/// How Jacobian values come about.
#[derive(Clone, PartialEq, Debug)]
pub enum JacobianForm {
    /// The routine writes the entries: dF/dy to `Out`, dF/dy' to `Out2`.
    Entries(RoutineId),
    /// The routine writes partials to a scratch array that stands in `Out`; the list composes them.
    Partials(RoutineId, Accumulation, PartialRows),
}

/// Routines that run at events, after `assign` of the simulation.
#[derive(Clone, PartialEq, Debug)]
pub struct EventRoutines {
    /// Truth of every relation to `Out`.
    pub truths: RoutineId,
    /// Instants of the relations in `timed` to `Out`.
    pub instants: RoutineId,
    /// Relations that change at known instants.
    pub timed: Vec<TimedRelation>,
    /// Relations over discrete variables of the same event that do not follow from them: they keep up with those within a pass.
    pub late: Vec<u32>,
    /// Whether each relation is read by the equations of the start or the run, or by another relation, and not only by discrete equations and checks.
    pub steering: Vec<bool>,
    /// Relations behind the root functions.
    pub rooted: Vec<u32>,
    /// Relations whose root functions depend on time alone.
    pub by_time: Vec<u32>,
    /// Their root functions to `Out`; needs no `assign` before.
    pub time_roots: RoutineId,
    /// Discrete equations, each stored at once.
    pub discrete: RoutineId,
    /// New values of states to `Out`.
    pub reinits: RoutineId,
    /// Which unknown each of them is for.
    pub reinit_unknowns: Vec<u32>,
    /// Discrete equations or `reinit` read rates or unknowns that are not states, themselves or through assigned variables.
    pub reads_solution: bool,
    /// Conditions of assertions and terminations to `Out`.
    pub checks: RoutineId,
    /// Coefficients that decide the choice of states to `Out`.
    pub pivots: RoutineId,
}

/// A relation between time and what only events change, `time >= p` or `2*time < q`: it changes once, at its instant.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TimedRelation {
    /// The relation.
    pub relation: u32,
    /// It becomes true, not false.
    pub rises: bool,
    /// It changes right after its instant and is still what it was at the instant itself: `>` and `<=`, not `>=` and `<`.
    pub right_after: bool,
}

/// What can be set from outside: the places of flag and value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Given {
    /// 1 when the value was given.
    pub flag: u32,
    /// The given value.
    pub value: u32,
}

/// The data area.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct DataArea {
    /// Its length.
    pub length: u32,
    /// Values of parameters and of everything that is computed with them.
    pub parameters: Range<u32>,
    /// Flag and value per parameter, none if it cannot be set.
    pub given: Vec<Option<Given>>,
    /// What each parameter is called.
    pub parameter_names: Vec<Name>,
    /// Discrete variables.
    pub discrete: Range<u32>,
    /// Their start values.
    pub discrete_starts: Vec<Option<u32>>,
    /// Their values before the event, in the same order.
    pub pre: Range<u32>,
    /// Continuous variables whose value before the event is asked for: where they stand and where that goes.
    pub pre_continuous: Vec<(Place, u32)>,
    /// Truth of the relations.
    pub held: Range<u32>,
    /// Which candidates are states, 1 or 0.
    pub chosen: Range<u32>,
    /// Delayed values per site.
    pub delayed: Range<u32>,
    /// Delayed rates per site.
    pub delayed_rates: Range<u32>,
    /// Values of the inputs that follow recorded samples.
    pub inputs: Range<u32>,
    /// Their derivatives.
    pub input_rates: Range<u32>,
    /// Positions with a value other than zero before anything is computed (constants, default start values).
    pub preset: Vec<(u32, f64)>,
    /// Places of start values, and what they are called.
    pub starts: Vec<(u32, Name)>,
}

/// A place, negated or not.
pub type Signed = (Place, bool);

/// Where the values of one delay site stand.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SitePlaces {
    /// What is delayed, in the simulation.
    pub source: Signed,
    /// The same in the initial system.
    pub initial_source: Signed,
    /// The delay time.
    pub time: Signed,
    /// Its upper bound.
    pub most: Signed,
    /// The delay time varies.
    pub varying: bool,
}

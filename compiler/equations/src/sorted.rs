//! The sorted system: what is computed in which order, and what is left for the solver.
//!
//! After alias elimination, matching, block sorting and tearing a model is a list of explicit assignments, each reading
//! only what comes before it, and a list of residuals `F(t, y, y') = 0` in the remaining unknowns `y` (states and
//! algebraic iteration variables).  The initial system is sorted in the same way with other unknowns.  An expression is a
//! node plus the operands for its slots; expressions of one template share the node.

use hyd_flat::{Target, VarId};
use hyd_symbolic::NodeId;
use hyd_system::CheckKind;

use crate::lists::Lists;
use crate::system::{EqId, EquationSystem, OperandRange, Selection};

/// `target := value`
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Assignment {
    /// `Var(v)`, in the initial plan also `Der(v)`, among the starts `Start(v)`.
    pub target: Target,
    /// The expression; does not use the slot of the target itself.
    pub value: NodeId,
    /// Operands of its slots.
    pub operands: OperandRange,
    /// The equation it was solved from.
    pub equation: EqId,
    /// Assignments of one level do not read each other; levels start at 0 and ascend along the list.
    pub level: u32,
}

/// A row `F_k = value` that the solver drives to zero (also used for other values computed from the sorted variables).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Residual {
    /// The expression (left minus right).
    pub value: NodeId,
    /// Operands of its slots.
    pub operands: OperandRange,
    /// The equation.
    pub equation: EqId,
}

/// An unknown that the solver iterates on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Unknown {
    /// `Var(v)`; in the initial plan also `Der(v)` and `Var` of a parameter solved for at the start.
    pub target: Target,
    /// Its derivative occurs (never in the initial plan).
    pub differential: bool,
}

/// A block of the block lower triangular form, for explanation and printing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Block<'a> {
    /// Positions in `Plan::assignments`, in order.
    pub assignments: &'a [u32],
    /// Positions in `Plan::unknowns` that belong to the block (tearing variables, or the state of a rate equation).
    pub unknowns: &'a [u32],
    /// Positions in `Plan::residuals`.
    pub residuals: &'a [u32],
}

/// The blocks in the order in which they are solved; stored in a few lists, because large systems have as many blocks as equations.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Blocks {
    assignments: Lists<u32>,
    unknowns: Lists<u32>,
    residuals: Lists<u32>,
}

impl Blocks {
    /// Appends a block of these assignments, unknowns and residuals.
    pub fn push<I: IntoIterator<Item = u32>>(&mut self, [assignments, unknowns, residuals]: [I; 3]) {
        self.assignments.push_row(assignments);
        self.unknowns.push_row(unknowns);
        self.residuals.push_row(residuals);
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.assignments.len()
    }

    /// True without blocks.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A block by its number.
    pub fn get(&self, k: usize) -> Block<'_> {
        Block { assignments: self.assignments.row(k), unknowns: self.unknowns.row(k), residuals: self.residuals.row(k) }
    }

    /// All blocks in order.
    pub fn iter(&self) -> impl Iterator<Item = Block<'_>> {
        (0..self.len()).map(|k| self.get(k))
    }

    /// Gives assignments new positions: that at `k` goes to `position[k]`.
    pub(crate) fn move_assignments(&mut self, position: &[u32]) {
        for entry in &mut self.assignments.items {
            *entry = position[*entry as usize];
        }
    }
}

/// What to compute for one purpose (simulation or initialisation).
///
/// In the simulation plan `y` = `unknowns`; a state's derivative `Der(v)` is read from `y'` directly.  In the initial plan
/// `z` = `unknowns`, and states and derivatives that are not unknowns are assigned.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Plan {
    /// Unknowns of the solver.
    pub unknowns: Vec<Unknown>,
    /// Explicit assignments in order (by level).
    pub assignments: Vec<Assignment>,
    /// As many residuals as unknowns.
    pub residuals: Vec<Residual>,
    /// The blocks in order.
    pub blocks: Blocks,
}

/// How the change of a relation is found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Trigger {
    /// By the sign of its root function.
    State,
    /// At a known instant.
    Time {
        /// The instant, an expression over the relation's operands, which read only parameters and discrete variables.
        instant: NodeId,
        /// The relation becomes true, not false.
        rises: bool,
        /// It changes right after its instant (`>`, `<=`), not at it (`>=`, `<`).
        right_after: bool,
    },
}

/// A relation that can cause events.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct EventRelation {
    /// Truth, computed literally (a `Compare` node).
    pub truth: NodeId,
    /// Root function; positive where the relation is true.
    pub root: NodeId,
    /// Operands of both.
    pub operands: OperandRange,
    /// How its change is found.
    pub trigger: Trigger,
    /// Equation it stands in.
    pub equation: EqId,
}

/// Assertion or termination.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Check {
    /// Condition: an assertion wants it true, one in a `when` fails at the event at which it is true, a termination ends the run there.
    pub condition: Residual,
    /// Index into the flat model's messages.
    pub message: u32,
    /// What it is.
    pub kind: CheckKind,
}

/// An initial condition that follows from others: an equation whose sides must agree.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Redundant {
    /// Left side.
    pub left: Residual,
    /// Right side.
    pub right: Residual,
    /// The variable whose fixed start value this is, if it is not an equation of the text.
    pub start_of: Option<VarId>,
    /// The conditions that it follows from, in words; empty where it follows from the equations of the model alone, and none where that is not known.
    pub others: Option<Vec<String>>,
}

/// Everything that code is made from.
#[derive(Clone, Debug)]
pub struct SortedSystem {
    /// Variables, roles, operands, equations.
    pub system: EquationSystem,
    /// Parameters, constants and variables that depend on nothing else, in order.
    pub bindings: Vec<Assignment>,
    /// Start attributes (`Target::Start`), computed after the bindings.
    pub starts: Vec<Assignment>,
    /// Start values of discrete variables that read what is found at the start, computed again with each solution of the initial system;
    /// `starts` holds what their guesses give.
    pub late_starts: Vec<Assignment>,
    /// The system to integrate.
    pub simulation: Plan,
    /// The system that gives consistent initial values.
    pub initial: Plan,
    /// Discrete variables in the order of their dependence; evaluated at events, after the relations.
    pub discrete: Vec<Assignment>,
    /// `reinit`: target `Var(state)`, value the new value (the state itself when not fired).
    pub reinits: Vec<Assignment>,
    /// Assertions and terminations.
    pub checks: Vec<Check>,
    /// Relations behind `Target::Held`.
    pub relations: Vec<EventRelation>,
    /// Sets of candidates of which some are states, chosen during the run.
    pub selections: Vec<Selection>,
    /// The entries of their Jacobians, set after set.
    pub pivots: Vec<Residual>,
    /// Initial conditions that follow from the initial system: they must hold.
    pub redundant: Vec<Redundant>,
}

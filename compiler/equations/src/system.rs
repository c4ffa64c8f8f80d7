//! The equation system: the flat model after alias elimination, with a role for every variable.

use hyd_flat::{ConstId, FlatModel, Operand, Section, VarId};
use hyd_index::{IndexVec, typed_index};
use hyd_symbolic::TemplateId;

typed_index!(
    /// A scalar equation of the [`EquationSystem`] (the number after alias elimination).
    EqId,
    "eq"
);

/// Where the operands of an expression stand in [`EquationSystem::operands`]: slot `k` reads entry `first + k`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OperandRange {
    /// Operand of slot 0.
    pub first: u32,
    /// Number of slots.
    pub len: u32,
}

/// What a variable is for the solver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// Its derivative occurs.
    State,
    /// A state for parts of the run: one of a set of which some are states, which ones is data (see [`Selection`]).
    Candidate,
    /// A continuous variable without derivative.
    Algebraic,
    /// Changes at events only.
    Discrete,
    /// Known before the run, or found by the initial system when not fixed.
    Parameter,
    /// Never changes.
    Constant,
}

impl Role {
    /// True for what varies continuously: states, candidates and algebraic variables.
    pub fn is_continuous(self) -> bool {
        matches!(self, Role::State | Role::Candidate | Role::Algebraic)
    }

    /// True for states and for those that may be.
    pub fn may_be_state(self) -> bool {
        matches!(self, Role::State | Role::Candidate)
    }
}

/// What alias elimination made of a variable.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Resolution {
    /// It stands for itself.
    Own,
    /// It equals another variable or its negative; that one stands for itself.
    Alias {
        /// The variable that is kept.
        of: VarId,
        /// Equal to its negative.
        negated: bool,
    },
    /// It has a fixed value (`p.v = 0`).
    Value(ConstId),
}

/// A scalar equation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Equation {
    /// Its template.
    pub template: TemplateId,
    /// Operands of its slots.
    pub operands: OperandRange,
    /// Index into `FlatModel::equations` (origin and section).
    pub block: u32,
    /// Number within that block.
    pub element: u32,
    /// How often it was differentiated by index reduction (0: as it was written).
    pub order: u32,
}

/// What index reduction did, for printing and for the start.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Reduction {
    /// Variables whose derivative occurs but that are not states, because equations determine them.
    pub demoted: Vec<VarId>,
    /// The dummy derivatives: algebraic variables made for the derivatives of those.
    pub dummies: Vec<VarId>,
    /// Sets of candidates whose states are chosen during the run.
    pub selections: Vec<Selection>,
    /// Parameters that are taken as 0 for good, because equations determine other unknowns without them.
    pub fixed_at_zero: Vec<VarId>,
    /// Sums of equations that stand in the place of some.
    pub combined: Vec<Combination>,
}

/// Equations of the flat model that add up to one in which unknowns cancel.
#[derive(Clone, PartialEq, Debug)]
pub struct Combination {
    /// The equations with what they are multiplied by; the sum replaces the first.
    pub(crate) terms: Vec<Term>,
}

/// An equation of a sum.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Term {
    /// Block of the flat model, and number within it.
    pub place: (u32, u32),
    /// What it is multiplied by, never 0.
    pub factor: f64,
}

impl Combination {
    /// Of equations that index reduction differentiated equally often; none if it did not.
    pub(crate) fn new(system: &EquationSystem, weighted: &[(EqId, f64)]) -> Option<Self> {
        let order = system.equations[weighted.first()?.0].order;
        let is_plain = |eq: EqId| system.equations[eq].order == order && system.section(eq) == Section::Continuous;
        if !weighted.iter().all(|&(eq, factor)| is_plain(eq) && factor.is_finite() && factor != 0.0) {
            return None;
        }
        let place = |eq: EqId| (system.equations[eq].block, system.equations[eq].element);
        let mut terms: Vec<Term> = weighted.iter().map(|&(eq, factor)| Term { place: place(eq), factor }).collect();
        // The one that weighs most is replaced.
        terms.sort_by(|a, b| b.factor.abs().total_cmp(&a.factor.abs()).then(a.place.cmp(&b.place)));
        let largest = terms[0].factor;
        terms.iter_mut().for_each(|term| term.factor /= largest);
        Some(Self { terms })
    }
}

/// Variables of which some are states and the others follow from constraints; which ones is decided during the run.
///
/// The constraints have the Jacobian given by `entries`.  Eliminating `pivots` in order leaves the rows `open` and the
/// columns of `candidates`; as many candidates as open rows are dependent at any time, those for which the remaining square
/// matrix is best conditioned.  The others are states: equation `r` of the set, in section
/// [`Section::Selection`](hyd_flat::Section::Selection), is `sum_k Chosen(first + r*n + k) * (der(x_k) - rate_k) = 0`, `n` the
/// number of candidates, with exactly one choice of 1 in each equation.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Selection {
    /// Rows and columns of the Jacobian.
    pub size: (u32, u32),
    /// Row and column of each entry; the values are the next equations of section
    /// [`Section::Pivot`](hyd_flat::Section::Pivot), in order.
    pub entries: Vec<(u32, u32)>,
    /// Pivots that hold for the whole run.
    pub pivots: Vec<(u32, u32)>,
    /// Rows left after these.
    pub open: Vec<u32>,
    /// Columns left, with the variable (at translation; it may be an alias by now) and its weight: how unwilling it is to be a
    /// state.
    pub candidates: Vec<Candidate>,
    /// Number of the first choice.
    pub first: u32,
}

/// A variable that may be a state.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Candidate {
    /// Its column in the Jacobian.
    pub column: u32,
    /// The variable.
    pub variable: VarId,
    /// Factor of its column when pivots are compared, greater than 0: `stateSelect` and `nominal`.
    pub weight: f64,
}

impl Selection {
    /// Number of states at any time, and of equations.
    pub fn states(&self) -> usize {
        self.candidates.len() - self.open.len()
    }

    /// Number of choices.
    pub fn choices(&self) -> usize {
        self.states() * self.candidates.len()
    }
}

/// The flat model after alias elimination.
#[derive(Clone, Debug, Default)]
pub struct EquationSystem {
    /// Variables, constants, templates, messages (its equations keep the original operands for printing).
    pub flat: FlatModel,
    /// Role of each scalar variable (of eliminated ones: the role of what they equal).
    pub roles: IndexVec<VarId, Role>,
    /// What became of each scalar variable.
    pub resolution: IndexVec<VarId, Resolution>,
    /// Operands of all expressions, aliases replaced.
    pub operands: Vec<Operand>,
    /// Equations of all sections but the alias equations that were used up.
    pub equations: IndexVec<EqId, Equation>,
    /// What index reduction did.
    pub reduction: Reduction,
    /// Variables that are fixed because one that they equal is.
    pub fixed_by_others: Vec<VarId>,
}

impl EquationSystem {
    /// The operands of an expression.
    pub fn operands_of(&self, range: OperandRange) -> &[Operand] {
        &self.operands[range.first as usize..(range.first + range.len) as usize]
    }

    /// Variables whose derivative occurs and that are not states at any time.
    pub fn never_states(&self) -> Vec<VarId> {
        self.without_candidates(&self.reduction.demoted)
    }

    /// Dummy derivatives that are not states at any time.
    pub fn dummies(&self) -> Vec<VarId> {
        self.without_candidates(&self.reduction.dummies)
    }

    /// Roles of eliminated variables are those of what they equal.
    fn without_candidates(&self, variables: &[VarId]) -> Vec<VarId> {
        variables.iter().copied().filter(|&v| self.roles[v] != Role::Candidate).collect()
    }
}

//! The equation system: the flat model after alias elimination, with a role for every variable.

use hyd_flat::{ConstId, FlatModel, Operand, VarId};
use hyd_index::IndexVec;
use hyd_symbolic::TemplateId;

use crate::sorted::{EqId, OperandRange};

/// What a variable is for the solver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// Its derivative occurs.
    State,
    /// A continuous variable without derivative.
    Algebraic,
    /// Changes at events only.
    Discrete,
    /// Known before the run, or found by the initial system when not fixed.
    Parameter,
    /// Never changes.
    Constant,
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
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Reduction {
    /// Variables whose derivative occurs but that are no states, because equations determine them.
    pub demoted: Vec<VarId>,
    /// The dummy derivatives: algebraic variables made for the derivatives of those.
    pub dummies: Vec<VarId>,
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
}

impl EquationSystem {
    /// The operands of an expression.
    pub fn operands_of(&self, range: OperandRange) -> &[Operand] {
        &self.operands[range.first as usize..(range.first + range.len) as usize]
    }
}

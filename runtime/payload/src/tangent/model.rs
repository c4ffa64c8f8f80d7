//! Tangents of a model as plain data: routines of partial derivatives, and the rows that chain them.

use std::sync::Arc;

use super::rows::{Rows, Spaces};
use crate::mapping::Code;
use crate::program::{Program, RoutineId};

/// What the tangents of one routine need.
#[derive(Clone, PartialEq, Debug)]
pub struct Stage {
    /// Computes the coefficients that are not numbers.
    pub partials: RoutineId,
    /// Coefficients before it has run.
    pub coefficients: Vec<f64>,
    /// The chain rule.
    pub rows: Rows,
}

/// The stages by name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(usize)]
pub enum Part {
    /// Parameters and start values.
    Bind,
    /// Assigned variables of the initial system.
    InitialAssign,
    /// Residuals of the initial system.
    InitialResidual,
    /// Assigned variables of the simulation.
    Assign,
    /// Residuals of the simulation.
    Residual,
    /// Root functions.
    Roots,
    /// Instants of time events.
    Instants,
    /// Discrete equations.
    Discrete,
    /// New values of states.
    Reinits,
}

/// Number of stages.
pub const PARTS: usize = 9;

/// Tangents of all routines of a model.
#[derive(Clone, Debug)]
pub struct TangentModel {
    /// Machine code of the partial derivatives, none where they are only interpreted.
    pub code: Option<Arc<Code>>,
    /// The routines of the partial derivatives.
    pub program: Arc<Program>,
    /// Where the blocks of each area begin.
    pub spaces: Spaces,
    /// What each routine needs, by [`Part`].
    pub stages: [Stage; PARTS],
    /// For each output the position of its start value in the data area, where that can be varied.
    pub starts: Vec<Option<u32>>,
    /// Derivatives of the residuals by everything that directions can reach, if there are any and they are wanted.
    pub sweep: Option<SweepModel>,
}

impl TangentModel {
    /// The stage of this name.
    pub fn stage(&self, part: Part) -> &Stage {
        &self.stages[part as usize]
    }
}

/// One routine for both Jacobians and the derivatives of the residuals by data, and what it stores behind dF/dy.
#[derive(Clone, Debug)]
pub struct SweepModel {
    /// Machine code, none where it is only interpreted.
    pub code: Option<Arc<Code>>,
    /// The routines.
    pub program: Arc<Program>,
    /// dF/dy and the further entries to `Out`, dF/dy' to `Out2`.
    pub routine: RoutineId,
    /// Number of entries of dF/dy.
    pub state_entries: u32,
    /// The arguments of branches without an event, to `Out`.
    pub arguments: RoutineId,
    /// These branches.
    pub branches: Vec<Branch>,
    /// Residual row and position in the data area of each further entry; those of delayed values come last.
    pub entries: Vec<(u32, u32)>,
    /// Number of those that come first.
    pub still: u32,
}

/// Where a branch without an event stands.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Branch {
    /// In the Jacobians.
    pub always: bool,
    /// In these further entries.
    pub entries: Vec<u32>,
}

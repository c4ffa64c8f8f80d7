//! The rows and columns of a plan: its assignments and residuals by one number, its unknowns and their rates by another.

use hyd_equations::{Plan, SortedSystem};
use hyd_flat::Operand;
use hyd_symbolic::NodeId;

use crate::layout::{PlanPlaces, resolve};
use crate::program::Area;

/// A plan seen as rows: assignments in order, then residuals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'a> {
    /// The plan.
    pub plan: &'a Plan,
}

/// What a slot means for derivatives.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Column {
    /// Unknown `k` is column `k`, the rate of unknown `k` is column `n + k`.
    Direct(u32),
    /// The value of an assignment.
    Assigned(u32),
    /// Constant as far as the Jacobian is concerned.
    None,
}

impl Rows<'_> {
    /// Number of rows.
    pub(crate) fn count(&self) -> usize {
        self.plan.assignments.len() + self.plan.residuals.len()
    }

    /// Expression and operands of a row.
    pub(crate) fn expression<'s>(&self, sorted: &'s SortedSystem, row: usize) -> (NodeId, &'s [Operand]) {
        let (value, operands) = match self.plan.assignments.get(row) {
            Some(assignment) => (assignment.value, assignment.operands),
            None => {
                let residual = &self.plan.residuals[row - self.plan.assignments.len()];
                (residual.value, residual.operands)
            }
        };
        (value, sorted.system.operands_of(operands))
    }

    /// What an operand means for derivatives, and its sign.
    pub(crate) fn column(&self, sorted: &SortedSystem, places: &PlanPlaces, operand: Operand) -> (Column, bool) {
        let (target, negated) = resolve(sorted, operand);
        let column = match places.get(target) {
            Some(place) => match place.area {
                Area::Unknown => Column::Direct(place.index),
                Area::Rate => Column::Direct(self.plan.unknowns.len() as u32 + place.index),
                Area::Work => Column::Assigned(place.index),
                _ => Column::None,
            },
            None => Column::None,
        };
        (column, negated)
    }
}

//! The plan for solving a torn block: plain data with a stable text form, made by [`crate::tearing`].

use crate::graph::{Column, Row};
use std::fmt;

/// How to evaluate a block: given the tearing columns, the assignments in order determine all other columns, and the
/// residual rows remain to be made zero.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TearingPlan {
    /// Explicit solutions (row solved for column) in order of evaluation.
    pub assignments: Vec<(Row, Column)>,
    /// Iteration variables, ascending.
    pub tearing: Vec<Column>,
    /// Equations left for the iteration, ascending; as many as tearing columns if the block is square.
    pub residuals: Vec<Row>,
}

/// Three lines `tearing: v0`, `assign: eq1=v1 ...`, `residuals: eq0`.
impl fmt::Display for TearingPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tearing:")?;
        for column in &self.tearing {
            write!(f, " {column}")?;
        }
        write!(f, "\nassign:")?;
        for (row, column) in &self.assignments {
            write!(f, " {row}={column}")?;
        }
        write!(f, "\nresiduals:")?;
        for row in &self.residuals {
            write!(f, " {row}")?;
        }
        writeln!(f)
    }
}

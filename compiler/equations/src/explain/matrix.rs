//! The equations of the simulation as a matrix: which unknowns stand in which equation, in the order of solution.
//!
//! Row `k` determines column `k`: assignments and unknowns of the blocks, one block after the other.  Only direct occurrences
//! count, not what assignments pass on; for pictures and pages, where a user looks for the shape of a system.

use hyd_flat::Target;
use rustc_hash::FxHashMap;

use crate::sorted::SortedSystem;
use crate::system::{EqId, OperandRange};

/// A square matrix of occurrences.
#[derive(Clone, Debug, Default)]
pub struct Matrix {
    /// Equation of each row, in the order of solution.
    pub equations: Vec<EqId>,
    /// What each column stands for; column `k` is determined with row `k`.
    pub unknowns: Vec<Target>,
    /// Solved explicitly, or left to the solver (false).
    pub explicit: Vec<bool>,
    /// Columns that occur in each row, ascending.
    pub entries: Vec<Vec<u32>>,
    /// Number of rows of each block.
    pub blocks: Vec<u32>,
}

/// The matrix of the system to integrate.
pub fn matrix(sorted: &SortedSystem) -> Matrix {
    let plan = &sorted.simulation;
    let mut matrix = Matrix::default();
    let mut operands: Vec<OperandRange> = Vec::new();
    for block in plan.blocks.iter() {
        for &a in block.assignments {
            let a = &plan.assignments[a as usize];
            matrix.equations.push(a.equation);
            matrix.unknowns.push(a.target);
            matrix.explicit.push(true);
            operands.push(a.operands);
        }
        for (&r, &u) in block.residuals.iter().zip(block.unknowns) {
            let (residual, unknown) = (&plan.residuals[r as usize], &plan.unknowns[u as usize]);
            matrix.equations.push(residual.equation);
            matrix.unknowns.push(match (unknown.differential, unknown.target) {
                (true, Target::Var(v)) => Target::Der(v),
                (_, target) => target,
            });
            matrix.explicit.push(false);
            operands.push(residual.operands);
        }
        matrix.blocks.push((block.assignments.len() + block.residuals.len()) as u32);
    }
    let column: FxHashMap<Target, u32> = matrix.unknowns.iter().enumerate().map(|(k, &t)| (t, k as u32)).collect();
    for &range in &operands {
        let read = sorted.system.operands_of(range).iter().filter_map(|operand| column.get(&operand.target()).copied());
        let mut row: Vec<u32> = read.collect();
        row.sort_unstable();
        row.dedup();
        matrix.entries.push(row);
    }
    matrix
}

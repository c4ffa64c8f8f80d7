//! The parts of the Jacobian, dF/dy and dF/dy', a matrix that is made of them, and its factors.
//!
//! All matrices that the solver factors for the equations of a run are column-wise combinations of the two: the iteration matrix of a step,
//! `dF/dy + c dF/dy'`, and the matrix of the consistency solve, which has the columns of dF/dy' of differential unknowns and those of
//! dF/dy of the others.  Who evaluates the parts writes them ([`IterationMatrix::parts`]); they stay readable behind the factors.

use hyd_system::{Pattern, Structure};

use super::merge::MergedPattern;
use super::{FactorError, LinearSolver};
use crate::tiled::{Tile, Tiled};

/// Both parts, their combination and its factors.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct IterationMatrix {
    merged: MergedPattern,
    state_pattern: Pattern,
    rate_pattern: Pattern,
    state: Vec<f64>,
    rate: Vec<f64>,
    values: Vec<f64>,
    solver: LinearSolver,
}

impl IterationMatrix {
    /// A matrix for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let (state_pattern, rate_pattern) = (structure.state_pattern.clone(), structure.rate_pattern.clone());
        let merged = MergedPattern::new(&state_pattern, &rate_pattern);
        Self {
            solver: LinearSolver::new(&merged.pattern),
            state: vec![0.0; state_pattern.entries()],
            rate: vec![0.0; rate_pattern.entries()],
            values: vec![0.0; merged.pattern.entries()],
            merged,
            state_pattern,
            rate_pattern,
        }
    }

    /// Starts over with unknowns of these sizes, see [`LinearSolver::begin`].
    pub(crate) fn begin(&mut self, nominals: &[f64]) {
        self.solver.begin(nominals);
    }

    /// The entries of dF/dy and of dF/dy', to be written.
    pub(crate) fn parts(&mut self) -> (&mut [f64], &mut [f64]) {
        (&mut self.state, &mut self.rate)
    }

    /// The entries of dF/dy, then those of dF/dy'.
    pub(crate) fn entries(&self) -> impl Iterator<Item = &f64> {
        self.state.iter().chain(&self.rate)
    }

    /// Rows and entries of a column of dF/dy.
    pub(crate) fn state_column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> {
        column_of(&self.state_pattern, &self.state, column)
    }

    /// Rows and entries of a column of dF/dy'.
    #[inline(always)]
    pub(crate) fn rate_column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> {
        column_of(&self.rate_pattern, &self.rate, column)
    }

    /// Rows and entries of a column of the matrix of the consistency solve.
    pub(crate) fn consistent_column(&self, column: usize, differential: bool) -> impl Iterator<Item = (usize, f64)> {
        let (pattern, values) = match differential {
            true => (&self.rate_pattern, &self.rate),
            false => (&self.state_pattern, &self.state),
        };
        column_of(pattern, values, column)
    }

    /// Factors `dF/dy + c dF/dy'`.
    pub(crate) fn factor(&mut self, c: f64) -> Result<(), FactorError> {
        self.merged.combine(&self.state, &self.rate, c, &mut self.values);
        self.solver.factor(&mut self.values)
    }

    /// Factors the matrix of the consistency solve.
    pub(crate) fn factor_consistent(&mut self, differential: &[bool]) -> Result<(), FactorError> {
        let parts = (&self.state_pattern, &self.rate_pattern);
        self.merged.select(parts, &self.state, &self.rate, differential, &mut self.values);
        self.solver.factor(&mut self.values)
    }

    /// As [`Self::factor`] for a matrix that it has found singular, see [`LinearSolver::factor_deficient`].
    pub(crate) fn factor_deficient(&mut self, c: f64, sizes: &[f64], ranks: &[u8]) -> bool {
        self.merged.combine(&self.state, &self.rate, c, &mut self.values);
        self.solver.factor_deficient(&self.values, sizes, ranks)
    }

    /// As [`Self::factor_consistent`] for a matrix that it has found singular, see [`LinearSolver::factor_deficient`].
    pub(crate) fn factor_consistent_deficient(&mut self, differential: &[bool], sizes: &[f64], ranks: &[u8]) -> bool {
        let parts = (&self.state_pattern, &self.rate_pattern);
        self.merged.select(parts, &self.state, &self.rate, differential, &mut self.values);
        self.solver.factor_deficient(&self.values, sizes, ranks)
    }

    /// See [`LinearSolver::is_deficient`].
    #[inline(always)]
    pub(crate) fn is_deficient(&self) -> bool {
        self.solver.is_deficient()
    }

    /// See [`LinearSolver::contradicts`].
    pub(crate) fn contradicts(&self, x: &[f64], part: f64) -> bool {
        self.solver.contradicts(x, part)
    }

    /// See [`LinearSolver::undetermined`].
    pub(crate) fn undetermined(&self) -> impl Iterator<Item = usize> + '_ {
        self.solver.undetermined()
    }

    /// Replaces `b` by the solution, see [`LinearSolver::solve`].
    pub(crate) fn solve(&mut self, b: &mut [f64]) {
        self.solver.solve(b);
    }

    /// The solution for the corrections of an iteration, see [`LinearSolver::correct`].
    #[inline(always)]
    pub(crate) fn correct(&mut self, b: &Tiled, x: &mut Tiled) {
        self.solver.correct(b, x);
    }

    /// Replaces several right-hand sides by their solutions, see [`LinearSolver::solve_tiles`].
    pub(crate) fn solve_tiles(&mut self, b: &mut Vec<Tile>, count: usize) {
        self.solver.solve_tiles(b, count);
    }

    /// The scale of row `k` in the last factorisation.
    pub(crate) fn row_scale(&self, k: usize) -> f64 {
        self.solver.row_scale(k)
    }
}

#[inline(always)]
fn column_of<'a>(pattern: &'a Pattern, values: &'a [f64], column: usize) -> impl Iterator<Item = (usize, f64)> + 'a {
    pattern.column(column).map(|entry| (pattern.row_indices[entry] as usize, values[entry]))
}

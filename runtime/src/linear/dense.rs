//! Dense LU with partial pivoting, in place, for small systems that fill up.
//!
//! `P A = L U` column by column (Golub, Van Loan, "Matrix Computations", algorithm 3.4.1) on one preallocated nalgebra matrix:
//! the library's elimination step and triangular solves are used, its `LU` type is not, because it allocates
//! its permutation anew for each factorisation.

use hyd_system::Pattern;
use nalgebra::linalg::{gauss_step, gauss_step_swap};
use nalgebra::{DMatrix, DVectorViewMut};

use super::factor::{FactorError, PIVOT_FLOOR, subtract};
use crate::tiled::Tile;

/// The factors of one matrix.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct Dense {
    factors: DMatrix<f64>,
    /// Row swapped with row `k` in step `k`.
    swaps: Vec<u32>,
    /// Original row now at each place (for messages).
    rows: Vec<u32>,
    /// Largest entry of each column before elimination.
    column_max: Vec<f64>,
}

impl Dense {
    /// Room for an n by n matrix.
    pub(super) fn new(n: usize) -> Self {
        Self { factors: DMatrix::zeros(n, n), swaps: vec![0; n], rows: vec![0; n], column_max: vec![0.0; n] }
    }

    /// Factors the matrix with scaled `values` on `pattern`.
    pub(super) fn factor(&mut self, pattern: &Pattern, values: &[f64]) -> Result<(), FactorError> {
        let n = pattern.rows;
        self.factors.fill(0.0);
        let storage = self.factors.as_mut_slice();
        for column in 0..n {
            let mut largest = 0.0f64;
            for entry in pattern.column(column) {
                storage[column * n + pattern.row_indices[entry] as usize] = values[entry];
                largest = largest.max(values[entry].abs());
            }
            self.column_max[column] = largest;
            self.rows[column] = column as u32;
        }
        for k in 0..n {
            let pivot_row = self.pivot_row(k, n);
            let pivot = self.factors[(pivot_row, k)];
            if pivot.abs() <= PIVOT_FLOOR * self.column_max[k] {
                return Err(FactorError::Singular { row: self.rows[pivot_row] as usize, column: k });
            }
            self.swaps[k] = pivot_row as u32;
            if pivot_row == k {
                gauss_step(&mut self.factors, pivot, k);
            } else {
                self.rows.swap(k, pivot_row);
                self.factors.columns_range_mut(..k).swap_rows(k, pivot_row);
                gauss_step_swap(&mut self.factors, pivot, k, pivot_row);
            }
        }
        Ok(())
    }

    fn pivot_row(&self, k: usize, n: usize) -> usize {
        let column = &self.factors.as_slice()[k * n..(k + 1) * n];
        let mut best = k;
        for row in k + 1..n {
            if column[row].abs() > column[best].abs() {
                best = row;
            }
        }
        best
    }

    /// Replaces `b` by the solution.
    pub(super) fn solve(&self, b: &mut [f64]) {
        for (k, &other) in self.swaps.iter().enumerate() {
            b.swap(k, other as usize);
        }
        let n = b.len();
        if n == 0 {
            return;
        }
        let mut x = DVectorViewMut::from_slice(b, n);
        self.factors.solve_lower_triangular_with_diag_mut(&mut x, 1.0);
        self.factors.solve_upper_triangular_mut(&mut x);
    }

    /// Replaces each of several right-hand sides by its solution: `count` tiles per unknown.
    pub(super) fn solve_tiles(&self, b: &mut [Tile], count: usize) {
        for (k, &other) in self.swaps.iter().enumerate() {
            for tile in 0..count {
                b.swap(k * count + tile, other as usize * count + tile);
            }
        }
        let n = self.swaps.len();
        let factors = self.factors.as_slice();
        for k in 0..n {
            let (done, rest) = b.split_at_mut((k + 1) * count);
            let column = &factors[k * n + k + 1..(k + 1) * n];
            for (values, &factor) in rest.chunks_exact_mut(count).zip(column) {
                subtract(values, factor, &done[k * count..]);
            }
        }
        for k in (0..n).rev() {
            let inverse = factors[k * n + k].recip();
            let (rest, solved) = b.split_at_mut(k * count);
            let solved = &mut solved[..count];
            solved.iter_mut().flatten().for_each(|value| *value *= inverse);
            for (values, &factor) in rest.chunks_exact_mut(count).zip(&factors[k * n..k * n + k]) {
                subtract(values, factor, solved);
            }
        }
    }
}

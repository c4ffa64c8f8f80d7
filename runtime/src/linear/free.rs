//! Matrices of less than full rank: which unknowns they leave free, and solutions that leave those where they are.
//!
//! Gaussian elimination with complete pivoting (Golub, Van Loan, "Matrix Computations", section 3.4.8) ends where all that is left is
//! rounding: at as many rows without a pivot as columns.  Each of these columns is then given one of the rows with the pivot 1, which makes
//! of `A` a regular `A + sum e_r e_c^T`.  Where the rows left over agree with the others, its solution is a solution of `A x = b`, that with
//! `x_c = 0`; where they do not, `x_c` is what they are off by, so that an iteration with such a matrix converges to nothing that
//! does not fulfil all equations.

use hyd_system::Pattern;

use super::factor::subtract;
use crate::tiled::Tile;

/// A pivot below this of a matrix scaled to 1 is rounding.
const RANK_FLOOR: f64 = 1e-12;
/// Most unknowns of such a matrix: it is full, and eliminated anew each time.
pub(super) const MOST: usize = 600;

/// The factors of one matrix.
#[derive(Clone, Default)]
pub(super) struct Free {
    n: usize,
    /// The factors, column by column, rows and columns in their new order.
    factors: Vec<f64>,
    /// Row and column of the matrix at each place.
    rows: Vec<usize>,
    columns: Vec<usize>,
    rank: usize,
    work: Vec<f64>,
    tiles: Vec<Tile>,
}

impl Free {
    /// Factors the matrix with scaled `values` on `pattern`.
    pub(super) fn factor(&mut self, pattern: &Pattern, values: &[f64]) {
        let n = pattern.rows;
        self.n = n;
        self.factors.clear();
        self.factors.resize(n * n, 0.0);
        for column in 0..n {
            for entry in pattern.column(column) {
                self.factors[column * n + pattern.row_indices[entry] as usize] = values[entry];
            }
        }
        self.rows = (0..n).collect();
        self.columns = (0..n).collect();
        self.rank = 0;
        while self.rank < n {
            let k = self.rank;
            let (mut largest, mut place) = (0.0, (k, k));
            for column in k..n {
                for row in k..n {
                    let size = self.factors[column * n + row].abs();
                    if size > largest {
                        (largest, place) = (size, (row, column));
                    }
                }
            }
            if largest <= RANK_FLOOR {
                break;
            }
            self.bring(place, k);
            self.eliminate(k);
            self.rank += 1;
        }
        for k in self.rank..n {
            for row in self.rank..n {
                self.factors[k * n + row] = f64::from(u8::from(row == k));
            }
        }
    }

    /// Brings an entry to place `k` of the diagonal.
    fn bring(&mut self, (row, column): (usize, usize), k: usize) {
        let n = self.n;
        self.rows.swap(row, k);
        self.columns.swap(column, k);
        (0..n).for_each(|c| self.factors.swap(c * n + row, c * n + k));
        (0..n).for_each(|r| self.factors.swap(column * n + r, k * n + r));
    }

    fn eliminate(&mut self, k: usize) {
        let n = self.n;
        let pivot = self.factors[k * n + k];
        let (done, rest) = self.factors.split_at_mut((k + 1) * n);
        let own = &mut done[k * n..];
        own[k + 1..].iter_mut().for_each(|factor| *factor /= pivot);
        for column in rest.chunks_exact_mut(n) {
            let above = column[k];
            if above != 0.0 {
                column[k + 1..].iter_mut().zip(&own[k + 1..]).for_each(|(entry, factor)| *entry -= factor * above);
            }
        }
    }

    /// The unknowns that the last matrix leaves free.
    pub(super) fn columns(&self) -> &[usize] {
        &self.columns[self.rank..]
    }

    /// Replaces `b` by the solution.
    pub(super) fn solve(&mut self, b: &mut [f64]) {
        let n = self.n;
        let x = &mut self.work;
        x.clear();
        x.extend(self.rows.iter().map(|&row| b[row]));
        for k in 0..self.rank {
            let own = x[k];
            x[k + 1..].iter_mut().zip(&self.factors[k * n + k + 1..]).for_each(|(x, factor)| *x -= factor * own);
        }
        for k in (0..n).rev() {
            x[k] /= self.factors[k * n + k];
            let own = x[k];
            x[..k].iter_mut().zip(&self.factors[k * n..]).for_each(|(x, factor)| *x -= factor * own);
        }
        self.columns.iter().zip(&*x).for_each(|(&column, &value)| b[column] = value);
    }

    /// Replaces each of several right-hand sides by its solution: `count` tiles per unknown.
    pub(super) fn solve_tiles(&mut self, b: &mut [Tile], count: usize) {
        let n = self.n;
        let x = &mut self.tiles;
        x.clear();
        self.rows.iter().for_each(|&row| x.extend_from_slice(&b[row * count..][..count]));
        for k in 0..self.rank {
            let (done, rest) = x.split_at_mut((k + 1) * count);
            for (values, &factor) in rest.chunks_exact_mut(count).zip(&self.factors[k * n + k + 1..(k + 1) * n]) {
                subtract(values, factor, &done[k * count..]);
            }
        }
        for k in (0..n).rev() {
            let (rest, solved) = x.split_at_mut(k * count);
            let solved = &mut solved[..count];
            let inverse = self.factors[k * n + k].recip();
            solved.iter_mut().flatten().for_each(|value| *value *= inverse);
            for (values, &factor) in rest.chunks_exact_mut(count).zip(&self.factors[k * n..]) {
                subtract(values, factor, solved);
            }
        }
        for (values, &column) in x.chunks_exact(count).zip(&self.columns) {
            b[column * count..][..count].copy_from_slice(values);
        }
    }
}

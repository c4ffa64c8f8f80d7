//! Matrices of less than full rank: the solution next to zero of equations that depend on each other without contradiction.
//!
//! Two friction elements that are locked share a load, and nothing says how; no current says where an idle bridge floats.  There the
//! equations are redundant, and what they leave open is left where it is: with complete pivoting `P A Q = L U` ends when no pivot is left
//! (Golub, Van Loan, "Matrix Computations", section 3.4.8), the rows behind it must hold by themselves, and of all solutions the
//! smallest is taken, unknowns measured by their sizes and those moved first that matter least.  Rows and columns are scaled by their
//! largest entries, so that a pivot vanishes by rounding and not for its units.  What is left over of a row is compared with the terms of
//! the equations that it was made of: a large unknown elsewhere excuses nothing.  Dense, for the rare case.

use hyd_system::Pattern;
use hyd_system::math::square;

use crate::tiled::{LANES, Tile};

/// Larger matrices are not looked at: the cost grows with the third power.
const MOST: usize = 1500;
/// A pivot below this part of the largest entry, times the dimension, is rounding.
const FLOOR: f64 = 8.0 * f64::EPSILON;
/// Part of an unknown in what is left open, from which it counts as open.
const OPEN: f64 = 1e-6;

/// Factors of one matrix of less than full rank, and what it leaves open.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct Deficient {
    n: usize,
    rank: usize,
    /// L and U, one column after the other, rows and columns in the order of the pivots.
    factors: Vec<f64>,
    /// Row and column of A at each place.
    rows: Vec<u32>,
    columns: Vec<u32>,
    row_scale: Vec<f64>,
    /// From an unknown of the scaled matrix to one in its size, and from that to its own unit.
    own_scale: Vec<f64>,
    sizes: Vec<f64>,
    /// What is left open, in the sizes of the unknowns: vectors that change no equation.  The first ones, orthonormal, are those along which
    /// a solution is made the smallest; along the others an unknown would be moved for which one of lower rank can make up.
    open: Vec<Vec<f64>>,
    smoothed: usize,
    work: Vec<f64>,
    /// For each row without a pivot what the last right-hand side has left over of it, and how large each unknown is in the equations that
    /// it was made of, for an unknown of its size.
    left_over: Vec<f64>,
    terms: Vec<Vec<f64>>,
}

impl Deficient {
    /// Factors the matrix with `values` on `pattern`; `sizes` are those of the unknowns; of two that can make up for
    /// each other the one of lower `rank` is moved, both if they have the same (0 for all where it is empty).  `None` where the matrix is
    /// too large or has full rank.
    pub(super) fn new(pattern: &Pattern, values: &[f64], sizes: &[f64], ranks: &[u8]) -> Option<Self> {
        let n = pattern.rows;
        if n > MOST {
            return None;
        }
        let mut factors = vec![0.0; n * n];
        let mut row_scale = vec![0.0_f64; n];
        for column in 0..n {
            for entry in pattern.column(column) {
                let row = pattern.row_indices[entry] as usize;
                let value = values[entry] * sizes[column];
                factors[column * n + row] = value;
                row_scale[row] = row_scale[row].max(value.abs());
            }
        }
        row_scale.iter_mut().for_each(|scale| *scale = inverse_or_one(*scale));
        let mut own_scale = vec![1.0; n];
        for (column, own) in factors.chunks_exact_mut(n).zip(&mut own_scale) {
            column.iter_mut().zip(&row_scale).for_each(|(value, scale)| *value *= scale);
            *own = inverse_or_one(column.iter().fold(0.0, |largest, value| value.abs().max(largest)));
            column.iter_mut().for_each(|value| *value *= *own);
        }
        let order = || (0..n as u32).collect();
        let (rows, columns, sizes) = (order(), order(), sizes.to_vec());
        let (open, work) = (Vec::new(), vec![0.0; n]);
        let (rank, smoothed) = (0, 0);
        let mut made = Self {
            n,
            rank,
            factors,
            rows,
            columns,
            row_scale,
            own_scale,
            sizes,
            open,
            smoothed,
            work,
            left_over: Vec::new(),
            terms: Vec::new(),
        };
        let of = |column: u32| ranks.get(column as usize).copied().unwrap_or(0);
        made.eliminate(of);
        if made.rank == n {
            return None;
        }
        made.find_open(of);
        made.find_terms(pattern, values);
        Some(made)
    }

    fn eliminate(&mut self, rank_of: impl Fn(u32) -> u8) {
        let n = self.n;
        let mut ranks: Vec<u8> = self.columns.iter().map(|&column| rank_of(column)).collect();
        ranks.sort_unstable();
        ranks.dedup();
        for k in 0..n {
            let pivot = ranks.iter().find_map(|&rank| self.largest(k, |column| rank_of(column) == rank));
            let Some((row, column)) = pivot else { return };
            self.exchange(k, row, column);
            let (done, rest) = self.factors.split_at_mut((k + 1) * n);
            let pivot = &mut done[k * n..];
            let inverse = pivot[k].recip();
            pivot[k + 1..].iter_mut().for_each(|factor| *factor *= inverse);
            for column in rest.chunks_exact_mut(n) {
                let upper = column[k];
                if upper != 0.0 {
                    column[k + 1..].iter_mut().zip(&pivot[k + 1..]).for_each(|(value, l)| *value -= l * upper);
                }
            }
            self.rank = k + 1;
        }
    }

    /// The largest entry from place `k` on among some of the columns, unless it has vanished.
    fn largest(&self, k: usize, among: impl Fn(u32) -> bool) -> Option<(usize, usize)> {
        let n = self.n;
        let (mut best, mut at) = (FLOOR * n as f64, None);
        for column in (k..n).filter(|&column| among(self.columns[column])) {
            for row in k..n {
                let size = self.factors[column * n + row].abs();
                if size > best {
                    (best, at) = (size, Some((row, column)));
                }
            }
        }
        at
    }

    /// Brings row and column to place `k`.
    fn exchange(&mut self, k: usize, row: usize, column: usize) {
        let n = self.n;
        self.rows.swap(k, row);
        for own in self.factors.chunks_exact_mut(n) {
            own.swap(k, row);
        }
        self.columns.swap(k, column);
        if column != k {
            let (left, right) = self.factors.split_at_mut(column * n);
            left[k * n..(k + 1) * n].swap_with_slice(&mut right[..n]);
        }
    }

    /// What changes no equation: a vector for each column without a pivot.
    fn find_open(&mut self, rank_of: impl Fn(u32) -> u8) {
        let mut kept = Vec::new();
        for free in self.rank..self.n {
            self.work.fill(0.0);
            let column = &self.factors[free * self.n..][..self.rank];
            self.work.iter_mut().zip(column).for_each(|(value, upper)| *value = -upper);
            self.substitute_back();
            self.work[free] = 1.0;
            let mut vector = vec![0.0; self.n];
            for (&column, value) in self.columns.iter().zip(&self.work) {
                vector[column as usize] = value * self.own_scale[column as usize];
            }
            scale_to_one(&mut vector);
            let own = rank_of(self.columns[free]);
            if (0..self.n).any(|k| vector[k].abs() > OPEN && rank_of(k as u32) < own) {
                kept.push(vector);
                continue;
            }
            // Modified Gram-Schmidt.
            for other in &self.open {
                let along = product(other, &vector);
                vector.iter_mut().zip(other).for_each(|(value, other)| *value -= along * other);
            }
            scale_to_one(&mut vector);
            self.open.push(vector);
        }
        self.smoothed = self.open.len();
        self.open.append(&mut kept);
    }

    /// The terms of rows without a pivot: each is a combination of equations, `e_l - L_l L^-1`, whose terms do not cancel in `terms`.
    fn find_terms(&mut self, pattern: &Pattern, values: &[f64]) {
        let n = self.n;
        self.left_over = vec![0.0; n - self.rank];
        for place in self.rank..n {
            // Of each equation, by its row of A.
            let mut share = vec![0.0; n];
            for k in (0..self.rank).rev() {
                let own = &self.factors[k * n..][..n];
                let behind = (k + 1..self.rank).map(|m| own[m] * self.work[m]).sum::<f64>();
                self.work[k] = own[place] - behind;
                share[self.rows[k] as usize] = self.work[k].abs();
            }
            share[self.rows[place] as usize] = 1.0;
            let of_column = |column: usize| {
                let of_row = |entry: usize| {
                    let row = pattern.row_indices[entry] as usize;
                    share[row] * (self.row_scale[row] * values[entry] * self.sizes[column]).abs()
                };
                pattern.column(column).map(of_row).sum::<f64>()
            };
            self.terms.push((0..n).map(of_column).collect());
        }
    }

    /// The first places of the work vector, where U has pivots.
    fn substitute_back(&mut self) {
        for c in (0..self.rank).rev() {
            let column = &self.factors[c * self.n..][..=c];
            let value = self.work[c] / column[c];
            self.work[c] = value;
            self.work[..c].iter_mut().zip(column).for_each(|(other, upper)| *other -= upper * value);
        }
    }

    /// Replaces `b` by the smallest solution of the equations that have pivots; see [`Self::contradicts`] for the others.
    pub(super) fn solve(&mut self, b: &mut [f64]) {
        for (value, &row) in self.work.iter_mut().zip(&self.rows) {
            *value = b[row as usize] * self.row_scale[row as usize];
        }
        for c in 0..self.rank {
            let value = self.work[c];
            let lower = &self.factors[c * self.n..][c + 1..self.n];
            self.work[c + 1..].iter_mut().zip(lower).for_each(|(other, l)| *other -= l * value);
        }
        self.left_over.copy_from_slice(&self.work[self.rank..]);
        self.work[self.rank..].fill(0.0);
        self.substitute_back();
        for (&column, value) in self.columns.iter().zip(&self.work) {
            b[column as usize] = value * self.own_scale[column as usize];
        }
        for open in &self.open[..self.smoothed] {
            let along = product(open, b);
            b.iter_mut().zip(open).for_each(|(value, open)| *value -= along * open);
        }
        b.iter_mut().zip(&self.sizes).for_each(|(value, size)| *value *= size);
    }

    /// Replaces each of several right-hand sides by its solution: `count` tiles per unknown.
    pub(super) fn solve_tiles(&mut self, b: &mut [Tile], count: usize) {
        let mut single = vec![0.0; self.n];
        for (tile, lane) in (0..count).flat_map(|tile| (0..LANES).map(move |lane| (tile, lane))) {
            single.iter_mut().enumerate().for_each(|(k, value)| *value = b[k * count + tile][lane]);
            self.solve(&mut single);
            single.iter().enumerate().for_each(|(k, &value)| b[k * count + tile][lane] = value);
        }
    }

    /// True if the last right-hand side leaves over more of an equation without a pivot than this part of its terms at the unknowns `x`.
    pub(super) fn contradicts(&self, x: &[f64], part: f64) -> bool {
        self.left_over.iter().zip(&self.terms).any(|(left_over, terms)| {
            let all: f64 =
                terms.iter().zip(x.iter().zip(&self.sizes)).map(|(term, (x, size))| term * x.abs() / size).sum();
            left_over.is_nan() || left_over.abs() > part * (1.0 + all)
        })
    }

    /// The unknowns that are not determined, each alone or with others.
    pub(super) fn undetermined(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.n).filter(|&k| self.open.iter().map(|vector| square(vector[k])).sum::<f64>().sqrt() > OPEN)
    }
}

fn inverse_or_one(value: f64) -> f64 {
    if value > 0.0 { value.recip() } else { 1.0 }
}

fn scale_to_one(vector: &mut [f64]) {
    let length = product(vector, vector).sqrt();
    vector.iter_mut().for_each(|value| *value /= length);
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// `left * right` of these ranks, in units that differ by decades.
    fn product_of(n: usize, rank: usize, seed: f64) -> DMatrix<f64> {
        // The last digits of a sine have no pattern.
        let entry = |k: usize| ((seed + 12.9898 * k as f64).sin() * 43_758.545_3).fract();
        let left = DMatrix::from_fn(n, rank, |i, j| entry(i * 31 + j) * 10f64.powi((i % 5) as i32 - 2));
        let right = DMatrix::from_fn(rank, n, |i, j| entry(1000 + i * 37 + j));
        left * right
    }

    fn factored(matrix: &DMatrix<f64>, sizes: &[f64], ranks: &[u8]) -> Option<Deficient> {
        let n = matrix.nrows();
        Deficient::new(&Pattern::dense(n, n), matrix.as_slice(), sizes, ranks)
    }

    /// The smallest solution is that of the pseudo-inverse (singular values of nalgebra), unknowns measured by their sizes.
    #[test]
    fn solutions_are_those_of_the_pseudo_inverse() {
        for (n, rank) in [(2, 1), (5, 3), (12, 11), (20, 13)] {
            for seed in [0.1, 0.7, 2.3] {
                let matrix = product_of(n, rank, seed);
                let sizes: Vec<f64> = (0..n).map(|k| [1e3, 1.0, 1e-2][k % 3]).collect();
                let mut deficient = factored(&matrix, &sizes, &[]).unwrap();
                assert_eq!(deficient.rank, rank);
                let known = DVector::from_fn(n, |k, _| sizes[k] * (seed * 3.0 + k as f64).cos());
                let mut b = (&matrix * &known).as_slice().to_vec();
                let in_sizes = &matrix * DMatrix::from_diagonal(&DVector::from_column_slice(&sizes));
                // Rows of one size, so that the singular values of the reference are not a matter of units.
                let scales = in_sizes.row_iter().map(|row| row.amax().recip()).collect::<Vec<_>>();
                let scaled = DMatrix::from_fn(n, n, |i, j| in_sizes[(i, j)] * scales[i]);
                let right = DVector::from_fn(n, |i, _| b[i] * scales[i]);
                let smallest = scaled.svd(true, true).solve(&right, 1e-9).unwrap();
                deficient.solve(&mut b);
                assert!(!deficient.contradicts(&b, 1e-9));
                for k in 0..n {
                    assert!((b[k] / sizes[k] - smallest[k]).abs() < 1e-8, "{n} {rank} {seed}: {k}");
                }
                assert!(deficient.undetermined().count() > n - rank);
            }
        }
    }

    #[test]
    fn full_rank_is_none_of_its_business() {
        assert!(factored(&product_of(6, 6, 0.3), &[1.0; 6], &[]).is_none());
    }

    /// x + y = 2 and x + y + z = b beside w = 1e9: z is determined, and what contradicts is compared with the terms of its own equations.
    #[test]
    fn a_large_unknown_elsewhere_excuses_no_contradiction() {
        let matrix = DMatrix::from_row_slice(
            4,
            4,
            &[
                1.0, 1.0, 0.0, 0.0, //
                1.0, 1.0, 0.0, 0.0, //
                0.0, 0.0, 1.0, 0.0, //
                0.0, 0.0, 0.0, 1.0,
            ],
        );
        let mut deficient = factored(&matrix, &[1.0; 4], &[]).unwrap();
        let mut answer = |other: f64| {
            let mut b = [2.0, other, 5.0, 1e9];
            deficient.solve(&mut b);
            (deficient.contradicts(&b, 1e-9), b)
        };
        let (contradicts, b) = answer(2.0);
        let near = |found: &[f64], right: &[f64]| {
            found.iter().zip(right).all(|(a, b)| (a - b).abs() <= 1e-15 * b.abs().max(1.0))
        };
        assert!(!contradicts && near(&b, &[1.0, 1.0, 5.0, 1e9]), "{b:?}");
        assert!(answer(2.0 + 1e-6).0 && !answer(2.0 + 1e-12).0);
        let open: Vec<usize> = deficient.undetermined().collect();
        assert_eq!(open, [0, 1]);
        // An unknown of higher rank is not moved where another one can be.
        for (ranks, right) in [([0, 1, 0, 0], [2.0, 0.0]), ([2, 1, 0, 0], [0.0, 2.0]), ([1, 1, 0, 0], [1.0, 1.0])] {
            let mut b = [2.0, 2.0, 5.0, 0.0];
            factored(&matrix, &[1.0; 4], &ranks).unwrap().solve(&mut b);
            assert!(near(&b, &right), "{ranks:?}: {b:?}");
        }
    }
}

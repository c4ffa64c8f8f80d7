//! Linear systems `A x = b` of the solver: scaling, factorisation, solution, and the name of what is singular.
//!
//! `A` has a fixed pattern and changing values.  Rows are scaled by their largest entry and columns by the nominal values of
//! the unknowns before factoring, because SI magnitudes differ by many decades and pivots are chosen by size.  Small
//! systems are eliminated along a list of operations ([`small`]), the smallest inverted for corrections ([`inverse`]); what fills up is
//! eliminated dense ([`dense`]), others sparse ([`sparse`]).  Equations that depend on each other are solved all the same where they
//! do not contradict each other ([`deficient`]), if that is asked for.  Nothing is allocated after the first matrices, except when the pivot order of a
//! sparse one has to change.  Source of the scaling rule: Golub, Van Loan, "Matrix
//! Computations", section 3.5.2.

mod deficient;
mod dense;
mod factor;
mod inverse;
mod iteration_matrix;
mod lower;
mod merge;
mod pivot;
mod pivoting;
mod small;
mod sparse;
mod tail;

use hyd_system::Pattern;

pub(crate) use factor::{FactorError, subtract};
pub(crate) use iteration_matrix::IterationMatrix;

use crate::tiled::{Tile, Tiled};
use deficient::Deficient;
use dense::Dense;
use factor::idle_column;
use small::Small;
use sparse::Sparse;

/// Largest dimension that counts as small.  Dense and sparse cost the same near 50 unknowns for tridiagonal-like
/// patterns; below, dense has no index overhead.
const SMALL_LIMIT: usize = 40;

const _: () = assert!(SMALL_LIMIT <= pivoting::MOST, "the search for pivots has room for the largest");

#[derive(Clone, serde::Serialize, serde::Deserialize)]
enum Kernel {
    Small(Box<Small>),
    Dense(Dense),
    Sparse(Box<Sparse>),
}

/// A scaled factorisation that can be renewed and used for many right-hand sides.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct LinearSolver {
    pattern: Pattern,
    row_scale: Vec<f64>,
    column_scale: Vec<f64>,
    kernel: Kernel,
    /// In use from [`Self::factor_deficient`] to the next factorisation.
    deficient: Option<Box<Deficient>>,
}

impl LinearSolver {
    /// A solver for square matrices with this pattern.
    pub(crate) fn new(pattern: &Pattern) -> Self {
        let n = pattern.rows;
        let kernel = if n <= SMALL_LIMIT {
            Kernel::Small(Box::new(Small::new(pattern)))
        } else {
            Kernel::Sparse(Box::new(Sparse::new(pattern)))
        };
        Self { pattern: pattern.clone(), row_scale: vec![1.0; n], column_scale: vec![1.0; n], kernel, deficient: None }
    }

    /// Begins anew with unknowns of these sizes (n values > 0), before a run and before each initial system.  Pivots
    /// that were chosen before are forgotten, so that a run gives the same bits whatever was solved before it.
    pub(crate) fn begin(&mut self, nominals: &[f64]) {
        self.column_scale.copy_from_slice(nominals);
        self.deficient = None;
        match &mut self.kernel {
            Kernel::Small(small) => small.forget(),
            Kernel::Sparse(sparse) => sparse.forget(),
            Kernel::Dense(_) => self.kernel = Kernel::Small(Box::new(Small::new(&self.pattern))),
        }
    }

    /// Factors the matrix with these values on the pattern; `values` are scaled in place.
    pub(crate) fn factor(&mut self, values: &mut [f64]) -> Result<(), FactorError> {
        self.deficient = None;
        if let Kernel::Small(small) = &mut self.kernel {
            let factored = small.factor(&self.pattern, values, &self.column_scale);
            if !small.is_full() {
                return factored;
            }
            self.kernel = Kernel::Dense(Dense::new(self.row_scale.len()));
        }
        self.scale(values)?;
        match &mut self.kernel {
            Kernel::Small(_) => Ok(()),
            Kernel::Dense(dense) => dense.factor(&self.pattern, values),
            Kernel::Sparse(sparse) => sparse.factor(&self.pattern, values),
        }
    }

    /// Factors a matrix that [`Self::factor`] has found singular, so that solutions are the smallest ones of equations that may depend on
    /// each other; false if that does not help.  Whether they contradict each other is known behind each solution
    /// ([`Self::contradicts`]).  `sizes` are those of the
    /// unknowns, by which solutions are the smallest; `ranks`: which unknowns are moved before others ([`Deficient::new`]).
    pub(crate) fn factor_deficient(&mut self, values: &[f64], sizes: &[f64], ranks: &[u8]) -> bool {
        self.deficient = Deficient::new(&self.pattern, values, sizes, ranks).map(Box::new);
        self.deficient.is_some()
    }

    /// True if the last factorisation is that of [`Self::factor_deficient`].
    #[inline(always)]
    pub(crate) fn is_deficient(&self) -> bool {
        self.deficient.is_some()
    }

    /// True if equations contradict each other at the last right-hand side by more than this part of their terms at `x`; false with full rank.
    pub(crate) fn contradicts(&self, x: &[f64], part: f64) -> bool {
        self.deficient.as_ref().is_some_and(|deficient| deficient.contradicts(x, part))
    }

    /// The unknowns that the last matrix does not determine.
    pub(crate) fn undetermined(&self) -> impl Iterator<Item = usize> + '_ {
        self.deficient.iter().flat_map(|deficient| deficient.undetermined())
    }

    /// Replaces `b` by the solution of `A x = b`.
    pub(crate) fn solve(&mut self, b: &mut [f64]) {
        if let Some(deficient) = &mut self.deficient {
            return deficient.solve(b);
        }
        if let Kernel::Small(small) = &mut self.kernel {
            return small.solve(b);
        }
        for (value, scale) in b.iter_mut().zip(&self.row_scale) {
            *value *= scale;
        }
        match &mut self.kernel {
            Kernel::Small(_) => {}
            Kernel::Dense(dense) => dense.solve(b),
            Kernel::Sparse(sparse) => sparse.solve(b),
        }
        for (value, scale) in b.iter_mut().zip(&self.column_scale) {
            *value *= scale;
        }
    }

    /// `x := A^{-1} b` for the corrections of an iteration, which may be off by a few more roundings than those of [`Self::solve`].
    #[inline(always)]
    pub(crate) fn correct(&mut self, b: &Tiled, x: &mut Tiled) {
        if let Kernel::Small(small) = &mut self.kernel
            && self.deficient.is_none()
            && small.correct(b, x.tiles_mut())
        {
            return;
        }
        // With what fills the last tile: a correction that was not finite may have left something there.
        x.tiles_mut().copy_from_slice(b.tiles());
        self.solve(x);
    }

    /// Replaces each of several right-hand sides by its solution; `b` has `count` tiles per unknown.
    pub(crate) fn solve_tiles(&mut self, b: &mut Vec<Tile>, count: usize) {
        if let Some(deficient) = &mut self.deficient {
            return deficient.solve_tiles(b, count);
        }
        if let Kernel::Small(small) = &mut self.kernel {
            return small.solve_tiles(b, count);
        }
        scale_tiles(b, count, &self.row_scale);
        match &mut self.kernel {
            Kernel::Small(_) => {}
            Kernel::Dense(dense) => dense.solve_tiles(b, count),
            Kernel::Sparse(sparse) => sparse.solve_tiles(b, count),
        }
        scale_tiles(b, count, &self.column_scale);
    }

    /// The scale of row `k` in the last factorisation, for comparing residuals of different rows.
    pub(crate) fn row_scale(&self, k: usize) -> f64 {
        match &self.kernel {
            Kernel::Small(small) => small.row_scale(k),
            Kernel::Dense(_) | Kernel::Sparse(_) => self.row_scale[k],
        }
    }

    /// `a_ij := r_i a_ij c_j` with `c` the nominals and `r_i = 1 / max_j |a_ij c_j|`.
    fn scale(&mut self, values: &mut [f64]) -> Result<(), FactorError> {
        let rows = &self.pattern.row_indices;
        self.row_scale.fill(0.0);
        for column in 0..self.column_scale.len() {
            let c = self.column_scale[column];
            for entry in self.pattern.column(column) {
                values[entry] *= c;
                let row = rows[entry] as usize;
                if !values[entry].is_finite() {
                    return Err(FactorError::NotFinite { row, column });
                }
                self.row_scale[row] = self.row_scale[row].max(values[entry].abs());
            }
        }
        if let Some(row) = self.row_scale.iter().position(|&largest| largest == 0.0) {
            return Err(FactorError::Singular { row, column: idle_column(&self.pattern, values, row) });
        }
        for scale in &mut self.row_scale {
            *scale = scale.recip();
        }
        for (value, &row) in values.iter_mut().zip(rows) {
            *value *= self.row_scale[row as usize];
        }
        Ok(())
    }
}

fn scale_tiles(b: &mut [Tile], count: usize, scale: &[f64]) {
    for (values, scale) in b.chunks_exact_mut(count).zip(scale) {
        values.iter_mut().flatten().for_each(|value| *value *= scale);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::tiled::LANES;
    use proptest::prelude::*;

    /// Values of a band matrix with a few far entries, and `A x` for a known x.
    fn check(n: usize, seed: &[f64]) {
        let mut pairs = Vec::new();
        for k in 0..n as u32 {
            for d in [0, 1, 7] {
                if k + d < n as u32 {
                    pairs.push((k, k + d));
                    pairs.push((k + d, k));
                }
            }
        }
        let pattern = Pattern::from_pairs(n, n, &pairs);
        let mut solver = LinearSolver::new(&pattern);
        let nominals: Vec<f64> = (0..n).map(|k| [1e7, 1.0, 1e-4][k % 3]).collect();
        solver.begin(&nominals);
        let mut shift = 0;
        for round in 0..3 {
            let mut values = vec![0.0; pattern.entries()];
            let mut product = vec![0.0; n];
            let x: Vec<f64> = (0..n).map(|k| nominals[k] * (1.0 + k as f64).sin()).collect();
            for c in 0..n {
                for e in pattern.column(c) {
                    let row = pattern.row_indices[e] as usize;
                    shift += 1;
                    let entry = seed[(shift * (round + 1)) % seed.len()] + if row == c { 4.0 } else { 0.0 };
                    values[e] = entry * 10f64.powi((row % 5) as i32 - 2) / nominals[c];
                    product[row] += values[e] * x[c];
                }
            }
            solver.factor(&mut values).unwrap();
            let tile: Vec<Tile> = product.iter().map(|&value| [value, -value, 0.0, 2.0 * value]).collect();
            solver.solve(&mut product);
            // A second tile per unknown, the first one times 3.
            let mut tile: Vec<Tile> = tile.iter().flat_map(|tile| [*tile, tile.map(|value| 3.0 * value)]).collect();
            solver.solve_tiles(&mut tile, 2);
            for (values, &x) in tile.as_flattened().chunks_exact(2 * LANES).zip(&product) {
                for (value, factor) in values.iter().zip([1.0, -1.0, 0.0, 2.0, 3.0, -3.0, 0.0, 6.0]) {
                    assert!((value - factor * x).abs() <= 1e-13 * x.abs().max(nominals[0]));
                }
            }
            for k in 0..n {
                // 4.0 on the diagonal against at most 4 entries below 1: condition well below 1e3.
                assert!((product[k] - x[k]).abs() <= 1e-11 * nominals[k], "n {n}, round {round}, {k}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn solutions_are_recovered_dense_and_sparse(seed in prop::collection::vec(-0.9f64..0.9, 97)) {
            check(12, &seed);
            check(120, &seed);
        }
    }

    /// Corrections are solutions, whatever the size, and factors are there behind an inverse.
    #[test]
    fn corrections_agree_with_solutions() {
        for n in [1usize, 3, 4, 9, 12, 13, inverse::LARGEST, inverse::LARGEST + 1, 40] {
            let pattern = Pattern::dense(n, n);
            let mut solver = LinearSolver::new(&pattern);
            let mut number = 0.37;
            let mut next = || {
                number = (number * 997.0_f64).fract();
                number - 0.5
            };
            for round in 0..4 {
                let entry = |k: usize, small: f64| small + if k.is_multiple_of(n + 1) { 2.0 * n as f64 } else { 0.0 };
                let matrix: Vec<f64> = (0..n * n).map(|k| entry(k, next())).collect();
                solver.factor(&mut matrix.clone()).unwrap();
                let (mut b, mut x) = (Tiled::zeros(n), Tiled::zeros(n));
                b.iter_mut().for_each(|value| *value = next());
                solver.correct(&b, &mut x);
                let mut solution = b.to_vec();
                solver.solve(&mut solution);
                for (x, solution) in x.iter().zip(&solution) {
                    assert!((x - solution).abs() <= 1e-13, "n {n}, round {round}");
                }
                assert!(x.tiles().as_flattened()[n..].iter().all(|&filling| filling == 0.0));
            }
            // With an inverse, too, what is singular or not finite is named, and the next matrix is solved.
            if n > 1 {
                let mut twice: Vec<f64> = (0..n * n).map(|k| f64::from(u8::from(k % (n + 1) == 0))).collect();
                twice[n * n - 1] = 0.0;
                assert!(matches!(solver.factor(&mut twice.clone()), Err(FactorError::Singular { .. })), "n {n}");
                twice[n * n - 1] = f64::NAN;
                let named = FactorError::NotFinite { row: n - 1, column: n - 1 };
                assert_eq!(solver.factor(&mut twice.clone()), Err(named));
                twice[n * n - 1] = 1.0;
                solver.factor(&mut twice).unwrap();
                let (mut b, mut x) = (Tiled::zeros(n), Tiled::zeros(n));
                b.fill(3.0);
                solver.correct(&b, &mut x);
                assert!(x.iter().all(|&x| x == 3.0));
            }
        }
    }

    /// Solution and correction of one right-hand side.
    fn answers(solver: &mut LinearSolver, values: &[f64]) -> Vec<u64> {
        let n = solver.row_scale.len();
        solver.factor(&mut values.to_vec()).unwrap();
        let (mut b, mut x) = (Tiled::zeros(n), Tiled::zeros(n));
        b.iter_mut().enumerate().for_each(|(k, value)| *value = (1.0 + k as f64).sqrt());
        solver.correct(&b, &mut x);
        let mut solution = b.to_vec();
        solver.solve(&mut solution);
        x.iter().chain(&solution).map(|value| value.to_bits()).collect()
    }

    /// A solver that has chosen pivots by another matrix gives the bits of a new one.
    #[test]
    fn a_begun_run_knows_nothing_of_matrices_before() {
        for n in [6u32, 14, 20, 60] {
            // An arrow: all is filled if its head is the first pivot, nothing if it is the last one.
            let pairs = (0..n).flat_map(|k| [(k, k), (0, k), (k, 0)]);
            let pattern = Pattern::from_pairs(
                n as usize,
                n as usize,
                &pairs.collect::<std::collections::BTreeSet<_>>().into_iter().collect::<Vec<_>>(),
            );
            let matrix = |shaft: f64| -> Vec<f64> {
                let entries = (0..n as usize).flat_map(|column| pattern.column(column).map(move |e| (e, column)));
                let value = |(e, column): (usize, usize)| match (pattern.row_indices[e] as usize, column) {
                    (row, column) if row == column && row > 0 => shaft * (1.0 + 0.1 * (row as f64).sin()),
                    (row, column) => 1.0 + 0.3 * ((3 * row + column) as f64).cos(),
                };
                entries.map(value).collect()
            };
            let (other, own) = (matrix(1e-3), matrix(0.7));
            let new = || LinearSolver::new(&pattern);
            let alone = answers(&mut new(), &own);
            let mut used = new();
            answers(&mut used, &other);
            let without = answers(&mut used, &own);
            assert!(without != alone, "{n}: what was chosen before changes nothing");
            answers(&mut used, &other);
            used.begin(&vec![1.0; n as usize]);
            assert!(answers(&mut used, &own) == alone, "{n}");
        }
        // Whether a matrix fills up depends on its pivots, too.
        let mut used = LinearSolver::new(&Pattern::dense(20, 20));
        answers(&mut used, &(0..400).map(|k| f64::from(k * k).sin()).collect::<Vec<_>>());
        assert!(matches!(used.kernel, Kernel::Dense(_)));
        used.begin(&[1.0; 20]);
        assert!(matches!(used.kernel, Kernel::Small(_)));
    }

    /// A chain of differences in which unknown `free` occurs only through its sum with the next one.
    fn singular_at(n: usize, free: u32) -> FactorError {
        let mut pairs: Vec<(u32, u32)> = (0..n as u32).map(|k| (k, k)).collect();
        pairs.extend([(free, free + 1), (free + 1, free)]);
        let pattern = Pattern::from_pairs(n, n, &pairs);
        let mut values = vec![1.0; pattern.entries()];
        LinearSolver::new(&pattern).factor(&mut values).unwrap_err()
    }

    #[test]
    fn the_singular_pair_is_named() {
        for (n, free) in [(6, 3), (90, 55)] {
            let FactorError::Singular { row, column } = singular_at(n, free) else { panic!() };
            assert!([free, free + 1].contains(&(row as u32)), "{n}: row {row}");
            assert!([free, free + 1].contains(&(column as u32)), "{n}: column {column}");
        }
    }

    #[test]
    fn empty_rows_and_infinite_entries_are_named() {
        let pattern = Pattern::dense(2, 2);
        let mut solver = LinearSolver::new(&pattern);
        assert_eq!(solver.factor(&mut [1.0, 0.0, 1.0, 0.0]), Err(FactorError::Singular { row: 1, column: 0 }));
        assert_eq!(solver.factor(&mut [1.0, 0.0, f64::NAN, 1.0]), Err(FactorError::NotFinite { row: 0, column: 1 }));
    }
}

//! The last pivots of an elimination, among which little is zero: they are not eliminated but inverted ([`super::inverse`]).
//!
//! What is left after the first pivots, the Schur complement, fills up (Duff, Erisman, Reid, "Direct Methods for Sparse
//! Matrices", section 7.3), and substitution in its factors is the longest chain of a solution.  Of small matrices all
//! pivots are last ones.

use hyd_system::Pattern;

use super::inverse::{self, Inverse};
use super::pivot::Pivot;
use crate::tiled::{LANES, Tile};

/// Fewer pivots are as well eliminated.
const FEWEST: usize = 5;
/// Part of the block that is not zero.
const FULL: f64 = 0.6;
/// Most pivots that are inverted where others are eliminated.
const LARGEST: usize = 3 * LANES;

/// The block of the last pivots.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Tail {
    /// Position of the first of them.
    pub(super) first: usize,
    /// The pivots with rows and columns of the block.
    pivots: Vec<Pivot>,
    /// Row, column and place of each entry.
    entries: Vec<(u32, u32, u32)>,
    /// Row and column of the matrix that each of the block is.
    rows: Vec<u32>,
    columns: Vec<u32>,
    right: Vec<f64>,
    left: Vec<Tile>,
    inverse: Inverse,
}

impl Tail {
    /// Chooses the block for pivots in their order; `indices` are the columns and rows of the factors.
    pub(super) fn choose(&mut self, pattern: &Pattern, pivots: &[Pivot], indices: &[u32]) {
        let n = pattern.rows;
        self.first = 0;
        if n <= inverse::LARGEST {
            // Rows and columns stay those of the matrix, and right-hand sides need not be sorted.
            return;
        }
        self.first = first_of(pivots);
        self.rows.clear();
        self.columns.clear();
        self.rows.extend(pivots[self.first..].iter().map(|pivot| pivot.row));
        self.columns.extend(pivots[self.first..].iter().map(|pivot| pivot.column));
        let mut of_row = vec![0; n];
        let mut of_column = vec![0; n];
        for (k, (&row, &column)) in self.rows.iter().zip(&self.columns).enumerate() {
            (of_row[row as usize], of_column[column as usize]) = (k as u32, k as u32);
        }
        self.pivots.clear();
        self.entries.clear();
        for pivot in &pivots[self.first..] {
            let (row, column) = (of_row[pivot.row as usize], of_column[pivot.column as usize]);
            self.pivots.push(pivot.at_place(row, column));
            self.entries.push((row, column, pivot.at));
            for place in pivot.upper_range() {
                self.entries.push((row, of_column[indices[place] as usize], place as u32));
            }
            for place in pivot.lower_range() {
                self.entries.push((of_row[indices[place] as usize], column, place as u32));
            }
        }
        self.right.resize(self.rows.len(), 0.0);
        self.left.resize(self.rows.len().div_ceil(LANES), [0.0; LANES]);
    }

    /// The inverse is that of another matrix.
    pub(super) fn forget(&mut self) {
        self.inverse.forget();
    }

    /// True if there is an inverse of this matrix.
    #[inline(always)]
    pub(super) fn is_made(&self) -> bool {
        self.inverse.is_made()
    }

    /// Makes the inverse of what the first pivots have left of `values`; false if a pivot has become too small.
    /// `largest` is the largest entry of each row, `drift` the part of the entries below it that a pivot is at least.
    pub(super) fn invert(&mut self, values: &[f64], largest: &[f64], drift: f64) -> bool {
        let entries =
            self.entries.iter().map(|&(row, column, place)| (row as usize, column as usize, values[place as usize]));
        let largest = |row: usize| largest[self.rows[row] as usize];
        self.inverse.make(self.rows.len(), entries, &self.pivots, largest, drift)
    }

    /// The same where all pivots are last ones, with the entries of the matrix (row, column, value).
    pub(super) fn invert_whole(
        &mut self,
        entries: impl Iterator<Item = (usize, usize, f64)>,
        pivots: &[Pivot],
        largest: &[f64],
        drift: f64,
    ) -> bool {
        self.inverse.make(pivots.len(), entries, pivots, |row| largest[row], drift)
    }

    /// Solves for all unknowns at once, if all pivots are last ones.
    #[inline(always)]
    pub(super) fn apply(&self, b: &[f64], x: &mut [Tile]) {
        self.inverse.apply(b, x);
    }

    /// Solves for the unknowns of the block, from right-hand sides that the first pivots have changed.
    #[inline(always)]
    pub(super) fn apply_within(&mut self, b: &[f64], x: &mut [f64]) {
        for (right, &row) in self.right.iter_mut().zip(&self.rows) {
            *right = b[row as usize];
        }
        self.inverse.apply(&self.right, &mut self.left);
        for (&value, &column) in self.left.as_flattened().iter().zip(&self.columns) {
            x[column as usize] = value;
        }
    }
}

/// The first pivot of the largest block that is full enough; their number if none is.
fn first_of(pivots: &[Pivot]) -> usize {
    let n = pivots.len();
    let (mut entries, mut best) = (0, n);
    for (size, pivot) in (1..=LARGEST).zip(pivots.iter().rev()) {
        entries += 1 + pivot.upper_range().len() + pivot.lower_range().len();
        if size >= FEWEST && entries as f64 >= FULL * (size * size) as f64 {
            best = n - size;
        }
    }
    best
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use hyd_system::Pattern;

    use super::super::small::Small;
    use crate::tiled::Tiled;

    fn turn(k: usize, n: usize) -> usize {
        (7 * k + 3) % n
    }

    /// Chains of unknowns beside a block in which all depend on all, rows and columns in no order.
    fn bordered(n: usize, block: usize) -> Pattern {
        let chain = (0..n).flat_map(|k| [(k, k), (k, (k + 1) % n)]);
        let within = (0..block).flat_map(|row| (0..block).map(move |column| (row, column)));
        let mut pairs: Vec<(u32, u32)> = chain
            .chain(within)
            .map(|(row, column)| (turn(row, n) as u32, ((turn(column, n) + 5) % n) as u32))
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        Pattern::from_pairs(n, n, &pairs)
    }

    #[test]
    fn corrections_agree_with_solutions_where_a_part_is_inverted() {
        for (n, block) in [(17, 6), (19, 8), (23, 10), (31, 12), (40, 14)] {
            let pattern = bordered(n, block);
            let mut small = Small::new(&pattern);
            let sizes = vec![1.0; n];
            let mut number = 0.37;
            let mut next = || {
                number = (number * 997.0_f64).fract();
                number - 0.5
            };
            for round in 0..6 {
                let mut values: Vec<f64> = (0..pattern.entries()).map(|_| next()).collect();
                // Pivots of the block that served become nothing, and others must be chosen.
                let place = |row: u32| (0..block).position(|k| turn(k, n) == row as usize);
                let side = |column: usize| (0..block).position(|k| (turn(k, n) + 5) % n == column);
                for (column, entry) in
                    (0..n).flat_map(|column| pattern.column(column).map(move |entry| (column, entry)))
                {
                    if let (Some(row), Some(column)) = (place(pattern.row_indices[entry]), side(column))
                        && round >= 4
                        && (row + column + round).is_multiple_of(2)
                    {
                        values[entry] *= 1e-14;
                    }
                }
                small.factor(&pattern, &values, &sizes).unwrap();
                let (mut b, mut x) = (Tiled::zeros(n), Tiled::zeros(n));
                b.iter_mut().for_each(|value| *value = next());
                let in_part = small.correct(&b, x.tiles_mut());
                assert_eq!(in_part, round > 0, "n {n}, round {round}");
                let mut solution = b.to_vec();
                small.solve(&mut solution);
                if !in_part {
                    continue;
                }
                let size = solution.iter().fold(0.0f64, |size, value| size.max(value.abs()));
                for (x, solution) in x.iter().zip(&solution) {
                    assert!((x - solution).abs() <= 1e-9 * size, "n {n}, round {round}: {x} {solution}");
                }
                for row in 0..n {
                    let entries = (0..n).flat_map(|c| pattern.column(c).map(move |entry| (entry, c)));
                    let own = entries.filter(|&(entry, _)| pattern.row_indices[entry] as usize == row);
                    let terms: Vec<f64> = own.map(|(entry, c)| values[entry] * x[c]).collect();
                    let scale = terms.iter().fold(b[row].abs(), |scale, term| scale.max(term.abs()));
                    assert!((terms.iter().sum::<f64>() - b[row]).abs() <= 1e-8 * scale, "n {n}, row {row}");
                }
                assert!(x.tiles().as_flattened()[n..].iter().all(|&filling| filling == 0.0));
            }
        }
    }
}

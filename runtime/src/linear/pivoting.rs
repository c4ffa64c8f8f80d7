//! Choice of the pivots of a small matrix: Markowitz's count among entries that are large enough.
//!
//! Of the entries that are not much smaller than the largest of their column that one is taken whose row and column
//! have the fewest others, of equal ones the largest (Duff, Erisman, Reid, "Direct Methods for Sparse Matrices", Oxford
//! 2017, sections 5.2 and 7.2).  Rows of a column are the bits of a word, so that a search meets entries only.

use super::factor::{FactorError, PIVOT_FLOOR};

/// A pivot is at least this part of the largest scaled entry of its column when it is chosen.
const THRESHOLD: f64 = 0.1;

/// Rows or columns, a bit each.
type Set = u64;

/// Most rows of a matrix.
pub(super) const MOST: usize = Set::BITS as usize;

/// The matrix while pivots are chosen.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Pivoting {
    n: usize,
    /// Entries, scaled, column by column.
    full: Vec<f64>,
    /// Rows with an entry, of each column; those that were zero and have been filled, too.
    filled: Vec<Set>,
    /// Without a pivot so far.
    rows: Set,
    columns: Set,
    /// Entries of each row in columns without a pivot.
    in_row: Vec<u32>,
    /// Largest entry of each column in rows without a pivot, and in those with one.
    largest: Vec<f64>,
    above: Vec<f64>,
    /// Multiples of the pivot's row that are taken from the others.
    factors: Vec<f64>,
}

impl Pivoting {
    /// Begins with a matrix of zeros; at most [`MOST`] rows.
    pub(super) fn begin(&mut self, n: usize) {
        self.n = n;
        self.full.clear();
        self.full.resize(n * n, 0.0);
        self.filled.clear();
        self.filled.resize(n, 0);
        self.in_row.clear();
        self.in_row.resize(n, 0);
        self.largest.clear();
        self.largest.resize(n, 0.0);
        self.above.clear();
        self.above.resize(n, 0.0);
        self.factors.resize(n, 0.0);
        self.rows = Set::MAX.checked_shr(Set::BITS - n as u32).unwrap_or(0);
        self.columns = self.rows;
    }

    /// An entry of the matrix, scaled so that the largest of its row is 1.
    pub(super) fn set(&mut self, row: usize, column: usize, value: f64) {
        self.full[column * self.n + row] = value;
        self.filled[column] |= 1 << row;
        self.in_row[row] += 1;
        self.largest[column] = self.largest[column].max(value.abs());
    }

    /// True if there is an entry, or was one during the elimination.
    pub(super) fn is_filled(&self, row: usize, column: usize) -> bool {
        self.filled[column] >> row & 1 != 0
    }

    /// Row, column and value of the next pivot, which is eliminated; none when all rows have one.
    pub(super) fn next(&mut self) -> Result<Option<(usize, usize, f64)>, FactorError> {
        if self.rows == 0 {
            return Ok(None);
        }
        let (row, column) = self.best()?;
        let pivot = self.full[column * self.n + row];
        self.eliminate(row, column, pivot);
        Ok(Some((row, column, pivot)))
    }

    /// The entry that is large enough and fills least.
    fn best(&self) -> Result<(usize, usize), FactorError> {
        let mut best: Option<((u32, f64), (usize, usize))> = None;
        for column in members(self.columns) {
            let (here, largest) = (self.filled[column] & self.rows, self.largest[column]);
            // The matrix is scaled: what is left of a column of which nothing is left is rounding.
            let sound = largest > PIVOT_FLOOR * largest.max(self.above[column]);
            if !sound {
                let row = members(here).chain(members(self.rows)).next().unwrap_or(0);
                return Err(FactorError::Singular { row, column });
            }
            let entries = &self.full[column * self.n..][..self.n];
            let others = here.count_ones() - 1;
            for row in members(here) {
                let size = entries[row].abs();
                if size >= THRESHOLD * largest {
                    let rank = ((self.in_row[row] - 1) * others, -size / largest);
                    if best.is_none_or(|(known, _)| rank.0 < known.0 || rank.0 == known.0 && rank.1 < known.1) {
                        best = Some((rank, (row, column)));
                    }
                }
            }
        }
        let first = |set: Set| set.trailing_zeros() as usize;
        let none = FactorError::Singular { row: first(self.rows), column: first(self.columns) };
        best.map(|(_, place)| place).ok_or(none)
    }

    /// Takes multiples of the pivot's row from those that have an entry below it.
    fn eliminate(&mut self, row: usize, column: usize, pivot: f64) {
        self.rows &= !(1 << row);
        self.columns &= !(1 << column);
        let below = self.filled[column] & self.rows;
        for r in members(below) {
            self.factors[r] = self.full[column * self.n + r] / pivot;
            self.in_row[r] -= 1;
        }
        for c in members(self.columns) {
            if !self.is_filled(row, c) {
                continue;
            }
            let entries = &mut self.full[c * self.n..][..self.n];
            let own = entries[row];
            self.above[c] = self.above[c].max(own.abs());
            for r in members(below) {
                entries[r] -= self.factors[r] * own;
            }
            for r in members(below & !self.filled[c]) {
                self.in_row[r] += 1;
            }
            self.filled[c] |= below;
            let left = members(self.filled[c] & self.rows);
            self.largest[c] = left.fold(0.0, |largest, r| largest.max(entries[r].abs()));
        }
    }
}

/// The members of a set, in ascending order.
fn members(mut set: Set) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let first = set.trailing_zeros();
        set &= set.wrapping_sub(1);
        (first < Set::BITS).then_some(first as usize)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pivots, and what ended the search before its end.
    fn pivots(
        pivoting: &mut Pivoting,
        n: usize,
        entries: &[(usize, usize, f64)],
    ) -> (Vec<(usize, usize, f64)>, Option<FactorError>) {
        pivoting.begin(n);
        entries.iter().for_each(|&(row, column, value)| pivoting.set(row, column, value));
        let mut list = Vec::new();
        loop {
            match pivoting.next() {
                Ok(Some(pivot)) => list.push(pivot),
                Ok(None) => return (list, None),
                Err(error) => return (list, Some(error)),
            }
        }
    }

    /// The same by looking at everything each time.
    fn by_hand(n: usize, entries: &[(usize, usize, f64)]) -> Vec<(usize, usize, f64)> {
        let mut matrix = vec![vec![None; n]; n];
        entries.iter().for_each(|&(row, column, value)| matrix[row][column] = Some(value));
        let (mut rows, mut columns): (Vec<usize>, Vec<usize>) = ((0..n).collect(), (0..n).collect());
        let mut list = Vec::new();
        while !rows.is_empty() {
            let size = |row: usize, column: usize| matrix[row][column].map_or(0.0, f64::abs);
            let mut ranks = Vec::new();
            for &column in &columns {
                let largest = rows.iter().fold(0.0f64, |largest, &row| largest.max(size(row, column)));
                let scale = (0..n).fold(0.0f64, |largest, row| largest.max(size(row, column)));
                if largest <= PIVOT_FLOOR * scale {
                    return list;
                }
                let in_column = rows.iter().filter(|&&row| matrix[row][column].is_some()).count();
                for &row in rows.iter().filter(|&&row| size(row, column) >= THRESHOLD * largest) {
                    if matrix[row][column].is_some() {
                        let in_row = columns.iter().filter(|&&c| matrix[row][c].is_some()).count();
                        ranks.push(((in_row - 1) * (in_column - 1), -size(row, column) / largest, row, column));
                    }
                }
            }
            // Of equal ones the first, column by column.
            let best = ranks.iter().min_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).expect("numbers"));
            let &(_, _, row, column) = best.expect("a candidate");
            let pivot = matrix[row][column].expect("an entry");
            list.push((row, column, pivot));
            rows.retain(|&r| r != row);
            columns.retain(|&c| c != column);
            let own = matrix[row].clone();
            for &r in &rows {
                let Some(value) = matrix[r][column] else { continue };
                let factor = value / pivot;
                for &c in &columns {
                    if let Some(own) = own[c] {
                        matrix[r][c] = Some(matrix[r][c].unwrap_or(0.0) - factor * own);
                    }
                }
            }
        }
        list
    }

    #[test]
    fn pivots_are_those_of_a_search_of_everything() {
        let mut state = 1u64;
        let mut number = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 9_007_199_254_740_992.0
        };
        let mut pivoting = Pivoting::default();
        let mut whole = 0;
        for case in 0..600 {
            let n = [0, 1, 2, 5, 12, 23, 40][case % 7];
            let density = 0.05 + 0.4 * number();
            let mut entries = Vec::new();
            for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
                if row == column || number() < density {
                    // Few sizes, so that many are equal, zeros among them.
                    entries.push((row, column, (8.0 * number()).floor() / 4.0 - 1.0));
                }
            }
            let (list, end) = pivots(&mut pivoting, n, &entries);
            assert_eq!(list, by_hand(n, &entries), "{n} rows, {entries:?}");
            assert_eq!(end.is_none(), list.len() == n);
            whole += usize::from(end.is_none());
        }
        assert!((100..500).contains(&whole), "{whole} matrices can be eliminated");
    }

    #[test]
    fn an_arrow_is_eliminated_from_its_feathers() {
        // Full first row and column: taken first, it fills everything; last, nothing.
        let n = 6;
        let mut entries = vec![(0, 0, 1.0)];
        for k in 1..n {
            entries.extend([(k, k, 1.0), (0, k, 0.5), (k, 0, 0.5)]);
        }
        let mut pivoting = Pivoting::default();
        let (list, end) = pivots(&mut pivoting, n, &entries);
        assert!(end.is_none());
        // All but the last two, which are equal.
        assert!(list[..n - 2].iter().all(|&(row, column, value)| row != 0 && row == column && value == 1.0));
        assert_eq!(list.iter().map(|pivot| pivot.2).product::<f64>().abs(), 0.25, "the determinant: 1 - 5*0.25");
        assert!((1..n).all(|k| (1..n).all(|j| pivoting.is_filled(k, j) == (k == j))), "nothing is filled");
    }

    #[test]
    fn what_is_filled_counts() {
        // A ring: the first pivot fills the last row, which becomes as long as the others were.
        let n = 5;
        let entries: Vec<_> = (0..n).flat_map(|k| [(k, k, 1.0), (k, (k + 1) % n, 0.5)]).collect();
        let mut pivoting = Pivoting::default();
        let (list, end) = pivots(&mut pivoting, n, &entries);
        assert!(end.is_none());
        assert!(pivoting.is_filled(n - 1, 1));
        assert_eq!(list[..3], [0, 1, 2].map(|k| (k, k, 1.0)));
        assert_eq!(list.iter().map(|pivot| pivot.2).product::<f64>().abs(), 1.0 + 0.5f64.powi(5), "the determinant");
    }

    #[test]
    fn small_entries_are_no_pivots_however_little_they_fill() {
        // Row 1 has one entry, a hundredth of the largest of its column.
        let entries = [(0, 0, 1.0), (0, 1, 1.0), (0, 2, 0.7), (1, 0, 0.01), (2, 0, 1.0), (2, 1, 0.4), (2, 2, 0.5)];
        let (list, end) = pivots(&mut Pivoting::default(), 3, &entries);
        assert!(end.is_none());
        assert_ne!((list[0].0, list[0].1), (1, 0));
        assert_eq!(list.len(), 3);
    }

    #[test]
    fn what_cancels_has_no_pivot() {
        // But for rounding the second row is a third of the first.
        let entries = [(0, 0, 1.0), (0, 1, 0.1), (1, 0, 1.0 / 3.0), (1, 1, (0.1f64 / 3.0).next_up())];
        let (list, end) = pivots(&mut Pivoting::default(), 2, &entries);
        assert_eq!(list.len(), 1);
        assert!(matches!(end, Some(FactorError::Singular { row: 1, column: 1 })));
    }
}

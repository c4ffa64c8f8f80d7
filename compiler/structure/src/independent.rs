//! Linearly independent columns of a sparse matrix, taken in order of preference.
//!
//! Left-looking elimination with partial pivoting (Duff, Erisman, Reid 2017, *Direct Methods for Sparse Matrices*, ch. 10):
//! a column is taken if enough of it is left after eliminating those taken before.  Independent sets form a matroid,
//! so that taking columns greedily gives the best basis for any order of preference (Edmonds 1971, *Matroids and the
//! greedy algorithm*).  Rows are scaled to largest entry 1 first.  What "enough" means is lowered in steps, so that a
//! well-conditioned choice goes before a preferred one.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A column keeps at least this part of its largest entry; the later values are tried only if columns are missing.
const LEAST_REST: [f64; 3] = [0.05, 1e-4, 1e-9];

/// A sparse matrix, column by column: (row, value).
pub(crate) struct Columns {
    /// Number of rows.
    pub rows: usize,
    /// The columns in order of preference, rows ascending.
    pub columns: Vec<Vec<(u32, f64)>>,
}

/// Chosen columns (positions) with the row each is pivot of; as many as rows if the matrix has full rank.
pub(crate) fn independent_columns(matrix: &Columns) -> Vec<(usize, u32)> {
    independent_columns_before(matrix, matrix.columns.len())
}

/// The same, where columns from position `reserve` on are taken only if those before them are too few, however little is left of these.
pub(crate) fn independent_columns_before(matrix: &Columns, reserve: usize) -> Vec<(usize, u32)> {
    let mut elimination = Elimination::new(matrix);
    for range in [0..reserve, reserve..matrix.columns.len()] {
        let mut open: Vec<usize> = range.collect();
        for least in LEAST_REST {
            if elimination.chosen.len() < matrix.rows {
                open.retain(|&k| !elimination.take(&matrix.columns[k], k, least));
            }
        }
    }
    elimination.chosen
}

/// Positions of linearly independent columns, the first in order as long as enough is left of them; a column is a list of
/// (row, value) with rows ascending.
pub fn independent(rows: usize, columns: Vec<Vec<(u32, f64)>>) -> Vec<usize> {
    independent_columns(&Columns { rows, columns }).into_iter().map(|chosen| chosen.0).collect()
}

struct Elimination {
    scale: Vec<f64>,
    /// Position in `chosen` of the column whose pivot a row is.
    pivot_of_row: Vec<Option<u32>>,
    chosen: Vec<(usize, u32)>,
    /// Multiples of the pivot row to subtract from other rows, for each chosen column.
    factors: Vec<Vec<(u32, f64)>>,
    work: Vec<f64>,
    touched: Vec<u32>,
    is_touched: Vec<bool>,
    queue: BinaryHeap<Reverse<u32>>,
}

impl Elimination {
    fn new(matrix: &Columns) -> Self {
        let mut scale = vec![0.0_f64; matrix.rows];
        for &(row, value) in matrix.columns.iter().flatten() {
            scale[row as usize] = scale[row as usize].max(value.abs());
        }
        for scale in &mut scale {
            *scale = if *scale > 0.0 { 1.0 / *scale } else { 0.0 };
        }
        Self {
            scale,
            pivot_of_row: vec![None; matrix.rows],
            chosen: Vec::new(),
            factors: Vec::new(),
            work: vec![0.0; matrix.rows],
            touched: Vec::new(),
            is_touched: vec![false; matrix.rows],
            queue: BinaryHeap::new(),
        }
    }

    /// Takes a column if it is independent of those taken before.
    fn take(&mut self, column: &[(u32, f64)], k: usize, least: f64) -> bool {
        let mut largest = 0.0_f64;
        for &(row, value) in column {
            let value = value * self.scale[row as usize];
            largest = largest.max(value.abs());
            self.add(row, value);
        }
        while let Some(Reverse(position)) = self.queue.pop() {
            let value = self.work[self.chosen[position as usize].1 as usize];
            let factors = std::mem::take(&mut self.factors[position as usize]);
            for &(row, factor) in &factors {
                self.add(row, -factor * value);
            }
            self.factors[position as usize] = factors;
        }
        self.touched.sort_unstable();
        let free = self.touched.iter().filter(|&&row| self.pivot_of_row[row as usize].is_none());
        let rest: Vec<(u32, f64)> = free.map(|&row| (row, self.work[row as usize])).collect();
        for row in self.touched.drain(..) {
            self.work[row as usize] = 0.0;
            self.is_touched[row as usize] = false;
        }
        let best = rest.iter().copied().fold((0, 0.0_f64), |a, b| if b.1.abs() > a.1.abs() { b } else { a });
        if largest == 0.0 || best.1.abs() < least * largest {
            return false;
        }
        self.pivot_of_row[best.0 as usize] = Some(self.chosen.len() as u32);
        self.chosen.push((k, best.0));
        let others = rest.into_iter().filter(|&(row, value)| row != best.0 && value != 0.0);
        self.factors.push(others.map(|(row, value)| (row, value / best.1)).collect());
        true
    }

    fn add(&mut self, row: u32, value: f64) {
        self.work[row as usize] += value;
        if !std::mem::replace(&mut self.is_touched[row as usize], true) {
            self.touched.push(row);
            if let Some(position) = self.pivot_of_row[row as usize] {
                self.queue.push(Reverse(position));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependent_and_nearly_dependent_columns_come_last() {
        // Columns a, 2a + tiny, b: the second is taken only if nothing better is there.
        let a = vec![(0, 1.0), (1, 1.0)];
        let nearly = vec![(0, 2.0), (1, 2.0 + 1e-6)];
        let b = vec![(1, 3.0)];
        let chosen = |columns: Vec<Vec<(u32, f64)>>| {
            let mut chosen: Vec<usize> =
                independent_columns(&Columns { rows: 2, columns }).into_iter().map(|(k, _)| k).collect();
            chosen.sort_unstable();
            chosen
        };
        assert_eq!(chosen(vec![a.clone(), nearly.clone(), b.clone()]), [0, 2]);
        assert_eq!(chosen(vec![a.clone(), nearly]), [0, 1]);
        assert_eq!(chosen(vec![a.clone(), a.clone()]), [0]);
        assert_eq!(chosen(vec![b.clone(), b.clone(), a.clone()]), [0, 2]);
        // A column in reserve gives way to one of which little is left.
        let columns = vec![a.clone(), vec![(0, 2.0), (1, 2.0 + 1e-6)], b];
        let chosen = independent_columns_before(&Columns { rows: 2, columns }, 2);
        assert_eq!(chosen.iter().map(|chosen| chosen.0).collect::<Vec<_>>(), [0, 1]);
    }

    #[test]
    fn a_chain_of_eliminations_is_followed() {
        // Bidiagonal rows: e_k = c_k - c_(k+1); the last column is the sum of what the others leave.
        let n = 6;
        let column = |k: u32| {
            let above = (k > 0).then(|| (k - 1, -1.0));
            let own = (k < n).then_some((k, 1.0));
            above.into_iter().chain(own).collect::<Vec<_>>()
        };
        let columns = (0..=n).map(column).collect();
        assert_eq!(independent_columns(&Columns { rows: n as usize, columns }).len(), n as usize);
        let closed = (0..n).map(column).chain([vec![(n - 1, -1.0)]]).collect();
        let chosen: Vec<usize> =
            independent_columns(&Columns { rows: n as usize, columns: closed }).iter().map(|c| c.0).collect();
        assert_eq!(chosen, [0, 1, 2, 3, 4, 5]);
    }
}

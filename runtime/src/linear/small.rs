//! Sparse LU for small systems: elimination along a list of operations that is made when pivots are chosen.
//!
//! Pivots are chosen on the scaled matrix ([`Pivoting`]).  From then on every matrix is eliminated along the same list
//! without search, without index work and without scaling: with given pivots scaling changes nothing but rounding, so
//! scales only serve to watch the pivots.  Where one has become too small the choice is made anew.  The smallest
//! matrices get an inverse ([`inverse`]) where corrections are asked for, larger ones that of what their first pivots
//! leave ([`Tail`]), and all factors only where solutions are asked for, too.  Larger systems that fill up are left to
//! [`super::dense`].

use std::ops::Range;

use hyd_system::{Pattern, wide};

use super::factor::{FactorError, PIVOT_FLOOR, idle_column, subtract};
use super::inverse;
use super::lower::Lower;
use super::pivot::Pivot;
use super::pivoting::Pivoting;
use super::tail::Tail;
use crate::tiled::{LANES, Tile};

/// A pivot smaller than this, relative to the largest candidate of its column, asks for a new choice.
const PIVOT_DRIFT: f64 = 1e-6;
/// With more operations than this part of those of a full matrix the list is slower than loops without indices.
const FULL: f64 = 0.35;
/// So many operations are always few.
const FEW: usize = 200;

impl Pivot {
    /// The same of a matrix in which it stands elsewhere.
    pub(super) fn at_place(&self, row: u32, column: u32) -> Self {
        Self { row, column, ..*self }
    }

    /// Places of its row of U.
    #[inline(always)]
    pub(super) fn upper_range(&self) -> Range<usize> {
        let first = self.at as usize + 1;
        first..first + self.upper as usize
    }

    /// Places of its column of L.
    #[inline(always)]
    pub(super) fn lower_range(&self) -> Range<usize> {
        let first = self.at as usize + 1 + self.upper as usize;
        first..first + self.lower as usize
    }
}

/// Factors of one matrix with the way to renew them.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct Small {
    n: usize,
    pivots: Vec<Pivot>,
    /// Factors, with each pivot as its inverse; before the elimination the matrix.
    values: Vec<f64>,
    /// Where each entry of the pattern goes, and its row and column.
    places: Vec<u32>,
    entry_columns: Vec<u32>,
    /// Column (in U) or row (in L) of each value.
    indices: Vec<u32>,
    /// What each product of an elimination step is subtracted from, step by step.
    targets: Vec<u32>,
    /// Largest scaled entry of each row.
    largest: Vec<f64>,
    work: Vec<f64>,
    tiles: Vec<Tile>,
    pivoting: Pivoting,
    chosen: bool,
    /// Pivots that have been eliminated; what follows in `values` is what they have left of the matrix.
    eliminated: usize,
    tail: Tail,
    lower: Lower,
    /// Corrections have been asked for: the last pivots of each matrix are inverted, and eliminated only where
    /// solutions are asked for, too.
    corrects: bool,
}

impl Small {
    /// Room for matrices with this pattern.
    pub(super) fn new(pattern: &Pattern) -> Self {
        let n = pattern.rows;
        let columns = (0..pattern.columns()).flat_map(|c| pattern.column(c).map(move |_| c as u32));
        Self {
            n,
            pivots: Vec::with_capacity(n),
            values: vec![0.0],
            places: vec![0; pattern.entries()],
            entry_columns: columns.collect(),
            indices: Vec::new(),
            targets: Vec::new(),
            largest: vec![0.0; n],
            work: vec![0.0; n],
            tiles: Vec::new(),
            pivoting: Pivoting::default(),
            chosen: false,
            eliminated: 0,
            tail: Tail::default(),
            lower: Lower::default(),
            corrects: false,
        }
    }

    /// Chooses pivots anew for the next matrix.
    pub(super) fn forget(&mut self) {
        (self.chosen, self.corrects) = (false, false);
    }

    /// The matrix fills up so much that loops without indices are faster.
    pub(super) fn is_full(&self) -> bool {
        let full = FULL * (self.n * self.n * self.n) as f64 / 3.0;
        self.n > inverse::LARGEST && self.chosen && self.targets.len() > FEW && self.targets.len() as f64 > full
    }

    /// Factors the matrix with `values` on `pattern`; `sizes` are those of the unknowns.
    pub(super) fn factor(&mut self, pattern: &Pattern, values: &[f64], sizes: &[f64]) -> Result<(), FactorError> {
        self.tail.forget();
        self.load(pattern, values, sizes)?;
        if self.chosen && self.renew(pattern, values) {
            return Ok(());
        }
        self.choose(pattern, values, sizes)?;
        self.load(pattern, values, sizes)?;
        if self.renew(pattern, values) {
            return Ok(());
        }
        let last = self.pivots.last().copied().unwrap_or_default();
        Err(FactorError::Singular { row: last.row as usize, column: last.column as usize })
    }

    /// Puts the entries into their places, and finds the largest of each row relative to the sizes of the unknowns.
    fn load(&mut self, pattern: &Pattern, values: &[f64], sizes: &[f64]) -> Result<(), FactorError> {
        self.eliminated = 0;
        self.largest.fill(0.0);
        self.values.fill(0.0);
        let mut sum = 0.0;
        let places = self.places.iter().zip(&self.entry_columns);
        for ((&value, &row), (&place, &column)) in values.iter().zip(&pattern.row_indices).zip(places) {
            let size = (value * sizes[column as usize]).abs();
            let largest = &mut self.largest[row as usize];
            *largest = if size > *largest { size } else { *largest };
            sum += size;
            self.values[place as usize] = value;
        }
        if sum.is_finite() { Ok(()) } else { self.blame(pattern, values) }
    }

    /// The first entry that is not finite.
    fn blame(&self, pattern: &Pattern, values: &[f64]) -> Result<(), FactorError> {
        match values.iter().position(|value| !value.is_finite()) {
            Some(k) => {
                let (row, column) = (pattern.row_indices[k] as usize, self.entry_columns[k] as usize);
                Err(FactorError::NotFinite { row, column })
            }
            None => Ok(()),
        }
    }

    /// Factors the matrix that was loaded, or inverts what its first pivots leave; false if a pivot has become too small.
    fn renew(&mut self, pattern: &Pattern, values: &[f64]) -> bool {
        if !self.corrects {
            return self.eliminate::<true>(self.n);
        }
        if self.tail.first == 0 {
            let places = pattern.row_indices.iter().zip(&self.entry_columns);
            let entries = places.zip(values).map(|((&row, &column), &value)| (row as usize, column as usize, value));
            return self.tail.invert_whole(entries, &self.pivots, &self.largest, PIVOT_DRIFT);
        }
        let first = self.tail.first;
        self.eliminate::<true>(first) && (first == self.n || self.tail.invert(&self.values, &self.largest, PIVOT_DRIFT))
    }

    /// Makes the factors, as far as that was left.
    fn complete(&mut self) {
        if self.eliminated < self.n {
            // Pivots have been found sound when the inverse was made.
            self.eliminate::<false>(self.n);
        }
    }

    /// Elimination along the list, up to a pivot; false if one has become too small, if that is watched.
    fn eliminate<const WATCHED: bool>(&mut self, end: usize) -> bool {
        let pivots = &self.pivots[self.eliminated..end];
        let mut targets = pivots.first().map_or(&[][..], |first| &self.targets[first.targets as usize..]);
        for pivot in pivots {
            let (at, upper, lower) = (pivot.at as usize, pivot.upper as usize, pivot.lower as usize);
            let (own, rest) = self.values[at..].split_at_mut(1 + upper + lower);
            let (own_row, own_column) = own.split_at_mut(1 + upper);
            let value = own_row[0];
            let scale = self.largest[pivot.row as usize];
            // Not a number fails too.
            let sound = value.abs() > pivot.floor * scale;
            if WATCHED && !sound {
                return false;
            }
            let inverse = value.recip();
            own_row[0] = inverse;
            let rows = &self.indices[at + 1 + upper..at + 1 + upper + lower];
            for (factor, &row) in own_column.iter_mut().zip(rows) {
                *factor *= inverse;
                let sound = PIVOT_DRIFT * (*factor * scale).abs() < self.largest[row as usize];
                if WATCHED && !sound {
                    return false;
                }
                let (here, later) = targets.split_at(upper);
                targets = later;
                for (&target, entry) in here.iter().zip(&own_row[1..]) {
                    rest[target as usize] -= *factor * entry;
                }
            }
        }
        self.eliminated = end;
        true
    }

    /// Chooses pivots for this matrix and lists the elimination.
    fn choose(&mut self, pattern: &Pattern, values: &[f64], sizes: &[f64]) -> Result<(), FactorError> {
        let n = self.n;
        self.chosen = false;
        if let Some(row) = self.largest.iter().position(|&largest| largest == 0.0) {
            return Err(FactorError::Singular { row, column: idle_column(pattern, values, row) });
        }
        self.pivoting.begin(n);
        for ((&value, &row), &column) in values.iter().zip(&pattern.row_indices).zip(&self.entry_columns) {
            let (row, column) = (row as usize, column as usize);
            self.pivoting.set(row, column, value * sizes[column] / self.largest[row]);
        }
        self.pivots.clear();
        while let Some((row, column, pivot)) = self.pivoting.next()? {
            // A column of small entries throughout is no reason to choose again and again.
            let floor = PIVOT_FLOOR * pivot.abs().min(1.0) / sizes[column];
            self.pivots.push(Pivot { row: row as u32, column: column as u32, floor, ..Pivot::default() });
        }
        self.list(pattern);
        self.tail.choose(pattern, &self.pivots, &self.indices);
        let first = if self.tail.first < n { self.tail.first } else { 0 };
        self.lower.choose(&self.pivots, first, &self.indices);
        self.chosen = true;
        Ok(())
    }

    /// Lists the elimination: places of the factors, and what each product is subtracted from.
    fn list(&mut self, pattern: &Pattern) {
        let n = self.n;
        let mut place = vec![u32::MAX; n * n];
        let (mut row_done, mut column_done) = (vec![false; n], vec![false; n]);
        self.indices.clear();
        for pivot in &mut self.pivots {
            let (row, column) = (pivot.row as usize, pivot.column as usize);
            (row_done[row], column_done[column]) = (true, true);
            pivot.at = self.indices.len() as u32;
            place[row * n + column] = pivot.at;
            self.indices.push(pivot.column);
            for c in (0..n).filter(|&c| !column_done[c] && self.pivoting.is_filled(row, c)) {
                place[row * n + c] = self.indices.len() as u32;
                self.indices.push(c as u32);
            }
            pivot.upper = self.indices.len() as u32 - pivot.at - 1;
            for r in (0..n).filter(|&r| !row_done[r] && self.pivoting.is_filled(r, column)) {
                place[r * n + column] = self.indices.len() as u32;
                self.indices.push(r as u32);
            }
            pivot.lower = self.indices.len() as u32 - pivot.at - 1 - pivot.upper;
        }
        self.values.clear();
        self.values.resize(self.indices.len(), 0.0);
        for ((to, &row), &column) in self.places.iter_mut().zip(&pattern.row_indices).zip(&self.entry_columns) {
            *to = place[row as usize * n + column as usize];
        }
        self.targets.clear();
        for pivot in &mut self.pivots {
            pivot.targets = self.targets.len() as u32;
            let (first, upper) = (pivot.at as usize + 1, pivot.upper as usize);
            let behind = (first + upper + pivot.lower as usize) as u32;
            for &row in &self.indices[first + upper..behind as usize] {
                let row = row as usize * n;
                self.targets
                    .extend(self.indices[first..first + upper].iter().map(|&c| place[row + c as usize] - behind));
            }
        }
    }

    /// Inverse of the largest entry of row `k`.
    pub(super) fn row_scale(&self, k: usize) -> f64 {
        self.largest[k].recip()
    }

    /// Replaces `b` by the solution.
    pub(super) fn solve(&mut self, b: &mut [f64]) {
        self.complete();
        forward(&self.pivots, (&self.indices, &self.values), b);
        backward(&self.pivots, (&self.indices, &self.values), b, &mut self.work);
        b.copy_from_slice(&self.work);
    }

    /// `x := A^{-1} b` with the inverse of what the first pivots leave; false if there is none.
    #[inline(always)]
    pub(super) fn correct(&mut self, b: &[f64], x: &mut [Tile]) -> bool {
        self.corrects = true;
        if !self.tail.is_made() {
            return false;
        }
        if self.tail.first == 0 {
            self.tail.apply(b, x);
        } else {
            self.correct_in_part(b, x.as_flattened_mut());
        }
        true
    }

    #[inline(always)]
    fn correct_in_part(&mut self, b: &[f64], x: &mut [f64]) {
        let (pivots, factors) = (&self.pivots[..self.tail.first], (&*self.indices, &*self.values));
        self.work.copy_from_slice(b);
        self.lower.subtract(&self.values, &mut self.work);
        self.tail.apply_within(&self.work, x);
        backward(pivots, factors, &self.work, x);
    }

    /// The same for several right-hand sides: `count` tiles per unknown.
    pub(super) fn solve_tiles(&mut self, b: &mut Vec<Tile>, count: usize) {
        self.complete();
        self.tiles.resize(self.n * count, [0.0; LANES]);
        let mut own = std::mem::take(&mut self.tiles);
        // Sums stay in registers where their number is known.
        wide(
            #[inline(always)]
            || match count {
                1 => self.solve_blocks(b.as_chunks_mut::<1>().0, own.as_chunks_mut().0),
                2 => self.solve_blocks(b.as_chunks_mut::<2>().0, own.as_chunks_mut().0),
                3 => self.solve_blocks(b.as_chunks_mut::<3>().0, own.as_chunks_mut().0),
                _ => self.solve_wide(b, &mut own, count),
            },
        );
        self.tiles = std::mem::replace(b, own);
    }

    #[inline(always)]
    fn solve_blocks<const T: usize>(&self, b: &mut [[Tile; T]], x: &mut [[Tile; T]]) {
        for pivot in &self.pivots {
            let first = (pivot.at + 1 + pivot.upper) as usize;
            let range = first..first + pivot.lower as usize;
            let value = b[pivot.row as usize];
            for (&row, &factor) in self.indices[range.clone()].iter().zip(&self.values[range]) {
                subtract(&mut b[row as usize], factor, &value);
            }
        }
        for pivot in self.pivots.iter().rev() {
            let at = pivot.at as usize;
            let range = at + 1..at + 1 + pivot.upper as usize;
            let mut sum = b[pivot.row as usize];
            for (&column, &factor) in self.indices[range.clone()].iter().zip(&self.values[range]) {
                subtract(&mut sum, factor, &x[column as usize]);
            }
            let inverse = self.values[at];
            // Loops become vector instructions, nested maps of arrays do not.
            for sum in sum.as_flattened_mut() {
                *sum *= inverse;
            }
            x[pivot.column as usize] = sum;
        }
    }

    #[inline(always)]
    fn solve_wide(&self, b: &mut [Tile], own: &mut [Tile], count: usize) {
        let block = |k: u32| k as usize * count..(k as usize + 1) * count;
        for pivot in &self.pivots {
            let first = (pivot.at + 1 + pivot.upper) as usize;
            let range = first..first + pivot.lower as usize;
            if range.is_empty() {
                continue;
            }
            own[..count].copy_from_slice(&b[block(pivot.row)]);
            for (&row, &factor) in self.indices[range.clone()].iter().zip(&self.values[range]) {
                subtract(&mut b[block(row)], factor, &own[..count]);
            }
        }
        for pivot in self.pivots.iter().rev() {
            let at = pivot.at as usize;
            let range = at + 1..at + 1 + pivot.upper as usize;
            let sum = &mut b[block(pivot.row)];
            for (&column, &factor) in self.indices[range.clone()].iter().zip(&self.values[range]) {
                subtract(sum, factor, &own[block(column)]);
            }
            let inverse = self.values[at];
            for (value, sum) in own[block(pivot.column)].iter_mut().zip(sum) {
                for lane in 0..LANES {
                    value[lane] = sum[lane] * inverse;
                }
            }
        }
    }
}

/// Takes the columns of L of these pivots from `b`.
#[inline(always)]
fn forward(pivots: &[Pivot], (indices, values): (&[u32], &[f64]), b: &mut [f64]) {
    for pivot in pivots {
        let value = b[pivot.row as usize];
        for (&row, factor) in indices[pivot.lower_range()].iter().zip(&values[pivot.lower_range()]) {
            b[row as usize] -= factor * value;
        }
    }
}

/// Solves the rows of U of these pivots for their unknowns; those of later pivots are known.
#[inline(always)]
fn backward(pivots: &[Pivot], (indices, values): (&[u32], &[f64]), b: &[f64], x: &mut [f64]) {
    for pivot in pivots.iter().rev() {
        let mut value = b[pivot.row as usize];
        for (&column, factor) in indices[pivot.upper_range()].iter().zip(&values[pivot.upper_range()]) {
            value -= factor * x[column as usize];
        }
        x[pivot.column as usize] = value * values[pivot.at as usize];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_change_by_rows_as_they_do_by_columns() {
        for n in [3, 17, 23, 40] {
            // A band and three full rows and columns at the end.
            let number = |k: usize| ((k * k * 7919 + k * 31) % 1009) as f64 / 500.0 - 1.0;
            let has = |row: usize, column: usize| row.abs_diff(column) < 2 || row + 3 >= n || column + 3 >= n;
            let pairs: Vec<(u32, u32)> = (0..n as u32)
                .flat_map(|column| (0..n as u32).map(move |row| (row, column)))
                .filter(|&(row, column)| has(row as usize, column as usize))
                .collect();
            let pattern = Pattern::from_pairs(n, n, &pairs);
            let value = |&(row, column): &(u32, u32)| {
                number((row * 41 + column) as usize) + if row == column { 4.0 } else { 0.0 }
            };
            let values: Vec<f64> = pairs.iter().map(value).collect();
            let mut small = Small::new(&pattern);
            small.factor(&pattern, &values, &vec![1.0; n]).expect("it has pivots");
            for first in 0..=n {
                let mut by_columns: Vec<f64> = (0..n).map(number).collect();
                let mut by_rows = by_columns.clone();
                forward(&small.pivots[..first], (&small.indices, &small.values), &mut by_columns);
                small.lower.choose(&small.pivots, first, &small.indices);
                small.lower.subtract(&small.values, &mut by_rows);
                let bits = |b: &[f64]| b.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&by_rows), bits(&by_columns), "{first} of {n} pivots");
            }
        }
    }
}

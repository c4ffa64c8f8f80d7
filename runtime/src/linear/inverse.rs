//! The inverse of a small matrix, for corrections that need few digits.
//!
//! Substitution in triangular factors is a chain in which each unknown waits for the one before; a product with the
//! inverse is a handful of sums that do not wait for each other.  The inverse is made by Gauss-Jordan elimination in
//! place with pivots that were chosen before.  Its product has an error of a few roundings times the condition of the
//! matrix (Higham, "Accuracy and Stability of Numerical Algorithms", SIAM 2002, sections 14.1 and 14.4): nothing to an
//! iteration that is content with a tenth, too much for values that must be exact.

use hyd_system::wide;

use super::pivot::Pivot;
use crate::tiled::{LANES, Tile};

/// Matrices of more rows have no inverse here: it takes longer to make than products save, and zeros of the factors are
/// worth more (15 unknowns of few matrices take a quarter less with it, 20 and 23 up to a quarter more).
pub(super) const LARGEST: usize = 4 * LANES;

/// An inverse, column by column.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Inverse {
    /// Tiles of a column; 0 before one is made.
    width: usize,
    columns: Vec<Tile>,
    /// The matrix row by row, while it is made the inverse.
    rows: Vec<Tile>,
}

impl Inverse {
    /// True if there is one.
    #[inline(always)]
    pub(super) fn is_made(&self) -> bool {
        self.width > 0
    }

    /// The matrix has changed.
    pub(super) fn forget(&mut self) {
        self.width = 0;
    }

    /// Makes the inverse of an `n` by `n` matrix of these entries (row, column, value) with these pivots.  False, and none is made, if
    /// a pivot is not above its floor, or less than the part `drift` of an entry below it; `largest` is the size of each row.
    pub(super) fn make(
        &mut self,
        n: usize,
        entries: impl Iterator<Item = (usize, usize, f64)>,
        pivots: &[Pivot],
        largest: impl Fn(usize) -> f64,
        drift: f64,
    ) -> bool {
        let width = n.div_ceil(LANES);
        self.rows.clear();
        self.rows.resize(n * width, [0.0; LANES]);
        let all = self.rows.as_flattened_mut();
        for (row, column, value) in entries {
            all[row * width * LANES + column] = value;
        }
        self.columns.resize(n * width, [0.0; LANES]);
        let (rows, columns) = (&mut self.rows, &mut self.columns);
        let is_made = wide(
            #[inline(always)]
            || match width {
                1 => invert::<1>(rows, columns, pivots, largest, drift),
                2 => invert::<2>(rows, columns, pivots, largest, drift),
                3 => invert::<3>(rows, columns, pivots, largest, drift),
                _ => invert::<4>(rows, columns, pivots, largest, drift),
            },
        );
        self.width = if is_made { width } else { 0 };
        is_made
    }

    /// `x := A^{-1} b`; `x` is in tiles, the last of which is filled up with zeros.
    #[inline(always)]
    pub(super) fn apply(&self, b: &[f64], x: &mut [Tile]) {
        match self.width {
            1 => self.product::<1>(b, x),
            2 => self.product::<2>(b, x),
            3 => self.product::<3>(b, x),
            _ => self.product::<4>(b, x),
        }
    }

    #[inline(always)]
    fn product<const T: usize>(&self, b: &[f64], x: &mut [Tile]) {
        // Two sums each, so that additions need not wait for each other.
        let (mut even, mut odd) = ([[0.0; LANES]; T], [[0.0; LANES]; T]);
        let (columns, last) = self.columns.as_chunks::<T>().0.as_chunks::<2>();
        let (values, value) = b.as_chunks::<2>();
        for ([first, second], [a, b]) in columns.iter().zip(values) {
            add_multiple(&mut even, first, *a);
            add_multiple(&mut odd, second, *b);
        }
        if let ([column], [value]) = (last, value) {
            add_multiple(&mut even, column, *value);
        }
        for (x, (even, odd)) in x.iter_mut().zip(even.iter().zip(&odd)) {
            for lane in 0..LANES {
                x[lane] = even[lane] + odd[lane];
            }
        }
    }
}

/// `sum += value column`
#[inline(always)]
fn add_multiple<const T: usize>(sum: &mut [Tile; T], column: &[Tile; T], value: f64) {
    for (sum, entry) in sum.iter_mut().zip(column) {
        for lane in 0..LANES {
            sum[lane] += entry[lane] * value;
        }
    }
}

/// The columns of the inverse of a matrix that is given row by row.
#[inline(always)]
fn invert<const T: usize>(
    rows: &mut [Tile],
    columns: &mut [Tile],
    pivots: &[Pivot],
    largest: impl Fn(usize) -> f64,
    drift: f64,
) -> bool {
    if !eliminate::<T>(rows, pivots, largest, drift) {
        return false;
    }
    // What stands at (row k, column l) of the pivots is that of (column k, row l) of the inverse.
    let (rows, columns) = (rows.as_chunks::<T>().0, columns.as_chunks_mut::<T>().0);
    for own in pivots {
        let (made, to) = (rows[own.row as usize].as_flattened(), own.column as usize);
        for other in pivots {
            columns[other.row as usize].as_flattened_mut()[to] = made[other.column as usize];
        }
    }
    true
}

/// Gauss-Jordan elimination in place.
#[inline(always)]
fn eliminate<const T: usize>(rows: &mut [Tile], pivots: &[Pivot], largest: impl Fn(usize) -> f64, drift: f64) -> bool {
    let rows = rows.as_chunks_mut::<T>().0;
    let mut is_done = [false; LARGEST];
    for pivot in pivots {
        let (row, column) = (pivot.row as usize, pivot.column as usize);
        // Numbers are masked, not replaced one by one: a vector is not read where a number was just written.
        let unit: [Tile; T] =
            std::array::from_fn(|k| std::array::from_fn(|lane| if k * LANES + lane == column { 1.0 } else { 0.0 }));
        let kept = unit.map(|unit| unit.map(|one| 1.0 - one));
        let mut own = rows[row];
        let value = own[column / LANES][column % LANES];
        let scale = largest(row);
        // Not a number fails too.
        let sound = value.abs() > pivot.floor * scale;
        if !sound {
            return false;
        }
        is_done[row] = true;
        let inverse = value.recip();
        for (own, (kept, unit)) in own.iter_mut().zip(kept.iter().zip(&unit)) {
            for lane in 0..LANES {
                own[lane] = (own[lane] * kept[lane] + unit[lane]) * inverse;
            }
        }
        for (at, other) in rows.iter_mut().enumerate() {
            let factor = other[column / LANES][column % LANES];
            if factor == 0.0 {
                continue;
            }
            let sound = is_done[at] || drift * (factor * inverse * scale).abs() < largest(at);
            if !sound {
                return false;
            }
            for (other, (kept, own)) in other.iter_mut().zip(kept.iter().zip(&own)) {
                for lane in 0..LANES {
                    other[lane] = other[lane] * kept[lane] - factor * own[lane];
                }
            }
        }
        rows[row] = own;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::{Inverse, LARGEST, Pivot};
    use crate::tiled::Tiled;
    use proptest::prelude::*;

    proptest! {
        /// A permuted matrix with a strong entry in each row and column: its product with the solution gives back the
        /// right-hand side.
        #[test]
        fn products_solve_the_system(n in 1..=LARGEST, turn in 0..LARGEST, seed in prop::collection::vec(-1.0f64..1.0, LARGEST * LARGEST + LARGEST)) {
            let pivot = |row: usize| (row, (row + turn) % n);
            let entry = |row: usize, column: usize| {
                let size = 10f64.powi((row % 5) as i32 - (column % 3) as i32);
                size * (seed[row * LARGEST + column] + if pivot(row).1 == column { 2.0 * n as f64 } else { 0.0 })
            };
            let entries = (0..n).flat_map(|row| (0..n).map(move |column| (row, column)));
            let mut inverse = Inverse::default();
            let entries = entries.map(|(row, column)| (row, column, entry(row, column)));
            let pivots = (0..n).map(pivot).map(|(row, column)| {
                let mut pivot = Pivot::default();
                (pivot.row, pivot.column) = (row as u32, column as u32);
                pivot
            });
            let pivots: Vec<Pivot> = pivots.collect();
            assert!(inverse.make(n, entries, &pivots, |_| 1.0, 1e-12));
            let b = &seed[LARGEST * LARGEST..][..n];
            let mut x = Tiled::zeros(n);
            inverse.apply(b, x.tiles_mut());
            for (row, b) in b.iter().enumerate() {
                let terms: Vec<f64> = (0..n).map(|column| entry(row, column) * x[column]).collect();
                let size = terms.iter().fold(b.abs(), |size, term| size.max(term.abs()));
                prop_assert!((terms.iter().sum::<f64>() - b).abs() <= 1e-13 * size, "row {row}");
            }
            prop_assert!(x.tiles().as_flattened()[n..].iter().all(|&filling| filling == 0.0));
        }
    }
}

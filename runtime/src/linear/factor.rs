//! What the ways to factor a matrix share: when a pivot counts as zero, what makes a matrix singular, one step of a substitution.

use hyd_system::Pattern;

use crate::tiled::{LANES, Tile};

/// A pivot below this, relative to the largest entry of its scaled column, counts as zero.
pub(super) const PIVOT_FLOOR: f64 = 4.0 * f64::EPSILON;

/// Why a matrix cannot be factored.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum FactorError {
    /// Unknown `column` is not determined; `row` is the equation left without a pivot for it.
    Singular {
        /// Row without pivot.
        row: usize,
        /// Column without pivot.
        column: usize,
    },
    /// An entry is not finite.
    NotFinite {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
    },
}

/// For an empty row: a column that is empty too, else the column the pattern has in that row, else the row's number.
pub(super) fn idle_column(pattern: &Pattern, values: &[f64], row: usize) -> usize {
    let columns = 0..pattern.columns();
    let empty = columns.clone().find(|&c| pattern.column(c).all(|e| values[e] == 0.0));
    let touching = || columns.clone().find(|&c| pattern.column(c).any(|e| pattern.row_indices[e] as usize == row));
    empty.or_else(touching).unwrap_or(row)
}

/// `b -= factor * x`
#[inline(always)]
pub(crate) fn subtract(b: &mut [Tile], factor: f64, x: &[Tile]) {
    for (b, x) in b.iter_mut().zip(x) {
        for lane in 0..LANES {
            b[lane] -= factor * x[lane];
        }
    }
}

//! Equations that are about to determine an unknown no longer: the singular vectors of the matrix that solves them.
//!
//! Where two solutions meet (a fold) or a coefficient vanishes, the matrix `[F_x' F_z]`, which the rates of the states and all other
//! unknowns are solved with, loses its rank.  Its smallest singular value then shrinks on the way; the right singular vector
//! says which unknown is lost, the left one which equation loses it (Golub, Van Loan, "Matrix Computations", section 2.4).  Looked at
//! once, when a run has failed.

use hyd_system::{DaeSystem, EquationInfo};
use nalgebra::DMatrix;

use crate::linearize::{OperatingPoint, local_matrices};

/// Larger systems are not looked at: the matrix is full.
const MOST_UNKNOWNS: usize = 150;
/// The smallest singular value vanishes when it is this part of what it was at the start.
const SMALL: f64 = 1e-2;

/// An unknown that is determined ever less.
#[derive(Clone, PartialEq, Debug)]
pub struct Vanishing {
    /// The unknown.
    pub variable: String,
    /// The equation that no longer determines it, if it is known.
    pub equation: Option<EquationInfo>,
    /// Smallest singular values at the start and at the end, of equations and unknowns in their own sizes.
    pub before: f64,
    /// See `before`.
    pub now: f64,
}

impl Vanishing {
    /// What vanishes on the way from one point to another; `None` if nothing does, or the system is too large or has delays.
    pub(crate) fn new(
        system: &mut dyn DaeSystem,
        from: OperatingPoint<'_>,
        to: OperatingPoint<'_>,
        nominals: &[f64],
    ) -> Option<Self> {
        if to.y.len() > MOST_UNKNOWNS || to.y.is_empty() {
            return None;
        }
        let size = |k: usize| nominals.get(k).copied().filter(|size| *size > 0.0).unwrap_or(1.0);
        // Each equation in the size that it has at the start, so that what shrinks is not scaled away.
        let mut before = local_matrices(system, from)?.0;
        let mut now = local_matrices(system, to)?.0;
        for k in 0..before.ncols() {
            before.column_mut(k).scale_mut(size(k));
            now.column_mut(k).scale_mut(size(k));
        }
        for row in 0..before.nrows() {
            let size = before.row(row).amax();
            if size > 0.0 {
                before.row_mut(row).scale_mut(1.0 / size);
                now.row_mut(row).scale_mut(1.0 / size);
            }
        }
        let (least_before, ..) = smallest(before)?;
        let (least_now, row, column) = smallest(now)?;
        let name = system.tables().unknown_name(column);
        let equation = system.tables().row_equation(row).cloned();
        (least_now <= SMALL * least_before).then_some(Self {
            variable: name,
            equation,
            before: least_before,
            now: least_now,
        })
    }
}

/// The smallest singular value, with the row that weighs most in its vectors and, of the columns in that row, the one that does; a rate that
/// only follows what is lost may weigh more.
fn smallest(matrix: DMatrix<f64>) -> Option<(f64, usize, usize)> {
    let (n, entries) = (matrix.ncols(), matrix.clone());
    let parts = matrix.try_svd(true, true, f64::EPSILON, 10_000)?;
    let (left, right) = (parts.u.as_ref()?, parts.v_t.as_ref()?);
    let values = parts.singular_values.iter().copied().enumerate();
    let (place, value) = values.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let row = (0..n).max_by(|&a, &b| left[(a, place)].abs().total_cmp(&left[(b, place)].abs()))?;
    let column = (0..n).filter(|&k| entries[(row, k)] != 0.0);
    let column = column.max_by(|&a, &b| right[(place, a)].abs().total_cmp(&right[(place, b)].abs()))?;
    Some((value, row, column))
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::smallest;

    #[test]
    fn the_row_and_column_that_vanish_are_found() {
        let matrix = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.2, 0.0, 1e-9, 0.0, 0.0, 0.0, 2.0]);
        let (value, row, column) = smallest(matrix).expect("a regular matrix");
        assert!((value - 1e-9).abs() < 1e-15, "{value}");
        assert_eq!((row, column), (1, 1));
        // The third unknown follows the second a million times as fast, and stands in another equation.
        let matrix = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, 1e-9, 0.0, 0.0, -1e6, 1.0]);
        let (_, row, column) = smallest(matrix).expect("a regular matrix");
        assert_eq!((row, column), (1, 1));
    }
}

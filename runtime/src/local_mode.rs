//! The motion behind steps that collapse: the eigenvalue of the local linear model in which the unknown at fault takes part, who
//! else takes part in it, and what that says of the steps.
//!
//! With states `x` the equations near a point are `dx' = A dx` (see `linearize`).  A state `k` takes part in the eigenvalue
//! `e` by `|w_k v_k| / sum |w_i v_i|` with its right and left eigenvectors `v` and `w` (participation factors: Perez-Arriaga, Verghese, Schweppe
//! 1982, "Selective modal analysis with applications to electric power systems"), found by inverse iteration (Golub, Van Loan,
//! "Matrix Computations", section 7.6.1).  Looked at once, when a run has failed.

use hyd_system::{DaeSystem, math};
use nalgebra::{Complex, DMatrix, DVector};

use crate::linearize::{OperatingPoint, eigenvalues, local_matrices, solve};

/// Larger systems are not looked at: the eigenvalues are those of a full matrix.
const MOST_UNKNOWNS: usize = 400;
/// Eigenvalues that are asked who takes part in them, the largest first.
const MOST_ASKED: usize = 8;
/// The unknown at fault takes part in an eigenvalue from this share on.
const TAKES_PART: f64 = 0.1;
/// Variables with a smaller share are not listed, and not more than so many.
const SMALLEST_LISTED: f64 = 0.05;
const MOST_LISTED: usize = 4;
/// Where the eigenvalue is moved to, relative to its size, so that its matrix can be inverted.
const MOVED: f64 = 1e-9;

/// An eigenvalue and those who take part in it.
#[derive(Clone, PartialEq, Debug)]
pub struct LocalMode {
    /// Real and imaginary part (1/s).
    pub eigenvalue: (f64, f64),
    /// States that take part in it, with their shares, which sum up to at most 1; the largest first.
    pub shares: Vec<(String, f64)>,
    /// Absolute values of the largest eigenvalue and of the smallest that is not zero (1/s).
    pub fastest: f64,
    /// See `fastest`.
    pub slowest: f64,
    /// Number of states.
    pub states: usize,
}

impl LocalMode {
    /// The eigenvalue behind a failure at a point, `unknown` being at fault.  `nominals` are the sizes of the unknowns.  `None` for systems
    /// without states, with delays, too large, or whose derivatives are not finite there.
    pub(crate) fn new(
        system: &mut dyn DaeSystem,
        point: OperatingPoint<'_>,
        nominals: &[f64],
        unknown: Option<usize>,
    ) -> Option<Self> {
        if point.y.len() > MOST_UNKNOWNS {
            return None;
        }
        let (matrix, right, states) = local_matrices(system, point)?;
        let solution = solve(system, matrix, right).ok()?;
        let n = states.len();
        let size = |k: usize| nominals.get(states[k] as usize).copied().filter(|size| *size > 0.0).unwrap_or(1.0);
        // Similar to `A`, so that units decide nothing.
        let a =
            DMatrix::from_fn(n, n, |row, column| solution[(states[row] as usize, column)] * size(column) / size(row));
        if n == 0 || !a.iter().all(|value| value.is_finite()) {
            return None;
        }
        let rows: Vec<Vec<f64>> = a.row_iter().map(|row| row.iter().copied().collect()).collect();
        let of_size = |(re, im): (f64, f64)| math::hypot(re, im);
        let mut candidates: Vec<(f64, f64)> = eigenvalues(&rows)?.into_iter().filter(|own| own.1 >= 0.0).collect();
        candidates.sort_by(|a, b| of_size(*b).total_cmp(&of_size(*a)));
        let sizes = candidates.iter().map(|own| of_size(*own));
        let slowest = sizes.filter(|size| *size > 0.0).fold(f64::INFINITY, f64::min);
        let fastest = candidates.first().map(|own| of_size(*own)).filter(|size| *size > 0.0)?;
        let own = unknown.and_then(|unknown| states.iter().position(|&state| state as usize == unknown));
        let asked = candidates.iter().take(MOST_ASKED).map(|&eigenvalue| (eigenvalue, participation(&a, eigenvalue)));
        let mut asked = asked.filter_map(|(eigenvalue, shares)| Some((eigenvalue, shares?))).peekable();
        let first = asked.peek().cloned();
        let (eigenvalue, shares) = match own {
            Some(own) => asked.find(|(_, shares)| shares[own] >= TAKES_PART).or(first),
            None => first,
        }?;
        let mut listed: Vec<(usize, f64)> =
            shares.into_iter().enumerate().filter(|(_, share)| *share >= SMALLEST_LISTED).collect();
        listed.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        listed.truncate(MOST_LISTED);
        let name = |k: usize| system.tables().unknown_name(states[k] as usize);
        let shares = listed.into_iter().map(|(k, share)| (name(k), share)).collect();
        Some(Self { eigenvalue, shares, fastest, slowest, states: n })
    }
}

/// Shares of the states in an eigenvalue of `a`; `None` if the iteration for its vectors fails.
fn participation(a: &DMatrix<f64>, (re, im): (f64, f64)) -> Option<Vec<f64>> {
    let n = a.nrows();
    let moved = Complex::new(re, im) + Complex::new(1.0, 0.7) * (MOVED * math::hypot(re, im).max(f64::MIN_POSITIVE));
    let shifted = DMatrix::from_fn(n, n, |row, column| {
        let own = Complex::new(a[(row, column)], 0.0);
        if row == column { own - moved } else { own }
    });
    let vector = |matrix: DMatrix<Complex<f64>>| {
        let factors = matrix.lu();
        // No eigenvector of a model is at right angles to this one but by chance.
        let mut vector = DVector::from_fn(n, |k, _| Complex::new(1.0 + 0.3 * math::sin(k as f64 * 1.7), 0.1));
        for _ in 0..3 {
            vector = factors.solve(&vector)?;
            let size = vector.iter().map(|value| value.norm()).fold(0.0, f64::max);
            if !(size > 0.0 && size.is_finite()) {
                return None;
            }
            vector.iter_mut().for_each(|value| *value /= Complex::new(size, 0.0));
        }
        Some(vector)
    };
    let (left, right) = (vector(shifted.transpose())?, vector(shifted)?);
    let products: Vec<f64> = (0..n).map(|k| (left[k] * right[k]).norm()).collect();
    let all: f64 = products.iter().sum();
    (all > 0.0 && all.is_finite()).then(|| products.iter().map(|product| product / all).collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::participation;

    /// A chain that leads one way: each eigenvalue belongs to one state, however strongly they are coupled.
    #[test]
    fn states_in_a_chain_have_an_eigenvalue_each() {
        let a = DMatrix::from_row_slice(3, 3, &[-1.0, 0.0, 0.0, 50.0, -10.0, 0.0, 0.0, 70.0, -1000.0]);
        for (k, eigenvalue) in [-1.0, -10.0, -1000.0].into_iter().enumerate() {
            let shares = participation(&a, (eigenvalue, 0.0)).expect("an eigenvector");
            assert!((shares[k] - 1.0).abs() < 1e-6, "{eigenvalue}: {shares:?}");
        }
    }

    /// An oscillator shares its eigenvalue evenly between position and speed.
    #[test]
    fn both_states_of_an_oscillator_take_part_alike() {
        let a = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, -4.0, 0.0, 0.0, 0.0, 0.0, -3.0]);
        let shares = participation(&a, (0.0, 2.0)).expect("an eigenvector");
        assert!((shares[0] - 0.5).abs() < 1e-6 && (shares[1] - 0.5).abs() < 1e-6 && shares[2] < 1e-6, "{shares:?}");
    }
}

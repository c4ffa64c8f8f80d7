//! The corrector of a step: solves `F(t, y_pred + e, y'_pred + c e) = 0` for `e` by a modified Newton method.
//!
//! The iteration matrix `J = dF/dy + c dF/dy'` is kept over steps while `c` changes little; corrections with an old `c` are scaled
//! by `2 / (1 + c/c_J)`.  The rate of convergence `rho` is estimated from successive corrections and carried over
//! steps, so that one iteration suffices when it is known to be small: converged when `rho/(1-rho) |d| <= epsilon`.
//! Sources: Brenan, Campbell, Petzold 1996, section 5.2.3; Hindmarsh et al., ACM TOMS 31 (2005) 363, section 2.3.
//! Outcomes other than convergence are for the step to handle (renew the matrix, shorten the step).

use std::ops::RangeInclusive;

use hyd_system::Structure;
use hyd_system::math::pow;

use crate::linear::{FactorError, IterationMatrix};
use crate::problem::Problem;
use crate::tiled::{LANES, Tiled, over_tiles, sum};
use crate::weights::{Weights, largest};

/// Most iterations of one correction.
const MOST_ITERATIONS: usize = 4;
/// The same with the matrix of the very point, instead of which there is nothing but a shorter step.
const MOST_WITH_FRESH_MATRIX: usize = 8;
/// Accepted error of the iteration, as a part of the error that the error test accepts.
const EPSILON: f64 = 0.1;
/// A correction this small relative to `EPSILON` ends the iteration whatever the rate.
const TINY: f64 = 1e-4;
/// Convergence slower than this counts as none.
const SLOWEST: f64 = 0.9;
/// Part of the tolerance by which unknowns are moved where the prediction has no finite slope.
const BESIDE: f64 = 1e-3;
/// `rho/(1-rho)` assumed after a renewal and after a change of `c`.
const RATE_AFTER_RENEWAL: f64 = 20.0;
const RATE_AFTER_CHANGE: f64 = 100.0;

/// What came of a correction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Correction {
    Converged,
    Diverged,
    NotFinite,
    /// The derivative of equation `row` with respect to unknown `column` is not finite.
    SlopeNotFinite {
        row: usize,
        column: usize,
    },
    Singular {
        row: usize,
        column: usize,
    },
}

/// Where the step leads: time, leading coefficient and the predicted values.
pub(crate) struct Prediction<'a> {
    pub(crate) t: f64,
    pub(crate) leading: f64,
    pub(crate) y: &'a Tiled,
    pub(crate) yp: &'a Tiled,
}

/// Iteration matrix and the vectors of the iteration.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Corrector {
    matrix: IterationMatrix,
    leading_range: RangeInclusive<f64>,
    /// Corrected values.
    pub(crate) y: Tiled,
    pub(crate) yp: Tiled,
    /// Sum of all corrections, `y - y_pred`.
    pub(crate) correction: Tiled,
    residual: Tiled,
    /// Last iterate's change.
    delta: Tiled,
    /// `c` in the factored matrix, and of the last correction.
    factored_leading: f64,
    last_leading: f64,
    /// `rho/(1-rho)`.
    rate: f64,
    have_matrix: bool,
    /// Row and column without a pivot, where the matrix has not full rank.
    lacking: (usize, usize),
}

impl Corrector {
    /// A matrix with leading coefficient `c_J` serves for `c` while `c / c_J` is in `leading_range`.
    pub(crate) fn new(structure: &Structure, leading_range: RangeInclusive<f64>) -> Self {
        let n = structure.unknowns;
        Self {
            matrix: IterationMatrix::new(structure),
            leading_range,
            y: Tiled::zeros(n),
            yp: Tiled::zeros(n),
            correction: Tiled::zeros(n),
            residual: Tiled::zeros(n),
            delta: Tiled::zeros(n),
            factored_leading: 0.0,
            last_leading: 0.0,
            rate: RATE_AFTER_CHANGE,
            have_matrix: false,
            lacking: (0, 0),
        }
    }

    /// Sets the sizes of the unknowns and drops the matrix.
    pub(crate) fn reset(&mut self, nominals: &[f64]) {
        self.matrix.begin(nominals);
        self.drop_matrix();
    }

    /// The matrix no longer fits the system (after events): renew it before use.
    pub(crate) fn drop_matrix(&mut self) {
        self.have_matrix = false;
    }

    /// Corrects a prediction; with an old matrix that fails, once more with a new one.
    #[inline(always)]
    pub(crate) fn correct(&mut self, problem: &mut Problem<'_>, at: &Prediction<'_>, weights: &Weights) -> Correction {
        let ratio = at.leading / self.factored_leading;
        let mut renew = !self.have_matrix || !self.leading_range.contains(&ratio);
        if at.leading != self.last_leading {
            self.rate = RATE_AFTER_CHANGE;
        }
        self.last_leading = at.leading;
        loop {
            problem.evaluate(at.t, at.y, at.yp, &mut self.residual);
            if renew {
                if !self.residual.is_finite() {
                    return self.stopped(at, Correction::NotFinite);
                }
                if let Err(error) = self.renew(problem, at, weights) {
                    return self.stopped(at, error);
                }
            }
            match self.iterate(problem, at, weights, renew) {
                (Correction::Converged, _) if self.matrix.is_deficient() => match self.judge(problem, at, weights) {
                    Ok(()) => return Correction::Converged,
                    Err(singular) if renew => return singular,
                    Err(_) => renew = true,
                },
                (Correction::Converged, _) => return Correction::Converged,
                // A residual that is not finite makes the first change so, whatever the matrix.
                (Correction::NotFinite, 0) if !self.residual.is_finite() => {
                    return self.stopped(at, Correction::NotFinite);
                }
                (failure, _) if renew => return failure,
                _ => renew = true,
            }
        }
    }

    /// What stopped the correction at the prediction, with the values at which it did.
    #[cold]
    fn stopped(&mut self, at: &Prediction<'_>, cause: Correction) -> Correction {
        self.y.copy_from_slice(at.y);
        self.yp.copy_from_slice(at.yp);
        self.correction.fill(0.0);
        cause
    }

    /// Evaluates and factors the iteration matrix at the prediction, or where that has a slope that is not finite, beside it.
    #[inline(never)]
    fn renew(&mut self, problem: &mut Problem<'_>, at: &Prediction<'_>, weights: &Weights) -> Result<(), Correction> {
        let (state, rate) = self.matrix.parts();
        problem.jacobian(at.t, at.y, at.yp, state, rate);
        problem.statistics.factorisations += 1;
        self.have_matrix = false;
        if let Err(error) = self.matrix.factor(at.leading) {
            match error {
                FactorError::Singular { row, column } => {
                    self.lacking = (row, column);
                    if !self.matrix.factor_deficient(at.leading, &weights.nominals, problem.open.ranks()) {
                        return Err(Correction::Singular { row, column });
                    }
                }
                FactorError::NotFinite { row, column } => {
                    self.factor_beside(problem, at, weights).map_err(|()| Correction::SlopeNotFinite { row, column })?
                }
            }
        }
        self.have_matrix = true;
        self.factored_leading = at.leading;
        self.rate = RATE_AFTER_RENEWAL;
        Ok(())
    }

    /// Equations that depend on each other must not contradict each other at what has been found; notes what they leave open.
    #[cold]
    fn judge(&self, problem: &mut Problem<'_>, at: &Prediction<'_>, weights: &Weights) -> Result<(), Correction> {
        if self.matrix.contradicts(&self.y, EPSILON * weights.tolerance()) {
            let (row, column) = self.lacking;
            return Err(Correction::Singular { row, column });
        }
        problem.note_open(at.t, None, self.matrix.undetermined());
        Ok(())
    }

    /// Takes the slopes a small part of the tolerance beside the prediction: at zero a root has none, and any that is finite lets
    /// the iteration go on, which is judged by its changes all the same (as solvers do that difference residuals).
    #[cold]
    fn factor_beside(&mut self, problem: &mut Problem<'_>, at: &Prediction<'_>, weights: &Weights) -> Result<(), ()> {
        for side in [BESIDE, -BESIDE] {
            for (k, value) in self.y.iter_mut().enumerate() {
                *value = at.y[k] + side / weights.all[k];
            }
            let (state, rate) = self.matrix.parts();
            problem.jacobian(at.t, &self.y, at.yp, state, rate);
            problem.statistics.factorisations += 1;
            if self.matrix.factor(at.leading).is_ok() {
                return Ok(());
            }
        }
        Err(())
    }

    /// What came of it, and the number of iterations before the last.  `fresh`: the matrix is that of the prediction.
    #[inline(always)]
    fn iterate(
        &mut self,
        problem: &mut Problem<'_>,
        at: &Prediction<'_>,
        weights: &Weights,
        fresh: bool,
    ) -> (Correction, usize) {
        let ratio = at.leading / self.factored_leading;
        let scale = -2.0 / (1.0 + ratio);
        let (mut first, mut first_size) = (0, 0.0);
        let most = if fresh { MOST_WITH_FRESH_MATRIX } else { MOST_ITERATIONS };
        for iteration in 0..most {
            problem.statistics.newton_iterations += 1;
            self.matrix.correct(&self.residual, &mut self.delta);
            if iteration == 0 {
                self.correction.tiles_mut().fill([0.0; LANES]);
            }
            let size = self.take(at, scale, weights);
            if !size.is_finite() {
                return (Correction::NotFinite, iteration);
            }
            if iteration == 0 {
                first_size = size;
                if size <= TINY * EPSILON {
                    return (Correction::Converged, iteration);
                }
            } else {
                let fall = size / first_size;
                let rho = match iteration - first {
                    1 => fall,
                    2 => fall.sqrt(),
                    count => pow(fall, 1.0 / count as f64),
                };
                if rho <= SLOWEST {
                    self.rate = rho / (1.0 - rho);
                } else if fresh && iteration == 1 {
                    // With the matrix of this very point the first change may be small because parts of it cancel, as in a product of
                    // two unknowns; the second one is measured by what follows.
                    (first, first_size) = (1, size);
                } else {
                    return (Correction::Diverged, iteration);
                }
            }
            if self.rate * size <= EPSILON {
                return (Correction::Converged, iteration);
            }
            if iteration + 1 < most {
                problem.evaluate(at.t, &self.y, &self.yp, &mut self.residual);
                if !self.residual.is_finite() {
                    return (Correction::NotFinite, iteration + 1);
                }
            }
        }
        (Correction::Diverged, most)
    }

    /// Scales the last iterate's change, adds it to the correction and moves the values by it; the norm of the change,
    /// not a number where a value is not finite.
    #[inline(always)]
    fn take(&mut self, at: &Prediction<'_>, scale: f64, weights: &Weights) -> f64 {
        let leading = at.leading;
        let delta = self.delta.tiles_mut();
        let count = delta.len();
        let correction = &mut self.correction.tiles_mut()[..count];
        let (y, yp) = (&mut self.y.tiles_mut()[..count], &mut self.yp.tiles_mut()[..count]);
        let (predicted, predicted_rate) = (&at.y.tiles()[..count], &at.yp.tiles()[..count]);
        let weight = &weights.all.tiles()[..count];
        let (squares, finite) = over_tiles(
            count,
            #[inline(always)]
            || {
                let (mut sums, mut finite) = ([0.0; LANES], [0.0; LANES]);
                for k in 0..count {
                    // All of a tile is read before any of it is written: vectors of numbers, not numbers.
                    let (mut change, mut all, mut value, mut rate) =
                        (delta[k], correction[k], predicted[k], predicted_rate[k]);
                    let weight = weight[k];
                    for lane in 0..LANES {
                        change[lane] *= scale;
                        all[lane] += change[lane];
                        value[lane] += all[lane];
                        rate[lane] += leading * all[lane];
                        let weighted = change[lane] * weight[lane];
                        finite[lane] += 0.0 * value[lane];
                        sums[lane] += weighted * weighted;
                    }
                    (delta[k], correction[k], y[k], yp[k]) = (change, all, value, rate);
                }
                (sum(sums), sum(finite))
            },
        );
        // Values that are not finite make a change of no size.
        if finite == 0.0 { weights.norm_of_squares(squares) } else { f64::NAN }
    }

    /// `v := c (dF/dy + c dF/dy')^{-1} dF/dy' v` with the last matrix: leaves slow components of an error as they are and damps
    /// stiff ones.
    pub(crate) fn filter(&mut self, v: &mut [f64]) {
        self.delta.fill(0.0);
        for (column, &value) in v.iter().enumerate() {
            for (row, entry) in self.matrix.rate_column(column) {
                self.delta[row] += self.factored_leading * entry * value;
            }
        }
        self.matrix.solve(&mut self.delta);
        v.copy_from_slice(&self.delta);
    }

    /// After divergence: the row of largest residual at the last iterate, each row measured by its largest entry.
    pub(crate) fn worst_row(&self) -> Option<usize> {
        largest((0..self.residual.len()).map(|k| self.residual[k] * self.matrix.row_scale(k)))
    }

    /// The unknown that moved most in the last iteration, or, over the whole correction.
    pub(crate) fn worst_unknown(&self, weights: &Weights, last_iteration: bool) -> Option<usize> {
        weights.worst(if last_iteration { &self.delta } else { &self.correction })
    }
}

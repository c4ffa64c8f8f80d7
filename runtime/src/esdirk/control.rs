//! Choice of the step from the estimated error: a proportional-integral controller.
//!
//! `h := h * 0.9 err_n^(-0.7/4) err_{n-1}^(0.4/4)` after success, `h * 0.9 err^(-1/4)` after failure.  A step that would grow only a
//! little keeps its size, so that the factored matrix stays valid.  One whose end was given did not follow from the errors before, so
//! that `h * 0.9 err^(-1/4)` comes next.  Source: Hairer, Wanner, "Solving Ordinary Differential
//! Equations II" (Springer 1996), section IV.2.

use hyd_system::math::{exp, fourth_root, ln};

/// Aim below the tolerance.
const SAFETY: f64 = 0.9;
/// Exponents of the last error and of the one before; the estimate is of order 4 in the step.
const LAST: f64 = 0.7 / 4.0;
const BEFORE: f64 = 0.4 / 4.0;
/// Exponent of the last error where no other counts.
const ALONE: f64 = 1.0 / 4.0;
/// Least and greatest change of a step.
const SHRINK: f64 = 0.2;
const GROW: f64 = 5.0;
/// A growth below this is not worth a new matrix.
const WORTHWHILE: f64 = 1.2;
/// An error below this says no more.
const LEAST_ERROR: f64 = 1e-6;
/// Logarithm of the least error of the step before: that of 1e-2.
const LEAST_BEFORE: f64 = -2.0 * std::f64::consts::LN_10;

/// Memory of the controller.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct StepControl {
    /// Logarithm of the error of the step before.
    before: f64,
    rejected: bool,
}

impl Default for StepControl {
    fn default() -> Self {
        Self { before: 0.0, rejected: false }
    }
}

impl StepControl {
    /// Factor of the step after one with error `error`, at most 1 in tolerances; `is_fitted`: the end of that step was given.
    pub(super) fn after_success(&mut self, error: f64, is_fitted: bool) -> f64 {
        // Both powers by one exponential, which takes less time than two powers.
        let error = ln(error.max(LEAST_ERROR));
        let exponent = if is_fitted { -ALONE * error } else { BEFORE * self.before - LAST * error };
        let factor = SAFETY * exp(exponent);
        self.before = error.max(LEAST_BEFORE);
        let most = if std::mem::take(&mut self.rejected) { 1.0 } else { GROW };
        let factor = factor.clamp(SHRINK, most);
        if !is_fitted && (1.0..WORTHWHILE).contains(&factor) { 1.0 } else { factor }
    }

    /// Factor of the step after one with error `error` above 1.
    pub(super) fn after_failure(&mut self, error: f64) -> f64 {
        self.rejected = true;
        (SAFETY / fourth_root(error)).clamp(SHRINK, SAFETY)
    }

    /// The step was shortened because the iteration did not converge.
    pub(super) fn after_divergence(&mut self) -> f64 {
        self.rejected = true;
        0.25
    }
}

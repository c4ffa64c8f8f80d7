//! Error test, choice of the next order and of the next step.
//!
//! Local errors at orders k, k-1, k-2 are estimated from the correction `e = y - y_pred` and the highest differences:
//! `err_k = sigma_k |e|`, `err_{k-1} = sigma_{k-1} |phi_k + e|`, `err_{k-2} = sigma_{k-2} |phi_{k-1} + phi_k + e|`; the scaled
//! derivative norms `(j+1) err_j` are compared, and the order is lowered when they do not fall with the order.  After a restart
//! order and step grow with each step until the first sign that this was enough.  The step changes only when it can be doubled
//! or must shrink, so that the iteration matrix keeps its value.
//! Source: Brenan, Campbell, Petzold 1996, section 5.2.4 and 5.2.5.

use super::history::{History, MAX_ORDER};
use crate::tiled::Tiled;
use crate::weights::Weights;
use hyd_system::math::{exp, ln};

/// Estimates of one step.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Estimates {
    /// Norm of the correction and of the difference below it.
    norm: f64,
    norm_below: f64,
    /// Local error at the order of the step and one below.
    at_order: f64,
    below: f64,
    /// The order that the differences recommend, same or one below, and its error.
    order: usize,
    error: f64,
}

impl Estimates {
    /// Estimates after a correction; the error test has passed if `passed()`.
    #[inline(always)]
    pub(super) fn new(history: &History, correction: &Tiled, weights: &Weights) -> Self {
        let k = history.order;
        let [norm, norm_below, second] =
            weights.tested_norms(correction.tiles(), history.tiles(k), history.tiles(k - 1));
        let at_order = history.sigma[k] * norm;
        let term = (k + 1) as f64 * at_order;
        let mut estimates = Self { norm, norm_below: norm, at_order, below: 0.0, order: k, error: at_order };
        if k > 1 {
            estimates.norm_below = norm_below;
            estimates.below = history.sigma[k - 1] * estimates.norm_below;
            let term_below = k as f64 * estimates.below;
            let lower = if k > 2 {
                let term_second = (k - 1) as f64 * history.sigma[k - 2] * second;
                term_below.max(term_second) <= term
            } else {
                term_below <= 0.5 * term
            };
            if lower {
                (estimates.order, estimates.error) = (k - 1, estimates.below);
            }
        }
        estimates
    }

    /// Ratio of the last two differences: small where the step resolves the solution, near one where it does not.
    pub(super) fn ratio(&self) -> f64 {
        if self.norm_below > 0.0 { self.norm / self.norm_below } else { 0.0 }
    }

    /// The error test.
    pub(super) fn passed(&self, error_constant: f64) -> bool {
        error_constant * self.norm <= 1.0
    }

    /// After a failed test number `failures` (from 1): sets the order and returns the factor of the step.
    pub(super) fn shrink(&self, history: &mut History, failures: u32) -> f64 {
        match failures {
            1 => {
                history.order = self.order;
                (0.9 * step_ratio(self.error, self.order)).clamp(0.25, 0.9)
            }
            2 => {
                history.order = self.order;
                0.25
            }
            _ => {
                history.order = 1;
                0.25
            }
        }
    }
}

/// Part of the allowed error below which the step of each order can be doubled: `2^-(k+1)`.
const DOUBLING: [f64; MAX_ORDER + 1] = [0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625];

/// Twice the error, in allowed ones, and a little, so that steps do not grow without bound.
fn allowance(error: f64) -> f64 {
    2.0 * error + 1e-4
}

/// `(2 err + 1e-4)^(-1/(k+1))`: the ratio to the step at which the error would be half of what is allowed.
fn step_ratio(error: f64, order: usize) -> f64 {
    exp(-ln(allowance(error)) / (order + 1) as f64)
}

/// Order and step selection between steps.
#[derive(Clone, Copy, Default, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Selection {
    /// The growing phase after a restart is over.
    settled: bool,
    steps_since_restart: u64,
    /// Steps for which the step size must not grow: after a failure at order 1 as many as a higher order needs to be judged.
    hold: usize,
}

impl Selection {
    /// After a past has been taken over: no growing phase.
    pub(super) fn resumed() -> Self {
        Self { settled: true, steps_since_restart: 0, hold: 0 }
    }

    /// After a failure at the lowest order: sizes that failed are not tried again at once.
    pub(super) fn hold(&mut self, order: usize) {
        self.hold = order + 3;
    }

    /// Sets order and size of the next step after an accepted one.  Call before the history takes the correction;
    /// `previous_order` is the order of the step before, `max_step` in s.
    #[inline(always)]
    pub(super) fn next(
        &mut self,
        history: &mut History,
        estimates: &Estimates,
        correction: &Tiled,
        weights: &Weights,
        limits: (usize, f64),
    ) {
        let (max_order, max_step) = limits;
        let k = history.order;
        let raised = k > history.order_used;
        self.steps_since_restart += 1;
        if estimates.order < k || k >= max_order {
            self.settled = true;
        }
        if !self.settled {
            if self.steps_since_restart > 1 {
                history.order = k + 1;
                history.h = (2.0 * history.h).min(max_step);
            }
            return;
        }
        let (order, error) = Self::order(history, estimates, correction, weights, max_order, raised);
        history.order = order.min(max_order);
        self.hold = self.hold.saturating_sub(1);
        let doubles = allowance(error) <= DOUBLING[order];
        if doubles && self.hold > 0 {
            // A formula of low order may pass with this step and fail with twice the step, again and again.
        } else if doubles {
            history.h = (2.0 * history.h).min(max_step);
        } else if allowance(error) >= 1.0 {
            history.h *= step_ratio(error, order).clamp(0.5, 0.9);
        }
    }

    #[inline(always)]
    fn order(
        history: &History,
        estimates: &Estimates,
        correction: &Tiled,
        weights: &Weights,
        max_order: usize,
        raised: bool,
    ) -> (usize, f64) {
        let k = history.order;
        if estimates.order < k {
            return (k - 1, estimates.below);
        }
        if k >= max_order || k + 1 >= history.steady || raised {
            return (k, estimates.at_order);
        }
        let above = weights.tested_norm_of_difference(correction.tiles(), history.tiles(k + 1));
        let term = (k + 1) as f64 * estimates.at_order;
        let error_above = above / (k + 2) as f64;
        if k == 1 {
            return if above >= 0.5 * term { (1, estimates.at_order) } else { (2, error_above) };
        }
        let term_below = k as f64 * estimates.below;
        if term_below <= term.min(above) {
            (k - 1, estimates.below)
        } else if above >= term {
            (k, estimates.at_order)
        } else {
            (k + 1, error_above)
        }
    }
}

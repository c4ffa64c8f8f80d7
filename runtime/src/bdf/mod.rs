//! Variable-order, variable-step BDF for `F(t, y, y') = 0`.
//!
//! One step: set the coefficients and predict ([`history`]), correct ([`crate::corrector`]), test the error and choose what comes next
//! ([`control`]); repeat with a smaller step when a part fails.  Fixed-leading-coefficient formulas of order 1 to 5
//! in modified divided differences after Brenan, Campbell, Petzold, "Numerical Solution of Initial-Value Problems in
//! Differential-Algebraic Equations" (SIAM 1996), chapter 5, with the heuristics of Hindmarsh et al., ACM TOMS 31 (2005) 363.
//! A step allocates nothing.  The integrator knows no events and no output: it stops where it is told.

mod control;
mod history;

use hyd_system::Structure;

use crate::corrector::{Correction, Corrector, Prediction, StepFailure, StepFault};
use crate::problem::Problem;
use crate::tiled::Tiled;
use crate::weights::Weights;
use control::{Estimates, Selection};
use history::{History, MAX_ORDER};

/// Renew the matrix when `c/c_J` leaves this range.
const LEADING_RANGE: std::ops::RangeInclusive<f64> = 0.6..=1.0 / 0.6;

/// Where algebraic unknowns amplify the states, every change of order or step shows in them as a jump that fails the error test, and
/// steps stay tiny for good.  Failures at order 1 tell: each counts as `FAILURE` steps, each accepted step takes one off, and above
/// `STUCK` the test looks at the states alone; `MOST_STUCK` steps later all is forgotten.  It costs
/// no error in later steps: the formula keeps the past of all unknowns, but no derivative of an algebraic one stands in an equation.
/// Of the reference problems it changes the transistor amplifier (up to 130 times fewer steps) and the squeezing mechanism at
/// 1e-10.  The three numbers were found on the amplifier; no theory gives them.
const FAILURE: u32 = 10;
const STUCK: u32 = 40;
const MOST_STUCK: u32 = 1000;

/// Failed attempts of one kind after which a step is given up.
const MOST_FAILURES: u32 = 12;

/// The integrator with all its work space.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Bdf {
    history: History,
    corrector: Corrector,
    selection: Selection,
    predicted: Tiled,
    predicted_rate: Tiled,
    max_order: usize,
    max_step: f64,
    min_step_scale: f64,
    t_before: f64,
    ratio: f64,
    /// Grows with each failure of the error test at order 1, falls with each step.
    stuck: u32,
}

impl Bdf {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let n = structure.unknowns;
        Self {
            history: History::new(n),
            corrector: Corrector::new(structure, LEADING_RANGE),
            selection: Selection::default(),
            predicted: Tiled::zeros(n),
            predicted_rate: Tiled::zeros(n),
            max_order: MAX_ORDER,
            max_step: f64::INFINITY,
            min_step_scale: 0.0,
            t_before: 0.0,
            ratio: 0.0,
            stuck: 0,
        }
    }

    /// Prepares a run: limits, and the time (s) below whose rounding no step makes sense.
    pub(crate) fn configure(&mut self, max_order: usize, max_step: f64, time_scale: f64, nominals: &[f64]) {
        self.max_order = max_order;
        self.max_step = max_step;
        self.min_step_scale = time_scale;
        self.stuck = 0;
        self.corrector.reset(nominals);
    }

    /// Starts at order 1 from consistent values with first step `h` (s).
    pub(crate) fn restart(&mut self, t: f64, y: &[f64], yp: &[f64], h: f64) {
        self.history.restart(t, y, yp, h.min(self.max_step));
        self.corrector.drop_matrix();
        self.corrector.y.copy_from_slice(y);
        self.corrector.yp.copy_from_slice(yp);
        self.selection = Selection::default();
        self.stuck = 0;
        self.t_before = t;
    }

    /// Goes on from a past known elsewhere, at `order` with step `h` (s); `value` gives values at times back to `t - order h`,
    /// `yp` are the rates at `t`.
    pub(crate) fn resume(&mut self, (t, h, order): (f64, f64, usize), yp: &[f64], value: impl FnMut(f64, &mut [f64])) {
        self.history.resume(t, h, order.min(self.max_order), value);
        self.corrector.y.copy_from_slice(self.history.phi(0));
        self.corrector.yp.copy_from_slice(yp);
        self.selection = Selection::resumed();
        self.stuck = 0;
        self.t_before = t;
    }

    /// The matrix no longer fits the system (after events, or when other states were chosen).
    pub(crate) fn drop_matrix(&mut self) {
        self.corrector.drop_matrix();
    }

    /// Sets the highest order for the following steps.
    pub(crate) fn set_max_order(&mut self, order: usize) {
        self.max_order = order;
    }

    /// Ratio of the two highest differences at the last accepted step, and its order.
    pub(crate) fn falling(&self) -> (f64, usize) {
        (self.ratio, self.history.order_used)
    }

    /// Size of the step to be tried next (s).
    pub(crate) fn next_step(&self) -> f64 {
        self.history.h
    }

    /// Time of the newest accepted point (s).
    pub(crate) fn t(&self) -> f64 {
        self.history.t
    }

    /// Time of the accepted point before (s).
    pub(crate) fn t_before(&self) -> f64 {
        self.t_before
    }

    /// Last accepted step (s), or the one to be tried first.
    pub(crate) fn step_size(&self) -> f64 {
        if self.history.order_used == 0 { self.history.h } else { self.history.h_used }
    }

    /// Values at the newest accepted point.
    pub(crate) fn y(&self) -> &[f64] {
        self.history.phi(0)
    }

    /// Rates at the newest accepted point.
    pub(crate) fn yp(&self) -> &[f64] {
        &self.corrector.yp
    }

    /// Interpolates within the last accepted step.
    pub(crate) fn at(&self, t: f64, y: &mut [f64], yp: &mut [f64]) {
        self.history.at(t, y, yp);
    }

    /// Smallest sensible step at time `t` (s).
    pub(crate) fn smallest_step(&self, t: f64) -> f64 {
        4.0 * f64::EPSILON * t.abs().max(self.min_step_scale)
    }

    /// Does one step, not beyond `limit` (s); a step that would end shortly before the limit ends on it.
    pub(crate) fn step(
        &mut self,
        problem: &mut Problem<'_>,
        weights: &mut Weights,
        limit: f64,
    ) -> Result<(), StepFailure> {
        // Not the single loops, which are short: the way to wide instructions is gone once.
        hyd_system::wide(
            #[inline(always)]
            || self.attempt(problem, weights, limit),
        )
    }

    #[inline(always)]
    fn attempt(&mut self, problem: &mut Problem<'_>, weights: &mut Weights, limit: f64) -> Result<(), StepFailure> {
        weights.update(self.history.phi(0));
        if self.stuck > STUCK {
            weights.forgive_algebraic();
        }
        let start = self.history.t;
        let (mut error_failures, mut other_failures) = (0u32, 0u32);
        loop {
            let target = self.aim(start, limit);
            if self.history.h < self.smallest_step(start) {
                let report = (target, self.history.h, self.history.order);
                return Err(self.failure(StepFault::Error, report, weights));
            }
            self.history.advance(target);
            self.history.predict(&mut self.predicted, &mut self.predicted_rate);
            let at =
                Prediction { t: target, leading: self.history.leading, y: &self.predicted, yp: &self.predicted_rate };
            let outcome = self.corrector.correct(problem, &at, weights);
            let h = self.history.h;
            if outcome == Correction::Converged {
                let estimates = Estimates::new(&self.history, &self.corrector.correction, weights);
                if estimates.passed(self.history.error_constant) {
                    self.accept(problem, &estimates, weights, start);
                    return Ok(());
                }
                problem.statistics.error_rejections += 1;
                if let Some(profile) = &mut problem.profile {
                    profile.reject(self.corrector.worst_unknown(weights, false));
                }
                error_failures += 1;
                let order = self.history.order;
                self.history.retreat(start);
                let factor = estimates.shrink(&mut self.history, error_failures);
                self.history.resize(factor);
                if order == 1 {
                    self.stuck = (self.stuck + FAILURE).min(MOST_STUCK);
                    // No lower order is left: where algebraic unknowns amplify the states, steps would stay tiny for good.
                    self.selection.hold(self.history.order);
                    weights.forgive_algebraic();
                }
                if self.history.h <= self.smallest_step(start) {
                    return Err(self.failure(StepFault::Error, (target, h, order), weights));
                }
                continue;
            }
            problem.statistics.convergence_failures += 1;
            if let Some(profile) = &mut problem.profile {
                profile.diverge(self.corrector.worst_row(), self.corrector.worst_unknown(weights, true));
            }
            other_failures += 1;
            let order = self.history.order;
            self.history.retreat(start);
            self.history.resize(0.25);
            if other_failures >= MOST_FAILURES || self.history.h <= self.smallest_step(start) {
                return Err(StepFailure::of_correction(outcome, |fault| {
                    self.failure(fault, (target, h, order), weights)
                }));
            }
        }
    }

    /// Fits the step in hand to the limit and returns the time it leads to.
    #[inline(always)]
    fn aim(&mut self, start: f64, limit: f64) -> f64 {
        let rest = limit - start;
        let h = self.history.h;
        if 1.05 * h >= rest {
            self.history.set_step(rest);
            limit
        } else if 2.0 * h > rest {
            self.history.set_step(0.5 * rest);
            start + 0.5 * rest
        } else {
            start + h
        }
    }

    #[inline(always)]
    fn accept(&mut self, problem: &mut Problem<'_>, estimates: &Estimates, weights: &Weights, start: f64) {
        let order = self.history.order;
        let step = self.history.h;
        problem.statistics.steps += 1;
        self.stuck = self.stuck.saturating_sub(1);
        problem.statistics.steps_by_order[order - 1] += 1;
        self.ratio = estimates.ratio();
        let limits = (self.max_order, self.max_step);
        self.selection.next(&mut self.history, estimates, &self.corrector.correction, weights, limits);
        let next = (self.history.order, self.history.h);
        (self.history.order, self.history.h) = (order, step);
        self.history.accept(&self.corrector.correction, self.max_order);
        (self.history.order, self.history.h) = next;
        self.t_before = start;
    }

    fn failure(&self, fault: StepFault, (t, h, order): (f64, f64, usize), weights: &Weights) -> StepFailure {
        let last_iteration = fault != StepFault::Error;
        StepFailure {
            fault,
            t,
            h,
            order,
            row: if last_iteration { self.corrector.worst_row() } else { None },
            unknown: match fault {
                // Corrections that are not finite say nothing about their origin.
                StepFault::NotFinite => None,
                _ => self.corrector.worst_unknown(weights, last_iteration),
            },
        }
    }

    /// The unknown whose error was the largest of the last step.
    pub(crate) fn dominant(&self, weights: &Weights) -> Option<usize> {
        self.corrector.worst_unknown(weights, false)
    }

    /// Values and rates of the last attempt, for messages about values that are not finite.
    pub(crate) fn last_attempt(&self) -> (&[f64], &[f64]) {
        (&self.corrector.y, &self.corrector.yp)
    }
}

//! A one-step method for `F(t, y, y') = 0`: singly diagonally implicit Runge-Kutta with explicit first stage.
//!
//! Stage i solves `F(t_i, Y_i, (Y_i - p_i) / (h gamma)) = 0` with `p_i = y_n + h sum_{j<i} a_ij K_j`, the problem of a BDF step with
//! leading coefficient `1/(h gamma)`; so the same corrector solves it, and one matrix serves all stages and, while `h`
//! stays, many steps.  Algebraic unknowns take part like the others; their `K` is a formal derivative, forgotten from step to
//! step because the method is L-stable, and their error is what the errors of the states make of it.  The error of the states is the difference to the embedded result as it is: the usual filter
//! `c (dF/dy + c dF/dy')^{-1} dF/dy'` that damps its stiff components hides contacts that are stepped over (drive at 1e-4: error
//! twenty times as large for the same work); it is used only in the first steps after BDF at its limit of stability.  The embedded
//! result differs so little from the other that a kink of the rates within a step, such as a contact, shows in it twenty times
//! too small; a second combination of the rates sees kinks at their size and nothing where the solution is smooth ([`tableau`]).
//! Sources: [`tableau`]; Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), sections IV.6 and IV.8.
//! A step allocates nothing.  Knows no events and no output.

mod control;
mod estimate;
mod last_step;
pub(crate) mod tableau;

use hyd_system::Structure;

use crate::corrector::{Correction, Corrector, Prediction, StepFailure, StepFault};
use crate::problem::Problem;
use crate::tiled::Tiled;
use crate::weights::Weights;
use control::StepControl;
use estimate::Estimate;
use last_step::LastStep;
pub(crate) use tableau::ORDER;
use tableau::{A, C, GAMMA, PREDICTOR, STAGES};

/// Failed corrections after which a step is given up.
const MOST_FAILURES: u32 = 12;
/// A matrix for another step size serves while the ratio of the two is in this range.
const LEADING_RANGE: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Beyond this growth of the step the last one does not predict the second stage.
const MOST_GROWTH_PREDICTED: f64 = 2.0;
/// A step may become so many times as long to end on a limit.
const STRETCH: f64 = 1.01;

/// The integrator with all its work space.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Esdirk {
    corrector: Corrector,
    control: StepControl,
    last: LastStep,
    attempt: Attempt,
    estimate: Estimate,
    /// Step to try next (s).
    h: f64,
    /// It was changed to end on a limit, or halfway to it.
    is_fitted: bool,
    max_step: f64,
    min_step_scale: f64,
}

/// Vectors of a stage.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct Attempt {
    base: Vec<f64>,
    predicted: Tiled,
    predicted_rate: Tiled,
}

impl Esdirk {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let n = structure.unknowns;
        Self {
            corrector: Corrector::new(structure, LEADING_RANGE),
            control: StepControl::default(),
            last: LastStep::new(n),
            attempt: Attempt { base: vec![0.0; n], predicted: Tiled::zeros(n), predicted_rate: Tiled::zeros(n) },
            estimate: Estimate::new(&structure.differential),
            h: 0.0,
            is_fitted: false,
            max_step: f64::INFINITY,
            min_step_scale: 0.0,
        }
    }

    /// Prepares a run: the largest step and the time (s) below whose rounding no step makes sense.
    pub(crate) fn configure(&mut self, max_step: f64, time_scale: f64, nominals: &[f64]) {
        self.max_step = max_step;
        self.min_step_scale = time_scale;
        self.corrector.reset(nominals);
    }

    /// The matrix no longer fits the system (after events).
    pub(crate) fn drop_matrix(&mut self) {
        self.corrector.drop_matrix();
    }

    /// Starts from consistent values with first step `h` (s).  `noisy`: they come from steps at the limit of stability, which
    /// leave stiff components of about the tolerance that mean nothing; the first steps damp them instead of following them.
    pub(crate) fn restart(&mut self, t: f64, (y, yp, states): (&[f64], &[f64], &[bool]), h: f64, noisy: bool) {
        self.estimate.restart(noisy);
        self.set_states(y, yp, states);
        self.last.restart(t);
        self.h = h.min(self.max_step);
        self.control = StepControl::default();
    }

    /// Goes on from the same values with other states: rates that were formal have become those of states, and are given.
    pub(crate) fn set_states(&mut self, y: &[f64], yp: &[f64], states: &[bool]) {
        self.last.y.copy_from_slice(y);
        self.last.yp.copy_from_slice(yp);
        self.estimate.set_states(states);
    }

    pub(crate) fn t(&self) -> f64 {
        self.last.to
    }

    pub(crate) fn t_before(&self) -> f64 {
        self.last.from
    }

    /// Last accepted step (s), or the one to be tried first.
    pub(crate) fn step_size(&self) -> f64 {
        if self.last.h > 0.0 { self.last.h } else { self.h }
    }

    /// Step to be tried next, and how long it may become to end on a limit (s).
    pub(crate) fn step_and_most(&self) -> (f64, f64) {
        (self.h, STRETCH * self.h)
    }

    /// Step to be tried next (s).
    pub(crate) fn next_step(&self) -> f64 {
        self.h
    }

    pub(crate) fn y(&self) -> &[f64] {
        &self.last.y
    }

    pub(crate) fn yp(&self) -> &[f64] {
        &self.last.yp
    }

    /// Values of the last attempt, for messages about values that are not finite.
    pub(crate) fn last_attempt(&self) -> (&[f64], &[f64]) {
        (&self.corrector.y, &self.corrector.yp)
    }

    /// Values and rates at a time within the last accepted step.
    pub(crate) fn at(&self, t: f64, y: &mut [f64], yp: &mut [f64]) {
        self.last.at(t, y, yp);
    }

    fn smallest_step(&self) -> f64 {
        4.0 * f64::EPSILON * self.last.to.abs().max(self.min_step_scale)
    }

    /// Does one step, not beyond `limit` (s); a step that would end shortly before the limit ends on it.
    pub(crate) fn step(
        &mut self,
        problem: &mut Problem<'_>,
        weights: &mut Weights,
        limit: f64,
    ) -> Result<(), StepFailure> {
        weights.update(&self.last.y);
        let from = self.last.to;
        let per_old_step = if self.last.h > 0.0 { self.last.h.recip() } else { 0.0 };
        self.last.leave();
        let mut failures = 0u32;
        loop {
            let target = self.aim(from, limit);
            if self.h < self.smallest_step() {
                return Err(self.failure(StepFault::Error, target, weights));
            }
            let outcome = self.stages(problem, weights, from, per_old_step);
            if outcome != Correction::Converged {
                problem.statistics.convergence_failures += 1;
                failures += 1;
                let failure = StepFailure::of_correction(outcome, |fault| self.failure(fault, target, weights));
                if let Some(profile) = &mut problem.profile {
                    profile.diverge(failure.row, failure.unknown);
                }
                self.h *= self.control.after_divergence();
                if failures >= MOST_FAILURES || self.h <= self.smallest_step() {
                    return Err(failure);
                }
                continue;
            }
            let error = self.estimate.measure(&mut self.corrector, (self.h, &self.last.rates), weights);
            if error <= 1.0 {
                problem.statistics.steps += 1;
                problem.statistics.one_step_steps += 1;
                self.accept(target, error);
                return Ok(());
            }
            problem.statistics.error_rejections += 1;
            let failure = self.failure(StepFault::Error, target, weights);
            if let Some(profile) = &mut problem.profile {
                profile.reject(failure.unknown);
            }
            self.h *=
                if error.is_finite() { self.control.after_failure(error) } else { self.control.after_divergence() };
            if self.h <= self.smallest_step() {
                return Err(failure);
            }
        }
    }

    /// Fits the step in hand to the limit and returns the time it leads to.
    fn aim(&mut self, start: f64, limit: f64) -> f64 {
        let rest = limit - start;
        self.is_fitted = 2.0 * self.h > rest;
        if STRETCH * self.h >= rest {
            self.h = rest;
            limit
        } else if 2.0 * self.h > rest {
            self.h = 0.5 * rest;
            start + self.h
        } else {
            start + self.h
        }
    }

    /// All stages of one attempt; `per_old_step`: the inverse of the last step, or 0.
    fn stages(&mut self, problem: &mut Problem<'_>, weights: &Weights, from: f64, per_old_step: f64) -> Correction {
        let Attempt { base, predicted, predicted_rate } = &mut self.attempt;
        let n = base.len();
        let (h, leading) = (self.h, (self.h * GAMMA).recip());
        for i in 1..STAGES {
            base.copy_from_slice(&self.last.start);
            predicted_rate.fill(0.0);
            for j in 0..i {
                let (a, p) = (h * A[i][j], PREDICTOR[i][j]);
                let rate = &self.last.rates[j * n..(j + 1) * n];
                for ((base, guess), rate) in base.iter_mut().zip(predicted_rate.iter_mut()).zip(rate) {
                    *base += a * rate;
                    *guess += p * rate;
                }
            }
            if i == 1 {
                let ahead = C[1] * h * per_old_step;
                if ahead <= C[1] * MOST_GROWTH_PREDICTED {
                    self.last.bend(ahead, predicted_rate);
                }
            }
            for k in 0..n {
                predicted[k] = base[k] + h * GAMMA * predicted_rate[k];
            }
            let at = Prediction { t: from + C[i] * h, leading, y: predicted, yp: predicted_rate };
            let outcome = self.corrector.correct(problem, &at, weights);
            if outcome != Correction::Converged {
                return outcome;
            }
            self.last.rates[i * n..(i + 1) * n].copy_from_slice(&self.corrector.yp);
        }
        Correction::Converged
    }

    /// The unknown whose error was the largest of the last step.
    pub(crate) fn dominant(&self, weights: &Weights) -> Option<usize> {
        weights.worst(&self.estimate.error)
    }

    fn accept(&mut self, target: f64, error: f64) {
        self.estimate.accepted();
        let last = &mut self.last;
        last.y.copy_from_slice(&self.corrector.y);
        last.yp.copy_from_slice(&self.corrector.yp);
        (last.from, last.to, last.h) = (last.to, target, self.h);
        self.h = (self.h * self.control.after_success(error, self.is_fitted)).min(self.max_step);
    }

    fn failure(&self, fault: StepFault, t: f64, weights: &Weights) -> StepFailure {
        StepFailure {
            fault,
            t,
            h: self.h,
            order: ORDER,
            row: if fault == StepFault::Error { None } else { self.corrector.worst_row() },
            unknown: match fault {
                StepFault::NotFinite => None,
                StepFault::Error => weights.worst(&self.estimate.error),
                _ => self.corrector.worst_unknown(weights, true),
            },
        }
    }
}

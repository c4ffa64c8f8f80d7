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
pub(crate) mod tableau;

use hyd_system::Structure;

use crate::corrector::{Correction, Corrector, Prediction, StepFailure, StepFault};
use crate::problem::Problem;
use crate::tiled::Tiled;
use crate::weights::Weights;
use control::StepControl;
pub(crate) use tableau::ORDER;
use tableau::{A, C, END_CURVATURE, END_SLOPE, GAMMA, PREDICTOR, STAGES, dense, difference, kink};

/// Failed corrections after which a step is given up.
const MOST_FAILURES: u32 = 12;
/// A matrix for another step size serves while the ratio of the two is in this range.
const LEADING_RANGE: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Steps after a handover from BDF in which stiff noise is stepped over, and how much of it at most, in tolerances.
const FORGIVING_STEPS: u32 = 8;
const FORGIVEN: f64 = 10.0;
/// Beyond this growth of the step the last one does not predict the second stage.
const MOST_GROWTH_PREDICTED: f64 = 2.0;

/// The integrator with all its work space.
pub(crate) struct Esdirk {
    n: usize,
    corrector: Corrector,
    control: StepControl,
    /// `K_1 .. K_6` of the last step, one after the other.
    rates: Vec<f64>,
    /// `h^2 y''` and `h^3 y'''` at the end of the last step, in units of that step.
    bend: Vec<f64>,
    twist: Vec<f64>,
    /// Values at the start of the last step, and at its end.
    start: Vec<f64>,
    y: Vec<f64>,
    yp: Vec<f64>,
    base: Vec<f64>,
    predicted: Tiled,
    predicted_rate: Tiled,
    error: Vec<f64>,
    /// What kinks of the rates contribute to the error.
    kink: Vec<f64>,
    filtered: Vec<f64>,
    /// Unknowns that are states now.
    states: Vec<bool>,
    has_algebraic: bool,
    t: f64,
    t_before: f64,
    /// Step to try next, and the last accepted one (0 before the first) (s).
    h: f64,
    h_used: f64,
    max_step: f64,
    min_step_scale: f64,
    /// Steps to come with the filtered error.
    forgiving: u32,
}

impl Esdirk {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let n = structure.unknowns;
        let zeros = || vec![0.0; n];
        Self {
            n,
            corrector: Corrector::new(structure, LEADING_RANGE),
            control: StepControl::default(),
            rates: vec![0.0; STAGES * n],
            bend: zeros(),
            twist: zeros(),
            start: zeros(),
            y: zeros(),
            yp: zeros(),
            base: zeros(),
            predicted: Tiled::zeros(n),
            predicted_rate: Tiled::zeros(n),
            error: zeros(),
            kink: zeros(),
            filtered: zeros(),
            states: structure.differential.clone(),
            has_algebraic: structure.differential.contains(&false),
            t: 0.0,
            t_before: 0.0,
            h: 0.0,
            h_used: 0.0,
            max_step: f64::INFINITY,
            min_step_scale: 0.0,
            forgiving: 0,
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
        self.forgiving = if noisy { FORGIVING_STEPS } else { 0 };
        self.set_states(y, yp, states);
        self.bend.fill(0.0);
        self.twist.fill(0.0);
        (self.t, self.t_before, self.h, self.h_used) = (t, t, h.min(self.max_step), 0.0);
        self.control = StepControl::default();
    }

    /// Goes on from the same values with other states: rates that were formal have become those of states, and are given.
    pub(crate) fn set_states(&mut self, y: &[f64], yp: &[f64], states: &[bool]) {
        self.y.copy_from_slice(y);
        self.yp.copy_from_slice(yp);
        self.states.copy_from_slice(states);
        self.has_algebraic = states.contains(&false);
    }

    pub(crate) fn t(&self) -> f64 {
        self.t
    }

    pub(crate) fn t_before(&self) -> f64 {
        self.t_before
    }

    /// Last accepted step (s), or the one to be tried first.
    pub(crate) fn step_size(&self) -> f64 {
        if self.h_used > 0.0 { self.h_used } else { self.h }
    }

    /// Step to be tried next (s).
    pub(crate) fn next_step(&self) -> f64 {
        self.h
    }

    pub(crate) fn y(&self) -> &[f64] {
        &self.y
    }

    pub(crate) fn yp(&self) -> &[f64] {
        &self.yp
    }

    /// Values of the last attempt, for messages about values that are not finite.
    pub(crate) fn last_attempt(&self) -> (&[f64], &[f64]) {
        (&self.corrector.y, &self.corrector.yp)
    }

    fn rate(&self, i: usize) -> &[f64] {
        &self.rates[i * self.n..(i + 1) * self.n]
    }

    /// Interpolates within the last accepted step.
    pub(crate) fn interpolate(&self, t: f64, y: &mut [f64], yp: &mut [f64]) {
        if self.h_used == 0.0 {
            y.copy_from_slice(&self.y);
            yp.copy_from_slice(&self.yp);
            return;
        }
        let theta = (t - self.t_before) / self.h_used;
        y.copy_from_slice(&self.start);
        yp.fill(0.0);
        for i in 0..STAGES {
            let (b, slope) = dense(i, theta);
            let b = b * self.h_used;
            for ((y, yp), rate) in y.iter_mut().zip(yp.iter_mut()).zip(self.rate(i)) {
                *y += b * rate;
                *yp += slope * rate;
            }
        }
    }

    fn smallest_step(&self) -> f64 {
        4.0 * f64::EPSILON * self.t.abs().max(self.min_step_scale)
    }

    /// Does one step, not beyond `limit` (s); a step that would end shortly before the limit ends on it.
    pub(crate) fn step(
        &mut self,
        problem: &mut Problem<'_>,
        weights: &mut Weights,
        limit: f64,
    ) -> Result<(), StepFailure> {
        weights.update(&self.y);
        let from = self.t;
        let growth = self.begin();
        let mut failures = 0u32;
        loop {
            let target = self.aim(from, limit);
            if self.h < self.smallest_step() {
                return Err(self.failure(StepFault::Error, target, weights));
            }
            let outcome = self.stages(problem, weights, from, growth);
            if outcome != Correction::Converged {
                problem.statistics.convergence_failures += 1;
                failures += 1;
                let failure = StepFailure::of_correction(outcome, |fault| self.failure(fault, target, weights));
                self.h *= self.control.after_divergence();
                if failures >= MOST_FAILURES || self.h <= self.smallest_step() {
                    return Err(failure);
                }
                continue;
            }
            let error = self.estimate(weights);
            if error <= 1.0 {
                problem.statistics.steps += 1;
                problem.statistics.one_step_steps += 1;
                self.accept(target, error);
                return Ok(());
            }
            problem.statistics.error_rejections += 1;
            let failure = self.failure(StepFault::Error, target, weights);
            self.h *=
                if error.is_finite() { self.control.after_failure(error) } else { self.control.after_divergence() };
            if self.h <= self.smallest_step() {
                return Err(failure);
            }
        }
    }

    /// Takes over the last point as the start of the next step; gives the inverse of the step that `bend` belongs to, or 0.
    fn begin(&mut self) -> f64 {
        let n = self.n;
        if self.h_used > 0.0 {
            for k in 0..n {
                let (mut bend, mut twist) = (0.0, 0.0);
                for i in 0..STAGES {
                    let rate = self.rates[i * n + k];
                    bend += END_SLOPE[i] * rate;
                    twist += END_CURVATURE[i] * rate;
                }
                (self.bend[k], self.twist[k]) = (bend, 0.5 * twist);
            }
        }
        self.start.copy_from_slice(&self.y);
        self.rates[..n].copy_from_slice(&self.yp);
        if self.h_used > 0.0 { self.h_used.recip() } else { 0.0 }
    }

    /// Fits the step in hand to the limit and returns the time it leads to.
    fn aim(&mut self, start: f64, limit: f64) -> f64 {
        let rest = limit - start;
        if 1.01 * self.h >= rest {
            self.h = rest;
            limit
        } else if 2.0 * self.h > rest {
            self.h = 0.5 * rest;
            start + self.h
        } else {
            start + self.h
        }
    }

    /// All stages of one attempt.
    fn stages(&mut self, problem: &mut Problem<'_>, weights: &Weights, from: f64, per_old_step: f64) -> Correction {
        let n = self.n;
        let (h, leading) = (self.h, (self.h * GAMMA).recip());
        for i in 1..STAGES {
            self.base.copy_from_slice(&self.start);
            self.predicted_rate.fill(0.0);
            for j in 0..i {
                let (a, p) = (h * A[i][j], PREDICTOR[i][j]);
                let rate = &self.rates[j * n..(j + 1) * n];
                for ((base, guess), rate) in self.base.iter_mut().zip(self.predicted_rate.iter_mut()).zip(rate) {
                    *base += a * rate;
                    *guess += p * rate;
                }
            }
            if i == 1 {
                let ahead = C[1] * h * per_old_step;
                if ahead <= C[1] * MOST_GROWTH_PREDICTED {
                    for k in 0..n {
                        self.predicted_rate[k] += ahead * (self.bend[k] + ahead * self.twist[k]);
                    }
                }
            }
            for k in 0..n {
                self.predicted[k] = self.base[k] + h * GAMMA * self.predicted_rate[k];
            }
            let at = Prediction { t: from + C[i] * h, leading, y: &self.predicted, yp: &self.predicted_rate };
            let outcome = self.corrector.correct(problem, &at, weights);
            if outcome != Correction::Converged {
                return outcome;
            }
            self.rates[i * n..(i + 1) * n].copy_from_slice(&self.corrector.yp);
        }
        Correction::Converged
    }

    /// The error of the attempt in tolerances; `error` is left as what it was measured by.
    fn estimate(&mut self, weights: &Weights) -> f64 {
        self.combine(difference);
        let plain = weights.tested_norm(&self.error);
        if self.forgiving > 0 {
            if plain <= 1.0 {
                return plain;
            }
            self.corrector.filter(&mut self.error);
            return weights.tested_norm(&self.error).max(plain / FORGIVEN).min(plain);
        }
        std::mem::swap(&mut self.error, &mut self.kink);
        self.combine(kink);
        let bent = weights.tested_norm(&self.error);
        // Not a number counts as the larger one.
        if bent <= plain {
            std::mem::swap(&mut self.error, &mut self.kink);
            return plain;
        }
        bent
    }

    /// `error := h sum_i w_i K_i`.
    fn combine(&mut self, weight: fn(usize) -> f64) {
        self.error.fill(0.0);
        for i in 0..STAGES {
            let d = self.h * weight(i);
            if d != 0.0 {
                let rate = &self.rates[i * self.n..(i + 1) * self.n];
                for (error, rate) in self.error.iter_mut().zip(rate) {
                    *error += d * rate;
                }
            }
        }
        if self.has_algebraic {
            self.follow_states();
        }
    }

    /// Algebraic unknowns follow the states, and so do their errors: the formal ones of their `K` amplify what is rough in
    /// inputs or in the past, and no smaller step makes them small.
    fn follow_states(&mut self) {
        self.filtered.copy_from_slice(&self.error);
        self.corrector.filter(&mut self.filtered);
        for (k, is_state) in self.states.iter().enumerate() {
            if !is_state {
                self.error[k] = self.filtered[k];
            }
        }
    }

    /// The unknown whose error was the largest of the last step.
    pub(crate) fn dominant(&self, weights: &Weights) -> Option<usize> {
        weights.worst(&self.error)
    }

    fn accept(&mut self, target: f64, error: f64) {
        self.forgiving = self.forgiving.saturating_sub(1);
        self.y.copy_from_slice(&self.corrector.y);
        self.yp.copy_from_slice(&self.corrector.yp);
        (self.t_before, self.t, self.h_used) = (self.t, target, self.h);
        self.h = (self.h * self.control.after_success(error)).min(self.max_step);
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
                StepFault::Error => weights.worst(&self.error),
                _ => self.corrector.worst_unknown(weights, true),
            },
        }
    }
}

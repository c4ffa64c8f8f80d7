//! The error of an attempt.
//!
//! Plain differences of the two results for states; algebraic unknowns follow the states.  A second combination of the rates sees kinks
//! within the step (see [`super::tableau`]).

use super::tableau::{STAGES, difference, kink};
use crate::corrector::Corrector;
use crate::weights::Weights;

/// Steps after a handover from BDF in which stiff noise is stepped over, and how much of it at most, in tolerances.
const FORGIVING_STEPS: u32 = 8;
const FORGIVEN: f64 = 10.0;

/// What the error of a step is measured by.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct Estimate {
    /// Of the last attempt.
    pub(super) error: Vec<f64>,
    /// What kinks of the rates contribute to it.
    kink: Vec<f64>,
    filtered: Vec<f64>,
    /// Unknowns that are states now.
    states: Vec<bool>,
    has_algebraic: bool,
    /// Steps to come with the filtered error.
    forgiving: u32,
}

impl Estimate {
    /// For unknowns of which these are states.
    pub(super) fn new(states: &[bool]) -> Self {
        let zeros = || vec![0.0; states.len()];
        Self {
            error: zeros(),
            kink: zeros(),
            filtered: zeros(),
            states: states.to_vec(),
            has_algebraic: states.contains(&false),
            forgiving: 0,
        }
    }

    /// Before the first step; `noisy`: see [`super::Esdirk::restart`].
    pub(super) fn restart(&mut self, noisy: bool) {
        self.forgiving = if noisy { FORGIVING_STEPS } else { 0 };
    }

    /// Other unknowns are states from now on.
    pub(super) fn set_states(&mut self, states: &[bool]) {
        self.states.copy_from_slice(states);
        self.has_algebraic = states.contains(&false);
    }

    /// A step has been accepted.
    pub(super) fn accepted(&mut self) {
        self.forgiving = self.forgiving.saturating_sub(1);
    }

    /// The error of the attempt with these rates, one stage after the other, in tolerances; `error` is left as what it was measured by.
    pub(super) fn measure(&mut self, corrector: &mut Corrector, (h, rates): (f64, &[f64]), weights: &Weights) -> f64 {
        self.combine(corrector, (h, rates), difference);
        let plain = weights.tested_norm(&self.error);
        if self.forgiving > 0 {
            if plain <= 1.0 {
                return plain;
            }
            corrector.filter(&mut self.error);
            return weights.tested_norm(&self.error).max(plain / FORGIVEN).min(plain);
        }
        std::mem::swap(&mut self.error, &mut self.kink);
        self.combine(corrector, (h, rates), kink);
        let bent = weights.tested_norm(&self.error);
        // Not a number counts as the larger one.
        if bent <= plain {
            std::mem::swap(&mut self.error, &mut self.kink);
            return plain;
        }
        bent
    }

    /// `error := h sum_i w_i K_i`.
    fn combine(&mut self, corrector: &mut Corrector, (h, rates): (f64, &[f64]), weight: fn(usize) -> f64) {
        self.error.fill(0.0);
        let n = self.error.len();
        for i in 0..STAGES {
            let d = h * weight(i);
            if d != 0.0 {
                for (error, rate) in self.error.iter_mut().zip(&rates[i * n..(i + 1) * n]) {
                    *error += d * rate;
                }
            }
        }
        if self.has_algebraic {
            self.follow_states(corrector);
        }
    }

    /// Algebraic unknowns follow the states, and so do their errors: the formal ones of their `K` amplify what is rough in
    /// inputs or in the past, and no smaller step makes them small.
    fn follow_states(&mut self, corrector: &mut Corrector) {
        self.filtered.copy_from_slice(&self.error);
        corrector.filter(&mut self.filtered);
        for (k, is_state) in self.states.iter().enumerate() {
            if !is_state {
                self.error[k] = self.filtered[k];
            }
        }
    }
}

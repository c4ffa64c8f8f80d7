//! State events: the first change of a root function's sign within a step.
//!
//! The sign of each root function is compared with the held truth of its relation (`value > 0` is true).  A change is
//! located on the dense output by the Illinois variant of regula falsi with bisection as a guard (Dowell, Jarratt, BIT 11
//! (1971) 168) until the bracket is a few units in the last place of t; the event is the right end, where the new
//! truth holds.  Every point tried is made consistent first, so that roots of algebraic unknowns see the values
//! that the event will see.  Two changes of one relation within a single step are not seen.

use hyd_system::{DaeSystem, Structure};

use crate::bdf::Bdf;
use crate::initial::consistent::Consistency;
use crate::problem::Problem;
use crate::weights::Weights;

/// Width of the final bracket: units in the last place of t, and a part of the step.
const TIME_ULPS: f64 = 4.0;
const STEP_PART: f64 = 1e-13;
/// A bracket is halved at least every so many evaluations.
const HALVING: u32 = 4;

/// Watches the root functions over a run.
pub(crate) struct RootWatch {
    held: Vec<bool>,
    /// The value was exactly zero on the wrong side just after the last event: zero is no change until it has moved.
    resting: Vec<bool>,
    left: Vec<f64>,
    right: Vec<f64>,
    trial: Vec<f64>,
    /// Relations that change at the event found last.
    pub(crate) fired: Vec<bool>,
    /// Values at the event found last, or at the last point tried.
    pub(crate) y: Vec<f64>,
    pub(crate) yp: Vec<f64>,
    trial_y: Vec<f64>,
    trial_yp: Vec<f64>,
}

impl RootWatch {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let (roots, n) = (structure.roots, structure.unknowns);
        Self {
            held: vec![false; roots],
            resting: vec![false; roots],
            left: vec![0.0; roots],
            right: vec![0.0; roots],
            trial: vec![0.0; roots],
            fired: vec![false; roots],
            y: vec![0.0; n],
            yp: vec![0.0; n],
            trial_y: vec![0.0; n],
            trial_yp: vec![0.0; n],
        }
    }

    /// Takes over held truths and values just after the start or an event.
    pub(crate) fn restart(&mut self, problem: &mut Problem<'_>, t: f64, y: &[f64], yp: &[f64]) {
        if self.held.is_empty() {
            return;
        }
        problem.system.held(&mut self.held);
        problem.system.roots(t, y, yp, &mut self.left);
        for k in 0..self.held.len() {
            self.resting[k] = self.left[k] == 0.0 && self.held[k];
        }
    }

    /// Time of the first change within the last step, with the values there in `y` and `yp`.
    pub(crate) fn check(
        &mut self,
        problem: &mut Problem<'_>,
        bdf: &Bdf,
        consistency: &mut Consistency,
        weights: &Weights,
    ) -> Option<f64> {
        if self.held.is_empty() {
            return None;
        }
        problem.system.roots(bdf.t(), bdf.y(), bdf.yp(), &mut self.right);
        if !mark(&self.right, &self.held, &self.resting, &mut self.fired) {
            self.advance();
            return None;
        }
        // The same point again, consistent this time.
        self.probe(problem, bdf, consistency, weights, bdf.t());
        self.right.copy_from_slice(&self.trial);
        std::mem::swap(&mut self.y, &mut self.trial_y);
        std::mem::swap(&mut self.yp, &mut self.trial_yp);
        if !mark(&self.right, &self.held, &self.resting, &mut self.fired) {
            self.advance();
            return None;
        }
        Some(self.locate(problem, bdf, consistency, weights))
    }

    fn advance(&mut self) {
        std::mem::swap(&mut self.left, &mut self.right);
        for (resting, value) in self.resting.iter_mut().zip(&self.left) {
            *resting &= *value == 0.0;
        }
    }

    /// Root functions at time `t` into `trial`, values into `trial_y`.
    fn probe(
        &mut self,
        problem: &mut Problem<'_>,
        bdf: &Bdf,
        consistency: &mut Consistency,
        weights: &Weights,
        t: f64,
    ) {
        bdf.interpolate(t, &mut self.trial_y, &mut self.trial_yp);
        consistency.refine(problem, (t, bdf.step_size()), weights, &mut self.trial_y, &mut self.trial_yp);
        problem.system.roots(t, &self.trial_y, &self.trial_yp, &mut self.trial);
    }

    /// Shrinks the bracket around the first change; `right`, `fired`, `y`, `yp` belong to its right end.
    fn locate(
        &mut self,
        problem: &mut Problem<'_>,
        bdf: &Bdf,
        consistency: &mut Consistency,
        weights: &Weights,
    ) -> f64 {
        let (mut a, mut b) = (bdf.t_before(), bdf.t());
        let width = TIME_ULPS * f64::EPSILON * a.abs().max(b.abs()) + STEP_PART * (b - a);
        let (mut weight_a, mut weight_b) = (1.0, 1.0);
        let mut last_right = None;
        let (mut evaluations, mut size_then) = (0, b - a);
        while b - a > width {
            evaluations += 1;
            let halve = evaluations % HALVING == 0 && b - a > 0.5 * size_then;
            if evaluations % HALVING == 0 {
                size_then = b - a;
            }
            let guess = if halve { 0.5 * (a + b) } else { self.secant(a, b, weight_a, weight_b) };
            let margin = 0.25 * width;
            let middle = guess.clamp(a + margin, b - margin);
            if middle <= a || middle >= b {
                break;
            }
            self.probe(problem, bdf, consistency, weights, middle);
            if mark(&self.trial, &self.held, &self.resting, &mut self.fired) {
                b = middle;
                std::mem::swap(&mut self.right, &mut self.trial);
                std::mem::swap(&mut self.y, &mut self.trial_y);
                std::mem::swap(&mut self.yp, &mut self.trial_yp);
                (weight_a, weight_b) = if last_right == Some(true) { (0.5 * weight_a, 1.0) } else { (1.0, 1.0) };
                last_right = Some(true);
            } else {
                a = middle;
                std::mem::swap(&mut self.left, &mut self.trial);
                (weight_a, weight_b) = if last_right == Some(false) { (1.0, 0.5 * weight_b) } else { (1.0, 1.0) };
                last_right = Some(false);
            }
        }
        mark(&self.right, &self.held, &self.resting, &mut self.fired);
        b
    }

    /// Earliest crossing of the chords of all relations that change within the bracket; the middle where a chord is no help.
    fn secant(&self, a: f64, b: f64, weight_a: f64, weight_b: f64) -> f64 {
        let mut earliest = b;
        for k in 0..self.held.len() {
            if !changed(self.right[k], self.held[k], self.resting[k]) {
                continue;
            }
            let (left, right) = (weight_a * self.left[k], weight_b * self.right[k]);
            let part = left / (left - right);
            let crossing = if (0.0..1.0).contains(&part) { a + part * (b - a) } else { 0.5 * (a + b) };
            earliest = earliest.min(crossing);
        }
        earliest
    }
}

fn changed(value: f64, held: bool, resting: bool) -> bool {
    (value > 0.0) != held && !(resting && value == 0.0)
}

/// Marks the relations that changed; true if there are any.
fn mark(values: &[f64], held: &[bool], resting: &[bool], fired: &mut [bool]) -> bool {
    let mut any = false;
    for k in 0..values.len() {
        fired[k] = changed(values[k], held[k], resting[k]);
        any |= fired[k];
    }
    any
}

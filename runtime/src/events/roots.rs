//! State events: the first change of a root function's sign within a step.
//!
//! The sign of each root function is compared with the held truth of its relation (`value > 0` is true).  A change is
//! located on the dense output by the Illinois variant of regula falsi with bisection as a guard (Dowell, Jarratt, BIT
//! 11 (1971) 168) until the bracket is a few units in the last place of t; the event is the right end, where the new
//! truth holds.  Every point tried is made consistent first, so that roots of algebraic unknowns see the values that
//! the event will see.  A relation that changes and changes back within a step is looked for at points between, no
//! farther apart than the output points, and at the bottom of the parabola through three of them where it comes close
//! to zero.

use hyd_system::{DaeSystem, Structure};

use crate::initial::consistent::Consistency;
use crate::integrator::Integrator;
use crate::problem::Problem;
use crate::weights::Weights;

/// Width of the final bracket: units in the last place of t, and a part of the step.
const TIME_ULPS: f64 = 4.0;
const STEP_PART: f64 = 1e-13;
/// A bracket is halved at least every so many evaluations.
const HALVING: u32 = 4;

/// Intervals into which a step is divided at most.
const MOST_PARTS: usize = 24;
/// A parabola whose bottom is below this part of its ends is looked at there.
const NEAR_ZERO: f64 = 0.4;
/// Relations that turn back within so many final brackets after an event belong to the same instant.
const SAME_INSTANT: f64 = 16.0;

/// Watches the root functions over a run.
pub(crate) struct RootWatch {
    held: Vec<bool>,
    /// The value was exactly zero on the wrong side just after the last event: zero is no change until it has moved.
    resting: Vec<bool>,
    left: Vec<f64>,
    right: Vec<f64>,
    trial: Vec<f64>,
    /// Values at the last three points between.
    samples: [Vec<f64>; 3],
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
            samples: std::array::from_fn(|_| vec![0.0; roots]),
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

    /// Time of the first change within the last step, with the values there in `y` and `yp`.  Changes that last longer than
    /// `spacing` (s) are never missed.
    pub(crate) fn check(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        spacing: f64,
    ) -> Option<f64> {
        if self.held.is_empty() {
            return None;
        }
        let (begin, end) = (past.t_before(), past.t());
        problem.system.roots(past.t(), past.y(), past.yp(), &mut self.right);
        if !mark(&self.right, &self.held, &self.resting, &mut self.fired) {
            return self.between(problem, past, consistency, weights, spacing);
        }
        // The same point again, consistent this time.
        if !self.confirmed(problem, past, consistency, weights, end) {
            self.right.copy_from_slice(&self.trial);
            self.advance();
            return None;
        }
        Some(self.locate(problem, past, consistency, weights, (begin, end)))
    }

    /// A change that is undone again before the end of the step.
    fn between(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        spacing: f64,
    ) -> Option<f64> {
        let (begin, end) = (past.t_before(), past.t());
        let parts = (((end - begin) / spacing).ceil() as usize).clamp(past.parts(), MOST_PARTS);
        let part = (end - begin) / parts as f64;
        self.samples[2].copy_from_slice(&self.left);
        for j in 1..=parts {
            let t = begin + j as f64 * part;
            self.samples.rotate_left(1);
            if j < parts {
                past.interpolate(t, &mut self.trial_y, &mut self.trial_yp);
                problem.system.roots(t, &self.trial_y, &self.trial_yp, &mut self.samples[2]);
            } else {
                self.samples[2].copy_from_slice(&self.right);
            }
            let flipped = j < parts && mark(&self.samples[2], &self.held, &self.resting, &mut self.fired);
            let bottom = if j > 1 { self.bottom().map(|place| t + (place - 1.0) * part) } else { None };
            let suspect = if flipped { Some(t) } else { bottom };
            if let Some(suspect) = suspect
                && self.confirmed(problem, past, consistency, weights, suspect)
            {
                return Some(self.locate(problem, past, consistency, weights, (begin, suspect)));
            }
        }
        self.advance();
        None
    }

    /// Where the first parabola through the last three points (at -1, 0, 1) that comes near zero has its bottom.
    fn bottom(&self) -> Option<f64> {
        let [a, b, c] = &self.samples;
        let place = |k: usize| {
            let sign = if self.held[k] { 1.0 } else { -1.0 };
            let (a, b, c) = (sign * a[k], sign * b[k], sign * c[k]);
            let (slope, bend) = (0.5 * (c - a), a - 2.0 * b + c);
            let inside = bend > 0.0 && slope.abs() < bend;
            let lowest = b - 0.5 * slope * slope / bend;
            (inside && lowest < NEAR_ZERO * a.min(c)).then(|| -slope / bend)
        };
        (0..self.held.len()).filter_map(place).min_by(f64::total_cmp)
    }

    /// True if a relation has changed at time `t` on consistent values, which then stand in `right`, `y` and `yp`.
    fn confirmed(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        t: f64,
    ) -> bool {
        self.probe(problem, past, consistency, weights, t);
        let changed = mark(&self.trial, &self.held, &self.resting, &mut self.fired);
        if changed {
            self.right.copy_from_slice(&self.trial);
            std::mem::swap(&mut self.y, &mut self.trial_y);
            std::mem::swap(&mut self.yp, &mut self.trial_yp);
        }
        changed
    }

    /// After an event at `t` with a `reinit`: moves `y` on by as much time as rounding leaves open, if a relation turns back within
    /// it (a ball just above its floor again).  Then that change belongs to the same instant.
    pub(crate) fn turn_back(
        &mut self,
        problem: &mut Problem<'_>,
        (t, h): (f64, f64),
        (y, yp, states): (&mut [f64], &[f64], &[bool]),
    ) -> bool {
        if self.held.is_empty() {
            return false;
        }
        problem.system.held(&mut self.held);
        problem.system.roots(t, y, yp, &mut self.trial);
        self.resting.fill(false);
        if mark(&self.trial, &self.held, &self.resting, &mut self.fired) {
            return false;
        }
        let ahead = SAME_INSTANT * (TIME_ULPS * f64::EPSILON * t.abs() + STEP_PART * h);
        for (k, value) in self.trial_y.iter_mut().enumerate() {
            *value = if states[k] { y[k] + ahead * yp[k] } else { y[k] };
        }
        problem.system.roots(t, &self.trial_y, yp, &mut self.trial);
        let turned = mark(&self.trial, &self.held, &self.resting, &mut self.fired);
        if turned {
            y.copy_from_slice(&self.trial_y);
        }
        turned
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
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        t: f64,
    ) {
        past.interpolate(t, &mut self.trial_y, &mut self.trial_yp);
        consistency.refine(problem, (t, past.step_size()), weights, &mut self.trial_y, &mut self.trial_yp);
        problem.system.roots(t, &self.trial_y, &self.trial_yp, &mut self.trial);
    }

    /// Shrinks the bracket `(a, b)` around the first change; `right`, `fired`, `y`, `yp` belong to its right end.
    fn locate(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        (mut a, mut b): (f64, f64),
    ) -> f64 {
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
            self.probe(problem, past, consistency, weights, middle);
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

//! The way down: Levenberg-Marquardt in the metric of the prior.
//!
//! Nocedal, Wright, "Numerical Optimization", 2nd ed., section 10.3.  Between fresh Jacobians the last one is corrected
//! by Broyden's rank-one update (Broyden 1965), because a Jacobian costs a run per unknown and shot and an update none;
//! a fit counts as converged only on a fresh one.  The matrix of the normal equations follows by rank two, which costs a product of the Jacobian
//! with one vector instead of one with itself.  A step changes no unknown by more than its limit, and none goes beyond its bounds.

use std::ops::ControlFlow;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::{Effort, Fit, Jacobian, squared};
use crate::Fault;
use crate::problem::{Problem, Runs, Weighing};

/// A step that promises less than this share of the distance to a rival does not catch up.
const CATCHING_UP: f64 = 0.02;

/// Damping at the start, the least, and that beyond which no step leads down.
const DAMPING: (f64, f64, f64) = (1e-3, 1e-6, 1e6);
/// Age of a Jacobian that has to be computed anew.
const OLD: usize = usize::MAX;

/// Minimises over all unknowns from `start`.  `known` is a Jacobian by the first unknowns with the weighing under which it was
/// computed, from a fit that is not far away; only the columns that it lacks are computed at first.
///
/// # Errors
/// When the model does not run at the start, or no derivative can be had.
pub(crate) fn minimise(
    problem: &Problem<'_>,
    start: &[f64],
    weighing: &Weighing,
    effort: Effort,
    known: Option<(&DMatrix<f64>, &Weighing)>,
) -> Result<Fit, Fault> {
    let free: Vec<usize> = (0..problem.unknowns.len()).collect();
    minimise_over(problem, start, weighing, &free, effort, known)
}

/// The same over the unknowns `free` only.
///
/// # Errors
/// As [`minimise`].
pub(crate) fn minimise_over(
    problem: &Problem<'_>,
    start: &[f64],
    weighing: &Weighing,
    free: &[usize],
    effort: Effort,
    known: Option<(&DMatrix<f64>, &Weighing)>,
) -> Result<Fit, Fault> {
    let start: Vec<f64> = problem.unknowns.iter().zip(start).map(|(own, &xi)| own.within(xi)).collect();
    let best = Fit::at(problem, &start, weighing)?;
    let (jacobian, age) = match known {
        Some(known) => (complete(problem, (&best.xi, &best.runs), weighing, known, effort.difference)?, 1),
        None => (DMatrix::zeros(0, 0), OLD),
    };
    let normal = squared(&jacobian);
    let damping = DAMPING.0;
    let mut descent = Descent { problem, weighing, free, effort, best, jacobian, normal, age, damping, failed: None };
    while descent.best.steps < effort.steps && descent.step()?.is_continue() {}
    Ok(descent.end())
}

/// A fit under way.
struct Descent<'a> {
    problem: &'a Problem<'a>,
    weighing: &'a Weighing,
    free: &'a [usize],
    effort: Effort,
    best: Fit,
    jacobian: DMatrix<f64>,
    /// The Jacobian, transposed, times itself.
    normal: DMatrix<f64>,
    /// Steps since the Jacobian was computed.
    age: usize,
    damping: f64,
    /// Why the model did not run at the last attempt, if it did not.
    failed: Option<Fault>,
}

impl Descent<'_> {
    /// A fresh Jacobian is worth its runs here.
    fn is_worthwhile(&self) -> bool {
        self.best.cost <= self.effort.worthwhile || self.jacobian.is_empty()
    }

    /// One attempt to go further down.
    fn step(&mut self) -> Result<ControlFlow<()>, Fault> {
        let is_worthwhile = self.is_worthwhile();
        if self.age >= self.effort.reuse && is_worthwhile {
            let at = (self.best.xi.as_slice(), &self.best.runs);
            self.jacobian = self.problem.jacobian(at, self.weighing, self.free, self.effort.difference)?;
            self.normal = squared(&self.jacobian);
            self.age = 0;
        }
        let (normal, gradient) = self.equations();
        let Some((step, promised)) = damped_step(&normal, &gradient, self.damping, self.effort.step_limit) else {
            return Ok(ControlFlow::Break(()));
        };
        if promised < CATCHING_UP * (self.best.cost - self.effort.rival) {
            self.best.converged = self.age == 0 && promised < self.effort.gain;
            return Ok(ControlFlow::Break(()));
        }
        if promised < self.effort.gain {
            self.best.converged = self.age == 0;
            let is_over = self.age == 0 || !is_worthwhile;
            self.age = if is_over { self.age } else { OLD };
            return Ok(if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) });
        }
        Ok(self.attempt(&step, promised, is_worthwhile))
    }

    /// The normal equations: matrix and gradient.
    fn equations(&self) -> (DMatrix<f64>, DVector<f64>) {
        let mut gradient = self.jacobian.tr_mul(&self.best.residuals);
        for (k, &unknown) in self.free.iter().enumerate() {
            gradient[k] += self.best.xi[unknown];
        }
        let mut normal = self.normal.clone();
        // What stands at the end of where it may go and would go on is held (Bertsekas 1982: projected Newton methods).
        for (k, &unknown) in self.free.iter().enumerate() {
            let (low, high) = self.problem.unknowns[unknown].bounds;
            let xi = self.best.xi[unknown];
            if xi <= low && gradient[k] > 0.0 || xi >= high && gradient[k] < 0.0 {
                gradient[k] = 0.0;
                normal.row_mut(k).fill(0.0);
                normal.column_mut(k).fill(0.0);
            }
        }
        (normal, gradient)
    }

    /// Takes the step if it leads down; holds the next one shorter, or asks for a fresh Jacobian, if not.
    fn attempt(&mut self, step: &DVector<f64>, promised: f64, is_worthwhile: bool) -> ControlFlow<()> {
        let mut xi = self.best.xi.clone();
        for (&unknown, change) in self.free.iter().zip(step.iter()) {
            xi[unknown] = self.problem.unknowns[unknown].within(xi[unknown] + change);
        }
        self.best.steps += 1;
        match Fit::at(self.problem, &xi, self.weighing) {
            Ok(next) if next.cost < self.best.cost => self.take(next, promised),
            next => {
                self.failed = next.err();
                self.damping = (self.damping * 8.0).max(1e-2);
                if self.age > 0 && (is_worthwhile || self.damping < DAMPING.2) {
                    self.age = OLD;
                } else if self.damping > DAMPING.2 {
                    // On a fresh Jacobian no step leads down: the floor of what differences can see.
                    self.best.converged = promised < 20.0 * self.effort.gain;
                    return ControlFlow::Break(());
                }
            }
        }
        self.damping = self.damping.max(DAMPING.1);
        ControlFlow::Continue(())
    }

    /// Goes on from a lower point, the Jacobian corrected by what it did not foresee.
    fn take(&mut self, next: Fit, promised: f64) {
        let ratio = (self.best.cost - next.cost) / promised;
        let moved = self.free.iter().map(|&k| next.xi[k] - self.best.xi[k]);
        let moved = DVector::from_iterator(self.free.len(), moved);
        let error = &next.residuals - &self.best.residuals - &self.jacobian * &moved;
        let weight = 1.0 / moved.norm_squared().max(1e-300);
        corrected(&mut self.normal, (&self.jacobian, &error), &moved, weight);
        self.jacobian.ger(weight, &error, &moved, 1.0);
        self.damping = if ratio > 0.6 { self.damping * 0.2 } else { self.damping };
        self.age = if ratio < 0.3 { OLD } else { self.age.saturating_add(1) };
        self.best = Fit { steps: self.best.steps, ..next };
        self.failed = None;
    }

    /// Why the model cannot be run further down, where steps held short for that alone have ended the way.
    fn wall(&mut self) -> Option<String> {
        let failed = self.failed.take()?;
        if self.jacobian.is_empty() {
            return None;
        }
        let (normal, gradient) = self.equations();
        let (_, promised) = damped_step(&normal, &gradient, DAMPING.0, self.effort.step_limit)?;
        (promised >= self.effort.gain).then(|| failed.to_string())
    }

    fn end(mut self) -> Fit {
        let wall = self.wall();
        let fresh = self.age == 0 && self.free.len() == self.problem.unknowns.len();
        Fit { wall, fresh, jacobian: Some(Jacobian::new(self.jacobian, self.free.to_vec())), ..self.best }
    }
}

/// What `J'J` becomes when `weight error moved'` is added to `J`.
fn corrected(
    normal: &mut DMatrix<f64>,
    (jacobian, error): (&DMatrix<f64>, &DVector<f64>),
    moved: &DVector<f64>,
    weight: f64,
) {
    // Half of the square stands in either of the two products that mirror each other, so that the matrix stays symmetric to the bit.
    let half = weight * (jacobian.tr_mul(error) + 0.5 * weight * error.norm_squared() * moved);
    for i in 0..normal.nrows() {
        for k in 0..=i {
            normal[(i, k)] += half[i] * moved[k] + moved[i] * half[k];
            normal[(k, i)] = normal[(i, k)];
        }
    }
}

/// A Jacobian of which the first columns are known under another weighing.
fn complete(
    problem: &Problem<'_>,
    at: (&[f64], &Runs),
    weighing: &Weighing,
    (known, under): (&DMatrix<f64>, &Weighing),
    difference: f64,
) -> Result<DMatrix<f64>, Fault> {
    let new: Vec<usize> = (known.ncols()..problem.unknowns.len()).collect();
    let added = problem.jacobian(at, weighing, &new, difference)?;
    let mut jacobian = DMatrix::zeros(known.nrows(), problem.unknowns.len());
    let (now, then) = (problem.all_weights(weighing), problem.all_weights(under));
    for (k, column) in known.column_iter().enumerate() {
        let scaled = column.iter().zip(now.iter().zip(&then));
        let scaled = scaled.map(|(value, (now, then))| if *then > 0.0 { value * now / then } else { 0.0 });
        jacobian.set_column(k, &DVector::from_iterator(known.nrows(), scaled));
    }
    for (k, column) in new.into_iter().zip(added.column_iter()) {
        jacobian.set_column(k, &column);
    }
    Ok(jacobian)
}

/// The step of the damped normal equations with the prior's unit matrix, held within `limit`, and what it promises.
fn damped_step(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
    limit: f64,
) -> Option<(DVector<f64>, f64)> {
    let mut matrix = normal.clone();
    for k in 0..matrix.nrows() {
        matrix[(k, k)] += 1.0 + damping * (1.0 + normal[(k, k)]);
    }
    let mut step = -Cholesky::new(matrix)?.solve(gradient);
    let largest = step.amax();
    if !largest.is_finite() {
        return None;
    }
    if largest > limit {
        step *= limit / largest;
    }
    let curved = step.dot(&(normal * &step)) + step.norm_squared();
    Some((step.clone(), -(2.0 * gradient.dot(&step) + curved)))
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{corrected, squared};

    #[test]
    fn normal_equations_follow_a_corrected_jacobian() {
        let mut jacobian = DMatrix::from_fn(40, 5, |i, k| ((3 * i + 7 * k) as f64).sin() + 0.1 * k as f64);
        let error = DVector::from_fn(40, |i, _| (0.7 * i as f64).cos());
        let moved = DVector::from_fn(5, |k, _| 0.3 - 0.2 * k as f64);
        let (mut normal, weight) = (squared(&jacobian), 1.0 / moved.norm_squared());
        corrected(&mut normal, (&jacobian, &error), &moved, weight);
        jacobian.ger(weight, &error, &moved, 1.0);
        assert!((&normal - jacobian.transpose() * &jacobian).amax() < 1e-12 * normal.amax());
        assert_eq!(normal, normal.transpose());
    }
}

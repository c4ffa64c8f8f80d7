//! Maximum a posteriori fits: Levenberg-Marquardt in the metric of the prior.
//!
//! Minimises `C = r'r + xi'xi` (Nocedal, Wright, "Numerical Optimization", 2nd ed., section 10.3).  Between fresh Jacobians the last
//! one is corrected by Broyden's rank-one update (Broyden 1965), because a Jacobian costs a run per unknown and shot and an
//! update none; a fit counts as converged only on a fresh one.  A step changes no unknown by more than its limit.

pub mod profile;
pub mod schedule;

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::Fault;
use crate::problem::{Problem, Runs, Weighing};
use crate::unknowns::LIMIT;

/// How hard to try.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most steps.
    pub steps: usize,
    /// Converged when the next step promises less than this (units of the cost).
    pub gain: f64,
    /// Step of the differences in standard deviations.
    pub difference: f64,
    /// Largest change of an unknown in one step, in standard deviations.
    pub step_limit: f64,
    /// Steps for which a Jacobian is corrected before it is computed anew.
    pub reuse: usize,
    /// At a cost above this a known Jacobian is never computed anew: what ends there is of no interest.
    pub worthwhile: f64,
    /// Cost of a fit of something else with which this one competes: it is followed only as long as it catches up.
    pub rival: f64,
}

/// A step that promises less than this share of the distance to a rival does not catch up.
const CATCHING_UP: f64 = 0.02;

impl Effort {
    /// For stages on the way.
    pub const SHORT: Effort = Effort { steps: 5, gain: 2.0, difference: 0.1, ..Effort::FULL };
    /// For what is reported.
    pub const FULL: Effort = Effort {
        steps: 20,
        gain: 0.2,
        difference: 0.05,
        step_limit: 1.5,
        reuse: 4,
        worthwhile: f64::INFINITY,
        rival: f64::INFINITY,
    };

    /// Along valleys that bend, where a part of the misfit is explained already and the rest is worth the time.
    pub const LONG: Effort = Effort { steps: 60, reuse: 2, ..Effort::FULL };

    /// The same against a rival of this cost.
    pub fn against(self, rival: f64) -> Self {
        Self { rival, ..self }
    }
}

/// A fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The unknowns.
    pub xi: Vec<f64>,
    /// Channels at the unknowns.
    pub runs: Runs,
    /// Residuals there.
    pub residuals: DVector<f64>,
    /// Sum of squares and of the prior.
    pub cost: f64,
    /// Sum of squares.
    pub misfit: f64,
    /// The last step promised less than asked for.
    pub converged: bool,
    /// Steps taken.
    pub steps: usize,
    /// The last Jacobian, with the unknowns of its columns.
    pub jacobian: Option<(DMatrix<f64>, Vec<usize>)>,
    /// It is by all unknowns, and was computed at this very point.
    pub fresh: bool,
}

impl Fit {
    /// Evaluates the problem at `xi`.
    ///
    /// # Errors
    /// A run that failed.
    pub fn at(problem: &Problem<'_>, xi: &[f64], weighing: &Weighing) -> Result<Self, Fault> {
        let runs = problem.simulate(xi, weighing)?;
        let residuals = problem.residuals(xi, &runs, weighing);
        let misfit = residuals.norm_squared();
        let cost = misfit + xi.iter().map(|x| x * x).sum::<f64>();
        Ok(Self {
            xi: xi.to_vec(),
            runs,
            residuals,
            cost,
            misfit,
            converged: false,
            steps: 0,
            jacobian: None,
            fresh: false,
        })
    }

    /// Covariance of the unknowns at the minimum, `(J'J + I)^-1`, in the order of the Jacobian's columns.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let (jacobian, _) = self.jacobian.as_ref()?;
        let mut normal = squared(jacobian);
        for k in 0..normal.nrows() {
            normal[(k, k)] += 1.0;
        }
        Cholesky::new(normal).map(|factor| factor.inverse())
    }

    /// How many standard errors lie between some unknowns and others that are so far `away`, with a third sort held where they are:
    /// `sqrt(a'Ia)` with the information `I` on them when all else follows (Wald 1943).
    pub fn errors_beside(&self, unknowns: &[usize], away: &[f64], held: &[usize]) -> Option<f64> {
        let columns = &self.jacobian.as_ref()?.1;
        let place = |unknown: &usize| columns.iter().position(|own| own == unknown);
        let mut places: Vec<usize> = unknowns.iter().map(place).collect::<Option<_>>()?;
        // What is no column was held all along.
        places.extend(held.iter().filter_map(place));
        let covariance = self.covariance()?;
        // What is known of some when all else follows them is the inverse of their part of the covariance.
        let part = DMatrix::from_fn(places.len(), places.len(), |i, k| covariance[(places[i], places[k])]);
        let information = Cholesky::new(part)?.inverse();
        let sum = |i: usize| -> f64 { (0..away.len()).map(|k| away[i] * information[(i, k)] * away[k]).sum() };
        Some((0..away.len()).map(sum).sum::<f64>().max(0.0).sqrt())
    }

    /// Where the other unknowns go, to first order, when some are moved back by `away` and the rest follows to the minimum.
    pub fn moved_back(&self, unknowns: &[usize], away: &[f64]) -> Option<Vec<f64>> {
        let columns = &self.jacobian.as_ref()?.1;
        let place = |unknown: &usize| columns.iter().position(|own| own == unknown);
        let places: Vec<usize> = unknowns.iter().map(place).collect::<Option<_>>()?;
        let covariance = self.covariance()?;
        let part = DMatrix::from_fn(places.len(), places.len(), |i, k| covariance[(places[i], places[k])]);
        let pulls = Cholesky::new(part)?.solve(&DVector::from_column_slice(away));
        let mut xi = self.xi.clone();
        for (column, &unknown) in columns.iter().enumerate() {
            let change: f64 = places.iter().zip(pulls.iter()).map(|(&k, pull)| covariance[(column, k)] * pull).sum();
            xi[unknown] = (xi[unknown] - change).clamp(-LIMIT, LIMIT);
        }
        Some(xi)
    }

    /// Standard error of an unknown in its standard deviations.
    pub fn standard_error(&self, unknown: usize) -> Option<f64> {
        let column = self.jacobian.as_ref()?.1.iter().position(|&own| own == unknown)?;
        self.covariance().map(|covariance| covariance[(column, column)].max(0.0).sqrt())
    }
}

/// Minimises over all unknowns from `start`.  `known` is a Jacobian by the first unknowns with the weighing under which it was
/// computed, from a fit that is not far away; only the columns that it lacks are computed at first.
///
/// # Errors
/// When the model does not run at the start, or no derivative can be had.
pub fn minimise(
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
pub fn minimise_over(
    problem: &Problem<'_>,
    start: &[f64],
    weighing: &Weighing,
    free: &[usize],
    effort: Effort,
    known: Option<(&DMatrix<f64>, &Weighing)>,
) -> Result<Fit, Fault> {
    let mut best = Fit::at(problem, start, weighing)?;
    let mut damping = 1e-3;
    let mut age = usize::MAX;
    let mut jacobian = DMatrix::zeros(0, 0);
    if let Some((known, under)) = known {
        jacobian = complete(problem, (&best.xi, &best.runs), weighing, (known, under), effort.difference)?;
        age = 1;
    }
    while best.steps < effort.steps {
        let worthwhile = best.cost <= effort.worthwhile || jacobian.is_empty();
        if age >= effort.reuse && worthwhile {
            jacobian = problem.jacobian((&best.xi, &best.runs), weighing, free, effort.difference)?;
            age = 0;
        }
        let normal = squared(&jacobian);
        let mut gradient = jacobian.tr_mul(&best.residuals);
        for (k, &unknown) in free.iter().enumerate() {
            gradient[k] += best.xi[unknown];
        }
        let Some((step, promised)) = damped_step(&normal, &gradient, damping, effort.step_limit) else { break };
        if promised < CATCHING_UP * (best.cost - effort.rival) {
            best.converged = age == 0 && promised < effort.gain;
            break;
        }
        if promised < effort.gain {
            if age == 0 {
                best.converged = true;
                break;
            }
            if !worthwhile {
                break;
            }
            age = usize::MAX;
            continue;
        }
        let mut xi = best.xi.clone();
        for (&unknown, change) in free.iter().zip(step.iter()) {
            xi[unknown] = (xi[unknown] + change).clamp(-LIMIT, LIMIT);
        }
        best.steps += 1;
        match Fit::at(problem, &xi, weighing) {
            Ok(next) if next.cost < best.cost => {
                let ratio = (best.cost - next.cost) / promised;
                let moved = DVector::from_iterator(free.len(), free.iter().map(|&k| xi[k] - best.xi[k]));
                let error = &next.residuals - &best.residuals - &jacobian * &moved;
                jacobian.ger(1.0 / moved.norm_squared().max(1e-300), &error, &moved, 1.0);
                damping = if ratio > 0.6 { damping * 0.2 } else { damping };
                age = if ratio < 0.3 { usize::MAX } else { age.saturating_add(1) };
                best = Fit { steps: best.steps, ..next };
            }
            _ => {
                damping = (damping * 8.0).max(1e-2);
                if age > 0 && (worthwhile || damping < 1e6) {
                    age = usize::MAX;
                } else if damping > 1e6 {
                    // On a fresh Jacobian no step leads down: the floor of what differences can see.
                    best.converged = promised < 20.0 * effort.gain;
                    break;
                }
            }
        }
        damping = damping.max(1e-6);
    }
    best.fresh = age == 0 && free.len() == problem.unknowns.len();
    best.jacobian = Some((jacobian, free.to_vec()));
    Ok(best)
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

/// `J'J`.  The product of a transposed copy is one of blocks, several times as fast as one of columns with each other.
pub(crate) fn squared(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    jacobian.transpose() * jacobian
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

    use super::Fit;

    /// With one unknown held and one free to follow, what is left of the information on the first is the Schur complement.
    #[test]
    fn errors_beside_held_unknowns_are_those_of_the_smaller_problem() {
        let jacobian = DMatrix::from_fn(30, 3, |i, k| match k {
            0 => (0.3 * i as f64).sin(),
            1 => (0.3 * i as f64).sin() + 0.01 * (1.7 * i as f64).cos(),
            _ => 0.1 * i as f64,
        });
        let normal = jacobian.transpose() * &jacobian + DMatrix::identity(3, 3);
        let fit = Fit {
            xi: vec![0.0; 3],
            runs: Vec::new(),
            residuals: nalgebra::DVector::zeros(30),
            cost: 0.0,
            misfit: 0.0,
            converged: true,
            steps: 0,
            jacobian: Some((jacobian, vec![0, 1, 2])),
            fresh: true,
        };
        let schur = normal[(0, 0)] - normal[(0, 2)].powi(2) / normal[(2, 2)];
        let errors = fit.errors_beside(&[0], &[2.0], &[1]).expect("a Jacobian");
        assert!((errors - 2.0 * schur.sqrt()).abs() < 1e-12 * errors, "{errors}");
        // The two first columns are all but one, so that either alone is far better known than beside the other.
        let error = fit.standard_error(0).expect("a Jacobian");
        assert!(errors > 2.0 * 2.0 / error);
        let free = fit.errors_beside(&[0], &[2.0], &[]).expect("a Jacobian");
        assert!((free * error / 2.0 - 1.0).abs() < 1e-12);
        // Moved back, the first is where it should be and the gradient by the others stays what it was.
        let moved = DVector::from_vec(fit.moved_back(&[0], &[2.0]).expect("a Jacobian"));
        let slope = &normal * &moved;
        assert!((moved[0] + 2.0).abs() < 1e-9 && slope[1].abs() < 1e-9 && slope[2].abs() < 1e-9, "{moved} {slope}");
        // Both together, the third free: the Schur complement by the third.
        let both = fit.errors_beside(&[0, 1], &[2.0, -1.0], &[]).expect("a Jacobian");
        let part = |i: usize, k: usize| normal[(i, k)] - normal[(i, 2)] * normal[(k, 2)] / normal[(2, 2)];
        let square = 4.0 * part(0, 0) - 4.0 * part(0, 1) + part(1, 1);
        assert!((both - square.sqrt()).abs() < 1e-9 * both, "{both}");
    }
}

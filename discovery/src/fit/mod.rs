//! Maximum a posteriori fits: how hard to try ([`Effort`]), the way down ([`minimise`]), and what is known where it ends ([`Fit`]).
//!
//! Minimises `C = r'r + xi'xi` with `xi` in standard deviations of the prior, so that the prior is a unit matrix in the
//! normal equations.

mod descent;
mod jacobian;
pub(crate) mod profile;
pub(crate) mod schedule;

pub(crate) use descent::{minimise, minimise_over};
pub(crate) use jacobian::{Jacobian, normal, squared};
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::Fault;
use crate::problem::{Problem, Runs, Weighing};
use crate::unknowns::LIMIT;

/// How hard to try.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
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

impl Effort {
    /// For stages on the way.
    pub(crate) const SHORT: Effort = Effort { steps: 5, gain: 2.0, difference: 0.1, ..Effort::FULL };
    /// For what is reported.
    pub(crate) const FULL: Effort = Effort {
        steps: 20,
        gain: 0.2,
        difference: 0.05,
        step_limit: 1.5,
        reuse: 4,
        worthwhile: f64::INFINITY,
        rival: f64::INFINITY,
    };

    /// Along a narrow curved minimum, where a part of the misfit is explained already and the rest is worth the time.
    pub(crate) const LONG: Effort = Effort { steps: 60, reuse: 2, ..Effort::FULL };

    /// The same against a rival of this cost.
    pub(crate) fn against(self, rival: f64) -> Self {
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
    /// The last Jacobian.
    pub(crate) jacobian: Option<Jacobian>,
    /// It is by all unknowns, and was computed at this very point.
    pub fresh: bool,
    /// Why the model does not run further down, where that and no minimum has ended the fit.
    pub wall: Option<String>,
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
        if !misfit.is_finite() {
            return Err(problem.overflow(xi, &runs, weighing));
        }
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
            wall: None,
        })
    }

    /// Forgets the derivatives but for what they say of the unknowns: they are megabytes of every fit.
    pub(crate) fn forget_derivatives(&mut self) {
        if let Some(own) = &self.jacobian {
            (self.jacobian, self.fresh) = (Some(own.summary()), false);
        }
    }

    /// How many standard errors lie between some unknowns and others that are so far `away`, with a third sort held where they are:
    /// `sqrt(a'Ia)` with the information `I` on them when all else follows (Wald 1943).
    pub fn errors_beside(&self, unknowns: &[usize], away: &[f64], held: &[usize]) -> Option<f64> {
        let jacobian = self.jacobian.as_ref()?;
        let place = |unknown: &usize| jacobian.unknowns.iter().position(|own| own == unknown);
        let mut places: Vec<usize> = unknowns.iter().map(place).collect::<Option<_>>()?;
        // What is not a column was held all along.
        places.extend(held.iter().filter_map(place));
        let covariance = jacobian.covariance()?;
        // What is known of some when all else follows them is the inverse of their part of the covariance.
        let part = DMatrix::from_fn(places.len(), places.len(), |i, k| covariance[(places[i], places[k])]);
        let information = Cholesky::new(part)?.inverse();
        let sum = |i: usize| -> f64 { (0..away.len()).map(|k| away[i] * information[(i, k)] * away[k]).sum() };
        Some((0..away.len()).map(sum).sum::<f64>().max(0.0).sqrt())
    }

    /// Where the other unknowns go, to first order, when some are moved back by `away` and the rest follows to the minimum.
    pub fn moved_back(&self, unknowns: &[usize], away: &[f64]) -> Option<Vec<f64>> {
        let jacobian = self.jacobian.as_ref()?;
        let place = |unknown: &usize| jacobian.unknowns.iter().position(|own| own == unknown);
        let places: Vec<usize> = unknowns.iter().map(place).collect::<Option<_>>()?;
        let covariance = jacobian.covariance()?;
        let part = DMatrix::from_fn(places.len(), places.len(), |i, k| covariance[(places[i], places[k])]);
        let pulls = Cholesky::new(part)?.solve(&DVector::from_column_slice(away));
        let mut xi = self.xi.clone();
        for (column, &unknown) in jacobian.unknowns.iter().enumerate() {
            let change: f64 = places.iter().zip(pulls.iter()).map(|(&k, pull)| covariance[(column, k)] * pull).sum();
            xi[unknown] = (xi[unknown] - change).clamp(-LIMIT, LIMIT);
        }
        Some(xi)
    }

    /// Standard error of an unknown in its standard deviations.
    pub fn standard_error(&self, unknown: usize) -> Option<f64> {
        let jacobian = self.jacobian.as_ref()?;
        let column = jacobian.unknowns.iter().position(|&own| own == unknown)?;
        jacobian.covariance().map(|covariance| covariance[(column, column)].max(0.0).sqrt())
    }

    /// The same of an unknown with all others held where they are.
    pub(crate) fn error_alone(&self, unknown: usize) -> Option<f64> {
        let jacobian = self.jacobian.as_ref()?;
        let column = jacobian.unknowns.iter().position(|&own| own == unknown)?;
        Some(1.0 / (1.0 + jacobian.matrix.column(column).norm_squared()).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{Fit, Jacobian};

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
            jacobian: Some(Jacobian::new(jacobian, vec![0, 1, 2])),
            fresh: true,
            wall: None,
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

//! What is left of a signature when the nuisances have taken their share.
//!
//! With the Jacobian `J` of the residuals by the nuisances and their unit prior, `P = I - J (J'J + I)^-1 J'` takes out all that
//! nuisances can imitate.  For residuals `r` and a signature `d` (the change of the residuals when an effect is switched on) the best
//! amplitude is `a = -d'Pr/d'Pd`, and the cost falls by `(d'Pr)^2/(d'Pd)`: the score test (Rao 1948) with a prior.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::fit::{Fit, squared};

/// A fit seen through the projection of its nuisances.
pub struct Projection<'a> {
    jacobian: &'a DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    residuals: &'a DVector<f64>,
    /// `(J'J + I)^-1 (J'r + xi)`.
    pull: DVector<f64>,
}

/// A signature held against residuals.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Score {
    /// `d'Pd`: the fall of the cost that an effect of this size would bring, were it the truth.
    pub power: f64,
    /// Best amplitude in units of the signature, from `from` to `to`.
    pub amplitude: f64,
    /// Fall of the cost at that amplitude.
    pub gain: f64,
    /// Share of `d'd` that the nuisances leave.
    pub left: f64,
    /// Fall of the sum of squares alone, at the amplitude best for that, were the nuisances held where they are.
    pub alone: f64,
}

impl<'a> Projection<'a> {
    /// None where the fit has no Jacobian.
    pub fn new(fit: &'a Fit) -> Option<Self> {
        let (jacobian, columns) = fit.jacobian.as_ref()?;
        let mut normal = squared(jacobian);
        for k in 0..normal.nrows() {
            normal[(k, k)] += 1.0;
        }
        let factor = Cholesky::new(normal)?;
        let mut gradient = jacobian.tr_mul(&fit.residuals);
        for (k, &unknown) in columns.iter().enumerate() {
            gradient[k] += fit.xi[unknown];
        }
        let pull = factor.solve(&gradient);
        Some(Self { jacobian, factor, residuals: &fit.residuals, pull })
    }

    /// `a'Pb`.
    pub fn inner(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        let (ja, jb) = (self.jacobian.tr_mul(a), self.jacobian.tr_mul(b));
        a.dot(b) - ja.dot(&self.factor.solve(&jb))
    }

    /// Scores a signature; amplitudes beyond the ends count as the ends.
    pub fn score(&self, signature: &DVector<f64>, (from, to): (f64, f64)) -> Score {
        let j = self.jacobian.tr_mul(signature);
        let square = signature.norm_squared();
        let power = (square - j.dot(&self.factor.solve(&j))).max(0.0);
        let along = -(signature.dot(self.residuals) - j.dot(&self.pull));
        let amplitude = if power > 0.0 { (along / power).clamp(from, to) } else { 0.0 };
        let gain = 2.0 * amplitude * along - amplitude * amplitude * power;
        let plain = -signature.dot(self.residuals);
        let own = if square > 0.0 { (plain / square).clamp(from, to) } else { 0.0 };
        let alone = 2.0 * own * plain - own * own * square;
        Score { power, amplitude, gain, left: if square > 0.0 { power / square } else { 0.0 }, alone }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::Projection;
    use crate::fit::Fit;

    /// The score is what a linear least-squares fit of nuisance and effect together finds.
    #[test]
    fn a_linear_problem_is_scored_exactly() {
        let n = 40;
        let column = |f: &dyn Fn(f64) -> f64| DVector::from_fn(n, |k, _| f(k as f64 / n as f64));
        let nuisance = column(&|t| 3.0 * t + 1.0);
        let effect = column(&|t| (7.0 * t).sin());
        let noise = column(&|t| (91.0 * t * t).cos());
        // residual = noise - 0.8 effect (the effect is in the data), the nuisance at its minimum.
        let raw = &noise - 0.8 * &effect;
        let at = -nuisance.dot(&raw) / (nuisance.norm_squared() + 1.0);
        let residuals = &raw + at * &nuisance;
        let cost = |a: f64, b: f64| (&raw + a * &nuisance + b * &effect).norm_squared() + a * a;
        let fit = Fit {
            xi: vec![at],
            runs: Vec::new(),
            misfit: residuals.norm_squared(),
            cost: cost(at, 0.0),
            residuals,
            converged: true,
            steps: 0,
            jacobian: Some((DMatrix::from_columns(std::slice::from_ref(&nuisance)), vec![0])),
            fresh: true,
        };
        let score = Projection::new(&fit).expect("a Jacobian").score(&effect, (-9.0, 9.0));
        // The joint minimum by the normal equations of two unknowns.
        let (nn, ne, ee) = (nuisance.norm_squared() + 1.0, nuisance.dot(&effect), effect.norm_squared());
        let (rn, re) = (-nuisance.dot(&raw), -effect.dot(&raw));
        let b = (re * nn - rn * ne) / (nn * ee - ne * ne);
        let a = (rn - ne * b) / nn;
        assert!((score.amplitude - b).abs() < 1e-9, "{} instead of {b}", score.amplitude);
        assert!((score.gain - (fit.cost - cost(a, b))).abs() < 1e-8);
    }
}

//! What is left of a signature when the nuisances have taken their share.
//!
//! With the Jacobian `J` of the residuals by the nuisances and their unit prior, `P = I - J (J'J + I)^-1 J'` takes out
//! all that nuisances can imitate.  For residuals `r` and a signature `d` (the change of the residuals when an effect
//! is switched on) the best amplitude is `a = -d'Pr/d'Pd`, and the cost drops by `(d'Pr)^2/(d'Pd)`: the score test (Rao
//! 1948) with a prior.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::fit::{Fit, Jacobian, normal};

/// Squared length below which a part of a signature says nothing of its amplitude.
const VISIBLE: f64 = 1.0;
/// Rounds over amplitudes that hang together.
const SWEEPS: usize = 200;

/// A fit seen through the projection of its nuisances.
pub struct Projection<'a> {
    jacobian: &'a DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    residuals: &'a DVector<f64>,
    /// `(J'J + I)^-1 (J'r + xi)`.
    pull: DVector<f64>,
}

/// A signature compared with residuals.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Score {
    /// `d'Pd`: the drop of the cost that an effect of this size would bring, were it the truth.
    pub power: f64,
    /// Best amplitude in units of the signature, from `from` to `to`.
    pub amplitude: f64,
    /// Drop of the cost at that amplitude.
    pub gain: f64,
    /// Drop of the cost at the best amplitude of the other sign, down to `-to`; 0 where `from` admits it.
    pub opposite: f64,
    /// Share of `d'd` that the nuisances leave.
    pub left: f64,
    /// Drop of the sum of squares alone, at the amplitude best for that, were the nuisances held where they are.
    pub alone: f64,
}

impl<'a> Projection<'a> {
    /// None where the fit has no Jacobian.
    pub fn new(fit: &'a Fit) -> Option<Self> {
        let is_whole = |own: &&Jacobian| own.matrix.nrows() == fit.residuals.len();
        let Jacobian { matrix: jacobian, unknowns: columns, .. } = fit.jacobian.as_ref().filter(is_whole)?;
        let factor = Cholesky::new(normal(jacobian))?;
        let mut gradient = jacobian.tr_mul(&fit.residuals);
        for (k, &unknown) in columns.iter().enumerate() {
            gradient[k] += fit.xi[unknown];
        }
        let pull = factor.solve(&gradient);
        Some(Self { jacobian, factor, residuals: &fit.residuals, pull })
    }

    /// Scores a signature whose rows fall into parts that each have an amplitude of their own, such as shots.  Returns
    /// the amplitudes as well; `power` and `left` are those of the signature as it is.
    pub fn score_in_parts(
        &self,
        signature: &DVector<f64>,
        parts: &[Range<usize>],
        (from, to): (f64, f64),
    ) -> (Score, Vec<f64>) {
        let whole = self.score(signature, (from, to));
        let own = |part: &Range<usize>| signature.rows(part.start, part.len());
        let seen = |part: &Range<usize>| self.jacobian.rows(part.start, part.len()).tr_mul(&own(part));
        let seen: Vec<DVector<f64>> = parts.iter().map(seen).collect();
        let followed: Vec<DVector<f64>> = seen.iter().map(|seen| self.factor.solve(seen)).collect();
        let inner = DMatrix::from_fn(parts.len(), parts.len(), |i, k| {
            // Parts have no row in common.
            let direct = if i == k { own(&parts[i]).norm_squared() } else { 0.0 };
            direct - seen[i].dot(&followed[k])
        });
        let along = DVector::from_fn(parts.len(), |k, _| {
            let residuals = self.residuals.rows(parts[k].start, parts[k].len());
            seen[k].dot(&self.pull) - own(&parts[k]).dot(&residuals)
        });
        let mut amplitudes = best_within(&inner, &along, (from, to));
        let gain = 2.0 * amplitudes.dot(&along) - amplitudes.dot(&(&inner * &amplitudes));
        // A part that shows nothing of it is begun with the amplitude of all.
        for k in (0..parts.len()).filter(|&k| inner[(k, k)] < VISIBLE) {
            amplitudes[k] = whole.amplitude;
        }
        (Score { gain, ..whole }, amplitudes.as_slice().to_vec())
    }

    /// `J'S` of several signatures `S`.
    pub fn seen(&self, signatures: &DMatrix<f64>) -> DMatrix<f64> {
        self.jacobian.tr_mul(signatures)
    }

    /// `(J'J + I)^-1 J'S` of what [`Projection::seen`] gave.
    pub fn followed(&self, seen: &DMatrix<f64>) -> DMatrix<f64> {
        self.factor.solve(seen)
    }

    /// Half the slope of the cost along several signatures, downwards; with what [`Projection::seen`] gave of them.
    pub fn along(&self, signatures: &DMatrix<f64>, seen: &DMatrix<f64>) -> DVector<f64> {
        seen.tr_mul(&self.pull) - signatures.tr_mul(self.residuals)
    }

    /// `a'Pb`.
    pub fn inner(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        let (ja, jb) = (self.jacobian.tr_mul(a), self.jacobian.tr_mul(b));
        a.dot(b) - ja.dot(&self.factor.solve(&jb))
    }

    /// Scores a signature; amplitudes beyond the ends count as the ends.
    pub fn score(&self, signature: &DVector<f64>, ends: (f64, f64)) -> Score {
        let j = self.jacobian.tr_mul(signature);
        self.score_of((signature.norm_squared(), &j, -signature.dot(self.residuals)), ends)
    }

    /// The same of a signature `d` of which `d'd`, `J'd` and `-d'r` are known.
    pub fn score_of(&self, (square, j, plain): (f64, &DVector<f64>, f64), (from, to): (f64, f64)) -> Score {
        let power = (square - j.dot(&self.factor.solve(j))).max(0.0);
        // Half the slope of the cost along the signature, downwards.
        let along = plain + j.dot(&self.pull);
        let amplitude = if power > 0.0 { (along / power).clamp(from, to) } else { 0.0 };
        let cost_drop = |amplitude: f64| 2.0 * amplitude * along - amplitude * amplitude * power;
        let gain = cost_drop(amplitude);
        let opposite = if from < 0.0 || power <= 0.0 { 0.0 } else { cost_drop((along / power).clamp(-to, 0.0)) };
        let own = if square > 0.0 { (plain / square).clamp(from, to) } else { 0.0 };
        let alone = 2.0 * own * plain - own * own * square;
        Score { power, amplitude, gain, opposite, left: if square > 0.0 { power / square } else { 0.0 }, alone }
    }
}

/// The `a` between two ends that makes `2 a'c - a'Ga` largest: one coordinate after the other (Hildreth 1957).
fn best_within(inner: &DMatrix<f64>, along: &DVector<f64>, (from, to): (f64, f64)) -> DVector<f64> {
    let mut amplitudes = DVector::zeros(along.len());
    for _ in 0..SWEEPS {
        let before = amplitudes.clone();
        for k in 0..along.len() {
            let others = inner.row(k).transpose().dot(&amplitudes) - inner[(k, k)] * amplitudes[k];
            let best = (along[k] - others) / inner[(k, k)];
            amplitudes[k] = if inner[(k, k)] > 0.0 { best.clamp(from, to) } else { 0.0 };
        }
        if (&amplitudes - before).amax() < 1e-6 {
            break;
        }
    }
    amplitudes
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{Projection, best_within};
    use crate::fit::{Fit, Jacobian};

    /// With nothing to imitate it, what a signature explains with either sign is the square of its projection.
    #[test]
    fn what_the_other_sign_would_explain_is_no_gain() {
        let residuals = DVector::from_row_slice(&[3.0, -1.0, 2.0]);
        let fit = Fit {
            xi: vec![0.0],
            runs: Vec::new(),
            residuals: residuals.clone(),
            cost: 14.0,
            misfit: 14.0,
            converged: true,
            steps: 0,
            jacobian: Some(Jacobian::new(DMatrix::zeros(3, 1), vec![0])),
            fresh: true,
            wall: None,
        };
        let projection = Projection::new(&fit).expect("a Jacobian");
        // Residuals grow with this signature, so that its amplitude should be negative.
        let signature = DVector::from_row_slice(&[2.0, 0.0, 2.0]);
        let square = signature.dot(&residuals).powi(2) / signature.norm_squared();
        let score = projection.score(&signature, (0.0, 3.0));
        assert!(score.gain == 0.0 && (score.opposite - square).abs() < 1e-12, "{score:?}");
        let score = projection.score(&signature, (-3.0, 3.0));
        assert!(score.opposite == 0.0 && (score.gain - square).abs() < 1e-12, "{score:?}");
        let score = projection.score(&-&signature, (0.0, 3.0));
        assert!(score.opposite == 0.0 && (score.gain - square).abs() < 1e-12, "{score:?}");
    }

    /// Three amplitudes that trade against each other, one of them held at its end.
    #[test]
    fn the_best_amplitudes_within_ends_leave_no_way_up() {
        let inner = DMatrix::from_row_slice(3, 3, &[4.0, 3.0, 1.0, 3.0, 5.0, 2.0, 1.0, 2.0, 3.0]);
        let free = DVector::from_row_slice(&[0.7, 1.9, 0.4]);
        let along = &inner * &free;
        assert!((best_within(&inner, &along, (0.0, 3.0)) - &free).amax() < 1e-4);
        let along = &inner * DVector::from_row_slice(&[2.0, -0.5, 1.0]);
        let found = best_within(&inner, &along, (0.0, 3.0));
        let slope = along - &inner * &found;
        for k in 0..3 {
            assert!(
                found[k] >= 0.0 && (found[k] > 0.0 && slope[k].abs() < 1e-4 || found[k] == 0.0 && slope[k] <= 1e-9)
            );
        }
        assert!(found[0] > 1.0 && found[1] == 0.0 && found[2] > 0.5, "{found}");
    }

    /// With a constant as the nuisance and an effect that is there in the second half only, one amplitude cannot tell; two can.
    #[test]
    fn parts_with_amplitudes_of_their_own_show_what_the_whole_hides() {
        let n = 40;
        let nuisance = DVector::from_element(n, 10.0);
        let effect = DVector::from_element(n, 1.0);
        let raw = DVector::from_fn(n, |k, _| if k < n / 2 { 0.0 } else { -1.0 });
        let at = -nuisance.dot(&raw) / (nuisance.norm_squared() + 1.0);
        let residuals: DVector<f64> = &raw + at * &nuisance;
        let cost = residuals.norm_squared() + at * at;
        let fit = Fit {
            xi: vec![at],
            runs: Vec::new(),
            misfit: residuals.norm_squared(),
            cost,
            residuals,
            converged: true,
            steps: 0,
            jacobian: Some(Jacobian::new(DMatrix::from_columns(std::slice::from_ref(&nuisance)), vec![0])),
            fresh: true,
            wall: None,
        };
        let projection = Projection::new(&fit).expect("a Jacobian");
        assert!(projection.score(&effect, (0.0, 9.0)).gain < 0.01);
        let (score, amplitudes) = projection.score_in_parts(&effect, &[0..n / 2, n / 2..n], (0.0, 9.0));
        // The sum of squares of +-1/2 is all explained: no effect in the first half, all of it in the second.
        assert!((score.gain - cost).abs() < 1e-3 * cost, "{} of {cost}", score.gain);
        assert!(amplitudes[0] < 0.01 && (amplitudes[1] - 1.0).abs() < 0.01, "{amplitudes:?}");
    }

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
            jacobian: Some(Jacobian::new(DMatrix::from_columns(std::slice::from_ref(&nuisance)), vec![0])),
            fresh: true,
            wall: None,
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

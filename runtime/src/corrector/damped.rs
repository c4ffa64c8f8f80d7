//! Damped Newton method for nonlinear systems `g(x) = 0` far from the solution.
//!
//! `J(x) d = -g(x)`, `x := x + lambda d`.  The damping factor follows the natural monotonicity test: the simplified correction
//! `J(x) e = -g(x + lambda d)` must be smaller than `d`, a test that does not change when equations are scaled or combined.
//! Source: Deuflhard, "Newton Methods for Nonlinear Problems" (Springer 2004), section 3.3, algorithm NLEQ-ERR.
//! Glossary: `theta` contraction `|e|/|d|`, `mu` the factor at which the model of the path predicts the best decrease.
//! Corrections are measured in the root mean square of `d_i / max(|x_i|, nominal_i)`.  Does not search for further solutions.
//! Where the Jacobian has not full rank the smallest correction is taken that fulfils what can be fulfilled, and what is left over must
//! have vanished with the last one: equations may depend on each other, but not contradict each other.

use crate::linear::FactorError;
use hyd_system::math;

/// Smallest damping factor.
const SMALLEST_FACTOR: f64 = 1e-8;
/// Most Newton steps.
const MOST_STEPS: usize = 100;
/// After so many steps that did not converge it is asked whether rounding is why, with so many changes of the unknowns by a rounding.
const PATIENCE: usize = 6;
const ROUNDINGS: u32 = 4;
/// A correction is rounding if it is no larger than so many of what those changes make, and small beside values and nominals.
const NOISE: f64 = 8.0;
/// Where the decrease has stopped, corrections of so many tolerances are rounding, too.
const ABOVE: f64 = 1e3;
const LEAST_EXACT: f64 = 1e-6;
/// What equations of less than full rank may leave over, as a part of their terms.
const LEFT_OVER: f64 = 1e-9;

/// A system that the method can solve.
pub(crate) trait Target {
    /// g(x) into `out`; false if a value is not finite.
    fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool;
    /// Evaluates and factors the Jacobian at x.
    fn factor(&mut self, x: &[f64]) -> Result<(), FactorError>;
    /// The same where that has found a Jacobian that is singular, for equations that depend on each other; false if that does not help.
    fn factor_deficient(&mut self, x: &[f64]) -> bool;
    /// Replaces `b` by the solution of `J x = b` with the last factors.
    fn solve(&mut self, b: &mut [f64]);
    /// True if equations contradict each other at the last `b` by more than this part of their terms at `x`; false where the Jacobian has
    /// full rank.
    fn contradicts(&self, x: &[f64], part: f64) -> bool;
}

/// Why the method stopped.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum NewtonFailure {
    /// g is not finite at the current point, whatever the damping.
    NotFinite,
    /// The derivative of equation `row` with respect to unknown `column` is not finite.
    SlopeNotFinite {
        /// Equation.
        row: usize,
        /// Unknown.
        column: usize,
    },
    /// The Jacobian is singular.
    Singular {
        /// Equation without pivot.
        row: usize,
        /// Unknown without pivot.
        column: usize,
    },
    /// No damping factor reduces the correction any more, or there were too many steps.
    NoConvergence {
        /// Steps taken.
        steps: usize,
    },
}

/// Vectors of the method; after a failure `x` is where it stopped, `residual` is g there and `correction` the last step.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Newton {
    pub(crate) x: Vec<f64>,
    pub(crate) residual: Vec<f64>,
    pub(crate) correction: Vec<f64>,
    pub(crate) nominals: Vec<f64>,
    pub(super) trial: Vec<f64>,
    pub(super) trial_residual: Vec<f64>,
    pub(super) simplified: Vec<f64>,
}

impl Newton {
    /// Room for n unknowns.
    pub(crate) fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            x: zeros(),
            residual: zeros(),
            correction: zeros(),
            nominals: vec![1.0; n],
            trial: zeros(),
            trial_residual: zeros(),
            simplified: zeros(),
        }
    }

    /// Solves from the start in `x`; leaves the solution in `x`.  Converged when a correction is at most `tolerance`; that
    /// correction is still applied.
    pub(crate) fn solve(&mut self, target: &mut dyn Target, tolerance: f64) -> Result<(), NewtonFailure> {
        self.trial_residual.fill(0.0);
        if !target.residual(&self.x, &mut self.residual) {
            return Err(NewtonFailure::NotFinite);
        }
        let mut last: Option<(f64, f64)> = None; // (lambda, |d|) of the step before
        let mut before = f64::INFINITY;
        for step in 0..MOST_STEPS {
            let lacking = self.factor(target)?;
            negate_into(&self.residual, &mut self.correction);
            target.solve(&mut self.correction);
            let size = self.norm(&self.correction);
            if !size.is_finite() {
                return Err(NewtonFailure::NotFinite);
            }
            // Rounding may also let it decrease by next to nothing in every step.
            let idle = step >= PATIENCE && size > 0.5 * before;
            before = size;
            if size <= tolerance {
                add(&mut self.x, &self.correction);
                return self.judge(target, lacking);
            }
            if idle && (size <= ABOVE * tolerance || self.at_rounding(target, size)) {
                add(&mut self.x, &self.correction);
                return self.judge(target, lacking);
            }
            let predicted = last.map_or(1.0, |(lambda, old_size)| self.predict(lambda, old_size, size));
            match self.damp(target, predicted, size, tolerance) {
                Damped::Solved => return self.judge(target, lacking),
                Damped::Accepted(lambda) => last = Some((lambda, size)),
                // Rounding stops the decrease just above the tolerance.
                Damped::Stuck if size <= ABOVE * tolerance => return self.judge(target, lacking),
                Damped::Stuck if self.at_rounding(target, size) => return self.judge(target, lacking),
                Damped::Stuck => return Err(lacking.unwrap_or(NewtonFailure::NoConvergence { steps: step + 1 })),
                Damped::NotFinite => return Err(NewtonFailure::NotFinite),
            }
        }
        Err(NewtonFailure::NoConvergence { steps: MOST_STEPS })
    }

    /// Factors the Jacobian at the current point; what is to be said of its rank, if it is not full.
    fn factor(&mut self, target: &mut dyn Target) -> Result<Option<NewtonFailure>, NewtonFailure> {
        match target.factor(&self.x) {
            Ok(()) => Ok(None),
            Err(FactorError::NotFinite { row, column }) => Err(NewtonFailure::SlopeNotFinite { row, column }),
            Err(FactorError::Singular { row, column }) => {
                let lacking = NewtonFailure::Singular { row, column };
                if target.factor_deficient(&self.x) { Ok(Some(lacking)) } else { Err(lacking) }
            }
        }
    }

    /// A solution, unless equations that depend on each other contradict each other at it.
    fn judge(&self, target: &dyn Target, lacking: Option<NewtonFailure>) -> Result<(), NewtonFailure> {
        let Some(lacking) = lacking else { return Ok(()) };
        if target.contradicts(&self.x, LEFT_OVER) { Err(lacking) } else { Ok(()) }
    }

    /// True if no iteration can do better: a rounding of each unknown changes the correction as much as the correction is large.  Unknowns of
    /// very different sizes leave that, such as currents that leak through a blocking diode beside the voltage across it.
    fn at_rounding(&mut self, target: &mut dyn Target, size: f64) -> bool {
        if size > LEAST_EXACT {
            return false;
        }
        let mut largest = 0.0_f64;
        for turn in 0..ROUNDINGS {
            for (k, trial) in self.trial.iter_mut().enumerate() {
                // Signs that no pattern of the equations follows (multiplicative hashing).
                let up = (k as u32 ^ turn).wrapping_mul(0x9e37_79b9) >> 31 == 0;
                *trial = self.x[k] * if up { 1.0 + f64::EPSILON } else { 1.0 - f64::EPSILON };
            }
            if !target.residual(&self.trial, &mut self.trial_residual) {
                return false;
            }
            negate_into(&self.trial_residual, &mut self.simplified);
            target.solve(&mut self.simplified);
            largest = largest.max(self.norm_of(|k| self.simplified[k] - self.correction[k]));
        }
        size <= NOISE * largest
    }

    /// After [`NewtonFailure::NotFinite`]: the first equation without a finite value.
    pub(crate) fn not_finite_row(&self) -> Option<usize> {
        let first = |values: &[f64]| values.iter().position(|v| !v.is_finite());
        first(&self.residual).or_else(|| first(&self.trial_residual))
    }

    /// After a failure: where it happened.
    pub(crate) fn attempt(&self) -> &[f64] {
        if self.trial_residual.iter().all(|v| v.is_finite()) { &self.x } else { &self.trial }
    }

    /// First damping factor of a step, from the last simplified correction `e` and the new `d`:
    /// `mu = |d_old| |e| / (|e - d| |d|) lambda`.
    fn predict(&self, lambda: f64, old_size: f64, size: f64) -> f64 {
        let difference = self.norm_of(|k| self.simplified[k] - self.correction[k]);
        if difference == 0.0 {
            return 1.0;
        }
        let mu = old_size * self.norm(&self.simplified) / (difference * size) * lambda;
        mu.clamp(SMALLEST_FACTOR, 1.0)
    }

    /// Finds a damping factor that passes the monotonicity test and takes the step.
    fn damp(&mut self, target: &mut dyn Target, predicted: f64, size: f64, tolerance: f64) -> Damped {
        let mut lambda = predicted;
        let mut reduced = false;
        let mut finite = false;
        while lambda >= SMALLEST_FACTOR {
            for (k, trial) in self.trial.iter_mut().enumerate() {
                *trial = self.x[k] + lambda * self.correction[k];
            }
            if !target.residual(&self.trial, &mut self.trial_residual) {
                lambda *= 0.25;
                reduced = true;
                continue;
            }
            finite = true;
            negate_into(&self.trial_residual, &mut self.simplified);
            target.solve(&mut self.simplified);
            let simplified_size = self.norm(&self.simplified);
            let bend = self.norm_of(|k| self.simplified[k] - (1.0 - lambda) * self.correction[k]);
            let mu = if bend > 0.0 { 0.5 * size * lambda * lambda / bend } else { 1.0 };
            if simplified_size >= size || !simplified_size.is_finite() {
                lambda = mu.min(0.5 * lambda);
                reduced = true;
                continue;
            }
            let next = mu.min(1.0);
            if lambda == 1.0 && simplified_size <= tolerance {
                self.x.copy_from_slice(&self.trial);
                add(&mut self.x, &self.simplified);
                return Damped::Solved;
            }
            if next >= 4.0 * lambda && !reduced {
                lambda = next;
                continue;
            }
            self.x.copy_from_slice(&self.trial);
            self.residual.copy_from_slice(&self.trial_residual);
            return Damped::Accepted(lambda);
        }
        if finite { Damped::Stuck } else { Damped::NotFinite }
    }

    pub(super) fn norm(&self, v: &[f64]) -> f64 {
        self.norm_of(|k| v[k])
    }

    fn norm_of(&self, v: impl Fn(usize) -> f64) -> f64 {
        let square = |k: usize| math::square(v(k) / self.x[k].abs().max(self.nominals[k]));
        let sum: f64 = (0..self.x.len()).map(square).sum();
        (sum / self.x.len().max(1) as f64).sqrt()
    }
}

enum Damped {
    Solved,
    Accepted(f64),
    Stuck,
    NotFinite,
}

fn negate_into(source: &[f64], target: &mut [f64]) {
    for (t, s) in target.iter_mut().zip(source) {
        *t = -s;
    }
}

fn add(target: &mut [f64], source: &[f64]) {
    for (t, s) in target.iter_mut().zip(source) {
        *t += s;
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// One equation by its value and slope.
    struct Scalar<F: Fn(f64) -> (f64, f64)>(F, f64);

    impl<F: Fn(f64) -> (f64, f64)> Target for Scalar<F> {
        fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool {
            out[0] = self.0(x[0]).0;
            out[0].is_finite()
        }
        fn factor(&mut self, x: &[f64]) -> Result<(), FactorError> {
            self.1 = self.0(x[0]).1;
            if self.1 == 0.0 { Err(FactorError::Singular { row: 0, column: 0 }) } else { Ok(()) }
        }
        fn factor_deficient(&mut self, _: &[f64]) -> bool {
            false
        }
        fn solve(&mut self, b: &mut [f64]) {
            b[0] /= self.1;
        }
        fn contradicts(&self, _: &[f64], _: f64) -> bool {
            false
        }
    }

    fn root(f: impl Fn(f64) -> (f64, f64), start: f64) -> Result<f64, NewtonFailure> {
        let mut newton = Newton::new(1);
        newton.x[0] = start;
        newton.solve(&mut Scalar(f, 0.0), 1e-12).map(|()| newton.x[0])
    }

    #[test]
    fn arctangent_converges_where_the_plain_method_diverges() {
        // Plain Newton on atan diverges from |x| > 1.3917 (Deuflhard 2004, example 3.1).
        let x = root(|x: f64| (x.atan(), 1.0 / (1.0 + x * x)), 30.0).unwrap();
        assert!(x.abs() < 1e-12);
    }

    #[test]
    fn steps_out_of_the_domain_are_shortened() {
        // ln x = 0 from far right: the full step leads to negative x.
        let x = root(|x: f64| (x.ln(), 1.0 / x), 50.0).unwrap();
        assert!((x - 1.0).abs() < 1e-12);
    }

    #[test]
    fn failures_are_told_apart() {
        assert_eq!(root(|x| (x * x + 1.0, 2.0 * x), 0.0), Err(NewtonFailure::Singular { row: 0, column: 0 }));
        assert_eq!(root(|_| (f64::NAN, 1.0), 0.0), Err(NewtonFailure::NotFinite));
        // exp(x) + 1 has no zero; the corrections never get smaller.
        let stuck = root(|x: f64| (x.exp() + 1.0, x.exp()), 0.0);
        assert!(matches!(stuck, Err(NewtonFailure::NoConvergence { .. })), "{stuck:?}");
    }

    /// A correction that rounding lets shrink by next to nothing each time.
    struct Creeping(f64);

    impl Target for Creeping {
        fn residual(&mut self, _: &[f64], out: &mut [f64]) -> bool {
            self.0 *= 0.9995;
            out[0] = self.0;
            true
        }
        fn factor(&mut self, _: &[f64]) -> Result<(), FactorError> {
            Ok(())
        }
        fn factor_deficient(&mut self, _: &[f64]) -> bool {
            false
        }
        fn solve(&mut self, _: &mut [f64]) {}
        fn contradicts(&self, _: &[f64], _: f64) -> bool {
            false
        }
    }

    #[test]
    fn a_search_that_creeps_ends_near_its_tolerance_and_fails_far_from_it() {
        let mut newton = Newton::new(1);
        newton.x[0] = 1.0;
        newton.solve(&mut Creeping(2e-10), 1e-12).unwrap();
        newton.x[0] = 1.0;
        assert!(newton.solve(&mut Creeping(2e-7), 1e-12).is_err());
    }
}

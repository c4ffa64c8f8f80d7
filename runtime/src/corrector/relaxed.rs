//! Newton's method from equations that given values fulfil to those that are asked for.
//!
//! `G(x) - rest G(x0) = 0` has the solution `x0` for `rest = 1`; the rest is taken away in steps, each solved from where the last one
//! ended (Newton homotopy; Keller, in: Applications of Bifurcation Theory, Academic Press 1977).

use crate::corrector::damped::{Newton, Target};
use crate::linear::FactorError;

/// The first step, and the smallest.
const FIRST_SHARE: f64 = 0.25;
const SMALLEST_SHARE: f64 = 1e-4;

/// A system with a part of what it amounts to at the first values left over.
struct Relaxed<'a, 'b> {
    target: &'a mut (dyn Target + 'b),
    at_first: &'a [f64],
    rest: f64,
}

impl Target for Relaxed<'_, '_> {
    fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool {
        let is_finite = self.target.residual(x, out);
        out.iter_mut().zip(self.at_first).for_each(|(value, first)| *value -= self.rest * first);
        is_finite
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), FactorError> {
        self.target.factor(x)
    }

    fn factor_deficient(&mut self, x: &[f64]) -> bool {
        self.target.factor_deficient(x)
    }

    fn solve(&mut self, b: &mut [f64]) {
        self.target.solve(b);
    }

    fn contradicts(&self, x: &[f64], part: f64) -> bool {
        self.target.contradicts(x, part)
    }
}

/// Leads from `first` to a solution, which stands in `newton.x` then; false where the way ends.
pub(crate) fn lead_back(newton: &mut Newton, target: &mut dyn Target, first: &[f64], tolerance: f64) -> bool {
    let mut at_first = vec![0.0; first.len()];
    if !target.residual(first, &mut at_first) {
        return false;
    }
    newton.x.copy_from_slice(first);
    let (mut share, mut step) = (0.0, FIRST_SHARE);
    let mut last = first.to_vec();
    while share < 1.0 {
        let next = f64::min(share + step, 1.0);
        let mut relaxed = Relaxed { target, at_first: &at_first, rest: 1.0 - next };
        if newton.solve(&mut relaxed, tolerance).is_ok() {
            last.copy_from_slice(&newton.x);
            (share, step) = (next, 2.0 * step);
        } else if step <= SMALLEST_SHARE {
            return false;
        } else {
            newton.x.copy_from_slice(&last);
            step *= 0.25;
        }
    }
    true
}

//! The system under solution together with the counters: every evaluation goes through here and is counted.
//!
//! What made a value that is not finite is asked for only when a message needs it.

use crate::Statistics;
use crate::delay::Delaying;
use crate::profile::Profile;
use crate::tiled::sum_of_pairs;

/// A system and what it has cost so far.
pub(crate) struct Problem<'a> {
    pub(crate) system: Delaying<'a>,
    pub(crate) statistics: Statistics,
    /// Present in runs that are to say where their time goes.
    pub(crate) profile: Option<Box<Profile>>,
}

impl Problem<'_> {
    /// F(t, y, y') into `out`; false if a value is not finite.
    pub(crate) fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) -> bool {
        self.evaluate(t, y, yp, out);
        all_finite(out)
    }

    /// F(t, y, y') into `out`, be it finite or not.
    pub(crate) fn evaluate(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.statistics.residuals += 1;
        let begin = self.now();
        self.system.residual(t, y, yp, out);
        if let (Some(begin), Some(profile)) = (begin, &mut self.profile) {
            profile.seconds.residuals += profile.now() - begin;
        }
    }

    /// dF/dy and dF/dy' into the two value slices.
    pub(crate) fn jacobian(&mut self, t: f64, y: &[f64], yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        self.statistics.jacobians += 1;
        let begin = self.now();
        self.system.jacobian(t, y, yp, state, rate);
        if let (Some(begin), Some(profile)) = (begin, &mut self.profile) {
            profile.seconds.jacobians += profile.now() - begin;
        }
    }

    /// The time now (s), in runs with a profile.
    #[inline(always)]
    pub(crate) fn now(&self) -> Option<f64> {
        self.profile.as_ref().map(|profile| profile.now())
    }
}

/// True if no value is infinite or NaN.
#[inline]
pub(crate) fn all_finite(values: &[f64]) -> bool {
    // 0*x is NaN exactly for the non-finite x; one sum instead of a branch per value.
    sum_of_pairs(values, values, |value, _| 0.0 * value) == 0.0
}

//! The system under solution together with the counters: every evaluation goes through here and is counted.
//!
//! What made a value that is not finite is asked for only when a message needs it.

use crate::Statistics;
use crate::delay::Delaying;
use crate::profile::Profile;
use crate::tiled::sum_of_pairs;
use crate::undetermined::OpenUnknowns;

/// An unknown is moved by this part of its size to see which relations watch it; a relation whose sides are this near to each other is at
/// its limit.
const ASIDE: f64 = 1e-3;
const AT_LIMIT: f64 = 1e-9;

/// A system and what it has cost so far.
pub(crate) struct Problem<'a> {
    pub(crate) system: Delaying<'a>,
    pub(crate) statistics: Statistics,
    /// Present in runs that are to say where their time goes.
    pub(crate) profile: Option<Box<Profile>>,
    /// What equations that depend on each other have left open.
    pub(crate) open: OpenUnknowns,
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

    /// Notes unknowns that the equations leave open at a time (s); `rates`: those of which it is the rate that is looked for.
    pub(crate) fn note_open(&mut self, t: f64, rates: Option<&[bool]>, unknowns: impl Iterator<Item = usize>) {
        for k in unknowns {
            let is_rate = rates.is_some_and(|rates| rates[k]);
            self.open.note(t, (k, is_rate), |(k, is_rate)| {
                let name = self.system.tables().unknown_name(k);
                if is_rate { format!("der({name})") } else { name }
            });
        }
    }

    /// Ranks of unknowns that equations leave open, for [`crate::undetermined`]: those that relations watch above others, and those at a limit
    /// above these.  `open`: which ones; `at`: all unknowns, with their sizes; `roots` evaluates root functions with one of them changed.
    pub(crate) fn watched(
        &mut self,
        open: &[usize],
        sizes: &[f64],
        at: &[f64],
        mut roots: impl FnMut(&mut Self, usize, f64, &mut [f64]),
    ) -> Vec<u8> {
        let mut ranks = Vec::new();
        let count = self.system.structure().roots;
        let (mut here, mut beside) = (vec![0.0; count], vec![0.0; count]);
        for &k in open {
            roots(self, k, at[k], &mut here);
            roots(self, k, at[k] + ASIDE * at[k].abs().max(sizes[k]), &mut beside);
            let watching = here.iter().zip(&beside).filter(|(here, beside)| here != beside);
            let rank = watching.map(|(here, _)| if here.abs() <= AT_LIMIT { 2 } else { 1 }).max();
            if let Some(rank) = rank {
                ranks.resize(at.len(), 0);
                ranks[k] = rank;
            }
        }
        ranks
    }

    /// Notes unknowns of the initial system that it leaves open.
    pub(crate) fn note_open_at_start(&mut self, t: f64, unknowns: impl Iterator<Item = usize>) {
        for k in unknowns {
            if let Some(name) = self.system.tables().initial_unknowns.get(k) {
                self.open.note_name(t, name.to_string());
            }
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

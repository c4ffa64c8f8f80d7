//! A plainer form of the best candidate that was never fitted, because far from the measurement it seemed to lead away.
//!
//! Where nuisances are bent to their limits by what is missing, what is left of dry friction may ask for the opposite of it; the form with
//! further numbers, whose sign is free, is fitted all the same and imitates the plainer one.  That is fitted then from the nuisances of the
//! best, and from those with what is bent put back: of a form that is not the true one the bent nuisances are a part.

use hyd_system::math;

use super::context::{Search, patience};
use super::pass::{Pass, Tried, by_cost};
use crate::catalogue::Candidate;
use crate::fault::Fault;
use crate::fit::{Fit, minimise};

/// Sizes that are compared for a start, as multiples of the typical one: from the first to the last in so many equal factors.
const SIZES: (f64, f64, u32) = (1e-3, 3.0, 32);
/// A nuisance so many standard deviations from what was expected is bent.
const BENT: f64 = 2.0;

impl Search<'_> {
    /// Fits what the best candidate refines at its place, where that was not fitted.
    pub(super) fn plainest(&self, pass: &mut Pass) -> Result<(), Fault> {
        let Some(&best) = by_cost(&pass.tried).first() else { return Ok(()) };
        let (count, whole) = (pass.fit.xi.len(), self.whole());
        let (Some(leader), Some(fit)) = (pass.tried[best].hypothesis.inserts.last(), &pass.tried[best].fit) else {
            return Ok(());
        };
        let scale = (fit.misfit / pass.expected).max(1.0);
        if pass.fit.cost - fit.cost < self.needed * scale {
            return Ok(());
        }
        let is_plainer = |own: &Candidate| leader.refines(own);
        let is_new = |&k: &usize| {
            let Tried { hypothesis, fit, .. } = &pass.tried[k];
            fit.is_none() && hypothesis.machine.is_fast() && hypothesis.inserts.last().is_some_and(is_plainer)
        };
        let bent = fit.xi[..count].to_vec();
        let back: Vec<f64> = bent.iter().map(|&xi| if xi.abs() > BENT { 0.0 } else { xi }).collect();
        let starts = if back == bent { vec![bent] } else { vec![bent, back] };
        let new: Vec<usize> = (0..pass.tried.len()).filter(is_new).collect();
        let make = |k: usize| {
            let hypothesis = &pass.tried[new[k]].hypothesis;
            let Some(insert) = hypothesis.inserts.last() else { return Ok(None) };
            (self.progress)(&format!("fitting {} from the best candidate's parameters", hypothesis.label()));
            let problem = hypothesis.problem(self.setup)?;
            let typical = insert.effect.probe * self.setup.scale(insert);
            let factor = math::ln(SIZES.1 / SIZES.0) / f64::from(SIZES.2);
            let sizes = (0..=SIZES.2).map(|step| typical * SIZES.0 * math::exp(factor * f64::from(step)));
            let sizes: Vec<f64> = sizes.collect();
            let ends = starts.iter().filter_map(|nuisances| {
                let at = sizes.iter().map(|&size| hypothesis.at_size(&problem, nuisances, size));
                let fits = at.filter_map(|xi| Fit::at(&problem, &xi, &whole).ok());
                let start = fits.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
                minimise(&problem, &start.xi, &whole, patience(&problem), None).ok()
            });
            Ok(ends.min_by(|a, b| a.cost.total_cmp(&b.cost)))
        };
        let task = |k: usize| self.task("plainest", &pass.tried[new[k]].hypothesis, &[&fit.xi]);
        let lowest = self.each(new.len(), task, make)?;
        for (k, lowest) in new.into_iter().zip(lowest) {
            pass.tried[k].fit = lowest;
        }
        Ok(())
    }
}

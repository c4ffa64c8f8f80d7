//! How far does the cost drop where nothing is missing?  The threshold of names for one study and set.
//!
//! The fitted model is run under the conditions of all shots, noise like that of the set is added, and the whole search
//! runs on sets made in this way (parametric bootstrap: Efron, Tibshirani, "An Introduction to the Bootstrap", 1993,
//! chapter 6).  What the best candidate of the first pass seems to explain there, it explains by chance.  Scatter from
//! shot to shot that no study declares is not in these sets.

use std::ops::Range;

use crate::catalogue::Candidate;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::thresholds::NEEDED;
use crate::fit::Fit;
use crate::fit::schedule;
use crate::problem::{Problem, Weighing};
use crate::search::{Ends, Forgetful, Search};
use crate::tasks::Tasks;
use crate::variant::Workshop;
use crate::{Bench, Fault, Setup};
use hyd_system::random::SplitMix;

/// Share of the sets whose drop must lie below the threshold.
const BELOW: f64 = 0.95;

/// Drops of the cost on sets on which nothing is missing.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Calibration {
    /// The largest drop of each set, ascending.
    pub cost_drops: Vec<f64>,
}

impl Calibration {
    /// The drop that a name needs: that of 95 of 100 such sets, and no less than the usual one.
    pub fn needed(&self) -> f64 {
        let place = (BELOW * self.cost_drops.len() as f64).ceil() as usize;
        self.cost_drops.get(place.saturating_sub(1)).copied().unwrap_or(0.0).max(NEEDED)
    }
}

impl Calibration {
    /// From the drops of all sets, in any order.
    pub fn new(mut cost_drops: Vec<f64>) -> Self {
        cost_drops.sort_by(f64::total_cmp);
        Self { cost_drops }
    }

    /// Searches `sets` sets on which nothing is missing.
    ///
    /// # Errors
    /// When the base model does not run, or a text cannot be translated.
    pub fn of(
        setup: &Setup,
        workshop: &Workshop<'_>,
        candidates: &[Candidate],
        (sets, seed): (usize, u64),
        progress: &dyn Fn(&str),
    ) -> Result<Self, Fault> {
        let told = |set: usize| progress(&format!("set {} of {sets} on which nothing is missing", set + 1));
        Self::drops(setup, workshop, candidates, (0..sets, seed), &told).map(Self::new)
    }

    /// The largest drops of some of the sets, in their order.  Each set is drawn by its number and the seed alone, so that who searches which of them does
    /// not matter.  `progress` gets the number of a set before it is searched.
    ///
    /// # Errors
    /// When the base model does not run, or a text cannot be translated.
    pub fn drops(
        setup: &Setup,
        workshop: &Workshop<'_>,
        candidates: &[Candidate],
        (sets, seed): (Range<usize>, u64),
        progress: &dyn Fn(usize),
    ) -> Result<Vec<f64>, Fault> {
        let base = Hypothesis::new(setup, workshop, Vec::new())?;
        let problem = base.problem(setup)?;
        let zero = vec![0.0; problem.unknowns.len()];
        let (fit, _) = schedule::fit(&problem, &zero, &setup.train, setup.study.shots.time_tolerance)?;
        let mut cost_drops = Vec::with_capacity(sets.len());
        for set in sets {
            progress(set);
            let mut draws = SplitMix(seed.wrapping_add(1 + set as u64).wrapping_mul(0x2545_f491_4f6c_dd1d));
            let bench = like(setup, &problem, &fit, &mut draws)?;
            let mut made = Setup::new(setup.study.clone(), bench, setup.threads)?;
            made.foreign.clone_from(&setup.foreign);
            made.watch = setup.watch.clone();
            let candidates = candidates.to_vec();
            let search = Search {
                setup: &made,
                workshop,
                candidates,
                seed,
                needed: NEEDED,
                progress: &|_| {},
                memory: &Forgetful,
                ends: Ends::default(),
                tasks: Tasks::ALONE,
            };
            let findings = search.run()?;
            cost_drops.push(findings.passes.first().map_or(0.0, |pass| search.largest_drop(pass)));
        }
        Ok(cost_drops)
    }
}

/// A set like that of the study, of which the fitted model is the truth.
fn like(setup: &Setup, problem: &Problem<'_>, fit: &Fit, draws: &mut SplitMix) -> Result<Bench, Fault> {
    let all = Weighing::whole(&problem.all_shots(), 0.0);
    let runs = problem.simulate(&fit.xi, &all)?;
    let mut bench = setup.bench.clone();
    for (shot, own) in bench.shots.iter_mut().enumerate() {
        for (place, channel) in setup.data.channels.iter().enumerate() {
            let Some(values) = own.values.get_mut(&channel.name) else { continue };
            let shown = problem.shown(&fit.xi, &runs, shot, place);
            let mut error = draws.normal();
            for (value, shown) in values.iter_mut().zip(shown) {
                if value.is_finite() {
                    *value = channel.scale * (shown + channel.noise.sigma * error);
                }
                let rho = channel.noise.rho;
                error = rho * error + (1.0 - rho * rho).sqrt() * draws.normal();
            }
        }
    }
    Ok(bench)
}

#[cfg(test)]
mod tests {
    use super::Calibration;
    use crate::evidence::thresholds::NEEDED;

    #[test]
    fn the_threshold_is_that_of_95_of_100_sets() {
        let cost_drops = (1..=100).map(f64::from).collect();
        assert_eq!(Calibration { cost_drops }.needed(), 95.0);
        assert_eq!(Calibration { cost_drops: vec![0.0, 3.0, 17.0] }.needed(), NEEDED);
        assert_eq!(Calibration::default().needed(), NEEDED);
    }
}

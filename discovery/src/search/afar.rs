//! Fits of a candidate that has a course of its own, such as waves, from far away.
//!
//! The fit without has bent the nuisances to imitate it, so that they are no place to start from, and sizes between those looked at
//! would be out of step with the measurement.  Many sizes are run with the nuisances as expected, over the first part of the
//! record; the best are fitted on a growing horizon (Michalik, Hannemann, Marquardt 2009).  On the way derivatives by the
//! nuisances are those of the model without the candidate, which runs much faster; at the end they are its own.

use hyd_system::math::{exp, ln};

use super::context::Search;
use crate::evidence::hypothesis::Hypothesis;
use crate::fault::Fault;
use crate::fit::schedule::{GOOD, lower};
use crate::fit::{Effort, Fit, minimise};
use crate::problem::{Problem, Weighing};

/// Sizes that are run, their range as multiples of the typical one, and how many of them are fitted.
const SIZES: usize = 12;
const RANGE: (f64, f64) = (0.3, 2.2);
const FITTED: usize = 2;
/// Share of what is missing that a fit may leave to make others needless.
const EXPLAINED: f64 = 2e-3;
/// Sizes that are run before a short fit.
const FEW: usize = 5;
/// As a multiple of the typical size, one about which sizes are run of laws that were not made for the machine.
const SMALL: f64 = 0.03;
/// Parts of the record.
const HORIZONS: [f64; 4] = [0.25, 0.4, 0.65, 1.0];
/// For the way.
const WAY: Effort = Effort { steps: 12, gain: 2.0, difference: 0.1, reuse: 3, ..Effort::FULL };
/// For the end.
const END: Effort = Effort { reuse: 8, ..Effort::FULL };

impl Search<'_> {
    /// The lowest fit; none where no size can be run.
    pub(super) fn fit_from_afar(
        &self,
        (without, base): (&Hypothesis, &Fit),
        hypothesis: &Hypothesis,
        typical: f64,
    ) -> Result<Option<Fit>, Fault> {
        let lender = without.problem(self.setup)?;
        let exact = hypothesis.problem(self.setup)?;
        let mut problem = hypothesis.problem(self.setup)?;
        problem.lender = Some(&lender);
        let nuisances = lender.expected_nuisances(&base.xi);
        let stage = |horizon: f64| Weighing { horizon, ..self.wide() };
        let missing = base.misfit / lender.expected(&self.whole()) - 1.0;
        let mut starts: Vec<(f64, Vec<f64>)> = Vec::new();
        for size in sizes(typical, SIZES) {
            let xi = hypothesis.at_size(&problem, &nuisances, size);
            if let Ok(fit) = Fit::at(&problem, &xi, &stage(HORIZONS[1])) {
                starts.push((fit.cost, xi));
            }
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best: Option<Fit> = None;
        for (_, start) in starts.iter().take(FITTED) {
            if let Ok(fit) = along(&problem, start, &stage) {
                best = Some(best.map_or(fit.clone(), |other| lower(other, fit)));
            }
            let ended = best.as_ref().map_or(f64::INFINITY, |fit| fit.misfit / problem.expected(&stage(1.0)));
            if ended < GOOD || ended - 1.0 < EXPLAINED * missing {
                break;
            }
        }
        let Some(best) = best else { return Ok(None) };
        let best = minimise(&problem, &best.xi, &self.whole(), WAY, None).unwrap_or(best);
        Ok(minimise(&exact, &best.xi, &self.whole(), END, None).ok())
    }
}

impl Search<'_> {
    /// The beginning of a fit where nuisances of the fit without are no place to start from: the best of some sizes
    /// with all else as expected, then a short fit under wide weights.
    pub(super) fn begin_from_expected(
        &self,
        hypothesis: &Hypothesis,
        base: &Fit,
        typical: f64,
    ) -> Result<Option<Fit>, Fault> {
        let problem = hypothesis.problem(self.setup)?;
        let half = Weighing { horizon: HORIZONS[1], ..self.wide() };
        let before = problem.expected_nuisances(&base.xi);
        // How large a law is that was not made for the machine nobody has said.
        let is_found = hypothesis.inserts.last().is_some_and(|insert| insert.is_found());
        let small = if is_found { sizes(SMALL * typical, FEW) } else { Vec::new() };
        let starts = small.into_iter().chain(sizes(typical, FEW)).filter_map(|size| {
            let xi = hypothesis.at_size(&problem, &before, size);
            Fit::at(&problem, &xi, &half).ok()
        });
        let Some(start) = starts.min_by(|a, b| a.cost.total_cmp(&b.cost)) else { return Ok(None) };
        let fit = minimise(&problem, &start.xi, &half, Effort::SHORT, None);
        Ok(fit.and_then(|fit| minimise(&problem, &fit.xi, &self.wide(), Effort::SHORT, None)).ok())
    }
}

/// Sizes evenly spread on a logarithmic scale.
fn sizes(typical: f64, count: usize) -> Vec<f64> {
    let share = |k: usize| (k as f64 + 0.5) / count as f64;
    let size = |share: f64| typical * exp(ln(RANGE.0) * (1.0 - share) + ln(RANGE.1) * share);
    (0..count).map(|k| size(share(k))).collect()
}

/// The fit on a growing horizon.
fn along(problem: &Problem<'_>, start: &[f64], stage: &dyn Fn(f64) -> Weighing) -> Result<Fit, Fault> {
    let mut fit = Fit::at(problem, start, &stage(HORIZONS[0]))?;
    for horizon in HORIZONS {
        fit = minimise(problem, &fit.xi, &stage(horizon), WAY, None)?;
    }
    Ok(fit)
}

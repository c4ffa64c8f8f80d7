//! Sizes in standard errors, and numbers that can be.
//!
//! A fit may end where an effect has numbers that its library calls implausible: another valley, or a number that the measurement hardly
//! decides.  Before such a fit speaks against the effect it is made again from plausible numbers, and once more with
//! the numbers that leave their ranges again held at the ends; where that explains the measurement as well, the plausible fit is the effect's
//! (a profile likelihood over the held numbers: Raue et al., Bioinformatics 25 (2009)).

use super::shortlist::patience;
use super::{LEAD, Pass, Search, by_cost, contested};
use crate::fit::{Fit, minimise, minimise_over};
use crate::hypothesis::Hypothesis;
use crate::problem::Problem;
use crate::unknowns::{LIMIT, Meaning};
use crate::{Fault, Setup};

/// A size of fewer standard errors is none.
pub(super) const NOTHING: f64 = 2.0;
/// Most candidates that are fitted again.
const MOST: usize = 3;
/// Part of the range of what is plausible by which a number may lie outside: the ends are judgements, and what else is missing bends
/// numbers.
const MARGIN: f64 = 0.2;

impl Search<'_> {
    /// Fits those that explain about as much as the best again from plausible numbers, where theirs are not.
    pub(super) fn tame(&self, pass: &mut Pass) -> Result<(), Fault> {
        let Some(&best) = by_cost(&pass.tried).first() else { return Ok(()) };
        for k in contested(pass, best, self.needed).into_iter().take(MOST) {
            let tried = &mut pass.tried[k];
            let Some(fit) = tried.fit.take_if(|fit| !is_plausible(&tried.hypothesis, self.setup, fit)) else {
                continue;
            };
            (self.progress)(&format!("fitting {} from plausible numbers", tried.hypothesis.label()));
            tried.fit = Some(self.tamed(&tried.hypothesis, fit, pass.expected)?);
        }
        Ok(())
    }

    /// The fit with plausible numbers, if it explains the measurement as well; else the fit as it is.
    pub(super) fn tamed(&self, hypothesis: &Hypothesis, fit: Fit, expected: f64) -> Result<Fit, Fault> {
        let (problem, whole) = (hypothesis.problem(self.setup)?, self.whole());
        let is_enough = |own: &Fit| {
            let scale = (own.misfit / expected).max(1.0);
            is_plausible(hypothesis, self.setup, own) && own.cost < fit.cost + LEAD * scale
        };
        let known = |fit: &Fit| fit.jacobian.as_ref().map(|(jacobian, _)| jacobian.clone());
        let mut start = fit.xi.clone();
        let ends = ranges(hypothesis, self.setup, &problem);
        for &(k, low, high) in &ends {
            let is_size = problem.unknowns[k].effect.is_some_and(|part| part.parameter == 0);
            if !(low..=high).contains(&start[k]) {
                // Other numbers than the size may be had from what is expected.
                start[k] = if is_size { start[k].clamp(low, high) } else { 0.0 };
            }
        }
        let jacobian = known(&fit);
        let known_there = jacobian.as_ref().filter(|own| own.ncols() == start.len()).map(|own| (own, &whole));
        let Ok(free) = minimise(&problem, &start, &whole, patience(&problem), known_there) else { return Ok(fit) };
        if is_enough(&free) {
            return Ok(free);
        }
        let mut start = free.xi.clone();
        let mut held = Vec::new();
        for &(k, low, high) in &ends {
            if !(low..=high).contains(&start[k]) {
                start[k] = start[k].clamp(low, high);
                held.push(k);
            }
        }
        let others: Vec<usize> = (0..start.len()).filter(|k| !held.contains(k)).collect();
        let again = minimise_over(&problem, &start, &whole, &others, patience(&problem), None);
        let lowest = if free.cost < fit.cost { free } else { fit.clone() };
        Ok(again.ok().filter(is_enough).unwrap_or(lowest))
    }
}

/// Unknowns of the last effect that are numbers of all shots, with the ends of what is plausible.
fn ranges(hypothesis: &Hypothesis, setup: &Setup, problem: &Problem<'_>) -> Vec<(usize, f64, f64)> {
    let Some(insert) = hypothesis.inserts.last().filter(|_| hypothesis.term.is_none()) else { return Vec::new() };
    let of = |k: usize| {
        let unknown = &problem.unknowns[k];
        let Meaning::Value { prior, .. } = &unknown.meaning else { return None };
        let part = unknown.effect.filter(|part| Some(part.effect) == hypothesis.last() && unknown.shot.is_none())?;
        let (low, high) = insert.effect.parameters.get(part.parameter)?.range?;
        let scale = if part.parameter == 0 { setup.scale(insert) } else { 1.0 };
        Some((k, prior.xi(low * scale, LIMIT), prior.xi(high * scale, LIMIT)))
    };
    (0..problem.unknowns.len()).filter_map(of).collect()
}

/// The size of the last effect in its standard errors, of all shots together where every shot has its own.  The effect's other
/// numbers are held: without a size they mean nothing, and sizes that trade against them may be uncertain where the effect is not.
/// Infinite for an effect that no size makes vanish: how well its size is known says nothing of whether it is there.  None for a fit that
/// was not followed, of which no derivatives are known.
pub(super) fn size_in_errors(hypothesis: &Hypothesis, setup: &Setup, fit: &Fit) -> Option<f64> {
    let problem = hypothesis.problem(setup).ok()?;
    let Some(Sizes { own, away, others }) = sizes(hypothesis, setup, &problem, fit) else { return Some(f64::INFINITY) };
    fit.errors_beside(&own, &away, &others)
}

/// The unknowns of the last effect.
pub(super) struct Sizes {
    /// Those that carry its size in the fitted shots.
    pub(super) own: Vec<usize>,
    /// How far each of them is from nothing.
    pub(super) away: Vec<f64>,
    /// Its other numbers.
    others: Vec<usize>,
}

/// The unknowns of the last effect at the end of a fit; none if no size makes it vanish.
pub(super) fn sizes(hypothesis: &Hypothesis, setup: &Setup, problem: &Problem<'_>, fit: &Fit) -> Option<Sizes> {
    let last = hypothesis.last();
    let effect = hypothesis.inserts.last().filter(|_| hypothesis.term.is_none());
    let nothing = match effect {
        None => 0.0,
        Some(insert) => insert.effect.zero?,
    };
    let part_of = |k: &usize| problem.unknowns[*k].effect.filter(|part| Some(part.effect) == last);
    let all = |wanted: &dyn Fn(usize) -> bool| -> Vec<usize> {
        (0..problem.unknowns.len()).filter(|k| part_of(k).is_some_and(|part| wanted(part.parameter))).collect()
    };
    let (mut own, others) = (all(&|parameter| parameter == 0), all(&|parameter| parameter > 0));
    // Of shots that are not fitted nothing is known.
    own.retain(|&k| setup.train.iter().any(|&shot| problem.unknowns[k].touches(shot)));
    let away = |&k: &usize| match &problem.unknowns[k].meaning {
        Meaning::Value { prior, .. } => (prior.value(fit.xi[k]) - nothing) / prior.slope(fit.xi[k]),
        _ => 0.0,
    };
    let away = own.iter().map(away).collect();
    Some(Sizes { own, away, others })
}

/// False if a number of the last effect lies outside of what its library calls plausible by more than [`NOTHING`] standard errors and
/// [`MARGIN`]: it only resembles what is missing.  Sizes of single shots are not judged.
pub(super) fn is_plausible(hypothesis: &Hypothesis, setup: &Setup, fit: &Fit) -> bool {
    let Ok(problem) = hypothesis.problem(setup) else { return true };
    ranges(hypothesis, setup, &problem).into_iter().all(|(k, low, high)| {
        let error = (NOTHING * fit.standard_error(k).unwrap_or(0.0)).max(MARGIN * (high - low));
        fit.xi[k] + error >= low && fit.xi[k] - error <= high
    })
}

//! Sizes in standard errors, and numbers that can be.
//!
//! A fit may end where an effect has numbers that its library calls implausible: another local minimum, or a number that the
//! measurement hardly decides.  Before such a fit speaks against the effect it is made again from plausible numbers,
//! and once more with the numbers that leave their ranges again held at the ends; where that explains the measurement
//! as well, the plausible fit is the effect's (a profile likelihood over the held numbers: Raue et al., Bioinformatics
//! 25 (2009)).

use super::context::{Search, patience};
use super::pass::{Pass, by_cost, contested};
use super::rule::is_taken;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::thresholds::{ERRORS, LEAD, NOTHING};
use crate::fault::Fault;
use crate::fit::{Fit, minimise, minimise_over};
use crate::problem::Problem;
use crate::setup::Setup;
use crate::unknowns::{LIMIT, Meaning};

/// Most candidates that are fitted again.
const MOST: usize = 3;
/// Part of the range of what is plausible by which a number may lie outside: the ends are judgements, and what else is
/// missing bends numbers.
const MARGIN: f64 = 0.2;

impl Search<'_> {
    /// Fits those that explain about as much as the best again from plausible numbers, where theirs are not.  True if
    /// one has fallen by so much that the others must be compared again.
    pub(super) fn tame(&self, pass: &mut Pass) -> Result<bool, Fault> {
        let Some(&best) = by_cost(&pass.tried).first() else { return Ok(false) };
        let mut has_fallen = false;
        for k in contested(pass, best, self.needed).into_iter().take(MOST) {
            let tried = &mut pass.tried[k];
            let Some(fit) = tried.fit.take_if(|fit| !is_plausible(&tried.hypothesis, self.setup, fit)) else {
                continue;
            };
            (self.progress)(&format!("fitting {} from plausible numbers", tried.hypothesis.label()));
            let before = fit.cost;
            let fit = self.tamed(&tried.hypothesis, fit, pass.expected)?;
            has_fallen |= before - fit.cost > LEAD * (fit.misfit / pass.expected).max(1.0);
            tried.fit = Some(fit);
        }
        Ok(has_fallen)
    }

    /// The one of the lower cost, but no implausible one for a small drop.
    pub(super) fn preferred(&self, hypothesis: &Hypothesis, old: Fit, new: Fit, expected: f64) -> Fit {
        let scale = (new.misfit / expected).max(1.0);
        let plausible = |fit: &Fit| is_plausible(hypothesis, self.setup, fit);
        if is_taken(old.cost - new.cost, scale, || plausible(&old), || plausible(&new)) { new } else { old }
    }

    /// The fit with plausible numbers, if it explains the measurement as well; else the fit as it is.
    pub(super) fn tamed(&self, hypothesis: &Hypothesis, fit: Fit, expected: f64) -> Result<Fit, Fault> {
        let make = || self.tamed_here(hypothesis, fit.clone(), expected);
        self.one(|| self.task("tame", hypothesis, &[&[expected]]).with(&fit), make)
    }

    fn tamed_here(&self, hypothesis: &Hypothesis, fit: Fit, expected: f64) -> Result<Fit, Fault> {
        let (problem, whole) = (hypothesis.problem(self.setup)?, self.whole());
        let is_enough = |own: &Fit, lowest: f64| {
            let scale = (own.misfit / expected).max(1.0);
            is_plausible(hypothesis, self.setup, own) && own.cost < lowest + LEAD * scale
        };
        let mut start = fit.xi.clone();
        let ends = ranges(hypothesis, self.setup, &problem);
        for &(k, low, high) in &ends {
            let is_size = problem.unknowns[k].effect.is_some_and(|part| part.parameter == 0);
            if !(low..=high).contains(&start[k]) {
                // Other numbers than the size may be had from what is expected.
                start[k] = if is_size { start[k].clamp(low, high) } else { 0.0 };
            }
        }
        let known =
            fit.jacobian.as_ref().map(|own| (&own.matrix, &whole)).filter(|(own, _)| own.ncols() == start.len());
        let Ok(free) = minimise(&problem, &start, &whole, patience(&problem), known) else { return Ok(fit) };
        if is_enough(&free, fit.cost) {
            return Ok(free);
        }
        let lowest = if free.cost < fit.cost { free } else { fit };
        let mut start = lowest.xi.clone();
        let mut held = Vec::new();
        for &(k, low, high) in &ends {
            if !(low..=high).contains(&start[k]) {
                start[k] = start[k].clamp(low, high);
                held.push(k);
            }
        }
        let others: Vec<usize> = (0..start.len()).filter(|k| !held.contains(k)).collect();
        let again = minimise_over(&problem, &start, &whole, &others, patience(&problem), None);
        let Some(mut again) = again.ok().filter(|own| is_enough(own, lowest.cost)) else { return Ok(lowest) };
        drop(problem);
        // Derivatives by what was held, too.
        hypothesis.refresh(self.setup, &mut again, &whole)?;
        Ok(again)
    }
}

/// Unknowns of the last effect that are numbers of all shots, with the ends of what is plausible; none of a term.
fn ranges(hypothesis: &Hypothesis, setup: &Setup, problem: &Problem<'_>) -> Vec<(usize, f64, f64)> {
    let last = hypothesis.inserts.len().checked_sub(1).filter(|_| hypothesis.terms.is_empty());
    last.map_or(Vec::new(), |number| ranges_of(number, hypothesis, setup, problem))
}

/// The same of one of the effects.
fn ranges_of(number: usize, hypothesis: &Hypothesis, setup: &Setup, problem: &Problem<'_>) -> Vec<(usize, f64, f64)> {
    let insert = &hypothesis.inserts[number];
    let of = |k: usize| {
        let unknown = &problem.unknowns[k];
        let Meaning::Value { prior, .. } = &unknown.meaning else { return None };
        let part = unknown.effect.filter(|part| part.effect == number && unknown.shot.is_none())?;
        let (low, high) = insert.effect.parameters.get(part.parameter)?.range?;
        let scale = if part.parameter == 0 { setup.scale(insert) } else { 1.0 };
        Some((k, prior.xi(low * scale, LIMIT), prior.xi(high * scale, LIMIT)))
    };
    (0..problem.unknowns.len()).filter_map(of).collect()
}

/// The size of the last effect in its standard errors, of all shots together where every shot has its own.  The
/// effect's other numbers are held: without a size they mean nothing, and sizes that trade against them may be
/// uncertain where the effect is not. Infinite for an effect that no size makes vanish: how well its size is known says
/// nothing of whether it is there.  None for a fit that was not followed, of which no derivatives are known.
pub(super) fn size_in_errors(hypothesis: &Hypothesis, setup: &Setup, fit: &Fit) -> Option<f64> {
    let problem = hypothesis.problem(setup).ok()?;
    let Some(Sizes { own, away, others }) = sizes(hypothesis, setup, &problem, fit) else { return Some(f64::INFINITY) };
    fit.errors_beside(&own, &away, &others)
}

/// Effects of the base of a pass whose size is hardly one in the end: what was found later may have taken their part.
pub(super) fn vanished(pass: &Pass, setup: &Setup) -> Vec<usize> {
    let Ok(problem) = pass.base.problem(setup) else { return Vec::new() };
    let has_vanished = |&number: &usize| {
        let sizes = sizes_of(number, &pass.base, setup, &problem, &pass.fit);
        let errors = sizes.and_then(|sizes| pass.fit.errors_beside(&sizes.own, &sizes.away, &sizes.others));
        errors.is_some_and(|errors| errors < ERRORS)
    };
    (0..pass.base.inserts.len()).filter(has_vanished).collect()
}

/// The unknowns of an effect.
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
    sizes_of(hypothesis.last()?, hypothesis, setup, problem, fit)
}

/// The same for one of the effects; the term is the one after them.
fn sizes_of(number: usize, hypothesis: &Hypothesis, setup: &Setup, problem: &Problem<'_>, fit: &Fit) -> Option<Sizes> {
    let nothing = match hypothesis.inserts.get(number) {
        None => 0.0,
        Some(insert) => insert.effect.zero?,
    };
    let part_of = |k: &usize| problem.unknowns[*k].effect.filter(|part| part.effect == number);
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

/// False if a number of the last effect lies outside of what its library calls plausible by more than [`NOTHING`]
/// standard errors and [`MARGIN`]: it only resembles what is missing.  Sizes of single shots are not judged.
pub(super) fn is_plausible(hypothesis: &Hypothesis, setup: &Setup, fit: &Fit) -> bool {
    let Ok(problem) = hypothesis.problem(setup) else { return true };
    ranges(hypothesis, setup, &problem).into_iter().all(|range| is_within(fit, range))
}

/// The same of one of the effects.
pub(super) fn are_plausible(hypothesis: &Hypothesis, setup: &Setup, fit: &Fit, number: usize) -> bool {
    let Ok(problem) = hypothesis.problem(setup) else { return true };
    ranges_of(number, hypothesis, setup, &problem).into_iter().all(|range| is_within(fit, range))
}

fn is_within(fit: &Fit, (k, low, high): (usize, f64, f64)) -> bool {
    let error = (NOTHING * fit.standard_error(k).unwrap_or(0.0)).max(MARGIN * (high - low));
    fit.xi[k] + error >= low && fit.xi[k] - error <= high
}

/// Which number is beyond what is plausible, with its value and its range.
pub(super) fn implausible(hypothesis: &Hypothesis, setup: &Setup, fit: &Fit) -> Option<String> {
    let problem = hypothesis.problem(setup).ok()?;
    let (k, low, high) = ranges(hypothesis, setup, &problem).into_iter().find(|range| !is_within(fit, *range))?;
    let unknown = &problem.unknowns[k];
    let [value, low, high] = [fit.xi[k], low, high].map(|xi| unknown.value(xi));
    let name = &unknown.name;
    Some(format!("{name} = {value:.3e} is beyond what is plausible, {low:.3e} to {high:.3e}"))
}

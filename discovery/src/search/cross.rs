//! Fits from each other's nuisances, so that no name rests on a fit that only ended early (equal effort).

use super::context::{Search, patience};
use super::pass::{CLOSE, Pass, Tried, by_cost};
use super::plausible;
use crate::catalogue::Candidate;
use crate::fault::Fault;
use crate::fit::{Effort, Fit, minimise};

/// A drop of the cost that exceeds the square of the size in standard errors so many times is none within one local minimum.
const APART: f64 = 2.0;
/// Most candidates that are fitted again because they were given up, and their sizes as multiples of the typical one.
const MOST_GIVEN_UP: usize = 6;
const GIVEN_UP: [f64; 8] = [1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.35, 1.0, 2.0];
/// A short fit that leaves so many times what the best does is not followed.
const HOPELESS: f64 = 100.0;

/// True if one of two effects names the other as a rival, or is a plainer form of it.
fn are_rivals(one: &Candidate, other: &Candidate) -> bool {
    let names = |a: &Candidate, b: &Candidate| {
        a.effect.rivals.contains(&b.effect.id)
            || a.effect.refines.contains(&b.effect.id)
            || a.effect.excludes.contains(&b.effect.id)
    };
    names(one, other) || names(other, one)
}

impl Search<'_> {
    /// Fits again from each other's nuisances: the base from the best candidate's, and where the lead is small the best from the
    /// next one's and the next ones from the best one's.
    pub(super) fn cross(&self, pass: &mut Pass) -> Result<(), Fault> {
        let order = by_cost(&pass.tried);
        let Some(&best) = order.first() else { return Ok(()) };
        let count = pass.fit.xi.len();
        let whole = self.whole();
        let nuisances = |tried: &Tried| tried.fit.as_ref().map(|fit| fit.xi[..count].to_vec());
        self.without(pass, best)?;
        self.given_up(pass, best)?;
        self.plainest(pass)?;
        let order = by_cost(&pass.tried);
        let Some(&best) = order.first() else { return Ok(()) };
        let cost = |tried: &Tried| tried.fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
        let lowest = cost(&pass.tried[best]);
        let near = CLOSE.0.max(CLOSE.1 * (pass.fit.cost - lowest));
        let rivals = order[1..].iter().copied().filter(|&k| cost(&pass.tried[k]) - lowest < near).take(2);
        let rivals: Vec<usize> = rivals.collect();
        let from_best = nuisances(&pass.tried[best]);
        let mut again: Vec<(usize, Option<Vec<f64>>)> = rivals.iter().map(|&k| (k, from_best.clone())).collect();
        again.extend(rivals.first().map(|&other| (best, nuisances(&pass.tried[other]))));
        let from = |(k, start): (usize, Option<Vec<f64>>)| {
            let old = pass.tried[k].fit.as_ref()?;
            Some((k, [&start?[..], &old.xi[count..]].concat()))
        };
        let again: Vec<(usize, Vec<f64>)> = again.into_iter().filter_map(from).collect();
        let task = |k: usize| {
            let Tried { hypothesis, fit, .. } = &pass.tried[again[k].0];
            let task = self.task("cross", hypothesis, &[&again[k].1]);
            fit.iter().fold(task, |task, fit| task.with(fit))
        };
        let make = |k: usize| {
            let Tried { hypothesis, fit, .. } = &pass.tried[again[k].0];
            let problem = hypothesis.problem(self.setup)?;
            let jacobian = fit.as_ref().and_then(|fit| fit.jacobian.as_ref());
            let known = jacobian.map(|jacobian| (&jacobian.matrix, &whole));
            Ok(minimise(&problem, &again[k].1, &whole, patience(&problem), known).ok())
        };
        let next = self.each(again.len(), task, make)?;
        for (&(k, _), next) in again.iter().zip(next) {
            self.take_preferred(&mut pass.tried[k], next, pass.expected);
        }
        Ok(())
    }

    /// Candidates whose fits were given up or ran out of steps, once more from the nuisances of the best: what bends those may
    /// have kept a rival from the measurement that explains as much.
    fn given_up(&self, pass: &mut Pass, best: usize) -> Result<(), Fault> {
        let (count, whole) = (pass.fit.xi.len(), self.whole());
        let Some(fit) = pass.tried[best].fit.clone() else { return Ok(()) };
        let scale = (fit.misfit / pass.expected).max(1.0);
        if pass.fit.cost - fit.cost < self.needed * scale || !pass.tried[best].hypothesis.machine.is_fast() {
            return Ok(());
        }
        let Some(leader) = pass.tried[best].hypothesis.inserts.last().cloned() else { return Ok(()) };
        let is_open = |&k: &usize| {
            let tried = &pass.tried[k];
            let is_above =
                |own: &Fit| !own.converged && own.cost > fit.cost + CLOSE.0.max(CLOSE.1 * (pass.fit.cost - fit.cost));
            k != best && tried.hypothesis.machine.is_fast() && tried.fit.as_ref().is_some_and(is_above)
        };
        let mut open: Vec<usize> = (0..pass.tried.len()).filter(is_open).collect();
        // Its rivals first, then what promised most.
        open.sort_by_key(|&k| !pass.tried[k].hypothesis.inserts.last().is_some_and(|own| are_rivals(own, &leader)));
        open.truncate(MOST_GIVEN_UP);
        let task = |k: usize| self.task("given up", &pass.tried[open[k]].hypothesis, &[]).with(&fit);
        let make = |k: usize| {
            let hypothesis = &pass.tried[open[k]].hypothesis;
            (self.progress)(&format!("fitting {} from the best candidate's parameters", hypothesis.label()));
            let problem = hypothesis.problem(self.setup)?;
            let Some(insert) = hypothesis.inserts.last() else { return Ok(None) };
            let typical = insert.effect.probe * self.setup.scale(insert);
            let sizes = GIVEN_UP.iter().map(|size| hypothesis.at_size(&problem, &fit.xi[..count], size * typical));
            let starts = sizes.filter_map(|xi| Fit::at(&problem, &xi, &whole).ok());
            let Some(start) = starts.min_by(|a, b| a.cost.total_cmp(&b.cost)) else { return Ok(None) };
            let Ok(next) = minimise(&problem, &start.xi, &whole, Effort::SHORT, None) else { return Ok(None) };
            if next.misfit < HOPELESS * fit.misfit.max(pass.expected)
                && let Ok(end) = minimise(&problem, &next.xi, &whole, patience(&problem), None)
            {
                return Ok(Some(end));
            }
            Ok(Some(next))
        };
        let next = self.each(open.len(), task, make)?;
        for (k, next) in open.into_iter().zip(next) {
            self.take_preferred(&mut pass.tried[k], next, pass.expected);
        }
        Ok(())
    }

    /// Puts a new fit in the place of the old one where it is [preferred](Search::preferred).
    fn take_preferred(&self, tried: &mut Tried, next: Option<Fit>, expected: f64) {
        if let (Some(_), Some(next)) = (&tried.fit, next)
            && let Some(old) = tried.fit.take()
        {
            tried.fit = Some(self.preferred(&tried.hypothesis, old, next, expected));
        }
    }

    /// Fits the base again from where the best candidate ended: from its nuisances, and from where they would go
    /// without it.  Where the drop of the cost is much larger than the size in standard errors tells, the two lie in
    /// different local minima.
    fn without(&self, pass: &mut Pass, best: usize) -> Result<(), Fault> {
        (self.progress)("fitting again from each other's parameters");
        let tried = &pass.tried[best];
        let Some(fit) = &tried.fit else { return Ok(()) };
        let (count, whole) = (pass.fit.xi.len(), self.whole());
        let problem = pass.base.problem(self.setup)?;
        let mut tries: Vec<(&str, Fit)> = Vec::new();
        let known = pass.fit.jacobian.as_ref().map(|jacobian| (&jacobian.matrix, &whole));
        let against = Effort::FULL.against(fit.cost);
        let task = |role: &str, start: &[f64]| self.task(role, &pass.base, &[start, &[fit.cost]]).with(&pass.fit);
        let make = || Ok(minimise(&problem, &fit.xi[..count], &whole, against, known).ok());
        let plain = self.one(|| task("without", &fit.xi[..count]), make)?;
        tries.extend(plain.map(|again| ("from the best candidate's parameters", again)));
        let own = tried.hypothesis.problem(self.setup)?;
        let lowest = tries.iter().map(|(_, again)| again.cost).fold(pass.fit.cost, f64::min);
        if own.machine.is_fast()
            && let Some(sizes) = plausible::sizes(&tried.hypothesis, self.setup, &own, fit)
            && let Some(errors) = fit.errors_beside(&sizes.own, &sizes.away, &[])
            && lowest - fit.cost > APART * errors * errors + self.needed
            && let Some(start) = fit.moved_back(&sizes.own, &sizes.away)
            && let Some(again) = self.one(
                || task("moved back", &start[..count]),
                || Ok(minimise(&problem, &start[..count], &whole, Effort::FULL, None).ok()),
            )?
        {
            tries.push(("from the best candidate's parameters without it", again));
        }
        drop((problem, own));
        for (words, again) in tries {
            pass.record.note(words, &again, pass.expected);
            pass.fit = self.preferred(&pass.base, pass.fit.clone(), again, pass.expected);
        }
        Ok(())
    }
}

//! Is an effect that was found earlier still the best in its place, now that another one is in the model?
//!
//! As long as something else was missing, an effect may have been taken up because it imitated a part of that.  What stood against it is
//! fitted in its place beside all others, and takes it where it explains more, or as much with fewer numbers (the exchange of stepwise selection:
//! Miller, Subset Selection in Regression, 2002, section 3.4).

use super::context::{Search, patience};
use super::found::{Found, Rival};
use super::pass::Pass;
use super::plausible::are_plausible;
use super::rule::{Exchange, exchange};
use crate::catalogue::Candidate;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::thresholds::LEAD;
use crate::fault::Fault;
use crate::fit::{Fit, minimise};
use crate::problem::Problem;

/// How a verdict on a rival begins.
const BESIDE: &str = "with the other effects in the model";

impl Search<'_> {
    /// Fits rivals in the places of all effects but the last one, and keeps the better one of each; the fit of what is in the model then.
    /// A tie that is decided is over, and what has lost gets its verdict where it was fitted first.
    ///
    /// # Errors
    /// A model that cannot be translated.
    pub(super) fn exchanged(&self, found: &mut Found, passes: &mut [Pass], mut fit: Fit) -> Result<Fit, Fault> {
        for number in 0..found.all.len().saturating_sub(1) {
            let (mut kept, mut alike): (Vec<Rival>, Vec<(Candidate, f64)>) = (Vec::new(), Vec::new());
            for rival in std::mem::take(&mut found.all[number].rivals) {
                let others =
                    || found.all.iter().enumerate().filter(|(k, _)| *k != number).map(|(_, own)| &own.candidate);
                if others().any(|own| own.excludes(&rival.candidate) || own.is_same(&rival.candidate)) {
                    continue;
                }
                let own = &found.all[number].candidate;
                (self.progress)(&format!("fitting {} in the place of {}", rival.candidate.label(), own.label()));
                let with = Hypothesis::new(self.setup, self.workshop, found.effects())?;
                let problem = with.problem(self.setup)?;
                let scale = (fit.misfit / problem.expected(&self.whole())).max(1.0);
                let Some((other, again)) = self.in_place(&found.effects(), &problem, &fit, number, &rival)? else {
                    continue;
                };
                drop(problem);
                let plausible =
                    [(&with, &fit), (&other, &again)].map(|(of, fit)| are_plausible(of, self.setup, fit, number));
                let cost_drop = (fit.cost - again.cost) / scale;
                // A tie is decided by what else is missing, not by being plain.
                let is_tied = found.ties.iter().any(|tie| tie.number == number);
                let numbers = [own, &rival.candidate].map(|of| of.effect.parameters.len());
                let fewer = if is_tied { 0 } else { numbers[0].saturating_sub(numbers[1]) };
                match exchange(cost_drop, plausible, fewer) {
                    // It is asked again once another one is found.
                    Exchange::Stays => {
                        tell(passes, &rival.candidate, own, -cost_drop, plausible[1]);
                        kept.push(rival);
                    }
                    Exchange::Open => {
                        alike.push((rival.candidate.clone(), -cost_drop));
                        kept.push(rival);
                    }
                    Exchange::Replaced => {
                        let numbers = numbers_of(&with.problem(self.setup)?, &fit, number);
                        acquit(passes, &rival.candidate);
                        tell(passes, own, &rival.candidate, cost_drop, plausible[0]);
                        let own = std::mem::replace(&mut found.all[number].candidate, rival.candidate);
                        kept.push(Rival { candidate: own, numbers });
                        fit = again;
                        // What was as good as the one before is as far behind as that is now, or closer.
                        alike.iter_mut().for_each(|own| own.1 += cost_drop);
                        alike.retain(|own| own.1 < LEAD);
                    }
                }
            }
            found.ties.retain(|tie| tie.number != number || !alike.is_empty());
            let own = &mut found.all[number];
            (own.rivals, own.alike) = (kept, alike);
        }
        Ok(fit)
    }

    /// The model with a rival in the place of an effect, and its fit from where both were; none where no fit succeeds.
    fn in_place(
        &self,
        effects: &[Candidate],
        with: &Problem<'_>,
        fit: &Fit,
        number: usize,
        rival: &Rival,
    ) -> Result<Option<(Hypothesis, Fit)>, Fault> {
        let mut inserts = effects.to_vec();
        inserts[number] = rival.candidate.clone();
        let other = Hypothesis::new(self.setup, self.workshop, inserts)?;
        let problem = other.problem(self.setup)?;
        let is_own = |of: &Problem<'_>, k: usize| of.unknowns[k].effect.is_some_and(|part| part.effect == number);
        let mut kept = (0..fit.xi.len()).filter(|&k| !is_own(with, k)).map(|k| fit.xi[k]);
        let mut numbers = rival.numbers.iter().copied();
        let start = (0..problem.unknowns.len()).map(|k| {
            let known = if is_own(&problem, k) { numbers.next() } else { kept.next() };
            problem.unknowns[k].within(known.unwrap_or(0.0))
        });
        let start: Vec<f64> = start.collect();
        // What does not catch up explains less, however far it is followed.
        let effort = patience(&problem).against(fit.cost);
        let make = || Ok(minimise(&problem, &start, &self.whole(), effort, None).ok());
        let again = self.one(|| self.task("in place", &other, &[&start, &[fit.cost]]), make)?;
        drop(problem);
        Ok(again.map(|again| (other, again)))
    }

    /// The effects without the one in the last tie, and the fit of the rest; none where no fit succeeds.
    pub(super) fn without_tie(&self, found: &mut Found, fit: &Fit) -> Result<Option<Fit>, Fault> {
        let Some(number) = found.ties.last().map(|tie| tie.number) else { return Ok(None) };
        let with = Hypothesis::new(self.setup, self.workshop, found.effects())?;
        let problem = with.problem(self.setup)?;
        let is_own = |k: &usize| problem.unknowns[*k].effect.is_some_and(|part| part.effect == number);
        let start: Vec<f64> = (0..fit.xi.len()).filter(|k| !is_own(k)).map(|k| fit.xi[k]).collect();
        drop(problem);
        found.remove(number);
        let rest = Hypothesis::new(self.setup, self.workshop, found.effects())?;
        let problem = rest.problem(self.setup)?;
        Ok(minimise(&problem, &start, &self.whole(), patience(&problem), None).ok())
    }
}

/// Says of a candidate, in the passes where it was fitted and nothing weightier spoke against it, that another one has its place now.
fn tell(passes: &mut [Pass], candidate: &Candidate, winner: &Candidate, cost_drop: f64, is_plausible: bool) {
    let words = if is_plausible {
        format!("{BESIDE}, {} explains more, by {cost_drop:.0}", winner.label())
    } else {
        let winner = winner.label();
        format!("{BESIDE} its numbers are beyond what is plausible; {winner} is kept instead")
    };
    let tried = passes.iter_mut().flat_map(|pass| &mut pass.tried);
    for own in tried.filter(|own| own.fit.is_some() && own.verdict.is_empty() && own.hypothesis.ends_with(candidate)) {
        own.verdict.clone_from(&words);
    }
}

/// Takes back the verdict on a candidate that has a place now.
fn acquit(passes: &mut [Pass], candidate: &Candidate) {
    let tried = passes.iter_mut().flat_map(|pass| &mut pass.tried);
    for own in tried.filter(|own| own.verdict.starts_with(BESIDE) && own.hypothesis.ends_with(candidate)) {
        own.verdict.clear();
    }
}

fn numbers_of(problem: &Problem<'_>, fit: &Fit, number: usize) -> Vec<f64> {
    let is_own = |k: &usize| problem.unknowns[*k].effect.is_some_and(|part| part.effect == number);
    (0..fit.xi.len()).filter(is_own).map(|k| fit.xi[k]).collect()
}

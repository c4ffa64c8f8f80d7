//! Was the right one named, now that its fit has found a lower local minimum?
//!
//! Rivals were fitted in the local minimum that all shared then, and so was the model without any of them.  Where the fit of
//! the model with the named effect falls further in the next pass, they are fitted again from there, and the name is
//! given anew.

use super::context::{Search, patience};
use super::pass::Pass;
use super::plausible::is_plausible;
use super::rule::Outcome;
use crate::evidence::thresholds::LEAD;
use crate::fault::Fault;
use crate::fit::schedule::lower;
use crate::fit::{Effort, minimise};

/// Rivals that explained at least this share of what the named effect did are fitted again, so many of them.
const RIVALS: (f64, usize) = (0.5, 3);

impl Search<'_> {
    /// Fits what stood against the effect named in `before` from where `pass`, which begins with it, has ended; true if
    /// `before` no longer names that one.
    pub(super) fn revisit(&self, before: &mut Pass, pass: &Pass) -> Result<bool, Fault> {
        let own = pass.base.key();
        let Some(first) = before.tried.iter().position(|tried| tried.hypothesis.key() == own) else {
            return Ok(false);
        };
        let named = &before.tried[first];
        let Some(known) = named.fit.as_ref().filter(|fit| fit.xi.len() == pass.fit.xi.len()) else { return Ok(false) };
        let scale = (pass.fit.misfit / pass.expected).max(1.0);
        if known.cost - pass.fit.cost < LEAD * scale {
            return Ok(false);
        }
        (self.progress)("fitting the rivals again from a lower local minimum");
        let (count, whole) = (before.fit.xi.len(), self.whole());
        let nuisances = &pass.fit.xi[..count];
        let enough = RIVALS.0 * named.cost_drop;
        let fit = if is_plausible(&pass.base, self.setup, &pass.fit) {
            pass.fit.clone()
        } else {
            self.tamed(&pass.base, pass.fit.clone(), pass.expected)?
        };
        before.tried[first].fit = Some(fit);
        let others = before.tried.iter_mut().filter(|tried| tried.hypothesis.key() != own && tried.cost_drop >= enough);
        for rival in others.take(RIVALS.1).chain(before.terms.first_mut()) {
            let Some(old) = rival.fit.clone() else { continue };
            let start = [nuisances, &old.xi[count..]].concat();
            let make = || {
                let problem = rival.hypothesis.problem(self.setup)?;
                Ok(minimise(&problem, &start, &whole, patience(&problem), None).ok())
            };
            let Some(again) = self.one(|| self.task("revisit", &rival.hypothesis, &[&start]), make)? else { continue };
            rival.fit = Some(lower(old, again));
        }
        let problem = before.base.problem(self.setup)?;
        let effort = Effort::FULL.against(before.fit.cost);
        if let Ok(again) = minimise(&problem, nuisances, &whole, effort, None) {
            before.record.note("from where the next pass ended", &again, before.expected);
            before.fit = lower(before.fit.clone(), again);
        }
        drop(problem);
        self.judge(before);
        let outcome = self.outcome(before);
        let is_same = matches!(outcome, Outcome::Name(k) if before.tried[k].hypothesis.key() == own);
        Ok(!is_same)
    }
}

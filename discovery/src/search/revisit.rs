//! Was the right one named, now that its fit has found a lower valley?
//!
//! Rivals were fitted in the valley that all shared then.  Where the fit of the model with the named effect falls further in the next
//! pass, the rivals are fitted again from there, and the name is given anew.

use super::decide::Outcome;
use super::shortlist::patience;
use super::{LEAD, Pass, Search};
use crate::Fault;
use crate::fit::minimise;
use crate::fit::schedule::lower;

/// Rivals that explained at least this share of what the named effect did are fitted again, so many of them.
const RIVALS: (f64, usize) = (0.5, 3);

impl Search<'_> {
    /// Fits the rivals of the effect named in `before` from where `pass`, which begins with it, has ended; the outcome of `before` if it
    /// is no longer that one.
    pub(super) fn revisit(&self, before: &mut Pass, pass: &Pass) -> Result<Option<Outcome>, Fault> {
        let label = pass.base.label();
        let Some(first) = before.tried.iter().position(|tried| tried.hypothesis.label() == label) else {
            return Ok(None);
        };
        let named = &before.tried[first];
        let Some(known) = named.fit.as_ref().map(|fit| fit.cost) else { return Ok(None) };
        let scale = (pass.fit.misfit / pass.expected).max(1.0);
        if known - pass.fit.cost < LEAD * scale || pass.fit.xi.len() != named.fit.as_ref().map_or(0, |fit| fit.xi.len())
        {
            return Ok(None);
        }
        (self.progress)("fitting the rivals again from a lower valley");
        let (count, whole) = (before.fit.xi.len(), self.whole());
        let enough = RIVALS.0 * named.fall;
        before.tried[first].fit = Some(pass.fit.clone());
        let others = before.tried.iter_mut().filter(|tried| tried.hypothesis.label() != label);
        for rival in others.filter(|tried| tried.fall >= enough).take(RIVALS.1) {
            let Some(old) = rival.fit.clone() else { continue };
            let start = [&pass.fit.xi[..count], &old.xi[count..]].concat();
            let problem = rival.hypothesis.problem(self.setup)?;
            let Ok(again) = minimise(&problem, &start, &whole, patience(&problem), None) else { continue };
            drop(problem);
            rival.fit = Some(lower(old, again));
        }
        self.judge(before);
        let outcome = self.outcome(before);
        let is_same = matches!(outcome, Outcome::Name(k) if before.tried[k].hypothesis.label() == label);
        Ok((!is_same).then_some(outcome))
    }
}

//! Is an effect that was named earlier still needed, now that another one is in the model?
//!
//! What was named first may only have imitated what was found later.  Each earlier effect is taken out again and the rest fitted;
//! it stays if that costs as much as a name takes ([`Search::needed`]).  So is, in the end, each whose size has become uncertain.

use super::context::Search;
use crate::catalogue::Candidate;
use crate::evidence::hypothesis::Hypothesis;
use crate::fault::Fault;
use crate::fit::{Effort, Fit, minimise};

impl Search<'_> {
    /// The first one of the `doubted` effects that is not needed, and the fit without it; none where all are.
    pub(super) fn needless(
        &self,
        found: &[Candidate],
        fit: &Fit,
        doubted: &[usize],
    ) -> Result<Option<(usize, Fit)>, Fault> {
        for &out in doubted {
            (self.progress)(&format!("fitting without {}", found[out].label()));
            let Some((rest, again)) = self.taken_out(found, fit, out)? else { continue };
            let expected = rest.problem(self.setup)?.expected(&self.whole());
            if (again.cost - fit.cost) / (fit.misfit / expected).max(1.0) <= self.needed {
                return Ok(Some((out, again)));
            }
        }
        Ok(None)
    }
    /// The model without one of its effects, and its fit from where that with it ended; none where no fit succeeds.
    pub(super) fn taken_out(
        &self,
        found: &[Candidate],
        fit: &Fit,
        out: usize,
    ) -> Result<Option<(Hypothesis, Fit)>, Fault> {
        let hypothesis = Hypothesis::new(self.setup, self.workshop, found.to_vec())?;
        let with = hypothesis.problem(self.setup)?;
        let is_kept = |k: &usize| with.unknowns[*k].effect.is_none_or(|part| part.effect != out);
        let start: Vec<f64> = (0..with.unknowns.len()).filter(is_kept).map(|k| fit.xi[k]).collect();
        let mut rest = found.to_vec();
        rest.remove(out);
        let rest = Hypothesis::new(self.setup, self.workshop, rest)?;
        let make = || Ok(minimise(&rest.problem(self.setup)?, &start, &self.whole(), Effort::FULL, None).ok());
        let again = self.one(|| self.task("taken out", &rest, &[&start]), make)?;
        Ok(again.map(|again| (rest, again)))
    }
}

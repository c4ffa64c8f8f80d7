//! Is an effect that was named earlier still needed, now that another one is in the model?
//!
//! What was named first may only have imitated what was found later.  Each earlier effect is taken out again and the rest fitted;
//! it stays if that costs as much as a name takes ([`Search::needed`]).  So is, in the end, each whose size has become uncertain.

use super::context::Search;
use crate::catalogue::Candidate;
use crate::fault::Fault;
use crate::fit::{Effort, Fit, minimise};
use crate::hypothesis::Hypothesis;

impl Search<'_> {
    /// The first one of the `doubted` effects that is not needed, and the fit without it; none where all are.
    pub(super) fn needless(
        &self,
        found: &[Candidate],
        fit: &Fit,
        doubted: &[usize],
    ) -> Result<Option<(usize, Fit)>, Fault> {
        for &out in doubted {
            let mut rest = found.to_vec();
            let dropped = rest.remove(out);
            (self.progress)(&format!("fitting without {}", dropped.label()));
            let hypothesis = Hypothesis::new(self.setup, self.workshop, found.to_vec())?;
            let with = hypothesis.problem(self.setup)?;
            let own = |k: &usize| with.unknowns[*k].effect.is_none_or(|part| part.effect != out);
            let kept: Vec<usize> = (0..with.unknowns.len()).filter(own).collect();
            let scale = (fit.misfit / with.expected(&self.whole())).max(1.0);
            let start: Vec<f64> = kept.iter().map(|&k| fit.xi[k]).collect();
            let without = Hypothesis::new(self.setup, self.workshop, rest)?;
            let problem = without.problem(self.setup)?;
            let Ok(again) = minimise(&problem, &start, &self.whole(), Effort::FULL, None) else { continue };
            if (again.cost - fit.cost) / scale <= self.needed {
                drop(problem);
                return Ok(Some((out, again)));
            }
        }
        Ok(None)
    }
}

//! Does a plainer effect do, now that another one is in the model?
//!
//! Before the other one was found, an effect with further numbers (`refines`) may have imitated it with them.  The plainer one that it
//! refines takes its place where that costs less than a lead ([`LEAD`]).

use super::context::Search;
use crate::catalogue::Candidate;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::thresholds::LEAD;
use crate::fault::Fault;
use crate::fit::{Effort, Fit, minimise};
use crate::unknowns::{LIMIT, Meaning};

impl Search<'_> {
    /// The effects with a plainer one in the place of the first that needs no more, and the fit with it; none where all do.
    pub(super) fn plainer(&self, found: &[Candidate], fit: &Fit) -> Result<Option<(Vec<Candidate>, Fit)>, Fault> {
        for (number, own) in found.iter().enumerate().filter(|(_, own)| !own.effect.refines.is_empty()) {
            let beside = || found.iter().enumerate().filter(|&(k, _)| k != number).map(|(_, other)| other);
            let is_plainer = |other: &&Candidate| own.refines(other) && own.effect.id != other.effect.id;
            let is_free = |other: &&Candidate| !beside().any(|own| own.excludes(other) || own.is_same(other));
            let Some(plainer) = self.candidates.iter().filter(is_plainer).find(is_free) else { continue };
            (self.progress)(&format!("fitting {} in the place of {}", plainer.label(), own.label()));
            let with = Hypothesis::new(self.setup, self.workshop, found.to_vec())?;
            let with = with.problem(self.setup)?;
            let is_own = |k: usize| with.unknowns[k].effect.is_some_and(|part| part.effect == number);
            let size = (0..fit.xi.len()).find(|&k| is_own(k)).map(|k| with.unknowns[k].value(fit.xi[k]));
            let scale = (fit.misfit / with.expected(&self.whole())).max(1.0);
            let mut others = (0..fit.xi.len()).filter(|&k| !is_own(k)).map(|k| fit.xi[k]);
            let mut inserts = found.to_vec();
            inserts[number] = plainer.clone();
            let without = Hypothesis::new(self.setup, self.workshop, inserts.clone())?;
            let problem = without.problem(self.setup)?;
            let start = problem.unknowns.iter().map(|unknown| match (&unknown.meaning, unknown.effect, size) {
                (Meaning::Value { prior, .. }, Some(part), Some(size)) if part.effect == number => {
                    unknown.within(if part.parameter == 0 { prior.xi(size, LIMIT - 1.0) } else { 0.0 })
                }
                _ => others.next().unwrap_or(0.0),
            });
            let start: Vec<f64> = start.collect();
            let make = || Ok(minimise(&problem, &start, &self.whole(), Effort::FULL, None).ok());
            let Some(again) = self.one(|| self.task("plainer", &without, &[&start]), make)? else { continue };
            if (again.cost - fit.cost) / scale <= LEAD {
                drop(problem);
                return Ok(Some((inserts, again)));
            }
        }
        Ok(None)
    }
}

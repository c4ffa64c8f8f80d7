//! Looks at all candidates without a fit: scores, powers, and where in the equations something is missing.

use super::context::Search;
use super::pass::{Pass, Tried};
use crate::catalogue::Candidate;
use crate::evidence::hypothesis::{Hypothesis, Look};
use crate::evidence::power::{Power, confusions};
use crate::evidence::projection::Projection;
use crate::evidence::thresholds::{NEEDED, adequate, noise};
use crate::fault::Fault;
use crate::fit::schedule;

impl Search<'_> {
    /// Looks at all candidates that can join, but those that were needless once, and at the equations.
    pub(super) fn look(&self, pass: &mut Pass, refused: &[Candidate]) -> Result<(), Fault> {
        if pass.tried.is_empty() {
            self.screen_effects(pass, refused)?;
        }
        let promise = pass.tried.first().and_then(|own| own.look.as_ref()).map_or(0.0, Look::promise);
        let is_bent = pass.seen.is_some();
        if pass.fit.misfit > adequate(pass.expected) || pass.base.inserts.is_empty() && promise > NEEDED && !is_bent {
            self.look_at_equations(pass)?;
        }
        Ok(())
    }

    /// Looks at all candidates that can join, but those that were needless once.
    pub(super) fn screen_effects(&self, pass: &mut Pass, refused: &[Candidate]) -> Result<(), Fault> {
        let weighing = self.whole();
        let mut fit = pass.fit.clone();
        pass.base.refresh(self.setup, &mut fit, &weighing)?;
        pass.fit = fit;
        let is_quiet = pass.fit.misfit <= adequate(pass.expected);
        // Where the misfit is that of noise but something is far off, what is missing shows once that is held back.
        if is_quiet {
            let problem = pass.base.problem(self.setup)?;
            pass.seen = schedule::held_back(&problem, &pass.fit, &weighing);
        }
        let is_bent = pass.seen.is_some();
        let mut seen = pass.seen.take().unwrap_or_else(|| pass.fit.clone());
        pass.base.refresh(self.setup, &mut seen, &weighing)?;
        let is_quiet = is_quiet && !is_bent;
        let Some(projection) = Projection::new(&seen) else {
            return Err(Fault::run(
                "the derivatives of the fitted base model cannot be computed over whole shots: its motion depends too much on where it begins, or its \
                 equations fail nearby; cut the records into windows (`windows = 4` in `[shots]`, with `[initial]` for the states), or leave out the shots \
                 that `hyd fit` follows worst",
            ));
        };
        let mut hypotheses = Vec::new();
        for candidate in &self.candidates {
            let is_taken = pass.base.inserts.iter().any(|own| own.excludes(candidate) || own.is_same(candidate));
            if is_taken || refused.iter().any(|own| own.is_same(candidate)) {
                continue;
            }
            let mut inserts = pass.base.inserts.clone();
            inserts.push(candidate.clone());
            hypotheses.push((candidate, Hypothesis::new(self.setup, self.workshop, inserts)?));
        }
        let task = |k: usize| self.task("look", &hypotheses[k].1, &[]).with(&seen);
        let make = |k: usize| hypotheses[k].1.look(self.setup, &seen, &projection, (&weighing, is_quiet));
        let looks = self.each(hypotheses.len(), task, make)?;
        let mut signatures = Vec::new();
        for ((candidate, hypothesis), mut look) in hypotheses.into_iter().zip(looks) {
            if let Some((typical, score, signature)) = look.as_mut().and_then(|look| look.typical.take()) {
                let (id, effect) = (candidate.effect.id.clone(), candidate.label());
                let power = Power { id, effect, typical, cost_drop: score.power, left: score.left };
                signatures.push((power, signature));
            }
            pass.tried.push(Tried::new(hypothesis, look));
        }
        pass.confusions = confusions(&signatures, &projection);
        drop(projection);
        // Beside an effect that is named already a small one may still be hidden.
        let is_quiet = is_quiet && pass.fit.misfit <= noise(pass.expected) && pass.base.inserts.is_empty();
        self.probe(pass, &seen, is_quiet)?;
        pass.seen = is_bent.then_some(seen);
        pass.powers = signatures.into_iter().map(|(power, _)| power).collect();
        pass.powers.sort_by(|a, b| b.cost_drop.total_cmp(&a.cost_drop));
        let gain = |tried: &Tried| tried.look.as_ref().map_or(0.0, Look::promise);
        pass.tried.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
        Ok(())
    }
}

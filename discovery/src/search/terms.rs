//! Terms at equations: all compared with what is left, the best fitted like effects.
//!
//! A term that explains what no effect explains says where something is missing and what it looks like, never what it is.

use super::context::{Search, patience};
use super::pass::{Pass, Tried, by_cost};
use super::shortlist::Lowest;
use crate::catalogue::door::Door;
use crate::evidence::hypothesis::{Hypothesis, Look};
use crate::evidence::location::{Located, locate};
use crate::evidence::projection::Projection;
use crate::evidence::thresholds::{NEEDED, adequate};
use crate::fault::Fault;
use crate::fit::minimise;

/// Terms fitted: where the effects leave nothing but noise, and where they do not.
const FITTED: (usize, usize) = (1, 3);
/// Share of what the best effect explains that a term must explain if the fit without is to be made again from there.
const WORTH_IT: f64 = 0.01;
/// Spread of a coefficient before the measurement, by what its screening claims.
const SPREAD: f64 = 5.0;

impl Search<'_> {
    /// Holds all terms against what is left.
    pub(super) fn look_at_equations(&self, pass: &mut Pass) -> Result<(), Fault> {
        (self.progress)("screening the equations");
        // Where something is far off, what is missing shows with that held back.
        let fit = pass.seen.as_ref().unwrap_or(&pass.fit);
        let Some(projection) = Projection::new(fit) else { return Ok(()) };
        let sites = self.candidates.iter().flat_map(|candidate| &candidate.sites);
        let declared = sites.filter(|site| site.door == Door::Component);
        let places: Vec<&str> = declared.map(|site| site.path.as_str()).collect();
        pass.located = locate(
            (self.setup, self.workshop, self.tasks),
            &pass.base,
            (&places, None),
            (fit, &projection),
            &self.whole(),
        )?;
        Ok(())
    }

    /// Fits the best term of each of the likeliest equations.
    pub(super) fn fit_terms(&self, pass: &mut Pass) -> Result<(), Fault> {
        let fits = pass.tried.iter().filter_map(|tried| tried.fit.as_ref()).chain([&pass.fit]);
        let lowest = Lowest::of(fits, pass.expected);
        if lowest.is_noise() && pass.fit.cost - lowest.cost < self.needed {
            // There is nothing to be named.
            return Ok(());
        }
        let count = if lowest.misfit * pass.expected > adequate(pass.expected) { FITTED.1 } else { FITTED.0 };
        let chosen = likeliest(&pass.located, count);
        let base = pass.seen.as_ref().unwrap_or(&pass.fit).clone();
        let mut looks = Vec::new();
        for Located { term, score } in chosen {
            let spread = SPREAD * score.amplitude.abs();
            let made =
                Hypothesis::with_terms(self.setup, self.workshop, pass.base.inserts.clone(), vec![(term, spread)]);
            let Ok(hypothesis) = made else { continue };
            let problem = hypothesis.problem(self.setup)?;
            let start = hypothesis.at_size(&problem, &base.xi, score.amplitude);
            drop(problem);
            let start = start[base.xi.len()..].to_vec();
            let look = Look { score, size: score.amplitude, start, alone: score.alone, typical: None, probed: None };
            looks.push((hypothesis, look));
        }
        let numbers = [lowest.misfit, lowest.cost];
        let task = |k: usize| self.task("term", &looks[k].0, &[&looks[k].1.start, &numbers]).with(&base);
        let make = |k: usize| {
            let (hypothesis, look) = &looks[k];
            (self.progress)(&format!("fitting {}", hypothesis.own_label()));
            let others = [0.5 * look.size, 1.5 * look.size];
            self.fit_from_sizes(hypothesis, &base, look, &others, lowest)
        };
        let fits = self.each(looks.len(), task, make)?;
        for ((hypothesis, look), fit) in looks.into_iter().zip(fits) {
            pass.terms.push(Tried { fit, ..Tried::new(hypothesis, Some(look)) });
        }
        self.without_terms(pass)
    }

    /// Fits the model without a term again from where the best term has ended: the way there may have led into a lower local minimum that
    /// needs no term.
    fn without_terms(&self, pass: &mut Pass) -> Result<(), Fault> {
        let Some(&best) = by_cost(&pass.terms).first() else { return Ok(()) };
        let fits = pass.tried.iter().filter_map(|tried| tried.fit.as_ref());
        let most = pass.fit.cost - Lowest::of(fits, pass.expected).cost;
        let enough = self.needed.max(WORTH_IT * most);
        let Some(start) = pass.terms[best].fit.as_ref().filter(|fit| fit.cost < pass.fit.cost - enough) else {
            return Ok(());
        };
        (self.progress)("fitting again without a term");
        let make = || {
            let problem = pass.base.problem(self.setup)?;
            let xi = &start.xi[..problem.unknowns.len()];
            Ok(minimise(&problem, xi, &self.whole(), patience(&problem), None).ok())
        };
        let Some(again) = self.one(|| self.task("without a term", &pass.base, &[&start.xi]), make)? else {
            return Ok(());
        };
        pass.record.note("from where a term ended", &again, pass.expected);
        pass.fit = self.preferred(&pass.base, pass.fit.clone(), again, pass.expected);
        Ok(())
    }
}

/// The best term of each of the best equations.
fn likeliest(located: &[Located], count: usize) -> Vec<Located> {
    let mut chosen: Vec<Located> = Vec::new();
    for own in located.iter().filter(|own| own.score.gain > NEEDED) {
        let place = |other: &Located| (other.term.component.clone(), other.term.line);
        if chosen.len() < count && !chosen.iter().any(|other| place(other) == place(own)) {
            chosen.push(own.clone());
        }
    }
    chosen
}

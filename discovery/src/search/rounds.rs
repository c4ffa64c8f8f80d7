//! Rounds of a search: what the best model leaves decides what counts as noise in the next one.
//!
//! The first round takes noise as it is stated, unless the fit of the base model leaves more, and nothing but, white noise: then there is nothing to be told from
//! it under a wrong measure, and it is taken as it is found; as are hum and drift, if they explain far more of what that fit leaves than any effect promises
//! to.  Where even the best model leaves more, what it leaves is looked at
//! ([`crate::leftover`]): bad samples, hum, drift, parameters that scatter, and model error with a size and a correlation.  The
//! search then begins again with these taken up, until they no longer change; waves that were named are taken up where they were
//! ([`super::ends`]).  Effects that were named late, or that have a size of their
//! own in every shot, and laws that the records chose, may only have imitated parameters that scatter; where scatter explains as much as they do, it is taken up in
//! their place; where the sizes of the shots have an order, it has to explain more than they do.

use super::context::Search;
use super::ends::Ends;
use super::pass::{Findings, Pass, Status};
use super::rule;
use crate::catalogue::Candidate;
use crate::disturbance::Disturbances;
use crate::evidence::hypothesis::{Hypothesis, Look};
use crate::evidence::proof::Gap;
use crate::evidence::thresholds::{LEAD, adequate, noise};
use crate::fault::Fault;
use crate::fit::{Effort, Fit, minimise};
use crate::leftover::{Kinds, Leftover, leftover};
use crate::setup::Setup;
use crate::unknowns::EffectPart;

/// Most rounds.
const MOST: usize = 5;
/// Most times that hum and drift are looked for before the first round.
const TURNS: usize = 3;
/// A best model that leaves more, in standard deviations, may have its waves in the wrong place.
const NEAR: f64 = 2.0;
/// So many times the mean square that the round before left is not explained by names that only imitated a disturbance.
const FAR_MORE: f64 = 4.0;
/// Levels that change by less than this factor are the same.
const SAME: f64 = 1.25;
/// The same of levels of model error: over how many samples residuals are alike is known to a half from the hundred independent ones of a
/// record (Sokal, Monte Carlo Methods in Statistical Mechanics, 1997, section 3), and a level to half of that.
const SAME_ERROR: f64 = 1.5;

/// What a round has found.
struct Earlier {
    findings: Findings,
    /// Its setup, if it is another one than that of the search.
    setup: Option<Setup>,
    /// Mean square of what its best model leaves, in that of the noise as stated.
    left: f64,
}

impl Search<'_> {
    /// Searches round after round; with the setup of the last one if it is another one than that of the search.
    ///
    /// # Errors
    /// As [`Search::run`].
    pub fn settled(&self) -> Result<(Findings, Option<Setup>), Fault> {
        let begun = self.setup.watch.runs();
        let mut base = self.begin(Vec::new(), None)?;
        let mut setup = self.louder(&mut base)?;
        let mut first_pass = Some(base);
        if setup.is_none() {
            setup = self.humming(&mut first_pass)?;
        }
        let first = Search { setup: setup.as_ref().unwrap_or(self.setup), ..self.again() };
        let (mut findings, other) = first.round(first_pass)?;
        setup = other.or(setup);
        let why = findings.no_law.clone();
        let (mut unexplained, mut earlier): (Option<Earlier>, Option<Earlier>) = (None, None);
        for round in 1..=MOST {
            let current = Search { setup: setup.as_ref().unwrap_or(self.setup), ..self.again() };
            let Some(next) = current.refined(&findings)? else { break };
            let left = (findings.named(), mean_square(&next));
            let is_astray = |earlier: &mut Earlier| is_astray((earlier.findings.named(), earlier.left), left);
            if let Some(earlier) = earlier.take_if(is_astray) {
                (self.progress)("this round has gone astray: the answer is that of the one before");
                let named = findings.passes.last().filter(|_| left.0 > 0).map(|last| last.base.label());
                (findings, setup) = (earlier.findings, earlier.setup);
                findings.given_up = Some(named.unwrap_or_else(|| "nothing".to_string()));
                break;
            }
            if round == MOST {
                findings.is_settled = false;
                break;
            }
            (self.progress)("once more, with what the best model leaves counted by its size and correlation");
            let is_near = next.levels.iter().all(|level| level.size < NEAR);
            let ends = if is_near { Ends::of(&findings, current.setup)? } else { Ends::default() };
            let next = current.setup.disturbed(next)?;
            let (again, other) = Search { setup: &next, ends, ..self.again() }.round(None)?;
            let mut before = Earlier {
                findings: std::mem::replace(&mut findings, again),
                setup: setup.replace(other.unwrap_or(next)),
                left: left.1,
            };
            findings.keep_refuted(&before.findings.refuted);
            before.findings.passes.iter_mut().for_each(Pass::forget_derivatives);
            let is_as_stated = before.setup.as_ref().unwrap_or(self.setup).disturbances.levels.is_empty();
            if is_as_stated && unexplained.is_none() && leaves_noise(&before.findings) {
                unexplained = Some(before);
            } else {
                earlier = Some(before);
            }
        }
        // Where a fit left nothing but noise as stated, a name that only comes with disturbances is not better founded than none.
        let is_named = matches!(findings.status, Status::Named | Status::Sensor | Status::Law);
        let is_new = |before: &Earlier| !before.findings.has_found(&findings);
        if let Some(before) = unexplained.filter(|before| is_named && is_new(before)) {
            (findings, setup) = (before.findings, before.setup);
        }
        if findings.status == Status::Unknown {
            findings.no_law = both(why, findings.no_law);
        }
        let last = Search { setup: setup.as_ref().unwrap_or(self.setup), ..self.again() };
        findings.exact = last.exact(&mut findings)?;
        findings.runs = self.setup.watch.runs() - begun;
        Ok((findings, setup))
    }

    pub(super) fn again(&self) -> Search<'_> {
        Search { candidates: self.candidates.clone(), ends: self.ends.clone(), ..*self }
    }

    /// The setup with noise as the fit of the base model leaves it, if that is more than stated and nothing but white noise; the fit is made again in it.
    fn louder(&self, base: &mut Pass) -> Result<Option<Setup>, Fault> {
        if base.fit.misfit <= adequate(base.expected) || !self.setup.disturbances.levels.is_empty() {
            return Ok(None);
        }
        let known = &self.setup.disturbances;
        // The screening needs the derivatives, too.
        base.base.refresh(self.setup, &mut base.fit, &self.whole())?;
        let left = self.left(&base.base, &base.fit)?.disturbances;
        if left.fitted() > known.fitted() || !left.is_noise() {
            return Ok(None);
        }
        // Bad samples are left out only once everything that may be missing was tried: steep flanks that a model misses look like them.
        let next = Disturbances { spikes: known.spikes.clone(), ..left };
        if !is_new(known, &next) {
            return Ok(None);
        }
        (self.progress)("noise is more than stated, and is counted as it is");
        let setup = self.setup.disturbed(next)?;
        let problem = base.base.problem(&setup)?;
        let whole = self.whole();
        base.expected = problem.expected(&whole);
        base.fit = minimise(&problem, &base.fit.xi, &whole, Effort::LONG, None)?;
        base.record.note("from there, with noise as it is", &base.fit, base.expected);
        drop(problem);
        Ok(Some(setup))
    }

    /// The setup with hum and drift as the fit of the base model leaves them, if they explain far more of that than any effect promises to:
    /// effects are searched beside them at once.  The pass is then over, or begun again under that setup.
    fn humming(&self, begun: &mut Option<Pass>) -> Result<Option<Setup>, Fault> {
        let mut setup: Option<Setup> = None;
        for _ in 0..TURNS {
            let current = Search { setup: setup.as_ref().unwrap_or(self.setup), ..self.again() };
            let Some(base) = begun.as_mut() else { break };
            if !current.is_of_chains(base, &[])? {
                break;
            }
            (self.progress)("what measuring chains add explains far more than effects, and is counted");
            let found = current.of_chains(base, Kinds::AddedOfOneKind)?.disturbances;
            let added = Disturbances { added: found.added, ..current.setup.disturbances.clone() };
            let next = current.setup.disturbed(added)?;
            let again = Search { setup: &next, ..self.again() }.begin(Vec::new(), None)?;
            (*begun, setup) = (Some(again), Some(next));
        }
        Ok(setup)
    }

    /// True if hum and drift explain far more of what the fit of a pass leaves than any effect promises to: nothing is to be told of effects
    /// before they are counted.  The effects are screened for that.  Hum speaks for itself alone, and so does drift, which something slow that
    /// the model lacks looks like.
    pub(super) fn is_of_chains(&self, pass: &mut Pass, refused: &[Candidate]) -> Result<bool, Fault> {
        if pass.fit.misfit <= adequate(pass.expected) || !self.setup.disturbances.levels.is_empty() {
            return Ok(false);
        }
        let explained = self.explained_by_chains(pass, Kinds::AddedOfOneKind)?;
        let excess = pass.fit.misfit - pass.expected;
        if !rule::is_of_chains(explained, excess, 0.0) {
            return Ok(false);
        }
        self.screen_effects(pass, refused)?;
        let promise = pass.tried.first().and_then(|own| own.look.as_ref()).map_or(0.0, Look::promise);
        Ok(rule::is_of_chains(explained, excess, promise))
    }

    /// Drop of the misfit by hum and drift that are not known yet.
    fn explained_by_chains(&self, pass: &mut Pass, kinds: Kinds) -> Result<f64, Fault> {
        let found = self.of_chains(pass, kinds)?;
        let is_more = found.disturbances.fitted() > self.setup.disturbances.fitted();
        Ok(if is_more { pass.fit.misfit - found.misfit * pass.expected } else { 0.0 })
    }

    /// What the fit of a pass leaves, by hum and drift alone.
    fn of_chains(&self, pass: &mut Pass, kinds: Kinds) -> Result<Leftover, Fault> {
        let whole = self.whole();
        pass.base.refresh(self.setup, &mut pass.fit, &whole)?;
        leftover(self.setup, &pass.base.problem(self.setup)?, &pass.fit, (&whole, kinds))
    }

    /// One search, whose first pass may have begun; where the shots held out show a gap that the others hide, another one with others held out.
    fn round(&self, begun: Option<Pass>) -> Result<(Findings, Option<Setup>), Fault> {
        let findings = self.with_law_if_needed(self.run_from(begun)?)?;
        let other = if findings.hidden { self.setup.exchanged()? } else { None };
        let Some(other) = other else { return Ok((findings, None)) };
        (self.progress)("the shots held out show a gap that the others hide: holding out others");
        let other_search = Search { setup: &other, ..self.again() };
        let mut again = other_search.with_law_if_needed(other_search.run()?)?;
        again.keep_refuted(&findings.refuted);
        Ok((again, Some(other)))
    }

    /// Findings with a law where one is missing; none is looked for where disturbances that are taken up next explain what is left, or where that is
    /// white noise, more than stated: the next round has the better measure for it.
    fn with_law_if_needed(&self, mut findings: Findings) -> Result<Findings, Fault> {
        if !Self::may_have_law(&findings) || self.scatter_instead(&findings)?.is_some() {
            return Ok(findings);
        }
        let Some(last) = findings.passes.last_mut() else { return Ok(findings) };
        let found = self.left(&last.base, &last.fit)?;
        let known = &self.setup.disturbances;
        let is_more = found.disturbances.fitted() > known.fitted();
        let is_all = found.misfit * last.expected <= noise(last.expected)
            || known.levels.is_empty()
                && rule::is_of_chains(
                    self.explained_by_chains(last, Kinds::Added)?,
                    last.fit.misfit - last.expected,
                    0.0,
                );
        let is_white = found.disturbances.is_noise() && is_new(known, &found.disturbances);
        let is_for_the_next = if is_more { is_all } else { is_white };
        if is_for_the_next { Ok(findings) } else { self.with_law(findings) }
    }

    /// What disturbs the bench by what the best model leaves; none where that is known already.
    fn refined(&self, findings: &Findings) -> Result<Option<Disturbances>, Fault> {
        let (Some(first), Some(last)) = (findings.passes.first(), findings.passes.last()) else { return Ok(None) };
        if let Some(instead) = self.scatter_instead(findings)? {
            return Ok(Some(instead));
        }
        let (hypothesis, fit) = findings
            .passes
            .iter()
            .flat_map(fits)
            .fold((&last.base, &last.fit), |best, own| if own.1.cost < best.1.cost { own } else { best });
        let is_left = fit.misfit > adequate(first.expected);
        let is_known = !self.setup.disturbances.levels.is_empty();
        // Without any tolerance of time more than noise may be left although the fit leaves none.
        let is_answered = !matches!(findings.status, Status::Unconverged | Status::Unknown);
        if !is_left && !is_known && is_answered {
            return Ok(None);
        }
        let mut found = self.left(hypothesis, fit)?;
        // An effect that gets no name may have imitated what disturbs the fit without it.
        if !is_answered && fit.cost < last.fit.cost {
            let own = self.left(&last.base, &last.fit)?;
            let is_more = own.disturbances.fitted() > found.disturbances.fitted();
            if is_more && self.fit_with((&last.base, &last.fit), &own.disturbances)?.cost < fit.cost + LEAD {
                found = own;
            }
        }
        Ok(is_new(&self.setup.disturbances, &found.disturbances).then_some(found.disturbances))
    }

    /// Scatter from shot to shot that explains what effects named after the first one do, or one whose size is another in every shot.
    fn scatter_instead(&self, findings: &Findings) -> Result<Option<Disturbances>, Fault> {
        let Some(last) = findings.passes.last() else { return Ok(None) };
        // One with a size of its own in every shot is scatter itself, unless it is larger than tolerances allow; and a law is a form that the
        // records chose.
        let may_imitate = |pass: &&Pass| {
            let known = pass.base.inserts.len();
            last.base.inserts.get(known).is_some_and(|next| known > 0 || next.effect.per_shot || findings.law.is_some())
        };
        for pass in findings.passes.iter().filter(may_imitate) {
            let number = pass.base.inserts.len();
            let is_ordered = self.has_order(last, number)?;
            let own = &last.base.inserts[number..];
            let kinds = |effects: &[Candidate]| {
                let are_sizes = effects.iter().all(|own| own.effect.per_shot);
                if are_sizes { Kinds::InPlaceOfSizes } else { Kinds::All }
            };
            let asked = |effects: &[Candidate]| (kinds(effects), is_ordered);
            if let Some(found) = self.scatter_for((&pass.base, &pass.fit), last, own, asked(own))? {
                return Ok(Some(found));
            }
            // What was found after it, or that which it took a part of, stays in the model.
            if own.len() > 1
                && own[0].effect.per_shot
                && let Some((rest, fit)) = self.taken_out(&last.base.inserts, &last.fit, number)?
                && let Some(found) = self.scatter_for((&rest, &fit), last, &own[..1], asked(&own[..1]))?
            {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Scatter that explains in a model without `own` effects as much as these do, or more where their sizes have an order; none where it does not.
    fn scatter_for(
        &self,
        without: (&Hypothesis, &Fit),
        last: &Pass,
        own: &[Candidate],
        (kinds, is_ordered): (Kinds, bool),
    ) -> Result<Option<Disturbances>, Fault> {
        let found = self.left_of(without, kinds)?;
        let known = &self.setup.disturbances;
        let more = found.disturbances.fitted().saturating_sub(known.fitted());
        if more == 0 {
            return Ok(None);
        }
        let of_effects: usize = own.iter().map(|own| own.effect.parameters.len()).sum();
        let numbers = (more * self.setup.train.len(), of_effects);
        let stated = known.levels.is_empty().then_some(noise(last.expected));
        let enough = match is_ordered {
            true => rule::enough_against_order(last.fit.misfit, numbers),
            false => rule::enough_for_scatter(last.fit.misfit, stated, numbers),
        };
        let is_enough =
            found.misfit * last.expected < enough || self.fit_with(without, &found.disturbances)?.misfit < enough;
        Ok(is_enough.then_some(found.disturbances))
    }

    /// True if an effect has a size of its own in every shot, and these have an order ([`rule::has_order`]), those held out included; errors are
    /// those beside what all shots share.
    fn has_order(&self, last: &Pass, effect: usize) -> Result<bool, Fault> {
        let setup = self.setup;
        if !last.base.inserts.get(effect).is_some_and(|own| own.effect.per_shot) || setup.held_out.is_empty() {
            return Ok(false);
        }
        let problem = last.base.problem(setup)?;
        let unseen = Gap::of(&problem, &last.fit.xi, &setup.held_out, true)?;
        let size = EffectPart { effect, parameter: 0 };
        let mut sizes: Vec<(usize, (f64, f64))> = Vec::new();
        for (k, unknown) in problem.unknowns.iter().enumerate().filter(|(_, own)| own.effect == Some(size)) {
            let Some(shot) = unknown.shot else { continue };
            let fit = if setup.train.contains(&shot) { &last.fit } else { &unseen.fit };
            let Some(error) = fit.error_alone(k) else { continue };
            sizes.push((shot, (unknown.value(fit.xi[k]), error * unknown.slope(fit.xi[k]).abs())));
        }
        sizes.sort_unstable_by_key(|own| own.0);
        let sizes: Vec<(f64, f64)> = sizes.into_iter().map(|(_, size)| size).collect();
        Ok(rule::has_order(&sizes))
    }

    /// The fit of a model once disturbances are fitted, too, whose courses are not linear; samples are weighed as before.
    fn fit_with(&self, (hypothesis, fit): (&Hypothesis, &Fit), found: &Disturbances) -> Result<Fit, Fault> {
        let levels = self.setup.disturbances.levels.clone();
        let setup = self.setup.disturbed(Disturbances { levels, ..found.clone() })?;
        let (before, problem) = (hypothesis.problem(self.setup)?, hypothesis.problem(&setup)?);
        let known = |name: &str| before.unknowns.iter().position(|own| own.name == name);
        let start = problem.unknowns.iter().map(|own| known(&own.name).map_or(0.0, |k| fit.xi[k]));
        let start: Vec<f64> = start.collect();
        let task = || Search { setup: &setup, ..self.again() }.task("with disturbances", hypothesis, &[&start]);
        self.one(task, || minimise(&problem, &start, &self.whole(), Effort::LONG, None))
    }

    fn left(&self, hypothesis: &Hypothesis, fit: &Fit) -> Result<Leftover, Fault> {
        self.left_of((hypothesis, fit), Kinds::All)
    }

    fn left_of(&self, (hypothesis, fit): (&Hypothesis, &Fit), kinds: Kinds) -> Result<Leftover, Fault> {
        let whole = self.whole();
        let mut fit = fit.clone();
        hypothesis.refresh(self.setup, &mut fit, &whole)?;
        leftover(self.setup, &hypothesis.problem(self.setup)?, &fit, (&whole, kinds))
    }
}

/// Why there is no law, by the first round and by the last: what was found before model error counted stays said.
fn both(first: Option<String>, last: Option<String>) -> Option<String> {
    match (first, last) {
        (Some(first), Some(last)) if first != last => Some(format!("{first}; and {last}")),
        (first, last) => last.or(first),
    }
}

/// True for an answer of something unknown although the last fit leaves no more than noise, with the tolerance of time.
fn leaves_noise(findings: &Findings) -> bool {
    let last = findings.passes.last();
    findings.status == Status::Unknown && last.is_some_and(|last| last.fit.misfit <= adequate(last.expected))
}

/// Mean square of what the best model leaves, over the channels, in that of the noise as stated.
fn mean_square(left: &Disturbances) -> f64 {
    let count = left.levels.len();
    if count == 0 { 1.0 } else { left.levels.iter().map(|level| level.size * level.size).sum::<f64>() / count as f64 }
}

/// True if a round that names so many effects leaves more, although the one before named some and no more, or if it leaves far more: its
/// fits have ended in another local minimum.
fn is_astray((before, was_left): (usize, f64), (named, left): (usize, f64)) -> bool {
    let most = if named >= before { SAME * SAME } else { FAR_MORE };
    before > 0 && left > most * was_left
}

/// All fits of a pass; that of its base alone where shots held out refuted an effect: others would imitate the same, and what they leave is no
/// measure of the best that a model can do.
fn fits(pass: &Pass) -> Vec<(&Hypothesis, &Fit)> {
    let is_refuted = pass.tried.iter().any(|own| own.is_refuted);
    let tried = pass.tried.iter().chain(&pass.terms).filter(|_| !is_refuted);
    let tried = tried.filter_map(|own| Some((&own.hypothesis, own.fit.as_ref()?)));
    tried.chain([(&pass.base, &pass.fit)]).collect()
}

/// True if there is more to be taken up, or levels have changed.
fn is_new(known: &Disturbances, found: &Disturbances) -> bool {
    let more = |a: usize, b: usize| b > a;
    let channels = known.levels.len().max(found.levels.len());
    let changed = (0..channels).any(|k| {
        let (found, known) = (found.level(k), known.level(k));
        let same = if found.is_white() || known.is_white() { SAME } else { SAME_ERROR };
        !(1.0 / same..=same).contains(&(found.factor / known.factor))
    });
    changed || more(known.spikes.len(), found.spikes.len()) || more(known.fitted(), found.fitted())
}

#[cfg(test)]
mod tests {
    use super::{both, is_astray, is_new, mean_square};
    use crate::disturbance::{Disturbances, Level, Spike};

    #[test]
    fn more_effects_that_leave_more_have_gone_astray() {
        assert!(is_astray((2, 3.0), (3, 60.0)) && is_astray((1, 1.0), (1, 2.0)));
        // Effects that only imitated a disturbance go, and a little more may be left then.
        assert!(!is_astray((2, 1.0), (0, 3.9)) && !is_astray((2, 1.0), (1, 3.9)) && !is_astray((0, 1.0), (1, 9.0)));
        assert!(is_astray((2, 3.0), (0, 75.0)) && !is_astray((1, 2.0), (1, 2.5)));
        let levels = vec![Level::new(3.0, 9.0, 1.0), Level::NOISE];
        assert_eq!(mean_square(&Disturbances { levels, ..Default::default() }), 5.0);
    }

    #[test]
    fn what_the_first_round_says_of_laws_stays_said() {
        let some = |text: &str| Some(text.to_string());
        assert_eq!(both(some("two come close"), some("model error")), some("two come close; and model error"));
        assert_eq!(both(some("model error"), some("model error")), some("model error"));
        assert_eq!((both(some("two come close"), None), both(None, None)), (some("two come close"), None));
    }

    #[test]
    fn a_round_follows_only_what_changes() {
        let of =
            |size: f64| Disturbances { levels: vec![Level::NOISE, Level::new(size, 9.0, 1.0)], ..Default::default() };
        let none = Disturbances::default();
        assert!(!is_new(&none, &none) && is_new(&none, &of(2.0)) && is_new(&of(2.0), &none));
        assert!(!is_new(&of(2.0), &of(2.9)) && is_new(&of(2.0), &of(1.3)) && is_new(&of(2.0), &of(3.1)));
        // Of white noise the size is known well.
        let white =
            |size: f64| Disturbances { levels: vec![Level::NOISE, Level::new(size, 1.5, 1.0)], ..Default::default() };
        assert!(!is_new(&white(2.0), &white(2.4)) && is_new(&white(2.0), &white(2.6)));
        let spike = Spike { shot: 0, channel: 0, sample: 3 };
        let spiky = Disturbances { spikes: vec![spike], ..of(2.0) };
        assert!(is_new(&of(2.0), &spiky) && !is_new(&spiky, &of(2.0)));
    }
}

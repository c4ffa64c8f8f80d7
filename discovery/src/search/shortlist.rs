//! Fits of the likely candidates, with equal effort.
//!
//! All begin with short fits from three sizes under wide weights.  They are followed to their ends in the order of what
//! these left, so that what explains the measurement is known early: one that falls behind it beyond hope is not
//! followed, and another one only as long as it catches up.  Candidates with several numbers are then fitted from afar,
//! if nothing comes near the measurement and nuisances are bent; those whose runs are long come last, but for one that
//! promises most of all.

use super::context::{Search, patience};
use super::pass::{Pass, Tried, by_cost};
use super::rule;
use crate::evidence::hypothesis::{Hypothesis, Look};
use crate::evidence::thresholds::{NEEDED, PROMISING, adequate, noise};
use crate::fault::Fault;
use crate::fit::schedule::{self, lower};
use crate::fit::{Effort, Fit, minimise};
use crate::problem::Problem;
use crate::tasks::waves;
use hyd_system::random::SplitMix;

/// Candidates fitted, at a misfit close to the expected one and far above it.
const SHORTLIST: (usize, usize) = (5, 8);
/// Candidates fitted at places that were found in the equations: laws that were not made for the machine are many, and far from the
/// measurement what a look at each promises ranks them badly.
const SHORTLIST_FOUND: usize = 24;
/// Of candidates that leave more than noise so many are followed on, if they explain at least this share of what the best does.
const CONTENDERS: (usize, f64) = (3, 0.5);
/// Steps that each of those whose runs are long is followed at first.
const TURN: usize = 6;
/// Random starts of the leader.
const SCATTERED: usize = 3;
/// A short fit whose misfit is so many times that of the best one is not followed to its end: while nothing leaves only noise, and
/// after.
const HOPELESS: (f64, f64) = (10.0, 3.0);
/// Candidates that are fitted for the place that they fit.
const MOST_PLACED: usize = 3;
/// Candidates that are fitted from afar.
const MOST_AFAR: usize = 2;
/// Misfit per expected misfit above which nuisances of the fit without are no place to start from.
const FAR: f64 = 3.0;

/// A look that promises less is not followed where model error counts.
const HIDDEN: f64 = 1.0;
/// Share of the excess of the base model that a fit may leave if it is to be followed further.
const MOST: f64 = 0.5;

/// The lowest fit so far: misfit per expected one, and cost.
#[derive(Clone, Copy)]
pub(super) struct Lowest {
    pub(super) misfit: f64,
    pub(super) cost: f64,
    /// Expected misfit.
    pub(super) expected: f64,
}

impl Lowest {
    pub(super) fn of<'a>(fits: impl IntoIterator<Item = &'a Fit>, expected: f64) -> Self {
        let mut lowest = Self { misfit: f64::INFINITY, cost: f64::INFINITY, expected };
        fits.into_iter().for_each(|fit| lowest.take(fit));
        lowest
    }

    fn take(&mut self, fit: &Fit) {
        self.misfit = self.misfit.min(fit.misfit / self.expected);
        self.cost = self.cost.min(fit.cost);
    }

    /// Nothing but noise is left.
    pub(super) fn is_noise(&self) -> bool {
        self.misfit * self.expected <= noise(self.expected)
    }
}

impl Search<'_> {
    /// The drop of the cost that a candidate must promise to be fitted.
    pub(super) fn promising(&self, pass: &Pass) -> f64 {
        match pass.fit.misfit > adequate(pass.expected) {
            // What counts as model error may be an effect that hides in it: a better model lowers the level.
            _ if !self.setup.disturbances.is_noise() => HIDDEN,
            true => PROMISING.0,
            false => PROMISING.1,
        }
    }

    /// Fits the likely candidates.
    pub(super) fn shortlist(&self, pass: &mut Pass) -> Result<(), Fault> {
        let ratio = pass.fit.misfit / pass.expected;
        let count = if ratio > 2.0 || pass.seen.is_some() { SHORTLIST.1 } else { SHORTLIST.0 };
        let promising = self.promising(pass);
        let gain = |tried: &Tried| tried.look.as_ref().map_or(0.0, Look::promise);
        let is_found = |tried: &Tried| tried.hypothesis.inserts.last().is_some_and(|own| own.is_found());
        let most = |tried: &Tried| if is_found(tried) && ratio > FAR { SHORTLIST_FOUND } else { count };
        let is_likely = |&rank: &usize| rank < most(&pass.tried[rank]) && gain(&pass.tried[rank]) >= promising;
        let chosen = (0..pass.tried.len()).filter(is_likely);
        let mut chosen: Vec<usize> = chosen.collect();
        chosen.extend(at_located_places(pass, &chosen));
        let mut lowest = Lowest::of([&pass.fit], pass.expected);
        for rank in std::mem::take(&mut chosen) {
            let tried = &mut pass.tried[rank];
            if let Some(fit) = self.recalled(role(pass.is_again), &tried.hypothesis)? {
                lowest.take(&fit);
                tried.fit = Some(fit);
                continue;
            }
            if let Some(fit) = &tried.fit {
                lowest.take(fit);
                continue;
            }
            if let Some(fit) = self.resumed(&tried.hypothesis)? {
                self.keep(role(pass.is_again), &tried.hypothesis, &fit);
                lowest.take(&fit);
                tried.fit = Some(fit);
                continue;
            }
            chosen.push(rank);
        }
        let mut begun = self.begun_near(pass, &chosen)?;
        // Where one whose runs are long promises most, what it explains spares others the effort.
        let is_slow = |rank: &&usize| !pass.tried[**rank].hypothesis.machine.is_fast();
        let first: Vec<usize> = chosen.first().filter(is_slow).copied().into_iter().collect();
        self.shortlist_from_afar(pass, &first, &mut lowest)?;
        begun.sort_by(|a, b| a.1.misfit.total_cmp(&b.1.misfit));
        for wave in waves(begun.len()) {
            let wave = &begun[wave];
            let hypothesis = |k: usize| &pass.tried[wave[k].0].hypothesis;
            let numbers = [lowest.misfit, lowest.cost];
            let task = |k: usize| self.task("finish", hypothesis(k), &[&numbers]).with(&wave[k].1.fit);
            let make = |k: usize| {
                let fit = self.finish_near(hypothesis(k), &wave[k].1, lowest)?;
                fit.iter().for_each(|fit| self.keep(role(pass.is_again), hypothesis(k), fit));
                Ok(fit)
            };
            let fits = self.each(wave.len(), task, make)?;
            for (&(rank, _), fit) in wave.iter().zip(fits) {
                let tried = &mut pass.tried[rank];
                fit.iter().for_each(|fit| lowest.take(fit));
                tried.fit = fit;
            }
        }
        drop(begun);
        self.go_on(pass, &mut lowest)?;
        self.shortlist_from_afar(pass, &chosen[first.len()..], &mut lowest)?;
        // Once more, for those that were fitted further.
        for tried in chosen.iter().map(|&rank| &pass.tried[rank]) {
            if let Some(fit) = &tried.fit {
                self.keep(role(pass.is_again), &tried.hypothesis, fit);
            }
        }
        Ok(())
    }

    /// Short fits of those of the chosen candidates whose runs are not long.
    fn begun_near(&self, pass: &Pass, chosen: &[usize]) -> Result<Vec<(usize, Begun)>, Fault> {
        let base = pass.seen.as_ref().unwrap_or(&pass.fit);
        let is_near = |rank: &&usize| {
            let Tried { hypothesis, look, .. } = &pass.tried[**rank];
            look.is_some() && hypothesis.machine.is_fast()
        };
        let near: Vec<usize> = chosen.iter().filter(is_near).copied().collect();
        let task = |k: usize| {
            let Tried { hypothesis, look, .. } = &pass.tried[near[k]];
            let start = look.as_ref().map_or(&[][..], |look| &look.start);
            let probed = look.as_ref().and_then(|look| look.probed.as_ref()).map_or(&[][..], |own| &own.1);
            self.task("begin", hypothesis, &[start, probed]).with(base)
        };
        let make = |k: usize| {
            let Tried { hypothesis, look: Some(look), .. } = &pass.tried[near[k]] else { return Ok(None) };
            (self.progress)(&format!("fitting {}", hypothesis.label()));
            let begun = self.begin_near(hypothesis, base, look, &self.other_sizes(hypothesis))?;
            Ok(begun.map(|own| (own.misfit, own.fit)))
        };
        let begun = near.iter().zip(self.each(near.len(), task, make)?);
        Ok(begun.filter_map(|(&rank, own)| own.map(|(misfit, fit)| (rank, Begun { misfit, fit }))).collect())
    }

    /// Follows the lowest fit further if it explains most of what is missing but not all: it may only have ended early.
    fn go_on(&self, pass: &mut Pass, lowest: &mut Lowest) -> Result<(), Fault> {
        let Some(&best) = by_cost(&pass.tried).first() else { return Ok(()) };
        let tried = &mut pass.tried[best];
        if !tried.hypothesis.machine.is_fast() {
            return Ok(());
        }
        let excess = |fit: &Fit| fit.misfit / lowest.expected - 1.0;
        let is_most = |fit: &Fit| excess(fit) < MOST * excess(&pass.fit);
        let Some(fit) = tried.fit.take_if(|fit| !lowest.is_noise() && !fit.converged && is_most(fit)) else {
            return Ok(());
        };
        (self.progress)(&format!("going on with {}", tried.hypothesis.label()));
        let is_enough = |fit: &Fit| fit.misfit <= noise(pass.expected);
        let make = || {
            let problem = tried.hypothesis.problem(self.setup)?;
            Ok(schedule::go_on(&problem, fit.clone(), &self.setup.train, self.whole().tau, &is_enough))
        };
        let fit = self.one(|| self.task("go on", &tried.hypothesis, &[]).with(&fit), make)?;
        lowest.take(&fit);
        tried.fit = Some(fit);
        Ok(())
    }

    /// Follows the contenders further, and from what is expected, where the best of them leaves more than noise: which
    /// of them explains it shows only when none has ended early.
    pub(super) fn contend(&self, pass: &mut Pass) -> Result<(), Fault> {
        let order = by_cost(&pass.tried);
        let cost = |k: usize| pass.tried[k].fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
        let Some(&best) = order.first() else { return Ok(()) };
        let is_noise = pass.tried[best].fit.as_ref().is_some_and(|fit| fit.misfit <= adequate(pass.expected));
        let enough = pass.fit.cost - CONTENDERS.1 * (pass.fit.cost - cost(best));
        if is_noise || pass.fit.cost - cost(best) < self.needed * (pass.fit.misfit / pass.expected).max(1.0) {
            return Ok(());
        }
        let contenders: Vec<usize> = order.into_iter().filter(|&k| cost(k) <= enough).take(CONTENDERS.0).collect();
        let fitted = |k: &usize| pass.tried[*k].fit.as_ref().map(|fit| (*k, fit));
        let fits: Vec<(usize, &Fit)> = contenders.iter().filter_map(fitted).collect();
        let task = |k: usize| self.task("unbend", &pass.tried[fits[k].0].hypothesis, &[]).with(fits[k].1);
        let make = |k: usize| {
            let hypothesis = &pass.tried[fits[k].0].hypothesis;
            (self.progress)(&format!("going on with {}", hypothesis.label()));
            let fit = self.unbend(&hypothesis.problem(self.setup)?, fits[k].1.clone(), pass.expected);
            self.keep(role(pass.is_again), hypothesis, &fit);
            Ok(fit)
        };
        let unbent = self.each(fits.len(), task, make)?;
        for (k, fit) in contenders.into_iter().zip(unbent) {
            pass.tried[k].fit = Some(fit);
        }
        self.scatter(pass)
    }

    /// Fits the leader from numbers of the effect drawn at random, where it has several and leaves more than noise: one
    /// may have ended where another imitates it.
    fn scatter(&self, pass: &mut Pass) -> Result<(), Fault> {
        let Some(&best) = by_cost(&pass.tried).first() else { return Ok(()) };
        let Some(fit) = pass.tried[best].fit.clone() else { return Ok(()) };
        let hypothesis = &pass.tried[best].hypothesis;
        let has_several = hypothesis.inserts.last().is_some_and(|insert| insert.effect.parameters.len() > 1);
        if !has_several || !hypothesis.machine.is_fast() {
            return Ok(());
        }
        let make = || self.scattered(hypothesis, fit.clone(), pass.expected);
        let fit = self.one(|| self.task("scatter", hypothesis, &[]).with(&fit), make)?;
        self.keep(role(pass.is_again), hypothesis, &fit);
        pass.tried[best].fit = Some(fit);
        Ok(())
    }

    /// The lowest of a fit and of those from drawn numbers.
    fn scattered(&self, hypothesis: &Hypothesis, mut fit: Fit, expected: f64) -> Result<Fit, Fault> {
        let problem = hypothesis.problem(self.setup)?;
        let last = hypothesis.last();
        let mut draws = SplitMix(self.seed | 1);
        for _ in 0..SCATTERED {
            if fit.misfit <= adequate(expected) {
                break;
            }
            let mut start = problem.expected_nuisances(&fit.xi);
            for (unknown, xi) in problem.unknowns.iter().zip(&mut start) {
                if unknown.effect.is_some_and(|part| Some(part.effect) == last) {
                    *xi = draws.normal();
                }
            }
            (self.progress)(&format!("fitting {} from elsewhere", hypothesis.label()));
            let tau = self.whole().tau;
            let Ok((again, _)) = schedule::fit(&problem, &start, &self.setup.train, tau) else { continue };
            fit = lower(fit, again);
        }
        Ok(fit)
    }

    /// Follows a fit that leaves more than noise further, then fits once more with nuisances as expected: they were
    /// bent to imitate what is missing besides.
    fn unbend(&self, problem: &Problem<'_>, fit: Fit, expected: f64) -> Fit {
        let (whole, patience) = (self.whole(), patience(problem));
        let mut fit = match minimise(problem, &fit.xi, &whole, patience, None) {
            Ok(next) => lower(fit, next),
            Err(_) => fit,
        };
        if !problem.machine.is_fast() {
            return fit;
        }
        // Small misses of steep parts make local minima of their own, which wide weights do not see.
        if fit.misfit > adequate(expected)
            && let Ok(over) = minimise(problem, &fit.xi, &self.wide(), Effort::FULL, None)
            && let Ok(next) = minimise(problem, &over.xi, &whole, patience, None)
        {
            fit = lower(fit, next);
        }
        if fit.misfit <= adequate(expected) {
            return fit;
        }
        let again = schedule::fit(problem, &problem.expected_nuisances(&fit.xi), &self.setup.train, whole.tau);
        match again.and_then(|(fit, _)| minimise(problem, &fit.xi, &whole, patience, None)) {
            Ok(again) => lower(fit, again),
            Err(_) => fit,
        }
    }

    /// Fits from afar where nothing explains the measurement, and fits of candidates whose runs are long.
    fn shortlist_from_afar(&self, pass: &mut Pass, chosen: &[usize], lowest: &mut Lowest) -> Result<(), Fault> {
        let is_far = pass.fit.misfit / pass.expected > FAR;
        let mut left = MOST_AFAR;
        for &rank in chosen {
            let tried = &mut pass.tried[rank];
            let Some(insert) = tried.hypothesis.inserts.last() else { continue };
            let typical = insert.effect.probe * self.setup.scale(insert);
            let afar = is_far && left > 0 && insert.effect.parameters.len() > 1 && lowest.misfit > FAR;
            if afar {
                left -= 1;
                (self.progress)(&format!("fitting {} from afar", tried.hypothesis.label()));
                let task = || self.task("afar", &tried.hypothesis, &[&[typical]]).with(&pass.fit);
                let make = || self.fit_from_afar((&pass.base, &pass.fit), &tried.hypothesis, typical);
                if let Some(fit) = self.one(task, make)? {
                    lowest.take(&fit);
                    tried.fit = Some(tried.fit.take().map_or(fit.clone(), |near| lower(near, fit)));
                }
            }
            let is_close = tried.fit.as_ref().is_some_and(|fit| fit.misfit / pass.expected <= FAR);
            if let Some(look) = tried.look.as_ref().filter(|_| !tried.hypothesis.machine.is_fast() && !is_close) {
                // One start tells whether there is hope beside what explains the measurement.
                let others = if lowest.is_noise() { Vec::new() } else { self.other_sizes(&tried.hypothesis) };
                let base = pass.seen.as_ref().unwrap_or(&pass.fit);
                (self.progress)(&format!("fitting {}", tried.hypothesis.label()));
                let numbers = [lowest.misfit, lowest.cost];
                let task = || self.task("sizes", &tried.hypothesis, &[&look.start, &others, &numbers]).with(base);
                let make = || self.fit_from_sizes(&tried.hypothesis, base, look, &others, *lowest);
                if let Some(fit) = self.one(task, make)? {
                    lowest.take(&fit);
                    tried.fit = Some(tried.fit.take().map_or(fit.clone(), |own| lower(own, fit)));
                }
            }
        }
        self.follow_the_best(pass, chosen, lowest)
    }

    /// Follows the best of the candidates whose runs are long with derivatives of their own, as long as they explain a
    /// good share of what the best does: a few steps each, then the rest in the order of what these have left.
    fn follow_the_best(&self, pass: &mut Pass, chosen: &[usize], lowest: &mut Lowest) -> Result<(), Fault> {
        let cost = |tried: &Tried| tried.fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
        let is_slow = |rank: &usize| !pass.tried[*rank].hypothesis.machine.is_fast();
        let mut order: Vec<usize> = chosen.iter().copied().filter(is_slow).collect();
        for turn in 0..2 {
            order.sort_by(|&a, &b| cost(&pass.tried[a]).total_cmp(&cost(&pass.tried[b])));
            order.truncate(CONTENDERS.0);
            let mut followed = Vec::new();
            for &rank in &order {
                let tried = &mut pass.tried[rank];
                let is_done = |fit: &Fit| if turn == 0 { fit.fresh } else { fit.converged };
                let Some(fit) = tried.fit.take_if(|fit| !is_done(fit)) else { continue };
                let cost_drop = pass.fit.cost - fit.cost;
                let is_good = cost_drop >= self.needed && cost_drop >= CONTENDERS.1 * (pass.fit.cost - lowest.cost);
                tried.fit = Some(if is_good { self.followed(&tried.hypothesis, fit, turn, lowest)? } else { fit });
                followed.extend(is_good.then_some(rank));
            }
            order = followed;
        }
        Ok(())
    }

    /// The fit followed for a few steps, or from there to its end.
    fn followed(&self, hypothesis: &Hypothesis, fit: Fit, turn: usize, lowest: &mut Lowest) -> Result<Fit, Fault> {
        (self.progress)(&format!("going on with {}", hypothesis.label()));
        let against = lowest.cost;
        let make = || {
            let (problem, whole) = (hypothesis.problem(self.setup)?, self.whole());
            let mut effort = patience(&problem).against(against);
            effort.steps = if turn == 0 { TURN } else { effort.steps };
            // Derivatives that were borrowed at first are its own by then.
            let known = fit.jacobian.as_ref().filter(|_| turn > 0).map(|jacobian| (&jacobian.matrix, &whole));
            Ok(minimise(&problem, &fit.xi, &whole, effort, known).ok())
        };
        let next = self.one(|| self.task("follow", hypothesis, &[&[against, turn as f64]]).with(&fit), make)?;
        let fit = next.map_or(fit.clone(), |next| lower(fit, next));
        lowest.take(&fit);
        Ok(fit)
    }

    /// Sizes to start from beside the one that the screening claims.
    fn other_sizes(&self, hypothesis: &Hypothesis) -> Vec<f64> {
        let typical = hypothesis.inserts.last().map(|insert| insert.effect.probe * self.setup.scale(insert));
        typical.into_iter().flat_map(|typical| [0.5 * typical, 1.5 * typical]).collect()
    }

    /// Fits a candidate from three sizes, the best of them to the end.
    pub(super) fn fit_from_sizes(
        &self,
        hypothesis: &Hypothesis,
        base: &Fit,
        look: &Look,
        others: &[f64],
        lowest: Lowest,
    ) -> Result<Option<Fit>, Fault> {
        let whole = self.whole();
        if !hypothesis.machine.is_fast() && base.fresh && base.misfit / lowest.expected < FAR {
            // Derivatives are dear, and those of the fit without are good: which candidates are worth their own is seen later.
            let thrifty = Effort { worthwhile: f64::NEG_INFINITY, ..Effort::FULL };
            let known = base.jacobian.as_ref().map(|jacobian| (&jacobian.matrix, &whole));
            let start = [&base.xi[..], &look.start[..]].concat();
            return Ok(minimise(&hypothesis.problem(self.setup)?, &start, &whole, thrifty, known).ok());
        }
        match self.begin_near(hypothesis, base, look, others)? {
            Some(begun) => self.finish_near(hypothesis, &begun, lowest),
            None => Ok(None),
        }
    }

    /// Short fits from the size that the screening claims and from others, under wide weights; the best of them.
    fn begin_near(
        &self,
        hypothesis: &Hypothesis,
        base: &Fit,
        look: &Look,
        others: &[f64],
    ) -> Result<Option<Begun>, Fault> {
        let problem = hypothesis.problem(self.setup)?;
        let whole = self.whole();
        let known = base.jacobian.as_ref().map(|jacobian| (&jacobian.matrix, &whole));
        let wide = self.wide();
        let expected = problem.expected(&wide);
        let mut starts: Vec<Vec<f64>> = look.probed.iter().map(|(_, end)| end.clone()).collect();
        starts.push([&base.xi[..], &look.start[..]].concat());
        starts.extend(others.iter().map(|&size| hypothesis.at_size(&problem, &base.xi, size)));
        let mut best: Option<Fit> = None;
        for start in &starts {
            if let Ok(fit) = minimise(&problem, start, &wide, Effort::SHORT, known) {
                best = Some(match best {
                    Some(other) => lower(other, fit),
                    None => fit,
                });
            }
            // Where nothing but noise is left other sizes can gain nothing.
            if best.as_ref().is_some_and(|best| best.misfit <= noise(expected)) {
                break;
            }
        }
        if (base.misfit / problem.expected(&whole) > FAR || problem.is_pulled(&base.xi))
            && let Some(insert) = hypothesis.inserts.last()
            && let Some(fit) =
                self.begin_from_expected(hypothesis, base, insert.effect.probe * self.setup.scale(insert))?
        {
            best = Some(best.map_or(fit.clone(), |near| lower(near, fit)));
        }
        Ok(best.map(|fit| Begun { misfit: fit.misfit / expected, fit }))
    }

    /// Follows a short fit to its end; not if it is hopelessly far above the lowest one, and only while it catches up with that.
    fn finish_near(&self, hypothesis: &Hypothesis, begun: &Begun, lowest: Lowest) -> Result<Option<Fit>, Fault> {
        let problem = hypothesis.problem(self.setup)?;
        let (whole, wide) = (self.whole(), self.wide());
        let hopeless = if lowest.is_noise() { HOPELESS.1 } else { HOPELESS.0 };
        if begun.misfit > hopeless * lowest.misfit.max(1.0) {
            return Ok(Fit::at(&problem, &begun.fit.xi, &whole).ok());
        }
        let known = begun.fit.jacobian.as_ref().map(|jacobian| (&jacobian.matrix, &wide));
        Ok(minimise(&problem, &begun.fit.xi, &whole, Effort::FULL.against(lowest.cost), known).ok())
    }
}

/// Effects beside the chosen ones that fit the places where terms promise most, if those promise more than any effect:
/// an effect whose nuisances imitate it is hidden from the looks, but not from the place where it acts.
fn at_located_places(pass: &Pass, chosen: &[usize]) -> Vec<usize> {
    let promise = |tried: &Tried| tried.look.as_ref().map_or(0.0, Look::promise);
    let most = pass.tried.iter().map(promise).fold(NEEDED, f64::max);
    let gains: Vec<(f64, &str)> =
        pass.located.iter().map(|located| (located.score.gain, &*located.term.component)).collect();
    let places = rule::places_of_more(&gains, most);
    let fits = |&rank: &usize| {
        let tried = &pass.tried[rank];
        let is_there = tried.hypothesis.inserts.last().is_some_and(|own| places.contains(&own.sites[0].path.as_str()));
        is_there && tried.look.is_some() && tried.hypothesis.machine.is_fast() && !chosen.contains(&rank)
    };
    (0..pass.tried.len()).filter(fits).take(MOST_PLACED).collect()
}

/// In which role fits of candidates are remembered.
fn role(is_again: bool) -> &'static str {
    if is_again { "candidate again" } else { "candidate" }
}

/// A short fit under wide weights.
struct Begun {
    /// Its misfit per expected one.
    misfit: f64,
    fit: Fit,
}

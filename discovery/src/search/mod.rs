//! The search for what is missing: fit without, look at every effect, fit the likely ones with equal effort, decide, repeat.
//!
//! Guards: every candidate is fitted from several sizes; the fit without is tried again from the nuisances of the best candidate
//! and the candidates from those of their rivals, so that no name rests on a fit that only ended early; a candidate whose size
//! ends within two standard errors of nothing is the fit without.  Where the fall of the cost is larger than that size accounts for,
//! the fit without lies in another valley and the pass is begun again from a lower one.  A name needs a fall of the cost of 25, four
//! standard errors, plausible numbers, a lead of 10 over the next one and residuals that are noise; plain terms at equations are
//! rivals of every effect.

mod afar;
mod decide;
mod drop;
pub mod memory;
mod probe;
mod revisit;
mod shortlist;
mod terms;

use crate::catalogue::Candidate;
use crate::fit::schedule::{self, Record, lower};
use crate::fit::{Effort, Fit, minimise};
use crate::hypothesis::{Hypothesis, Look};
use crate::location::Located;
use crate::power::{Confusion, Power, confusions};
use crate::problem::{Problem, Weighing};
use crate::projection::Projection;
use crate::variant::Workshop;
use crate::{Fault, Setup};
use decide::{Outcome, noise};
use memory::Memory;
use shortlist::patience;

/// Fall of the cost (in units of the misfit per expected misfit) that a name needs.
pub const NEEDED: f64 = 25.0;
/// Lead over the next candidate.
pub const LEAD: f64 = 10.0;
/// Standard errors that the size must be away from nothing.
pub const ERRORS: f64 = 4.0;
/// Misfit per expected misfit up to which residuals count as noise.
pub const ADEQUATE: f64 = 1.06;
/// Most effects that are looked for.
const MOST_EFFECTS: usize = 3;
/// A rival is fitted again when its cost is above that of the best by less than this, or this part of the best's fall.
const CLOSE: (f64, f64) = (60.0, 0.05);
/// A fall of the cost that exceeds the square of the size in standard errors so many times is none of one valley.
const APART: f64 = 2.0;
/// A look that promises less is not followed: where something is missing, and where nothing but noise is left.
const PROMISING: (f64, f64) = (6.0, 12.0);

/// What came out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Status {
    /// Nothing is missing.
    Adequate,
    /// One effect (or several, one after the other) of the machine.
    Named,
    /// Several effects explain it equally well.
    Ambiguous,
    /// A measuring chain.
    Sensor,
    /// Something is missing that no library knows.
    Unknown,
    /// The fits did not end where they could be compared.
    Unconverged,
}

impl Status {
    /// The word of reports.
    pub fn word(self) -> &'static str {
        match self {
            Status::Adequate => "adequate",
            Status::Named => "named",
            Status::Ambiguous => "ambiguous",
            Status::Sensor => "sensor",
            Status::Unknown => "unknown",
            Status::Unconverged => "unconverged",
        }
    }
}

/// A candidate that was looked at, and fitted if it was likely.
pub struct Tried {
    /// With the effects found before it.
    pub hypothesis: Hypothesis,
    /// The look without a fit.
    pub look: Option<Look>,
    /// The fit.
    pub fit: Option<Fit>,
    /// Fall of the cost against the fit without, in units of the noise left.
    pub fall: f64,
    /// Size in standard errors from nothing.
    pub errors: f64,
    /// Its numbers are such as the library calls plausible.
    pub is_plausible: bool,
    /// Why it was not named, if there is a reason.
    pub verdict: String,
}

impl Tried {
    /// Before any fit.
    fn new(hypothesis: Hypothesis, look: Option<Look>) -> Self {
        Self { hypothesis, look, fit: None, fall: 0.0, errors: 0.0, is_plausible: true, verdict: String::new() }
    }
}

/// One pass of the search.
pub struct Pass {
    /// The model that the pass began with.
    pub base: Hypothesis,
    /// Its fit.
    pub fit: Fit,
    /// Where the fit has noise left only with something far off: the fit with that held back, from which effects are looked at.
    pub seen: Option<Fit>,
    /// Expected misfit.
    pub expected: f64,
    /// What was tried for it.
    pub record: Record,
    /// Candidates, the best first.
    pub tried: Vec<Tried>,
    /// Terms of equations held against what is left, the best first.
    pub located: Vec<Located>,
    /// The best of them, fitted; the best first.
    pub terms: Vec<Tried>,
    /// Runs that the look at the equations took.
    pub located_runs: usize,
    /// The pass was begun again, after so many runs, because its base fell into a lower valley.
    pub again: Option<usize>,
    /// How well each effect that can join could be seen.
    pub powers: Vec<Power>,
    /// Effects that look alike.
    pub confusions: Vec<Confusion>,
}

impl Pass {
    /// Runs of the model.
    fn runs(&self) -> usize {
        let tried = self.tried.iter().chain(&self.terms).map(|tried| tried.hypothesis.machine.runs());
        self.base.machine.runs() + tried.sum::<usize>() + self.located_runs + self.again.unwrap_or(0)
    }
}

/// The outcome of a search.
pub struct Findings {
    /// Status.
    pub status: Status,
    /// Passes; the last one found nothing more.
    pub passes: Vec<Pass>,
    /// Effects that explain the last pass equally well.
    pub ambiguous: Vec<Candidate>,
    /// Why what seemed to be the answer was not given, if so.
    pub reason: Option<String>,
    /// The best library effect where none is named.
    pub resembles: Option<Candidate>,
    /// Runs of the model.
    pub runs: usize,
    /// Seed of the random starts.
    pub seed: u64,
    /// Fall of the cost that a name needed.
    pub needed: f64,
    /// Nothing was named, and the shots held out show a gap that the fitted ones hide: others should be held out.
    pub hidden: bool,
}

/// A search.
pub struct Search<'a> {
    /// Study and set.
    pub setup: &'a Setup,
    /// Writer of models.
    pub workshop: &'a Workshop<'a>,
    /// All that may be missing.
    pub candidates: Vec<Candidate>,
    /// Seed of random starts.
    pub seed: u64,
    /// Fall of the cost that a name needs: [`NEEDED`], or more where [`crate::calibration`] says so.
    pub needed: f64,
    /// Told what is being done.
    pub progress: &'a dyn Fn(&str),
    /// Fits made before.
    pub memory: &'a dyn Memory,
}

impl Search<'_> {
    fn whole(&self) -> Weighing {
        Weighing::whole(&self.setup.train, self.setup.study.shots.time_tolerance)
    }

    /// Searches.
    ///
    /// # Errors
    /// When the base model does not run, or a text cannot be translated.
    pub fn run(&self) -> Result<Findings, Fault> {
        let mut passes: Vec<Pass> = Vec::new();
        let mut found: Vec<Candidate> = Vec::new();
        let mut start: Option<Fit> = None;
        let mut refused: Vec<Candidate> = Vec::new();
        let mut revisited = false;
        let mut left: Option<Pass> = None;
        loop {
            let mut pass = self.begin(found.clone(), start.take())?;
            if let Some(left) = left.take() {
                pass.again = Some(left.runs());
                pass.record = left.record;
            }
            let begun = pass.fit.cost;
            self.look(&mut pass, &refused)?;
            self.shortlist(&mut pass)?;
            self.contend(&mut pass)?;
            self.cross(&mut pass)?;
            if pass.again.is_none() && begun - pass.fit.cost > self.needed {
                (self.progress)("once more, from a lower valley");
                start = Some(pass.fit.clone());
                left = Some(pass);
                continue;
            }
            self.fit_terms(&mut pass)?;
            self.judge(&mut pass);
            let mut outcome = self.outcome(&pass);
            if matches!(outcome, Outcome::Unexplained) && found.is_empty() {
                // Before something unknown is claimed the fit without is tried as hard as can be.
                (self.progress)("fitting the base model again from elsewhere");
                let problem = pass.base.problem(self.setup)?;
                let tau = self.whole().tau;
                pass.fit = schedule::retry(&problem, pass.fit, &self.setup.train, (tau, self.seed), &mut pass.record);
                drop(problem);
                self.judge(&mut pass);
                outcome = self.outcome(&pass);
            }
            let again = match passes.last_mut() {
                Some(before) if !revisited => self.revisit(before, &pass)?,
                _ => None,
            };
            if let Some((again, before)) = again.and_then(|again| Some((again, passes.pop()?))) {
                found.clone_from(&before.base.inserts);
                (revisited, pass, outcome) = (true, before, again);
            }
            let named = match outcome {
                Outcome::Name(k) if found.len() < MOST_EFFECTS => Some(k),
                _ => None,
            };
            if let Some(k) = named {
                let best = &pass.tried[k];
                found = best.hypothesis.inserts.clone();
                start = best.fit.clone();
                (self.progress)(&format!("found: {}", best.hypothesis.label()));
                passes.push(pass);
                if let Some(fit) = &start
                    && let Some((out, again)) = self.needless(&found, fit)?
                {
                    let without = found.remove(out);
                    (self.progress)(&format!("no longer needed: {}", without.label()));
                    refused.push(without);
                    start = Some(again);
                }
                continue;
            }
            passes.push(pass);
            return self.conclude(passes, &found, outcome);
        }
    }

    /// Fits the model with what was found so far.
    fn begin(&self, found: Vec<Candidate>, start: Option<Fit>) -> Result<Pass, Fault> {
        let base = Hypothesis::new(self.setup, self.workshop, found)?;
        (self.progress)(&format!("fitting {}", base.label()));
        let problem = base.problem(self.setup)?;
        let expected = problem.expected(&self.whole());
        let mut record = Record::default();
        let fit = match start {
            None => match self.recalled("alone", &base)? {
                Some(fit) => fit,
                None => {
                    let zero = vec![0.0; problem.unknowns.len()];
                    let (fit, made) = schedule::fit(&problem, &zero, &self.setup.train, self.whole().tau)?;
                    record = made;
                    let fit = self.ended(&problem, fit, &mut record);
                    let fit =
                        schedule::unpull(&problem, fit, &self.setup.train, (self.whole().tau, self.seed), &mut record);
                    self.keep("alone", &base, &fit);
                    fit
                }
            },
            Some(fit) => {
                record.note("the fit that named the effect", &fit, expected);
                fit
            }
        };
        drop(problem);
        if record.attempts.is_empty() {
            record.note("the fit of the search that was ended", &fit, expected);
        }
        Ok(Pass {
            base,
            fit,
            seen: None,
            expected,
            record,
            tried: Vec::new(),
            located: Vec::new(),
            terms: Vec::new(),
            located_runs: 0,
            again: None,
            powers: Vec::new(),
            confusions: Vec::new(),
        })
    }

    /// A fit that ran out of steps above noise, but not far above, followed to its end.
    fn ended(&self, problem: &Problem<'_>, fit: Fit, record: &mut Record) -> Fit {
        let expected = problem.expected(&self.whole());
        if fit.converged || fit.misfit <= noise(expected) || fit.misfit > 2.0 * expected {
            return fit;
        }
        let Ok(next) = minimise(problem, &fit.xi, &self.whole(), Effort::LONG, None) else { return fit };
        record.note("from there", &next, expected);
        schedule::lower(fit, next)
    }

    /// Looks at all candidates that can join, but those that were needless once.
    fn look(&self, pass: &mut Pass, refused: &[Candidate]) -> Result<(), Fault> {
        let weighing = self.whole();
        let mut fit = pass.fit.clone();
        refresh(&pass.base, self.setup, &mut fit, &weighing)?;
        pass.fit = fit;
        let is_quiet = pass.fit.misfit / pass.expected <= ADEQUATE;
        // Where the misfit is that of noise but something is far off, what is missing shows once that is held back.
        if is_quiet {
            let problem = pass.base.problem(self.setup)?;
            pass.seen = schedule::held_back(&problem, &pass.fit, &weighing);
        }
        let is_bent = pass.seen.is_some();
        let mut seen = pass.seen.take().unwrap_or_else(|| pass.fit.clone());
        refresh(&pass.base, self.setup, &mut seen, &weighing)?;
        let is_quiet = is_quiet && !is_bent;
        let Some(projection) = Projection::new(&seen) else {
            return Err(Fault::run("no derivatives at the fit of the base model"));
        };
        let mut signatures = Vec::new();
        for candidate in &self.candidates {
            let same =
                |own: &Candidate| own.effect.id == candidate.effect.id && own.sites[0].path == candidate.sites[0].path;
            let taken =
                pass.base.inserts.iter().any(|own| own.excludes(candidate) || same(own)) || refused.iter().any(same);
            if taken {
                continue;
            }
            let mut inserts = pass.base.inserts.clone();
            inserts.push(candidate.clone());
            let hypothesis = Hypothesis::new(self.setup, self.workshop, inserts)?;
            let mut look = hypothesis.look(self.setup, &seen, &projection, (&weighing, is_quiet))?;
            if let Some((typical, score, signature)) = look.as_mut().and_then(|look| look.typical.take()) {
                let power = Power { effect: candidate.label(), typical, fall: score.power, left: score.left };
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
        pass.powers.sort_by(|a, b| b.fall.total_cmp(&a.fall));
        let gain = |tried: &Tried| tried.look.as_ref().map_or(0.0, Look::promise);
        pass.tried.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
        let promise = pass.tried.first().map_or(0.0, gain);
        if pass.fit.misfit / pass.expected > ADEQUATE || pass.base.inserts.is_empty() && promise > NEEDED && !is_bent {
            self.look_at_equations(pass)?;
        }
        Ok(())
    }

    /// Fits again from each other's nuisances: the base from the best candidate's, and where the lead is small the best from the
    /// next one's and the next ones from the best one's.
    fn cross(&self, pass: &mut Pass) -> Result<(), Fault> {
        let order = by_cost(&pass.tried);
        let Some(&best) = order.first() else { return Ok(()) };
        let count = pass.fit.xi.len();
        let whole = self.whole();
        let nuisances = |tried: &Tried| tried.fit.as_ref().map(|fit| fit.xi[..count].to_vec());
        self.without(pass, best)?;
        let cost = |tried: &Tried| tried.fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
        let lowest = cost(&pass.tried[best]);
        let near = CLOSE.0.max(CLOSE.1 * (pass.fit.cost - lowest));
        let rivals = order[1..].iter().copied().filter(|&k| cost(&pass.tried[k]) - lowest < near).take(2);
        let rivals: Vec<usize> = rivals.collect();
        let from_best = nuisances(&pass.tried[best]);
        let mut again: Vec<(usize, Option<Vec<f64>>)> = rivals.iter().map(|&k| (k, from_best.clone())).collect();
        again.extend(rivals.first().map(|&other| (best, nuisances(&pass.tried[other]))));
        for (k, start) in again {
            let (Some(start), Some(old)) = (start, pass.tried[k].fit.clone()) else { continue };
            let problem = pass.tried[k].hypothesis.problem(self.setup)?;
            let xi = [&start[..], &old.xi[count..]].concat();
            let known = old.jacobian.as_ref().map(|(jacobian, _)| (jacobian, &whole));
            let Ok(next) = minimise(&problem, &xi, &whole, patience(&problem), known) else { continue };
            drop(problem);
            pass.tried[k].fit = Some(lower(old, next));
        }
        Ok(())
    }
}

impl Search<'_> {
    /// Fits the base again from where the best candidate ended: from its nuisances, and from where they would go without it.  Where the
    /// fall of the cost is much larger than the size in standard errors tells, the two lie in different valleys.
    fn without(&self, pass: &mut Pass, best: usize) -> Result<(), Fault> {
        (self.progress)("fitting again from each other's parameters");
        let tried = &pass.tried[best];
        let Some(fit) = &tried.fit else { return Ok(()) };
        let (count, whole) = (pass.fit.xi.len(), self.whole());
        let problem = pass.base.problem(self.setup)?;
        let mut tries: Vec<(&str, Fit)> = Vec::new();
        let known = pass.fit.jacobian.as_ref().map(|(jacobian, _)| (jacobian, &whole));
        let against = Effort::FULL.against(fit.cost);
        let plain = minimise(&problem, &fit.xi[..count], &whole, against, known);
        tries.extend(plain.ok().map(|again| ("from the best candidate's parameters", again)));
        let own = tried.hypothesis.problem(self.setup)?;
        let lowest = tries.iter().map(|(_, again)| again.cost).fold(pass.fit.cost, f64::min);
        if own.machine.is_fast()
            && let Some(sizes) = decide::sizes(&tried.hypothesis, self.setup, &own, fit)
            && let Some(errors) = fit.errors_beside(&sizes.own, &sizes.away, &[])
            && lowest - fit.cost > APART * errors * errors + self.needed
            && let Some(start) = fit.moved_back(&sizes.own, &sizes.away)
            && let Ok(again) = minimise(&problem, &start[..count], &whole, Effort::FULL, None)
        {
            tries.push(("from the best candidate's parameters without it", again));
        }
        drop((problem, own));
        for (words, again) in tries {
            pass.record.note(words, &again, pass.expected);
            if again.cost < pass.fit.cost {
                pass.fit = again;
            }
        }
        Ok(())
    }
}

/// Positions of the candidates that were fitted, the lowest cost first.
fn by_cost(tried: &[Tried]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..tried.len()).filter(|&k| tried[k].fit.is_some()).collect();
    let cost = |k: usize| tried[k].fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
    order.sort_by(|&a, &b| cost(a).total_cmp(&cost(b)));
    order
}

/// Gives a fit a Jacobian at its own unknowns.
pub(crate) fn refresh(hypothesis: &Hypothesis, setup: &Setup, fit: &mut Fit, weighing: &Weighing) -> Result<(), Fault> {
    if fit.fresh {
        return Ok(());
    }
    let problem = hypothesis.problem(setup)?;
    let all: Vec<usize> = (0..problem.unknowns.len()).collect();
    let jacobian = problem.jacobian((&fit.xi, &fit.runs), weighing, &all, Effort::FULL.difference)?;
    (fit.jacobian, fit.fresh) = (Some((jacobian, all)), true);
    Ok(())
}

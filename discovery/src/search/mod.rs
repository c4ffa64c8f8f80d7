//! The search for what is missing: fit without, look at every effect, fit the likely ones with equal effort, decide, repeat.
//!
//! Guards: every candidate is fitted from several sizes; the fit without is tried again from the nuisances of the best
//! candidate and the candidates from those of their rivals, so that no name rests on a fit that only ended early; a
//! candidate whose size ends within two standard errors of nothing is the fit without.  Where the drop of the cost is
//! larger than that size accounts for, the fit without lies in another local minimum and the pass is begun again from a lower
//! one.  A name needs a drop of the cost of 25, four standard errors, plausible numbers, a lead of 10 over the next one
//! and residuals that are noise; plain terms at equations are rivals of every effect.  What stood against an effect, or would with fewer numbers
//! now, is fitted in its place once another one is found, and a tie is gone on from ([`found`], [`stand_in`], [`exchange`]).

mod afar;
mod context;
mod cross;
mod decide;
mod drop;
mod ends;
mod exact;
mod exchange;
mod found;
mod lasting;
mod laws;
mod look;
mod memory;
mod pass;
mod plainer;
mod plainest;
mod plausible;
mod probe;
mod revisit;
mod rounds;
mod rule;
mod shortlist;
mod stand_in;
mod terms;
mod withdraw;

use crate::catalogue::Candidate;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::thresholds::noise;
use crate::fault::Fault;
use crate::fit::schedule::{self, Record, lower};
use crate::fit::{Effort, Fit, minimise};
use crate::problem::Problem;
pub use context::Search;
pub(crate) use decide::is_beaten;
pub use ends::Ends;
pub(crate) use exact::Exact;
use found::Found;
pub use memory::{Forgetful, Memory};
pub(crate) use pass::{Alike, Findings, Pass, Refuted, Status, Tried};
use rule::Outcome;
use shortlist::Lowest;

/// Most effects that are looked for.
const MOST_EFFECTS: usize = 3;
/// Share of what a candidate explains that another local minimum of the fit without may explain as well.
const ELSEWHERE: f64 = 0.2;

/// A fit that ran out of steps is on a wrong way where it leaves more than this, in units of what noise leaves.
const FAR: f64 = 2.0;

/// How the first pass begins.
enum Start {
    /// With a fit from what is expected.
    Afresh,
    /// With this fit.
    Fit(Box<Fit>),
    /// It has begun.
    Begun(Box<Pass>),
}

impl Search<'_> {
    /// Searches.
    ///
    /// # Errors
    /// When the base model does not run, or a text cannot be translated.
    pub fn run(&self) -> Result<Findings, Fault> {
        self.run_from(None)
    }

    /// The same with a first pass that was begun before, if there is one.
    fn run_from(&self, begun: Option<Pass>) -> Result<Findings, Fault> {
        self.from(Vec::new(), Vec::new(), begun.map_or(Start::Afresh, |pass| Start::Begun(Box::new(pass))))
    }

    /// Goes on after these passes, with what was found.
    fn from(&self, mut passes: Vec<Pass>, found: Vec<Candidate>, start: Start) -> Result<Findings, Fault> {
        let mut found = Found::of(found);
        let (mut begun, mut start) = match start {
            Start::Afresh => (None, None),
            Start::Fit(fit) => (None, Some(*fit)),
            Start::Begun(pass) => (Some(*pass), None),
        };
        let mut refused: Vec<Candidate> = Vec::new();
        let mut revisited = !passes.is_empty();
        loop {
            let mut pass = match begun.take() {
                Some(pass) => pass,
                None => self.begin(found.effects(), start.take())?,
            };
            // Beside what was found, noise as stated is no measure for effects where hum and drift are what is left.
            if !found.all.is_empty() && found.ties.is_empty() && self.is_of_chains(&mut pass, &refused)? {
                (self.progress)("what measuring chains add explains far more of the rest than effects");
                pass.explained = passes.first().map_or(0.0, |first| first.fit.cost - pass.fit.cost);
                if let Some(before) = passes.last_mut() {
                    before.forget_derivatives();
                }
                passes.push(pass);
                return self.conclude(passes, found.effects(), Outcome::Unexplained);
            }
            pass = self.pass(pass, &refused)?;
            pass.explained = passes.first().map_or(0.0, |first| first.fit.cost - pass.fit.cost);
            let mut outcome = self.settle(&mut pass)?;
            let is_another = match passes.last_mut() {
                Some(before) if !revisited => self.revisit(before, &pass)?,
                _ => false,
            };
            if let Some(before) = passes.pop_if(|_| is_another) {
                found.truncate(before.base.inserts.len());
                (revisited, pass) = (true, before);
                outcome = self.answer(&mut pass)?;
            }
            let known = found.all.len();
            let taken = match &outcome {
                Outcome::Name(k) if known < MOST_EFFECTS => {
                    found.take(&pass, *k);
                    Some(*k)
                }
                Outcome::Several(close) if found.goes_on(&pass, close, MOST_EFFECTS) => {
                    found.take_for_now(&pass, close.clone(), passes.len() + 1);
                    Some(close[0])
                }
                _ => None,
            };
            // Effects that may not be needed any more: all earlier ones beside a new one, in the end those that have vanished.
            let doubted = match taken {
                Some(k) => {
                    let named = &pass.tried[k];
                    start.clone_from(&named.fit);
                    let is_tied = matches!(outcome, Outcome::Several(_));
                    let words = if is_tied { "for the time being" } else { "found" };
                    (self.progress)(&format!("{words}: {}", named.hypothesis.label()));
                    (0..known).collect()
                }
                None if known > 1 => {
                    start = Some(pass.fit.clone());
                    plausible::vanished(&pass, self.setup)
                }
                None => Vec::new(),
            };
            let needless = match &start {
                Some(fit) => self.needless(&found.effects(), fit, &doubted)?,
                None => None,
            };
            let plainer = match &start {
                Some(fit) if taken.is_some() && needless.is_none() => self.plainer(&found.effects(), fit)?,
                _ => None,
            };
            if let Some((inserts, again)) = plainer {
                found.all.iter_mut().zip(inserts).for_each(|(own, plainer)| own.candidate = plainer);
                start = Some(again);
            }
            if let Some(before) = passes.last_mut() {
                before.forget_derivatives();
            }
            passes.push(pass);
            if let Some((out, again)) = needless {
                let without = found.remove(out);
                (self.progress)(&format!("no longer needed: {}", without.label()));
                refused.push(without);
                start = Some(again);
            } else if taken.is_some() {
                if let Some(fit) = &start {
                    self.stand_ins(&mut found, fit)?;
                }
                start = start.map(|fit| self.exchanged(&mut found, &mut passes, fit)).transpose()?;
            } else if let Some(mut tie) = found.last_tie() {
                // Nothing was found beside it: the tie is the answer.
                found.truncate(tie.number);
                while let Some(before) = found.last_tie() {
                    found.truncate(before.number);
                    tie = before;
                }
                passes.truncate(tie.passes);
                return self.conclude(passes, found.effects(), Outcome::Several(tie.close));
            } else if !found.ties.is_empty() {
                // What was found beside it is the model in which those that are alike are compared at last.
                start = match passes.last() {
                    Some(last) => self.without_tie(&mut found, &last.fit)?,
                    None => None,
                };
            } else {
                let alike = found.alike();
                let mut findings = self.conclude(passes, found.effects(), outcome)?;
                let inserts = findings.passes.last().map(|last| last.base.inserts.clone()).unwrap_or_default();
                let is_in = |of: &Candidate| inserts.iter().any(|own| own.is_same(of));
                let is_open = |own: &Alike| is_in(&own.named) && !is_in(&own.candidate);
                if findings.named() > 0 {
                    findings.alike = alike.into_iter().filter(is_open).collect();
                }
                return Ok(findings);
            }
        }
    }

    /// One pass after the fit without: the screening and the fits of candidates.  Begun again where the fit without reaches a
    /// lower local minimum on the way.
    fn pass(&self, mut pass: Pass, refused: &[Candidate]) -> Result<Pass, Fault> {
        if pass.base.inserts.len() >= MOST_EFFECTS {
            // What the rest looks like is told; no further effect would be named.
            self.look(&mut pass, refused)?;
            return Ok(pass);
        }
        let begun = pass.fit.cost;
        self.explain(&mut pass, refused, None)?;
        let scale = (pass.fit.misfit / pass.expected).max(1.0);
        let fits = pass.tried.iter().filter_map(|tried| tried.fit.as_ref());
        let lowest = Lowest::of(fits, pass.expected);
        // What leaves nothing but noise explains much more than the way to the lower local minimum did.
        let is_settled = lowest.is_noise() && begun - pass.fit.cost < ELSEWHERE * (begun - lowest.cost);
        if is_settled || begun - pass.fit.cost <= self.needed * scale {
            return Ok(pass);
        }
        (self.progress)("once more, from a lower local minimum");
        let mut again = self.begin(pass.base.inserts.clone(), Some(pass.fit.clone()))?;
        again.is_again = true;
        again.record = std::mem::take(&mut pass.record);
        self.explain(&mut again, refused, Some(pass))?;
        Ok(again)
    }

    /// Looks at the candidates and fits the likely ones; those of an earlier turn of the same pass count as well.
    fn explain(&self, pass: &mut Pass, refused: &[Candidate], earlier: Option<Pass>) -> Result<(), Fault> {
        self.look(pass, refused)?;
        // Fits from afar begin with nuisances as expected, and would end where they did.
        let old = earlier.into_iter().flat_map(|earlier| earlier.tried);
        let (fast, slow) = old.partition(|tried| tried.hypothesis.machine.is_fast());
        take_over(pass, slow);
        self.shortlist(pass)?;
        take_over(pass, fast);
        self.contend(pass)?;
        self.cross(pass)
    }

    /// Fits what has implausible numbers again, and terms beside the candidates; says what follows.
    fn settle(&self, pass: &mut Pass) -> Result<Outcome, Fault> {
        if self.tame(pass)? {
            self.cross(pass)?;
        }
        self.fit_terms(pass)?;
        self.answer(pass)
    }

    /// What follows from the fits of a pass.
    fn answer(&self, pass: &mut Pass) -> Result<Outcome, Fault> {
        self.judge(pass);
        let outcome = self.outcome(pass);
        if !matches!(outcome, Outcome::Unexplained) || !pass.base.inserts.is_empty() {
            return Ok(outcome);
        }
        // Before something unknown is claimed the fit without is tried as hard as can be.
        (self.progress)("fitting the base model again from elsewhere");
        let make = || {
            let mut record = Record::default();
            let how = (self.whole().tau, self.seed);
            let problem = pass.base.problem(self.setup)?;
            let fit = schedule::retry(&problem, pass.fit.clone(), &self.setup.train, how, &mut record);
            Ok((fit, record))
        };
        let (fit, record) = self.one(|| self.task("elsewhere", &pass.base, &[]).with(&pass.fit), make)?;
        pass.fit = fit;
        pass.record.attempts.extend(record.attempts);
        self.judge(pass);
        Ok(self.outcome(pass))
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
                    let made = self.one(|| self.task("alone", &base, &[]), || self.afresh(&problem))?;
                    record = made.1;
                    self.keep("alone", &base, &made.0);
                    made.0
                }
            },
            Some(fit) => {
                record.note("the fit that named the effect", &fit, expected);
                fit
            }
        };
        problem.check_misfit(&fit, &self.whole())?;
        drop(problem);
        if record.attempts.is_empty() {
            record.note("the fit of the search that was ended", &fit, expected);
        }
        Ok(Pass {
            base,
            fit,
            seen: None,
            expected,
            explained: 0.0,
            record,
            tried: Vec::new(),
            located: Vec::new(),
            terms: Vec::new(),
            is_again: false,
            powers: Vec::new(),
            confusions: Vec::new(),
        })
    }

    /// Fits from what is expected.
    fn afresh(&self, problem: &Problem<'_>) -> Result<(Fit, Record), Fault> {
        let (shots, tau) = (&self.setup.train, self.whole().tau);
        let zero = vec![0.0; problem.unknowns.len()];
        let (fit, mut record) = schedule::fit(problem, &zero, shots, tau)?;
        let fit = self.ended(problem, fit, &mut record);
        let fit = schedule::unpull(problem, fit, shots, (tau, self.seed), &mut record);
        Ok((fit, record))
    }

    /// A fit that ran out of steps above noise, followed to its end; far above noise it was on a wrong way, and goes another one from there.
    fn ended(&self, problem: &Problem<'_>, fit: Fit, record: &mut Record) -> Fit {
        let expected = problem.expected(&self.whole());
        if fit.converged || fit.misfit <= noise(expected) {
            return fit;
        }
        if fit.misfit > FAR * expected {
            let is_fast = problem.machine.is_fast();
            let (shots, tau) = (&self.setup.train, self.whole().tau);
            return if is_fast { schedule::from_there(problem, fit, shots, tau, record) } else { fit };
        }
        let Ok(next) = minimise(problem, &fit.xi, &self.whole(), Effort::LONG, None) else { return fit };
        record.note("from there", &next, expected);
        schedule::lower(fit, next)
    }
}

/// Fits of an earlier turn of a pass where they are lower.
fn take_over(pass: &mut Pass, earlier: Vec<Tried>) {
    for old in earlier {
        let same = |tried: &&mut Tried| tried.hypothesis.key() == old.hypothesis.key();
        if let Some(tried) = pass.tried.iter_mut().find(same) {
            tried.fit = match (tried.fit.take(), old.fit) {
                (Some(own), Some(old)) => Some(lower(own, old)),
                (own, old) => own.or(old),
            };
        }
    }
}

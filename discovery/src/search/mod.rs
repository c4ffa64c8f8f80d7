//! The search for what is missing: fit without, look at every effect, fit the likely ones with equal effort, decide, repeat.
//!
//! Guards: every candidate is fitted from several sizes; the fit without is tried again from the nuisances of the best
//! candidate and the candidates from those of their rivals, so that no name rests on a fit that only ended early; a
//! candidate whose size ends within two standard errors of nothing is the fit without.  Where the fall of the cost is
//! larger than that size accounts for, the fit without lies in another valley and the pass is begun again from a lower
//! one.  A name needs a fall of the cost of 25, four standard errors, plausible numbers, a lead of 10 over the next one
//! and residuals that are noise; plain terms at equations are rivals of every effect.

mod afar;
mod cross;
mod decide;
mod drop;
mod look;
pub mod memory;
mod plainer;
mod plausible;
mod probe;
mod revisit;
mod rounds;
mod rule;
mod shortlist;
mod terms;

use crate::catalogue::Candidate;
use crate::fit::schedule::{self, Record, lower};
use crate::fit::{Effort, Fit, minimise};
use crate::hypothesis::{Hypothesis, Look};
use crate::location::Located;
use crate::power::{Confusion, Power};
use crate::problem::{Problem, Weighing};
use crate::variant::Workshop;
use crate::{Fault, Setup};
pub(crate) use decide::is_beaten;
use decide::noise;
use memory::Memory;
use rule::Outcome;
use shortlist::Lowest;

/// Fall of the cost (in units of the misfit per expected misfit) that a name needs.
pub const NEEDED: f64 = 25.0;
/// Lead over the next candidate.
pub const LEAD: f64 = 10.0;
/// Standard errors that the size must be away from nothing.
pub const ERRORS: f64 = 4.0;
/// Misfit per expected misfit up to which residuals count as noise.
pub const ADEQUATE: f64 = 1.06;
/// The largest misfit that counts as noise where noise leaves `expected`: of few independent samples the scatter of their sum decides.
pub fn adequate(expected: f64) -> f64 {
    (ADEQUATE * expected).max(noise(expected))
}

/// Most effects that are looked for.
const MOST_EFFECTS: usize = 3;
/// A rival is fitted again when its cost is above that of the best by less than this, or this part of the best's fall.
const CLOSE: (f64, f64) = (60.0, 0.05);
/// A fall of the cost that exceeds the square of the size in standard errors so many times is none of one valley.
const APART: f64 = 2.0;
/// Share of what a candidate explains that another valley of the fit without may explain as well.
const VALLEY: f64 = 0.2;
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
    /// Size in standard errors from nothing; none where it is not known.
    pub errors: Option<f64>,
    /// Its numbers are such as the library calls plausible.
    pub is_plausible: bool,
    /// Why it was not named, if there is a reason.
    pub verdict: String,
}

impl Tried {
    /// Before any fit.
    fn new(hypothesis: Hypothesis, look: Option<Look>) -> Self {
        Self { hypothesis, look, fit: None, fall: 0.0, errors: None, is_plausible: true, verdict: String::new() }
    }

    /// True if its size is known well enough for a name.
    pub fn has_size(&self) -> bool {
        rule::has_size(self.errors)
    }

    /// True if its size is none within its error: the model without it.
    fn is_nothing(&self) -> bool {
        rule::is_nothing(self.errors)
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
    /// Fall of the cost that the effects named before have brought.
    pub explained: f64,
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
    /// The pass was begun again because its base fell into a lower local minimum.
    pub is_again: bool,
    /// Runs of passes that were given up for this one.
    pub dropped: usize,
    /// How well each effect that can join could be seen.
    pub powers: Vec<Power>,
    /// Effects that look alike.
    pub confusions: Vec<Confusion>,
}

impl Pass {
    /// Runs of the model.
    fn runs(&self) -> usize {
        let tried = self.tried.iter().chain(&self.terms).map(|tried| tried.hypothesis.machine.runs());
        self.base.machine.runs() + tried.sum::<usize>() + self.located_runs + self.dropped
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
    /// False if what the best model leaves still changed in the last round.
    pub is_settled: bool,
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
        loop {
            let mut pass = self.pass(&found, start.take(), &refused)?;
            pass.explained = passes.first().map_or(0.0, |first| first.fit.cost - pass.fit.cost);
            let mut outcome = self.settle(&mut pass)?;
            let is_another = match passes.last_mut() {
                Some(before) if !revisited => self.revisit(before, &pass)?,
                _ => false,
            };
            if let Some(before) = passes.pop_if(|_| is_another) {
                found.clone_from(&before.base.inserts);
                (revisited, pass) = (true, before);
                outcome = self.answer(&mut pass)?;
            }
            let is_named = matches!(outcome, Outcome::Name(_)) && found.len() < MOST_EFFECTS;
            // Effects that may not be needed any more: all earlier ones beside a new one, in the end those that have vanished.
            let doubted = match outcome {
                Outcome::Name(k) if is_named => {
                    let named = &pass.tried[k];
                    found.clone_from(&named.hypothesis.inserts);
                    start.clone_from(&named.fit);
                    (self.progress)(&format!("found: {}", named.hypothesis.label()));
                    (0..found.len() - 1).collect()
                }
                _ if found.len() > 1 => {
                    start = Some(pass.fit.clone());
                    plausible::vanished(&pass, self.setup)
                }
                _ => Vec::new(),
            };
            let needless = match &start {
                Some(fit) => self.needless(&found, fit, &doubted)?,
                None => None,
            };
            let plainer = match &start {
                Some(fit) if is_named && needless.is_none() => self.plainer(&found, fit)?,
                _ => None,
            };
            if let Some((inserts, again)) = plainer {
                (found, start) = (inserts, Some(again));
            }
            passes.push(pass);
            if let Some((out, again)) = needless {
                let without = found.remove(out);
                (self.progress)(&format!("no longer needed: {}", without.label()));
                refused.push(without);
                start = Some(again);
            } else if !is_named {
                return self.conclude(passes, &found, outcome);
            }
        }
    }

    /// One pass: the fit without, the looks and the fits of candidates.  Begun again where the fit without falls into a
    /// lower local minimum on the way.
    fn pass(&self, found: &[Candidate], start: Option<Fit>, refused: &[Candidate]) -> Result<Pass, Fault> {
        let mut pass = self.begin(found.to_vec(), start)?;
        let begun = pass.fit.cost;
        self.explain(&mut pass, refused, None)?;
        let scale = (pass.fit.misfit / pass.expected).max(1.0);
        let fits = pass.tried.iter().filter_map(|tried| tried.fit.as_ref());
        let lowest = Lowest::of(fits, pass.expected);
        // What leaves nothing but noise explains much more than the way to the lower local minimum did.
        let is_settled = lowest.is_noise() && begun - pass.fit.cost < VALLEY * (begun - lowest.cost);
        if is_settled || begun - pass.fit.cost <= self.needed * scale {
            return Ok(pass);
        }
        (self.progress)("once more, from a lower local minimum");
        let mut again = self.begin(found.to_vec(), Some(pass.fit.clone()))?;
        (again.is_again, again.dropped) = (true, pass.runs());
        again.record = std::mem::take(&mut pass.record);
        self.explain(&mut again, refused, Some(pass))?;
        Ok(again)
    }

    /// Looks at the candidates and fits the likely ones; those of an earlier turn of the same pass count as well.
    fn explain(&self, pass: &mut Pass, refused: &[Candidate], earlier: Option<Pass>) -> Result<(), Fault> {
        self.look(pass, refused)?;
        self.shortlist(pass)?;
        for old in earlier.into_iter().flat_map(|earlier| earlier.tried) {
            let same = |tried: &&mut Tried| tried.hypothesis.key() == old.hypothesis.key();
            if let Some(tried) = pass.tried.iter_mut().find(same) {
                tried.fit = match (tried.fit.take(), old.fit) {
                    (Some(own), Some(old)) => Some(lower(own, old)),
                    (own, old) => own.or(old),
                };
            }
        }
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
        let problem = pass.base.problem(self.setup)?;
        let tau = self.whole().tau;
        let fit = pass.fit.clone();
        pass.fit = schedule::retry(&problem, fit, &self.setup.train, (tau, self.seed), &mut pass.record);
        drop(problem);
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
            located_runs: 0,
            is_again: false,
            dropped: 0,
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
}

/// Positions of the candidates that were fitted, the lowest cost first.
fn by_cost(tried: &[Tried]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..tried.len()).filter(|&k| tried[k].fit.is_some()).collect();
    let cost = |k: usize| tried[k].fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
    order.sort_by(|&a, &b| cost(a).total_cmp(&cost(b)));
    order
}

/// Of the candidates that were fitted, the best first, those that explain about as much as the one at `best`, and more
/// than chance would.
fn contested(pass: &Pass, best: usize, needed: f64) -> Vec<usize> {
    let fit = |k: usize| pass.tried[k].fit.as_ref();
    let lowest = fit(best).map_or(f64::INFINITY, |fit| fit.cost);
    let near = CLOSE.0.max(CLOSE.1 * (pass.fit.cost - lowest));
    let is_contested = |&k: &usize| {
        fit(k).is_some_and(|own| {
            let scale = (own.misfit / pass.expected).max(1.0);
            own.cost - lowest < near && pass.fit.cost - own.cost >= needed * scale
        })
    };
    by_cost(&pass.tried).into_iter().filter(is_contested).collect()
}

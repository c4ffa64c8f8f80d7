//! What follows from the fits: drops of the cost, sizes in errors, a name or none, and what speaks against it.

use super::MOST_EFFECTS;
use super::context::Search;
use super::pass::{Findings, Pass, Status, Tried};
use super::plausible::{implausible, is_plausible, size_in_errors};
use super::rule::{self, Outcome, Standing, Without, is_beaten_by};
use crate::catalogue::{Candidate, Kind};
use crate::evidence::hypothesis::Look;
use crate::evidence::proof::Gap;
use crate::evidence::thresholds::{ADEQUATE, LEAD, PROMISING, adequate, noise};
use crate::fault::Fault;
use crate::fit::Fit;
use crate::fit::schedule::Record;
use crate::unknowns::{LIMIT, Unknown};

/// How many times more a further effect takes where what is left is adequate, and the share of what was explained
/// before that it takes then, up to this share of the expected misfit.
const FURTHER: (f64, f64, f64) = (3.0, 2e-3, 0.02);
/// How many times more an effect takes for each shot in which it has a size of its own.
const OF_EACH_SHOT: f64 = 0.5;
/// How many times more it takes where parameters scatter from shot to shot: which ones do is known roughly, and it imitates the rest.
const WHERE_SCATTERED: f64 = 3.0;
/// Of a single fitted shot nothing tells a parameter that is off there from an effect with a size of its own in each shot.
const FEW: usize = 2;
/// Above this the fit without is taken for unfinished where nothing explains it and its attempts disagree.
const APART: f64 = 0.1;
/// Share of what was missing (in the excess of the mean square over that of noise) that a name may leave where samples
/// are not granted any tolerance of time: what rises steeply is met a little too early or too late by all models.
const LEFT: f64 = 0.15;
/// Share of the excess that the best effect leaves, of which a term that explains all leaves no more.
const NEXT_TO_NOTHING: f64 = 0.05;
/// What is said of a candidate whose numbers cannot be.
const IMPLAUSIBLE: &str = "its numbers are beyond what is plausible";

impl Search<'_> {
    /// Drops of the cost and sizes in standard errors; candidates that have a size come first, in the order of their cost.  One
    /// whose size ends within [`NOTHING`] errors of nothing is the fit without: it may lower the cost that others are compared with.
    pub(super) fn judge(&self, pass: &mut Pass) {
        let mut without = pass.fit.cost;
        for tried in pass.tried.iter_mut().chain(&mut pass.terms) {
            let Some(fit) = &tried.fit else { continue };
            tried.errors = size_in_errors(&tried.hypothesis, self.setup, fit);
            tried.is_plausible = is_plausible(&tried.hypothesis, self.setup, fit);
            if tried.is_nothing() {
                without = without.min(fit.cost);
            }
        }
        for tried in pass.tried.iter_mut().chain(&mut pass.terms) {
            let Some(fit) = &tried.fit else { continue };
            tried.cost_drop = (without - fit.cost) / (fit.misfit / pass.expected).max(1.0);
        }
        let key = |tried: &Tried| match &tried.fit {
            Some(fit) => (tried.is_nothing(), fit.cost),
            None => (true, f64::INFINITY),
        };
        for list in [&mut pass.tried, &mut pass.terms] {
            list.sort_by(|a, b| {
                let (a, b) = (key(a), key(b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            });
        }
        let standings = self.standings(pass);
        let leader = rule::leader(&standings);
        let best = leader.map_or(0.0, |k| pass.tried[k].cost_drop);
        let promising = self.promising(pass);
        for (k, (tried, standing)) in pass.tried.iter_mut().zip(&standings).enumerate() {
            tried.verdict = verdict(tried, standing.as_ref(), (leader == Some(k), best), promising);
            if tried.verdict == IMPLAUSIBLE
                && let Some(fit) = &tried.fit
                && let Some(words) = implausible(&tried.hypothesis, self.setup, fit)
            {
                tried.verdict = words;
            }
        }
    }

    /// What each candidate's fit has brought.
    fn standings(&self, pass: &Pass) -> Vec<Option<Standing>> {
        let plainer = |tried: &Tried| {
            let own = tried.hypothesis.inserts.last()?;
            let cost = |k: usize| pass.tried[k].fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
            let is_plainer = |other: &Tried| {
                let inserted = other.hypothesis.inserts.last().filter(|_| other.fit.is_some());
                inserted.is_some_and(|other| own.refines(other))
            };
            let all = (0..pass.tried.len()).filter(|&k| is_plainer(&pass.tried[k]));
            all.min_by(|&a, &b| cost(a).total_cmp(&cost(b)))
        };
        let standing = |tried: &Tried| {
            let plainer = plainer(tried);
            // What an effect with implausible numbers explains beyond the plainer one that it refines belongs to something else.
            let is_imitation = !tried.is_plausible && plainer.is_some_and(|other| pass.tried[other].is_plausible);
            let fit = tried.fit.as_ref().filter(|_| !is_imitation)?;
            Some(Standing {
                cost: fit.cost,
                scale: (fit.misfit / pass.expected).max(1.0),
                cost_drop: tried.cost_drop,
                needed: self.needed_for(pass, tried),
                errors: tried.errors,
                is_plausible: tried.is_plausible,
                plainer,
            })
        };
        pass.tried.iter().map(standing).collect()
    }

    /// The drop that the next name needs.  Once an effect is named and what is left is adequate, the next one needs
    /// more by [`FURTHER`]: what an effect does differently in truth is imitated by small amounts of others, and that
    /// is the more the more it explains. An effect with a size of its own for each shot needs more by [`OF_EACH_SHOT`]:
    /// it imitates what scatters from shot to shot.
    fn needed_for(&self, pass: &Pass, tried: &Tried) -> f64 {
        let is_enough = !pass.base.inserts.is_empty() && is_adequate(pass);
        let share = (FURTHER.1 * pass.explained).min(FURTHER.2 * pass.expected);
        let further = (FURTHER.0 * self.needed).max(share);
        self.scatter_of(tried) * if is_enough { further } else { self.needed }
    }

    /// How many times more than others an effect needs because every shot has a size of its own.
    fn scatter_of(&self, tried: &Tried) -> f64 {
        let is_per_shot = tried.hypothesis.inserts.last().is_some_and(|insert| insert.effect.per_shot);
        let count = self.setup.train.len();
        match is_per_shot {
            false => 1.0,
            true if count < FEW => f64::INFINITY,
            true => {
                let is_scattered = !self.setup.disturbances.scatter.is_empty();
                (OF_EACH_SHOT * count as f64).max(1.0) * if is_scattered { WHERE_SCATTERED } else { 1.0 }
            }
        }
    }

    /// The largest drop of a pass, in units of what each candidate needs times the usual threshold.
    pub(crate) fn largest_drop(&self, pass: &Pass) -> f64 {
        pass.tried.iter().map(|tried| tried.cost_drop / self.scatter_of(tried)).fold(0.0, f64::max)
    }

    /// What a pass says once it is judged.
    pub(super) fn outcome(&self, pass: &Pass) -> Outcome {
        let without = Without {
            is_adequate: is_adequate(pass),
            is_noise: !pass.base.inserts.is_empty() || pass.fit.misfit <= noise(pass.expected),
        };
        let is_beaten = |k: usize| pass.tried[k].fit.as_ref().is_some_and(|fit| is_beaten(pass, fit));
        rule::outcome(&self.standings(pass), without, is_beaten)
    }

    pub(super) fn conclude(
        &self,
        mut passes: Vec<Pass>,
        mut found: Vec<Candidate>,
        outcome: Outcome,
    ) -> Result<Findings, Fault> {
        let refuted = self.withdraw(&mut passes, &mut found)?;
        let outcome = if refuted.is_empty() { outcome } else { Outcome::Unexplained };
        let found = &found[..];
        let (status, ambiguous) = (Status::Adequate, Vec::new());
        let mut findings = Findings {
            status,
            passes,
            ambiguous,
            reason: None,
            resembles: None,
            unfitted: None,
            runs: 0,
            seed: self.seed,
            needed: self.needed,
            hidden: false,
            is_settled: true,
            given_up: None,
            refuted,
            alike: Vec::new(),
            law: None,
            no_law: None,
            exact: Vec::new(),
        };
        let (Some(first), Some(last)) = (findings.passes.first(), findings.passes.last()) else { return Ok(findings) };
        let doubt = self.doubt(first, last)?;
        let best = last.tried.first().and_then(|tried| tried.hypothesis.inserts.last().cloned());
        // Those that were fitted stand before those that were not.
        let first_tried = last.tried.first().filter(|tried| found.is_empty() && tried.fit.is_none());
        let promise = first_tried.and_then(|tried| Some(tried.look.as_ref()?.promise()));
        let unfitted = promise.map(|promise| (promise, self.promising(last)));
        let (status, ambiguous) = match &outcome {
            // What unseen shots refute shows nothing where the model without it leaves nothing but noise.
            Outcome::Nothing if doubt.as_ref().is_some_and(|doubt| doubt.is_refuted) && self.is_noise(first)? => {
                (Status::Adequate, Vec::new())
            }
            Outcome::Nothing if doubt.is_some() => (Status::Unknown, Vec::new()),
            Outcome::Nothing if found.is_empty() && self.setup.disturbances.is_noise() => {
                (Status::Adequate, Vec::new())
            }
            Outcome::Nothing if found.is_empty() => (Status::Unknown, Vec::new()),
            Outcome::Nothing => (named(found), Vec::new()),
            Outcome::Several(close) => {
                let inserts = close.iter().filter_map(|&k| last.tried[k].hypothesis.inserts.last().cloned());
                // What was found stays found, whatever explains the rest.
                let is_found = !found.is_empty() && doubt.is_none();
                (if is_found { named(found) } else { Status::Ambiguous }, inserts.collect())
            }
            // What was found stays found, whatever else is missing.
            Outcome::Name(_) | Outcome::Unexplained if !found.is_empty() && doubt.is_none() => {
                (named(found), Vec::new())
            }
            Outcome::Name(_) | Outcome::Unexplained => {
                let unfinished = found.is_empty() && apart(&last.record) && last.fit.misfit / last.expected < 1.5;
                (if unfinished { Status::Unconverged } else { Status::Unknown }, Vec::new())
            }
        };
        (findings.status, findings.ambiguous) = (status, ambiguous);
        let is_said = matches!(outcome, Outcome::Nothing) || !found.is_empty();
        findings.reason = doubt.filter(|_| is_said).map(|doubt| doubt.words);
        if findings.reason.is_none() && status == Status::Unknown && matches!(outcome, Outcome::Nothing) {
            findings.reason = Some("no effect explains what every model leaves, which is more than noise".to_string());
        }
        findings.hidden = (found.is_empty() || status == Status::Adequate) && self.hides(first)?;
        if status == Status::Unknown {
            findings.resembles = found.last().cloned().or(best);
            findings.unfitted = unfitted;
        }
        Ok(findings)
    }

    /// What speaks against the answer.  Under the true noise, without any tolerance of time, what is left must be noise; an effect
    /// must not make the gap on shots held out larger, and shots of one operating point cannot tell an effect from wrong numbers.
    fn doubt(&self, first: &Pass, last: &Pass) -> Result<Option<Doubt>, Fault> {
        let (setup, base) = (self.setup, last.base.problem(self.setup)?);
        let train = Gap::of(&base, &last.fit.xi, &setup.train, false)?;
        let missing = Gap::of(&first.base.problem(setup)?, &first.fit.xi, &setup.train, false)?;
        let excess = |gap: &Gap| gap.left - 1.0;
        let share = if last.base.inserts.is_empty() { 0.0 } else { LEFT };
        let allowed = (ADEQUATE - 1.0).max(share * excess(&missing));
        // Where model error counts, it is what the best model leaves.
        if setup.disturbances.levels.is_empty() && excess(&train) > allowed {
            return Ok(Some(Doubt::new(format!("what is left is {:.2} times noise", train.all))));
        }
        if last.base.inserts.is_empty() {
            return Ok(None);
        }
        let is_alike = setup.disturbances.levels.iter().any(|level| !level.is_white());
        if let Some(share) = rule::imitates((missing.all, train.all), is_alike) {
            let words = format!("{:.0} % of what noise does not explain is left with it", 100.0 * share);
            return Ok(Some(Doubt::new(words)));
        }
        // A model that leaves more than noise, and only with numbers that cannot be, is not the machine.
        let is_held = |(unknown, xi): &(&Unknown, &f64)| unknown.effect.is_none() && unknown.is_at_limit(**xi);
        let held: Vec<&str> =
            base.unknowns.iter().zip(&last.fit.xi).filter(is_held).map(|(unknown, _)| &*unknown.name).collect();
        if !held.is_empty() && (last.fit.misfit > adequate(last.expected) || !setup.disturbances.levels.is_empty()) {
            let words = format!("{} would have to be {LIMIT} standard deviations off with it", held.join(" and "));
            return Ok(Some(Doubt::new(words)));
        }
        if setup.held_out.is_empty() {
            return Ok(Some(Doubt::new("no shot is held out on which a name could be proved")));
        }
        if !setup.has_several_operating_points() {
            let words = "all shots were made at one operating point, where wrong numbers and effects look alike";
            return Ok(Some(Doubt::new(words)));
        }
        // With the tolerance of time of the fits: what rises steeply may be met a little too late before and too early after.
        let (before, after) = (self.unseen(first)?, self.unseen(last)?);
        // An effect at the edge of what can be seen moves the sum of squares there by a few to either side.
        Ok((after > before + LEAD).then(|| {
            let by = (after / before).sqrt();
            let words = format!("the best effect makes the gap on shots held out larger, {by:.3} times");
            Doubt { words, is_refuted: true }
        }))
    }

    /// True if what a pass began with leaves nothing but noise, whatever is granted to times.
    fn is_noise(&self, pass: &Pass) -> Result<bool, Fault> {
        Ok(pass.fit.misfit <= noise(pass.expected) && self.doubt(pass, pass)?.is_none())
    }

    /// True if the shots held out show a gap of which the fitted ones hide the most: nuisances can be bent to fit some shots, but
    /// not all of them.
    pub(super) fn hides(&self, pass: &Pass) -> Result<bool, Fault> {
        if self.setup.held_out.is_empty() {
            return Ok(false);
        }
        let base = pass.base.problem(self.setup)?;
        let excess = |shots, refit| Gap::of(&base, &pass.fit.xi, shots, refit).map(|gap| gap.left - 1.0);
        Ok(rule::is_hidden(excess(&self.setup.held_out, true)?, excess(&self.setup.train, false)?))
    }
}

/// True if a plain term explains what the best effect leaves: the effect then only resembles what is missing.  What
/// each of them is expected to be does not count: one that is a term itself would lose against it by its prior.
pub(crate) fn is_beaten(pass: &Pass, fit: &Fit) -> bool {
    let Some((term, own)) = pass.terms.first().and_then(|term| Some((term, term.fit.as_ref()?))) else {
        return false;
    };
    let scale = (own.misfit / pass.expected).max(1.0);
    let count = pass.fit.xi.len();
    let without_prior = |fit: &Fit| fit.cost - fit.xi[count..].iter().map(|xi| xi * xi).sum::<f64>();
    let by = (without_prior(fit) - without_prior(own)) / scale;
    // Noise may be more than stated: a term that leaves next to nothing of what the effect leaves explains it, too.
    let is_all = own.misfit <= adequate(pass.expected)
        || own.misfit - pass.expected < NEXT_TO_NOTHING * (fit.misfit - pass.expected);
    term.has_size() && is_all && is_beaten_by(by, fit.misfit <= noise(pass.expected))
}

/// The status of an answer that names effects.
fn named(found: &[Candidate]) -> Status {
    let are_sensors = found.iter().all(|candidate| candidate.effect.kind == Kind::Sensor);
    if are_sensors { Status::Sensor } else { Status::Named }
}

/// What speaks against an answer.
struct Doubt {
    words: String,
    /// Shots that were not fitted say the opposite.
    is_refuted: bool,
}

impl Doubt {
    fn new(words: impl Into<String>) -> Self {
        Self { words: words.into(), is_refuted: false }
    }
}

/// True if the model that a pass began with leaves nothing but noise.
fn is_adequate(pass: &Pass) -> bool {
    pass.fit.misfit <= adequate(pass.expected)
}

/// What is said of an effect that explains something with the wrong sign only.
const OPPOSITE: &str = "the residuals are the opposite of what it does: its size would have to be negative";

/// Why a candidate was not named; nothing for one that could be.  `promising`: the promise from which on candidates are fitted.
fn verdict(tried: &Tried, standing: Option<&Standing>, (is_first, best): (bool, f64), promising: f64) -> String {
    let promise = tried.look.as_ref().map_or(0.0, Look::promise);
    // Only of an effect that cannot have the other sign.
    let is_opposite = tried.look.as_ref().is_some_and(|look| look.score.opposite >= PROMISING.0.max(look.promise()));
    let words = match standing {
        None if tried.fit.is_some() => IMPLAUSIBLE,
        None if tried.look.is_none() => "the model does not run with it",
        None if is_opposite && promise < PROMISING.0 => OPPOSITE,
        None if promise < PROMISING.0 => "its signature explains nothing of the residuals",
        None if tried.hypothesis.inserts.len() > MOST_EFFECTS => "three effects are named, and no more are looked for",
        None if promise < promising => {
            return format!(
                "it promises too little to be fitted: a drop of the cost by {promise:.1}, and {promising:.0} is needed"
            );
        }
        None => "others promised more, or no fit succeeded",
        Some(own) if own.is_nothing() && is_opposite => OPPOSITE,
        Some(own) if own.is_nothing() => "its size is zero within its standard error",
        Some(own) if own.needed.is_infinite() => "a single fitted shot does not tell it from a parameter that is off",
        Some(own) if own.cost_drop < own.needed => "it hardly reduces the cost",
        Some(own) if !own.has_size() => "its size is uncertain",
        Some(own) if !own.is_plausible => IMPLAUSIBLE,
        Some(own) if !is_first && best - own.cost_drop > LEAD => "another candidate explains more",
        Some(_) => "",
    };
    words.to_string()
}

/// No two attempts at a fit end near the lowest.
fn apart(record: &Record) -> bool {
    let mut ends: Vec<f64> = record.attempts.iter().map(|attempt| attempt.misfit).collect();
    ends.sort_unstable_by(f64::total_cmp);
    ends.dedup();
    ends.get(1).is_some_and(|second| second - ends[0] > APART * ends[0])
}

#[cfg(test)]
mod tests {
    use super::apart;
    use crate::fit::schedule::{Attempt, Record};

    #[test]
    fn one_attempt_that_ends_elsewhere_is_no_doubt() {
        let ended = |misfits: &[f64]| {
            let attempt =
                |&misfit: &f64| Attempt { start: String::new(), misfit, cost: 0.0, steps: 1, converged: true };
            Record { attempts: misfits.iter().map(attempt).collect() }
        };
        assert!(!apart(&ended(&[1.2])));
        assert!(apart(&ended(&[1.2, 1.9])));
        assert!(!apart(&ended(&[1.2, 3.4, 1.21])));
    }
}

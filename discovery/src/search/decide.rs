//! What follows from the fits: falls of the cost, sizes in errors, a name or none, and what speaks against it.

use super::{ADEQUATE, ERRORS, Findings, LEAD, NEEDED, PROMISING, Pass, Search, Status, Tried};
use crate::Fault;
use crate::Setup;
use crate::catalogue::{Candidate, Kind};
use crate::fit::Fit;
use crate::fit::schedule::Record;
use crate::hypothesis::{Hypothesis, Look};
use crate::problem::Problem;
use crate::proof::{Gap, gap, unseen};
use crate::unknowns::Meaning;

/// A size of fewer standard errors is none.
const NOTHING: f64 = 2.0;
/// How many times more a further effect takes where what is left is adequate.
const FURTHER: f64 = 3.0;
/// How many times more an effect takes for each shot in which it has a size of its own.
const OF_EACH_SHOT: f64 = 0.5;
/// Above this the fit without is taken for unfinished where nothing explains it and its attempts disagree.
const APART: f64 = 0.1;
/// Share of what was missing (in the excess of the mean square over that of noise) that a name may leave where samples are not granted
/// any tolerance of time: what rises steeply is met a little too early or too late by all models.
const LEFT: f64 = 0.15;
/// Shots held out show what the others hide when their mean square exceeds that of noise by so many times the excess of the fitted
/// ones, and that counts as no less than the second number.
const HIDDEN: (f64, f64) = (5.0, 0.1);
/// Standard deviations of the sum of squares of noise within which a misfit is that of noise.
const SPREAD: f64 = 3.0;

impl Search<'_> {
    /// Falls of the cost and sizes in standard errors; candidates that have a size come first, in the order of their cost.  One
    /// whose size ends within [`NOTHING`] errors of nothing is the fit without: it may lower the cost that others are held against.
    pub(super) fn judge(&self, pass: &mut Pass) {
        let mut without = pass.fit.cost;
        for tried in pass.tried.iter_mut().chain(&mut pass.terms) {
            let Some(fit) = &tried.fit else { continue };
            tried.errors = size_in_errors(&tried.hypothesis, self.setup, fit);
            tried.is_plausible = is_plausible(&tried.hypothesis, self.setup, fit);
            if tried.errors < NOTHING {
                without = without.min(fit.cost);
            }
        }
        for tried in pass.tried.iter_mut().chain(&mut pass.terms) {
            let Some(fit) = &tried.fit else { continue };
            tried.fall = (without - fit.cost) / (fit.misfit / pass.expected).max(1.0);
        }
        let key = |tried: &Tried| match &tried.fit {
            Some(fit) => (tried.errors < NOTHING, fit.cost),
            None => (true, f64::INFINITY),
        };
        for list in [&mut pass.tried, &mut pass.terms] {
            list.sort_by(|a, b| {
                let (a, b) = (key(a), key(b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            });
        }
        let best = pass.tried.first().map_or(0.0, |tried| tried.fall);
        let needed: Vec<f64> = pass.tried.iter().map(|tried| self.needed_for(pass, tried)).collect();
        for (k, (tried, needed)) in pass.tried.iter_mut().zip(needed).enumerate() {
            tried.verdict = verdict(tried, k == 0, best, needed);
        }
    }

    /// The fall that the next name needs.  Once an effect is named and what is left is adequate, the next one needs
    /// [`FURTHER`] times as much: what an effect does differently in truth is imitated by small amounts of others.
    /// An effect with a size of its own for each shot needs more by [`OF_EACH_SHOT`]: it imitates what scatters from shot to shot.
    fn needed_for(&self, pass: &Pass, tried: &Tried) -> f64 {
        let is_per_shot = tried.hypothesis.inserts.last().is_some_and(|insert| insert.effect.per_shot);
        let scatter = if is_per_shot { (OF_EACH_SHOT * self.setup.train.len() as f64).max(1.0) } else { 1.0 };
        let is_enough = !pass.base.inserts.is_empty() && pass.fit.misfit <= ADEQUATE * pass.expected;
        scatter * if is_enough { FURTHER * self.needed } else { self.needed }
    }

    pub(super) fn outcome(&self, pass: &Pass) -> Outcome {
        let ratio = pass.fit.misfit / pass.expected;
        let Some((best, fit)) = pass.tried.first().and_then(|tried| Some((tried, tried.fit.as_ref()?))) else {
            return if ratio <= ADEQUATE { Outcome::Nothing } else { Outcome::Unexplained };
        };
        if best.fall < self.needed_for(pass, best) || best.errors < ERRORS {
            return if ratio <= ADEQUATE { Outcome::Nothing } else { Outcome::Unexplained };
        }
        if self.is_beaten(pass, fit) {
            return Outcome::Unexplained;
        }
        let scale = (fit.misfit / pass.expected).max(1.0);
        let close: Vec<usize> = (0..pass.tried.len())
            .filter(|&k| {
                let own = pass.tried[k].fit.as_ref();
                own.is_some_and(|own| (own.cost - fit.cost) / scale < LEAD && pass.tried[k].errors >= ERRORS)
            })
            .filter(|&k| pass.tried[k].is_plausible)
            .collect();
        match close[..] {
            [] if ratio <= ADEQUATE && !pass.base.inserts.is_empty() => Outcome::Nothing,
            [] => Outcome::Unexplained,
            [k] => Outcome::Name(k),
            _ => Outcome::Several(close),
        }
    }

    /// True if a plain term explains what the best effect leaves: the effect then only resembles what is missing.
    fn is_beaten(&self, pass: &Pass, best: &Fit) -> bool {
        let Some((term, fit)) = pass.terms.first().and_then(|term| Some((term, term.fit.as_ref()?))) else {
            return false;
        };
        let scale = (fit.misfit / pass.expected).max(1.0);
        // One of many terms explains a little of any noise.
        let lead = if best.misfit > noise(pass.expected) { LEAD } else { NEEDED };
        term.errors >= ERRORS && fit.misfit / pass.expected <= ADEQUATE && (best.cost - fit.cost) / scale > lead
    }

    pub(super) fn conclude(&self, passes: Vec<Pass>, found: &[Candidate], outcome: Outcome) -> Result<Findings, Fault> {
        let runs = passes.iter().map(Pass::runs).sum();
        let (status, ambiguous) = (Status::Adequate, Vec::new());
        let mut findings = Findings {
            status,
            passes,
            ambiguous,
            reason: None,
            resembles: None,
            runs,
            seed: self.seed,
            needed: self.needed,
            hidden: false,
        };
        let (Some(first), Some(last)) = (findings.passes.first(), findings.passes.last()) else { return Ok(findings) };
        let doubt = self.doubt(first, last)?;
        let best = last.tried.first().and_then(|tried| tried.hypothesis.inserts.last().cloned());
        let (status, ambiguous) = match &outcome {
            Outcome::Nothing if doubt.is_some() => (Status::Unknown, Vec::new()),
            Outcome::Nothing if found.is_empty() => (Status::Adequate, Vec::new()),
            Outcome::Nothing if found.iter().all(|candidate| candidate.effect.kind == Kind::Sensor) => {
                (Status::Sensor, Vec::new())
            }
            Outcome::Nothing => (Status::Named, Vec::new()),
            Outcome::Several(close) => {
                let inserts = close.iter().filter_map(|&k| last.tried[k].hypothesis.inserts.last().cloned());
                (Status::Ambiguous, inserts.collect())
            }
            Outcome::Name(_) | Outcome::Unexplained => {
                let unfinished = found.is_empty() && apart(&last.record) && last.fit.misfit / last.expected < 1.5;
                (if unfinished { Status::Unconverged } else { Status::Unknown }, Vec::new())
            }
        };
        (findings.status, findings.ambiguous) = (status, ambiguous);
        findings.reason = if matches!(outcome, Outcome::Nothing) { doubt } else { None };
        findings.hidden = found.is_empty() && self.hides(first)?;
        if status == Status::Unknown {
            findings.resembles = found.last().cloned().or(best);
        }
        Ok(findings)
    }

    /// What speaks against the answer.  Under the true noise, without any tolerance of time, what is left must be noise; an effect
    /// must not make the gap on shots held out larger, and shots of one operating point cannot tell an effect from wrong numbers.
    fn doubt(&self, first: &Pass, last: &Pass) -> Result<Option<String>, Fault> {
        let (setup, base) = (self.setup, last.base.problem(self.setup)?);
        let train = gap(&base, &last.fit.xi, &setup.train, false)?;
        let missing = gap(&first.base.problem(setup)?, &first.fit.xi, &setup.train, false)?;
        let excess = |gap: &Gap| gap.all * gap.all - 1.0;
        let share = if last.base.inserts.is_empty() { 0.0 } else { LEFT };
        let allowed = (ADEQUATE - 1.0).max(share * excess(&missing));
        if excess(&train) > allowed {
            return Ok(Some(format!("what is left is {:.2} times noise", train.all)));
        }
        if last.base.inserts.is_empty() {
            return Ok(None);
        }
        if setup.held_out.is_empty() {
            return Ok(Some("no shot is held out on which a name could be proved".to_string()));
        }
        if !setup.has_several_operating_points() {
            let words = "all shots were made at one operating point, where wrong numbers and effects look alike";
            return Ok(Some(words.to_string()));
        }
        // With the tolerance of time of the fits: what rises steeply may be met a little too late before and too early after.
        let tau = setup.study.shots.time_tolerance;
        let misfit = |pass: &Pass| unseen(&pass.base.problem(setup)?, &pass.fit.xi, &setup.held_out, tau);
        let (before, after) = (misfit(first)?, misfit(last)?);
        // An effect at the edge of what can be seen moves the sum of squares there by a few to either side.
        Ok((after > before + LEAD).then(|| {
            let by = (after / before).sqrt();
            format!("the best effect makes the gap on shots held out larger, {by:.2} times")
        }))
    }

    /// True if the shots held out show a gap of which the fitted ones hide the most: nuisances can be bent to fit some shots, but
    /// not all of them.
    pub(super) fn hides(&self, pass: &Pass) -> Result<bool, Fault> {
        if self.setup.held_out.is_empty() {
            return Ok(false);
        }
        let base = pass.base.problem(self.setup)?;
        let excess = |shots, refit| gap(&base, &pass.fit.xi, shots, refit).map(|gap| gap.all * gap.all - 1.0);
        Ok(excess(&self.setup.held_out, true)? > HIDDEN.0 * excess(&self.setup.train, false)?.max(HIDDEN.1))
    }
}

/// The largest misfit that noise alone leaves where it is expected to leave `expected`.
pub(super) fn noise(expected: f64) -> f64 {
    expected + SPREAD * (2.0 * expected).sqrt()
}

/// Why a candidate was not named; nothing for one that could be.
fn verdict(tried: &Tried, first: bool, best: f64, needed: f64) -> String {
    let promise = tried.look.as_ref().map_or(0.0, Look::promise);
    match &tried.fit {
        None if tried.look.is_none() => "the model does not run with it".to_string(),
        None if promise < PROMISING.0 => "its signature explains nothing of what is left".to_string(),
        None => "others promised more, or no fit succeeded".to_string(),
        Some(_) if tried.errors < NOTHING => "its size is nothing within its error".to_string(),
        Some(_) if tried.fall < needed => "it brings the model hardly nearer to the measurement".to_string(),
        Some(_) if tried.errors < ERRORS => "its size is uncertain".to_string(),
        Some(_) if !tried.is_plausible => "its numbers are beyond what is plausible".to_string(),
        Some(_) if !first && best - tried.fall > LEAD => "another one explains more".to_string(),
        Some(_) => String::new(),
    }
}

/// What a pass says.
pub(super) enum Outcome {
    /// Nothing is missing any more.
    Nothing,
    /// This one.
    Name(usize),
    /// These explain it equally well.
    Several(Vec<usize>),
    /// Something is missing and nothing explains it.
    Unexplained,
}

/// No two attempts at a fit end near the lowest.
fn apart(record: &Record) -> bool {
    let mut ends: Vec<f64> = record.attempts.iter().map(|attempt| attempt.misfit).collect();
    ends.sort_unstable_by(f64::total_cmp);
    ends.dedup();
    ends.get(1).is_some_and(|second| second - ends[0] > APART * ends[0])
}

/// The size of the last effect in its standard errors, of all shots together where every shot has its own.  The effect's other
/// numbers are held: without a size they mean nothing, and sizes that trade against them may be uncertain where the effect is not.
/// Infinite for an effect that no size makes vanish: how well its size is known says nothing of whether it is there.
fn size_in_errors(hypothesis: &Hypothesis, setup: &Setup, fit: &Fit) -> f64 {
    let Ok(problem) = hypothesis.problem(setup) else { return 0.0 };
    let Some(Sizes { own, away, others }) = sizes(hypothesis, setup, &problem, fit) else { return f64::INFINITY };
    fit.errors_beside(&own, &away, &others).unwrap_or(0.0)
}

/// The unknowns of the last effect.
pub(super) struct Sizes {
    /// Those that carry its size in the fitted shots.
    pub(super) own: Vec<usize>,
    /// How far each of them is from nothing.
    pub(super) away: Vec<f64>,
    /// Its other numbers.
    others: Vec<usize>,
}

/// The unknowns of the last effect at the end of a fit; none if no size makes it vanish.
pub(super) fn sizes(hypothesis: &Hypothesis, setup: &Setup, problem: &Problem<'_>, fit: &Fit) -> Option<Sizes> {
    let last = hypothesis.last();
    let effect = hypothesis.inserts.last().filter(|_| hypothesis.term.is_none());
    let nothing = match effect {
        None => 0.0,
        Some(insert) => insert.effect.zero?,
    };
    let part_of = |k: &usize| problem.unknowns[*k].effect.filter(|part| Some(part.effect) == last);
    let all = |wanted: &dyn Fn(usize) -> bool| -> Vec<usize> {
        (0..problem.unknowns.len()).filter(|k| part_of(k).is_some_and(|part| wanted(part.parameter))).collect()
    };
    let (mut own, others) = (all(&|parameter| parameter == 0), all(&|parameter| parameter > 0));
    // Of shots that are not fitted nothing is known.
    own.retain(|&k| setup.train.iter().any(|&shot| problem.unknowns[k].touches(shot)));
    let away = |&k: &usize| match &problem.unknowns[k].meaning {
        Meaning::Value { prior, .. } => (prior.value(fit.xi[k]) - nothing) / prior.slope(fit.xi[k]),
        _ => 0.0,
    };
    let away = own.iter().map(away).collect();
    Some(Sizes { own, away, others })
}

/// False if a number of the last effect lies outside of what its library calls plausible by more than [`NOTHING`] standard errors: it only
/// resembles what is missing.  Sizes of single shots are not judged.
fn is_plausible(hypothesis: &Hypothesis, setup: &Setup, fit: &Fit) -> bool {
    let Some(insert) = hypothesis.inserts.last().filter(|_| hypothesis.term.is_none()) else { return true };
    let Ok(problem) = hypothesis.problem(setup) else { return true };
    problem.unknowns.iter().enumerate().all(|(k, unknown)| {
        let Meaning::Value { prior, .. } = &unknown.meaning else { return true };
        let part = unknown.effect.filter(|part| Some(part.effect) == hypothesis.last() && unknown.shot.is_none());
        let range = part.and_then(|part| Some((part, insert.effect.parameters.get(part.parameter)?.range?)));
        let Some((part, (low, high))) = range else { return true };
        let scale = if part.parameter == 0 { setup.scale(insert) } else { 1.0 };
        let value = prior.value(fit.xi[k]);
        let error = fit.standard_error(k).unwrap_or(0.0) * prior.slope(fit.xi[k]).abs();
        value + NOTHING * error >= low * scale && value - NOTHING * error <= high * scale
    })
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

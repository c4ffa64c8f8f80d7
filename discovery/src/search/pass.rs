//! What a search finds, pass by pass: candidates with their fits, what each has brought, and the answer.

use super::exact::Exact;
use super::rule;
use crate::catalogue::Candidate;
use crate::evidence::hypothesis::{Hypothesis, Look};
use crate::evidence::location::Located;
use crate::evidence::power::{Confusion, Power};
use crate::fit::Fit;
use crate::fit::schedule::Record;
use crate::terms::law::Law;

/// A rival is fitted again when its cost is above that of the best by less than this, or this part of the best's drop.
pub(super) const CLOSE: (f64, f64) = (60.0, 0.05);

/// What came out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Status {
    /// Nothing is missing.
    Adequate,
    /// One effect (or several, one after the other) of the machine.
    Named,
    /// Several effects explain it equally well.
    Ambiguous,
    /// A law of the machine that no library holds.
    Law,
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
            Status::Law => "law",
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
    /// The screening without a fit.
    pub look: Option<Look>,
    /// The fit.
    pub fit: Option<Fit>,
    /// Drop of the cost against the fit without, in units of the noise left.
    pub cost_drop: f64,
    /// Size in standard errors from nothing; none where it is not known.
    pub errors: Option<f64>,
    /// Its numbers are such as the library calls plausible.
    pub is_plausible: bool,
    /// Why it was not named, if there is a reason.
    pub verdict: String,
    /// It was named and taken out again, because the gap on shots held out is larger with it.
    pub is_refuted: bool,
}

impl Tried {
    /// Before any fit.
    pub(super) fn new(hypothesis: Hypothesis, look: Option<Look>) -> Self {
        Self {
            hypothesis,
            look,
            fit: None,
            cost_drop: 0.0,
            errors: None,
            is_plausible: true,
            verdict: String::new(),
            is_refuted: false,
        }
    }

    /// True if its size is known well enough for a name.
    pub fn has_size(&self) -> bool {
        rule::has_size(self.errors)
    }

    /// True if its size is none within its error: the model without it.
    pub(super) fn is_nothing(&self) -> bool {
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
    /// Drop of the cost that the effects named before have brought.
    pub explained: f64,
    /// What was tried for it.
    pub record: Record,
    /// Candidates, the best first.
    pub tried: Vec<Tried>,
    /// Terms of equations compared with what is left, the best first.
    pub located: Vec<Located>,
    /// The best of them, fitted; the best first.
    pub terms: Vec<Tried>,
    /// The pass was begun again because its base fell into a lower local minimum.
    pub is_again: bool,
    /// How well each effect that can join could be seen.
    pub powers: Vec<Power>,
    /// Effects that look alike.
    pub confusions: Vec<Confusion>,
}

impl Pass {
    /// Forgets the derivatives of what was tried: the search has gone on.
    pub(super) fn forget_derivatives(&mut self) {
        for tried in self.tried.iter_mut().chain(&mut self.terms) {
            if let Some(fit) = &mut tried.fit {
                fit.forget_derivatives();
            }
        }
    }
}

/// An effect that shots held out refuted.
#[derive(Clone)]
pub struct Refuted {
    /// The effect.
    pub candidate: Candidate,
    /// How many times as large the gap on shots held out is with it; below 1 where it explains too little of it.
    pub by: f64,
}

/// An effect that explains about as much in the place of a named one, beside all others, although it did not when that was named.
#[derive(Clone)]
pub struct Alike {
    /// The named one.
    pub named: Candidate,
    /// The other one.
    pub candidate: Candidate,
    /// By how much the cost is larger with it, in units of the noise left; negative where it is smaller.
    pub behind: f64,
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
    /// Where no effect was fitted: the drop of the cost that the likeliest one promises, and the promise from which on effects are fitted.
    pub unfitted: Option<(f64, f64)>,
    /// Runs of one shot that the whole search took.
    pub runs: usize,
    /// Seed of the random starts.
    pub seed: u64,
    /// Drop of the cost that a name needed.
    pub needed: f64,
    /// Nothing was named, and the shots held out show a gap that the fitted ones hide: others should be held out.
    pub hidden: bool,
    /// False if what the best model leaves still changed in the last round.
    pub is_settled: bool,
    /// What a further round named that was given up, because its models leave more.
    pub given_up: Option<String>,
    /// Effects that were named and taken out again.
    pub refuted: Vec<Refuted>,
    /// Effects that could stand in the place of named ones.
    pub alike: Vec<Alike>,
    /// The law that was found, for [`Status::Law`].
    pub law: Option<Law>,
    /// Why terms that explain what is left are not a law.
    pub no_law: Option<String>,
    /// Parameters taken as exact that would explain what is left, where nothing is named.
    pub exact: Vec<Exact>,
}

impl Findings {
    /// Number of effects that are named, whatever the status says of the rest.
    pub(super) fn named(&self) -> usize {
        let is_named = matches!(self.status, Status::Named | Status::Sensor);
        if is_named { self.passes.last().map_or(0, |last| last.base.inserts.len()) } else { 0 }
    }

    /// True if the last pass of these holds every effect of that of `other`, named or not.
    pub(super) fn has_found(&self, other: &Self) -> bool {
        let inserts = |own: &Self| own.passes.last().map(|last| last.base.inserts.clone()).unwrap_or_default();
        let known = inserts(self);
        let labels: Vec<String> = known.iter().map(Candidate::label).collect();
        inserts(other).iter().all(|insert| labels.contains(&insert.label()))
    }

    /// Takes over what the round before refuted, but what these name.
    pub(super) fn keep_refuted(&mut self, before: &[Refuted]) {
        let inserts = self.passes.last().map(|last| last.base.inserts.clone()).unwrap_or_default();
        let is_known = |all: &[Refuted], own: &Refuted| all.iter().any(|other| other.candidate.is_same(&own.candidate));
        for own in before {
            if !is_known(&self.refuted, own) && !inserts.iter().any(|named| named.is_same(&own.candidate)) {
                self.refuted.push(own.clone());
            }
        }
    }

    /// The word of the status.
    pub fn word(&self) -> &'static str {
        self.status.word()
    }
}

/// Positions of the candidates that were fitted, the lowest cost first.
pub(super) fn by_cost(tried: &[Tried]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..tried.len()).filter(|&k| tried[k].fit.is_some()).collect();
    let cost = |k: usize| tried[k].fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost);
    order.sort_by(|&a, &b| cost(a).total_cmp(&cost(b)));
    order
}

/// Of the candidates that were fitted, the best first, those that explain about as much as the one at `best`, and more
/// than chance would.
pub(super) fn contested(pass: &Pass, best: usize, needed: f64) -> Vec<usize> {
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

//! A model with effects in it, translated and ready to be fitted; and the first look at an effect without a fit.
//!
//! The unknowns of a model with one more effect are those of the model before, then those of the effect, so that a fit can go on
//! where another one ended.

use nalgebra::DVector;

use crate::catalogue::Candidate;
use crate::evidence::projection::{Projection, Score};
use crate::fit::{Effort, Fit, Jacobian};
use crate::machine::Machine;
use crate::problem::{Problem, Weighing};
use crate::terms::dictionary::Term;
use crate::unknowns::prior::Prior;
use crate::unknowns::{EffectPart, LIMIT, Meaning, Unknown};
use crate::variant::{Insert, Workshop, coefficient};
use crate::{Fault, Setup};

/// Sizes, as multiples of the typical one, at which an effect is looked at: one that grows from nothing, and one that does not.
const SIZES: (&[f64], &[f64]) = (&[1.0, 0.3, 2.0], &[1.0, 0.3, 0.5, 0.75, 1.5, 2.0]);
const SIZES_BESIDE_WAVES: &[f64] = &[1.0];
/// The smallest of the first ones, and further sizes below it, each a quarter of the one before.
const SMALLEST: f64 = 0.3;
const SMALLER: &[f64] = &[0.075, 0.01875, 0.004_687_5, 0.001_171_875, 0.000_292_968_75];
/// A size that explains less than this part of what is left is not the one.
const WORTHWHILE: f64 = 0.3;
/// Where nothing but noise is left an effect that explains less than this at its typical size is not looked at at others.
const HINT: f64 = 3.0;
/// An effect with a course of its own whose signature is so many times all that is left is too large at any size.
const FAR_TOO_LARGE: f64 = 100.0;
/// Amplitudes, as multiples of the size looked at, that a score may claim.
const AMPLITUDES: (f64, f64) = (0.0, 3.0);

/// A model with effects in it.
pub struct Hypothesis {
    /// The effects.
    pub inserts: Vec<Candidate>,
    /// Terms at equations, with the spreads of their coefficients before the measurement.
    pub terms: Vec<(Term, f64)>,
    /// The translated model.
    pub machine: Machine,
}

/// An effect compared with the residuals of a fit without it.
#[derive(Clone, Debug)]
pub struct Look {
    /// The score at the best size.
    pub score: Score,
    /// That size.
    pub size: f64,
    /// Unknowns of the effect at the size that the score claims.
    pub start: Vec<f64>,
    /// Largest drop of the sum of squares at any size with the nuisances held where they are.
    pub alone: f64,
    /// Score and signature at the typical size.
    pub typical: Option<(f64, Score, DVector<f64>)>,
    /// Drop of the cost that a few steps of a fit brought, and where they ended.
    pub probed: Option<(f64, Vec<f64>)>,
}

impl Look {
    /// The drop of the cost that may be expected.
    pub fn promise(&self) -> f64 {
        self.probed.as_ref().map_or(self.score.gain, |(cost_drop, _)| cost_drop.max(self.score.gain))
    }
}

impl Hypothesis {
    /// Translates the base model with these effects.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn new(setup: &Setup, workshop: &Workshop<'_>, inserts: Vec<Candidate>) -> Result<Self, Fault> {
        let texts = inserts.iter().map(|candidate| Insert { candidate: candidate.clone(), values: Vec::new() });
        let model = workshop.translate(&texts.collect::<Vec<_>>())?;
        Ok(Self { inserts, terms: Vec::new(), machine: setup.machine(model)? })
    }

    /// Translates the base model with these effects and terms, whose coefficients are expected within their spreads.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn with_terms(
        setup: &Setup,
        workshop: &Workshop<'_>,
        inserts: Vec<Candidate>,
        terms: Vec<(Term, f64)>,
    ) -> Result<Self, Fault> {
        let texts = inserts.iter().map(|candidate| Insert { candidate: candidate.clone(), values: Vec::new() });
        let added: Vec<Term> = terms.iter().map(|(term, _)| term.clone()).collect();
        let model = workshop.translate_with_terms(&texts.collect::<Vec<_>>(), &added)?;
        Ok(Self { inserts, terms, machine: setup.machine(model)? })
    }

    /// The comparison with the set.
    ///
    /// # Errors
    /// When a parameter that the study names is not there.
    pub fn problem<'a>(&'a self, setup: &'a Setup) -> Result<Problem<'a>, Fault> {
        self.problem_of(setup, &self.machine)
    }

    /// The same with another translation, which has further terms behind those of this one.
    ///
    /// # Errors
    /// When a parameter that the study names is not there.
    pub(crate) fn problem_of<'a>(&self, setup: &'a Setup, machine: &'a Machine) -> Result<Problem<'a>, Fault> {
        let mut problem = setup.problem(machine, &self.inserts)?;
        for (k, (term, spread)) in self.terms.iter().enumerate() {
            let (place, nominal) = machine.parameter(&coefficient(k))?;
            let places = vec![problem.places.len()];
            problem.places.push(place);
            problem.base.iter_mut().for_each(|values| values.push(nominal));
            problem.unknowns.push(Unknown::new(
                format!("{} of `{}`", term.shape, term.equation),
                Meaning::Value { places, prior: Prior::Normal(0.0, *spread) },
                None,
                Some(EffectPart { effect: self.inserts.len() + k, parameter: 0 }),
            ));
        }
        Ok(problem)
    }

    /// Gives a fit of this model a Jacobian at its own unknowns.
    ///
    /// # Errors
    /// A run that failed.
    pub(crate) fn refresh(&self, setup: &Setup, fit: &mut Fit, weighing: &Weighing) -> Result<(), Fault> {
        if fit.fresh {
            return Ok(());
        }
        let problem = self.problem(setup)?;
        let all: Vec<usize> = (0..problem.unknowns.len()).collect();
        let jacobian = problem.jacobian((&fit.xi, &fit.runs), weighing, &all, Effort::FULL.difference)?;
        (fit.jacobian, fit.fresh) = (Some(Jacobian::new(jacobian, all)), true);
        Ok(())
    }

    /// Number of the last thing put in: among the effects, then the terms.
    pub fn last(&self) -> Option<usize> {
        (self.inserts.len() + self.terms.len()).checked_sub(1)
    }

    /// Id of the effect that was put in last; none for a term.
    pub fn own_id(&self) -> Option<&str> {
        let last = self.inserts.last().filter(|_| self.terms.is_empty());
        last.map(|candidate| &*candidate.effect.id)
    }

    /// Name of what was put in last.
    pub fn own_label(&self) -> String {
        match self.terms.last() {
            Some((term, _)) => format!("{} in `{}`", term.shape, term.equation),
            None => self.inserts.last().map_or(String::new(), Candidate::label),
        }
    }

    /// Names of the effects, for progress and reports.
    pub fn label(&self) -> String {
        let mut parts: Vec<String> = self.inserts.iter().map(Candidate::label).collect();
        parts.extend(self.terms.iter().map(|(term, _)| format!("{} in `{}`", term.shape, term.equation)));
        if parts.is_empty() { "the base model".to_string() } else { parts.join(" + ") }
    }

    /// What tells it from all others of one search, the same wherever the search is made from.
    pub fn key(&self) -> String {
        let mut parts: Vec<String> = self.inserts.iter().map(Candidate::key).collect();
        let file = |term: &Term| term.file.rsplit(['/', '\\']).next().unwrap_or_default().to_string();
        let term = |term: &Term| format!("{} in {} ({}:{})", term.shape, term.component, file(term), term.line);
        parts.extend(self.terms.iter().map(|(own, _)| term(own)));
        parts.join(" + ")
    }

    /// True if the effect put in last is this one.
    pub fn ends_with(&self, candidate: &Candidate) -> bool {
        self.terms.is_empty() && self.inserts.last().is_some_and(|own| own.is_same(candidate))
    }

    /// Unknowns of the last effect at a size (all other parameters as expected), appended to those of the fit before.
    pub fn at_size(&self, problem: &Problem<'_>, before: &[f64], size: f64) -> Vec<f64> {
        let mut xi = before.to_vec();
        let last = self.last();
        for unknown in &problem.unknowns[before.len()..] {
            let carries = unknown.effect.is_some_and(|part| Some(part.effect) == last && part.parameter == 0);
            xi.push(match &unknown.meaning {
                Meaning::Value { prior, .. } if carries => unknown.within(prior.xi(size, LIMIT - 1.0)),
                _ => unknown.within(0.0),
            });
        }
        xi
    }

    /// Sets the size of the last effect in one shot, where every shot has its own.
    fn set_size_of_shot(&self, problem: &Problem<'_>, xi: &mut [f64], shot: usize, size: f64) {
        let last = self.last();
        for (unknown, xi) in problem.unknowns.iter().zip(xi).filter(|(unknown, _)| unknown.shot == Some(shot)) {
            let carries = unknown.effect.is_some_and(|part| Some(part.effect) == last && part.parameter == 0);
            if let Meaning::Value { prior, .. } = &unknown.meaning
                && carries
            {
                *xi = unknown.within(prior.xi(size, LIMIT - 1.0));
            }
        }
    }

    /// Holds the last effect against the residuals of the fit `before`, at several sizes and without a fit.  None where no size
    /// can be run.  `is_quiet`: the fit leaves nothing but noise.
    ///
    /// # Errors
    /// When a parameter that the study names is not there.
    pub fn look(
        &self,
        setup: &Setup,
        before: &Fit,
        projection: &Projection<'_>,
        (weighing, is_quiet): (&Weighing, bool),
    ) -> Result<Option<Look>, Fault> {
        let Some(insert) = self.inserts.last() else { return Ok(None) };
        let problem = self.problem(setup)?;
        let typical = insert.effect.probe * setup.scale(insert);
        let mut best: Option<Look> = None;
        let mut usual = None;
        let left = before.residuals.norm_squared();
        let mut alone = 0.0_f64;
        let sizes = match (insert.effect.zero.is_some(), self.inserts.len() > 1 && !self.machine.is_fast()) {
            // Runs of models with delays are long.
            (_, true) => SIZES_BESIDE_WAVES,
            (true, false) => SIZES.0,
            (false, false) => SIZES.1,
        };
        let ends_at_nothing = insert.effect.zero.is_some() && self.machine.is_fast();
        let mut power = 0.0;
        for (place, multiple) in sizes.iter().chain(SMALLER).copied().enumerate() {
            // What an effect does is in proportion to its size where that is small.  Where it does more than all that is left at every
            // size so far, and none explains much of it, smaller ones tell.
            let explains = best.as_ref().map_or(0.0, |best| best.score.gain);
            let is_too_large = power > left && explains < WORTHWHILE * left;
            if place >= sizes.len() && !(ends_at_nothing && is_too_large) {
                break;
            }
            let size = multiple * typical;
            let xi = self.at_size(&problem, &before.xi, size);
            let Ok(runs) = problem.simulate(&xi, weighing) else {
                if multiple <= SMALLEST {
                    power = f64::INFINITY;
                }
                continue;
            };
            let signature = problem.residuals(&xi, &runs, weighing) - &before.residuals;
            // An effect whose size may be negative shows so.
            let two_sided = insert.effect.parameters[0].prior.value(-3.0) < 0.0;
            let ends = if two_sided { (-AMPLITUDES.1, AMPLITUDES.1) } else { AMPLITUDES };
            let (score, amplitudes) = if insert.effect.per_shot {
                projection.score_in_parts(&signature, &problem.parts(weighing), ends)
            } else {
                (projection.score(&signature, ends), Vec::new())
            };
            alone = alone.max(score.alone);
            if multiple <= SMALLEST {
                power = score.power;
            }
            if best.as_ref().is_none_or(|best| score.gain > best.score.gain) {
                let claimed = |amplitude: f64| size * if amplitude == 0.0 { 1.0 } else { amplitude };
                let mut start = self.at_size(&problem, &before.xi, claimed(score.amplitude));
                for (&shot, &amplitude) in weighing.shots.iter().zip(&amplitudes) {
                    self.set_size_of_shot(&problem, &mut start, shot, size * amplitude);
                }
                let start = start[before.xi.len()..].to_vec();
                best = Some(Look { score, size, start, alone, typical: None, probed: None });
            }
            if multiple == 1.0 {
                usual = Some((size, score, signature));
                let too_large = insert.effect.zero.is_none() && score.power > FAR_TOO_LARGE * before.misfit;
                if too_large || is_quiet && score.gain < HINT {
                    break;
                }
            }
        }
        Ok(best.map(|best| Look { typical: usual, alone, ..best }))
    }
}

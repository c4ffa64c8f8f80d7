//! A law with memory, where no terms of one equation explain what is missing.
//!
//! The forms that promise most ([`screen`]) are written as text and fitted with all their numbers.  Such a law needs what a law of terms
//! needs: what is left is noise, the coefficient and the first of the form's numbers are four standard errors from nothing, the cost falls by
//! what a name needs and by the price of the choice, twice the logarithm of how many there were, and neither an effect nor another
//! equation nor another form explains as much.

mod screen;

use hyd_system::math;
use nalgebra::DVector;

use super::context::Search;
use super::laws::{self, Grown, NoLaw};
use super::pass::Pass;
use super::shortlist::Lowest;
use crate::catalogue::Site;
use crate::dynamics::Dynamics;
use crate::fault::Fault;
use crate::fit::Fit;
use crate::hypothesis::{Hypothesis, Look};
use crate::law::{Law, LawTerm, Parts, RIVALS, Rival};
use crate::prior::Prior;
use crate::thresholds::{ERRORS, LEAD, adequate};
use screen::{Screened, likeliest};

/// Laws of one equation whose additions differ by less, but for terms without memory, are the same.
const KIN: f64 = 0.1;
/// Spread of a coefficient before the measurement, by what its screening claims, and of the logarithms of the form's numbers.
const SPREAD: (f64, f64) = (5.0, 1.0);

/// A form with memory that was fitted.
struct Lasting {
    screened: Screened,
    law: Law,
    grown: Grown,
}

impl Lasting {
    /// Unknowns of the fit before those of the law: its coefficient, then the numbers of its form.
    fn first(&self) -> usize {
        self.grown.fit.xi.len() - 1 - self.screened.dynamics.numbers.len()
    }

    /// The form with the numbers that were fitted.
    fn fitted(&self) -> Dynamics {
        let dynamics = &self.screened.dynamics;
        let (priors, xi) = (priors(dynamics), &self.grown.fit.xi[self.first() + 1..]);
        let numbers = priors.iter().zip(xi).map(|(own, &xi)| own.value(xi));
        Dynamics { numbers: numbers.collect(), ..dynamics.clone() }
    }
}

impl Search<'_> {
    /// The law with memory that explains what a pass leaves.
    pub(super) fn law_with_memory(
        &self,
        last: &Pass,
        declared: &[&Site],
    ) -> Result<Result<(Law, Grown), NoLaw>, Fault> {
        if last.fit.misfit <= adequate(last.expected) || !last.base.machine.is_fast() {
            return Ok(Err(NoLaw::Nothing));
        }
        (self.progress)("screening forms with memory");
        let mut fit = last.seen.as_ref().unwrap_or(&last.fit).clone();
        last.base.refresh(self.setup, &mut fit, &self.whole())?;
        let (screened, count) = self.screen(last, &fit, declared)?;
        let needed = self.needed + 2.0 * math::ln(count.max(1) as f64);
        let mut fitted: Vec<Lasting> = Vec::new();
        for own in likeliest(screened, needed) {
            fitted.extend(self.fit_memory(last, &fit, own, (declared, needed))?);
        }
        fitted.sort_by(|a, b| a.grown.fit.cost.total_cmp(&b.grown.fit.cost));
        let Some(best) = fitted.iter().position(|own| self.is_known(last, own)) else {
            return Ok(Err(NoLaw::Nothing));
        };
        let scale = (fitted[best].grown.fit.misfit / last.expected).max(1.0);
        let lead = |fit: &Fit| (fit.cost - fitted[best].grown.fit.cost) / scale;
        let others = fitted.iter().enumerate().filter(|(k, own)| *k != best && !self.is_kin(own, &fitted[best]));
        let others = others.map(|(_, own)| Rival {
            equation: own.screened.term.equation.clone(),
            shape: own.fitted().words(),
            behind: lead(&own.grown.fit),
        });
        let terms = last.terms.iter().filter_map(|tried| {
            let (term, _) = tried.hypothesis.terms.first()?;
            Some(Rival {
                equation: term.equation.clone(),
                shape: term.shape.clone(),
                behind: lead(tried.fit.as_ref()?),
            })
        });
        let mut rivals: Vec<Rival> = others.chain(terms).chain(laws::effects(last, &lead)).collect();
        rivals.sort_by(|a, b| a.behind.total_cmp(&b.behind));
        let own = fitted.swap_remove(best);
        if let Some(rival) = rivals.iter().find(|rival| rival.behind < LEAD) {
            let equation = own.screened.term.equation.trim_end_matches(';');
            let words = format!(
                "{} in `{equation}` would be one, and {} explains it as well",
                own.fitted().words(),
                rival.said()
            );
            return Ok(Err(NoLaw::Ever(words)));
        }
        rivals.truncate(RIVALS);
        Ok(match self.with_numbers(&own, declared)? {
            Some(law) => Ok((Law { rivals, ..law }, own.grown)),
            None => Err(NoLaw::Because("its equation cannot be written as a class of its own".to_string())),
        })
    }

    /// A form written as text and fitted with all its numbers.
    fn fit_memory(
        &self,
        last: &Pass,
        base: &Fit,
        screened: Screened,
        (declared, needed): (&[&Site], f64),
    ) -> Result<Option<Lasting>, Fault> {
        let Screened { term, dynamics, score, .. } = &screened;
        (self.progress)(&format!("fitting {} in `{}`", dynamics.words(), term.equation.trim_end_matches(';')));
        let own = LawTerm {
            term: term.clone(),
            value: score.amplitude,
            error: f64::NAN,
            spread: SPREAD.0 * score.amplitude.abs(),
        };
        let parts = Parts { terms: vec![own], memory: Some((dynamics, priors(dynamics))) };
        let Some(law) = self.as_law(declared, parts)? else { return Ok(None) };
        let inserts = last.base.inserts.iter().cloned().chain([law.candidate.clone()]).collect();
        let made = law.known_to(self.workshop, |workshop| Hypothesis::new(self.setup, workshop, inserts));
        let Ok(hypothesis) = made else { return Ok(None) };
        let start = hypothesis.at_size(&hypothesis.problem(self.setup)?, &base.xi, score.amplitude);
        let start = start[base.xi.len()..].to_vec();
        let (score, size) = (*score, score.amplitude);
        let look = Look { score, size, start, alone: score.alone, typical: None, probed: None };
        let lowest = Lowest::of([&last.fit], last.expected);
        let Some(mut fit) = self.fit_from_sizes(&hypothesis, base, &look, &[0.5 * size, 1.5 * size], lowest)? else {
            return Ok(None);
        };
        hypothesis.refresh(self.setup, &mut fit, &self.whole())?;
        Ok(Some(Lasting { screened, law, grown: Grown { hypothesis, fit, needed } }))
    }

    /// What is left is noise, and coefficient and memory are known.
    fn is_known(&self, last: &Pass, own: &Lasting) -> bool {
        let (fit, first) = (&own.grown.fit, own.first());
        let error = |k: usize| fit.standard_error(k).unwrap_or(f64::INFINITY);
        let is_size = fit.xi[first].abs() >= ERRORS * error(first);
        // The unknown of a number is its logarithm.
        let is_memory = ERRORS * SPREAD.1 * error(first + 1) <= 1.0;
        let drop = (last.fit.cost - fit.cost) / (fit.misfit / last.expected).max(1.0);
        fit.misfit <= adequate(last.expected) && drop >= own.grown.needed && is_size && is_memory
    }

    /// True if two laws are told apart by terms without memory only, as a spring and damper in series are one law by its force and by its way:
    /// what one adds is that of the other but for a part of the variables themselves.
    fn is_kin(&self, one: &Lasting, other: &Lasting) -> bool {
        let (a, b) = (&one.screened, &other.screened);
        if a.alike != b.alike {
            return false;
        }
        let course = |own: &Lasting| -> Vec<f64> {
            let form = own.fitted();
            let shots = self.setup.train.iter().zip(&*own.screened.variable);
            shots.flat_map(|(&shot, variable)| form.course(&self.setup.data.shots[shot].span, variable)).collect()
        };
        let rows = a.variable.iter().map(Vec::len).sum::<usize>();
        let (wanted, own) = (DVector::from_vec(course(one)), DVector::from_vec(course(other)));
        let plain = [DVector::from_vec(a.variable.concat()), DVector::from_vec(b.variable.concat())];
        if wanted.len() != rows || plain.iter().any(|plain| plain.len() != rows) || own.len() != rows {
            return false;
        }
        let constant = DVector::from_element(rows, 1.0);
        let left = |wanted: &DVector<f64>, by: &[&DVector<f64>]| -> f64 {
            let mut basis: Vec<DVector<f64>> = Vec::new();
            let without = |vector: &DVector<f64>, basis: &[DVector<f64>]| {
                basis.iter().fold(vector.clone(), |vector, own| &vector - own * own.dot(&vector))
            };
            for &vector in by {
                let rest = without(vector, &basis);
                if rest.norm() > 1e-6 * vector.norm() {
                    basis.push(rest.normalize());
                }
            }
            without(wanted, &basis).norm()
        };
        let alone = left(&wanted, &[&constant, &plain[0], &plain[1]]);
        left(&wanted, &[&constant, &plain[0], &plain[1], &own]) < KIN * alone
    }

    /// The law with the numbers that were fitted in its text.
    fn with_numbers(&self, own: &Lasting, declared: &[&Site]) -> Result<Option<Law>, Fault> {
        let (fit, first) = (&own.grown.fit, own.first());
        let Some(term) = own.law.terms.first() else { return Ok(None) };
        let value = term.spread * fit.xi[first];
        let error = fit.standard_error(first).map_or(f64::NAN, |error| error * term.spread);
        let term = LawTerm { term: own.screened.term.clone(), value, error, spread: term.spread };
        // What was expected of the numbers stays, so that the fit does.
        let memory = Some((&own.fitted(), priors(&own.screened.dynamics)));
        self.as_law(declared, Parts { terms: vec![term], memory })
    }
}

/// What is expected of the numbers of a form that was screened.
fn priors(dynamics: &Dynamics) -> Vec<Prior> {
    dynamics.numbers.iter().map(|&number| Prior::Lognormal(number, SPREAD.1)).collect()
}

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
use crate::evidence::hypothesis::{Hypothesis, Look};
use crate::evidence::thresholds::{ERRORS, LEAD, adequate};
use crate::fault::Fault;
use crate::fit::Fit;
use crate::terms::dynamics::Dynamics;
use crate::terms::law::{Law, LawTerm, Parts, RIVALS, Rival};
use crate::unknowns::prior::Prior;
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
        let role = format!("memory of {}", law.equation());
        let task = || self.task(&role, &hypothesis, &[&look.start, &[size]]).with(base);
        let make = || self.fit_from_sizes(&hypothesis, base, &look, &[0.5 * size, 1.5 * size], lowest);
        let Some(mut fit) = self.one(task, make)? else { return Ok(None) };
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

    /// True if two laws are of one equation and what they add is [`told_apart_by_terms`] only.
    fn is_kin(&self, one: &Lasting, other: &Lasting) -> bool {
        let course = |own: &Lasting| -> Vec<f64> {
            let form = own.fitted();
            let shots = self.setup.train.iter().zip(&*own.screened.variable);
            shots.flat_map(|(&shot, variable)| form.course(&self.setup.data.shots[shot].span, variable)).collect()
        };
        let seen = |own: &Lasting| (course(own), own.screened.variable.concat());
        one.screened.alike == other.screened.alike && told_apart_by_terms(seen(one), seen(other))
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

/// True if what one law adds is that of the other but for a factor and a part of the variables themselves, as a spring and damper in series
/// are one law by their force and by their way.  Of each what it adds and its variable, at the same points.
fn told_apart_by_terms((one, along): (Vec<f64>, Vec<f64>), (other, beside): (Vec<f64>, Vec<f64>)) -> bool {
    let rows = one.len();
    if [&along, &other, &beside].iter().any(|own| own.len() != rows) {
        return false;
    }
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let without = |vector: DVector<f64>, basis: &[DVector<f64>]| {
        basis.iter().fold(vector, |vector, own| &vector - own * own.dot(&vector))
    };
    let mut span = |vector: DVector<f64>| {
        let size = vector.norm();
        let rest = without(vector, &basis);
        if rest.norm() > 1e-6 * size {
            basis.push(rest.normalize());
        }
        basis.clone()
    };
    span(DVector::from_element(rows, 1.0));
    span(DVector::from_vec(along));
    let terms = span(DVector::from_vec(beside));
    let all = span(DVector::from_vec(other));
    let left = |basis: &[DVector<f64>]| without(DVector::from_column_slice(&one), basis).norm();
    left(&all) < KIN * left(&terms)
}

/// What is expected of the numbers of a form that was screened.
fn priors(dynamics: &Dynamics) -> Vec<Prior> {
    dynamics.numbers.iter().map(|&number| Prior::Lognormal(number, SPREAD.1)).collect()
}

#[cfg(test)]
mod tests {
    use super::told_apart_by_terms;
    use crate::machine::span::Span;
    use crate::terms::dynamics::{Dynamics, Form};

    #[test]
    fn a_spring_and_damper_in_series_is_one_law() {
        let span = Span { start: 0.0, stop: 4.0, intervals: 800 };
        let times: Vec<f64> = (0..=800).map(|k| 5e-3 * f64::from(k)).collect();
        let way: Vec<f64> = times.iter().map(|t| (6.0 * t).cos() * (-0.2 * t).exp()).collect();
        let speed: Vec<f64> =
            times.iter().map(|t| -(6.0 * (6.0 * t).sin() + 0.2 * (6.0 * t).cos()) * (-0.2 * t).exp()).collect();
        let of = |form: Form, number: f64, variable: &[f64]| {
            let own = Dynamics { form, driver: "u".into(), unit: String::new(), numbers: vec![number] };
            (own.course(&span, variable), variable.to_vec())
        };
        // The lag of the speed is the relaxation of the way, and a lag is a relaxation but for the variable itself.
        let lag = || of(Form::Lag, 0.15, &speed);
        assert!(told_apart_by_terms(lag(), of(Form::Relaxation, 0.15, &way)));
        assert!(told_apart_by_terms(lag(), of(Form::Relaxation, 0.15, &speed)));
        // Hysteresis is something else, and other points cannot be compared.
        assert!(!told_apart_by_terms(lag(), of(Form::Hysteresis, 0.1, &speed)));
        assert!(!told_apart_by_terms(lag(), (vec![0.0; 3], vec![0.0; 3])));
    }
}

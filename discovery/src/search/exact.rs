//! Where no effect is named: parameters that the study takes as exact, and that would explain what is missing if they were not.
//!
//! A number that is wrong by a half looks like an effect that no library has: a connection that the model has too strong cannot be mended by one more.
//! Every parameter of the model that the study neither fits nor sets is changed a little, its signature scored beside the nuisances
//! ([`crate::evidence::projection`]), and the likeliest are fitted.  They get no name: a study that trusts a number is believed until the user looks at it.

use hyd_system::{Settable, ValueKind};

use super::context::Search;
use super::pass::{Findings, Status};
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::projection::Projection;
use crate::evidence::proof::Gap;
use crate::fault::Fault;
use crate::fit::{Effort, Fit, Jacobian, minimise};
use crate::machine::{Machine, ParameterPlace};
use crate::problem::Problem;
use crate::unknowns::limits::limit;
use crate::unknowns::prior::Prior;
use crate::unknowns::{EffectPart, LIMIT, Meaning, Unknown};

/// How far a parameter is moved for its signature, in its logarithm.
const STEP: f64 = 0.02;
/// Parameters that are fitted, and those that are reported.
const MOST: (usize, usize) = (4, 3);
/// Beyond so many parameters nothing is tried: each takes a run of every shot.
const MANY: usize = 300;
/// Share of what noise does not explain that has to go.
const ENOUGH: f64 = 0.5;

/// A parameter that would explain what is missing.
#[derive(Clone, PartialEq, Debug)]
pub struct Exact {
    /// Its name.
    pub parameter: String,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// What it is in the model.
    pub stated: f64,
    /// What it would have to be.
    pub value: f64,
    /// Gap of the fitted shots without and with that, as the report has it.
    pub gap: [f64; 2],
}

impl Search<'_> {
    /// The parameters of the model without any effect that would explain what it leaves, the best first; none where the answer is a name or that
    /// nothing is missing.
    ///
    /// # Errors
    /// A model without derivatives.
    pub(super) fn exact(&self, findings: &mut Findings) -> Result<Vec<Exact>, Fault> {
        let is_open = matches!(findings.status, Status::Unknown | Status::Law | Status::Ambiguous);
        let Some(first) = findings.passes.first_mut().filter(|_| is_open) else { return Ok(Vec::new()) };
        if !first.base.inserts.is_empty() || !first.base.machine.is_fast() {
            return Ok(Vec::new());
        }
        let whole = self.whole();
        first.base.refresh(self.setup, &mut first.fit, &whole)?;
        let fit = &first.fit;
        // What a machine is told stays with it, so that this one is none of the search.
        let own = Hypothesis::new(self.setup, self.workshop, Vec::new())?;
        let free = parameters(&own.machine, &own.problem(self.setup)?.places);
        let (Some(projection), Some(Jacobian { matrix, .. })) = (Projection::new(fit), &fit.jacobian) else {
            return Ok(Vec::new());
        };
        if free.len() > MANY {
            return Ok(Vec::new());
        }
        (self.progress)("screening parameters that the study takes as exact");
        let mut scored: Vec<(f64, f64, usize)> = Vec::new();
        for k in 0..free.len() {
            let problem = freed(own.problem(self.setup)?, &free, k);
            let step = match problem.unknowns.last() {
                Some(unknown) if unknown.bounds.1 >= STEP => STEP,
                Some(unknown) if unknown.bounds.0 <= -STEP => -STEP,
                _ => continue,
            };
            let Ok(moved) = Fit::at(&problem, &[&fit.xi[..], &[step]].concat(), &whole) else { continue };
            if moved.residuals.len() != fit.residuals.len() {
                continue;
            }
            let signature = &moved.residuals - &fit.residuals;
            let score = projection.score(&signature, (-LIMIT / STEP, LIMIT / STEP));
            if score.gain >= self.needed {
                scored.push((score.gain, step * score.amplitude, k));
            }
        }
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        let before = Gap::of(&first.base.problem(self.setup)?, &fit.xi, &self.setup.train, false)?;
        let mut found = Vec::new();
        for (_, start, k) in scored.into_iter().take(MOST.0) {
            let (place, stated) = &free[k];
            let problem = freed(own.problem(self.setup)?, &free, k);
            // What a straight line promises may be far beyond what the parameter can be.
            let starts = [start, 0.5 * start, STEP * start.signum()];
            let fits = starts.iter().filter_map(|&start| {
                let from = [&fit.xi[..], &[start]].concat();
                minimise(&problem, &from, &whole, Effort::FULL, Some((matrix, &whole))).ok()
            });
            let Some(best) = fits.min_by(|a, b| a.cost.total_cmp(&b.cost)) else { continue };
            let explained = (fit.misfit - best.misfit) / (fit.misfit - first.expected).max(f64::MIN_POSITIVE);
            if fit.cost - best.cost >= self.needed && explained >= ENOUGH {
                let unit = own.machine.unit(place).to_string();
                let value = problem.unknowns.last().zip(best.xi.last()).map_or(*stated, |(own, &xi)| own.value(xi));
                let Ok(after) = Gap::of(&problem, &best.xi, &self.setup.train, false) else { continue };
                let gap = [before.all, after.all];
                let parameter = place.name().to_string();
                found.push((best.cost, Exact { parameter, unit, stated: *stated, value, gap }));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(found.into_iter().take(MOST.1).map(|(_, own)| own).collect())
    }
}

/// Real parameters that can be set, have a value that is not 0, and are set by nobody; with their values.
fn parameters(machine: &Machine, known: &[ParameterPlace]) -> Vec<(ParameterPlace, f64)> {
    let mut found: Vec<(ParameterPlace, f64)> = Vec::new();
    for variable in &machine.tables().variables {
        if variable.settable != Settable::Yes || variable.kind != ValueKind::Real {
            continue;
        }
        for element in 0..variable.name.count() {
            let Ok((place, value)) = machine.parameter(&variable.name.element(element)) else { continue };
            let is_known = known.iter().chain(found.iter().map(|(own, _)| own)).any(|own| own.is_same(&place));
            if value != 0.0 && !is_known {
                found.push((place, value));
            }
        }
    }
    found
}

/// The problem with one more unknown, which is the logarithm of one of these parameters; the others are set to what they are.
fn freed<'a>(mut problem: Problem<'a>, free: &[(ParameterPlace, f64)], k: usize) -> Problem<'a> {
    let places = vec![problem.places.len() + k];
    for (place, stated) in free {
        problem.places.push(place.clone());
        problem.base.iter_mut().for_each(|values| values.push(*stated));
    }
    let (place, stated) = &free[k];
    let prior = if *stated > 0.0 { Prior::Lognormal(*stated, 1.0) } else { Prior::Normal(*stated, stated.abs()) };
    let part = EffectPart { effect: 0, parameter: 0 };
    problem.unknowns.push(Unknown::new(place.name().to_string(), Meaning::Value { places, prior }, None, Some(part)));
    limit(&mut problem);
    problem
}

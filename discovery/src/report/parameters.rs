//! What may be off: value before the measurement, as fitted to the base model, as fitted with what was found.

use serde_json::{Value, json};

use super::{Scene, number};
use crate::Fault;
use crate::fit::Fit;
use crate::unknowns::{Meaning, Unknown};

/// A row for every unknown of the last fit; those of the effects have no value in the base model.
pub(super) fn parameters(scene: &Scene<'_>) -> Result<Vec<Value>, Fault> {
    let problem = scene.last.base.problem(scene.setup)?;
    let known = scene.first.fit.xi.len();
    let base = scene.first.base.problem(scene.setup)?;
    let row = |(k, unknown): (usize, &Unknown)| {
        let before = (k < known).then(|| state(&base.unknowns[k], &scene.first.fit, k));
        json!({"name": unknown.name, "kind": kind(unknown), "before": before, "after": state(unknown, &scene.last.fit, k)})
    };
    Ok(problem.unknowns.iter().enumerate().map(row).collect())
}

/// Value, standard error and pull (standard deviations of the prior).
fn state(unknown: &Unknown, fit: &Fit, k: usize) -> Value {
    let xi = fit.xi[k];
    let error = fit.standard_error(k).unwrap_or(f64::NAN);
    json!({"value": number(unknown.value(xi)), "stderr": number(error * unknown.slope(xi).abs()), "pull": number(xi),
        "at_limit": unknown.is_at_limit(xi)})
}

/// Names of what the last fit has left as far off as anything may be; of shots that were not fitted nothing is known.
pub(super) fn at_limit(scene: &Scene<'_>) -> Result<Vec<String>, Fault> {
    let problem = scene.last.base.problem(scene.setup)?;
    let is_fitted = |unknown: &Unknown| unknown.shot.is_none_or(|shot| scene.setup.train.contains(&shot));
    let of = problem.unknowns.iter().zip(&scene.last.fit.xi);
    let of = of.filter(|&(unknown, &xi)| is_fitted(unknown) && unknown.is_at_limit(xi));
    Ok(of.map(|(unknown, _)| unknown.name.clone()).collect())
}

/// How the value is to be read.
fn kind(unknown: &Unknown) -> &'static str {
    match unknown.meaning {
        Meaning::Relative { .. } => "factor",
        Meaning::Value { .. } => "value",
        Meaning::Offset { .. } => "offset",
        Meaning::Gain { .. } => "gain",
        Meaning::Course { .. } => "amplitude",
        Meaning::Clock { .. } => "part",
        Meaning::Late { .. } | Meaning::Lag { .. } => "seconds",
    }
}

//! What came nearest where no single name is given: effects found in earlier passes, and the best candidates with their sizes, the
//! misfit they leave and what they failed by.

use serde_json::{Map, Value, json};

use super::sizes::{Size, words};
use super::{Scene, number};
use crate::Fault;
use crate::catalogue::Effect;
use crate::fit::Fit;
use crate::problem::Problem;
use crate::search::{Pass, Status, Tried, is_beaten};

/// Candidates that are shown.
const MOST: usize = 3;

/// Effects that earlier passes put in, at the last fit; those that were named stand under `effects`.
pub(super) fn found_before(scene: &Scene<'_>) -> Result<Vec<Value>, Fault> {
    let &Scene { setup, last, findings, .. } = scene;
    if !is_open(findings.status) || last.base.inserts.is_empty() {
        return Ok(Vec::new());
    }
    let problem = last.base.problem(setup)?;
    let describe = |(number_of, candidate): (usize, &crate::catalogue::Candidate)| {
        let parameters = sizes(&problem, &last.fit, (number_of, &candidate.effect));
        json!({"id": &*candidate.effect.id, "effect": candidate.label(), "words": &*candidate.effect.words, "component": candidate.place(),
            "parameters": parameters, "misfit": number(last.fit.misfit / last.expected)})
    };
    Ok(last.base.inserts.iter().enumerate().map(describe).collect())
}

/// The best candidates of the last pass.
pub(super) fn nearest(scene: &Scene<'_>) -> Result<Vec<Value>, Fault> {
    let &Scene { setup, last, findings, .. } = scene;
    if !is_open(findings.status) {
        return Ok(Vec::new());
    }
    let mut values = Vec::new();
    for tried in last.tried.iter().take(MOST) {
        let (Some(fit), Some(candidate)) = (&tried.fit, tried.hypothesis.inserts.last()) else { continue };
        let problem = tried.hypothesis.problem(setup)?;
        let parameters = sizes(&problem, fit, (tried.hypothesis.inserts.len() - 1, &candidate.effect));
        values.push(
            json!({"id": &*candidate.effect.id, "effect": candidate.label(), "words": &*candidate.effect.words,
            "component": candidate.place(), "parameters": parameters, "misfit": number(fit.misfit / last.expected),
            "cost_drop": number(tried.cost_drop), "size_in_errors": tried.errors.map(number),
            "criterion": criterion(scene, last, tried, fit)}),
        );
    }
    Ok(values)
}

/// True if an answer names nothing.
fn is_open(status: Status) -> bool {
    matches!(status, Status::Unknown | Status::Ambiguous | Status::Unconverged)
}

/// Values of the parameters of an effect with their errors.
fn sizes(problem: &Problem<'_>, fit: &Fit, (number_of, effect): (usize, &Effect)) -> Value {
    let own =
        problem.unknowns.iter().enumerate().filter(|(_, own)| own.effect.is_some_and(|part| part.effect == number_of));
    let list = own.map(|(k, unknown)| (unknown.name.clone(), Size::of(problem, fit, k, effect).json()));
    list.collect::<Map<String, Value>>().into()
}

/// What a candidate was not named for.
fn criterion(scene: &Scene<'_>, pass: &Pass, tried: &Tried, fit: &Fit) -> String {
    let findings = scene.findings;
    let is_one_of_several =
        tried.hypothesis.inserts.last().is_some_and(|own| findings.ambiguous.iter().any(|other| other.is_same(own)));
    if is_one_of_several {
        return "another candidate explains it equally well".to_string();
    }
    if !tried.verdict.is_empty() {
        return tried.verdict.clone();
    }
    if let Some(reason) = &findings.reason {
        return reason.clone();
    }
    if is_beaten(pass, fit) {
        return "a plain term at an equation explains what it leaves".to_string();
    }
    match findings.status {
        Status::Unconverged => "the fits did not end where they could be compared",
        _ => "one that fails itself explains as much",
    }
    .to_string()
}

/// The lines of the summary.
pub(super) fn lines(json: &Value) -> Vec<String> {
    let list = |key: &str| json[key].as_array().cloned().unwrap_or_default();
    let sizes = |own: &Value| -> String {
        let parameters = own["parameters"].as_object().into_iter().flatten();
        let one = |(name, size): (&String, &Value)| format!("{name} = {}", words(size));
        parameters.map(one).collect::<Vec<_>>().join(", ")
    };
    let word = |own: &Value, key: &str| own[key].as_str().unwrap_or_default().to_string();
    let misfit = |own: &Value| own["misfit"].as_f64().unwrap_or(f64::NAN);
    let mut lines = Vec::new();
    for own in list("found_before") {
        lines.push(format!("found before: {} ({}), {}", word(&own, "effect"), word(&own, "words"), sizes(&own)));
    }
    for own in list("nearest") {
        lines.push(format!(
            "nearest: {} ({}), {}, leaves {:.2} of the misfit of noise; not named: {}",
            word(&own, "effect"),
            word(&own, "words"),
            sizes(&own),
            misfit(&own),
            word(&own, "criterion")
        ));
    }
    lines
}

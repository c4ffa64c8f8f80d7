//! Sizes that fit the machine: numbers of effects that are shares of what the base model shows.
//!
//! An effect for any machine cannot say what is large.  It gives its numbers as shares of a formula (`of = "F/v"`) in names of
//! the place: the largest absolute value of a variable over the fitted shots (`v`), its range (`dv`), and the length of the longest
//! record (`t`, s).  One run of each shot of the base model, with everything as expected, tells them, or the measurement where the variable
//! is a channel.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::catalogue::{Candidate, Effect, EffectParameter, Reference, Site};
use crate::door::Door;
use crate::formula::{evaluate, names};
use crate::prior::Prior;
use crate::problem::Weighing;
use crate::variant::Workshop;
use crate::{Fault, Setup};

/// The length of the longest record.
const TIME: &str = "t";
/// What stands before a name for its range.
const RANGE: char = 'd';

/// The candidates with numbers of the machine, and sentences on those that are left out because nothing tells how large they may be.
///
/// # Errors
/// When the base model cannot be translated with what is asked of it, or does not run.
pub(crate) fn natural(
    setup: &Setup,
    workshop: &Workshop<'_>,
    candidates: Vec<Candidate>,
) -> Result<(Vec<Candidate>, Vec<String>), Fault> {
    let mut wanted: Vec<String> = Vec::new();
    for candidate in &candidates {
        for name in asked(&candidate.effect) {
            wanted.extend(expression(&candidate.sites[0], &name).map(|(expression, _)| expression));
        }
    }
    wanted.sort_unstable();
    wanted.dedup();
    let shown = if wanted.is_empty() { BTreeMap::new() } else { shown(setup, workshop, &wanted)? };
    let spans = setup.train.iter().map(|&shot| &setup.data.shots[shot].span);
    let time = spans.map(|span| span.stop - span.start).fold(0.0, f64::max);
    let (mut made, mut left_out) = (Vec::new(), Vec::new());
    for mut candidate in candidates {
        // What is measured says more than a model that lacks something, but not of the chain that it is measured by.
        let is_chain = matches!(candidate.sites[0].door, Door::Channel { .. });
        let value_of = |name: &str| {
            let (expression, is_range) = expression(&candidate.sites[0], name)?;
            let measured = if is_chain { None } else { measured(setup, &expression) };
            let (low, high) = measured.or_else(|| shown.get(&expression).copied())?;
            Some(if is_range { high - low } else { low.abs().max(high.abs()) })
        };
        let value_of = |name: &str| value_of(name).or((name == TIME).then_some(time));
        match sized(&candidate.effect, &value_of) {
            Ok(effect) => {
                candidate.effect = Arc::new(effect);
                made.push(candidate);
            }
            Err(why) => left_out.push(format!("`{}` is not tried: {why}", candidate.label())),
        }
    }
    Ok((made, left_out))
}

/// Names in the formulas of an effect.
fn asked(effect: &Effect) -> Vec<String> {
    let own = effect.parameters.iter().filter_map(|parameter| parameter.of.as_deref());
    let references = effect.references.iter().map(|reference| &*reference.of);
    own.chain(references).flat_map(names).collect()
}

/// The expression of the model that a name of a place means, and whether its range is meant.
fn expression(site: &Site, name: &str) -> Option<(String, bool)> {
    let known = |name: &str| site.scales.iter().find(|(known, _)| known == name).map(|(_, text)| text.clone());
    let range = name.strip_prefix(RANGE).filter(|rest| !rest.is_empty());
    match site.door {
        Door::Component if name == TIME => None,
        Door::Component => Some(match range {
            Some(of) => (format!("{}.{of}", site.path), true),
            None => (format!("{}.{name}", site.path), false),
        }),
        _ => known(name).map(|text| (text, false)).or_else(|| Some((known(range?)?, true))),
    }
}

/// Smallest and largest measured value of an expression that is a channel, over the fitted shots.
fn measured(setup: &Setup, expression: &str) -> Option<(f64, f64)> {
    let channel = setup.data.channels.iter().position(|channel| channel.expression == expression)?;
    let traces = setup.train.iter().filter_map(|&shot| setup.data.shots[shot].traces[channel].as_ref());
    let values = traces.flat_map(|trace| trace.values.iter().zip(&trace.used).filter(|(_, used)| **used));
    let ends = |(low, high): (f64, f64), (&value, _): (&f64, &bool)| (low.min(value), high.max(value));
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    (low < high).then_some((low, high))
}

/// Smallest and largest value of expressions of the base model over the fitted shots.
fn shown(setup: &Setup, workshop: &Workshop<'_>, wanted: &[String]) -> Result<BTreeMap<String, (f64, f64)>, Fault> {
    let watching = Workshop { channels: wanted.to_vec(), ..workshop.clone() };
    let machine = setup.machine_of(watching.translate(&[])?, wanted.len())?;
    let problem = setup.problem(&machine, &[])?;
    let expected = vec![0.0; problem.unknowns.len()];
    let runs = problem.simulate(&expected, &Weighing::whole(&setup.train, 0.0))?;
    let mut ranges = BTreeMap::new();
    for run in runs.iter().flatten() {
        for (text, series) in wanted.iter().zip(run) {
            let own = ranges.entry(text.clone()).or_insert((f64::INFINITY, f64::NEG_INFINITY));
            *own = series.iter().fold(*own, |(low, high): (f64, f64), &value| (low.min(value), high.max(value)));
        }
    }
    Ok(ranges)
}

/// The effect with its shares multiplied out.
fn sized(effect: &Effect, value_of: &dyn Fn(&str) -> Option<f64>) -> Result<Effect, String> {
    let scale = |of: &str| match evaluate(of, value_of) {
        Ok(scale) if scale > 0.0 => Ok(scale),
        Ok(_) => Err(format!("`{of}` is 0 in the base model")),
        Err(_) => Err(format!("the base model does not tell `{of}`")),
    };
    let mut made = effect.clone();
    for (k, EffectParameter { prior, range, of, .. }) in made.parameters.iter_mut().enumerate() {
        let Some(of) = of.take() else { continue };
        let scale = scale(&of)?;
        *prior = match *prior {
            Prior::Normal(m, s) => Prior::Normal(m * scale, s * scale),
            Prior::Lognormal(median, s) => Prior::Lognormal(median * scale, s),
            Prior::Uniform(a, b) => Prior::Uniform(a * scale, b * scale),
        };
        *range = range.map(|(low, high)| (low * scale, high * scale));
        if k == 0 {
            made.probe *= scale;
        }
    }
    for Reference { of, value, .. } in &mut made.references {
        *value = Some(scale(of)?);
    }
    Ok(made)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::Arc;

    use super::{asked, expression, sized};
    use crate::catalogue::{Effect, EffectParameter, Kind, Reference, Site};
    use crate::door::Door;
    use crate::prior::Prior;

    fn effect() -> Effect {
        let parameter = |name: &str, prior, range, of: Option<&str>| EffectParameter {
            name: name.into(),
            prior,
            range,
            of: of.map(Arc::from),
        };
        Effect {
            id: "drag".into(),
            kind: Kind::Physics,
            class: "Own.Drag".into(),
            words: "".into(),
            signature: "".into(),
            rivals: Vec::new(),
            at: vec![vec!["force".into()]],
            parameters: vec![
                parameter("c", Prior::Lognormal(0.1, 1.0), Some((0.01, 1.0)), Some("F/(v*v)")),
                parameter("s_0", Prior::Normal(0.5, 0.1), None, Some("ds")),
                parameter("e", Prior::Uniform(1.0, 2.0), None, None),
            ],
            references: vec![Reference { name: "w".into(), of: "1e-3*v".into(), value: None }],
            excludes: Vec::new(),
            refines: Vec::new(),
            zero: Some(0.0),
            probe: 0.2,
            of_range: false,
            is_law: true,
            given: Vec::new(),
            per_shot: false,
            base: None,
            file: "own.hyd".into(),
            line: 1,
        }
    }

    #[test]
    fn shares_become_numbers_of_the_machine() {
        let value_of = |name: &str| match name {
            "F" => Some(8.0),
            "v" => Some(2.0),
            "ds" => Some(3.0),
            _ => None,
        };
        let made = sized(&effect(), &value_of).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs();
        assert!(near(made.probe, 0.4) && made.references[0].value.is_some_and(|w| near(w, 2e-3)));
        let Prior::Lognormal(median, 1.0) = made.parameters[0].prior else { panic!("{made:?}") };
        let Some((low, high)) = made.parameters[0].range else { panic!("{made:?}") };
        assert!(near(median, 0.2) && near(low, 0.02) && near(high, 2.0));
        assert_eq!(made.parameters[2].prior, Prior::Uniform(1.0, 2.0));
        // What does not move, and what nobody knows.
        for (name, value, expected) in [("v", Some(0.0), "F/(v*v)"), ("ds", None, "the base model does not tell `ds`")]
        {
            let why = sized(&effect(), &|own| if own == name { value } else { value_of(own) }).unwrap_err();
            assert!(why.contains(expected), "{why}");
        }
    }

    #[test]
    fn names_mean_variables_of_the_place() {
        let mut site = Site {
            id: "force".into(),
            path: "arm.force".into(),
            words: "".into(),
            channel: None,
            file: "m.hyd".into(),
            line: 1,
            door: Door::Component,
            scales: Vec::new(),
        };
        assert_eq!(asked(&effect()), ["F", "v", "v", "ds", "v"]);
        assert_eq!(expression(&site, "v"), Some(("arm.force.v".into(), false)));
        assert_eq!(expression(&site, "dv"), Some(("arm.force.v".into(), true)));
        assert_eq!(expression(&site, "t"), None);
        (site.door, site.scales) =
            (Door::Channel { expression: "x".into(), heard: None }, vec![("u".into(), "x + y".into())]);
        assert_eq!(expression(&site, "u"), Some(("x + y".into(), false)));
        assert_eq!(expression(&site, "du"), Some(("x + y".into(), true)));
        assert_eq!(expression(&site, "v"), None);
    }
}

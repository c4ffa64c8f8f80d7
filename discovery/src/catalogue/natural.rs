//! Sizes that fit the machine: numbers of effects that are shares of what the base model shows.
//!
//! An effect for any machine cannot say what is large.  It gives its numbers as shares of a formula (`of = "F/v"`) in names of
//! the place: the largest absolute value of a variable over the fitted shots (`v`), its range (`dv`), and the length of the longest
//! record (`t`, s).  One run of each shot of the base model, with everything as expected, tells them, or the measurement where the variable
//! is a channel.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::catalogue::door::Door;
use crate::catalogue::{Candidate, Effect, EffectParameter, Reference, Site};
use crate::problem::Weighing;
use crate::study::formula::{evaluate, names};
use crate::unknowns::prior::Prior;
use crate::variant::Workshop;
use crate::{Fault, Setup};

/// The length of the longest record.
const TIME: &str = "t";
/// A channel that correlates so much with another one or its rate says the same as that.
const ECHO: f64 = 0.95;
/// What is colder is taken for a temperature in another unit (K).
const COLDEST: f64 = 120.0;
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
            wanted.extend(asked_at(candidate).iter().filter_map(|site| expression(site, &name)).map(|(own, _)| own));
        }
    }
    wanted.sort_unstable();
    wanted.dedup();
    let courses = if wanted.is_empty() { BTreeMap::new() } else { courses(setup, workshop, &wanted)? };
    let (candidates, mut left_out) = without_echoes(candidates, &courses);
    let shown = ranges(&courses);
    let spans = setup.train.iter().map(|&shot| &setup.data.shots[shot].span);
    let time = spans.map(|span| span.stop - span.start).fold(0.0, f64::max);
    let (mut made, mut cold) = (Vec::new(), Vec::new());
    for mut candidate in candidates {
        // What is measured says more than a model that lacks something, but not of the chain that it is measured by.
        let is_chain = matches!(candidate.sites[0].door, Door::Channel { .. });
        let value_at = |site: &Site, name: &str| {
            let (expression, is_range) = expression(site, name)?;
            let measured = if is_chain { None } else { measured(setup, &expression) };
            let (low, high) = measured.or_else(|| shown.get(&expression).copied())?;
            Some(if is_range { high - low } else { low.abs().max(high.abs()) })
        };
        if let Some(name) = &candidate.effect.absolute {
            let shows = |site: &Site| {
                let (expression, _) = expression(site, name)?;
                let range = measured(setup, &expression).or_else(|| shown.get(&expression).copied())?;
                Some((expression, range.0)).filter(|(_, lowest)| *lowest < COLDEST)
            };
            if let Some((expression, lowest)) = asked_at(&candidate).iter().find_map(shows) {
                // Once, and not for every place.
                if cold.contains(&candidate.effect.id) {
                    continue;
                }
                cold.push(candidate.effect.id.clone());
                left_out.push(format!(
                    "`{}` is not tried: `{expression}` falls to {lowest:.3}, and this law needs an absolute temperature in K",
                    candidate.label()
                ));
                continue;
            }
        }
        // Of elements of an array the one that shows most.
        let value_of =
            |name: &str| asked_at(&candidate).iter().filter_map(|site| value_at(site, name)).reduce(f64::max);
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

/// The places whose names mean something in the formulas: of several that a model declares the first one, of elements of an array all.
fn asked_at(candidate: &Candidate) -> &[Site] {
    if candidate.is_found() { &candidate.sites } else { &candidate.sites[..candidate.sites.len().min(1)] }
}

/// Names in the formulas of an effect.
fn asked(effect: &Effect) -> Vec<String> {
    let own = effect.parameters.iter().filter_map(|parameter| parameter.of.as_deref());
    let references = effect.references.iter().map(|reference| &*reference.of);
    own.chain(references).flat_map(names).chain(effect.absolute.iter().map(|name| name.to_string())).collect()
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

/// Values of an expression of the base model at the output points of each fitted shot, and how far apart these are (s).
type Courses = Vec<(Vec<f64>, f64)>;

/// The courses of expressions of the base model.
fn courses(setup: &Setup, workshop: &Workshop<'_>, wanted: &[String]) -> Result<BTreeMap<String, Courses>, Fault> {
    let watching = Workshop { channels: wanted.to_vec(), ..workshop.clone() };
    let machine = setup.machine_of(watching.translate(&[])?, wanted.len())?;
    let problem = setup.problem(&machine, &[])?;
    let expected = vec![0.0; problem.unknowns.len()];
    let runs = problem.simulate(&expected, &Weighing::whole(&setup.train, 0.0))?;
    let mut courses: BTreeMap<String, Courses> = BTreeMap::new();
    for (shot, run) in setup.data.shots.iter().zip(&runs) {
        let Some(run) = run else { continue };
        for (text, series) in wanted.iter().zip(run) {
            courses.entry(text.clone()).or_default().push((series.clone(), shot.span.step()));
        }
    }
    Ok(courses)
}

/// Smallest and largest value of each.
fn ranges(courses: &BTreeMap<String, Courses>) -> BTreeMap<String, (f64, f64)> {
    let ends = |(low, high): (f64, f64), &value: &f64| (low.min(value), high.max(value));
    let range =
        |own: &Courses| own.iter().flat_map(|(series, _)| series).fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    courses.iter().map(|(text, own)| (text.clone(), range(own))).collect()
}

/// Without channels that hear another one which goes like their own rate or like themselves, which would only be another word for a delay or
/// a gain; with a sentence on these.
fn without_echoes(candidates: Vec<Candidate>, courses: &BTreeMap<String, Courses>) -> (Vec<Candidate>, Vec<String>) {
    let is_echo = |candidate: &Candidate| match &candidate.sites[0].door {
        Door::Channel { expression, heard: Some(heard) } => match (courses.get(expression), courses.get(heard)) {
            (Some(own), Some(other)) => echoes(own, other),
            _ => false,
        },
        _ => false,
    };
    let (echoing, rest): (Vec<Candidate>, Vec<Candidate>) = candidates.into_iter().partition(is_echo);
    let labels: Vec<String> = echoing.iter().map(|own| format!("`{}`", own.label())).collect();
    let sentence = (!labels.is_empty()).then(|| {
        format!("{} cannot be told from a delay or a gain of that channel and is not tried", labels.join(", "))
    });
    (rest, sentence.into_iter().collect())
}

/// True if `other` goes like `own` or like its rate.
fn echoes(own: &Courses, other: &Courses) -> bool {
    let mut rates: Courses = Vec::new();
    for (series, step) in own {
        let rate = |k: usize| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(series.len() - 1));
            (series[after] - series[before]) / ((after - before).max(1) as f64 * step)
        };
        rates.push(((0..series.len()).map(rate).collect(), *step));
    }
    correlation(own, other).abs() > ECHO || correlation(&rates, other).abs() > ECHO
}

/// Correlation over all shots, each about its own mean, as offsets may be anything.
fn correlation(one: &Courses, other: &Courses) -> f64 {
    let (mut product, mut squares) = (0.0, [0.0; 2]);
    for ((one, _), (other, _)) in one.iter().zip(other) {
        let mean = |series: &[f64]| series.iter().sum::<f64>() / series.len().max(1) as f64;
        let means = [mean(one), mean(other)];
        for (a, b) in one.iter().zip(other) {
            let (a, b) = (a - means[0], b - means[1]);
            product += a * b;
            squares[0] += a * a;
            squares[1] += b * b;
        }
    }
    let size = (squares[0] * squares[1]).sqrt();
    if size > 0.0 { product / size } else { 0.0 }
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
    use crate::catalogue::door::Door;
    use crate::catalogue::{Effect, EffectParameter, Kind, Reference, Site};
    use crate::unknowns::prior::Prior;

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
            absolute: None,
            zero: Some(0.0),
            form: 0.0,
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
    fn a_speed_is_an_echo_of_its_position_and_a_voltage_is_not() {
        let of = |f: &dyn Fn(f64) -> f64| -> super::Courses {
            vec![((0..400).map(|k| f(0.05 * f64::from(k))).collect(), 0.05)]
        };
        let (position, speed) = (of(&|t| (2.0 * t).sin() + 3.0), of(&|t| 0.4 * (2.0 * t).cos()));
        assert!(super::echoes(&position, &speed) && super::echoes(&speed, &position));
        assert!(super::echoes(&position, &of(&|t| -7.0 * (2.0 * t).sin())));
        let (voltage, temperature) = (of(&|t| 1.0 - (-t).exp()), of(&|t| 1.0 - (-t / 20.0).exp()));
        assert!(!super::echoes(&temperature, &voltage) && !super::echoes(&voltage, &temperature));
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
            array: None,
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

//! The findings for the terminal.

use std::fmt::Write;

use serde_json::Value;

use super::sizes::{Size, words};
use super::{AllGaps, Scene, disturbed, json::proposed, nearest};
use crate::Fault;
use crate::catalogue::Candidate;
use crate::evidence::proof::Gap;
use crate::magnitude::shown;
use crate::search::{Exact, Status};
use crate::unknowns::LIMIT;

/// What came out, in one sentence.
pub(super) fn sentence(scene: &Scene<'_>) -> String {
    let findings = scene.findings;
    match findings.status {
        Status::Adequate => "adequate: nothing is missing; the residuals are noise".to_string(),
        Status::Named | Status::Sensor => {
            let inserts = &scene.last.base.inserts;
            let names: Vec<String> = inserts.iter().map(|c| format!("{} ({})", c.label(), c.effect.words)).collect();
            format!("{}: missing is {}", findings.status.word(), names.join(" and "))
        }
        Status::Law => {
            let law = findings.law.as_ref();
            let place = law.and_then(|law| law.terms.first()).map(|own| {
                let (of, file) = (&own.term.component, scene.workshop.shown_file(&own.term.file));
                let of = if of.is_empty() { String::new() } else { format!(" of {of}") };
                format!("{of} ({file}:{})", own.term.line)
            });
            let equation = law.map(crate::terms::law::Law::equation);
            let own = scene.last.base.inserts.iter().filter(|own| law.is_none_or(|law| !law.candidate.is_same(own)));
            let others: Vec<String> = own.map(|c| format!(" and {} ({})", c.label(), c.effect.words)).collect();
            format!(
                "law: missing is what no library holds: `{}`{}{}",
                equation.unwrap_or_default(),
                place.unwrap_or_default(),
                others.concat()
            )
        }
        Status::Ambiguous => {
            let names: Vec<String> = findings.ambiguous.iter().map(Candidate::label).collect();
            format!("ambiguous: these explain it equally well: {}", names.join(", "))
        }
        Status::Unknown => match (&findings.resembles, findings.unfitted) {
            (Some(candidate), Some((promise, needed))) => {
                let label = candidate.label();
                // A promise that is enough was followed by no fit that succeeded.
                let why = match promise < needed {
                    true => format!("promises a drop of the cost by {promise:.1}, and {needed:.0} is needed for a fit"),
                    false => format!("promises a drop of the cost by {promise:.1}, but no fit of it succeeded"),
                };
                format!(
                    "unknown: something is missing, and no library effect was fitted: the likeliest, {label}, {why}"
                )
            }
            (Some(candidate), None) => format!(
                "unknown: something is missing that no library effect explains; it resembles {}",
                candidate.label()
            ),
            (None, _) => "unknown: something is missing that no library effect explains".to_string(),
        },
        Status::Unconverged => {
            "unconverged: the fits did not end where they could be compared; no name is given".to_string()
        }
    }
}

/// What is said of a parameter that the study takes as exact.
pub(super) fn exact(own: &Exact) -> String {
    let unit = if own.unit.is_empty() || own.unit == "1" { String::new() } else { format!(" {}", own.unit) };
    format!(
        "`{}`, which the study takes as exact, takes the gap from {:.2} to {:.2} with {}{unit} instead of {}; if it is not known that well, give it a \
         tolerance in `[nuisances]`",
        own.parameter,
        own.gap[0],
        own.gap[1],
        rounded(own.value),
        shown(own.stated)
    )
}

/// A number with three digits.
fn rounded(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    shown(rounded)
}

/// Of two effects that differ by fewer standard deviations in a further measurement a fit may leave nothing.
const CLEAR: f64 = 5.0;

/// What the best further measurement says of two effects that explain alike.
fn told_apart(best: &Value) -> String {
    let measurement = best["measurement"].as_str().unwrap_or_default();
    let (one, other) = (&best["effects"][0], &best["effects"][1]);
    // Standard deviations of the noise, over all samples of the shot.
    let apart = best["apart"].as_f64().unwrap_or(0.0).sqrt();
    match apart {
        apart if apart < 1.0 => {
            format!("no other condition of a shot and no other channel of this study tells {one} from {other}")
        }
        apart if apart < CLEAR => format!(
            "{one} and {other} are hard to tell apart: most, but by {apart:.1} standard deviations only, they would differ if you {measurement}"
        ),
        _ => format!("to tell {one} from {other}: {measurement}"),
    }
}

/// The text of a law, and what else was fitted.
fn law_lines(json: &Value) -> Vec<String> {
    let law = &json["law"];
    let Some(text) = law["text"].as_str() else { return Vec::new() };
    let mut lines = vec![format!("written as an effect of a library: {text}")];
    let rivals = law["rivals"].as_array().into_iter().flatten();
    lines.extend(rivals.take(2).map(|own| {
        let (equation, shape) =
            (own["equation"].as_str().unwrap_or_default(), own["shape"].as_str().unwrap_or_default());
        let at = if equation.is_empty() { String::new() } else { format!(" in `{equation}`") };
        format!("next: {shape}{at}, whose cost is larger by {:.0}", own["behind"].as_f64().unwrap_or(f64::NAN))
    }));
    lines
}

/// Sentence, gaps and sizes.
pub(super) fn summary(scene: &Scene<'_>, gaps: &AllGaps, seconds: f64, json: &Value) -> Result<String, Fault> {
    let &Scene { setup, findings, last, .. } = scene;
    let (before, after) = (&gaps.before, gaps.after.as_ref());
    let mut text = String::new();
    let _ = writeln!(text, "{}", sentence(scene));
    if let Some(reason) = &findings.reason {
        let what = if findings.unfitted.is_some() { "not adequate" } else { "no name" };
        let _ = writeln!(text, "  {what}, because {reason}");
    }
    if let Some(wall) = json["does_not_run"].as_str() {
        let first = wall.lines().next().unwrap_or_default();
        let _ =
            writeln!(text, "  the fit has ended where the model does not run further, and not at a minimum: {first}");
    }
    for line in disturbed::lines(json, findings.status) {
        let _ = writeln!(text, "  {line}");
    }
    for line in nearest::lines(json) {
        let _ = writeln!(text, "  {line}");
    }
    for unit in json["units"].as_array().into_iter().flatten() {
        let _ = writeln!(text, "  {}", unit["words"].as_str().unwrap_or_default());
    }
    if !setup.exposed.is_empty() {
        let numbers: Vec<String> =
            setup.exposed.iter().map(|&shot| setup.bench.shots[shot].number.to_string()).collect();
        let _ = writeln!(
            text,
            "  shot {} was held out at first, showed a gap that the others hide, and is fitted now",
            numbers.join(", ")
        );
    }
    let held: Vec<&str> = json["at_limit"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    if !held.is_empty() {
        let _ = writeln!(text, "  at the limit of {LIMIT} standard deviations, held there: {}", held.join(", "));
    }
    if let Some(first) = json["further"].as_array().and_then(|all| all.first()) {
        let _ = writeln!(text, "  {}", told_apart(first));
    }
    for line in law_lines(json) {
        let _ = writeln!(text, "  {line}");
    }
    for term in proposed(scene)? {
        let text_of = |key: &str| term[key].as_str().unwrap_or_default().to_string();
        let figure = |key: &str| term[key].as_f64().unwrap_or(f64::NAN);
        let (component, unit) = (text_of("component"), text_of("unit"));
        let _ = writeln!(
            text,
            "  a term like {:.3e}*{} {unit} (+- {:.1e}) in `{}`{} ({}:{}) would bring the misfit to {:.2}",
            figure("coefficient"),
            text_of("shape"),
            figure("stderr"),
            text_of("equation"),
            if component.is_empty() { String::new() } else { format!(" of {component}") },
            text_of("file"),
            term["line"],
            figure("misfit")
        );
    }
    for own in &findings.exact {
        let _ = writeln!(text, "  {}", exact(own));
    }
    if let Some(why) = &findings.no_law {
        let _ = writeln!(text, "  no law, because {why}");
    }
    if let Some(equation) = json["missing"]["equation"].as_str() {
        let _ = writeln!(text, "  the report draws what `{equation}` lacks over time");
    }
    let _ = writeln!(text, "\ngap (1.00 is noise)         before   after");
    let mut line = |name: &str, before: &Gap, after: Option<&Gap>| {
        let _ = writeln!(text, "  {name:24} {:7.2} {:7.2}", before.all, after.map_or(before.all, |gap| gap.all));
        for (k, channel) in setup.data.channels.iter().enumerate().filter(|&(k, _)| before.channels[k].is_finite()) {
            let after = after.map_or(before.channels[k], |gap| gap.channels[k]);
            let _ = writeln!(text, "    {:22} {:7.2} {after:7.2}", channel.name, before.channels[k]);
        }
    };
    line("fitted shots", &before.train, after.map(|gaps| &gaps.train));
    if let Some(own) = &before.held_out {
        line("shots held out", own, after.and_then(|gaps| gaps.held_out.as_ref()));
    }
    if after.is_some() {
        let problem = last.base.problem(setup)?;
        let _ = writeln!(text, "\nsizes");
        // Of shots that were not fitted nothing is known.
        let is_fitted = |shot: Option<usize>| shot.is_none_or(|shot| setup.train.contains(&shot));
        let sizes = problem.unknowns.iter().enumerate().filter(|(_, own)| own.effect.is_some() && is_fitted(own.shot));
        for (k, unknown) in sizes {
            let effect = unknown.effect.map(|part| &scene.last.base.inserts[part.effect].effect);
            let size = effect.map(|effect| Size::of(&problem, &last.fit, k, effect).json()).unwrap_or_default();
            let _ = writeln!(text, "  {:34} {}", unknown.name, words(&size));
        }
    }
    let model =
        if after.is_some() { format!("; the model is {}", scene.workshop.extended_name()) } else { String::new() };
    let _ = writeln!(text, "\n{} runs of one shot, {seconds:.1} s{model}", findings.runs);
    Ok(text)
}

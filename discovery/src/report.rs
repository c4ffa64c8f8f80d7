//! What is written down: the model as text, the findings as JSON, measured and simulated channels as a table, a summary to read.
//!
//! Numbers of the extended model come from runs of the text that is written, translated anew.  Gaps are roots of the mean square of
//! residuals in standard deviations of the noise (1.0 is noise); see [`crate::proof`].

use std::fmt::Write;

use serde_json::{Value, json};

use crate::catalogue::Candidate;
use crate::location::Located;
use crate::proof::{Gap, gap};
use crate::search::{ERRORS, Findings, NEEDED, Pass, Status, Tried};
use crate::text_bundle::bundle;
use crate::unknowns::{EffectPart, Meaning};
use crate::variant::{EXTENDED, Insert, Workshop};
use crate::{Fault, Setup};

/// Everything that is written down.
pub struct Report {
    /// `report.json`.
    pub json: Value,
    /// `discovered.hyd`, if something was named.
    pub model: Option<String>,
    /// `trajectories.csv`.
    pub trajectories: String,
    /// For the terminal.
    pub summary: String,
}

/// Gaps of one model on the shots that were fitted and on those held out.
struct Gaps {
    train: Gap,
    held_out: Option<Gap>,
}

/// Writes everything down.  `built_in` knows the names of texts that every reader has.
///
/// # Errors
/// When the written model cannot be translated or run.
pub fn report(
    setup: &Setup,
    workshop: &Workshop<'_>,
    findings: &Findings,
    seconds: f64,
    built_in: &dyn Fn(&str) -> bool,
) -> Result<Report, Fault> {
    let (Some(first), Some(last)) = (findings.passes.first(), findings.passes.last()) else {
        return Err(Fault::run("nothing was fitted"));
    };
    let named = matches!(findings.status, Status::Named | Status::Sensor);
    let before = gaps(setup, &first.base.problem(setup)?, &first.fit.xi)?;
    let mut model = None;
    let mut after = None;
    if named {
        let inserts = inserts(setup, last)?;
        let annotation = format!(
            "  annotation(experiment(StopTime = {:e}, Tolerance = 1e-7), __hyd(discovered(from = \"{}\", status = \"{}\", set = \"{}\")));\n",
            setup.data.shots.iter().map(|shot| shot.span.stop).fold(0.0, f64::max),
            workshop.class,
            findings.status.word(),
            setup.bench.name
        );
        let words: Vec<&str> = inserts.iter().map(|insert| &*insert.candidate.effect.words).collect();
        let description = format!("{} with {}", workshop.class, words.join(" and "));
        let mut text = bundle(&workshop.texts(&inserts, built_in)?);
        text.push_str(&workshop.extended(&inserts, &description.replace('"', "'"), &[], &annotation));
        let machine = setup.machine(&*workshop.translate_whole(&text)?)?;
        let candidates: Vec<Candidate> = inserts.into_iter().map(|insert| insert.candidate).collect();
        after = Some(gaps(setup, &setup.problem(&machine, &candidates)?, &last.fit.xi)?);
        model = Some(text);
    }
    let json = json((setup, workshop), findings, (&before, after.as_ref()), seconds)?;
    let trajectories = trajectories(setup, findings, (&before, after.as_ref()))?;
    let summary = summary((setup, workshop), findings, (&before, after.as_ref()), seconds)?;
    Ok(Report { json, model, trajectories, summary })
}

fn gaps(setup: &Setup, problem: &crate::problem::Problem<'_>, xi: &[f64]) -> Result<Gaps, Fault> {
    let train = gap(problem, xi, &setup.train, false)?;
    let held_out = match setup.held_out.is_empty() {
        true => None,
        false => Some(gap(problem, xi, &setup.held_out, true)?),
    };
    Ok(Gaps { train, held_out })
}

/// The effects of a pass with their fitted values; what is another one in every shot gets its mean over the fitted shots.
fn inserts(setup: &Setup, pass: &Pass) -> Result<Vec<Insert>, Fault> {
    let problem = pass.base.problem(setup)?;
    let value = |part: EffectPart| {
        let of = problem.unknowns.iter().zip(&pass.fit.xi).filter(|(unknown, _)| {
            unknown.effect == Some(part) && unknown.shot.is_none_or(|shot| setup.train.contains(&shot))
        });
        let values: Vec<f64> = of.map(|(unknown, &xi)| unknown.value(xi)).collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    let make = |(effect, candidate): (usize, &Candidate)| {
        let values = (0..candidate.effect.parameters.len()).map(|parameter| value(EffectPart { effect, parameter }));
        Insert { candidate: candidate.clone(), values: values.collect() }
    };
    Ok(pass.base.inserts.iter().enumerate().map(make).collect())
}

/// A number, or null where there is none.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

fn json(
    (setup, workshop): (&Setup, &Workshop<'_>),
    findings: &Findings,
    (before, after): (&Gaps, Option<&Gaps>),
    seconds: f64,
) -> Result<Value, Fault> {
    let effects = match (after, findings.passes.last()) {
        (Some(_), Some(last)) => effects(setup, last)?,
        _ => Vec::new(),
    };
    let part = |before: Option<&Gap>, after: Option<&Gap>| match before {
        None => Value::Null,
        Some(before) => {
            let after_all = after.map_or(before.all, |gap| gap.all);
            let channels = setup.data.channels.iter().enumerate().map(|(k, channel)| {
                let after = after.map_or(before.channels[k], |gap| gap.channels[k]);
                (channel.name.clone(), json!({"before": number(before.channels[k]), "after": number(after)}))
            });
            let channels: serde_json::Map<String, Value> = channels.collect();
            json!({"before": number(before.all), "after": number(after_all), "channels": channels})
        }
    };
    let held_out = part(before.held_out.as_ref(), after.and_then(|gaps| gaps.held_out.as_ref()));
    let location = location(findings, workshop);
    let proposed = proposed(setup, findings, workshop)?;
    let candidates = findings.passes.iter().enumerate().flat_map(|(pass, found)| {
        found.tried.iter().chain(&found.terms).map(move |tried| {
            json!({"pass": pass + 1, "effect": tried.hypothesis.own_label(),
                "promise": tried.look.as_ref().map(|look| number(look.score.gain)),
                "power": tried.look.as_ref().map(|look| number(look.score.power)),
                "left_by_nuisances": tried.look.as_ref().map(|look| number(look.score.left)),
                "fitted": tried.fit.is_some(), "verdict": tried.verdict, "fall": number(tried.fall), "size_in_errors": number(tried.errors)})
        })
    });
    Ok(json!({
        "status": findings.status.word(),
        "set": setup.bench.name,
        "effects": effects,
        "ambiguous": findings.ambiguous.iter().map(|candidate| &*candidate.effect.id).collect::<Vec<_>>(),
        "reason": findings.reason,
        "resembles": findings.resembles.as_ref().map(|candidate| &*candidate.effect.id),
        "location": location,
        "proposed": proposed,
        "gap": {"train": part(Some(&before.train), after.map(|gaps| &gaps.train)), "heldout": held_out},
        "shots": {"train": numbers(setup, &setup.train), "heldout": numbers(setup, &setup.held_out)},
        "noise": noise(setup),
        "candidates": candidates.collect::<Vec<_>>(),
        "attempts": findings.passes.iter().map(|pass| pass.record.attempts.iter().map(|a|
            json!({"start": a.start, "misfit": number(a.misfit), "cost": number(a.cost), "steps": a.steps, "converged": a.converged})
        ).collect::<Vec<_>>()).collect::<Vec<_>>(),
        "simulations": findings.runs,
        "seconds": seconds,
    }))
}

/// Equations and places, the likeliest first: those of effects that were named, those of terms that were fitted by the fall of the cost,
/// then the others by how much it would fall with the best term of the equation or the best effect of the place.
fn location(findings: &Findings, workshop: &Workshop<'_>) -> Vec<Value> {
    let (Some(first), Some(last)) = (findings.passes.first(), findings.passes.last()) else { return Vec::new() };
    let mut ranked: Vec<(u8, f64, String, Value)> = Vec::new();
    let mut add = |rank: u8, score: f64, place: (&str, &str, u32), rest: Value| {
        let (component, file, line) = place;
        let key = format!("{component}:{file}:{line}");
        if ranked.iter().any(|(_, _, known, _)| *known == key) {
            return;
        }
        let mut object =
            json!({"component": component, "file": workshop.shown_file(file), "line": line, "score": number(score)});
        if let (Value::Object(object), Value::Object(rest)) = (&mut object, rest) {
            object.extend(rest);
        }
        ranked.push((rank, score, key, object));
    };
    let named = matches!(findings.status, Status::Named | Status::Sensor);
    for (insert, pass) in last.base.inserts.iter().zip(&findings.passes).filter(|_| named) {
        let fall = pass.tried.first().map_or(0.0, |tried| tried.fall);
        for site in &insert.sites {
            add(
                0,
                fall,
                (&site.path, &site.file, site.line),
                json!({"equation": &*site.words, "effect": insert.label()}),
            );
        }
    }
    let beaten = |tried: &Tried| !named && tried.fit.is_some() && tried.fall >= NEEDED;
    for tried in first.terms.iter().filter(|tried| beaten(tried)) {
        let Some((term, _)) = &tried.hypothesis.term else { continue };
        let rest = json!({"equation": term.equation, "shape": term.shape, "unit": term.unit});
        add(1, tried.fall, (&term.component, &term.file, term.line), rest);
    }
    for Located { term, score } in &first.located {
        let rest = json!({"equation": term.equation, "shape": term.shape, "coefficient": number(score.amplitude), "unit": term.unit});
        add(2, score.gain, (&term.component, &term.file, term.line), rest);
    }
    for tried in &first.tried {
        let (Some(insert), Some(look)) = (tried.hypothesis.inserts.last(), &tried.look) else { continue };
        for site in insert.sites.iter().take(1) {
            let rest = json!({"equation": &*site.words, "effect": insert.label()});
            add(2, look.score.gain, (&site.path, &site.file, site.line), rest);
        }
    }
    ranked.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    ranked.into_iter().map(|(.., value)| value).collect()
}

/// Terms that explain what no effect explains, the best first.
fn proposed(setup: &Setup, findings: &Findings, workshop: &Workshop<'_>) -> Result<Vec<Value>, Fault> {
    let Some(last) = findings.passes.last().filter(|_| findings.status == Status::Unknown) else {
        return Ok(Vec::new());
    };
    let mut values = Vec::new();
    for tried in last.terms.iter().filter(|tried| tried.fall >= NEEDED && tried.errors >= ERRORS) {
        let (Some((term, spread)), Some(fit)) = (&tried.hypothesis.term, &tried.fit) else { continue };
        let own = tried.hypothesis.problem(setup)?.unknowns.len() - 1;
        let error = fit.standard_error(own).map_or(f64::NAN, |error| error * spread);
        values.push(
            json!({"equation": term.equation, "component": &*term.component, "file": workshop.shown_file(&term.file),
            "line": term.line, "shape": term.shape, "unit": term.unit, "coefficient": number(fit.xi[own] * spread),
            "stderr": number(error), "fall": number(tried.fall), "misfit": number(fit.misfit / last.expected)}),
        );
    }
    Ok(values)
}

/// Scatter of the channels in units of the tables: as it was used, before the trigger, and its correlation.
fn noise(setup: &Setup) -> Value {
    let of = setup.data.channels.iter().map(|channel| {
        let (noise, scale) = (&channel.noise, channel.scale.abs());
        let quiet = noise.quiet.map(|quiet| quiet * scale);
        (channel.name.clone(), json!({"used": noise.sigma * scale, "before_trigger": quiet, "samples": noise.samples, "correlation": noise.rho}))
    });
    of.collect::<serde_json::Map<String, Value>>().into()
}

fn numbers(setup: &Setup, shots: &[usize]) -> Vec<usize> {
    shots.iter().map(|&shot| setup.data.shots[shot].number).collect()
}

/// The effects that were named.
fn effects(setup: &Setup, pass: &Pass) -> Result<Vec<Value>, Fault> {
    let problem = pass.base.problem(setup)?;
    let describe = |(number_of, candidate): (usize, &Candidate)| {
        let (effect, site) = (&candidate.effect, &candidate.sites[0]);
        let mut parameters = serde_json::Map::new();
        for (k, unknown) in
            problem.unknowns.iter().enumerate().filter(|(_, u)| u.effect.is_some_and(|part| part.effect == number_of))
        {
            let Meaning::Value { prior, .. } = &unknown.meaning else { continue };
            let error = pass.fit.standard_error(k).map_or(f64::NAN, |error| error * prior.slope(pass.fit.xi[k]).abs());
            let name = unknown.name.strip_prefix(&format!("{}.", effect.id)).unwrap_or(&unknown.name);
            parameters.insert(
                name.to_string(),
                json!({"value": number(prior.value(pass.fit.xi[k])), "stderr": number(error)}),
            );
        }
        json!({"id": &*effect.id, "kind": effect.kind.word(), "component": site.path, "equation": &*effect.words,
            "class": effect.class, "file": &*site.file, "line": site.line, "parameters": parameters})
    };
    Ok(pass.base.inserts.iter().enumerate().map(describe).collect())
}

/// Shot, channel, time, measured, base, extended, mask; units of the tables.
fn trajectories(setup: &Setup, findings: &Findings, (before, after): (&Gaps, Option<&Gaps>)) -> Result<String, Fault> {
    let mut text = String::from("shot,channel,time_s,measured,base,extended,mask\n");
    let (Some(first), Some(last)) = (findings.passes.first(), findings.passes.last()) else { return Ok(text) };
    let (base, extended) = (first.base.problem(setup)?, last.base.problem(setup)?);
    for shot in 0..setup.data.shots.len() {
        let pick = |gaps: &Gaps| match setup.train.contains(&shot) {
            true => Some(gaps.train.clone()),
            false => gaps.held_out.clone(),
        };
        let (Some(own), with) = (pick(before), after.and_then(pick)) else { continue };
        let data = &setup.data.shots[shot];
        for (channel, info) in setup.data.channels.iter().enumerate() {
            let Some(trace) = &data.traces[channel] else { continue };
            let plain = base.shown(&own.xi, &own.fit.runs, shot, channel);
            let more = with.as_ref().map(|gap| extended.shown(&gap.xi, &gap.fit.runs, shot, channel));
            for k in 0..data.times.len() {
                let measured = if trace.used[k] { format!("{}", trace.values[k] * info.scale) } else { String::new() };
                let more = more.as_ref().map_or(plain[k], |more| more[k]) * info.scale;
                // Writing to a String cannot fail.
                let _ = writeln!(
                    text,
                    "{},{},{},{measured},{:.8e},{more:.8e},{}",
                    data.number,
                    info.name,
                    data.times[k],
                    plain[k] * info.scale,
                    u8::from(!trace.used[k])
                );
            }
        }
    }
    Ok(text)
}

fn summary(
    (setup, workshop): (&Setup, &Workshop<'_>),
    findings: &Findings,
    (before, after): (&Gaps, Option<&Gaps>),
    seconds: f64,
) -> Result<String, Fault> {
    let mut text = String::new();
    let sentence = match findings.status {
        Status::Adequate => "adequate: nothing is missing; what is left is noise".to_string(),
        Status::Named | Status::Sensor => {
            let last = findings.passes.last();
            let names = last.map_or(Vec::new(), |pass| {
                pass.base.inserts.iter().map(|c| format!("{} ({})", c.label(), c.effect.words)).collect()
            });
            format!("{}: missing is {}", findings.status.word(), names.join(" and "))
        }
        Status::Ambiguous => {
            let names: Vec<String> = findings.ambiguous.iter().map(Candidate::label).collect();
            format!("ambiguous: these explain it equally well: {}", names.join(", "))
        }
        Status::Unknown => match &findings.resembles {
            Some(candidate) => format!(
                "unknown: something is missing that no library effect explains; it resembles {}",
                candidate.label()
            ),
            None => "unknown: something is missing that no library effect explains".to_string(),
        },
        Status::Unconverged => {
            "unconverged: the fits did not end where they could be compared; no name is given".to_string()
        }
    };
    let _ = writeln!(text, "{sentence}");
    if let Some(reason) = findings.reason {
        let _ = writeln!(text, "  no name, because {reason}");
    }
    for term in proposed(setup, findings, workshop)? {
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
    if let (Some(_), Some(last)) = (after, findings.passes.last()) {
        let problem = last.base.problem(setup)?;
        let _ = writeln!(text, "\nsizes");
        for (k, unknown) in problem.unknowns.iter().enumerate().filter(|(_, unknown)| unknown.effect.is_some()) {
            let xi = last.fit.xi[k];
            let error = last.fit.standard_error(k).map_or(f64::NAN, |error| error * unknown.slope(xi).abs());
            let _ = writeln!(text, "  {:34} {:10.4e} +- {error:.1e}", unknown.name, unknown.value(xi));
        }
    }
    let model = if after.is_some() { format!("; the model is {EXTENDED}") } else { String::new() };
    let _ = writeln!(text, "\n{} runs of one shot, {seconds:.1} s{model}", findings.runs);
    Ok(text)
}

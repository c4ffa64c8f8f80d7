//! The findings as JSON: `report.json`.

use serde_json::{Map, Value, json};

use super::sizes::Size;
use super::{AllGaps, Report, Scene, ShotFiles, course, disturbed, is_named, nearest, number, parameters, phases};
use crate::catalogue::Candidate;
use crate::evidence::further::further;
use crate::evidence::location::Located;
use crate::evidence::power::{Confusion, Power};
use crate::evidence::proof::Gap;
use crate::search::{Exact, Findings, Pass, Status, Tried};
use crate::terms::law::{Law, MemoryNumber, Rival};
use crate::unknowns::{EffectPart, Meaning};
use crate::variant::Workshop;
use crate::{Fault, Setup};

/// All of it.
pub(super) fn json(scene: &Scene<'_>, gaps: &AllGaps, seconds: f64) -> Result<Value, Fault> {
    let &Scene { setup, workshop, findings, last, .. } = scene;
    let effects = if gaps.after.is_some() { effects(scene)? } else { Vec::new() };
    let (before, after) = (&gaps.before, gaps.after.as_ref());
    let train = gap_json(setup, Some(&before.train), after.map(|gaps| &gaps.train));
    let held_out = gap_json(setup, before.held_out.as_ref(), after.and_then(|gaps| gaps.held_out.as_ref()));
    let mut whole = json!({
        "status": findings.status.word(),
        "sentence": super::summary::sentence(scene),
        "title": setup.study.title,
        "set": setup.bench.name,
        "model": workshop.class,
        "effects": effects,
        "ambiguous": findings.ambiguous.iter().map(|candidate| &*candidate.effect.id).collect::<Vec<_>>(),
        "further": further(setup, workshop, findings).iter().map(|own|
            json!({"measurement": own.words, "effects": [own.effects.0, own.effects.1], "apart": number(own.apart)})
        ).collect::<Vec<_>>(),
        "reason": findings.reason,
        "resembles": findings.resembles.as_ref().map(|candidate| &*candidate.effect.id),
        "unfitted": findings.unfitted.map(|(promise, needed)| json!({"promise": number(promise), "needed": needed})),
        "disturbed": disturbed::disturbed(scene, gaps),
        "remaining": disturbed::remaining(scene, gaps),
        "refuted": disturbed::refuted(findings),
        "alike": disturbed::alike(findings),
        "found_before": nearest::found_before(scene)?,
        "nearest": nearest::nearest(scene)?,
        "location": location(findings, workshop),
        "proposed": proposed(scene)?,
        "no_law": findings.no_law,
        "exact": exact(findings),
        "units": units(scene),
        "missing": course::missing_over_time(scene),
        "law": findings.law.as_ref().map(|own| law(scene, own)).transpose()?,
        "gap": {"train": train, "heldout": held_out},
        "phases": phases::phases(scene, gaps),
        "shots": {"train": numbers(setup, &setup.train), "heldout": numbers(setup, &setup.held_out),
            "heldout_at_first": numbers(setup, &setup.exposed)},
        "channels": channels(setup),
        "noise": noise(setup),
        "masked": masked(setup),
        "parameters": parameters::parameters(scene)?,
        "at_limit": parameters::at_limit(scene)?,
        "candidates": candidates(findings),
        "power": last.powers.iter().map(power).collect::<Vec<_>>(),
        "confusions": last.confusions.iter().map(confusion).collect::<Vec<_>>(),
        "attempts": findings.passes.iter().map(attempts).collect::<Vec<_>>(),
        "seed": findings.seed,
        "needed": number(findings.needed),
        "simulations": findings.runs,
        "whole_loops": setup.watch.whole_loops.load(std::sync::atomic::Ordering::Relaxed),
        "seconds": seconds,
    });
    whole["does_not_run"] = json!(last.fit.wall);
    Ok(whole)
}

/// The fits that a pass began with.
fn attempts(pass: &Pass) -> Vec<Value> {
    let own = pass.record.attempts.iter().map(|a| {
        json!({"start": a.start, "misfit": number(a.misfit), "cost": number(a.cost), "steps": a.steps, "converged": a.converged})
    });
    own.collect()
}

/// Parameters that the study takes as exact and that would explain what is missing.
fn exact(findings: &Findings) -> Vec<Value> {
    let own = |own: &Exact| {
        json!({"parameter": own.parameter, "unit": own.unit, "stated": number(own.stated), "value": number(own.value), "gap": {"before": number(own.gap[0]), "after": number(own.gap[1])},
            "words": super::summary::exact(own)})
    };
    findings.exact.iter().map(own).collect()
}

/// Units of other tools in the model, into which no search looks.
fn units(scene: &Scene<'_>) -> Vec<Value> {
    let blocks = scene.last.base.machine.blocks().iter();
    let one = |block: &hyd_compiler::ForeignBlock| {
        let words = format!(
            "the insides of `{}` cannot be looked at: terms and laws of its equations were not searched, only what it is given and what is \
             seen of it",
            block.file
        );
        json!({"path": &*block.path, "file": &*block.file, "words": words})
    };
    blocks.map(one).collect()
}

/// Files for runs of the model that was written.
pub(super) fn run<'a>(shots: &[ShotFiles], data: impl Iterator<Item = &'a String>) -> Value {
    let shots = shots.iter().map(|own| {
        let holds: Map<String, Value> =
            own.holds.iter().map(|(name, hold)| (name.clone(), hold.name().into())).collect();
        let shown = own.shown.iter().map(|channel| {
            // A range that does not end is null.
            json!({"channel": channel.name, "expression": channel.expression, "gain": channel.gain, "offset": channel.offset,
                "late": channel.late, "clock": channel.clock, "limits": [number(channel.limits.0), number(channel.limits.1)]})
        });
        json!({"shot": own.number, "parameters": own.file, "inputs": own.inputs.as_ref().map(|(name, _)| name),
            "options": own.options.trim_start(), "holds": holds, "start": own.span.0, "stop": own.span.1,
            "heldout": !own.is_fitted, "shown": shown.collect::<Vec<_>>()})
    });
    json!({"model": Report::MODEL, "shots": shots.collect::<Vec<_>>(), "data": data.collect::<Vec<_>>()})
}

/// A gap before and after, over all and by channel; after is before where nothing was added.
fn gap_json(setup: &Setup, before: Option<&Gap>, after: Option<&Gap>) -> Value {
    let Some(before) = before else { return Value::Null };
    let after_all = after.map_or(before.all, |gap| gap.all);
    let channels = setup.data.channels.iter().enumerate().map(|(k, channel)| {
        let after = after.map_or(before.channels[k], |gap| gap.channels[k]);
        (channel.name.clone(), json!({"before": number(before.channels[k]), "after": number(after)}))
    });
    json!({"before": number(before.all), "after": number(after_all), "channels": channels.collect::<Map<String, Value>>()})
}

fn candidates(findings: &Findings) -> Vec<Value> {
    let all = findings.passes.iter().enumerate().flat_map(|(pass, found)| {
        found.tried.iter().chain(&found.terms).map(move |tried| {
            let id = tried.hypothesis.own_id();
            json!({"pass": pass + 1, "id": id, "effect": tried.hypothesis.own_label(),
                "promise": tried.look.as_ref().map(|look| number(look.score.gain)),
                "probed": tried.look.as_ref().and_then(|look| look.probed.as_ref().map(|(cost_drop, _)| number(*cost_drop))),
                "alone": tried.look.as_ref().map(|look| number(look.alone)),
                "power": tried.look.as_ref().map(|look| number(look.score.power)),
                "left_by_nuisances": tried.look.as_ref().map(|look| number(look.score.left)),
                "fitted": tried.fit.is_some(), "misfit": tried.fit.as_ref().map(|fit| number(fit.misfit / found.expected)),
                "verdict": tried.verdict, "cost_drop": number(tried.cost_drop), "size_in_errors": tried.errors.map(number)})
        })
    });
    all.collect()
}

fn power(power: &Power) -> Value {
    json!({"id": &*power.id, "effect": power.effect, "typical": number(power.typical), "cost_drop": number(power.cost_drop),
        "left_by_nuisances": number(power.left), "chance": number(power.chance()), "smallest_visible": number(power.smallest())})
}

fn confusion(own: &Confusion) -> Value {
    json!({"effects": [own.effects.0, own.effects.1], "cosine": number(own.cosine), "apart": number(own.apart)})
}

pub(super) fn channels(setup: &Setup) -> Vec<Value> {
    let of = setup.data.channels.iter().map(|channel| {
        json!({"name": channel.name, "unit": channel.unit, "words": channel.words, "expression": channel.expression,
            "sigma": channel.noise.sigma * channel.scale.abs()})
    });
    of.collect()
}

/// Share of the samples that are left out, by channel.
pub(super) fn masked(setup: &Setup) -> Value {
    let share = |channel: usize| {
        let traces = || setup.data.shots.iter().filter_map(move |shot| shot.traces[channel].as_ref());
        let (all, used) = traces().fold((0, 0), |(all, used), trace| {
            (all + trace.used.len(), used + trace.used.iter().filter(|used| **used).count())
        });
        1.0 - f64::from(used as u32) / f64::from(all.max(1) as u32)
    };
    let of = setup.data.channels.iter().enumerate().map(|(k, channel)| (channel.name.clone(), json!(share(k))));
    of.collect::<Map<String, Value>>().into()
}

/// Equations and places, the likeliest first: those of effects that were named, those of terms that were fitted by the
/// drop of the cost, then the others by how much it would drop with the best term of the equation or the best effect of
/// the place.
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
    let named = is_named(findings.status);
    if let Some((law, first)) = findings.law.as_ref().and_then(|own| Some((own, &own.terms.first()?.term))) {
        let rest = json!({"equation": first.equation, "shape": law.shape(), "unit": first.unit, "id": &*law.candidate.effect.id,
            "effect": law.candidate.label()});
        add(0, f64::INFINITY, (&first.component, &first.file, first.line), rest);
    }
    for insert in last.base.inserts.iter().filter(|_| named) {
        let is_own = |tried: &&Tried| tried.hypothesis.ends_with(insert);
        // The pass that named it; which one that was an effect taken out again does not tell.
        let cost_drops =
            findings.passes.iter().flat_map(|pass| pass.tried.iter().filter(is_own)).map(|tried| tried.cost_drop);
        let cost_drop = cost_drops.fold(0.0, f64::max);
        for site in &insert.sites {
            add(
                0,
                cost_drop,
                (&site.path, &site.file, site.line),
                json!({"equation": &*site.words, "components": site.components(), "id": &*insert.effect.id, "effect": insert.label()}),
            );
        }
    }
    let beaten = |tried: &Tried| !named && tried.fit.is_some() && tried.cost_drop >= findings.needed;
    for tried in first.terms.iter().filter(|tried| beaten(tried)) {
        let Some((term, _)) = tried.hypothesis.terms.last() else { continue };
        let rest = json!({"equation": term.equation, "shape": term.shape, "unit": term.unit});
        add(1, tried.cost_drop, (&term.component, &term.file, term.line), rest);
    }
    for Located { term, score } in &first.located {
        let rest = json!({"equation": term.equation, "shape": term.shape, "coefficient": number(score.amplitude), "unit": term.unit});
        add(2, score.gain, (&term.component, &term.file, term.line), rest);
    }
    for tried in &first.tried {
        let (Some(insert), Some(look)) = (tried.hypothesis.inserts.last(), &tried.look) else { continue };
        for site in insert.sites.iter().take(1) {
            let rest = json!({"equation": &*site.words, "components": site.components(), "id": &*insert.effect.id, "effect": insert.label()});
            add(2, look.score.gain, (&site.path, &site.file, site.line), rest);
        }
    }
    ranked.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    ranked.into_iter().map(|(.., value)| value).collect()
}

/// Terms that explain what no effect explains, the best first.
pub(super) fn proposed(scene: &Scene<'_>) -> Result<Vec<Value>, Fault> {
    let &Scene { setup, workshop, last, findings, .. } = scene;
    if findings.status != Status::Unknown {
        return Ok(Vec::new());
    }
    let mut values = Vec::new();
    for tried in last.terms.iter().filter(|tried| tried.cost_drop >= findings.needed && tried.has_size()) {
        let (Some((term, spread)), Some(fit)) = (tried.hypothesis.terms.last(), &tried.fit) else { continue };
        let own = tried.hypothesis.problem(setup)?.unknowns.len() - 1;
        let error = fit.standard_error(own).map_or(f64::NAN, |error| error * spread);
        values.push(
            json!({"equation": term.equation, "component": &*term.component, "file": workshop.shown_file(&term.file),
            "line": term.line, "shape": term.shape, "unit": term.unit, "coefficient": number(fit.xi[own] * spread),
            "stderr": number(error), "cost_drop": number(tried.cost_drop), "misfit": number(fit.misfit / last.expected)}),
        );
    }
    Ok(values)
}

/// The law that was found: its equation, and the coefficients as the last fit has them.
fn law(scene: &Scene<'_>, own: &Law) -> Result<Value, Fault> {
    let (problem, fit) = (scene.last.base.problem(scene.setup)?, &scene.last.fit);
    let Some(first) = own.terms.first().map(|own| &own.term) else { return Ok(Value::Null) };
    let number_of = scene.last.base.inserts.iter().position(|insert| insert.is_same(&own.candidate));
    let terms = own.terms.iter().enumerate().map(|(parameter, own)| {
        let part = number_of.map(|effect| EffectPart { effect, parameter });
        let at = problem.unknowns.iter().position(|unknown| part.is_some() && unknown.effect == part);
        let value = at.map_or(own.value, |k| problem.unknowns[k].value(fit.xi[k]));
        let error = at.and_then(|k| Some(fit.standard_error(k)? * problem.unknowns[k].slope(fit.xi[k]).abs()));
        json!({"shape": own.term.shape, "unit": own.term.unit, "coefficient": number(value), "stderr": number(error.unwrap_or(own.error))})
    });
    let memory = own.memory.as_ref().map(|memory| {
        let number_of = |(k, own_number): (usize, &MemoryNumber)| {
            let part = number_of.map(|effect| EffectPart { effect, parameter: own.terms.len() + k });
            let at = problem.unknowns.iter().position(|unknown| part.is_some() && unknown.effect == part);
            let value = at.map_or(own_number.value, |k| problem.unknowns[k].value(fit.xi[k]));
            let error = at.and_then(|k| Some(fit.standard_error(k)? * problem.unknowns[k].slope(fit.xi[k]).abs()));
            json!({"name": own_number.name, "what": own_number.words, "unit": own_number.unit, "value": number(value),
                "stderr": number(error.unwrap_or(f64::NAN))})
        };
        let numbers: Vec<Value> = memory.numbers.iter().enumerate().map(number_of).collect();
        json!({"equations": memory.equations, "numbers": numbers})
    });
    let rival = |own: &Rival| json!({"equation": own.equation, "shape": own.shape, "behind": number(own.behind)});
    let rivals = own.rivals.iter().map(rival);
    Ok(json!({"class": own.name, "text": own.file(), "equation": first.equation, "with": own.equation(),
        "component": &*first.component, "file": scene.workshop.shown_file(&first.file), "line": first.line,
        "terms": terms.collect::<Vec<_>>(), "memory": memory, "rivals": rivals.collect::<Vec<_>>()}))
}

/// Scatter of the channels in units of the tables: as it was used, before the trigger, and its correlation.
pub(super) fn noise(setup: &Setup) -> Value {
    let of = setup.data.channels.iter().map(|channel| {
        let (noise, scale) = (&channel.noise, channel.scale.abs());
        let quiet = noise.quiet.map(|quiet| quiet * scale);
        (channel.name.clone(), json!({"used": noise.sigma * scale, "before_trigger": quiet, "samples": noise.samples, "correlation": noise.rho}))
    });
    of.collect::<Map<String, Value>>().into()
}

pub(super) fn numbers(setup: &Setup, shots: &[usize]) -> Vec<usize> {
    shots.iter().map(|&shot| setup.data.shots[shot].number).collect()
}

/// The effects that were named.
fn effects(scene: &Scene<'_>) -> Result<Vec<Value>, Fault> {
    let (setup, pass) = (scene.setup, scene.last);
    let problem = pass.base.problem(setup)?;
    let describe = |(number_of, candidate): (usize, &Candidate)| {
        let (effect, site) = (&candidate.effect, &candidate.sites[0]);
        let mut parameters = Map::new();
        for (k, unknown) in
            problem.unknowns.iter().enumerate().filter(|(_, u)| u.effect.is_some_and(|part| part.effect == number_of))
        {
            let Meaning::Value { places, .. } = &unknown.meaning else { continue };
            let name = unknown.name.strip_prefix(&format!("{}.", effect.id)).unwrap_or(&unknown.name);
            let mut size = Size::of(&problem, &pass.fit, k, effect).json();
            size["parameters"] = places.iter().map(|&place| problem.places[place].name()).collect::<Vec<_>>().into();
            parameters.insert(name.to_string(), size);
        }
        json!({"id": &*effect.id, "effect": candidate.label(), "kind": effect.kind.word(), "component": candidate.place(), "components": candidate.components(), "equation": &*effect.words,
            "class": effect.class, "file": &*site.file, "line": site.line, "parameters": parameters})
    };
    Ok(pass.base.inserts.iter().enumerate().map(describe).collect())
}

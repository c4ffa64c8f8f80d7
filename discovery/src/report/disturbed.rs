//! What was taken up beside the machine, and how much is left: noise larger than stated, hum, drift, lag, a wrong clock, the end of
//! a range, scatter, spikes, model error.

use serde_json::{Value, json};

use super::{AllGaps, Scene, number};
use crate::catalogue::Kind;
use crate::data::{Data, Trace};
use crate::disturbance::{Added, Course, Level, ROOM, Spike};
use crate::magnitude::shown;
use crate::search::{Alike, Findings, Refuted, Status};
use crate::unknowns::Meaning;

/// A channel with a gap below this is noisier by what was stated than it is.
const OVERSTATED: f64 = 0.6;
/// Drift beyond what sensors of industry state (one to two per cent of their span): part of the range of the channel, and standard deviations of its
/// noise where it shows little else.
const USUAL_DRIFT: (f64, f64) = (0.02, 20.0);
/// Drifts of two channels are alike where their cosine is larger in size than this: of six random numbers each it is by chance in one of a hundred cases.
const ALIKE: f64 = 0.9;
/// Sizes that differ by less than this share are about equal.
const SAME: f64 = 0.1;
/// Fewest numbers of which this can be said.
const FEWEST_ALIKE: usize = 6;
/// Spikes that are listed.
const MOST: usize = 10;
/// Share of the excess below which what is left is not worth a sentence where it is next to nothing beside noise, too.
const ALL: f64 = 0.02;
/// The same in the variance of the noise.
const BESIDE_NOISE: f64 = 0.2;

/// Gap on shots held out (in noise) from which on what is named has to show something there, and the share of it that hardly differs from all
/// (roots of a mean square of 25 and of 0.8, as for further effects in `search/withdraw.rs`).
const LARGE: f64 = 5.0;
const HARDLY: f64 = 0.894_427_190_999_915_9;
/// Factor on the stated noise from which a sentence says so.
const WORTH_IT: f64 = 1.05;

/// Everything that disturbs, as data and as sentences.
pub(super) fn disturbed(scene: &Scene<'_>, gaps: &AllGaps) -> Value {
    let (data, found) = (&scene.setup.data, &scene.setup.disturbances);
    let name = |channel: usize| data.channels[channel].name.as_str();
    let unit = |channel: usize| data.channels[channel].unit.as_str();
    let mut sentences: Vec<String> = Vec::new();
    let mut levels = Vec::new();
    for (channel, level) in found.levels.iter().enumerate().filter(|(_, level)| !level.is_noise()) {
        let size = level.size * data.channels[channel].noise.sigma * data.channels[channel].scale.abs();
        levels.push(json!({"channel": name(channel), "size": number(size), "of_noise": number(level.size),
            "samples": number(level.length), "bursts": number(level.bursts), "white": level.is_white()}));
        if level.is_white() {
            // What rounds to the noise as stated is no news.
            let words = format!("noise of {} is {:.1} times what was stated", name(channel), level.size);
            sentences.extend((level.size >= WORTH_IT).then_some(words));
        } else {
            sentences.push(format!(
                "what every model leaves in {} is {size:.2e} {} ({:.1} times the noise), alike over {:.0} samples",
                name(channel),
                unit(channel),
                level.size,
                level.length
            ));
        }
    }
    let left = &gaps.after.as_ref().unwrap_or(&gaps.before).train.channels;
    for (channel, gap) in left.iter().enumerate().filter(|(_, gap)| **gap < OVERSTATED) {
        let words = "stated smaller, it hides less";
        sentences.push(format!("noise of {} is no more than {gap:.2} times what was stated: {words}", name(channel)));
    }
    let mut added = Vec::new();
    for own in &found.added {
        let sigma = own.sigma * data.channels[own.channel].scale.abs();
        let (kind, words) = match own.added {
            Added::Drift => ("drift", "drift".to_string()),
            Added::Hum(frequency) => ("hum", format!("hum of {frequency} Hz")),
        };
        let frequency = if let Added::Hum(frequency) = own.added { number(frequency) } else { Value::Null };
        let channel = name(own.channel);
        added.push(json!({"channel": channel, "kind": kind, "frequency": frequency, "amplitude": number(sigma)}));
        let (info, size) = (&data.channels[own.channel], own.sigma / ROOM);
        let is_too_much =
            own.added == Added::Drift && size > USUAL_DRIFT.0 * info.range && size > USUAL_DRIFT.1 * info.noise.sigma;
        let doubt = match is_too_much {
            true => ", which is more than measuring chains drift: the model may lack something slow",
            false => "",
        };
        sentences.push(format!("{words} in {channel}, about {sigma:.1e} {}{doubt}", unit(own.channel)));
    }
    for (one, other) in drifting_alike(scene) {
        sentences.push(format!(
            "{} and {} drift alike, which measuring chains of their own do not: the model may lack something slow, or a parameter differs from shot to shot",
            name(one),
            name(other)
        ));
    }
    sentences.extend(chains_alike(scene));
    let mut scatter = Vec::new();
    for own in &found.scatter {
        scatter.push(json!({"parameter": own.label, "relative": number(own.sigma)}));
        sentences.push(format!("{} scatters from shot to shot by about {:.1} %", own.label, 100.0 * own.sigma));
    }
    let clipped = clipped(data, &mut sentences);
    let timing = timing(scene, &mut sentences);
    let close: Vec<String> = scene.findings.ambiguous.iter().map(crate::catalogue::Candidate::label).collect();
    if scene.findings.status != Status::Ambiguous && close.len() > 1 {
        sentences.push(format!("these explain equally well what is left: {}", close.join(", ")));
    }
    if !scene.findings.is_settled {
        let words = "what every model leaves still changed in the last round of the search: sizes and correlations above are not its last word";
        sentences.push(words.to_string());
    }
    if let Some(named) = &scene.findings.given_up {
        sentences.push(format!(
            "a further round of the search named {named} and left more, which was given up as another local minimum"
        ));
    }
    if let Some(words) = spikes_in_words(scene, &found.spikes) {
        sentences.push(words);
    }
    if let Some(share) = unseen(scene.findings, gaps) {
        sentences.push(format!(
            "shots held out neither show nor refute what is named: {:.1} % of the gap there is left, by something else that differs between the shots",
            100.0 * share
        ));
    }
    let spike = |own: &Spike| {
        let shot = &data.shots[own.shot];
        json!({"shot": shot.number, "channel": name(own.channel), "time": number(shot.times[own.sample])})
    };
    let spikes: Vec<Value> = found.spikes.iter().map(spike).collect();
    json!({"levels": levels, "added": added, "scatter": scatter, "spikes": spikes, "timing": timing, "clipped": clipped,
        "sentences": sentences})
}

/// Pairs of channels whose drifts follow each other from shot to shot, by the last fit.
fn drifting_alike(scene: &Scene<'_>) -> Vec<(usize, usize)> {
    let Ok(problem) = scene.last.base.problem(scene.setup) else { return Vec::new() };
    let drifting: Vec<usize> =
        scene.setup.disturbances.added.iter().filter(|own| own.added == Added::Drift).map(|own| own.channel).collect();
    // Offset and change of every record, in the order of the shots; waves are no drift.
    let of = |wanted: usize| -> Vec<f64> {
        let own = problem.unknowns.iter().zip(&scene.last.fit.xi);
        own.filter_map(|(unknown, &xi)| match unknown.meaning {
            Meaning::Course { channel, course, .. }
                if channel == wanted && matches!(course, Course::Offset | Course::Drift { .. }) =>
            {
                Some(xi)
            }
            _ => None,
        })
        .collect()
    };
    let pairs = drifting.iter().enumerate().flat_map(|(k, &a)| drifting[k + 1..].iter().map(move |&b| (a, b)));
    pairs.filter(|&(a, b)| are_alike(&of(a), &of(b))).collect()
}

/// True for numbers that follow each other, in either direction.
fn are_alike(a: &[f64], b: &[f64]) -> bool {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    a.len() >= FEWEST_ALIKE && a.len() == b.len() && dot(a, b).abs() > ALIKE * (dot(a, a) * dot(b, b)).sqrt()
}

/// A sentence where every channel has one effect of the measuring chain with about the same size: as many sensors do not err alike.
fn chains_alike(scene: &Scene<'_>) -> Option<String> {
    let (base, xi) = (&scene.last.base, &scene.last.fit.xi);
    let problem = base.problem(scene.setup).ok()?;
    let size = |number: usize| {
        let is_size =
            |k: &usize| problem.unknowns[*k].effect.is_some_and(|own| (own.effect, own.parameter) == (number, 0));
        (0..problem.unknowns.len()).find(is_size).map(|k| problem.unknowns[k].value(xi[k]))
    };
    let count = scene.setup.data.channels.len();
    for first in &base.inserts {
        let own = base.inserts.iter().enumerate().filter(|(_, own)| own.effect.id == first.effect.id);
        let own: Vec<(f64, String)> = own.filter_map(|(k, own)| Some((size(k)?, own.label()))).collect();
        let (least, most) =
            own.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), (v, _)| (l.min(*v), m.max(*v)));
        let is_alike = most - least <= SAME * most.abs().max(least.abs());
        if first.effect.kind == Kind::Sensor && count > 1 && own.len() == count && is_alike {
            let labels: Vec<&str> = own.iter().map(|(_, label)| label.as_str()).collect();
            return Some(format!(
                "{} are about equal: one cause in what drives the model, as a command, an input or the trigger, is likelier than as many in its sensors",
                labels.join(" and ")
            ));
        }
    }
    None
}

/// Channels that lag and a clock that runs fast, by the last fit.
fn timing(scene: &Scene<'_>, sentences: &mut Vec<String>) -> Value {
    let Ok(problem) = scene.last.base.problem(scene.setup) else { return Value::Null };
    let mut all = Vec::new();
    for (unknown, &xi) in problem.unknowns.iter().zip(&scene.last.fit.xi) {
        let value = unknown.value(xi);
        match unknown.meaning {
            Meaning::Lag { channel, .. } => {
                let name = &problem.data.channels[channel].name;
                let word = if value < 0.0 { "early" } else { "late" };
                let beside = match problem.data.channels.len() {
                    1 if !scene.setup.study.inputs.is_empty() => "the inputs",
                    1 => "the trigger",
                    _ => "the other channels",
                };
                sentences.push(format!(
                    "{name} is {:.2e} s {word} beside {beside}: a lag of its measuring chain",
                    value.abs()
                ));
                all.push(json!({"channel": name, "seconds": number(value)}));
            }
            Meaning::Clock { .. } => {
                let word = if value < 0.0 { "slow" } else { "fast" };
                sentences.push(format!("the clock of the records runs {word} by {:.2} %", 100.0 * value.abs()));
                all.push(json!({"clock": number(value)}));
            }
            _ => {}
        }
    }
    Value::Array(all)
}

/// Where the range of a channel ends, and how many samples stand there.
fn clipped(data: &Data, sentences: &mut Vec<String>) -> Value {
    let mut all = Vec::new();
    for (channel, info) in data.channels.iter().enumerate() {
        for limit in [info.limits.0, info.limits.1].into_iter().filter(|limit| limit.is_finite()) {
            let values = data.shots.iter().filter_map(|shot| shot.traces[channel].as_ref());
            let there =
                |trace: &Trace| trace.values.iter().zip(&trace.used).filter(|&(&v, &used)| used && v == limit).count();
            let samples: usize = values.map(there).sum();
            if samples == 0 {
                continue;
            }
            let end = limit * info.scale;
            all.push(json!({"channel": info.name, "value": number(end), "samples": samples}));
            let words = format!("{} shows nothing beyond {} {}", info.name, shown(end), info.unit);
            sentences.push(format!(
                "{}, where {samples} samples stand: the model is compared up to there",
                words.trim_end()
            ));
        }
    }
    Value::Array(all)
}

fn spikes_in_words(scene: &Scene<'_>, spikes: &[Spike]) -> Option<String> {
    if spikes.is_empty() {
        return None;
    }
    let data = &scene.setup.data;
    let one = |own: &Spike| {
        let shot = &data.shots[own.shot];
        format!("shot {} {} at {} s", shot.number, data.channels[own.channel].name, shot.times[own.sample])
    };
    let listed: Vec<String> = spikes.iter().take(MOST).map(one).collect();
    let more = if spikes.len() > MOST { format!(", and {} more", spikes.len() - MOST) } else { String::new() };
    Some(format!("left out as spikes: {}{more}", listed.join(", ")))
}

/// How much of the gap is left after what was named, and what it looks like; null where nothing was named or nothing is left.
pub(super) fn remaining(scene: &Scene<'_>, gaps: &AllGaps) -> Value {
    let Some(after) = gaps.after.as_ref().filter(|_| super::is_named(scene.findings.status)) else {
        return Value::Null;
    };
    let excess = |gap: f64| (gap * gap - 1.0).max(0.0);
    let left = excess(after.train.all);
    let share = left / excess(gaps.before.train.all).max(f64::MIN_POSITIVE);
    if share.is_nan() || (share <= ALL && left <= BESIDE_NOISE) {
        return Value::Null;
    }
    let levels = &scene.setup.disturbances.levels;
    let is_open = scene.last.tried.iter().chain(&scene.last.terms).any(|own| own.cost_drop >= scene.findings.needed);
    let looks_like = match levels.is_empty() {
        _ if is_open => "another effect",
        true => "noise",
        false if levels.iter().all(Level::is_white) => "noise, more than stated",
        false => "model error",
    };
    let located = scene.last.located.first().map(|own| own.term.equation.clone());
    let amount = if share < 0.01 { "less than 1 %".to_string() } else { format!("{:.0} %", 100.0 * share) };
    let sentence = format!("remaining: {amount} of the excess over noise, which looks like {looks_like}");
    json!({"share": number(share), "looks_like": looks_like, "first_place": located, "sentence": sentence})
}

/// The share of a large gap on shots held out that is left with what was named, if that is nearly all of it.
fn unseen(findings: &Findings, gaps: &AllGaps) -> Option<f64> {
    let is_named = matches!(findings.status, Status::Named | Status::Sensor | Status::Law);
    let (before, after) = (gaps.before.held_out.as_ref()?.all, gaps.after.as_ref()?.held_out.as_ref()?.all);
    (is_named && shows_nothing(before, after)).then_some(after / before)
}

/// True if gaps on shots held out, without and with what was named, are large and hardly differ.
fn shows_nothing(before: f64, after: f64) -> bool {
    before > LARGE && after > HARDLY * before
}

/// Effects that shots held out refuted.
pub(super) fn refuted(findings: &Findings) -> Vec<Value> {
    let describe = |own: &Refuted| {
        let (effect, words) = (own.candidate.label(), &*own.candidate.effect.words);
        let sentence = match own.by > 1.0 {
            true => format!(
                "refuted by the shots held out: {effect} ({words}), with which the gap there is {:.2} times as large",
                own.by
            ),
            false => format!(
                "not supported by the shots held out: {effect} ({words}), with which {:.0} % of the gap there is left",
                100.0 * own.by
            ),
        };
        json!({"id": &*own.candidate.effect.id, "effect": effect, "words": words, "gap_times": number(own.by), "sentence": sentence})
    };
    findings.refuted.iter().map(describe).collect()
}

/// Effects that explain about as much in the place of named ones.
pub(super) fn alike(findings: &Findings) -> Vec<Value> {
    let describe = |own: &Alike| {
        let (named, effect, words) = (own.named.label(), own.candidate.label(), &*own.candidate.effect.words);
        let sentence = format!(
            "in the place of {named}, {effect} ({words}) would explain about as much: the cost would be {} by {:.0}",
            if own.behind < 0.0 { "smaller" } else { "larger" },
            own.behind.abs()
        );
        json!({"id": &*own.candidate.effect.id, "effect": effect, "named": named, "words": words, "behind": number(own.behind),
            "sentence": sentence})
    };
    findings.alike.iter().map(describe).collect()
}

/// The lines of the summary.
pub(super) fn lines(json: &Value, status: Status) -> Vec<String> {
    let sentences = json["disturbed"]["sentences"].as_array().into_iter().flatten();
    let mut lines: Vec<String> = sentences.filter_map(|own| own.as_str().map(String::from)).collect();
    let remaining = &json["remaining"];
    if let (true, Some(sentence)) = (super::is_named(status), remaining["sentence"].as_str()) {
        let place =
            remaining["first_place"].as_str().map_or_else(String::new, |at| format!(", first of all at `{at}`"));
        lines.push(format!("{sentence}{place}"));
    }
    for key in ["refuted", "alike"] {
        let all = json[key].as_array().into_iter().flatten();
        lines.extend(all.filter_map(|own| own["sentence"].as_str().map(String::from)));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::are_alike;

    #[test]
    fn numbers_that_follow_each_other_are_alike() {
        let own = [1.0, -0.5, 2.0, 0.3, -1.2, 0.8];
        let other = own.map(|value| -3.0 * value + 0.1);
        assert!(are_alike(&own, &other) && are_alike(&own, &own));
        assert!(!are_alike(&own, &[0.5, 1.0, -0.3, 0.9, 0.7, -1.1]) && !are_alike(&own, &[0.0; 6]));
        // Two shots are too few to tell.
        assert!(!are_alike(&own[..4], &other[..4]));
    }
}

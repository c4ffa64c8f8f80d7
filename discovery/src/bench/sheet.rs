//! What a set shows before any model, as data for a page: curves, findings by shot and channel, sentences on what stands out.
//!
//! Curves are thinned to the smallest and largest value of each of some hundred parts, so that spikes stay in sight.  Shots repeat each
//! other where all recorded conditions are equal but the number and the clock.

use std::collections::BTreeMap;

use hyd_system::math::hypot;
use serde_json::{Value, json};

use crate::bench::Shot;
use crate::magnitude::shown;
use crate::record::{Findings, MAINS, drift, examine, repeats, sampling};
use crate::{Bench, Fault, Study};

/// Parts of a thinned curve.
const PARTS: usize = 500;
/// Significant digits of a curve: more than a screen shows.
const DIGITS: usize = 5;
/// Stated noise and that of the differences may differ by this factor.
const FACTOR: f64 = 1.5;
/// Noise before the trigger may be larger than that of the differences by this factor.
const CORRELATED: f64 = 1.3;
/// Spikes that are marked in one curve.
const MOST_MARKS: usize = 200;
/// Words in the names of conditions that tell shots apart and do not make them different.
const CLOCKS: [&str; 5] = ["minutes", "since", "date", "clock", "time_of_day"];

impl Study {
    /// A study of all columns of some tables, for sets that are looked at without one.
    ///
    /// # Errors
    /// When there is no column besides the times.
    pub fn of_columns(headers: &[Vec<String>]) -> Result<Study, Fault> {
        let first = headers.first().ok_or_else(|| Fault::new("the set holds no shots"))?;
        let is_time = |name: &&String| matches!(name.as_str(), "time_s" | "time" | "t");
        let time = first.iter().find(is_time).or(first.first()).cloned().unwrap_or_default();
        let quoted = |text: &str| toml::Value::String(text.to_string()).to_string();
        let mut names: Vec<&String> =
            headers.iter().flatten().filter(|name| **name != time && !name.is_empty()).collect();
        names.sort();
        names.dedup();
        let channels: Vec<String> =
            names.iter().map(|name| format!("{0} = {{ variable = {0} }}\n", quoted(name))).collect();
        if channels.is_empty() {
            return Err(Fault::new("the tables hold no column besides the times"));
        }
        Study::parse(&format!(
            "file = \"-\"\n[models]\ndefault = \"M\"\n[channels]\n{}[shots]\ntime = {}\n",
            channels.concat(),
            quoted(&time)
        ))
    }

    /// The data of a page on a set.
    pub fn sheet(&self, bench: &Bench) -> Value {
        let groups = groups(&bench.shots);
        let names: Vec<&String> = self
            .channels
            .keys()
            .filter(|name| bench.shots.iter().any(|shot| shot.values.contains_key(*name)))
            .collect();
        let channels: Vec<Value> = names.iter().map(|name| channel(bench, self, name, &groups)).collect();
        let shots: Vec<Value> = bench
        .shots
        .iter()
        .map(|shot| {
            let own = sampling(&shot.times);
            json!({"number": shot.number, "file": shot.file, "samples": shot.times.len(), "from": shot.times.first(),
                "to": shot.times.last(), "period": own.as_ref().map(|own| own.period),
                "uneven": own.as_ref().map(|own| own.uneven), "conditions": shot.conditions})
        })
        .collect();
        let groups: Vec<Vec<usize>> =
            groups.iter().map(|group| group.iter().map(|&k| bench.shots[k].number).collect()).collect();
        json!({"set": bench.name, "title": self.title, "shots": shots, "channels": channels, "groups": groups})
    }
}

/// Positions of shots that repeat each other.
fn groups(shots: &[Shot]) -> Vec<Vec<usize>> {
    let decides = |name: &str| name != "shot" && !CLOCKS.iter().any(|word| name.to_lowercase().contains(word));
    let mut groups: BTreeMap<Vec<(String, u64)>, Vec<usize>> = BTreeMap::new();
    for (k, shot) in shots.iter().enumerate() {
        let own = shot.conditions.iter().filter(|(name, _)| decides(name));
        groups.entry(own.map(|(name, value)| (name.clone(), value.to_bits())).collect()).or_default().push(k);
    }
    // Shots about which nothing is recorded are not known to repeat each other.
    let known = groups.into_iter().filter(|(conditions, group)| !conditions.is_empty() && group.len() > 1);
    let mut groups: Vec<Vec<usize>> = known.map(|(_, group)| group).collect();
    groups.sort();
    groups
}

fn channel(bench: &Bench, study: &Study, name: &str, groups: &[Vec<usize>]) -> Value {
    let stated = study.channels.get(name);
    let unit = stated.map_or("", |own| own.unit.as_str());
    let found: Vec<(usize, Findings)> = bench
        .shots
        .iter()
        .enumerate()
        .filter_map(|(k, shot)| Some((k, examine(&shot.times, shot.values.get(name)?, 0.0)?)))
        .collect();
    let noise = bench.noise.get(name).copied().or(stated.and_then(|own| own.noise));
    let step = bench.quantisation.get(name).copied().or(stated.and_then(|own| own.quantisation)).unwrap_or(0.0);
    let noise = noise.map(|noise| hypot(noise, step / 12.0_f64.sqrt()));
    let repeated: Vec<Value> = groups
        .iter()
        .filter_map(|group| {
            let records = group.iter().filter_map(|&k| Some((&bench.shots[k].times[..], &bench.shots[k].values.get(name)?[..])));
            let own = repeats(&records.collect::<Vec<_>>())?;
            let numbers: Vec<usize> = group.iter().map(|&k| bench.shots[k].number).collect();
            Some(json!({"shots": numbers, "sigma": own.sigma, "level": own.level, "largest": own.largest, "time": own.time}))
        })
        .collect();
    let notes = notes(bench, &found, noise, unit);
    let shots: Vec<Value> = found
        .iter()
        .map(|(k, own)| {
            let shot = &bench.shots[*k];
            let (times, values) = thinned(&shot.times, &shot.values[name]);
            finding(shot.number, own, times, values)
        })
        .collect();
    json!({"name": name, "words": stated.map_or("", |own| own.words.as_str()), "unit": unit, "stated": noise,
        "noise": middle(found.iter().filter_map(|(_, own)| Some(own.scatter?.sigma))),
        "quiet": middle(found.iter().filter_map(|(_, own)| Some(own.quiet?.sigma))), "notes": notes, "shots": shots,
        "repeats": repeated})
}

/// The findings of one shot with its curve.
fn finding(number: usize, own: &Findings, times: Vec<Value>, values: Vec<Value>) -> Value {
    let line = own.hum.iter().filter(|line| line.stands_out).max_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
    let clipped = own.clipping.map(|own| [own.top, own.bottom]).into_iter().flatten().flatten();
    let clipped: Vec<Value> = clipped
        .map(|limit| json!({"value": limit.value, "samples": limit.samples, "longest": limit.longest}))
        .collect();
    let marks: Vec<Value> =
        own.spikes.iter().take(MOST_MARKS).map(|spike| json!({"time": spike.time, "height": spike.height})).collect();
    let stuck: Vec<Value> =
        own.stuck.iter().map(|own| json!({"time": own.time, "samples": own.samples, "value": own.value})).collect();
    json!({"number": number, "times": times, "values": values, "low": own.range.0, "high": own.range.1,
        "noise": own.scatter.map(|own| own.sigma), "step": own.scatter.and_then(|own| own.step),
        "quiet": own.quiet.map(|own| own.sigma), "level": own.quiet.map(|own| own.level),
        "drift": own.drift.filter(|own| own.stands_out()).map(|own| own.change),
        "hum": line.map(|line| json!({"frequency": line.frequency, "amplitude": line.amplitude})),
        "hum_seen": own.hum.iter().any(|line| MAINS.contains(&line.frequency)), "spikes": own.spikes.len(), "marks": marks, "stuck": stuck,
        "gaps": own.gaps.iter().map(|gap| gap.missing).sum::<usize>(), "clipped": clipped})
}

/// Sentences on what stands out of one channel.
fn notes(bench: &Bench, found: &[(usize, Findings)], stated: Option<f64>, unit: &str) -> Vec<String> {
    let number = |k: &usize| bench.shots[*k].number.to_string();
    let listed = |which: &dyn Fn(&Findings) -> bool| -> Vec<String> {
        found.iter().filter(|(_, own)| which(own)).map(|(k, _)| number(k)).collect()
    };
    let value = |value: f64| format!("{} {unit}", shown(three(value))).trim_end().to_string();
    let mut notes = Vec::new();
    let noise = middle(found.iter().filter_map(|(_, own)| Some(own.scatter?.sigma)));
    let bounds = found.iter().filter(|(_, own)| own.scatter.is_some_and(|scatter| !scatter.is_settled)).count();
    let is_bound = 2 * bounds > found.len();
    // A bound above what is stated says nothing.
    if let (Some(noise), Some(stated)) = (noise, stated)
        && !(stated / FACTOR..=stated * FACTOR).contains(&noise)
        && !(is_bound && noise > stated)
    {
        let (own, stated) = (value(noise), value(stated));
        notes.push(format!("the stated noise is {stated}, the differences of neighbouring samples show {own}"));
    }
    if is_bound {
        notes.push(
            "it changes too fast between samples to tell its noise, of which the differences show a bound".to_string(),
        );
    }
    let quiet = middle(found.iter().filter_map(|(_, own)| Some(own.quiet?.sigma)));
    if let (Some(noise), Some(quiet)) = (noise, quiet)
        && quiet > CORRELATED * noise
    {
        let (noise, quiet) = (value(noise), value(quiet));
        notes.push(format!(
            "before the trigger it scatters by {quiet}, neighbouring samples by {noise}: its noise is correlated, or it hums"
        ));
    }
    let mut lines: BTreeMap<u64, (Vec<String>, f64)> = BTreeMap::new();
    for (k, own) in found {
        for line in own.hum.iter().filter(|line| line.stands_out) {
            let entry = lines.entry(line.frequency.round() as u64).or_default();
            entry.0.push(number(k));
            entry.1 = entry.1.max(line.amplitude);
        }
    }
    for (frequency, (shots, amplitude)) in lines {
        notes.push(format!(
            "hum at {frequency} Hz with an amplitude of up to {}, {}",
            value(amplitude),
            in_shots(&shots)
        ));
    }
    let drifts = listed(&|own| own.drift.is_some_and(|drift| drift.stands_out()));
    if !drifts.is_empty() {
        notes.push(format!("drift before the trigger {}", in_shots(&drifts)));
    }
    let (order, levels): (Vec<f64>, Vec<f64>) =
        found.iter().filter_map(|(k, own)| Some((*k as f64, own.quiet?.level))).unzip();
    if let Some(line) = drift(&order, &levels).filter(|line| line.stands_out() && line.samples > 4) {
        notes.push(format!(
            "its level before the trigger changes by {} from the first to the last shot",
            value(line.change)
        ));
    }
    let spikes: usize = found.iter().map(|(_, own)| own.spikes.len()).sum();
    if spikes > 0 {
        let what = if spikes == 1 { "1 spike".to_string() } else { format!("{spikes} spikes") };
        notes.push(format!("{what}, {}", in_shots(&listed(&|own| !own.spikes.is_empty()))));
    }
    let lost: usize = found.iter().flat_map(|(_, own)| &own.stuck).map(|own| own.samples).sum();
    if lost > 0 {
        let mut all: Vec<f64> = found.iter().flat_map(|(_, own)| &own.stuck).map(|own| own.value).collect();
        all.sort_unstable_by(f64::total_cmp);
        all.dedup();
        let at = match all[..] {
            [one] => format!("exactly {}", value(one)),
            _ => "one value each".to_string(),
        };
        let parts: usize = found.iter().map(|(_, own)| own.stuck.len()).sum();
        let parts = if parts == 1 { "1 dropout".to_string() } else { format!("{parts} dropouts") };
        notes.push(format!(
            "{parts}: {lost} samples stand at {at}, far from those before and after, {}",
            in_shots(&listed(&|own| !own.stuck.is_empty()))
        ));
    }
    let missing: usize = found.iter().flat_map(|(_, own)| &own.gaps).map(|gap| gap.missing).sum();
    if missing > 0 {
        let what =
            if missing == 1 { "1 sample is missing".to_string() } else { format!("{missing} samples are missing") };
        notes.push(format!("{what}, {}", in_shots(&listed(&|own| !own.gaps.is_empty()))));
    }
    let mut limits: BTreeMap<u64, (f64, Vec<String>, usize)> = BTreeMap::new();
    for (k, own) in found {
        for limit in own.clipping.iter().flat_map(|own| [own.top, own.bottom]).flatten() {
            let entry = limits.entry(limit.value.to_bits()).or_insert((limit.value, Vec::new(), 0));
            entry.1.push(number(k));
            entry.2 += limit.samples;
        }
    }
    for (limit, shots, samples) in limits.into_values() {
        notes.push(format!("clipped: {samples} samples stand at exactly {}, {}", value(limit), in_shots(&shots)));
    }
    notes
}

fn in_shots(numbers: &[String]) -> String {
    match numbers {
        [one] => format!("in shot {one}"),
        several => format!("in shots {}", several.join(", ")),
    }
}

fn middle(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

fn three(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Times and values of a curve for a screen; null where a value is missing.
fn thinned(times: &[f64], values: &[f64]) -> (Vec<Value>, Vec<Value>) {
    let count = times.len().min(values.len());
    let size = count.div_ceil(PARTS).max(1);
    let mut kept = Vec::new();
    for begin in (0..count).step_by(size) {
        let part = begin..(begin + size).min(count);
        if size <= 2 || values[part.clone()].iter().any(|value| !value.is_finite()) {
            kept.extend(part);
            continue;
        }
        let by = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
        let ends = [part.clone().min_by(by), part.max_by(by)];
        let mut ends: Vec<usize> = ends.into_iter().flatten().collect();
        ends.sort_unstable();
        ends.dedup();
        kept.extend(ends);
    }
    let short = |value: f64| {
        format!("{value:.DIGITS$e}").parse::<f64>().ok().filter(|v| v.is_finite()).map_or(Value::Null, Value::from)
    };
    (kept.iter().map(|&k| short(times[k])).collect(), kept.iter().map(|&k| short(values[k])).collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    /// Six shots of 1.5 s, the first two of equal conditions.
    fn bench(change: impl Fn(usize, usize, f64) -> f64) -> (Bench, Study) {
        let study = Study::of_columns(&[vec!["time_s".into(), "p".into()]]).unwrap();
        let shots = (0..6).map(|shot| {
            let mut draws = SplitMix(shot as u64);
            let times: Vec<f64> = (0..3000).map(|k| f64::from(k) * 5e-4 - 0.5).collect();
            let value =
                |(k, t): (usize, &f64)| change(shot, k, 10.0 + if *t > 0.0 { 3.0 } else { 0.0 } + 0.1 * draws.normal());
            let values = times.iter().enumerate().map(value).collect();
            let conditions =
                BTreeMap::from([("p0".to_string(), shot.max(1) as f64), ("minutes".to_string(), shot as f64)]);
            Shot {
                number: shot + 1,
                times,
                values: BTreeMap::from([("p".to_string(), values)]),
                conditions,
                ..Shot::default()
            }
        });
        (Bench { shots: shots.collect(), noise: BTreeMap::from([("p".to_string(), 0.1)]), ..Bench::default() }, study)
    }

    fn notes_of(change: impl Fn(usize, usize, f64) -> f64) -> Vec<String> {
        let (bench, study) = bench(change);
        let sheet = study.sheet(&bench);
        sheet["channels"][0]["notes"]
            .as_array()
            .unwrap()
            .iter()
            .map(|note| note.as_str().unwrap().to_string())
            .collect()
    }

    #[test]
    fn what_is_wrong_with_a_record_is_said() {
        assert_eq!(notes_of(|_, _, value| value), Vec::<String>::new());
        let hum = |_, k: usize, value: f64| value + 0.3 * (std::f64::consts::TAU * 50.0 * k as f64 * 5e-4).sin();
        let said = notes_of(hum).join("\n");
        assert!(
            said.contains("hum at 50 Hz with an amplitude of up to 0.3") && said.contains("in shots 1, 2, 3, 4, 5, 6"),
            "{said}"
        );
        let said = notes_of(|shot, k, value| if shot == 2 && k == 700 { value + 4.0 } else { value });
        assert_eq!(said, ["1 spike, in shot 3"]);
        let said = notes_of(|shot, k, value| if shot == 1 && (50..60).contains(&k) { 0.0 } else { value });
        assert_eq!(said, ["1 dropout: 10 samples stand at exactly 0, far from those before and after, in shot 2"]);
        let said = notes_of(|shot, k, value| if shot == 1 && (50..60).contains(&k) { f64::NAN } else { value });
        assert_eq!(said, ["10 samples are missing, in shot 2"]);
        let said =
            notes_of(
                |shot, k, value| {
                    if shot > 3 && k > 1000 { (value + 0.5 * (k as f64 / 99.0).sin()).min(13.3) } else { value }
                },
            );
        assert!(
            said.len() == 1 && said[0].starts_with("clipped: ") && said[0].ends_with("13.3, in shots 5, 6"),
            "{said:?}"
        );
        let said = notes_of(|shot, _, value| value + shot as f64);
        assert!(said.len() == 1 && said[0].starts_with("its level before the trigger changes by"), "{said:?}");
        let said = notes_of(|_, _, value| 10.0 * value);
        assert!(
            said[0].starts_with("the stated noise is 0.1, the differences of neighbouring samples show"),
            "{said:?}"
        );
    }

    #[test]
    fn shots_of_equal_conditions_repeat_each_other() {
        let (bench, study) = bench(|shot, _, value| if shot == 1 { value + 0.2 } else { value });
        let sheet = study.sheet(&bench);
        assert_eq!(sheet["groups"], json!([[1, 2]]));
        // Two levels that are 0.2 apart have a standard deviation of 0.2/sqrt(2).
        let level = sheet["channels"][0]["repeats"][0]["level"].as_f64().unwrap();
        assert!((level - 0.2 / 2.0_f64.sqrt()).abs() < 0.01, "{level}");
    }

    #[test]
    fn thinned_curves_keep_their_ends() {
        let times: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut values = vec![0.0; 100_000];
        values[54_321] = 7.0;
        let (few, kept) = thinned(&times, &values);
        assert!(few.len() <= 2 * PARTS && kept.iter().any(|value| value == 7.0));
    }
}

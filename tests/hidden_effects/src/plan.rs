//! Plans: which trials an evaluation runs.  A plan names groups; a trial's name and the seed decide everything in it.
//! Every group and every effect is spread evenly over the order of running, in which kinds alternate at random, and
//! trials are dealt out to shards in turn: wherever a run is ended, what was run is a fair sample.
//!
//! ```json
//! {"seed": 1, "sizes": [0.5, 2.0], "groups": [
//!   {"kind": "null", "count": 400}, {"kind": "effect", "effects": "all", "each": 15},
//!   {"kind": "outside", "effects": ["valve_drag"], "each": 4}, {"kind": "pair", "count": 40}, {"kind": "triple", "count": 10}]}
//! ```

use crate::disturb::{DRAWN, KINDS};
use crate::draft::{Points, Request, draw_together};
use crate::effects::{CATALOGUE, OUTSIDE};
use crate::random::Stream;
use serde_json::Value;

/// The requests of a plan in running order; `seed` replaces the plan's own.
pub fn requests(plan: &Value, seed: Option<u64>) -> Result<Vec<Request>, String> {
    let seed = seed.or(plan["seed"].as_u64()).ok_or("the plan has no `seed`, and none was given")?;
    let limits = plan["sizes"].as_array().map(|sizes| sizes.iter().filter_map(Value::as_f64).collect::<Vec<_>>());
    let limits = match limits.as_deref() {
        None => [0.5, 2.0],
        Some(&[low, high]) if low > 0.0 && low < high => [low, high],
        Some(_) => return Err("`sizes` takes two positive numbers, the smaller first".into()),
    };
    let mut ordered: Vec<(f64, Request)> = Vec::new();
    for entry in plan["groups"].as_array().ok_or("the plan has no `groups`")? {
        for (stratum, name, ids) in members(entry, seed)? {
            let place = stratum.0 + stratum.1 * Stream::new(seed, &format!("{name} place")).unit();
            let mut sizes = Stream::new(seed, &format!("{name} sizes"));
            let effects = ids.into_iter().map(|id| (id, sizes.log_uniform(limits[0], limits[1]))).collect();
            let disturbances = disturbances(entry, seed, &name)?;
            ordered.push((place, Request { name, seed, effects, disturbances, points: Points::default() }));
        }
    }
    ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(ordered.into_iter().map(|(_, request)| request).collect())
}

/// What disturbs a trial: one kind at random where its group says `"disturbed": true`, or one of those that it lists.
fn disturbances(entry: &Value, seed: u64, name: &str) -> Result<Vec<String>, String> {
    match &entry["disturbed"] {
        Value::Null | Value::Bool(false) => Ok(Vec::new()),
        Value::Bool(true) => Ok(vec![Stream::new(seed, &format!("{name} disturbance")).pick(&DRAWN).to_string()]),
        Value::Array(own) if !own.is_empty() => {
            let of = |own: &Value| KINDS.into_iter().find(|kind| own.as_str() == Some(kind));
            let own = own.iter().map(|own| of(own).ok_or(format!("no disturbance {own}: {}", KINDS.join(", "))));
            let own = own.collect::<Result<Vec<&str>, String>>()?;
            Ok(vec![Stream::new(seed, &format!("{name} disturbance")).pick(&own).to_string()])
        }
        _ => Err("`disturbed` takes true, false or a list of kinds".to_string()),
    }
}

type Member = ((f64, f64), String, Vec<String>);

/// Part of the run (begin and length, the whole being 1), name and effects of a group's trials.
fn members(entry: &Value, seed: u64) -> Result<Vec<Member>, String> {
    let kind = entry["kind"].as_str().ok_or("a group has no `kind`")?;
    let number = |key: &str| {
        entry[key].as_u64().map(|count| count as usize).ok_or(format!("a group of kind `{kind}` needs `{key}`"))
    };
    let part = |place: usize, of: usize| (place as f64 / of as f64, 1.0 / of as f64);
    match kind {
        "null" => {
            let count = number("count")?;
            Ok((0..count).map(|place| (part(place, count), format!("null-{place:03}"), Vec::new())).collect())
        }
        "pair" | "triple" => {
            let together = if kind == "pair" { 2 } else { 3 };
            let count = number("count")?;
            let one = |place: usize| {
                let name = format!("{kind}-{place:03}");
                let drawn = draw_together(&mut Stream::new(seed, &format!("{name} together")), together);
                (part(place, count), name, drawn.iter().map(|effect| effect.id.to_string()).collect())
            };
            Ok((0..count).map(one).collect())
        }
        "effect" | "outside" => {
            let known: Vec<&str> = match kind {
                "effect" => CATALOGUE.iter().map(|effect| effect.id).collect(),
                _ => OUTSIDE.iter().map(|effect| effect.id).collect(),
            };
            let wanted: Vec<&str> = match &entry["effects"] {
                Value::Array(list) => list.iter().filter_map(Value::as_str).collect(),
                _ => known.clone(),
            };
            if let Some(unknown) = wanted.iter().find(|id| !known.contains(id)) {
                return Err(format!("no effect `{unknown}` of kind `{kind}`"));
            }
            let each = number("each")?;
            let all = (0..each).flat_map(|place| wanted.iter().map(move |id| (place, *id)));
            Ok(all
                .map(|(place, id)| (part(place, each), format!("{kind}-{id}-{place:02}"), vec![id.to_string()]))
                .collect())
        }
        _ => Err(format!("no kind `{kind}`: null, effect, outside, pair, triple")),
    }
}

/// The part of shard `i/n` (from 1).
pub fn shard(requests: Vec<Request>, part: &str) -> Result<Vec<Request>, String> {
    let numbers: Vec<usize> = part.split('/').filter_map(|number| number.parse().ok()).collect();
    match numbers[..] {
        [which, of] if which >= 1 && which <= of => {
            Ok(requests.into_iter().enumerate().filter(|(place, _)| place % of == which - 1).map(|(_, r)| r).collect())
        }
        _ => Err(format!("--shard takes i/n with 1 <= i <= n, not `{part}`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn shards_are_a_partition_and_names_differ() {
        let plan = json!({"seed": 5, "groups": [{"kind": "null", "count": 7}, {"kind": "effect", "effects": "all", "each": 2},
            {"kind": "pair", "count": 4}]});
        let all = requests(&plan, None).expect("a plan");
        assert_eq!(all.len(), 7 + 40 + 4);
        let mut names: Vec<String> = all.iter().map(|request| request.name.clone()).collect();
        let mut dealt: Vec<String> = (1..=3)
            .flat_map(|which| shard(all.clone(), &format!("{which}/3")).expect("a shard"))
            .map(|request| request.name)
            .collect();
        names.sort();
        dealt.sort();
        assert_eq!(names, dealt);
        names.dedup();
        assert_eq!(names.len(), all.len());
        assert!(all.iter().all(|request| request.effects.iter().all(|(_, size)| (0.5..2.0).contains(size))));
        assert!(
            requests(&json!({"seed": 1, "groups": [{"kind": "effect", "effects": ["none"], "each": 1}]}), None)
                .is_err()
        );
    }

    /// Any first part of a run holds its share of every group and effect.
    #[test]
    fn a_run_that_is_ended_is_a_fair_sample() {
        let plan = json!({"seed": 5, "groups": [{"kind": "null", "count": 40}, {"kind": "effect", "effects": "all", "each": 4},
            {"kind": "pair", "count": 8}]});
        let all = requests(&plan, None).expect("a plan");
        for part in [0.25, 0.5, 0.75] {
            let run = &all[..(part * all.len() as f64) as usize];
            let count = |start: &str| run.iter().filter(|request| request.name.starts_with(start)).count() as f64;
            for (start, whole) in [("null", 40.0), ("effect-eddy_currents", 4.0), ("pair", 8.0)] {
                assert!((count(start) - part * whole).abs() <= 2.0, "{start}: {} of {whole} in {part}", count(start));
            }
        }
    }
}

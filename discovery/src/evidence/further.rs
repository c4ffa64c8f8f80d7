//! Which further measurement would tell effects apart that explain a set equally well?
//!
//! Both fitted models foretell what a channel that was not measured would show, and what all channels would show under other
//! conditions; where they differ most in standard deviations of the noise they are told apart best (discriminating experiments:
//! Box, Hill 1967).  Nothing is fitted again, so the figure is more than a fit would leave.

use hyd_system::math::square;

use crate::problem::Weighing;
use crate::search::{Findings, Tried};
use crate::study::Nuisance;
use crate::variant::{Insert, Workshop};
use crate::{Bench, Fault, Setup};

/// Conditions are varied by these factors.
const FACTORS: [f64; 2] = [0.7, 1.4];
/// Noise of a channel that nobody has measured, by its range.
const NOISE: f64 = 3e-3;

/// A measurement that was not made.
#[derive(Clone, Debug)]
pub(crate) struct Further {
    /// What to do.
    pub words: String,
    /// The two effects.
    pub effects: (String, String),
    /// Sum of the squares of the difference in standard deviations.
    pub apart: f64,
}

/// The measurements that would tell the two best effects of an ambiguous set apart, the best first.
pub(crate) fn further(setup: &Setup, workshop: &Workshop<'_>, findings: &Findings) -> Vec<Further> {
    let Some(last) = findings.passes.last().filter(|_| findings.ambiguous.len() > 1) else { return Vec::new() };
    let label = |k: usize| findings.ambiguous[k].label();
    let tried = |k: usize| last.tried.iter().find(|tried| tried.hypothesis.ends_with(&findings.ambiguous[k]));
    let (Some(one), Some(other)) = (tried(0), tried(1)) else { return Vec::new() };
    let mut found = Vec::new();
    let mut add = |words: String, apart: f64| {
        if apart.is_finite() && apart > 0.0 {
            found.push(Further { words, effects: (label(0), label(1)), apart });
        }
    };
    for name in setup.study.channels.keys().filter(|name| setup.data.channel(name).is_none()) {
        let words = &setup.study.channels[name].words;
        let shown = if words.is_empty() { String::new() } else { format!(" ({words})") };
        add(format!("measure `{name}`{shown} as well"), unmeasured(setup, workshop, name, (one, other)).unwrap_or(0.0));
    }
    for (condition, value) in conditions(setup) {
        for factor in FACTORS {
            let moved = rounded(value * factor);
            let apart = elsewhere(setup, (&condition, moved), (one, other)).unwrap_or(0.0);
            add(format!("fire a shot with {condition} = {} instead of {}", plain(moved), plain(value)), apart);
        }
    }
    found.sort_by(|a, b| b.apart.total_cmp(&a.apart));
    found
}

/// Conditions of the first fitted shot that decide parameters, but zeros, and those of which no shot knows more than the fit: a
/// parameter that is another unknown in every shot, or that has its value from the fit alone, nobody sets on a bench.
fn conditions(setup: &Setup) -> Vec<(String, f64)> {
    let shot = &setup.bench.shots[setup.train[0]];
    let is_unknown = |parameter: &str| {
        setup.study.nuisances.values().any(|nuisance| match nuisance {
            Nuisance::Stated(own) => own.parameter == parameter && (own.per_shot || own.absolute.is_some()),
            Nuisance::Parameter(_) => false,
        })
    };
    let words = |formula: &String| {
        let parts = formula.split(|c: char| !(c.is_alphanumeric() || c == '_')).map(str::to_string);
        parts.collect::<Vec<String>>()
    };
    let of = |is_left_out: bool| {
        let own = setup.study.conditions.iter().filter(move |(parameter, _)| is_unknown(parameter) == is_left_out);
        own.flat_map(|(_, formula)| words(formula)).collect::<Vec<String>>()
    };
    let (mut names, left_out) = (of(false), of(true));
    names.retain(|name| !left_out.contains(name));
    names.sort_unstable();
    names.dedup();
    let known = names.into_iter().filter_map(|name| shot.conditions.get(&name).map(|&value| (name, value)));
    known.filter(|(_, value)| *value != 0.0).collect()
}

/// How far the two differ in a channel that was not measured.
fn unmeasured(
    setup: &Setup,
    workshop: &Workshop<'_>,
    name: &str,
    (one, other): (&Tried, &Tried),
) -> Result<f64, Fault> {
    let channel = &setup.study.channels[name];
    let watching = Workshop { channels: vec![channel.variable.clone()], ..workshop.clone() };
    let all = Weighing::whole(&setup.train, 0.0);
    let run = |tried: &Tried| {
        let inserts = tried.hypothesis.inserts.iter();
        let inserts: Vec<Insert> =
            inserts.map(|candidate| Insert { candidate: candidate.clone(), values: Vec::new() }).collect();
        let machine = setup.machine_of(watching.translate(&inserts)?, 1)?;
        let xi = tried.fit.as_ref().map_or(Vec::new(), |fit| fit.xi.clone());
        setup.problem(&machine, &tried.hypothesis.inserts)?.simulate(&xi, &all)
    };
    let (a, b) = (run(one)?, run(other)?);
    let series = |runs: &crate::problem::Runs| -> Vec<f64> {
        runs.iter().flatten().filter_map(|run| run.first()).flatten().copied().collect()
    };
    let (a, b) = (series(&a), series(&b));
    let (low, high) = a.iter().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
    let sigma = channel.noise.map_or(NOISE * (high - low), |noise| noise / channel.scale.abs());
    Ok(a.iter().zip(&b).map(|(a, b)| square((a - b) / sigma)).sum())
}

/// The nearest number of three digits: what an engineer would set.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// A number as it is written by hand.
fn plain(value: f64) -> String {
    if (1e-3..1e4).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

/// How far the two differ in a shot with another condition.
fn elsewhere(setup: &Setup, (condition, moved): (&str, f64), (one, other): (&Tried, &Tried)) -> Result<f64, Fault> {
    let shot = setup.train[0];
    let mut bench: Bench = setup.bench.clone();
    if let Some(value) = bench.shots[shot].conditions.get_mut(condition) {
        *value = moved;
    }
    let mut moved = Setup::new(setup.study.clone(), bench, setup.threads)?;
    moved.foreign.clone_from(&setup.foreign);
    let own = Weighing::whole(&[shot], 0.0);
    let residuals = |tried: &Tried| {
        let problem = moved.problem(&tried.hypothesis.machine, &tried.hypothesis.inserts)?;
        let xi = tried.fit.as_ref().map_or(Vec::new(), |fit| fit.xi.clone());
        let runs = problem.simulate(&xi, &own)?;
        Ok::<_, Fault>(problem.residuals(&xi, &runs, &own))
    };
    Ok((residuals(one)? - residuals(other)?).norm_squared())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::path::Path;

    use super::conditions;
    use crate::{Bench, Setup, Study};

    #[test]
    fn only_what_can_be_set_on_a_bench_is_varied() {
        let study = Study::parse(
            "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"y\", noise = 1 }\n[conditions]\np = \"supply\"\n\
             v = \"speed\"\nw = \"2*speed\"\nx = \"level + offset\"\nq = \"offset\"\n[nuisances]\np = { parameter = \"p\", relative = 0.01 }\n\
             w = { parameter = \"w\", absolute = 1, per_shot = true }\nx = { parameter = \"x\", absolute = 1 }\n[shots]\ntime = \"t\"\n",
        );
        let rows: String = (0..30).map(|k| format!("{k},{}\n", k % 7)).collect();
        let set =
            "{\"experiments\": [{\"file\": \"s.csv\", \"supply\": 2, \"speed\": 3, \"level\": 4, \"offset\": 5}]}";
        let study = study.unwrap();
        let bench = Bench::parse(Path::new("set.json"), set, &study, &mut |_| Ok(format!("t,y\n{rows}"))).unwrap();
        // The supply is known to a percent, and set all the same.
        assert_eq!(conditions(&Setup::new(study, bench, 1).unwrap()), [("supply".to_string(), 2.0)]);
    }
}

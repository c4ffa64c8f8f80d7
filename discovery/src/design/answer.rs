//! Proposed shots as data and as text: conditions, what each is expected to say, where it shows, and what was looked at.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::aim::{Aim, Question};
use super::proved::Proved;
use super::seen::Farthest;
use super::space::{Point, Space};
use super::{Chosen, Looked};
use crate::Setup;
use crate::evidence::power::{CLEAR, normal_share};
use crate::evidence::thresholds::{LEAD, NEEDED};
use crate::search::Findings;

/// Units whose numbers are written with prefixes: those that end the names of conditions and channels.
const PREFIXED: [&str; 12] = ["Pa", "V", "A", "s", "m", "F", "N", "W", "J", "Hz", "K", "Ohm"];
/// Prefixes by the third power of ten.
const PREFIXES: [(i32, &str); 9] =
    [(-4, "p"), (-3, "n"), (-2, "u"), (-1, "m"), (0, ""), (1, "k"), (2, "M"), (3, "G"), (4, "T")];

/// Shots that are proposed.
pub struct NextShots {
    /// All of it: `next.json`.
    pub json: Value,
    /// For the terminal.
    pub summary: String,
    /// What models show in the shots.
    pub curves: Vec<PredictedCurves>,
}

impl NextShots {
    /// No shot, because none would settle anything.
    pub(super) fn none(setup: &Setup, findings: &Findings, why: &str) -> Self {
        let json = json!({"set": setup.bench.name, "status": findings.status.word(), "aim": null, "nothing": why, "shots": []});
        Self { json, summary: format!("{why}\n"), curves: Vec::new() }
    }
}

/// What two models show in a planned shot.
pub struct PredictedCurves {
    /// Position of the shot among those proposed.
    pub shot: usize,
    /// Whose record, and which model was fitted to it.
    pub pair: (String, String),
    /// Times (s).
    pub times: Vec<f64>,
    /// By channel its name, the standard deviation of its noise, the record and the fitted model (units of the table).
    pub channels: Vec<(String, f64, Vec<f64>, Vec<f64>)>,
}

impl Question {
    /// True if no shot of the ranges settles anything.
    pub(super) fn is_hopeless(&self) -> bool {
        !matches!(self.aim, Aim::Narrow { .. }) && self.compared().is_empty()
    }

    /// What no shot of the ranges settles.
    pub(super) fn never_told(&self) -> Vec<String> {
        let label = |own: usize| &self.contenders[own].label;
        if let Aim::Reveal { .. } = self.aim {
            let names: Vec<&str> = self.hopeless.iter().map(|pair| label(pair.0).as_str()).collect();
            return if names.is_empty() { Vec::new() } else { vec![format!("no shot shows {}", names.join(", "))] };
        }
        // Both ways at once, where neither is settled.
        let both = self.hopeless.iter().filter(|(a, b)| a < b && self.hopeless.contains(&(*b, *a)));
        let both = both.map(|&(a, b)| format!("no shot tells {} from {}", label(a), label(b)));
        let one = self.hopeless.iter().filter(|(a, b)| !self.hopeless.contains(&(*b, *a)));
        let one = one.map(|&(a, b)| format!("no shot refutes {} if it is {}", label(b), label(a)));
        both.chain(one).collect()
    }
}

/// Puts everything together; numbers that are missing are null.
pub(super) fn answer(
    (setup, space): (&Setup, &Space<'_>),
    question: &Question,
    findings: &Findings,
    (chosen, proved): (Vec<Chosen>, Vec<Proved>),
    looked: Looked,
) -> NextShots {
    let labels: Vec<&str> = question.contenders.iter().map(|own| own.label.as_str()).collect();
    let aim = match question.aim {
        Aim::Apart => "tell apart",
        Aim::Reveal { .. } => "reveal",
        Aim::Narrow { .. } => "narrow",
    };
    let shots: Vec<Value> = (0..chosen.len()).map(|k| shot((setup, space), question, (&chosen, k), &proved)).collect();
    let axes =
        space.axes.iter().map(|axis| json!({"condition": axis.condition, "low": axis.ends.0, "high": axis.ends.1}));
    let points = looked.seen.iter().map(|(point, worth)| json!({"values": point.values, "worth": number(*worth)}));
    // Windows of a record differ in no condition: one point for all of them says nothing.
    let made = setup.bench.shots.iter().filter(|shot| !shot.is_window).map(|shot| {
        let values = space.axes.iter().map(|axis| json!(shot.conditions.get(&axis.condition)));
        json!({"number": shot.number, "values": values.collect::<Vec<_>>()})
    });
    let others = question.all.saturating_sub(labels.len() - usize::from(matches!(question.aim, Aim::Reveal { .. })));
    let json = json!({
        "set": setup.bench.name,
        "status": findings.status.word(),
        "aim": aim,
        "models": labels,
        "models_left_out": others,
        "never": question.never_told(),
        "not_run": question.unrun,
        "vary": axes.collect::<Vec<_>>(),
        "shots": shots,
        "points": points.collect::<Vec<_>>(),
        "made": made.collect::<Vec<_>>(),
        "failed": {"points": looked.failed.0, "why": looked.failed.1},
        "beyond": looked.beyond,
        "forbidden": looked.forbidden,
    });
    let summary = summary(space, question, &chosen, &json);
    let curves = proved.iter().flat_map(|own| curves(setup, &labels, own)).collect();
    NextShots { json, summary, curves }
}

/// One of the shots.
fn shot(
    (setup, space): (&Setup, &Space<'_>),
    question: &Question,
    (chosen, k): (&[Chosen], usize),
    proved: &[Proved],
) -> Value {
    let Chosen { point, shares, farthest, .. } = &chosen[k];
    let label = |own: usize| question.contenders[own].label.as_str();
    let named = space.axes.iter().zip(&point.values).map(|(axis, &value)| (axis.condition.clone(), json!(value)));
    let like = setup.bench.shots[space.template].number;
    let mut object = Map::new();
    object.insert("conditions".into(), Value::Object(named.collect()));
    object.insert("settings".into(), json!(settings(space, point)));
    object.insert("cost".into(), json!(point.cost));
    object.insert("like".into(), json!(like));
    if let Aim::Narrow { .. } = question.aim {
        let narrowed = question
            .sizes
            .iter()
            .enumerate()
            .map(|(size, name)| json!({"size": name, "interval_times": number(question.narrowing(shares, size))}));
        object.insert("narrows".into(), narrowed.collect());
        return Value::Object(object);
    }
    let evidence = question.compared().into_iter().zip(farthest).map(|((truth, model), farthest)| {
        let expected = question.evidence(shares, truth, model);
        // Fits are made to all of the shots together.
        let is_last = k + 1 == chosen.len();
        let fitted = proved.iter().find(|own| own.pair == (truth, model)).filter(|_| is_last).map(|own| own.growth);
        let growth = fitted.unwrap_or(expected);
        let decides = if matches!(question.aim, Aim::Apart) { decides(growth) } else { shows(growth) };
        let channel = |own: &Farthest| &setup.data.channels[own.channel].name;
        let shows = farthest
            .as_ref()
            .map(|own| json!({"channel": channel(own), "time": own.time, "deviations": number(own.deviations)}));
        let size = question.contenders[truth].size;
        json!({"if": label(truth), "size": size, "against": label(model), "expected": number(expected), "fitted": fitted.map(number),
            "decides": number(decides), "shows": shows})
    });
    object.insert("evidence".into(), evidence.collect());
    Value::Object(object)
}

fn curves(setup: &Setup, labels: &[&str], proved: &Proved) -> Vec<PredictedCurves> {
    let of = |shot: usize| {
        let channels = setup.data.channels.iter().enumerate().filter(|(k, _)| !proved.record[shot][*k].is_empty());
        let channel = |(k, info): (usize, &crate::data::ChannelInfo)| {
            let scaled = |values: &[f64]| values.iter().map(|value| value * info.scale).collect();
            (
                info.name.clone(),
                info.sigma() * info.scale.abs(),
                scaled(&proved.record[shot][k]),
                scaled(&proved.shown[shot][k]),
            )
        };
        PredictedCurves {
            shot,
            pair: (labels[proved.pair.0].to_string(), labels[proved.pair.1].to_string()),
            times: proved.times[shot].clone(),
            channels: channels.map(channel).collect(),
        }
    };
    (0..proved.record.len()).map(of).collect()
}

/// Probability that a difference of costs that is expected comes out as a lead that decides: it scatters by twice its root.
fn decides(expected: f64) -> f64 {
    if expected > 0.0 { normal_share((expected - LEAD) / (2.0 * expected.sqrt())) } else { 0.0 }
}

/// Probability that an effect drops the cost by what a name needs, where this is expected: the root scatters by one.
fn shows(expected: f64) -> f64 {
    normal_share(expected.sqrt() - NEEDED.sqrt())
}

/// A number, or null where there is none.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

/// The findings for the terminal.
fn summary(space: &Space<'_>, question: &Question, chosen: &[Chosen], json: &Value) -> String {
    let mut text = String::new();
    let names = |from: usize| -> String {
        let list: Vec<&str> =
            json["models"].as_array().into_iter().flatten().skip(from).filter_map(Value::as_str).collect();
        list.join(", ")
    };
    let _ = match question.aim {
        Aim::Apart => writeln!(text, "to be told apart: {}", names(0)),
        Aim::Reveal { .. } => writeln!(text, "could have hidden at typical size: {}", names(1)),
        Aim::Narrow { .. } => writeln!(text, "to be known better: {}", question.sizes.join(", ")),
    };
    if let Some(others) = json["models_left_out"].as_u64().filter(|&others| others > 0) {
        let _ = writeln!(text, "  {others} more are left out, whose costs are larger");
    }
    for words in question.never_told() {
        let _ = writeln!(text, "  within these ranges {words}");
    }
    if !question.unrun.is_empty() {
        let names = question.unrun.join(", ");
        let _ = writeln!(text, "  the model does not run at the typical size of {names}, which is left out");
    }
    for (k, shot) in chosen.iter().enumerate() {
        let settings = settings(space, &shot.point);
        let cost = if shot.point.cost == 1.0 { String::new() } else { format!(", cost {:.3}", shot.point.cost) };
        let _ = writeln!(text, "shot {}: {}{cost}", k + 1, settings.join(", "));
        if let Aim::Narrow { .. } = question.aim {
            for (size, name) in question.sizes.iter().enumerate() {
                let _ = writeln!(
                    text,
                    "  the interval of {name} becomes {:.2} times as wide",
                    question.narrowing(&shot.shares, size)
                );
            }
            continue;
        }
        let evidence = json["shots"][k]["evidence"].as_array();
        for own in evidence.into_iter().flatten() {
            let _ = writeln!(text, "  {}", sentence(question, own, k));
        }
    }
    let pairs = [
        (&json["failed"]["points"], "cannot be run by every model"),
        (&json["forbidden"], "are forbidden"),
        (&json["beyond"], "let a channel leave what it may show"),
    ];
    let count = json["points"].as_array().map_or(0, Vec::len);
    let left_out: Vec<String> = pairs
        .iter()
        .filter_map(|(count, words)| count.as_u64().filter(|&count| count > 0).map(|count| format!("{count} {words}")))
        .collect();
    let behind = if left_out.is_empty() { String::new() } else { format!("; of others {}", left_out.join(", ")) };
    let _ = writeln!(text, "{count} points were run{behind}");
    if let Some(why) = json["failed"]["why"].as_str() {
        let _ = writeln!(text, "  the first that cannot be run: {why}");
    }
    text
}

/// What a shot says of a pair.
fn sentence(question: &Question, own: &Value, shot: usize) -> String {
    let text = |key: &str| own[key].as_str().unwrap_or_default();
    let value = |key: &str| own[key].as_f64();
    let evidence = value("fitted").or(value("expected")).unwrap_or(f64::NAN);
    // What no fit has confirmed holds to first order.
    let about = if value("fitted").is_some() { "" } else { "about " };
    let with = if shot == 0 { "" } else { " with the shots before it" };
    let what = match question.aim {
        Aim::Reveal { .. } => {
            let is_seen = if evidence >= CLEAR { "" } else { ", too little to be sure of" };
            let size = value("size").map_or_else(String::new, |size| format!(" of size {}", digits(size)));
            format!("{}{size}: the cost would drop by {about}{evidence:.0}{with}{is_seen}", text("if"))
        }
        _ => format!(
            "if it is {}, the cost of {} grows by {about}{evidence:.0}{with} (decides with {:.0} %)",
            text("if"),
            text("against"),
            100.0 * value("decides").unwrap_or(0.0)
        ),
    };
    let shows = &own["shows"];
    let (Some(channel), Some(time), Some(deviations)) =
        (shows["channel"].as_str(), shows["time"].as_f64(), shows["deviations"].as_f64())
    else {
        return what;
    };
    format!("{what}; they differ by up to {deviations:.1} sigma, in {channel} at {}", quantity(time, "s"))
}

/// The conditions of a shot that vary, as a lab writes them.
fn settings(space: &Space<'_>, point: &Point) -> Vec<String> {
    space.axes.iter().zip(&point.values).map(|(axis, &value)| setting(&axis.condition, value)).collect()
}

/// A condition and its value, and where its name ends like a unit what that is with a prefix.
fn setting(condition: &str, value: f64) -> String {
    // Of a compound unit, such as that of `v0_m_s`, the last part is no unit of the number.
    let is_compound = |stem: &str| stem.rsplit_once('_').is_some_and(|(_, before)| PREFIXED.contains(&before));
    let unit = condition.rsplit_once('_').filter(|(stem, unit)| PREFIXED.contains(unit) && !is_compound(stem));
    // Rounded once, so that both say the same.
    let value = rounded(value);
    let plain = digits(value);
    match unit.map(|(_, unit)| quantity(value, unit)) {
        Some(prefixed) if !prefixed.starts_with(&format!("{plain} ")) => format!("{condition} = {plain} ({prefixed})"),
        _ => format!("{condition} = {plain}"),
    }
}

/// A number with a prefixed unit.
fn quantity(value: f64, unit: &str) -> String {
    let power = |exponent: i32| hyd_system::math::powi(1000.0, exponent);
    let fits = |(exponent, _): &&(i32, &str)| {
        let scaled = (value / power(*exponent)).abs();
        (0.9995..999.5).contains(&scaled)
    };
    let (exponent, prefix) = PREFIXES.iter().find(fits).copied().unwrap_or((0, ""));
    format!("{} {prefix}{unit}", digits(value / power(exponent)))
}

/// Four significant digits, without zeros behind.
fn digits(value: f64) -> String {
    crate::magnitude::shown(rounded(value))
}

fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::{decides, setting};

    #[test]
    fn settings_read_as_a_lab_writes_them() {
        let cases = [
            (("p0_Pa", 6e6), "p0_Pa = 6000000 (6 MPa)"),
            (("pulse_s", 0.005), "pulse_s = 0.005 (5 ms)"),
            (("U0_V", 27.53), "U0_V = 27.53"),
            (("gap_m", 1.2346e-4), "gap_m = 0.0001235 (123.5 um)"),
            (("gap_m", 1.2345e-4), "gap_m = 0.0001234 (123.4 um)"),
            (("turns", 120.0), "turns = 120"),
            (("T_K", 0.0), "T_K = 0"),
            (("v0_m_s", 5.0), "v0_m_s = 5"),
        ];
        for ((name, value), text) in cases {
            assert_eq!(setting(name, value), text);
        }
    }

    /// The difference of two costs is normal with mean E and variance 4 E: at E = 10 it is a coin.
    #[test]
    fn decisions_are_as_sure_as_the_difference_of_costs() {
        assert!((decides(10.0) - 0.5).abs() < 1e-7 && decides(0.0) == 0.0);
        assert!((decides(40.0) - 0.991_1).abs() < 1e-3 && decides(200.0) > 0.999_99);
    }
}

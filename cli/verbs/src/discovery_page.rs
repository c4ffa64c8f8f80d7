//! A report of a search as one page that works without a network.
//!
//! Findings, curves and texts become JSON in front of a script, which draws them; the scripts (`discovery_page/page.js`, `parts.js` and
//! `curves.js`) stand in files of their own and are put together here.

use hyd_discovery::{Report, ShotCurves};
use serde_json::{Value, json};

use crate::page::{STYLE, framed};

const SCRIPT: &str = include_str!("discovery_page/page.js");
const PARTS: &str = include_str!("discovery_page/parts.js");
const CURVES: &str = include_str!("discovery_page/curves.js");
/// Significant digits of curves: more than a screen shows.
const DIGITS: usize = 5;

/// The page as HTML.
pub(crate) fn page(report: &Report) -> String {
    let texts: Vec<Value> = report.texts.iter().map(|(name, text)| json!({"name": name, "text": text})).collect();
    let data = json!({"report": report.json, "texts": texts});
    with_curves("What the model lacks", SCRIPT, &report.curves, data)
}

/// A page that shows curves of shots; its script finds them in the data.
pub(crate) fn with_curves(title: &str, script: &str, curves: &[ShotCurves], mut data: Value) -> String {
    data["shots"] = curves.iter().map(shot).collect::<Vec<Value>>().into();
    framed(title, STYLE, &format!("{CURVES}\n{PARTS}\n{script}"), &data)
}

fn shot(shot: &ShotCurves) -> Value {
    let short = |values: &[f64]| values.iter().map(|&value| rounded(value)).collect::<Vec<Value>>();
    let channels = shot.channels.iter().map(|channel| {
        let left_out: Vec<usize> = (0..channel.used.len()).filter(|&k| !channel.used[k]).collect();
        json!({"name": channel.name, "measured": short(&channel.measured), "base": short(&channel.base),
            "extended": short(&channel.extended), "left_out": left_out})
    });
    json!({"number": shot.number, "held_out": shot.held_out, "times": short(&shot.times), "channels": channels.collect::<Vec<_>>()})
}

/// A number with the digits of a screen.
pub(crate) fn rounded(value: f64) -> Value {
    format!("{value:.DIGITS$e}").parse::<f64>().ok().filter(|value| value.is_finite()).map_or(Value::Null, Value::from)
}

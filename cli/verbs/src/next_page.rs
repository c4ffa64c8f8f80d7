//! Proposed shots as one page that works without a network: what is expected of them, the map of conditions, what the rivals would show.
//!
//! As the report of a search is put together: data in front of a script that draws.

use hyd_discovery::{NextShots, PredictedCurves};
use serde_json::{Value, json};

use crate::discovery_page::rounded;
use crate::page::{STYLE, framed};

const OWN_STYLE: &str = include_str!("next_page/page.css");
const SCRIPT: &str = include_str!("next_page/page.js");

/// The page as HTML.
pub(crate) fn page(proposed: &NextShots) -> String {
    let data = json!({"next": proposed.json, "curves": proposed.curves.iter().map(curves).collect::<Vec<Value>>()});
    framed("The next shot", &format!("{STYLE}{OWN_STYLE}"), SCRIPT, &data)
}

fn curves(own: &PredictedCurves) -> Value {
    let short = |values: &[f64]| values.iter().map(|&value| rounded(value)).collect::<Vec<Value>>();
    let channels = own.channels.iter().map(|(name, sigma, record, fitted)| {
        json!({"name": name, "sigma": rounded(*sigma), "record": short(record), "fitted": short(fitted)})
    });
    json!({"shot": own.shot, "if": own.pair.0, "against": own.pair.1, "times": short(&own.times), "channels": channels.collect::<Vec<_>>()})
}

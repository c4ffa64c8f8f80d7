//! `gap.svg`: the channel with the largest gap, as measured, by the base model and by the model with what was found, on a shot
//! that was held out if there is one; underneath, the differences in standard deviations of the noise.

use std::sync::Arc;

use hyd_discovery::{ChannelCurves, Report, Setup, ShotCurves};
use hyd_report::{Curve, Figure, Panel};
use hyd_system::math::square;

/// The picture; none where no channel was measured.
pub(crate) fn gap_picture(setup: &Setup, report: &Report) -> Option<Figure> {
    let shots = &report.curves;
    let held_out = shots.iter().any(|shot| shot.held_out);
    let pairs = shots.iter().filter(|shot| shot.held_out == held_out);
    let pairs = pairs.flat_map(|shot| shot.channels.iter().map(move |channel| (shot, channel)));
    let (shot, channel) = pairs.max_by(|a, b| largest(setup, a.1).total_cmp(&largest(setup, b.1)))?;
    let own = setup.data.channels.iter().find(|own| own.name == channel.name)?;
    let sigma = own.noise.sigma * own.scale.abs();
    let times: Arc<[f64]> = shot.times.clone().into();
    let found = report.model.is_some();
    let curve =
        |name: &str, run: usize, values: Vec<f64>| Curve { name: name.into(), run, times: times.clone(), values };
    let measured = masked(channel, |k| channel.measured[k]);
    let mut values = vec![curve(&channel.name, 0, measured), curve(&channel.name, 1, channel.base.clone())];
    let left = |model: &[f64]| masked(channel, |k| (channel.measured[k] - model[k]) / sigma);
    let name = format!("({} - model)/noise", channel.name);
    let mut differences = vec![curve(&name, 1, left(&channel.base))];
    let mut runs = vec!["measured".to_string(), "base model, fitted".to_string()];
    if found {
        values.push(curve(&channel.name, 2, channel.extended.clone()));
        differences.push(curve(&name, 2, left(&channel.extended)));
        runs.push("with what was found".to_string());
    }
    Some(Figure {
        title: Some(title(report, shot)),
        runs,
        family: false,
        panels: vec![Panel { unit: own.unit.clone(), curves: values }, Panel { unit: "1".into(), curves: differences }],
        width: Figure::PAGE_WIDTH,
        panel_height: None,
    })
}

/// Sum of the squares of the base model's differences in standard deviations.
fn largest(setup: &Setup, channel: &ChannelCurves) -> f64 {
    let own = setup.data.channels.iter().find(|own| own.name == channel.name);
    let sigma = own.map_or(f64::INFINITY, |own| own.noise.sigma * own.scale.abs());
    let square = |k: usize| square((channel.measured[k] - channel.base[k]) / sigma);
    (0..channel.used.len()).filter(|&k| channel.used[k]).map(square).sum()
}

/// Values of the samples that count; a gap at the others.
pub(crate) fn masked(channel: &ChannelCurves, value: impl Fn(usize) -> f64) -> Vec<f64> {
    channel.used.iter().enumerate().map(|(k, &used)| if used { value(k) } else { f64::NAN }).collect()
}

fn title(report: &Report, shot: &ShotCurves) -> String {
    let ids = report.json["effects"].as_array().into_iter().flatten().filter_map(|effect| effect["id"].as_str());
    let ids: Vec<&str> = ids.collect();
    let what = if ids.is_empty() { "nothing was named".to_string() } else { format!("found: {}", ids.join(", ")) };
    let seen = if shot.held_out { "held out" } else { "fitted" };
    format!("shot {} ({seen}), {what}", shot.number)
}

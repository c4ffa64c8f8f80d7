//! A fit written down: measured channels beside the model as stated and as fitted, and what both leave.

use serde_json::{Value, json};

use super::trajectories::{ShotCurves, shot_curves};
use super::{json as findings, number};
use crate::evidence::proof::Gap;
use crate::problem::Problem;
use crate::{Fault, Setup};

/// What a fit has changed.
pub struct FittedReport {
    /// Study, channels with their noise and masks, gaps of the model as stated (`before`) and as fitted (`after`).
    pub json: Value,
    /// Measured, as stated (`base`), as fitted (`extended`), shot by shot.
    pub curves: Vec<ShotCurves>,
}

impl FittedReport {
    /// The report of a fit with these gaps; what the model as stated leaves is computed here.
    pub fn of(problem: &Problem<'_>, setup: &Setup, (train, held_out): (&Gap, Option<&Gap>)) -> Self {
        let stated = vec![0.0; problem.unknowns.len()];
        let of_stated = |shots: &[usize]| Gap::of(problem, &stated, shots, false);
        let before = of_stated(&setup.train);
        let before_held_out = held_out.and_then(|_| of_stated(&setup.held_out).ok());
        let curves = (0..setup.data.shots.len()).filter_map(|shot| match setup.train.contains(&shot) {
            true => Some(shot_curves(setup, shot, before.as_ref().ok().map(|gap| (problem, gap)), (problem, train))),
            false => {
                let before = before_held_out.as_ref().map(|gap| (problem, gap));
                Some(shot_curves(setup, shot, before, (problem, held_out?)))
            }
        });
        let fault = before.as_ref().err().map(|fault: &Fault| fault.sentence.clone());
        let json = json!({
            "title": setup.study.title,
            "set": setup.bench.name,
            "gap": {"train": gap(setup, before.as_ref().ok(), train),
                "heldout": held_out.map(|own| gap(setup, before_held_out.as_ref(), own))},
            "stated_fault": fault,
            "shots": {"train": findings::numbers(setup, &setup.train), "heldout": findings::numbers(setup, &setup.held_out)},
            "channels": findings::channels(setup),
            "noise": findings::noise(setup),
            "masked": findings::masked(setup),
        });
        Self { json, curves: curves.collect() }
    }
}

/// Gaps over all and by channel; null where the model as stated has none.
fn gap(setup: &Setup, before: Option<&Gap>, after: &Gap) -> Value {
    let channels = setup.data.channels.iter().enumerate().map(|(k, channel)| {
        let before = before.map_or(f64::NAN, |gap| gap.channels[k]);
        (channel.name.clone(), json!({"before": number(before), "after": number(after.channels[k])}))
    });
    let channels: serde_json::Map<String, Value> = channels.collect();
    json!({"before": number(before.map_or(f64::NAN, |gap| gap.all)), "after": number(after.all), "channels": channels})
}

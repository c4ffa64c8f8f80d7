//! Measured and simulated channels side by side, so that anyone can compute the gap again.

use std::fmt::Write;

use super::{AllGaps, Gaps, Scene};
use crate::evidence::proof::Gap;
use crate::problem::Problem;
use crate::{Fault, Setup};

/// One shot.
pub struct ShotCurves {
    /// Number of the shot.
    pub number: usize,
    /// It was held out of the fit.
    pub held_out: bool,
    /// Times (s).
    pub times: Vec<f64>,
    /// Channels that were measured.
    pub channels: Vec<ChannelCurves>,
}

/// One channel of a shot, in units of the table.
pub struct ChannelCurves {
    /// Its name.
    pub name: String,
    /// Measured values.
    pub measured: Vec<f64>,
    /// The base model, with what may be off as fitted.
    pub base: Vec<f64>,
    /// The model with what was found; the base model where nothing was.
    pub extended: Vec<f64>,
    /// The samples that count.
    pub used: Vec<bool>,
}

/// All shots.
pub(super) fn curves(scene: &Scene<'_>, gaps: &AllGaps) -> Result<Vec<ShotCurves>, Fault> {
    let setup = scene.setup;
    let (base, extended) = (scene.first.base.problem(setup)?, scene.last.base.problem(setup)?);
    let mut all = Vec::new();
    for shot in 0..setup.data.shots.len() {
        let seen = setup.train.contains(&shot);
        let pick = |gaps: &Gaps| if seen { Some(gaps.train.clone()) } else { gaps.held_out.clone() };
        let (Some(own), with) = (pick(&gaps.before), gaps.after.as_ref().and_then(pick)) else { continue };
        let with = with.as_ref().map_or((&base, &own), |with| (&extended, with));
        all.push(shot_curves(setup, shot, Some((&base, &own)), with));
    }
    Ok(all)
}

/// One shot by two models; the first has no values where it could not be run.
pub(super) fn shot_curves(
    setup: &Setup,
    shot: usize,
    base: Option<(&Problem<'_>, &Gap)>,
    extended: (&Problem<'_>, &Gap),
) -> ShotCurves {
    let data = &setup.data.shots[shot];
    let measured = setup.data.channels.iter().enumerate();
    let measured = measured.filter_map(|(k, info)| Some((k, info, data.traces[k].as_ref()?)));
    let channels = measured.map(|(channel, info, trace)| {
        let scaled = |values: Vec<f64>| values.into_iter().map(|value| value * info.scale).collect::<Vec<f64>>();
        let of = |(problem, gap): (&Problem<'_>, &Gap)| scaled(problem.shown(&gap.xi, &gap.fit.runs, shot, channel));
        ChannelCurves {
            name: info.name.clone(),
            measured: scaled(trace.values.clone()),
            base: base.map_or_else(|| vec![f64::NAN; data.times.len()], of),
            extended: of(extended),
            used: trace.used.clone(),
        }
    });
    let channels = channels.collect();
    let held_out = !setup.train.contains(&shot);
    ShotCurves { number: data.number, held_out, times: data.times.clone(), channels }
}

impl super::Report {
    /// `trajectories.csv`: shot, channel, time, measured, base, extended, mask.
    pub fn table(&self) -> String {
        ShotCurves::table(&self.curves, ["base", "extended"])
    }
}

impl ShotCurves {
    /// Shot, channel, time, measured, the two models under these names, mask.
    pub fn table(all: &[Self], [base, extended]: [&str; 2]) -> String {
        let mut text = format!("shot,channel,time_s,measured,{base},{extended},mask\n");
        for shot in all {
            for channel in &shot.channels {
                for (k, time) in shot.times.iter().enumerate() {
                    let used = channel.used[k];
                    let measured = if used { format!("{}", channel.measured[k]) } else { String::new() };
                    // Writing to a String cannot fail.
                    let base =
                        if channel.base[k].is_finite() { format!("{:.8e}", channel.base[k]) } else { String::new() };
                    let _ = writeln!(
                        text,
                        "{},{},{time},{measured},{base},{:.8e},{}",
                        shot.number,
                        channel.name,
                        channel.extended[k],
                        u8::from(!used)
                    );
                }
            }
        }
        text
    }
}

//! Measured and simulated channels side by side, so that anyone can compute the gap again.

use std::fmt::Write;

use super::{AllGaps, Gaps, Scene};
use crate::Fault;

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
    for (shot, data) in setup.data.shots.iter().enumerate() {
        let seen = setup.train.contains(&shot);
        let pick = |gaps: &Gaps| if seen { Some(gaps.train.clone()) } else { gaps.held_out.clone() };
        let (Some(own), with) = (pick(&gaps.before), gaps.after.as_ref().and_then(pick)) else { continue };
        let measured = setup.data.channels.iter().enumerate();
        let measured = measured.filter_map(|(k, info)| Some((k, info, data.traces[k].as_ref()?)));
        let channels = measured.map(|(channel, info, trace)| {
            let scaled = |values: Vec<f64>| values.into_iter().map(|value| value * info.scale).collect::<Vec<f64>>();
            let base = scaled(base.shown(&own.xi, &own.fit.runs, shot, channel));
            let more = with.as_ref().map(|gap| scaled(extended.shown(&gap.xi, &gap.fit.runs, shot, channel)));
            ChannelCurves {
                name: info.name.clone(),
                measured: scaled(trace.values.clone()),
                extended: more.unwrap_or_else(|| base.clone()),
                base,
                used: trace.used.clone(),
            }
        });
        let channels = channels.collect();
        all.push(ShotCurves { number: data.number, held_out: !seen, times: data.times.clone(), channels });
    }
    Ok(all)
}

impl super::Report {
    /// `trajectories.csv`: shot, channel, time, measured, base, extended, mask.
    pub fn table(&self) -> String {
        let mut text = String::from("shot,channel,time_s,measured,base,extended,mask\n");
        for shot in &self.curves {
            for channel in &shot.channels {
                for (k, time) in shot.times.iter().enumerate() {
                    let used = channel.used[k];
                    let measured = if used { format!("{}", channel.measured[k]) } else { String::new() };
                    // Writing to a String cannot fail.
                    let _ = writeln!(
                        text,
                        "{},{},{time},{measured},{:.8e},{:.8e},{}",
                        shot.number,
                        channel.name,
                        channel.base[k],
                        channel.extended[k],
                        u8::from(!used)
                    );
                }
            }
        }
        text
    }
}

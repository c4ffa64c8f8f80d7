//! Shots made ready for a fit: channels in model units, standard deviations, slopes and masks.
//!
//! Samples that are missing or masked have no weight.  Where a channel changes fast, a small error of time is a large one of
//! value; the variance is `sigma^2 + (|dy/dt| tau)^2` with the slope of the smoothed measurement, the largest of its neighbours,
//! and a `tau` that a fit lowers in stages.

use hyd_system::math::square;

use crate::bench::Shot;
use crate::bench::noise::Noise;
use crate::disturbance::{Disturbances, Level};
use crate::machine::span::Span;
use crate::magnitude::{is_plausible, shown};
use crate::record::end_of_range;
use crate::study::Mask;
use crate::study::formula::evaluate;
use crate::{Bench, Fault, Study};

/// Samples to either side over which the slope is the largest.
const NEIGHBOURS: usize = 4;
/// Share of its largest value below which a channel has returned where a mask does not say.
const RETURNED: f64 = 0.05;
/// Share of the evidence that a tolerance of time which nobody states leaves, and how often it is halved until then.
const EVIDENCE: f64 = 0.5;
const HALVINGS: u32 = 12;
/// Output points of a run.
const MOST_INTERVALS: usize = 200_000;

/// One channel of one shot.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Values in units of the model, 0 where there is none.
    pub values: Vec<f64>,
    /// Has the sample a weight?
    pub used: Vec<bool>,
    /// Largest slope nearby (units of the model per s).
    pub slope: Vec<f64>,
}

/// One shot.
#[derive(Clone, Debug)]
pub struct ShotData {
    /// Number given by the lab.
    pub number: usize,
    /// Times (s).
    pub times: Vec<f64>,
    /// Output points of its run.
    pub span: Span,
    /// Channels in the order of [`Data::channels`]; none where the shot lacks it.
    pub traces: Vec<Option<Trace>>,
}

/// A channel of a set.
#[derive(Clone, Debug)]
pub struct ChannelInfo {
    /// Column in the tables.
    pub name: String,
    /// Where the study names it, as the beginning of a sentence.
    pub(crate) place: String,
    /// Words for reports.
    pub words: String,
    /// Unit of the column.
    pub unit: String,
    /// Expression of the model.
    pub expression: String,
    /// Units of the table per unit of the model.
    pub scale: f64,
    /// Scatter in units of the model, as stated.
    pub noise: Noise,
    /// How residuals are weighed beside it.
    pub level: Level,
    /// Standard deviation of the offset in units of the model.
    pub offset: f64,
    /// Standard deviation of the gain.
    pub gain: f64,
    /// Largest minus smallest value over all shots, in units of the model.
    pub range: f64,
    /// Smallest and largest number that is shown, in units of the model; infinite where the range does not end.
    pub limits: (f64, f64),
}

impl ChannelInfo {
    /// Standard deviation that residuals are weighed with (units of the model).
    pub fn sigma(&self) -> f64 {
        self.noise.sigma * self.level.factor
    }
}

/// All shots of a set.
#[derive(Clone, Debug)]
pub struct Data {
    /// Channels that are measured in at least one shot.
    pub channels: Vec<ChannelInfo>,
    /// Shots in their order.
    pub shots: Vec<ShotData>,
    /// Masks of the study that leave out nothing.
    pub idle_masks: Vec<usize>,
}

impl Data {
    /// Weighs channels as these disturbances say, and leaves out their spikes.
    pub(crate) fn disturb(&mut self, disturbances: &Disturbances) {
        for (k, channel) in self.channels.iter_mut().enumerate() {
            channel.level = disturbances.level(k);
        }
        for spike in &disturbances.spikes {
            if let Some(trace) = &mut self.shots[spike.shot].traces[spike.channel] {
                trace.used[spike.sample] = false;
            }
        }
    }

    /// The share of the evidence that is left where fast changes count less by a tolerance of time (in sample periods).
    pub(crate) fn evidence(&self, tau: f64) -> f64 {
        let (mut left, mut count) = (0.0, 0.0);
        for shot in &self.shots {
            let tau = tau * shot.span.step();
            for (trace, channel) in shot.traces.iter().zip(&self.channels) {
                let variance = channel.noise.sigma * channel.noise.sigma;
                for (_, slope) in
                    trace.iter().flat_map(|trace| trace.used.iter().zip(&trace.slope)).filter(|own| *own.0)
                {
                    count += 1.0;
                    left += variance / (variance + square(slope * tau));
                }
            }
        }
        if count > 0.0 { left / count } else { 1.0 }
    }

    /// The largest tolerance of time up to this one that leaves most of the evidence: it is meant for flanks, and a record that moves all the
    /// time is read by a better clock than that.
    pub(crate) fn affordable(&self, tau: f64) -> f64 {
        let halves = (0..HALVINGS).map(|k| tau / f64::from(1_u32 << k));
        halves.into_iter().find(|&tau| self.evidence(tau) >= EVIDENCE).unwrap_or(0.0)
    }

    /// Makes a set ready.
    ///
    /// # Errors
    /// When a channel is unusable: of unknown scatter, or the same number throughout.
    pub fn new(bench: &Bench, study: &Study) -> Result<Self, Fault> {
        let mut channels = Vec::new();
        let measured = |name: &str| bench.shots.iter().any(|shot| shot.values.contains_key(name));
        let named: Vec<_> = study.channels.iter().filter(|(name, _)| measured(name)).collect();
        let names: Vec<&str> = named.iter().map(|(name, _)| name.as_str()).collect();
        let noises = Noise::of_all(bench, study, &names)?;
        for ((name, channel), noise) in named.into_iter().zip(noises) {
            let scale = channel.scale.abs();
            let all =
                || bench.shots.iter().filter_map(|shot| shot.values.get(name)).flatten().filter(|v| v.is_finite());
            let (low, high) = all().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
            if low == high {
                return Err(Fault::new(format!(
                    "channel `{name}` is {low} throughout: a dead sensor? Take it out of the tables or the study"
                )));
            }
            let records = bench.shots.iter().filter_map(|shot| Some((&shot.times[..], &shot.values.get(name)?[..])));
            let ends = channel.range.unwrap_or_else(|| end_of_range(records, (low, high)));
            let ends = (ends.0 / channel.scale, ends.1 / channel.scale);
            channels.push(ChannelInfo {
                name: name.clone(),
                place: study.place(&["channels", name]),
                words: if channel.words.is_empty() { name.clone() } else { channel.words.clone() },
                unit: channel.unit.clone(),
                expression: channel.variable.clone(),
                scale: channel.scale,
                noise: Noise { sigma: noise.sigma / scale, quiet: noise.quiet.map(|quiet| quiet / scale), ..noise },
                level: Level::NOISE,
                offset: bench.offset.get(name).copied().or(channel.offset).unwrap_or(0.0) / scale,
                gain: channel.gain.or(bench.gain).unwrap_or(0.0),
                range: (high - low) / scale,
                limits: (ends.0.min(ends.1), ends.0.max(ends.1)),
            });
        }
        Self { channels, shots: Vec::new(), idle_masks: Vec::new() }.of_shots(&bench.shots, study)
    }

    /// Other shots made ready, with channels as they are known here.
    ///
    /// # Errors
    /// When a run would begin after its first sample, or a value is not one of a variable.
    pub(crate) fn of_shots(&self, shots: &[Shot], study: &Study) -> Result<Self, Fault> {
        let channels = self.channels.clone();
        let mut idle = vec![true; study.shots.masks.len()];
        let shots = shots.iter().map(|shot| shot_data(shot, &channels, study, &mut idle));
        let shots = shots.collect::<Result<_, _>>()?;
        Ok(Self { shots, channels, idle_masks: (0..idle.len()).filter(|&mask| idle[mask]).collect() })
    }

    /// Position of a channel.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|channel| channel.name == name)
    }
}

/// A shot made ready; a mask that leaves out something of it is not `idle`.
fn shot_data(shot: &Shot, channels: &[ChannelInfo], study: &Study, idle: &mut [bool]) -> Result<ShotData, Fault> {
    let times = &shot.times;
    let (first, last) = (times[0], times[times.len() - 1]);
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let step = steps[steps.len() / 2];
    // States that begin at the first samples begin with them.
    let begins = shot.is_window || study.run.start.is_none() && !study.initial.is_empty();
    let stated = if begins { Some(first) } else { study.run.start };
    let start = start_of_run((first, last, step), stated).map_err(|begin| {
        Fault::new(format!("shot {}: runs begin at {begin} s, after the first sample", shot.number))
    })?;
    let intervals = ((last - start) / step).round();
    if start < first && intervals > MOST_INTERVALS as f64 {
        return Err(Fault::new(format!(
            "shot {}: from the start of runs at {start} s to {last} s there are {intervals} sample periods, more than {MOST_INTERVALS}",
            shot.number
        )));
    }
    let span = Span { start, stop: last, intervals: (intervals as usize).clamp(20, MOST_INTERVALS) };
    let mut trace = |channel: &ChannelInfo| -> Result<Option<Trace>, Fault> {
        let Some(raw) = shot.values.get(&channel.name) else { return Ok(None) };
        let mut used: Vec<bool> = raw.iter().map(|value| value.is_finite()).collect();
        let masks = study.shots.masks.iter().enumerate();
        let is_meant = |mask: &Mask| {
            let of_shot = mask.shots.is_empty() || mask.shots.contains(&shot.number);
            of_shot && (mask.channels.is_empty() || mask.channels.contains(&channel.name))
        };
        for own in masks.filter(|(_, mask)| is_meant(mask)) {
            let mut left = vec![true; used.len()];
            apply_mask(study, own, shot, &mut left)?;
            idle[own.0] &= left.iter().all(|left| *left);
            used.iter_mut().zip(left).for_each(|(used, left)| *used &= left);
        }
        let values: Vec<f64> =
            raw.iter().map(|value| if value.is_finite() { value / channel.scale } else { 0.0 }).collect();
        if let Some(k) = (0..values.len()).find(|&k| used[k] && !is_plausible(values[k])) {
            let (place, name) = (study.place(&["channels", &channel.name]), &channel.name);
            let (raw, scale) = (shown(raw[k]), shown(channel.scale));
            let sentence = format!(
                "{place}shot {}: channel `{name}`: {raw} by the scale {scale} is not a value of a variable",
                shot.number
            );
            return Err(Fault::new(sentence));
        }
        let slope = slopes(times, &values, &used);
        Ok(Some(Trace { values, used, slope }))
    };
    let traces = channels.iter().map(&mut trace).collect::<Result<_, _>>()?;
    Ok(ShotData { number: shot.number, times: times.clone(), span, traces })
}

/// When the run of a shot begins, whose samples go from `first` to `last` in steps (s): with its first sample, or
/// before it where the study says so or nothing speaks against the model's usual start at 0.  The error is a start
/// behind the first sample.
fn start_of_run((first, last, step): (f64, f64, f64), stated: Option<f64>) -> Result<f64, f64> {
    let begin = stated.unwrap_or(0.0);
    let is_before = first - begin > 1e-6 * step;
    match stated {
        Some(begin) if begin - first > 1e-6 * step => Err(begin),
        Some(begin) if is_before => Ok(begin),
        None if is_before && first - begin <= last - first => Ok(begin),
        _ => Ok(first),
    }
}

fn apply_mask(study: &Study, (number, mask): (usize, &Mask), shot: &Shot, used: &mut [bool]) -> Result<(), Fault> {
    // A study that was read has one where it has the other.
    let within = mask.within.unwrap_or(0.0);
    for (k, formula) in mask.around.iter().enumerate() {
        let at = evaluate(formula, &|name| shot.conditions.get(name).copied()).map_err(|fault| {
            let place = study.place(&["shots", "masks", &number.to_string(), "around", &k.to_string()]);
            Fault::new(format!("{place}shot {}: {fault}", shot.number))
        })?;
        for (time, used) in shot.times.iter().zip(&mut *used) {
            *used &= (time - at).abs() > within;
        }
    }
    let is_span = mask.from.is_some() || mask.to.is_some() || mask.after_return_of.is_some();
    if !mask.around.is_empty() && !is_span {
        return Ok(());
    }
    let mut from = mask.from.unwrap_or(f64::NEG_INFINITY);
    if let Some(values) = mask.after_return_of.as_ref().and_then(|name| shot.values.get(name)) {
        let below = mask.below.unwrap_or(RETURNED);
        let top = values.iter().copied().filter(|v| v.is_finite()).fold(f64::MIN, f64::max);
        let peak = values.iter().position(|&v| v == top).unwrap_or(0);
        let back = (peak..values.len()).find(|&k| values[k] < below * top);
        from = from.max(back.map_or(f64::INFINITY, |k| shot.times[k]));
    }
    let to = mask.to.unwrap_or(f64::INFINITY);
    for (time, used) in shot.times.iter().zip(used) {
        *used &= !(*time >= from && *time <= to);
    }
    Ok(())
}

/// The largest slope around each sample, from the values smoothed over three.
fn slopes(times: &[f64], values: &[f64], used: &[bool]) -> Vec<f64> {
    let n = values.len();
    let own: Vec<usize> = (0..n).filter(|&k| used[k]).collect();
    if own.len() > 1 && 2 * own.len() < n {
        // A channel that is read by a slower clock than others has neighbours of its own.
        let times: Vec<f64> = own.iter().map(|&k| times[k]).collect();
        let values: Vec<f64> = own.iter().map(|&k| values[k]).collect();
        let mut slope = vec![0.0; n];
        own.iter().zip(slopes(&times, &values, &vec![true; own.len()])).for_each(|(&k, own)| slope[k] = own);
        return slope;
    }
    let smooth: Vec<f64> = (0..n)
        .map(|k| {
            let around = k.saturating_sub(1)..(k + 2).min(n);
            let (sum, count) = around.filter(|&j| used[j]).fold((0.0, 0.0), |(s, c), j| (s + values[j], c + 1.0));
            if count > 0.0 { sum / count } else { values[k] }
        })
        .collect();
    let local: Vec<f64> = (0..n)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            if used[a] && used[b] && b > a { ((smooth[b] - smooth[a]) / (times[b] - times[a])).abs() } else { 0.0 }
        })
        .collect();
    (0..n)
        .map(|k| local[k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(n)].iter().copied().fold(0.0, f64::max))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Data, start_of_run};
    use crate::bench::{Bench, Shot};
    use crate::study::Study;

    /// A tolerance of time is for flanks: one that would leave the turning points of a swing alone is lowered until half of the
    /// evidence is left, and a step in a quiet record changes nothing.
    #[test]
    fn precise_records_that_move_keep_their_evidence() {
        let text = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"x\", noise = 1e-4 }\n";
        let study = Study::parse(text).unwrap_or_else(|fault| panic!("{fault}"));
        let data = |value: &dyn Fn(f64) -> f64| {
            let times: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
            let values = BTreeMap::from([("y".to_string(), times.iter().map(|&t| value(t)).collect())]);
            let bench = Bench { shots: vec![Shot { times, values, ..Shot::default() }], ..Bench::default() };
            Data::new(&bench, &study).unwrap_or_else(|fault| panic!("{fault}"))
        };
        let swing = data(&|t| (6.0 * t).sin());
        let lowered = swing.affordable(0.1);
        assert!(swing.evidence(0.1) < 0.05 && lowered < 0.01, "{} {lowered}", swing.evidence(0.1));
        assert!(lowered > 0.0 && swing.evidence(lowered) >= 0.5 && swing.evidence(2.0 * lowered) < 0.5);
        let step = data(&|t| if t > 5.0 { 1.0 } else { 0.0 });
        assert_eq!(step.affordable(0.1), 0.1);
    }

    #[test]
    fn runs_begin_with_the_model_where_the_record_begins_later() {
        // A record with a part before the trigger, one that begins a sample late, one whose clock counts from elsewhere.
        assert_eq!(start_of_run((-0.002, 0.04, 5e-5), None), Ok(-0.002));
        assert_eq!(start_of_run((5e-5, 0.04, 5e-5), None), Ok(0.0));
        assert_eq!(start_of_run((100.0, 100.04, 5e-5), None), Ok(100.0));
        assert_eq!(start_of_run((100.0, 100.04, 5e-5), Some(99.99)), Ok(99.99));
        assert_eq!(start_of_run((0.0, 0.04, 5e-5), None), Ok(0.0));
        assert_eq!(start_of_run((0.0, 0.04, 5e-5), Some(0.01)), Err(0.01));
    }
}

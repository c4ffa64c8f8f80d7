//! The comparison of one model with a set: runs, residuals in standard deviations, and their derivatives.
//!
//! A residual is `(measured - gain * model(t - shift) - offset)/sigma`, whitened where the noise is correlated; there
//! is a shift where a study does not say which times of the machine move with a trigger that scatters, where a channel lags, and
//! where a clock runs fast ([`chain`]).

mod chain;
mod derivatives;

use hyd_system::math::square;
use nalgebra::DVector;

use crate::Fault;
use crate::data::{ChannelInfo, Data};
use crate::fit::Fit;
use crate::machine::span::Span;
use crate::machine::{Job, Machine, ParameterPlace};
use crate::magnitude::RESOLVED;
use crate::threads::each;
use crate::unknowns::{Meaning, Unknown};

/// Channels of every shot on its output points; none for shots that were not run.
pub(crate) type Runs = Vec<Option<Vec<Vec<f64>>>>;

/// A model, the shots, and what may be changed.
pub struct Problem<'a> {
    /// The model.
    pub machine: &'a Machine,
    /// The shots.
    pub data: &'a Data,
    /// Places of the parameters that are set for every run.
    pub places: Vec<ParameterPlace>,
    /// Their values under the conditions of each shot.
    pub base: Vec<Vec<f64>>,
    /// What may be changed.
    pub unknowns: Vec<Unknown>,
    /// A model that runs much faster and has the first unknowns of this one: derivatives by them are taken from it.  They are
    /// then not those of this model; steps made with them are judged by runs of this one all the same.
    pub lender: Option<&'a Problem<'a>>,
}

/// Standard deviations beyond which the end of a fit is doubted.
const PULLED: f64 = 4.0;

/// How residuals are weighed: a stage of a fit.
#[derive(Clone, Debug)]
pub struct Weighing {
    /// Shots that count.
    pub shots: Vec<usize>,
    /// Share of the record that counts.
    pub horizon: f64,
    /// Factor on all standard deviations.
    pub inflation: f64,
    /// Tolerance of time, in sample periods.
    pub tau: f64,
}

impl Weighing {
    /// True weights over the whole of these shots.
    pub fn whole(shots: &[usize], tau: f64) -> Self {
        Self { shots: shots.to_vec(), horizon: 1.0, inflation: 1.0, tau }
    }
}

/// Where a share of a record ends (s).  What comes before 0, the record before the trigger, is not part of the share,
/// nor is the time before a run whose clock counts from elsewhere.
fn end_of(span: &Span, horizon: f64) -> f64 {
    let from = span.start.max(0.0);
    from + horizon * (span.stop - from)
}

impl Problem<'_> {
    /// Numbers of all shots.
    pub fn all_shots(&self) -> Vec<usize> {
        (0..self.data.shots.len()).collect()
    }

    /// True if something that is not a number of an effect is farther from what is expected than measurements of it leave open.
    pub(crate) fn is_pulled(&self, xi: &[f64]) -> bool {
        !self.beyond(xi, PULLED).is_empty()
    }

    /// What is not a number of an effect and farther from what is expected than so many standard deviations.
    pub(crate) fn beyond(&self, xi: &[f64], limit: f64) -> Vec<usize> {
        (0..xi.len()).filter(|&k| self.unknowns[k].effect.is_none() && xi[k].abs() > limit).collect()
    }

    /// All but the numbers of effects as expected.
    pub(crate) fn expected_nuisances(&self, xi: &[f64]) -> Vec<f64> {
        self.unknowns.iter().zip(xi).map(|(own, &xi)| if own.effect.is_some() { xi } else { 0.0 }).collect()
    }

    /// Parameter values of a shot.
    pub(crate) fn values(&self, xi: &[f64], shot: usize) -> Vec<f64> {
        let mut values = self.base[shot].clone();
        for (unknown, &xi) in self.unknowns.iter().zip(xi).filter(|(unknown, _)| unknown.touches(shot)) {
            match &unknown.meaning {
                Meaning::Relative { places, .. } => places.iter().for_each(|&k| values[k] *= unknown.value(xi)),
                Meaning::Value { places, .. } => places.iter().for_each(|&k| values[k] = unknown.value(xi)),
                Meaning::Late { places, .. } => places.iter().for_each(|&k| values[k] += unknown.value(xi)),
                Meaning::Offset { .. }
                | Meaning::Gain { .. }
                | Meaning::Course { .. }
                | Meaning::Lag { .. }
                | Meaning::Clock { .. } => {}
            }
        }
        values
    }

    /// Output points of each shot up to a share of the record.
    pub(crate) fn spans(&self, horizon: f64) -> Vec<Span> {
        let cut = |span: &Span| {
            let wanted = ((end_of(span, horizon) - span.start) / span.step()).ceil().max(8.0) as usize;
            let intervals = wanted.min(span.intervals);
            let stop =
                if intervals == span.intervals { span.stop } else { span.start + intervals as f64 * span.step() };
            Span { start: span.start, stop, intervals }
        };
        self.data.shots.iter().map(|shot| cut(&shot.span)).collect()
    }

    /// Runs the shots of a stage.
    ///
    /// # Errors
    /// The first run that failed.
    pub fn simulate(&self, xi: &[f64], weighing: &Weighing) -> Result<Runs, Fault> {
        let jobs =
            weighing.shots.iter().map(|&shot| Job { span: shot, values: self.values(xi, shot), derived: Vec::new() });
        let jobs: Vec<Job> = jobs.collect();
        let answers = self.machine.run(&self.spans(weighing.horizon), &self.places, &jobs);
        let mut runs: Runs = vec![None; self.data.shots.len()];
        for (job, answer) in jobs.iter().zip(answers) {
            runs[job.span] = Some(answer.map_err(|fault| {
                let sentence = format!("shot {}: {fault}", self.data.shots[job.span].number);
                Fault { sentence, ..fault }
            })?);
        }
        Ok(runs)
    }

    /// Residuals of all samples of the stage's shots, shot by shot and channel by channel; 0 where a sample has no weight.
    pub fn residuals(&self, xi: &[f64], runs: &Runs, weighing: &Weighing) -> DVector<f64> {
        let spans = self.spans(weighing.horizon);
        let shots = &weighing.shots;
        let of = |k: usize| self.residuals_of(shots[k], xi, (runs, &spans[shots[k]]), weighing);
        DVector::from_vec(each(self.machine.threads(), shots.len(), &of).concat())
    }

    fn residuals_of(&self, shot: usize, xi: &[f64], (runs, span): (&Runs, &Span), weighing: &Weighing) -> Vec<f64> {
        let data = &self.data.shots[shot];
        let mut all = Vec::with_capacity(self.rows_of(shot));
        for (channel, trace) in data.traces.iter().enumerate() {
            let begin = all.len();
            let (Some(trace), Some(run)) = (trace, &runs[shot]) else { continue };
            let chain = self.chain(xi, shot, channel);
            let weights = self.weights(shot, channel, weighing);
            for (k, &time) in data.times.iter().enumerate() {
                let weight = weights[k];
                all.push(if weight > 0.0 {
                    let model = span.at(&run[channel], chain.machine_time(time)).0;
                    (trace.values[k] - chain.shown(model, time)) * weight
                } else {
                    0.0
                });
            }
            self.whiten(channel, &weights, &mut all[begin..]);
        }
        all
    }

    /// Refuses an answer whose misfit shows nothing.
    ///
    /// # Errors
    /// The shot and the channel that are farthest from the model.
    pub fn check_misfit(&self, fit: &Fit, weighing: &Weighing) -> Result<(), Fault> {
        if fit.misfit <= RESOLVED { Ok(()) } else { Err(self.overflow(&fit.xi, &fit.runs, weighing)) }
    }

    /// Why a misfit shows nothing: the shot and the channel whose residuals are the largest.
    pub(crate) fn overflow(&self, xi: &[f64], runs: &Runs, weighing: &Weighing) -> Fault {
        let spans = self.spans(weighing.horizon);
        let mut worst = (0.0, None);
        for &shot in &weighing.shots {
            let data = &self.data.shots[shot];
            let residuals = self.residuals_of(shot, xi, (runs, &spans[shot]), weighing);
            let channels = (0..data.traces.len()).filter(|&channel| data.traces[channel].is_some());
            for (channel, part) in channels.zip(residuals.chunks(data.times.len().max(1))) {
                // What is not a number is worse than any.
                let largest = part.iter().map(|r| if r.is_nan() { f64::INFINITY } else { r.abs() }).fold(0.0, f64::max);
                if largest > worst.0 {
                    worst = (largest, Some((shot, channel)));
                }
            }
        }
        let Some((shot, channel)) = worst.1 else { return Fault::new("the misfit is not a number") };
        let number = self.data.shots[shot].number;
        let ChannelInfo { name, place, .. } = &self.data.channels[channel];
        let far = if worst.0.is_finite() {
            format!("{:.0e} standard deviations of the noise", worst.0)
        } else {
            "more than there are numbers for".to_string()
        };
        Fault::new(format!(
            "{place}shot {number}, channel `{name}`: model and measurement are {far} apart, so that the misfit shows nothing; check units and \
             scale of the channel, conditions, and the noise that is stated"
        ))
    }

    /// Change of the whitened residuals when the channels go from `runs` to `other`.
    pub fn signature(&self, xi: &[f64], runs: &Runs, other: &Runs, weighing: &Weighing) -> DVector<f64> {
        self.residuals(xi, other, weighing) - self.residuals(xi, runs, weighing)
    }

    /// Number of samples of the stage's shots, with or without weight.
    pub fn rows(&self, weighing: &Weighing) -> usize {
        weighing.shots.iter().map(|&shot| self.rows_of(shot)).sum()
    }

    /// The rows of each of the stage's shots.
    pub(crate) fn parts(&self, weighing: &Weighing) -> Vec<std::ops::Range<usize>> {
        let mut first = 0;
        let part = |&shot: &usize| {
            let own = first..first + self.rows_of(shot);
            first = own.end;
            own
        };
        weighing.shots.iter().map(part).collect()
    }

    fn rows_of(&self, shot: usize) -> usize {
        let data = &self.data.shots[shot];
        data.times.len() * data.traces.iter().flatten().count()
    }

    /// What the sum of squares is when nothing but noise is left: the sum over samples with weight of the share of the
    /// variance that is noise.
    pub fn expected(&self, weighing: &Weighing) -> f64 {
        let mut sum = 0.0;
        for &shot in &weighing.shots {
            for (channel, info) in self.data.channels.iter().enumerate() {
                if self.data.shots[shot].traces[channel].is_some() {
                    sum += self.weights(shot, channel, weighing).iter().map(|w| square(w * info.sigma())).sum::<f64>()
                        / info.level.samples();
                }
            }
        }
        sum
    }

    /// Reciprocal standard deviations of the samples of a channel, 0 for those that do not count.
    pub fn weights(&self, shot: usize, channel: usize, weighing: &Weighing) -> Vec<f64> {
        let data = &self.data.shots[shot];
        let Some(trace) = &data.traces[channel] else { return Vec::new() };
        let end = end_of(&data.span, weighing.horizon) + 1e-9 * data.span.step();
        let tau = weighing.tau * data.span.step();
        let sigma = self.data.channels[channel].sigma();
        let samples = data.times.iter().zip(trace.used.iter().zip(&trace.slope));
        let weight = |(&time, (&used, &slope)): (&f64, (&bool, &f64))| {
            if used && time <= end {
                1.0 / (weighing.inflation * (sigma * sigma + square(slope * tau)).sqrt())
            } else {
                0.0
            }
        };
        samples.map(weight).collect()
    }

    /// The weights of all rows of [`Problem::residuals`].
    pub fn all_weights(&self, weighing: &Weighing) -> Vec<f64> {
        let channels = 0..self.data.channels.len();
        let blocks = weighing.shots.iter().flat_map(|&shot| channels.clone().map(move |channel| (shot, channel)));
        blocks.flat_map(|(shot, channel)| self.weights(shot, channel, weighing)).collect()
    }

    /// Takes the correlation out of neighbouring residuals that both count.
    pub(crate) fn whiten(&self, channel: usize, weights: &[f64], residuals: &mut [f64]) {
        let rho = self.data.channels[channel].noise.rho;
        if rho == 0.0 {
            return;
        }
        let scale = (1.0 - rho * rho).sqrt();
        for k in (1..residuals.len()).rev() {
            if weights[k] > 0.0 && weights[k - 1] > 0.0 {
                residuals[k] = (residuals[k] - rho * residuals[k - 1]) / scale;
            }
        }
    }

    /// A channel as it would be shown, at the times of the shot.
    pub fn shown(&self, xi: &[f64], runs: &Runs, shot: usize, channel: usize) -> Vec<f64> {
        let data = &self.data.shots[shot];
        let Some(run) = &runs[shot] else { return Vec::new() };
        let chain = self.chain(xi, shot, channel);
        let shown = |&time: &f64| chain.shown(data.span.at(&run[channel], chain.machine_time(time)).0, time);
        data.times.iter().map(shown).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::end_of;
    use crate::machine::span::Span;

    #[test]
    fn a_share_of_a_record_does_not_depend_on_its_clock() {
        let end = |start: f64, stop: f64| end_of(&Span { start, stop, intervals: 20 }, 0.25);
        assert_eq!(end(0.0, 0.04), 0.01);
        // The record before the trigger is not part of the share.
        assert_eq!(end(-0.002, 0.04), 0.01);
        assert!((end(100.0, 100.04) - 100.01).abs() < 1e-12);
    }
}

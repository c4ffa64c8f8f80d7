//! One input of the model: it follows recorded samples, and then which of them counts, or a line that is given from outside.

use std::sync::Arc;

use hyd_system::{Sample, Series};

/// A straight line through a point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Line {
    pub value: f64,
    pub slope: f64,
    pub from: f64,
}

/// One input.
#[derive(Clone, Debug, Default)]
pub(crate) struct Follower {
    pub series: Option<Arc<Series>>,
    /// What is said from outside, instead of samples.
    pub line: Option<Line>,
    /// The samples that count are chosen by events.
    pub stepwise: bool,
    /// The sample that counts, or where the last search has ended.
    pub sample: usize,
    /// The derivative at the time that was asked for last.
    pub slope: f64,
    pub curvature: f64,
}

impl Follower {
    /// What the input is at a time (s).
    fn at(&mut self, t: f64) -> Sample {
        if let Some(Line { value, slope, from }) = self.line {
            let value = if slope == 0.0 { value } else { value + slope * (t - from) };
            return Sample { value, slope, curvature: 0.0 };
        }
        let Some(series) = &self.series else { return Sample::default() };
        if !self.stepwise {
            self.sample = series.interval(t, self.sample);
        }
        series.at(t, self.sample)
    }

    /// Brings the input to a time (s); its value and slope there.
    pub(crate) fn move_to(&mut self, t: f64) -> (f64, f64) {
        let Sample { value, slope, curvature } = self.at(t);
        (self.slope, self.curvature) = (slope, curvature);
        (value, slope)
    }

    /// The next sample (s) at which it jumps.
    pub(crate) fn next_break(&self) -> Option<f64> {
        let series = self.series.as_ref().filter(|_| self.stepwise)?;
        series.next_break(self.sample).map(|k| series.times()[k])
    }
}

//! A channel that lags behind the others, and a clock that runs fast: what shifts curves in time without changing them.
//!
//! To first order a shift leaves the slope of the curve, a wrong clock the slope times the time since the trigger.  Much of what a
//! machine lacks looks a little like it, so a shift is taken up only where it explains nearly all that is left.  Parameters bend far to
//! make up for a clock, so that what they are spared counts as well as what is explained.

use super::explain::{Columns, Explained};
use super::{Block, State};
use crate::evidence::thresholds::adequate;

/// Share of what is left over noise that a shift must explain.
const EXPLAINED: f64 = 0.8;
/// Longest lag, as a share of the shortest record.
const LONGEST: f64 = 0.05;
/// Largest error of a clock, as a part.
const LARGEST: f64 = 0.03;

impl State<'_> {
    /// Change of the residuals per second by which a channel lags, or per part by which the clock of all channels runs fast.
    pub(super) fn late(&self, channel: Option<usize>) -> Columns {
        let mut values = vec![0.0; self.residuals.len()];
        for block in self.of(channel) {
            let data = &self.problem.data.shots[block.shot];
            let Some(run) = &self.fit.runs[block.shot] else { continue };
            let chain = self.problem.chain(&self.fit.xi, block.shot, block.channel);
            let rows = block.first..block.first + block.rows;
            let weights = &self.weights[rows.clone()];
            for ((row, &time), &weight) in values[rows.clone()].iter_mut().zip(&data.times).zip(weights) {
                let (value, rate) = data.span.at(&run[block.channel], chain.machine_time(time));
                let later = if channel.is_some() { 1.0 } else { time };
                if weight > 0.0 && !chain.is_clipped(value, time) {
                    *row = -weight * chain.gain * rate * later;
                }
            }
            self.problem.whiten(block.channel, weights, &mut values[rows]);
        }
        Columns { first: 0, values }
    }

    /// True if a shift of a channel, or a clock, explains nearly all that is left there, and goes no farther than may be.
    pub(super) fn is_timing(&self, channel: Option<usize>, found: &Explained) -> bool {
        let length = |block: &Block| {
            let times = &self.problem.data.shots[block.shot].times;
            times[times.len() - 1] - times[0]
        };
        let largest = match channel {
            Some(_) => LONGEST * self.of(channel).map(length).fold(f64::INFINITY, f64::min),
            None => LARGEST,
        };
        let square = |values: &nalgebra::DVector<f64>| -> f64 {
            self.of(channel).map(|block| values.rows(block.first, block.rows).norm_squared()).sum()
        };
        let expected = self.expected(channel);
        let (before, after) = (square(&self.residuals), square(&found.left));
        let is_explained = after <= adequate(expected) || after - expected <= (1.0 - EXPLAINED) * (before - expected);
        found.amplitudes[0].abs() <= largest && is_explained
    }

    /// The blocks of a channel, or all.
    fn of(&self, channel: Option<usize>) -> impl Iterator<Item = &Block> {
        self.blocks.iter().filter(move |block| channel.is_none_or(|own| block.channel == own))
    }
}

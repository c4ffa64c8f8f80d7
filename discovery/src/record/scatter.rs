//! Noise of a record: from differences of neighbours, from the part before the trigger, and the step of the numbers.
//!
//! Third differences leave out what is smooth; for white noise their variance is 20 times that of the noise (a generalisation of von
//! Neumann, "Distribution of the ratio of the mean square successive difference to the variance", 1941).  Their quartiles leave out
//! what is fast and rare.  Noise that is correlated from sample to sample looks smaller in differences than before the trigger.

use super::{drift, median};

/// Fewest differences from which noise is taken.
const FEWEST: usize = 20;
/// Distance of the quartiles of a normal distribution in standard deviations.
const QUARTILES: f64 = 1.348_98;
/// Variance of third differences of white noise of variance 1: 1 + 9 + 9 + 1.
const VARIANCE: f64 = 20.0;
/// Steps of time within a difference differ by no more than this factor.
const EVEN: f64 = 1.5;
/// Samples that share a level where there are few levels.
const LEVELS: usize = 5;
/// Most samples that are searched for the step of the numbers.
const MOST: usize = 20_000;
/// How far a distance of neighbouring values may be from a multiple of the step, in steps.
const NEAR: f64 = 0.1;
/// Share of the distances that are multiples of the step.
const SHARE: f64 = 0.98;

/// Noise by the differences of neighbouring samples.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Scatter {
    /// Standard deviation of the noise and rounding together (unit of the values).
    pub sigma: f64,
    /// Step of the numbers, if they have one.
    pub step: Option<f64>,
    /// Number of differences.
    pub samples: usize,
}

impl Scatter {
    /// Standard deviation without the rounding to steps, whose variance is a twelfth of the square of the step.
    pub fn without_rounding(&self) -> f64 {
        let rounding = self.step.unwrap_or(0.0).powi(2) / 12.0;
        (self.sigma * self.sigma - rounding).max(0.0).sqrt()
    }
}

/// The part of a record before the trigger.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Quiet {
    /// Mean.
    pub level: f64,
    /// Standard deviation about a straight line.
    pub sigma: f64,
    /// Number of samples.
    pub samples: usize,
}

/// Noise by third differences; none where there are fewer than twenty.
///
/// Where a channel has a value in every tenth row only, those rows are its neighbours.
pub fn scatter(times: &[f64], values: &[f64]) -> Option<Scatter> {
    let (times, values): (Vec<f64>, Vec<f64>) =
        times.iter().zip(values).filter(|(t, v)| t.is_finite() && v.is_finite()).map(|(t, v)| (*t, *v)).unzip();
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let longest = EVEN * median(&mut steps)?;
    let is_even = |t: &[f64]| t.windows(2).all(|pair| pair[1] - pair[0] <= longest);
    let quadruples = times.windows(4).zip(values.windows(4)).filter(|(t, _)| is_even(t));
    let mut thirds: Vec<f64> = quadruples.map(|(_, v)| v[3] - 3.0 * v[2] + 3.0 * v[1] - v[0]).collect();
    let samples = thirds.len();
    if samples < FEWEST {
        return None;
    }
    thirds.sort_unstable_by(f64::total_cmp);
    let step = step(&values);
    let sigma = (quartile(&thirds, 3, step) - quartile(&thirds, 1, step)) / QUARTILES / VARIANCE.sqrt();
    Some(Scatter { sigma, step, samples })
}

/// A quartile of sorted numbers; equal ones count as spread over their step, as in a table of groups.
fn quartile(sorted: &[f64], number: usize, step: Option<f64>) -> f64 {
    let place = (number * sorted.len() / 4).min(sorted.len() - 1);
    let value = sorted[place];
    let Some(step) = step else { return value };
    let (from, to) = (
        sorted.partition_point(|&own| own < value - 0.5 * step),
        sorted.partition_point(|&own| own < value + 0.5 * step),
    );
    value + step * ((number as f64 * sorted.len() as f64 / 4.0 - from as f64) / (to - from).max(1) as f64 - 0.5)
}

/// Level and noise before `trigger` (s) about a straight line; none for fewer than twenty samples.
pub fn quiet(times: &[f64], values: &[f64], trigger: f64) -> Option<Quiet> {
    let end = times.partition_point(|&t| t < trigger).min(values.len());
    let line = drift(times.get(..end)?, values.get(..end)?)?;
    (line.samples >= FEWEST).then_some(Quiet { level: line.mean, sigma: line.sigma, samples: line.samples })
}

/// The step of which the distances of the values are multiples; none where there is none, or too few values to tell.
pub fn step(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).take(MOST).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let largest = sorted.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let rounding = 1e-12 * largest;
    let mut distances: Vec<f64> =
        sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|distance| *distance > rounding).collect();
    // A few levels are steps where many samples share them.
    let shared = distances.len() >= 2 && LEVELS * distances.len() < sorted.len();
    if distances.len() < FEWEST / 2 && !shared {
        return None;
    }
    distances.sort_unstable_by(f64::total_cmp);
    // The commonest distance is one step where values are dense; the smallest one is where they are sparse.
    [distances[distances.len() / 2], distances[0]].into_iter().find_map(|first| {
        let refined = refine(&distances, first);
        let is_multiple = |distance: &&f64| {
            let multiple = **distance / refined;
            // Text rounds values, too; many steps in one distance would add up what is off.
            multiple > 10.0 || multiple > 0.5 && (multiple - multiple.round()).abs() < NEAR
        };
        let multiples = distances.iter().filter(is_multiple).count();
        let single = distances.iter().filter(|distance| **distance < 10.5 * refined).count();
        let is_step = multiples as f64 >= SHARE * distances.len() as f64 && 2 * single > distances.len();
        is_step.then_some(refined)
    })
}

/// The mean of the distances that are one step.
fn refine(distances: &[f64], first: f64) -> f64 {
    let single = || distances.iter().filter(|distance| (**distance / first - 1.0).abs() < 0.3);
    single().sum::<f64>() / single().count().max(1) as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fit::schedule::Draws;

    fn times(count: u32) -> Vec<f64> {
        (0..count).map(|k| f64::from(k) * 1e-4).collect()
    }

    #[test]
    fn noise_is_found_under_a_signal_with_jumps() {
        let mut draws = Draws(11);
        let times = times(20_000);
        let signal = |t: f64| 30.0 * (200.0 * t).sin() + if t > 0.7 { 100.0 } else { 0.0 };
        let values: Vec<f64> = times.iter().map(|&t| signal(t) + 0.5 * draws.normal()).collect();
        let found = scatter(&times, &values).unwrap();
        assert!((found.sigma / 0.5 - 1.0).abs() < 0.03, "{found:?}");
        assert_eq!(found.step, None);
        // The same without a noise has none to speak of.
        let smooth: Vec<f64> = times.iter().map(|&t| signal(t)).collect();
        assert!(scatter(&times, &smooth).unwrap().sigma < 1e-4);
    }

    #[test]
    fn steps_of_numbers_are_found_and_taken_out() {
        let mut draws = Draws(5);
        let times = times(5000);
        for (step_of, decimals) in [(0.01, 2), (20.0 / 4096.0, 4), (0.25, 6)] {
            let exact: Vec<f64> = times.iter().map(|&t| 3.0 * (90.0 * t).sin() + 0.2 * draws.normal()).collect();
            let written = |value: f64| format!("{value:.decimals$}").parse::<f64>().unwrap();
            let values: Vec<f64> = exact.iter().map(|value| written((value / step_of).round() * step_of)).collect();
            let found = scatter(&times, &values).unwrap();
            let step = found.step.unwrap();
            assert!((step / step_of - 1.0).abs() < 0.02, "{step} instead of {step_of}");
            assert!((found.without_rounding() / 0.2 - 1.0).abs() < 0.1, "{found:?}");
        }
        let constant = vec![1.5; 5000];
        assert_eq!(scatter(&times, &constant).unwrap().sigma, 0.0);
    }

    #[test]
    fn the_part_before_the_trigger_has_its_own_noise() {
        let mut draws = Draws(7);
        let times: Vec<f64> = (0..6000).map(|k| f64::from(k) * 1e-4 - 0.2).collect();
        let values: Vec<f64> =
            times.iter().map(|&t| 4.0 + if t >= 0.0 { 1e3 * t } else { 0.0 } + 0.1 * draws.normal()).collect();
        let found = quiet(&times, &values, 0.0).unwrap();
        assert!((found.sigma / 0.1 - 1.0).abs() < 0.05 && (found.level - 4.0).abs() < 0.01, "{found:?}");
        assert_eq!((found.samples, quiet(&times, &values, -0.1995)), (2000, None));
    }
}

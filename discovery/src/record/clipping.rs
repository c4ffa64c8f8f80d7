//! Clipping: samples that stand exactly at the largest or smallest value because the range of a sensor or recorder ends there.
//!
//! A clipped signal comes to its limit at speed, stays there to the last digit, and leaves at speed.  A part that rests (before the
//! first or after the last move) is none, nor is a signal of two levels, nor are neighbours that noise leaves within one step of the numbers.  A part of a machine that is stopped at speed looks the same in a
//! record without noise; where noise is seen elsewhere but not at the limit, the limit is that of the measuring chain ([`end_of_range`]).

use hyd_system::math::{exp, powi};

use super::scatter::SEEN;
use super::{Scatter, Stuck, scatter};

/// Fewest equal samples in a row.
const FEWEST: usize = 4;
/// Share of the samples that lie between the extremes in a signal of more than two levels.
const BETWEEN: f64 = 0.05;
/// Equal neighbours elsewhere, as a share, from which on equal neighbours tell nothing.
const EQUAL: f64 = 0.5;
/// How steep a signal comes and leaves, as a part of its range per sample.
const STEEP: f64 = 1e-4;
/// Largest chance of a run of equal samples that is taken for the end of a range.
const CHANCE: f64 = 1e-4;

/// Values at the end of the range.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Clipping {
    /// Largest value, its samples within runs, and the longest run; none where nothing is clipped there.
    pub top: Option<Limit>,
    /// The same for the smallest value.
    pub bottom: Option<Limit>,
}

impl Clipping {
    /// The same without dropouts, whose value may be an extreme one; none where nothing is left.
    pub(super) fn without(self, dropouts: &[Stuck]) -> Option<Self> {
        let left = |limit: Option<Limit>| {
            let own = limit?;
            let lost: usize = dropouts.iter().filter(|lost| lost.value == own.value).map(|lost| lost.samples).sum();
            Some(Limit { samples: own.samples.saturating_sub(lost), ..own }).filter(|own| own.samples >= FEWEST)
        };
        let own = Self { top: left(self.top), bottom: left(self.bottom) };
        (own.top.is_some() || own.bottom.is_some()).then_some(own)
    }
}

/// One end of the range.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Limit {
    /// The value.
    pub value: f64,
    /// Samples that stand there.
    pub samples: usize,
    /// Longest run of them.
    pub longest: usize,
    /// Position of the first sample of that run.
    pub index: usize,
}

/// Where the range of a measuring chain ends by its records, whose smallest and largest values are `(low, high)`; infinite where it
/// does not.
///
/// The end of a range hides the noise that is seen elsewhere: so many equal samples at the extreme of all records are no chance.
pub(crate) fn end_of_range<'r>(
    records: impl Iterator<Item = (&'r [f64], &'r [f64])>,
    (low, high): (f64, f64),
) -> (f64, f64) {
    let (mut bottom, mut top) = (f64::NEG_INFINITY, f64::INFINITY);
    for (times, values) in records {
        let is_seen = |sigma: f64| sigma > SEEN * (high - low);
        let Some(own) = scatter(times, values).filter(|own| own.is_settled && is_seen(own.sigma)) else { continue };
        let ends = |value: f64| {
            let run = longest_run(values, value);
            run >= FEWEST && !is_chance(run, &own, values.len())
        };
        if ends(high) {
            top = high;
        }
        if ends(low) {
            bottom = low;
        }
    }
    (bottom, top)
}

/// Could so many equal samples in a row be chance, in a record of `count` samples with this noise?
pub(super) fn is_chance(run: usize, noise: &Scatter, count: usize) -> bool {
    // A sample of normal noise about the middle of a step falls into that step, which is the most likely one.
    let alike = share_within(0.5 * noise.step.unwrap_or(0.0) / noise.sigma);
    powi(alike, run as i32 - 1) * count as f64 > CHANCE
}

/// The most samples in a row that have exactly this value.
fn longest_run(values: &[f64], value: f64) -> usize {
    let (mut longest, mut run) = (0, 0);
    for &own in values {
        run = if own == value { run + 1 } else { 0 };
        longest = longest.max(run);
    }
    longest
}

/// Share of a normal distribution within so many standard deviations of its mean (Abramowitz and Stegun, 7.1.26, to 1.5e-7).
fn share_within(deviations: f64) -> f64 {
    let x = deviations / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let sum = ((((1.061_405_429 * t - 1.453_152_027) * t + 1.421_413_741) * t - 0.284_496_736) * t + 0.254_829_592) * t;
    1.0 - sum * exp(-x * x)
}

/// Where a record with this noise is clipped; none where it is not.
pub(crate) fn clipping(values: &[f64], noise: Option<&Scatter>) -> Option<Clipping> {
    let finite: Vec<(usize, f64)> = values.iter().copied().enumerate().filter(|(_, v)| v.is_finite()).collect();
    let (low, high) = finite.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &(_, v)| (l.min(v), h.max(v)));
    let between = finite.iter().filter(|(_, v)| *v > low && *v < high).count();
    if high <= low || (between as f64) < BETWEEN * finite.len() as f64 {
        return None;
    }
    let inner = || finite.windows(2).filter(|pair| pair.iter().all(|(_, v)| *v > low && *v < high));
    let equal = inner().filter(|pair| pair[0].1 == pair[1].1).count() as f64;
    if equal >= EQUAL * inner().count().max(1) as f64 {
        return None;
    }
    let stepped = noise.filter(|own| own.step.is_some());
    let is_shown = |own: &Limit| !stepped.is_some_and(|noise| is_chance(own.longest, noise, finite.len()));
    let at = |value: f64| limit(&finite, value, high - low).filter(is_shown);
    let found = Clipping { top: at(high), bottom: at(low) };
    (found.top.is_some() || found.bottom.is_some()).then_some(found)
}

fn limit(finite: &[(usize, f64)], value: f64, range: f64) -> Option<Limit> {
    let mut found: Option<Limit> = None;
    let mut k = 0;
    while k < finite.len() {
        let run = finite[k..].iter().take_while(|(_, v)| *v == value).count();
        if run >= FEWEST && k >= 1 && k + run < finite.len() {
            let steep = |other: usize| (finite[other].1 - value).abs() > STEEP * range;
            if steep(k - 1) && steep(k + run) {
                let index = finite[k].0;
                let own = found.get_or_insert(Limit { value, samples: 0, longest: 0, index });
                own.samples += run;
                if run > own.longest {
                    (own.longest, own.index) = (run, index);
                }
            }
        }
        k += run.max(1);
    }
    found
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    #[test]
    fn a_signal_that_leaves_the_range_is_clipped() {
        let mut draws = SplitMix(4);
        let exact: Vec<f64> = (0..2000).map(|k| 12.0 * (f64::from(k) / 100.0).sin() + 0.05 * draws.normal()).collect();
        let clipped: Vec<f64> = exact.iter().map(|value| value.clamp(-20.0, 10.0)).collect();
        let found = clipping(&clipped, None).unwrap();
        let beyond = exact.iter().filter(|value| **value >= 10.0).count();
        let top = found.top.unwrap();
        assert!(found.bottom.is_none() && top.value == 10.0, "{found:?}");
        assert!(top.samples <= beyond && top.samples + 30 > beyond && top.longest > 100, "{top:?}, {beyond} beyond");
        assert_eq!(clipping(&exact, None), None);
    }

    /// A range that ends is told of noise that is missing there, at rest, too; a stop of the machine is not, nor is a recorder that shows
    /// little but its steps.
    #[test]
    fn the_end_of_a_range_hides_the_noise() {
        let mut draws = SplitMix(5);
        let times: Vec<f64> = (0..1000).map(f64::from).collect();
        let fall = |k: usize| if k < 200 { 9.0 } else { 9.0 * (-(k as f64 - 200.0) / 300.0).exp() };
        let mut of = |noise: f64, step: f64, end: f64| -> (f64, f64) {
            let value = |k: usize| ((fall(k).min(8.0) + noise * draws.normal()).min(end) / step).round() * step;
            let values: Vec<f64> = (0..1000).map(value).collect();
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            end_of_range(std::iter::once((&times[..], &values[..])), (low, high))
        };
        let none = (f64::NEG_INFINITY, f64::INFINITY);
        assert_eq!(of(0.02, 0.01, 7.5), (f64::NEG_INFINITY, 7.5));
        for (noise, step) in [(0.02, 0.01), (0.004, 0.01), (0.001, 0.01), (0.0, 0.01), (0.0, 1e-9)] {
            assert_eq!(of(noise, step, 100.0), none, "{noise} {step}");
        }
        assert_eq!(of(0.0, 1e-9, 7.5), none);
    }

    #[test]
    fn rest_and_two_levels_are_not_clipping() {
        // At rest until it moves, and again afterwards.
        let lift: Vec<f64> = (0..600).map(|k| (f64::from(k - 200) / 100.0).clamp(0.0, 1.0)).collect();
        assert_eq!(clipping(&lift, None), None);
        let trigger: Vec<f64> = (0..600).map(|k| if (100..300).contains(&k) { 5.0 } else { 0.0 }).collect();
        assert_eq!((clipping(&trigger, None), clipping(&[1.0; 50], None), clipping(&[], None)), (None, None, None));
        // Coarse numbers stand still anywhere.
        let coarse: Vec<f64> = (0..2000).map(|k| (4.0 * (f64::from(k) / 150.0).sin()).round()).collect();
        assert_eq!(clipping(&coarse, None), None);
    }

    /// The temperature of a room, read in tenths of a degree: now and then noise stays within the highest step.
    #[test]
    fn noise_within_a_step_is_not_clipping() {
        let mut draws = SplitMix(6);
        let times: Vec<f64> = (0..720).map(|k| 5.0 * f64::from(k)).collect();
        let of = |draws: &mut SplitMix| -> Option<Clipping> {
            let value = |t: &f64| 294.65 + 0.6 * (t / 400.0).sin() + 0.08 * draws.normal();
            let values: Vec<f64> = times.iter().map(value).map(|own| (own / 0.1).round() * 0.1).collect();
            clipping(&values, scatter(&times, &values).as_ref())
        };
        for _ in 0..100 {
            assert_eq!(of(&mut draws), None);
        }
        // A part that stays at the end of its range much longer is.
        let swing = |k: u32| (12.0 * (f64::from(k) / 100.0).sin()).min(10.0);
        let clipped: Vec<f64> = (0..2000).map(|k| ((swing(k) / 0.1).round() * 0.1).min(10.0)).collect();
        let noise = Scatter { sigma: 0.05, step: Some(0.1), samples: 2000, is_settled: true };
        assert!(clipping(&clipped, Some(&noise)).is_some_and(|own| own.bottom.is_none() && own.top.is_some()));
    }
}

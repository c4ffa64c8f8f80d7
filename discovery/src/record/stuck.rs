//! Dropouts: samples in a row that stand at exactly one value far from those before and after, where noise is seen elsewhere.
//!
//! A recorder that loses its signal writes zeros or repeats a number.  A signal that is clipped or stopped comes to its limit by steps like
//! those before, one that rests comes to its rest and leaves it without a jump.  So many equal samples must be no chance under the noise
//! that is seen elsewhere.

use super::clipping::is_chance;
use super::scatter::{SEEN, Scatter};

/// Fewest equal samples in a row.
const FEWEST: usize = 3;
/// How far they stand from the samples on either side, in standard deviations of the noise.
const FAR: f64 = 10.0;
/// How much larger the jumps to them and from them are than the steps beside these.
const STEEPER: f64 = 3.0;

/// Equal samples in a row.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Stuck {
    /// Position of the first one.
    pub index: usize,
    /// Their number.
    pub samples: usize,
    /// The time of the first one (s).
    pub time: f64,
    /// Their value.
    pub value: f64,
}

/// The dropouts of a record with this noise and range, in their order.
pub(crate) fn stuck(times: &[f64], values: &[f64], scatter: Option<&Scatter>, (low, high): (f64, f64)) -> Vec<Stuck> {
    let is_seen = |own: &&Scatter| own.is_settled && own.sigma > SEEN * (high - low);
    let Some(noise) = scatter.filter(is_seen) else { return Vec::new() };
    let count = times.len().min(values.len());
    let jumps = |value: f64, beside: usize, beyond: usize| {
        let jump = (values[beside] - value).abs();
        jump > FAR * noise.sigma && jump > STEEPER * (values[beside] - values[beyond]).abs()
    };
    let mut found = Vec::new();
    let mut k = 0;
    while k < count {
        let value = values[k];
        // A value that is not finite equals nothing.
        let samples = values[k..count].iter().take_while(|own| **own == value).count().max(1);
        let end = k + samples;
        if samples >= FEWEST
            && k > 1
            && end + 1 < count
            && jumps(value, k - 1, k - 2)
            && jumps(value, end, end + 1)
            && !is_chance(samples, noise, count)
        {
            found.push(Stuck { index: k, samples, time: times[k], value });
        }
        k = end;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::examine;
    use hyd_system::random::SplitMix;

    fn found(values: &[f64]) -> Vec<(usize, usize, f64)> {
        let times: Vec<f64> = (0..values.len()).map(|k| k as f64 * 1e-3).collect();
        let all = examine(&times, values, 0.0).expect("values");
        all.stuck.iter().map(|own| (own.index, own.samples, own.value)).collect()
    }

    #[test]
    fn zeros_and_repeated_numbers_are_found_and_rest_is_not() {
        let mut draws = SplitMix(21);
        let signal = |k: usize| 3.0 * (k as f64 / 80.0).sin();
        let mut noisy: Vec<f64> = (0..2000).map(|k| signal(k) + 0.01 * draws.normal()).collect();
        assert_eq!(found(&noisy), []);
        noisy[300..312].fill(0.0);
        noisy[1100..1104].fill(0.7);
        assert_eq!(found(&noisy), [(300, 12, 0.0), (1100, 4, 0.7)]);
        // What is clipped comes to its limit by steps like those before.
        let clipped: Vec<f64> = (0..2000).map(|k| (signal(k) + 0.01 * draws.normal()).min(2.0)).collect();
        assert_eq!(found(&clipped), []);
        // A plunger that rests at zero to the last digit, moves and rests again.
        let moves = |k: usize| 4.0 * (((k as f64 - 500.0) / 500.0).clamp(0.0, 1.0));
        let rests: Vec<f64> =
            (0..2000).map(|k| moves(k) + if (500..1000).contains(&k) { 0.01 * draws.normal() } else { 0.0 }).collect();
        assert_eq!(found(&rests), []);
        // Coarse numbers stand still by chance.
        let coarse: Vec<f64> = (0..2000).map(|k| ((signal(k) + 0.01 * draws.normal()) / 0.05).round() * 0.05).collect();
        assert_eq!(found(&coarse), []);
        // Without noise nothing tells a stop from a dropout.
        let exact: Vec<f64> = (0..2000).map(|k| if (300..400).contains(&k) { 0.0 } else { signal(k) }).collect();
        assert_eq!(found(&exact), []);
    }
}

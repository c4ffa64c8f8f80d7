//! Spikes: up to three samples that stand far off while those before and after agree with each other.
//!
//! A peak of the signal has flanks: its neighbours turn back.  A spike has none, so a run of samples is one only if it stands off the
//! straight line over it by many standard deviations of the noise, and the two samples on either side go on like that line.  (Compare the
//! median filter of Tukey, "Exploratory data analysis", 1977, of which this is the strict form on a slope.)

use super::scatter::unevenness;

/// Longest run (samples).
const LONGEST: usize = 3;
/// How far a spike stands off, in standard deviations of the noise.
const FAR: f64 = 10.0;
/// How much the steps between the samples around it may differ, as a part of its height.
const STILL: f64 = 0.25;
/// Most spikes that are listed; a record with more is not one with isolated samples.
const MOST: usize = 1000;

/// One spike.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Spike {
    /// Position of its first sample.
    pub index: usize,
    /// Number of its samples.
    pub samples: usize,
    /// Its time (s).
    pub time: f64,
    /// How far it stands off its surroundings, with its sign (unit of the values).
    pub height: f64,
}

/// The spikes of a record in their order.
pub(crate) fn spikes(times: &[f64], values: &[f64]) -> Vec<Spike> {
    let (times, values) = (&times[..times.len().min(values.len())], &values[..values.len().min(times.len())]);
    let Some(noise) = unevenness(times, values) else { return Vec::new() };
    let least = FAR * noise.sigma.max(noise.step.unwrap_or(0.0) / 12.0_f64.sqrt());
    let mut found = Vec::new();
    let mut k = 2;
    while k + 2 < values.len() && found.len() < MOST {
        let spike = (1..=LONGEST).find_map(|samples| spike(values, k, samples, least));
        k += spike.map_or(1, |(samples, _)| samples);
        if let Some((samples, height)) = spike {
            found.push(Spike { index: k - samples, samples, time: times[k - samples], height });
        }
    }
    found
}

/// Number of samples and height of the spike that begins at `k`.
fn spike(values: &[f64], k: usize, samples: usize, least: f64) -> Option<(usize, f64)> {
    let [first, before, after, last] =
        [values[k - 2], values[k - 1], *values.get(k + samples)?, *values.get(k + samples + 1)?];
    // The step from sample to sample before it, over it and after it.
    let over = (after - before) / (samples + 1) as f64;
    let steps = [before - first, over, last - after];
    let (low, high) = steps.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    let heights = (0..samples).map(|own| values[k + own] - before - (own + 1) as f64 * over);
    // The sample that stands off least, all on one side; what is not finite fails every comparison.
    let smallest = heights.clone().reduce(|a, b| if b.abs() < a.abs() { b } else { a })?;
    let largest = heights.clone().reduce(|a, b| if b.abs() > a.abs() { b } else { a })?;
    let one_side = heights.clone().all(|height| height.signum() == smallest.signum());
    let is_spike = one_side && smallest.abs() > least && smallest != 0.0 && high - low < STILL * smallest.abs();
    is_spike.then_some((samples, largest))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    #[test]
    fn single_samples_are_spikes_and_peaks_are_not() {
        let mut draws = SplitMix(9);
        let times: Vec<f64> = (0..5000).map(|k| f64::from(k) * 1e-4).collect();
        // A step, a damped oscillation of 25 samples a period and a narrow bell.
        let signal = |t: f64| {
            (if t > 0.1 { 5.0 + 4.0 * (-(t - 0.1) / 0.01).exp() * (2500.0 * t).cos() } else { 0.0 })
                + 6.0 * (-((t - 0.3) / 4e-4_f64).powi(2)).exp()
        };
        let mut values: Vec<f64> = times.iter().map(|&t| signal(t) + 0.05 * draws.normal()).collect();
        assert_eq!(spikes(&times, &values), []);
        for (k, height) in [(700, 3.0), (2500, -1.5), (2501, -2.0), (4000, 8.0)] {
            values[k] += height;
        }
        let found = spikes(&times, &values);
        let places: Vec<(usize, usize)> = found.iter().map(|spike| (spike.index, spike.samples)).collect();
        assert_eq!(places, [(700, 1), (2500, 2), (4000, 1)]);
        for (spike, height) in found.iter().zip([3.0, -2.0, 8.0]) {
            assert!((spike.height - height).abs() < 0.3, "{spike:?}");
        }
        assert_eq!(found[0].time, times[700]);
    }

    /// What moves by a half of its height from sample to sample shows a spike all the same.
    #[test]
    fn spikes_on_a_slope_are_found() {
        let mut draws = SplitMix(10);
        let times: Vec<f64> = (0..1000).map(|k| f64::from(k) * 2e-3).collect();
        // Two tones of 90 and 20 samples a period.
        let signal = |k: usize| 0.1 * (k as f64 * 0.07).sin() + 0.008 * (k as f64 * 0.3).sin();
        let mut values: Vec<f64> = (0..1000).map(|k| signal(k) + 2e-4 * draws.normal()).collect();
        assert_eq!(spikes(&times, &values), []);
        let places: Vec<usize> = (0..18).map(|k| 20 + 53 * k).collect();
        for (number, &k) in places.iter().enumerate() {
            values[k] += if number % 2 == 0 { 0.02 } else { -0.02 };
        }
        let found: Vec<usize> = spikes(&times, &values).iter().map(|spike| spike.index).collect();
        assert_eq!(found, places);
    }

    #[test]
    fn gaps_and_constants_have_none() {
        let times: Vec<f64> = (0..200).map(f64::from).collect();
        let mut values = vec![1.0; 200];
        assert_eq!(spikes(&times, &values), []);
        values[50] = f64::NAN;
        values[100] = 2.0;
        assert_eq!(spikes(&times, &values).len(), 1);
    }
}

//! How much a channel scatters: standard deviation and correlation from what the lab states and from the record before the trigger.
//!
//! The stated noise and the rounding, `sigma^2 = noise^2 + step^2/12`, are used as they are where the set has them, since they
//! set the scale on which "nothing is missing" is judged; the quiet record is reported beside them.  Correlation from sample to
//! sample is that of an AR(1) process (Box, Jenkins, "Time Series Analysis", section 3.2).  That there is one must show before the
//! trigger, in one channel or in all that are read by one recorder (Cochran 1954: homogeneity of estimates); how large it is, is
//! then taken from third differences of the whole record, because a quiet record alone is short: differences leave out what is
//! smooth, and their quartiles what is fast and rare.

use hyd_system::math;

use crate::{Bench, Fault, Study};

/// Fewest quiet samples from which a scatter is estimated.
const FEWEST: usize = 20;
/// A correlation below this many standard errors is taken for none.
const SIGNIFICANT: f64 = 3.0;

/// Noise goes no farther than so many median deviations, which are three standard deviations.
const FAR: f64 = 4.45;
/// Fewest differences from which a correlation is taken.
const ENOUGH: usize = 400;
/// Largest correlation that is believed.
const LARGEST: f64 = 0.95;
/// Distance of the quartiles of a normal distribution in standard deviations.
const QUARTILES: f64 = 1.348_98;
/// Standard deviations of chi-squared within which estimates count as estimates of one number.
const ALIKE: f64 = 2.0;

/// The scatter of one channel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Noise {
    /// Standard deviation (units of the table).
    pub sigma: f64,
    /// Correlation of neighbouring samples.
    pub rho: f64,
    /// Standard deviation in the quiet record, if there is one.
    pub quiet: Option<f64>,
    /// Number of quiet samples.
    pub samples: usize,
    /// Number of pairs of neighbours among them.
    pub(crate) pairs: f64,
    /// Correlation by the differences of the whole record, if there are enough.
    pub(crate) whole: Option<f64>,
}

impl Noise {
    /// The scatter of each of these channels.
    ///
    /// # Errors
    /// When nothing says how large one is.
    pub fn of_all(bench: &Bench, study: &Study, channels: &[&str]) -> Result<Vec<Self>, Fault> {
        let own = channels.iter().map(|channel| Self::of(bench, study, channel));
        let mut all = own.collect::<Result<Vec<Self>, Fault>>()?;
        settle_correlations(&mut all);
        Ok(all)
    }

    /// The scatter of `channel`, its correlation as estimated from its own quiet record.
    ///
    /// # Errors
    /// When nothing says how large it is.
    fn of(bench: &Bench, study: &Study, channel: &str) -> Result<Self, Fault> {
        let stated = study.channels.get(channel);
        let noise = bench.noise.get(channel).copied().or(stated.and_then(|stated| stated.noise));
        let step = bench.quantisation.get(channel).copied().or(stated.and_then(|stated| stated.quantisation));
        let (quiet, rho, samples, pairs) = quiet(bench, channel);
        let known = noise.map(|noise| (noise * noise + math::square(step.unwrap_or(0.0)) / 12.0).sqrt());
        let sigma = known.or(quiet).filter(|sigma| *sigma > 0.0 && sigma.is_finite()).ok_or_else(|| {
            Fault::new(format!(
                "nothing says how much `{channel}` scatters: the set states no noise and the record before the trigger is too short or constant"
            ))
        })?;
        let whole = whole_record(bench, channel, sigma);
        Ok(Self { sigma, rho, quiet, samples, pairs, whole })
    }
}

/// Correlation where the quiet records show one, of all channels together where theirs differ no more than by chance.
fn settle_correlations(noises: &mut [Noise]) {
    let pairs: f64 = noises.iter().map(|noise| noise.pairs).sum();
    let mean = noises.iter().map(|noise| noise.pairs * noise.rho).sum::<f64>() / pairs.max(1.0);
    // The variance of an estimate from n pairs is (1 - rho^2)/n.
    let apart =
        noises.iter().map(|noise| noise.pairs * math::square(noise.rho - mean) / (1.0 - mean * mean)).sum::<f64>();
    let freedom = noises.iter().filter(|noise| noise.pairs > 0.0).count().saturating_sub(1) as f64;
    let alike = freedom > 0.0 && apart < freedom + ALIKE * (2.0 * freedom).sqrt();
    for noise in noises {
        let (rho, pairs) = if alike { (mean, pairs) } else { (noise.rho, noise.pairs) };
        let is_correlated = noise.pairs > 0.0 && rho * pairs.sqrt() > SIGNIFICANT;
        noise.rho = if is_correlated { noise.whole.unwrap_or(rho).clamp(0.0, LARGEST) } else { 0.0 };
    }
}

/// The correlation with which noise of this standard deviation has third differences like those of the record.
fn whole_record(bench: &Bench, channel: &str, sigma: f64) -> Option<f64> {
    let mut thirds: Vec<f64> = Vec::new();
    for values in bench.shots.iter().filter_map(|shot| shot.values.get(channel)) {
        let own: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        // A channel that is read by a slower clock than others has neighbours of its own.
        let values = if 2 * own.len() < values.len() { &own } else { values };
        thirds
            .extend(values.windows(4).map(|v| v[3] - 3.0 * v[2] + 3.0 * v[1] - v[0]).filter(|third| third.is_finite()));
    }
    if thirds.len() < ENOUGH {
        return None;
    }
    thirds.sort_unstable_by(f64::total_cmp);
    let quarter = thirds.len() / 4;
    let scale = (thirds[3 * quarter] - thirds[quarter]) / QUARTILES / sigma;
    // For AR(1) noise of variance 1 the third differences have the variance 20 - 30 rho + 12 rho^2 - 2 rho^3, which falls with rho.
    let variance = |rho: f64| 20.0 - rho * (30.0 - rho * (12.0 - 2.0 * rho));
    let (mut low, mut high) = (-0.5, LARGEST);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if variance(middle) > scale * scale { low = middle } else { high = middle }
    }
    Some(low)
}

/// Standard deviation, correlation, number of the samples before the trigger and of pairs of neighbours among them; means are taken
/// out shot by shot.
fn quiet(bench: &Bench, channel: &str) -> (Option<f64>, f64, usize, f64) {
    let (mut square, mut tamed_square, mut lagged, mut pairs) = (0.0, 0.0, 0.0, 0.0);
    let (mut count, mut shots) = (0usize, 0usize);
    for shot in &bench.shots {
        let Some(values) = shot.values.get(channel) else { continue };
        let quiet: Vec<f64> =
            shot.times.iter().zip(values).filter(|(t, v)| **t < 0.0 && v.is_finite()).map(|(_, v)| *v).collect();
        if quiet.len() < 4 {
            continue;
        }
        let mean = quiet.iter().sum::<f64>() / quiet.len() as f64;
        square += quiet.iter().map(|v| math::square(v - mean)).sum::<f64>();
        let tame = tamed(&quiet);
        tamed_square += tame.iter().map(|v| v * v).sum::<f64>();
        lagged += tame.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>();
        pairs += (quiet.len() - 1) as f64;
        count += quiet.len();
        shots += 1;
    }
    if count < FEWEST || square <= 0.0 {
        return (None, 0.0, count, 0.0);
    }
    let variance = square / (count - shots) as f64;
    // Means taken out of short records bias the correlation down by about (1 + rho)/(1 - rho) times the reciprocal of their length.
    let raw = if tamed_square > 0.0 { lagged / pairs / (tamed_square / (count - shots) as f64) } else { 0.0 };
    let bias = shots as f64 / count as f64;
    let rho = (raw + bias * (1.0 + raw) / (1.0 - raw).max(0.1)).clamp(-LARGEST, LARGEST);
    (Some(variance.sqrt()), rho, count, pairs)
}

/// Values without their mean, none farther from the median than noise goes: single bad samples hide a correlation.
fn tamed(values: &[f64]) -> Vec<f64> {
    let median = |mut values: Vec<f64>| {
        values.sort_unstable_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let middle = median(values.to_vec());
    let far = FAR * median(values.iter().map(|v| (v - middle).abs()).collect());
    let tame: Vec<f64> =
        values.iter().map(|v| if far > 0.0 { v.clamp(middle - far, middle + far) } else { *v }).collect();
    let mean = tame.iter().sum::<f64>() / tame.len() as f64;
    tame.iter().map(|v| v - mean).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Noise, settle_correlations, whole_record};
    use crate::bench::{Bench, Shot};
    use hyd_system::random::SplitMix;

    fn noises(estimates: &[f64]) -> Vec<Noise> {
        let one = |&rho: &f64| Noise { sigma: 1.0, rho, quiet: Some(1.0), samples: 164, pairs: 160.0, whole: None };
        estimates.iter().map(one).collect()
    }

    #[test]
    fn estimates_that_differ_by_chance_are_one_number() {
        let mut alike = noises(&[0.35, 0.42, 0.30, 0.44, 0.39]);
        settle_correlations(&mut alike);
        assert!(alike.iter().all(|noise| (noise.rho - 0.38).abs() < 1e-12));
        let mut apart = noises(&[0.0, 0.05, 0.6, -0.1, 0.02]);
        settle_correlations(&mut apart);
        assert_eq!(apart.iter().map(|noise| noise.rho).collect::<Vec<_>>(), [0.0, 0.0, 0.6, 0.0, 0.0]);
        let mut none = noises(&[0.05, -0.06, 0.02, 0.08]);
        settle_correlations(&mut none);
        assert!(none.iter().all(|noise| noise.rho == 0.0));
    }

    /// Correlated noise before the trigger, with and without single samples that are far off.
    #[test]
    fn bad_samples_hide_no_correlation() {
        for spikes in [false, true] {
            let mut draws = SplitMix(12);
            let mut shots = Vec::new();
            for _ in 0..20 {
                let mut noise = draws.normal();
                let values = (0..60).map(|k| {
                    noise = 0.4 * noise + (1.0 - 0.16_f64).sqrt() * draws.normal();
                    noise + if spikes && k % 29 == 7 { 15.0 } else { 0.0 }
                });
                let values = BTreeMap::from([("c".to_string(), values.collect())]);
                shots.push(Shot { times: (0..60).map(|k| f64::from(k) - 60.0).collect(), values, ..Shot::default() });
            }
            let (_, rho, _, _) = super::quiet(&Bench { shots, ..Bench::default() }, "c");
            assert!((rho - 0.4).abs() < 0.1, "{rho}");
        }
    }

    /// A signal with a step and an oscillation under noise of known correlation.
    #[test]
    fn differences_of_the_whole_record_show_the_correlation() {
        for rho in [0.0, 0.3, 0.6_f64] {
            let mut draws = SplitMix(77);
            let mut noise = draws.normal();
            let times: Vec<f64> = (0..8000).map(|k| f64::from(k) * 5e-5).collect();
            let record = times.iter().map(|&t| {
                noise = rho * noise + (1.0 - rho * rho).sqrt() * draws.normal();
                let signal = if t > 0.1 { 500.0 } else { 0.0 } + 40.0 * (300.0 * t).sin();
                signal + 2.0 * noise
            });
            let values = BTreeMap::from([("c".to_string(), record.collect())]);
            let shot = Shot { times: times.clone(), values, ..Shot::default() };
            let bench = Bench { shots: vec![shot], ..Bench::default() };
            let found = whole_record(&bench, "c", 2.0).expect("enough");
            assert!((found - rho).abs() < 0.03, "{found} instead of {rho}");
        }
    }
}

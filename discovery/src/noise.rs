//! How much a channel scatters: standard deviation and correlation from what the lab states and from the record before the trigger.
//!
//! The stated noise and the rounding, `sigma^2 = noise^2 + step^2/12`, are used as they are where the set has them, since they
//! set the scale on which "nothing is missing" is judged; the quiet record is reported beside them.  Correlation from sample to
//! sample is that of an AR(1) process (Box, Jenkins, "Time Series Analysis", section 3.2), used only where it is significant.
//! Channels read by one recorder are often correlated alike; where nothing speaks against it, what they say together is used
//! for each, because a quiet record alone is short (Cochran 1954: homogeneity of estimates).

use crate::{Bench, Fault, Study};

/// Fewest quiet samples from which a scatter is estimated.
const FEWEST: usize = 20;
/// A correlation below this many standard errors is taken for none.
const SIGNIFICANT: f64 = 3.0;

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
        let known = noise.map(|noise| (noise * noise + step.unwrap_or(0.0).powi(2) / 12.0).sqrt());
        let sigma = known.or(quiet).filter(|sigma| *sigma > 0.0 && sigma.is_finite()).ok_or_else(|| {
            Fault::new(format!(
                "nothing says how much `{channel}` scatters: the set states no noise and the record before the trigger is too short or constant"
            ))
        })?;
        Ok(Self { sigma, rho, quiet, samples, pairs })
    }
}

/// Takes one correlation for all channels where theirs differ no more than by chance, and none where it is not significant.
fn settle_correlations(noises: &mut [Noise]) {
    let pairs: f64 = noises.iter().map(|noise| noise.pairs).sum();
    let mean = noises.iter().map(|noise| noise.pairs * noise.rho).sum::<f64>() / pairs.max(1.0);
    // The variance of an estimate from n pairs is (1 - rho^2)/n.
    let apart = noises.iter().map(|noise| noise.pairs * (noise.rho - mean).powi(2) / (1.0 - mean * mean)).sum::<f64>();
    let freedom = noises.iter().filter(|noise| noise.pairs > 0.0).count().saturating_sub(1) as f64;
    let alike = freedom > 0.0 && apart < freedom + ALIKE * (2.0 * freedom).sqrt();
    for noise in noises {
        let (rho, pairs) = if alike { (mean, pairs) } else { (noise.rho, noise.pairs) };
        noise.rho = if noise.pairs > 0.0 && rho * pairs.sqrt() > SIGNIFICANT { rho } else { 0.0 };
    }
}

/// Standard deviation, correlation, number of the samples before the trigger and of pairs of neighbours among them; means are taken
/// out shot by shot.
fn quiet(bench: &Bench, channel: &str) -> (Option<f64>, f64, usize, f64) {
    let (mut square, mut lagged, mut pairs, mut count, mut shots) = (0.0, 0.0, 0.0, 0usize, 0usize);
    for shot in &bench.shots {
        let Some(values) = shot.values.get(channel) else { continue };
        let quiet: Vec<f64> =
            shot.times.iter().zip(values).filter(|(t, v)| **t < 0.0 && v.is_finite()).map(|(_, v)| *v).collect();
        if quiet.len() < 4 {
            continue;
        }
        let mean = quiet.iter().sum::<f64>() / quiet.len() as f64;
        square += quiet.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        lagged += quiet.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum::<f64>();
        pairs += (quiet.len() - 1) as f64;
        count += quiet.len();
        shots += 1;
    }
    if count < FEWEST || square <= 0.0 {
        return (None, 0.0, count, 0.0);
    }
    let variance = square / (count - shots) as f64;
    // Means taken out of short records bias the correlation down by about (1 + rho)/(1 - rho) times the reciprocal of their length.
    let raw = lagged / pairs / variance;
    let bias = shots as f64 / count as f64;
    let rho = (raw + bias * (1.0 + raw) / (1.0 - raw).max(0.1)).clamp(-0.95, 0.95);
    (Some(variance.sqrt()), rho, count, pairs)
}

#[cfg(test)]
mod tests {
    use super::{Noise, settle_correlations};

    fn noises(estimates: &[f64]) -> Vec<Noise> {
        let one = |&rho: &f64| Noise { sigma: 1.0, rho, quiet: Some(1.0), samples: 164, pairs: 160.0 };
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
}

//! How much a channel scatters: standard deviation and correlation from what the lab states and from the record before the trigger.
//!
//! The stated noise and the rounding, `sigma^2 = noise^2 + step^2/12`, are used as they are where the set has them, since they
//! set the scale on which "nothing is missing" is judged; the quiet record is reported beside them.  Correlation from sample to
//! sample is that of an AR(1) process (Box, Jenkins, "Time Series Analysis", section 3.2), used only where it is significant.

use crate::{Bench, Fault, Study};

/// Fewest quiet samples from which a scatter is estimated.
const FEWEST: usize = 20;
/// A correlation below this many standard errors is taken for none.
const SIGNIFICANT: f64 = 3.0;

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
}

impl Noise {
    /// The scatter of `channel`.
    ///
    /// # Errors
    /// When nothing says how large it is.
    pub fn of(bench: &Bench, study: &Study, channel: &str) -> Result<Self, Fault> {
        let stated = study.channels.get(channel);
        let noise = bench.noise.get(channel).copied().or(stated.and_then(|stated| stated.noise));
        let step = bench.quantisation.get(channel).copied().or(stated.and_then(|stated| stated.quantisation));
        let (quiet, rho, samples) = quiet(bench, channel);
        let known = noise.map(|noise| (noise * noise + step.unwrap_or(0.0).powi(2) / 12.0).sqrt());
        let sigma = known.or(quiet).filter(|sigma| *sigma > 0.0 && sigma.is_finite()).ok_or_else(|| {
            Fault::new(format!(
                "nothing says how much `{channel}` scatters: the set states no noise and the record before the trigger is too short or constant"
            ))
        })?;
        Ok(Self { sigma, rho, quiet, samples })
    }
}

/// Standard deviation, correlation and number of the samples before the trigger; their means are taken out shot by shot.
fn quiet(bench: &Bench, channel: &str) -> (Option<f64>, f64, usize) {
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
        return (None, 0.0, count);
    }
    let variance = square / (count - shots) as f64;
    // Means taken out of short records bias the correlation down by about the reciprocal of their length.
    let rho = lagged / pairs / variance + shots as f64 / count as f64;
    let rho = if rho * pairs.sqrt() > SIGNIFICANT { rho.min(0.95) } else { 0.0 };
    (Some(variance.sqrt()), rho, count)
}

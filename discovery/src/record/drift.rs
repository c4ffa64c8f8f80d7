//! Drift: the straight line through a part of a record, or through levels from shot to shot, and whether it stands out of the noise.
//!
//! Least squares; the standard error of the slope is widened by the correlation of neighbouring residuals, as n correlated samples tell
//! as much as n (1 - rho)/(1 + rho) independent ones (Bartlett 1935).

/// Fewest points through which a line is laid.
const FEWEST: usize = 4;
/// A slope of so many standard errors stands out.
const SIGNIFICANT: f64 = 4.0;
/// Largest correlation that is believed.
const LARGEST: f64 = 0.98;

/// A straight line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Drift {
    /// Mean of the values.
    pub mean: f64,
    /// Slope (units of the values per s, or per unit of what stands in the place of times).
    pub slope: f64,
    /// Standard error of the slope.
    pub error: f64,
    /// What the line changes from the first to the last point.
    pub change: f64,
    /// Standard deviation about the line.
    pub sigma: f64,
    /// Number of points.
    pub samples: usize,
}

impl Drift {
    /// Is the slope more than noise?
    pub(crate) fn stands_out(&self) -> bool {
        self.slope.abs() > SIGNIFICANT * self.error
    }
}

/// The line through points; none for fewer than four, or where all times are equal.
pub(crate) fn drift(times: &[f64], values: &[f64]) -> Option<Drift> {
    let points: Vec<(f64, f64)> =
        times.iter().copied().zip(values.iter().copied()).filter(|(t, v)| t.is_finite() && v.is_finite()).collect();
    let samples = points.len();
    if samples < FEWEST {
        return None;
    }
    let count = samples as f64;
    let (sum_t, sum_v) = points.iter().fold((0.0, 0.0), |(a, b), (t, v)| (a + t, b + v));
    let (middle, mean) = (sum_t / count, sum_v / count);
    let (tt, tv) = points
        .iter()
        .fold((0.0, 0.0), |(a, b), (t, v)| (a + (t - middle) * (t - middle), b + (t - middle) * (v - mean)));
    if tt.is_nan() || tt <= 0.0 {
        return None;
    }
    let slope = tv / tt;
    let residuals: Vec<f64> = points.iter().map(|(t, v)| v - mean - slope * (t - middle)).collect();
    let square: f64 = residuals.iter().map(|r| r * r).sum();
    let lagged: f64 = residuals.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let variance = square / (count - 2.0);
    let rho = if square > 0.0 { (lagged / square).clamp(0.0, LARGEST) } else { 0.0 };
    let error = (variance / tt * (1.0 + rho) / (1.0 - rho)).sqrt();
    let change = slope * (points[samples - 1].0 - points[0].0);
    Some(Drift { mean, slope, error, change, sigma: variance.sqrt(), samples })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    #[test]
    fn slopes_are_found_with_their_error() {
        let times: Vec<f64> = (0..500).map(|k| f64::from(k) * 0.01).collect();
        let (mut outside, mut chance) = (0, 0);
        for seed in 0..200 {
            let mut draws = SplitMix(seed);
            let values: Vec<f64> = times.iter().map(|&t| 2.0 + 0.3 * t + 0.1 * draws.normal()).collect();
            let found = drift(&times, &values).unwrap();
            assert!(found.stands_out() && (found.change / (0.3 * 4.99) - 1.0).abs() < 0.1, "{found:?}");
            outside += usize::from((found.slope - 0.3).abs() > 2.0 * found.error);
            let none: Vec<f64> = times.iter().map(|_| 0.1 * draws.normal()).collect();
            chance += usize::from(drift(&times, &none).unwrap().stands_out());
        }
        // Of 200 lines one in 22 is more than two standard errors off.
        assert!((2..=20).contains(&outside), "{outside} of 200");
        assert_eq!(chance, 0);
        assert_eq!((drift(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]), drift(&[1.0; 9], &[1.0; 9])), (None, None));
    }

    #[test]
    fn correlated_noise_is_not_a_drift() {
        let times: Vec<f64> = (0..1000).map(f64::from).collect();
        let found = (0..100).filter(|&seed| {
            let (mut draws, mut noise) = (SplitMix(seed), 0.0);
            let values: Vec<f64> = times
                .iter()
                .map(|_| {
                    noise = 0.9 * noise + draws.normal();
                    noise
                })
                .collect();
            drift(&times, &values).unwrap().stands_out()
        });
        assert_eq!(found.count(), 0);
    }
}

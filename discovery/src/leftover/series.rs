//! Size, correlation and bursts of residuals.
//!
//! How long residuals stay alike is their integrated autocorrelation, `L = 1 + 2 sum rho_k`, summed up to the first lag that is five
//! times the largest sum so far (automatic windowing: Sokal 1997, "Monte Carlo methods in statistical mechanics", section 3).  Where
//! that takes many lags the sum goes on with means of two neighbours: of these the variance is `v_2` in place of `v`, and
//! `L = 2 v_2/v L_2`.  Correlations are taken about zero: an offset is an error as well.

use crate::disturbance::Level;

/// Residuals of one record; samples without weight do not count.
pub(super) struct Series<'a> {
    pub values: &'a [f64],
    pub weights: &'a [f64],
}

/// Lags after which neighbours are averaged, lags by the sum so far, and most times that bursts may make samples fewer.
const LAGS: usize = 64;
const WINDOW: f64 = 5.0;
const MOST: f64 = 20.0;

/// The level of residuals of this size (root of the mean square, in standard deviations of the noise).
pub(super) fn level(series: &[Series<'_>], size: f64) -> Level {
    Level::new(size, length(series), bursts(series))
}

/// Samples over which residuals stay alike, at least 1.
fn length(series: &[Series<'_>]) -> f64 {
    let mut used: Vec<Vec<f64>> = series.iter().map(used).collect();
    let mut factor = 1.0;
    loop {
        let square = |series: &[Vec<f64>]| series.iter().flatten().map(|value| value * value).sum::<f64>();
        let all = square(&used);
        if all <= 0.0 {
            return 1.0;
        }
        let (mut sum, mut largest) = (1.0, 1.0_f64);
        let lags = used.iter().map(Vec::len).max().unwrap_or(0).saturating_sub(1);
        for lag in 1..=lags.min(LAGS) {
            let products = |own: &Vec<f64>| own.iter().zip(own.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
            sum += 2.0 * used.iter().map(products).sum::<f64>() / all;
            largest = largest.max(sum);
            if lag as f64 >= WINDOW * largest {
                return (factor * largest).max(1.0);
            }
        }
        if lags <= LAGS {
            return (factor * largest).max(1.0);
        }
        let count: usize = used.iter().map(Vec::len).sum();
        used = used.iter().map(|own| own.chunks_exact(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect()).collect();
        let fewer: usize = used.iter().map(Vec::len).sum();
        factor *= 2.0 * (square(&used) / fewer as f64) / (all / count as f64);
    }
}

/// Kurtosis over that of a normal distribution, at least 1.
fn bursts(series: &[Series<'_>]) -> f64 {
    let (mut count, mut second, mut fourth) = (0.0, 0.0, 0.0);
    for value in series.iter().flat_map(used) {
        let square = value * value;
        (count, second, fourth) = (count + 1.0, second + square, fourth + square * square);
    }
    if second > 0.0 { (fourth * count / (3.0 * second * second)).clamp(1.0, MOST) } else { 1.0 }
}

fn used(series: &Series<'_>) -> Vec<f64> {
    let samples = series.values.iter().zip(series.weights);
    samples.filter(|(_, weight)| **weight > 0.0).map(|(value, _)| *value).collect()
}

#[cfg(test)]
mod tests {
    use super::{Series, bursts, length};
    use hyd_system::random::SplitMix;

    fn of(values: &[f64], test: impl Fn(&[Series<'_>]) -> f64) -> f64 {
        test(&[Series { values, weights: &vec![1.0; values.len()] }])
    }

    /// The integrated correlation of an AR(1) process is (1 + rho)/(1 - rho).
    #[test]
    fn lengths_of_known_processes() {
        for (rho, expected) in [(0.0_f64, 1.0), (0.6, 4.0), (0.9, 19.0), (0.98, 99.0)] {
            let mut draws = SplitMix(5);
            let mut last = 0.0;
            let values: Vec<f64> = (0..400_000)
                .map(|_| {
                    last = rho * last + (1.0 - rho * rho).sqrt() * draws.normal();
                    last
                })
                .collect();
            let found = of(&values, length);
            assert!((0.85..1.2).contains(&(found / expected)), "{found} instead of {expected}");
        }
    }

    /// An offset stays alike for ever, white noise of a short record does not.
    #[test]
    fn short_records() {
        assert!(of(&vec![1.0; 400], length) > 300.0);
        let mut longest: f64 = 0.0;
        for seed in 1..200 {
            let mut draws = SplitMix(seed);
            let values: Vec<f64> = (0..400).map(|_| draws.normal()).collect();
            longest = longest.max(of(&values, length));
        }
        assert!(longest < 2.5, "{longest}");
    }

    #[test]
    fn bursts_carry_few_samples() {
        let mut draws = SplitMix(3);
        let even: Vec<f64> = (0..4000).map(|_| draws.normal()).collect();
        assert!(of(&even, bursts) < 1.15);
        // A tenth of the samples carries all: ten times fewer.
        let burst: Vec<f64> =
            even.iter().enumerate().map(|(k, value)| if k < 400 { 10.0 * value } else { 0.0 }).collect();
        let found = of(&burst, bursts);
        assert!((8.0..12.0).contains(&found), "{found}");
    }
}

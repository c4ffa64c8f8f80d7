//! Does what differs from shot to shot follow the conditions under which the shots were made?
//!
//! Parts scatter and mains hum whatever a shot is set to.  What grows with the supply, or depends on whether a part was built in, is an error
//! of the model.  The test is the correlation with each condition (Fisher's transformation; Fisher, Metron 1 (1921) 3).

use hyd_system::math::{ln, square};

use crate::Setup;
use crate::study::formula::evaluate;

/// Fisher's variable in its standard deviations above which a correlation is significant (two-sided, 1 %).
const CERTAIN: f64 = 2.576;
/// Fewest shots of which anything can be told.
const FEWEST: usize = 4;

/// True if sizes, one for each of these shots, are correlated with one of the conditions of the study.
pub(super) fn follow(setup: &Setup, shots: &[usize], sizes: &[f64]) -> bool {
    setup.study.conditions.values().any(|formula| {
        let value =
            |&shot: &usize| evaluate(formula, &|name| setup.bench.shots[shot].conditions.get(name).copied()).ok();
        let values: Option<Vec<f64>> = shots.iter().map(value).collect();
        values.is_some_and(|values| are_correlated(&values, sizes))
    })
}

/// True if two series are correlated by more than chance.
fn are_correlated(one: &[f64], other: &[f64]) -> bool {
    let count = one.len().min(other.len());
    if count < FEWEST {
        return false;
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (a, b) = (mean(one), mean(other));
    let pairs = || one.iter().zip(other).map(|(x, y)| (x - a, y - b));
    let (xx, yy): (f64, f64) = (pairs().map(|(x, _)| square(x)).sum(), pairs().map(|(_, y)| square(y)).sum());
    // Rounding alone makes no series.
    if xx <= square(1e-9 * a) * count as f64 || yy == 0.0 {
        return false;
    }
    let correlation = pairs().map(|(x, y)| x * y).sum::<f64>() / (xx * yy).sqrt();
    let fisher = 0.5 * ln((1.0 + correlation.abs()) / (1.0 - correlation.abs()).max(f64::EPSILON));
    fisher * (count as f64 - 3.0).sqrt() > CERTAIN
}

#[cfg(test)]
mod tests {
    use super::are_correlated;

    #[test]
    fn what_grows_with_a_condition_is_told_from_scatter() {
        let supply = [118.0, 194.0, 250.0, 114.0, 150.0, 250.0];
        assert!(are_correlated(&supply, &[-0.027, 0.002, 0.059, -0.066, -0.026, 0.057]));
        assert!(!are_correlated(&supply, &[0.03, -0.02, 0.01, -0.05, 0.04, 0.02]));
        // Either way round, and by whether a part is built in.
        assert!(are_correlated(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], &[0.11, 0.12, 0.13, -0.12, -0.13, -0.1]));
        // One condition for all shots, and too few of them, tell nothing.
        assert!(!are_correlated(&[5.0; 6], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        assert!(!are_correlated(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]));
    }
}

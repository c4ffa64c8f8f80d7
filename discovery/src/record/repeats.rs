//! Repeats: how far records of the same conditions scatter about their mean.
//!
//! Each record is interpolated to the times of the first, over the time that all cover.  At every time the records have a variance
//! about their mean; the root of its mean is the scatter of repeats, of which the noise of single samples is a part.  What is left
//! when every record has lost its own mean is the scatter of the course, the rest that of the level.

use hyd_system::math::square;

/// Records of the same conditions.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Repeats {
    /// Number of records.
    pub records: usize,
    /// Times at which all have a value.
    pub samples: usize,
    /// Standard deviation from record to record, root mean square over time (unit of the values).
    pub sigma: f64,
    /// Standard deviation of the records' means over time.
    pub level: f64,
    /// Largest standard deviation from record to record at one time.
    pub largest: f64,
    /// When that is (s).
    pub time: f64,
}

/// How far these records scatter; none for fewer than two that share some time.
pub(crate) fn repeats(records: &[(&[f64], &[f64])]) -> Option<Repeats> {
    let (first, others) = records.split_first()?;
    if others.is_empty() {
        return None;
    }
    let count = records.len() as f64;
    let (mut sum, mut samples, mut largest, mut time) = (0.0, 0usize, -1.0, 0.0);
    let mut means = vec![0.0; records.len()];
    for (&t, &own) in first.0.iter().zip(first.1) {
        let mut all = vec![own];
        all.extend(others.iter().map(|(times, values)| at(times, values, t)));
        if all.iter().any(|value| !value.is_finite()) {
            continue;
        }
        let mean = all.iter().sum::<f64>() / count;
        let variance = all.iter().map(|value| square(value - mean)).sum::<f64>() / (count - 1.0);
        if variance > largest {
            (largest, time) = (variance, t);
        }
        sum += variance;
        samples += 1;
        means.iter_mut().zip(all).for_each(|(sum, value)| *sum += value - mean);
    }
    if samples == 0 {
        return None;
    }
    let level = means.iter().map(|sum| square(sum / samples as f64)).sum::<f64>() / (count - 1.0);
    let sigma = (sum / samples as f64).sqrt();
    Some(Repeats {
        records: records.len(),
        samples,
        sigma,
        level: level.sqrt(),
        largest: largest.max(0.0).sqrt(),
        time,
    })
}

/// The value at `t` on the straight line between two samples; NaN outside the record or beside a gap.
fn at(times: &[f64], values: &[f64], t: f64) -> f64 {
    let after = times.partition_point(|&own| own < t);
    let value = |k: usize| values.get(k).copied().unwrap_or(f64::NAN);
    match times.get(after) {
        Some(&exact) if exact == t => value(after),
        Some(&end) if after > 0 => {
            let begin = times[after - 1];
            value(after - 1) + (value(after) - value(after - 1)) * (t - begin) / (end - begin)
        }
        _ => f64::NAN,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    #[test]
    fn scatter_of_level_and_course_are_told_apart() {
        let mut draws = SplitMix(21);
        let times: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
        let offsets = [0.0, 0.3, -0.3];
        let records: Vec<Vec<f64>> = offsets
            .iter()
            .map(|offset| times.iter().map(|&t| (3.0 * t).sin() + offset + 0.05 * draws.normal()).collect())
            .collect();
        let all: Vec<(&[f64], &[f64])> = records.iter().map(|values| (&times[..], &values[..])).collect();
        let found = repeats(&all).unwrap();
        // Offsets of 0 and +-0.3 have a standard deviation of 0.3.
        assert!((found.level - 0.3).abs() < 0.005 && (found.sigma - 0.3_f64.hypot(0.05)).abs() < 0.005, "{found:?}");
        assert_eq!((found.records, found.samples), (3, 4000));
        assert_eq!((repeats(&all[..1]), repeats(&[])), (None, None));
    }

    #[test]
    fn other_times_are_interpolated_and_gaps_left_out() {
        let first: Vec<f64> = (0..100).map(f64::from).collect();
        let second: Vec<f64> = (0..60).map(|k| f64::from(k) * 1.5 + 3.2).collect();
        let values: Vec<f64> = second.iter().map(|t| 2.0 * t).collect();
        let mut own: Vec<f64> = first.iter().map(|t| 2.0 * t).collect();
        own[50] = f64::NAN;
        let found = repeats(&[(&first, &own), (&second, &values)]).unwrap();
        assert!(found.sigma < 1e-12, "{found:?}");
        // From 3.2 to 91.7 there are the integers 4 to 91, one of them a gap.
        assert_eq!(found.samples, 87);
    }
}

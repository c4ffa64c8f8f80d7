//! The times of a record: sample period, how evenly it is kept, and gaps.
//!
//! The period is the median of the steps, which a few gaps do not move.

use super::median;

/// A step this many periods long is a gap.
const GAP: f64 = 1.5;
/// A step that differs from the period by more than this part of it is uneven.
const UNEVEN: f64 = 0.01;

/// How a record is sampled.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Sampling {
    /// Median step between samples (s).
    pub period: f64,
    /// Share of the steps that differ from the period by more than a hundredth of it, gaps left out.
    pub uneven: f64,
    /// Steps of more than one and a half periods.
    pub gaps: Vec<Gap>,
    /// Positions of samples whose time does not come after that of the sample before.
    pub not_ascending: Vec<usize>,
}

/// A part of a record without values.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Gap {
    /// Time of the last sample before it (s).
    pub from: f64,
    /// Time of the first sample after it (s).
    pub to: f64,
    /// How many samples are missing, by the period.
    pub missing: usize,
}

/// The sampling of a record; none for fewer than two times.
pub(crate) fn sampling(times: &[f64]) -> Option<Sampling> {
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let mut positive: Vec<f64> = steps().filter(|step| *step > 0.0 && step.is_finite()).collect();
    let period = median(&mut positive)?;
    let within = positive.iter().filter(|step| **step <= GAP * period);
    let uneven = within.filter(|step| (**step - period).abs() > UNEVEN * period).count();
    let not_ascending =
        steps().enumerate().filter(|(_, step)| step.is_nan() || *step <= 0.0).map(|(k, _)| k + 1).collect();
    let none = vec![0.0; times.len()];
    Some(Sampling { period, uneven: uneven as f64 / positive.len() as f64, gaps: gaps(times, &none), not_ascending })
}

/// The parts of a record in which times or values are missing.  A part at the very beginning or end begins or ends with the record.
pub(super) fn gaps(times: &[f64], values: &[f64]) -> Vec<Gap> {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    let Some(period) = median(&mut steps) else { return Vec::new() };
    let there: Vec<f64> = times.iter().zip(values).filter(|(_, v)| v.is_finite()).map(|(t, _)| *t).collect();
    let missing = |from: f64, to: f64| ((to - from) / period).round() - 1.0;
    let inner = there.windows(2).filter(|pair| pair[1] - pair[0] > GAP * period);
    let mut found: Vec<Gap> = inner.map(|pair| gap(pair[0], pair[1], missing(pair[0], pair[1]))).collect();
    if let (Some(&first), Some(&last)) = (times.first(), times.last().filter(|_| times.len() == values.len()))
        && let (Some(&begin), Some(&end)) = (there.first(), there.last())
    {
        if begin > first {
            found.insert(0, gap(first, begin, missing(first, begin) + 1.0));
        }
        if end < last {
            found.push(gap(end, last, missing(end, last) + 1.0));
        }
    }
    found
}

fn gap(from: f64, to: f64, missing: f64) -> Gap {
    Gap { from, to, missing: missing.max(1.0) as usize }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn periods_gaps_and_returns_are_found() {
        let mut times: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.001).collect();
        times.drain(40..45);
        let found = sampling(&times).unwrap();
        assert!((found.period - 0.001).abs() < 1e-12 && found.uneven == 0.0 && found.not_ascending.is_empty());
        assert_eq!(found.gaps, [Gap { from: times[39], to: times[40], missing: 5 }]);
        times[50] = times[49];
        times[61] = times[30];
        assert_eq!(sampling(&times).unwrap().not_ascending, [50, 61]);
        assert_eq!(sampling(&[1.0]), None);
    }

    #[test]
    fn missing_values_are_gaps_also_at_the_ends() {
        let times: Vec<f64> = (0..50).map(f64::from).collect();
        let mut values = times.clone();
        for k in [0, 1, 20, 21, 22, 49] {
            values[k] = f64::NAN;
        }
        let found: Vec<(f64, f64, usize)> = gaps(&times, &values).iter().map(|g| (g.from, g.to, g.missing)).collect();
        assert_eq!(found, [(0.0, 2.0, 2), (19.0, 23.0, 3), (48.0, 49.0, 1)]);
    }
}

//! Clipping: samples that stand exactly at the largest or smallest value because the range of a sensor or recorder ends there.
//!
//! A clipped signal comes to its limit at speed, stays there to the last digit, and leaves at speed.  A part that rests (before the
//! first or after the last move) is none, nor is a signal of two levels.

/// Fewest equal samples in a row.
const FEWEST: usize = 4;
/// Share of the samples that lie between the extremes in a signal of more than two levels.
const BETWEEN: f64 = 0.05;
/// Equal neighbours elsewhere, as a share, from which on equal neighbours tell nothing.
const EQUAL: f64 = 0.5;
/// How steep a signal comes and leaves, as a part of its range per sample.
const STEEP: f64 = 1e-4;

/// Values at the end of the range.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Clipping {
    /// Largest value, its samples within runs, and the longest run; none where nothing is clipped there.
    pub top: Option<Limit>,
    /// The same for the smallest value.
    pub bottom: Option<Limit>,
}

/// One end of the range.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limit {
    /// The value.
    pub value: f64,
    /// Samples that stand there.
    pub samples: usize,
    /// Longest run of them.
    pub longest: usize,
    /// Position of the first sample of that run.
    pub index: usize,
}

/// Where a record is clipped; none where it is not.
pub fn clipping(values: &[f64]) -> Option<Clipping> {
    let finite: Vec<(usize, f64)> = values.iter().copied().enumerate().filter(|(_, v)| v.is_finite()).collect();
    let (low, high) = finite.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &(_, v)| (l.min(v), h.max(v)));
    let between = finite.iter().filter(|(_, v)| *v > low && *v < high).count();
    if high <= low || (between as f64) < BETWEEN * finite.len() as f64 {
        return None;
    }
    let inner = || finite.windows(2).filter(|pair| pair.iter().all(|(_, v)| *v > low && *v < high));
    let equal = inner().filter(|pair| pair[0].1 == pair[1].1).count() as f64;
    if equal >= EQUAL * inner().count().max(1) as f64 {
        return None;
    }
    let found = Clipping { top: limit(&finite, high, high - low), bottom: limit(&finite, low, high - low) };
    (found.top.is_some() || found.bottom.is_some()).then_some(found)
}

fn limit(finite: &[(usize, f64)], value: f64, range: f64) -> Option<Limit> {
    let mut found: Option<Limit> = None;
    let mut k = 0;
    while k < finite.len() {
        let run = finite[k..].iter().take_while(|(_, v)| *v == value).count();
        if run >= FEWEST && k >= 1 && k + run < finite.len() {
            let steep = |other: usize| (finite[other].1 - value).abs() > STEEP * range;
            if steep(k - 1) && steep(k + run) {
                let index = finite[k].0;
                let own = found.get_or_insert(Limit { value, samples: 0, longest: 0, index });
                own.samples += run;
                if run > own.longest {
                    (own.longest, own.index) = (run, index);
                }
            }
        }
        k += run.max(1);
    }
    found
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::fit::schedule::Draws;

    #[test]
    fn a_signal_that_leaves_the_range_is_clipped() {
        let mut draws = Draws(4);
        let exact: Vec<f64> = (0..2000).map(|k| 12.0 * (f64::from(k) / 100.0).sin() + 0.05 * draws.normal()).collect();
        let clipped: Vec<f64> = exact.iter().map(|value| value.clamp(-20.0, 10.0)).collect();
        let found = clipping(&clipped).unwrap();
        let beyond = exact.iter().filter(|value| **value >= 10.0).count();
        let top = found.top.unwrap();
        assert!(found.bottom.is_none() && top.value == 10.0, "{found:?}");
        assert!(top.samples <= beyond && top.samples + 30 > beyond && top.longest > 100, "{top:?}, {beyond} beyond");
        assert_eq!(clipping(&exact), None);
    }

    #[test]
    fn rest_and_two_levels_are_not_clipping() {
        // At rest until it moves, and again afterwards.
        let lift: Vec<f64> = (0..600).map(|k| (f64::from(k - 200) / 100.0).clamp(0.0, 1.0)).collect();
        assert_eq!(clipping(&lift), None);
        let trigger: Vec<f64> = (0..600).map(|k| if (100..300).contains(&k) { 5.0 } else { 0.0 }).collect();
        assert_eq!((clipping(&trigger), clipping(&[1.0; 50]), clipping(&[])), (None, None, None));
        // Coarse numbers stand still anywhere.
        let coarse: Vec<f64> = (0..2000).map(|k| (4.0 * (f64::from(k) / 150.0).sin()).round()).collect();
        assert_eq!(clipping(&coarse), None);
    }
}

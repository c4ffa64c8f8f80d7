//! Edges: when a channel leaves the level with which it began, for triggers.
//!
//! The instant is that at which the straight line between two samples passes halfway to the value farthest from the first level.

use super::{median, scatter};

/// Share of the record that gives the first level, at least five samples.
const BEGINNING: f64 = 0.02;
/// How far a channel must go, in standard deviations of its noise.
const FAR: f64 = 8.0;
/// Share of the samples that a signal of two levels spends between them, at most, beyond the few of one edge.
const BETWEEN: f64 = 0.002;
/// Samples of one edge.
const OF_ONE_EDGE: usize = 4;
/// How near to a level a sample is, as a part of the distance of the levels.
const WITHIN: f64 = 0.1;
/// Where an edge counts as over again, as a part of the way.
const AGAIN: f64 = 0.25;

/// An edge.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Edge {
    /// When it passes halfway (s).
    pub time: f64,
    /// Position of the first sample beyond.
    pub index: usize,
    /// The level before.
    pub from: f64,
    /// The value farthest from it.
    pub to: f64,
    /// How often the channel leaves its first level.
    pub count: usize,
}

/// The first edge of a channel; none where it stays at its first level, or begins in the middle of a move.
pub(crate) fn edge(times: &[f64], values: &[f64]) -> Option<Edge> {
    let points: Vec<(usize, f64, f64)> = times
        .iter()
        .zip(values)
        .enumerate()
        .filter(|(_, (_, v))| v.is_finite())
        .map(|(k, (t, v))| (k, *t, *v))
        .collect();
    let beginning = ((BEGINNING * points.len() as f64) as usize).max(5);
    let mut first: Vec<f64> = points.get(..beginning)?.iter().map(|point| point.2).collect();
    let from = median(&mut first)?;
    let far = points.iter().map(|point| point.2).max_by(|a, b| (a - from).abs().total_cmp(&(b - from).abs()))?;
    let way = far - from;
    let noise = scatter(times, values).map_or(0.0, |scatter| scatter.sigma);
    if way == 0.0 || way.abs() <= FAR * noise {
        return None;
    }
    let share = |value: f64| (value - from) / way;
    let (mut found, mut count, mut beyond) = (None, 0, false);
    for (k, &(index, t, value)) in points.iter().enumerate() {
        if !beyond && share(value) >= 0.5 {
            (beyond, count) = (true, count + 1);
            if found.is_none() {
                let &(_, t0, v0) = points.get(k.checked_sub(1)?)?;
                let part = (0.5 - share(v0)) / (share(value) - share(v0));
                found = Some((index, t0 + part * (t - t0)));
            }
        } else if beyond && share(value) < AGAIN {
            beyond = false;
        }
    }
    found.map(|(index, time)| Edge { time, index, from, to: far, count })
}

/// True for a channel that stands at one of two levels nearly always, as a trigger or a switch does.
pub(crate) fn is_two_level(values: &[f64]) -> bool {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let (low, high) = finite.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    let half = 0.5 * (low + high);
    let (mut below, mut above): (Vec<f64>, Vec<f64>) = finite.iter().partition(|value| **value < half);
    let (Some(low), Some(high)) = (median(&mut below), median(&mut above)) else { return false };
    let within = WITHIN * (high - low);
    let near = finite.iter().filter(|value| (**value - low).abs() < within || (**value - high).abs() < within).count();
    let between = finite.len() - near;
    high > low && (between <= OF_ONE_EDGE || between as f64 <= BETWEEN * finite.len() as f64)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    #[test]
    fn edges_are_found_between_samples() {
        let mut draws = SplitMix(2);
        let times: Vec<f64> = (0..2000).map(|k| f64::from(k) * 1e-3).collect();
        for (up, down) in [(0.0, 5.0), (24.0, 0.0)] {
            let pulse = |t: f64| up + (down - up) * ((t - 0.7504) / 0.004 + 0.5).clamp(0.0, 1.0);
            let values: Vec<f64> = times.iter().map(|&t| pulse(t) + 0.02 * draws.normal()).collect();
            let found = edge(&times, &values).unwrap();
            assert!((found.time - 0.7504).abs() < 1e-4 && found.count == 1, "{found:?}");
            assert!((found.from - up).abs() < 0.05 && (found.to - down).abs() < 0.1, "{found:?}");
            assert!(is_two_level(&values));
        }
        let noise: Vec<f64> = times.iter().map(|_| draws.normal()).collect();
        assert_eq!((edge(&times, &noise), is_two_level(&noise)), (None, false));
        assert_eq!((edge(&times, &[3.0; 2000]), edge(&[], &[]), is_two_level(&[1.0; 9])), (None, None, false));
    }

    #[test]
    fn pulses_are_counted_and_curves_have_more_than_two_levels() {
        let times: Vec<f64> = (0..1000).map(f64::from).collect();
        let pulses: Vec<f64> = (0..1000).map(|k| if k % 200 >= 150 { 1.0 } else { 0.0 }).collect();
        let found = edge(&times, &pulses).unwrap();
        assert_eq!((found.index, found.time, found.count), (150, 149.5, 5));
        let lift: Vec<f64> = times.iter().map(|t| (t / 300.0).sin().max(0.0)).collect();
        assert!(!is_two_level(&lift) && is_two_level(&pulses));
        // A slow rise to a level is a measured channel, not a switch.
        let rise: Vec<f64> =
            times.iter().map(|t| if *t > 100.0 { 1.0 - (-(t - 100.0) / 5.0).exp() } else { 0.0 }).collect();
        assert!(!is_two_level(&rise));
    }
}

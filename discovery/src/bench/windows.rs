//! Long records cut into windows, and what the first samples of a shot say of its beginning.
//!
//! A model that integrates twice, or is lightly damped, drifts away from a long record however good it is.  In windows, each with initial
//! states of its own, it is compared over a time in which it can be right (the segments of multiple shooting, Bock 1983, without
//! the conditions that tie them together), and some windows can be held out where there is a single record.

use std::collections::BTreeMap;

use hyd_system::math::square;
use nalgebra::{DMatrix, DVector};

use crate::bench::Shot;
use crate::bench::shot_table::FEWEST;
use crate::study::Study;

/// Windows of a single record, where the study does not say how many and its states can begin anywhere.
const BY_ITSELF: usize = 8;
/// Samples of a window that is made without being asked for, as a multiple of the fewest.
const WORTH_IT: usize = 5;
/// Samples that the slope at the beginning of a channel is taken from.
const SLOPE: usize = 5;
/// A parabola through them has to leave less than this part of what a straight line leaves: of noise it leaves half on average.
const LESS: f64 = 0.05;

/// Into how many windows every table is cut.
pub(crate) fn count(study: &Study, tables: usize, rows: usize) -> usize {
    let by_itself = tables == 1 && study.shots.hold_out.is_none() && !study.initial.is_empty();
    match study.shots.windows {
        Some(count) => count,
        None if by_itself => (rows / (WORTH_IT * FEWEST)).clamp(1, BY_ITSELF),
        None => 1,
    }
}

/// A shot cut into so many windows of as many samples each as can be; `next` is the number of the first.
pub(crate) fn cut(shot: Shot, count: usize, next: usize) -> Vec<Shot> {
    if count < 2 {
        return vec![shot];
    }
    let rows = shot.times.len();
    let window = |k: usize| {
        let part = k * rows / count..(k + 1) * rows / count;
        let of = |(name, values): (&String, &Vec<f64>)| (name.clone(), values[part.clone()].to_vec());
        let has_one = |(_, values): &(String, Vec<f64>)| values.iter().any(|value| !value.is_nan());
        Shot {
            number: next + k,
            file: shot.file.clone(),
            conditions: shot.conditions.clone(),
            times: shot.times[part.clone()].to_vec(),
            values: shot.values.iter().map(of).filter(has_one).collect(),
            inputs: shot.inputs.clone(),
            is_window: true,
        }
    };
    (0..count).map(window).collect()
}

/// What the first samples of the channels say: `first_CHANNEL` and `slope_CHANNEL` (per s), in units of the model.
pub(crate) fn beginnings(shot: &Shot, study: &Study) -> BTreeMap<String, f64> {
    let mut found = BTreeMap::new();
    for (name, values) in &shot.values {
        let Some(channel) = study.channels.get(name) else { continue };
        let samples = shot.times.iter().zip(values).filter(|(_, value)| !value.is_nan()).take(SLOPE);
        let samples: Vec<(f64, f64)> = samples.map(|(time, value)| (*time, value / channel.scale)).collect();
        let Some(first) = samples.first() else { continue };
        found.insert(format!("first_{name}"), first.1);
        if let Some(slope) = first_slope(&samples) {
            found.insert(format!("slope_{name}"), slope);
        }
    }
    found
}

/// The slope at the first of some samples `(time, value)`: of the straight line through them, or, where they are bent so much that the noise
/// about the line shows it, of the parabola.
fn first_slope(samples: &[(f64, f64)]) -> Option<f64> {
    let first = samples.first()?.0;
    let of_line = polynomial(samples, first, 1)?;
    let bent = (samples.len() >= SLOPE).then(|| polynomial(samples, first, 2)).flatten();
    let left = |own: &[f64]| -> f64 {
        let value = |t: f64| own.iter().rev().fold(0.0, |sum, own| sum * (t - first) + own);
        samples.iter().map(|&(t, x)| square(x - value(t))).sum()
    };
    match bent {
        Some(bent) if left(&bent) < LESS * left(&of_line) => Some(bent[1]),
        _ => Some(of_line[1]),
    }
}

fn power_of(x: f64, power: usize) -> f64 {
    std::iter::repeat_n(x, power).product()
}

/// Coefficients of the polynomial of least squares in the time since `first`, the constant first.
fn polynomial(samples: &[(f64, f64)], first: f64, degree: usize) -> Option<Vec<f64>> {
    let span = samples.last()?.0 - first;
    if span <= 0.0 {
        return None;
    }
    // In parts of the span, so that powers are of one size.
    let powers = DMatrix::from_fn(samples.len(), degree + 1, |k, power| power_of((samples[k].0 - first) / span, power));
    let values = DVector::from_iterator(samples.len(), samples.iter().map(|own| own.1));
    let found = powers.svd(true, true).solve(&values, 1e-12).ok()?;
    Some(found.iter().enumerate().map(|(power, own)| own / power_of(span, power)).collect())
}

/// Sentences on which part of which table is which shot.
pub(crate) fn told(shots: &[Shot]) -> Vec<String> {
    let mut tables: Vec<(&str, Vec<&Shot>)> = Vec::new();
    for shot in shots.iter().filter(|shot| shot.is_window) {
        match tables.last_mut().filter(|(file, own)| *file == shot.file && follows(own, shot)) {
            Some((_, own)) => own.push(shot),
            None => tables.push((&shot.file, vec![shot])),
        }
    }
    let sentence = |(file, own): (&str, Vec<&Shot>)| {
        // Each table has at least one window, and each window samples.
        let (first, last) = (own[0], own[own.len() - 1]);
        format!(
            "`{file}` is cut into {} windows, the shots {} to {}, of about {} s",
            own.len(),
            first.number,
            last.number,
            shown_length(first)
        )
    };
    tables.into_iter().map(sentence).collect()
}

fn follows(own: &[&Shot], shot: &Shot) -> bool {
    own.last().is_some_and(|last| last.times.last() < shot.times.first() && last.number + 1 == shot.number)
}

/// The length of a shot (s) in three digits.
fn shown_length(shot: &Shot) -> f64 {
    let length = shot.times[shot.times.len() - 1] - shot.times[0];
    format!("{length:.2e}").parse().unwrap_or(length)
}

#[cfg(test)]
mod tests {
    use super::{Shot, beginnings, cut, first_slope, told};
    use crate::Study;

    fn study() -> Study {
        let text = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"x\", scale = 1e3 }\n";
        Study::parse(text).unwrap_or_else(|fault| panic!("{fault}"))
    }

    #[test]
    fn the_slope_at_the_first_sample_is_not_that_in_the_middle() {
        // A swing that turns 0.02 s later: 65 rad/s2, 100 samples a second.
        let bent: Vec<(f64, f64)> = (0..5).map(|k| 0.01 * f64::from(k)).map(|t| (t, 1.3 * t - 32.5 * t * t)).collect();
        assert!((first_slope(&bent).unwrap_or(f64::NAN) - 1.3).abs() < 1e-9);
        // Noise about a line stays a line: its slope is that of least squares.
        let noisy: Vec<(f64, f64)> =
            [0.02, 0.96, 2.03, 2.98, 4.01].into_iter().enumerate().map(|(k, x)| (k as f64, x)).collect();
        assert!((first_slope(&noisy).unwrap_or(f64::NAN) - 1.0).abs() < 1e-9, "{:?}", first_slope(&noisy));
        assert_eq!(first_slope(&[(1.0, 2.0)]), None);
    }

    #[test]
    fn windows_hold_every_sample_once_and_begin_where_the_channel_does() {
        let times: Vec<f64> = (0..103).map(|k| 0.5 * f64::from(k)).collect();
        // A straight line of 4 per s, the first samples of the third window missing.
        let mut line: Vec<f64> = times.iter().map(|time| 1e3 * (2.0 + 4.0 * time)).collect();
        line[51] = f64::NAN;
        line[52] = f64::NAN;
        let values = [("y".to_string(), line)].into_iter().collect();
        let whole = Shot { number: 9, file: "a.csv".into(), times: times.clone(), values, ..Shot::default() };
        let windows = cut(whole, 4, 1);
        let joined: Vec<f64> = windows.iter().flat_map(|window| window.times.clone()).collect();
        assert_eq!(joined, times);
        assert_eq!(windows.iter().map(|window| window.number).collect::<Vec<_>>(), [1, 2, 3, 4]);
        for (window, first) in windows.iter().zip([0, 25, 53, 77]) {
            let found = beginnings(window, &study());
            assert!((found["first_y"] - (2.0 + 4.0 * times[first])).abs() < 1e-12, "{found:?}");
            assert!((found["slope_y"] - 4.0).abs() < 1e-9, "{found:?}");
        }
        assert_eq!(told(&windows), ["`a.csv` is cut into 4 windows, the shots 1 to 4, of about 12 s"]);
    }
}

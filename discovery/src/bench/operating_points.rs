//! Operating points: under which conditions the shots were made, and which of them are held out.
//!
//! Shots differ where a condition that decides a parameter does, where states begin elsewhere, or where a recorded input takes another course.
//! Conditions are set and compared exactly; beginnings and inputs are measured, and repeats differ by noise.  Windows of one record begin
//! with states that nobody has set and not all of which are measured: they differ where a channel swings wider in one than in another.

use hyd_system::math::square;

use crate::bench::Shot;
use crate::study::formula::{evaluate, names};
use crate::study::initial::Initial;
use crate::{Bench, Study};

/// One in so many shots is held out, at least one.
const HELD_OUT: usize = 4;
/// Beginnings and inputs that differ by less than this part of their size are the same.
const SAME: f64 = 0.05;
/// Windows differ where a channel's swing differs by this part of the widest one: as far as a law that is not linear shows in them.
const SAME_SWING: f64 = 0.2;
/// Part of the samples that is left out at either end of a swing, so that single ones do not decide it.
const TAIL: f64 = 0.02;
/// Times at which inputs are compared.
const LOOKS: usize = 256;

/// True if the shots were made under more than one condition.
pub(crate) fn are_several(study: &Study, bench: &Bench) -> bool {
    let of = |formula: &str| -> Vec<Option<f64>> {
        let value = |shot: &Shot| evaluate(formula, &|name| shot.conditions.get(name).copied()).ok();
        bench.shots.iter().map(value).collect()
    };
    let differ = |formula: &String| of(formula).windows(2).any(|pair| pair[0] != pair[1]);
    let begin_elsewhere = |formula: &str| {
        let values: Vec<f64> = of(formula).into_iter().flatten().collect();
        let size = values.iter().fold(0.0f64, |size, value| size.max(value.abs()));
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), &value| (a.min(value), b.max(value)));
        // What is measured is compared with the way that the channel goes, so that its origin does not matter.
        high - low > SAME * way(formula, study, bench).unwrap_or(size)
    };
    study.conditions.values().any(differ)
        || study.initial.values().filter_map(Initial::formula).any(begin_elsewhere)
        || bench.shots.windows(2).any(|pair| are_driven_apart(&pair[0], &pair[1]))
        || study.channels.keys().any(|channel| swings_apart(channel, bench))
}

/// True if a channel swings wider in one window of a record than in another.
fn swings_apart(channel: &str, bench: &Bench) -> bool {
    let windows = bench.shots.iter().filter(|shot| shot.is_window);
    let swings: Vec<f64> = windows.filter_map(|shot| swing(shot.values.get(channel)?)).collect();
    let (low, high) = swings.iter().fold((f64::MAX, 0.0f64), |(a, b), &swing| (a.min(swing), b.max(swing)));
    high - low > SAME_SWING * high
}

/// From where to where values go, but for the outermost ones; none without a value.
fn swing(values: &[f64]) -> Option<f64> {
    let mut known: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    known.sort_unstable_by(f64::total_cmp);
    let last = known.len().checked_sub(1)?;
    let left_out = (TAIL * last as f64) as usize;
    Some(known[last - left_out] - known[left_out])
}

/// How far the value of a formula goes while the channels whose first samples stand in it go from end to end; none where it holds none.
fn way(formula: &str, study: &Study, bench: &Bench) -> Option<f64> {
    let ends = |name: &str| {
        let name = name.strip_prefix("first_")?;
        let scale = study.channels.get(name)?.scale;
        let own = bench.shots.iter().flat_map(|shot| &shot.values).filter(|(channel, _)| *channel == name);
        let values = own.flat_map(|(_, values)| values).filter(|value| !value.is_nan()).map(|value| value / scale);
        Some(values.fold((f64::MAX, f64::MIN), |(a, b), value| (a.min(value), b.max(value)))).filter(|(a, b)| a <= b)
    };
    names(formula).iter().find_map(|name| ends(name))?;
    let conditions = &bench.shots.first()?.conditions;
    let at = |end: fn((f64, f64)) -> f64| {
        evaluate(formula, &|name| ends(name).map(end).or_else(|| conditions.get(name).copied())).ok()
    };
    Some((at(|ends| ends.1)? - at(|ends| ends.0)?).abs())
}

/// True if a recorded input takes another course in one shot than in the other.
fn are_driven_apart(one: &Shot, other: &Shot) -> bool {
    let length =
        (one.times[one.times.len() - 1] - one.times[0]).min(other.times[other.times.len() - 1] - other.times[0]);
    let apart = |name: &String| {
        let (Some(a), Some(b)) = (one.inputs.get(name), other.inputs.get(name)) else { return false };
        let at = |series: &hyd_system::Series, begin: f64, k: usize| {
            let time = begin + length * k as f64 / LOOKS as f64;
            series.at(time, series.interval(time, 0)).value
        };
        let pairs = (0..LOOKS).map(|k| (at(a, one.times[0], k), at(b, other.times[0], k)));
        let (apart, size) =
            pairs.fold((0.0, 0.0), |(apart, size), (a, b)| (apart + square(a - b), size + a * a + b * b));
        apart > SAME * SAME * size
    };
    one.inputs.keys().any(apart)
}

/// The shots nearest to the centre of the operating points, but for some: values of the conditions that decide
/// parameters, each by its range.
pub(crate) fn central(study: &Study, bench: &Bench, except: &[usize]) -> Vec<usize> {
    let count = bench.shots.len();
    if count < 2 {
        return Vec::new();
    }
    if bench.shots.iter().all(|shot| shot.is_window) {
        // Of windows each is as good as its neighbours: they are held out all along the record.
        let all = (0..count).filter(|shot| !except.contains(shot));
        let phase = if except.is_empty() { HELD_OUT / 2 } else { 0 };
        let held: Vec<usize> = all.clone().filter(|shot| shot % HELD_OUT == phase).collect();
        return if held.is_empty() { all.max().into_iter().collect() } else { held };
    }
    let mut distances = vec![0.0; count];
    for formula in study.conditions.values() {
        let values: Vec<f64> = bench
            .shots
            .iter()
            .filter_map(|shot| evaluate(formula, &|name| shot.conditions.get(name).copied()).ok())
            .collect();
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), &v| (a.min(v), b.max(v)));
        if values.len() == count && high > low {
            let mean = values.iter().sum::<f64>() / count as f64;
            distances.iter_mut().zip(&values).for_each(|(d, v)| *d += square((v - mean) / (high - low)));
        }
    }
    let mut order: Vec<usize> = (0..count).filter(|shot| !except.contains(shot)).collect();
    // Of two equally central shots the later one, so that the first stays in.
    order.sort_by(|&a, &b| distances[a].total_cmp(&distances[b]).then(b.cmp(&a)));
    let mut held: Vec<usize> = order.into_iter().take((count / HELD_OUT).max(1)).collect();
    held.sort_unstable();
    held
}

#[cfg(test)]
mod tests {
    use super::are_several;
    use crate::bench::Shot;
    use crate::bench::windows::beginnings;
    use crate::{Bench, Study};

    /// An angle about `origin` that begins where each shot says and dies away.
    fn bench(origin: f64, begins: &[f64], study: &Study) -> Bench {
        let shot = |&begin: &f64| {
            let times: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
            let value = |t: &f64| 1e3 * (origin + begin * (20.0 * t).cos() * (-t).exp());
            let values = [("y".to_string(), times.iter().map(value).collect())].into_iter().collect();
            let mut shot = Shot { times, values, ..Shot::default() };
            shot.conditions = beginnings(&shot, study);
            shot
        };
        Bench { shots: begins.iter().map(shot).collect(), ..Bench::default() }
    }

    /// Windows of a swing that loses this part of its first width from one to the next, all of which begin where it passes the centre.
    fn windows(loss: f64) -> Bench {
        let window = |k: u32| {
            let times: Vec<f64> = (0..200).map(|n| 0.01 * f64::from(n)).collect();
            let width = 1.0 - loss * f64::from(k);
            let values: Vec<f64> = times.iter().map(|t| width * (20.0 * t).sin()).collect();
            Shot {
                times,
                values: [("y".to_string(), values)].into_iter().collect(),
                is_window: true,
                ..Shot::default()
            }
        };
        Bench { shots: (0..4).map(window).collect(), ..Bench::default() }
    }

    #[test]
    fn windows_differ_by_how_wide_a_channel_swings() {
        let text = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"x\" }\n\
            [initial]\nx = { value = \"first_y\", absolute = 0.1 }\n";
        let study = Study::parse(text).unwrap_or_else(|fault| panic!("{fault}"));
        assert!(are_several(&study, &windows(0.1)));
        assert!(!are_several(&study, &windows(0.01)));
        let mut repeats = windows(0.1);
        repeats.shots.iter_mut().for_each(|shot| shot.is_window = false);
        assert!(!are_several(&study, &repeats), "how wide shots swing is not set by a lab");
    }

    #[test]
    fn beginnings_differ_by_the_way_of_the_channel_wherever_its_origin_lies() {
        let text = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"x\", scale = 1e3 }\n\
            [initial]\nx = \"2*first_y - 1\"\n";
        let study = Study::parse(text).unwrap_or_else(|fault| panic!("{fault}"));
        for origin in [0.0, 3.0, -500.0] {
            assert!(are_several(&study, &bench(origin, &[0.1, 0.06, -0.03], &study)), "{origin}");
            assert!(!are_several(&study, &bench(origin, &[0.1, 0.1002, 0.0999], &study)), "{origin}");
        }
    }
}

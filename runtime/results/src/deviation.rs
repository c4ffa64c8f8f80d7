//! How far two results lie apart, variable by variable.
//!
//! The results may have different times.  A value of one is compared with all values that the other takes within a short
//! window of time, so that a jump that comes a little earlier or later is not a deviation; this is done both ways.  The window
//! makes a tube around each curve (as `csv-compare` of the Modelica Association does), here with flat sides.

use std::borrow::Cow;
use std::collections::HashMap;

use crate::{Side, Table, interpolate};

/// How far one variable lies apart in two results.
#[derive(Clone, PartialEq, Debug)]
pub struct Deviation {
    /// Full name.
    pub name: String,
    /// Largest distance of a value from the other result's window, in the variable's unit.
    pub largest: f64,
    /// Time (s) of it.
    pub time: f64,
    /// What it is to be measured by: the larger range of values of the two, or the value where nothing changes.
    pub scale: f64,
}

impl Deviation {
    /// The largest distance as a part of the scale; 0 where both are 0.
    pub fn relative(&self) -> f64 {
        if self.largest == 0.0 { 0.0 } else { self.largest / self.scale.max(f64::MIN_POSITIVE) }
    }
}

/// Deviations of all variables that both results have, in the order of `a`; `window` (s) is the half width of the window.
/// Only the time that both cover is looked at.  A value that is not finite in one result only is infinitely far away.  What one
/// result holds as a constant is compared with the values of the other.
pub fn deviations(a: &Table, b: &Table, window: f64) -> Vec<Deviation> {
    let (a_to_b, b_to_a) = (windows(&a.times, &b.times, window), windows(&b.times, &a.times, window));
    let start = a.times.first().copied().unwrap_or(0.0);
    let known = series(b);
    let mut all = Vec::new();
    for (name, of_a) in named(a) {
        let Some(&of_b) = known.get(name) else { continue };
        let (largest, time) = match (of_a, of_b) {
            (Series::Constant(value), Series::Constant(other)) => (distance(value, other, other), start),
            _ => {
                let (of_a, of_b) = (of_a.over(a), of_b.over(b));
                let first = farthest((&a.times, &of_a), (&b.times, &of_b), &a_to_b, window);
                let second = farthest((&b.times, &of_b), (&a.times, &of_a), &b_to_a, window);
                if second.0 > first.0 { second } else { first }
            }
        };
        all.push(Deviation { name: name.to_string(), largest, time, scale: of_a.range().max(of_b.range()) });
    }
    all
}

/// Values of a variable in one result.
#[derive(Clone, Copy)]
enum Series<'a> {
    Column(&'a [f64]),
    Constant(f64),
}

impl<'a> Series<'a> {
    /// A value for every time of the result.
    fn over(self, table: &Table) -> Cow<'a, [f64]> {
        match self {
            Series::Column(values) => values.into(),
            Series::Constant(value) => vec![value; table.times.len()].into(),
        }
    }

    fn range(self) -> f64 {
        match self {
            Series::Column(values) => range(values),
            Series::Constant(value) => range(&[value]),
        }
    }
}

/// The variables of a result, columns first, each with its values.
fn named(table: &Table) -> impl Iterator<Item = (&str, Series<'_>)> {
    let columns = table.names.iter().zip(&table.columns);
    let columns = columns.map(|(name, values)| (name.as_str(), Series::Column(values)));
    columns.chain(table.constants.iter().map(|(name, value)| (name.as_str(), Series::Constant(*value))))
}

fn series(table: &Table) -> HashMap<&str, Series<'_>> {
    named(table).collect()
}

/// For each time of `of` the rows of `within` that lie in its window, as a half-open range; `None` outside the common time.
fn windows(of: &[f64], within: &[f64], window: f64) -> Vec<Option<(usize, usize)>> {
    let (Some(&first), Some(&last)) = (within.first(), within.last()) else { return vec![None; of.len()] };
    let (mut low, mut high) = (0, 0);
    let mut find = |&t: &f64| {
        if t < first || t > last {
            return None;
        }
        while low < within.len() && within[low] < t - window {
            low += 1;
        }
        while high < within.len() && within[high] <= t + window {
            high += 1;
        }
        Some((low, high.max(low)))
    };
    of.iter().map(&mut find).collect()
}

/// Largest distance of the points of one curve from the windows of another, and its time.
fn farthest(
    (times, values): (&[f64], &[f64]),
    (other_times, other): (&[f64], &[f64]),
    windows: &[Option<(usize, usize)>],
    window: f64,
) -> (f64, f64) {
    let mut worst = (0.0, times.first().copied().unwrap_or(0.0));
    for ((&t, &value), rows) in times.iter().zip(values).zip(windows) {
        let Some((low, high)) = *rows else { continue };
        let (from, to) = (other_times[0], other_times[other_times.len() - 1]);
        let ends = [(t - window).clamp(from, to), (t + window).clamp(from, to)];
        let at = |t: f64, side| interpolate(other_times, |k| other[k], t, side);
        let ends =
            [at(ends[0], Side::Before), at(ends[0], Side::After), at(ends[1], Side::Before), at(ends[1], Side::After)];
        let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
        for &v in other[low..high].iter().chain(&ends) {
            bounds = (bounds.0.min(v), bounds.1.max(v));
        }
        let apart = distance(value, bounds.0, bounds.1);
        if apart > worst.0 {
            worst = (apart, t);
        }
    }
    worst
}

fn distance(value: f64, low: f64, high: f64) -> f64 {
    if !value.is_finite() || !low.is_finite() || !high.is_finite() {
        // A window without any number leaves its bounds crossed.
        let alike = if value.is_nan() { low > high || low.is_nan() } else { (low..=high).contains(&value) };
        return if alike { 0.0 } else { f64::INFINITY };
    }
    (value - high).max(low - value).max(0.0)
}

fn range(values: &[f64]) -> f64 {
    let finite = values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    match high - low {
        range if range > 0.0 => range,
        _ if high.is_finite() => high.abs(),
        _ => 0.0,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        Table::parse(text.as_bytes()).unwrap()
    }

    #[test]
    fn a_ramp_against_itself_on_another_grid_does_not_deviate() {
        let a = table("time,x\n0,0\n1,1\n2,2\n");
        let b = table("time,x\n0,0\n0.3,0.3\n1.7,1.7\n2,2\n");
        let found = deviations(&a, &b, 0.0);
        assert!(found[0].largest < 1e-15 && found[0].scale == 2.0, "{found:?}");
    }

    #[test]
    fn a_late_jump_is_forgiven_within_the_window_only() {
        let a = table("time,x\n0,0\n1,0\n1,5\n2,5\n");
        let b = table("time,x\n0,0\n1.01,0\n1.01,5\n2,5\n");
        assert_eq!(deviations(&a, &b, 0.02)[0].largest, 0.0);
        let found = &deviations(&a, &b, 0.001)[0];
        assert_eq!((found.largest, found.relative()), (5.0, 1.0));
        assert!((found.time - 1.0).abs() < 0.02);
    }

    #[test]
    fn an_offset_is_found_where_it_is_largest() {
        let a = table("time,x\n0,0\n1,1\n2,0\n");
        let b = table("time,x\n0,0\n1,1.5\n2,0\n");
        let found = &deviations(&a, &b, 0.0)[0];
        assert_eq!((found.largest, found.time, found.scale), (0.5, 1.0, 1.5));
    }

    #[test]
    fn a_constant_of_one_result_is_held_against_the_values_of_the_other() {
        let a = table("time,x,y\n0,2,1\n1,2,1.5\n2,2,1\n");
        let mut b = table("time,z\n0,0\n2,0\n");
        b.constants = vec![("x".to_string(), 2.0), ("y".to_string(), 1.0)];
        for found in [deviations(&a, &b, 0.0), deviations(&b, &a, 0.0)] {
            let told: Vec<_> = found.iter().map(|d| (d.name.as_str(), d.largest, d.time, d.scale)).collect();
            assert_eq!(told, [("x", 0.0, 0.0, 2.0), ("y", 0.5, 1.0, 1.0)]);
        }
    }

    #[test]
    fn what_is_not_a_number_on_one_side_is_far_away() {
        let a = table("time,x,y\n0,0,NaN\n1,NaN,NaN\n");
        let b = table("time,x,y\n0,0,NaN\n1,1,NaN\n");
        let found = deviations(&a, &b, 0.0);
        assert_eq!((found[0].largest, found[1].largest), (f64::INFINITY, 0.0));
        // Infinities are alike on the same side only, and none is like what is not a number.
        let a = table("time,x,y,z\n0,inf,inf,inf\n1,inf,inf,inf\n");
        let b = table("time,x,y,z\n0,inf,-inf,NaN\n1,inf,-inf,NaN\n");
        let found: Vec<f64> = deviations(&a, &b, 0.0).iter().map(|own| own.largest).collect();
        assert_eq!(found, [0.0, f64::INFINITY, f64::INFINITY]);
    }
}

//! Linear interpolation over rows in which events stand twice.
//!
//! Times ascend; two (or more) equal times mark an event.  Exactly at an event the caller says which side is meant;
//! elsewhere the two rows around a time always lie on the same side of every event.  Outside the rows the nearest value
//! holds.

/// Which of the rows of an event is meant at its very time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Side {
    /// The value just before.
    Before,
    /// The value just after.
    After,
}

/// The value at time `t` of a quantity known at ascending `times` by `value(row)`.
/// NaN if there are no rows or `t` is NaN.
pub fn interpolate(times: &[f64], value: impl Fn(usize) -> f64, t: f64, side: Side) -> f64 {
    if times.is_empty() || t.is_nan() {
        return f64::NAN;
    }
    let last = times.len() - 1;
    // Rows before `next` lie on or before t, as the side asks.
    let next = match side {
        Side::Before => times.partition_point(|&s| s < t),
        Side::After => times.partition_point(|&s| s <= t),
    };
    if next == 0 {
        return value(0);
    }
    if next > last {
        return value(last);
    }
    if side == Side::Before && times[next] == t {
        return value(next);
    }
    let (a, b) = (times[next - 1], times[next]);
    if side == Side::After && a == t {
        return value(next - 1);
    }
    let (left, right) = (value(next - 1), value(next));
    left + (t - a) / (b - a) * (right - left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_not_smeared() {
        let times = [0.0, 1.0, 1.0, 2.0];
        let values = [0.0, 10.0, 20.0, 40.0];
        let at = |t, side| interpolate(&times, |k| values[k], t, side);
        assert_eq!(at(0.5, Side::Before), 5.0);
        assert_eq!(at(1.0, Side::Before), 10.0);
        assert_eq!(at(1.0, Side::After), 20.0);
        assert_eq!(at(1.5, Side::Before), 30.0);
        assert_eq!(at(-1.0, Side::After), 0.0);
        assert_eq!(at(2.0, Side::Before), 40.0);
        assert_eq!(at(2.0, Side::After), 40.0);
        assert_eq!(at(9.0, Side::Before), 40.0);
        assert!(interpolate(&[], |_| 0.0, 0.0, Side::After).is_nan());
    }

    #[test]
    fn a_triple_time_takes_the_outer_rows() {
        let times = [0.0, 1.0, 1.0, 1.0, 2.0];
        let values = [0.0, 1.0, 7.0, 3.0, 4.0];
        let at = |side| interpolate(&times, |k| values[k], 1.0, side);
        assert_eq!((at(Side::Before), at(Side::After)), (1.0, 3.0));
    }
}

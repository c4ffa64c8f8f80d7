//! How far unknowns may go: no farther than `min` and `max` of the parameters that they stand for.
//!
//! Every unknown moves its parameters one way, so the limits of a parameter are bounds of the unknown, the narrowest of all places
//! and shots.  Where several unknowns move one parameter, or others follow from it, the bounds alone do not suffice; a run whose
//! values are outside is refused then, like one that fails.

use crate::magnitude::LARGEST;
use crate::problem::Problem;
use crate::unknowns::{Meaning, Unknown};

/// Halvings until a bound is as good as exact.
const HALVINGS: usize = 60;

/// Sets the bounds of all unknowns.
pub(crate) fn limit(problem: &mut Problem<'_>) {
    // Without limits of its own no parameter is larger than any number that makes sense.
    let range = |place| {
        let (min, max) = problem.machine.range(place);
        (min.max(-LARGEST), max.min(LARGEST))
    };
    let ranges: Vec<(f64, f64)> = problem.places.iter().map(range).collect();
    let mut unknowns = std::mem::take(&mut problem.unknowns);
    for unknown in &mut unknowns {
        for place in unknown.places().to_vec() {
            let shots = (0..problem.base.len()).filter(|&shot| unknown.touches(shot));
            for shot in shots.collect::<Vec<_>>() {
                let base = problem.base[shot][place];
                unknown.bounds = narrowed(unknown, base, ranges[place]);
            }
        }
    }
    problem.unknowns = unknowns;
}

/// The bounds within which a parameter of this value stays in its range.
fn narrowed(unknown: &Unknown, base: f64, (min, max): (f64, f64)) -> (f64, f64) {
    let value = |xi: f64| match &unknown.meaning {
        Meaning::Relative { .. } => base * unknown.value(xi),
        Meaning::Late { .. } => base + unknown.value(xi),
        _ => unknown.value(xi),
    };
    let is_inside = |xi: f64| (min..=max).contains(&value(xi));
    let (low, high) = unknown.bounds;
    // The way out from somewhere inside; the prior's centre as a rule.
    let Some(inside) = inside(&value, (min, max), (low, high)) else {
        // Nothing may be reached: the run says which value is outside of what.
        return (low, high);
    };
    let end = |far: f64| {
        if is_inside(far) {
            return far;
        }
        let (mut good, mut bad) = (inside, far);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (good + bad);
            if is_inside(middle) { good = middle } else { bad = middle }
        }
        good
    };
    (end(low), end(high))
}

/// A number between the bounds whose value is in the range.
fn inside(value: &dyn Fn(f64) -> f64, (min, max): (f64, f64), (low, high): (f64, f64)) -> Option<f64> {
    let is_inside = |xi: f64| (min..=max).contains(&value(xi));
    if let Some(xi) = [0.0_f64.clamp(low, high), low, high].into_iter().find(|&xi| is_inside(xi)) {
        return Some(xi);
    }
    // Values go one way: halve towards the range.
    let rises = value(high) > value(low);
    let (mut low, mut high) = (low, high);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_inside(middle) {
            return Some(middle);
        }
        if (value(middle) < min) == rises { low = middle } else { high = middle }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::{Meaning, Unknown, narrowed};
    use crate::unknowns::LIMIT;
    use crate::unknowns::prior::Prior;

    #[test]
    fn values_stay_within_the_limits_and_come_close_to_them() {
        let relative = |sigma| Meaning::Relative { places: vec![0], sigma };
        let value = |prior| Meaning::Value { places: vec![0], prior };
        let late = Meaning::Late { places: vec![0], sigma: 1e-3 };
        let unlimited = f64::INFINITY;
        for (meaning, base, range, expected) in [
            (relative(0.1), 2.0, (1.5, 3.0), (-2.5, 5.0)),
            // A negative value moves the other way.
            (relative(0.1), -2.0, (-3.0, -1.5), (-2.5, 5.0)),
            (relative(0.5), 1.0, (0.0, unlimited), (-2.0, LIMIT)),
            (relative(0.1), 2.0, (2.0, 2.0), (0.0, 0.0)),
            // The value itself is outside, and what may be is not far.
            (relative(0.1), 2.0, (2.2, 3.0), (1.0, 5.0)),
            (value(Prior::Normal(1.0, 0.5)), 9.0, (0.0, 3.0), (-2.0, 4.0)),
            (value(Prior::Lognormal(1.0, 1.0)), 9.0, (0.0, 1.0_f64.exp()), (-LIMIT, 1.0)),
            (late, 5e-3, (4e-3, unlimited), (-1.0, LIMIT)),
            // Nothing that may be reached.
            (relative(0.01), 2.0, (50.0, 60.0), (-LIMIT, LIMIT)),
            (relative(0.1), 0.0, (1.0, 2.0), (-LIMIT, LIMIT)),
        ] {
            let unknown = Unknown::new(String::new(), meaning, None, None);
            let bounds = narrowed(&unknown, base, range);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
            assert!(near(bounds.0, expected.0) && near(bounds.1, expected.1), "{bounds:?} {expected:?}");
        }
    }
}

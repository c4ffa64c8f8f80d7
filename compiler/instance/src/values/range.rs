//! Ranges `start:step:stop` (Modelica 3.6, section 10.4.3): how many values they have, and these values before the run.

use crate::instantiation::work::MAX_VALUES;
use crate::values::value::Value;

/// The message for `a:0:b`.
pub const ZERO_STEP: &str = "the step of this range is zero";

/// The least part of a step of type Real that is taken for rounding.
pub const SLACK: f64 = 1e-10;

/// What may be rounding for each step that the larger end is away from 0, as a part of a step.
pub const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// How many values a range of Integers has, whose step is not 0.
pub fn count_of_integers(start: i64, step: i64, stop: i64) -> i128 {
    let (distance, step) = (i128::from(stop) - i128::from(start), i128::from(step));
    let backwards = distance != 0 && (distance > 0) != (step > 0);
    if backwards { 0 } else { distance / step + 1 }
}

/// How many values `start:step:stop` has if one of the three is a Real: a step that misses the end by rounding still counts.  NaN or
/// infinite if the three are.
pub fn count_of_reals(start: f64, step: f64, stop: f64) -> f64 {
    let rounding = ROUNDING * (start.abs().max(stop.abs()) / step.abs());
    let count = ((stop - start) / step + SLACK.max(rounding)).floor() + 1.0;
    if count < 0.0 { 0.0 } else { count }
}

/// The values `first:by:last` of a step that is not 0; `stepped`: it is written.  `None` where the three have no range, or one with too
/// many values.
pub(crate) fn values(first: &Value, by: &Value, last: &Value, stepped: bool) -> Option<Vec<Value>> {
    match (first, by, last) {
        (Value::Integer(a), Value::Integer(s), Value::Integer(b)) => {
            let count = usize::try_from(count_of_integers(*a, *s, *b)).ok().filter(|&count| count <= MAX_VALUES)?;
            let at = |k: usize| (i128::from(*a) + k as i128 * i128::from(*s)) as i64;
            Some((0..count).map(|k| Value::Integer(at(k))).collect())
        }
        (Value::Enumeration(t, a), _, Value::Enumeration(u, b)) if t == u && !stepped => {
            Some((*a..=*b).map(|k| Value::Enumeration(t.clone(), k)).collect())
        }
        (Value::Boolean(a), _, Value::Boolean(b)) if !stepped => {
            Some([false, true].into_iter().filter(|v| *a <= *v && *v <= *b).map(Value::Boolean).collect())
        }
        _ => {
            let (a, s, b) = (first.as_real()?, by.as_real()?, last.as_real()?);
            let count = count_of_reals(a, s, b);
            let values = || (0..count as usize).map(|k| Value::Real(a + k as f64 * s)).collect();
            (count <= MAX_VALUES as f64).then(values)
        }
    }
}

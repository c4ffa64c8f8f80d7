//! Ticks of an axis: multiples of 1, 2 or 5 times a power of ten.
//!
//! The step is the smallest of these that gives no more than the wanted number of intervals; the labels have as many
//! decimals as the step needs, and computing with whole multiples keeps them exact.

use crate::decimal::{decade, power_of_ten};

/// Ticks within a range.
#[derive(Clone, PartialEq, Debug)]
pub struct Ticks {
    /// Positions, ascending.
    pub values: Vec<f64>,
    /// Text of each.
    pub labels: Vec<String>,
}

/// Ticks in `low..=high` with at most `intervals` steps across; none if the range is empty or not finite.
pub fn ticks(low: f64, high: f64, intervals: usize) -> Ticks {
    let mut result = Ticks { values: Vec::new(), labels: Vec::new() };
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) || intervals == 0 {
        return result;
    }
    let (mantissa, exponent) = nice_step(span / intervals as f64);
    let step = f64::from(mantissa) * power_of_ten(exponent);
    // A range that ends on a tick up to rounding has that tick.
    let slack = 1e-9 * intervals as f64;
    let (first, last) = ((low / step - slack).ceil(), (high / step + slack).floor());
    if !(first.abs() < 1e15 && last.abs() < 1e15) {
        return result;
    }
    for k in first as i64..=last as i64 {
        let whole = (k * i64::from(mantissa)) as f64;
        let value = if exponent < 0 { whole / power_of_ten(-exponent) } else { whole * power_of_ten(exponent) };
        result.values.push(value);
        result.labels.push(label(value, (-exponent).max(0) as usize));
    }
    result
}

/// The smallest `m * 10^e >= raw` with m of 1, 2, 5.
fn nice_step(raw: f64) -> (i32, i32) {
    let exponent = decade(raw);
    let fraction = raw / power_of_ten(exponent);
    for mantissa in [1, 2, 5] {
        if fraction <= f64::from(mantissa) * (1.0 + 1e-6) {
            return (mantissa, exponent);
        }
    }
    (1, exponent + 1)
}

fn label(value: f64, decimals: usize) -> String {
    // `+ 0.0` turns a negative zero into zero; the minus sign of typography is as wide as a plus.
    format!("{:.decimals$}", value + 0.0).replace('-', "\u{2212}")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn check(low: f64, high: f64, intervals: usize, expected: &[&str]) {
        let found = ticks(low, high, intervals);
        assert_eq!(found.labels, expected, "{low} .. {high} in {intervals}");
        for (value, label) in found.values.iter().zip(&found.labels) {
            assert_eq!(*value, label.replace('\u{2212}', "-").parse::<f64>().unwrap());
        }
    }

    #[test]
    fn steps_are_one_two_five() {
        check(0.0, 1.0, 5, &["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        check(0.0, 10.0, 10, &["0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10"]);
        check(0.0, 10.0, 9, &["0", "2", "4", "6", "8", "10"]);
        check(-3.0, 7.0, 4, &["0", "5"]);
        check(-0.11, 0.13, 5, &["−0.10", "−0.05", "0.00", "0.05", "0.10"]);
        check(99.2, 101.7, 5, &["99.5", "100.0", "100.5", "101.0", "101.5"]);
        check(0.0, 0.3, 3, &["0.0", "0.1", "0.2", "0.3"]);
        check(-2.0e7, 1.0e7, 3, &["−20000000", "−10000000", "0", "10000000"]);
        check(10.000001, 10.000004, 3, &["10.000001", "10.000002", "10.000003", "10.000004"]);
    }

    #[test]
    fn hopeless_ranges_have_no_ticks() {
        for (low, high) in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            assert!(ticks(low, high, 5).values.is_empty());
        }
        assert!(ticks(1e30, 1e30 * (1.0 + 1e-15), 5).values.is_empty());
    }
}

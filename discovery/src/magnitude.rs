//! How large numbers may be before they mean nothing, whoever has written or computed them.

/// What no sensor measures and no machine has, in any unit: from here on squares of residuals leave the range of numbers.
pub(crate) const LARGEST: f64 = 1e100;
/// The largest sum of squares that still shows a change by one, on which steps of fits, and names, are decided.
pub(crate) const RESOLVED: f64 = 1.0 / f64::EPSILON;

/// True for a number that a study, a set or a model may have.
pub(crate) fn is_plausible(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// A number for messages: very large and very small ones with an exponent and a few digits.
pub(crate) fn shown(value: f64) -> String {
    if value == 0.0 || (1e-5..1e15).contains(&value.abs()) {
        return value.to_string();
    }
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    format!("{rounded:e}")
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn numbers_in_messages_are_short() {
        let numbers = [0.0, -0.3, 1.0 + 1e-12, 1e300, 1.05 * 1e100, 1e7 * 1e300, -1.0 / 3.0 * 1e-9, f64::INFINITY];
        let texts = ["0", "-0.3", "1.000000000001", "1e300", "1.05e100", "1e307", "-3.33333e-10", "inf"];
        assert_eq!(numbers.map(shown), texts);
    }
}

//! Numbers as text: what `String(x, ...)` gives (Modelica 3.6, section 3.7.1.1), at translation and in messages of a run.
//!
//! Formats are those of the C language's `printf` for `d i f e g E G`, with flags, width and precision (ISO C 2011,
//! section 7.21.6.1).  Not here: hexadecimal, octal and unsigned forms.

use crate::math::log10;
use crate::tables::ValueKind;

/// How a value is written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TextFormat {
    /// Digits that count, of Real values.
    pub significant_digits: u32,
    /// Filled with blanks to this length.
    pub minimum_length: u32,
    /// Blanks stand on the right.
    pub left_justified: bool,
    /// A C format without the percent sign instead of the above, such as `.3f`.
    pub format: Option<String>,
}

impl Default for TextFormat {
    fn default() -> Self {
        Self { significant_digits: 6, minimum_length: 0, left_justified: true, format: None }
    }
}

/// Longest width or precision that is obeyed.
const LONGEST: usize = 400;

impl TextFormat {
    /// The text of a stored value (Booleans 0 and 1, literals counted from 1).  A format that cannot be read falls back to
    /// the default one.
    pub fn text(&self, value: f64, kind: &ValueKind) -> String {
        if let Some(text) = self.format.as_deref().and_then(|format| formatted(format, value)) {
            return text;
        }
        let text = match kind {
            ValueKind::Real => general(value, self.significant_digits.clamp(1, 17) as usize, false, false),
            ValueKind::Integer => format!("{value:.0}"),
            ValueKind::Boolean => (value != 0.0).to_string(),
            ValueKind::Enumeration(literals) => {
                literals.get((value - 1.0).max(0.0) as usize).map(|l| l.to_string()).unwrap_or_default()
            }
        };
        padded(text, (self.minimum_length as usize).min(LONGEST), self.left_justified, false)
    }
}

/// A C format without its percent sign; `None` if it cannot be read.
fn formatted(format: &str, value: f64) -> Option<String> {
    let format = format.trim_start_matches('%');
    let flags: String = format.chars().take_while(|c| "-+ #0".contains(*c)).collect();
    let rest = &format[flags.len()..];
    let conversion = rest.chars().last()?;
    let sizes = &rest[..rest.len() - conversion.len_utf8()];
    let (width, precision) = match sizes.split_once('.') {
        Some((width, precision)) => (width, Some(precision)),
        None => (sizes, None),
    };
    let number = |text: &str| if text.is_empty() { Some(0) } else { text.parse().ok().filter(|&n| n <= LONGEST) };
    let (width, precision) = (number(width)?, precision.map(number).map_or(Some(None), |p| p.map(Some))?);
    let mut text = match conversion {
        'd' | 'i' => format!("{:.0}", value.round()),
        'f' => format!("{value:.*}", precision.unwrap_or(6)),
        'e' | 'E' => exponential(value, precision.unwrap_or(6), conversion == 'E'),
        'g' | 'G' => general(value, precision.unwrap_or(6).max(1), conversion == 'G', flags.contains('#')),
        _ => return None,
    };
    if value >= 0.0 && flags.contains('+') {
        text.insert(0, '+');
    } else if value >= 0.0 && flags.contains(' ') {
        text.insert(0, ' ');
    }
    let zeros = flags.contains('0') && !flags.contains('-') && value.is_finite();
    Some(padded(text, width, flags.contains('-'), zeros))
}

fn padded(text: String, width: usize, left: bool, zeros: bool) -> String {
    let missing = width.saturating_sub(text.chars().count());
    if zeros {
        let sign = usize::from(text.starts_with(['-', '+', ' ']));
        return format!("{}{}{}", &text[..sign], "0".repeat(missing), &text[sign..]);
    }
    if left { text + &" ".repeat(missing) } else { " ".repeat(missing) + &text }
}

/// `%e`: one digit before the point, at least two in the exponent.
fn exponential(value: f64, precision: usize, upper: bool) -> String {
    if !value.is_finite() {
        return value.to_string();
    }
    let text = format!("{value:.precision$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let (sign, digits) = exponent.strip_prefix('-').map_or(('+', exponent), |digits| ('-', digits));
    format!("{mantissa}{}{sign}{digits:0>2}", if upper { 'E' } else { 'e' })
}

/// `%g`: `digits` that count, without trailing zeros, exponential where the exponent is below -4 or not below `digits`.
fn general(value: f64, digits: usize, upper: bool, keep_zeros: bool) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { value.to_string() };
    }
    let scientific = exponential(value, digits - 1, upper);
    let mark = if upper { 'E' } else { 'e' };
    let (mantissa, exponent) = scientific.split_once(mark).unwrap_or((&scientific, "0"));
    let power: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |text: &str| {
        if keep_zeros || !text.contains('.') {
            text.to_string()
        } else {
            text.trim_end_matches('0').trim_end_matches('.').to_string()
        }
    };
    if power < -4 || power >= digits as i32 {
        return format!("{}{mark}{exponent}", trimmed(mantissa));
    }
    trimmed(&format!("{value:.*}", (digits as i32 - 1 - power).max(0) as usize))
}

/// A number for people: seven significant digits, powers of ten where there would be many zeros.
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{}", value + 0.0);
    }
    let scientific = format!("{value:.6e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let strip = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text.to_string(),
    };
    if (-4..7).contains(&exponent) {
        strip(&format!("{value:.*}", (6 - exponent).max(0) as usize))
    } else {
        format!("{}e{exponent}", strip(mantissa))
    }
}

/// A measured value as far as it is known: to the second digit of its standard error.
pub fn as_known(value: f64, error: f64) -> String {
    if !(error.is_finite() && error > 0.0 && value.is_finite()) {
        return significant(value);
    }
    let exponent = |x: f64| if x == 0.0 { 0 } else { log10(x.abs()).floor() as i32 };
    let last = exponent(error) - 1;
    match exponent(value) {
        plain if (-3..6).contains(&plain) => format!("{value:.*}", usize::try_from(-last).unwrap_or(0)),
        large => format!("{value:.*e}", usize::try_from(large - last).unwrap_or(0)),
    }
}

/// Two different numbers for people: short where that shows the difference, else with all digits.
pub fn told_apart(a: f64, b: f64) -> [String; 2] {
    let short = [significant(a), significant(b)];
    if short[0] != short[1] {
        return short;
    }
    [a, b].map(|value| {
        let text = format!("{value:?}");
        text.strip_suffix(".0").map(str::to_string).unwrap_or(text)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected texts are those of `printf` of the C library.
    #[test]
    fn texts_are_those_of_printf() {
        let table = [
            ("g", 0.1, "0.1"),
            ("g", 1e6, "1e+06"),
            ("g", 123456.0, "123456"),
            ("g", 1e-5, "1e-05"),
            (".3g", 2.0 / 3.0, "0.667"),
            (".3f", 2.0 / 3.0, "0.667"),
            ("8.2f", -1.005, "   -1.00"),
            ("-8.2f", 3.25159, "3.25    "),
            ("08.2f", -3.25159, "-0003.25"),
            (".2e", 12345.678, "1.23e+04"),
            ("+d", 7.0, "+7"),
            ("G", 1e-10, "1E-10"),
        ];
        for (format, value, expected) in table {
            assert_eq!(formatted(format, value).as_deref(), Some(expected), "%{format} of {value}");
        }
        assert_eq!(formatted("x", 1.0), None);
    }

    #[test]
    fn defaults_are_those_of_the_language() {
        let text = |value, kind: &ValueKind| TextFormat::default().text(value, kind);
        assert_eq!(text(2.0 / 3.0, &ValueKind::Real), "0.666667");
        assert_eq!(text(2.0, &ValueKind::Real), "2");
        assert_eq!(text(3.0, &ValueKind::Integer), "3");
        assert_eq!(text(1.0, &ValueKind::Boolean), "true");
        let wide = TextFormat { minimum_length: 5, left_justified: false, ..TextFormat::default() };
        assert_eq!(wide.text(12.0, &ValueKind::Integer), "   12");
    }

    #[test]
    fn numbers_are_short() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-0.00012345678, "-0.0001234568"),
            (1.0e7, "1e7"),
            (1234567.89, "1234568"),
            // Rounding decides the power of ten.
            (9.9999999e-5, "0.0001"),
            (9_999_999.7, "1e7"),
            (-29.27933, "-29.27933"),
            (123_456_789.0, "1.234568e8"),
            (f64::NEG_INFINITY, "-inf"),
            (3.0e-9, "3e-9"),
            (100.0, "100"),
            (f64::NAN, "NaN"),
        ];
        for (value, text) in cases {
            assert_eq!(significant(value), text);
        }
    }

    #[test]
    fn a_measured_value_ends_with_the_second_digit_of_its_error() {
        for (value, error, text) in [
            (0.905_123, 0.0113, "0.905"),
            (3005.2, 9.1, "3005.2"),
            (5.4817e12, 1.1e11, "5.48e12"),
            (4.2e-7, 1.3e-9, "4.200e-7"),
            (0.0, 0.02, "0.000"),
            (2.0, 30.0, "2"),
            (2.5, f64::NAN, "2.5"),
        ] {
            assert_eq!(as_known(value, error), text, "{value} +- {error}");
        }
    }
}

//! Units on axes: a prefix that keeps the numbers between 1 and 1000, and the unit as print shows it.
//!
//! Models state units in Modelica's notation (`m3/s`, `N.m`).  The first factor takes the prefix where that is custom
//! (SI brochure, 9th edition, section 3): `Pa` becomes `MPa`, `m3/s` becomes `cm³/s`.  Units that take none get a power of
//! ten instead when the numbers would be unreadable.

use crate::decimal::{decade, power_of_ten};

/// How values of a unit are shown.
#[derive(Clone, PartialEq, Debug)]
pub struct Scale {
    /// Shown number = value times this factor.
    pub factor: f64,
    /// Unit as printed, with its prefix; may be empty.
    pub unit: String,
}

const PREFIXES: [(&str, i32); 8] = [("", 0), ("m", -3), ("k", 3), ("µ", -6), ("M", 6), ("n", -9), ("G", 9), ("T", 12)];
const PREFIXABLE: [&str; 16] = ["m", "s", "A", "N", "Pa", "V", "W", "J", "Hz", "C", "F", "H", "Wb", "T", "Ohm", "S"];

/// The scale for values of `unit` (Modelica's notation, `""` if unknown) whose largest magnitude is `largest`.
pub fn scale(unit: &str, largest: f64) -> Scale {
    let plain = Scale { factor: 1.0, unit: pretty_unit(unit) };
    if !(largest > 0.0 && largest.is_finite()) || (largest > 0.2 && largest < 1000.0) {
        return plain;
    }
    let best = candidates(unit)
        .into_iter()
        .min_by(|a, b| distance(a.factor * largest).total_cmp(&distance(b.factor * largest)))
        .unwrap_or(plain);
    if (1e-3..1e5).contains(&(best.factor * largest)) { best } else { by_power(&best, largest) }
}

/// The factor between a number and the range 1 to 1000, a little more above it than below; 1 in the range.
fn distance(number: f64) -> f64 {
    number.recip().max(number / 1000.0 * (1.0 + 1e-9)).max(1.0)
}

/// The unit with each prefix that is customary for it, the plain one first.
fn candidates(unit: &str) -> Vec<Scale> {
    let end = unit.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(unit.len());
    let (symbol, rest) = unit.split_at(end);
    let list = |entries: &[(&str, i32)], tail: &str| -> Vec<Scale> {
        entries
            .iter()
            .map(|&(name, exponent)| Scale {
                factor: power_of_ten(exponent),
                unit: pretty_unit(&format!("{name}{tail}")),
            })
            .collect()
    };
    let follows = |text: &str| text.is_empty() || text.starts_with(['/', '.', '*']);
    match (symbol, rest) {
        ("kg", "" | "/s") => list(&[("kg", 0), ("g", 3), ("mg", 6)], rest),
        ("m", _) if rest.starts_with('3') && follows(&rest[1..]) => {
            list(&[("m3", 0), ("L", 3), ("cm3", 6), ("mm3", 9)], &rest[1..])
        }
        ("m", _) if rest.starts_with('2') && follows(&rest[1..]) => {
            list(&[("m2", 0), ("cm2", 4), ("mm2", 6), ("µm2", 12)], &rest[1..])
        }
        ("s", "") => list(&[("s", 0), ("ms", 3), ("µs", 6), ("ns", 9)], ""),
        ("m", "") => list(&[("m", 0), ("mm", 3), ("µm", 6), ("nm", 9), ("km", -3)], ""),
        _ if PREFIXABLE.contains(&symbol) && follows(rest) => PREFIXES
            .iter()
            .map(|&(prefix, exponent)| Scale {
                factor: power_of_ten(-exponent),
                unit: pretty_unit(&format!("{prefix}{symbol}{rest}")),
            })
            .collect(),
        _ => Vec::new(),
    }
}

fn by_power(scale: &Scale, largest: f64) -> Scale {
    let exponent = decade(scale.factor * largest).div_euclid(3) * 3;
    if exponent == 0 || exponent < -300 {
        return scale.clone();
    }
    let factor = scale.factor * power_of_ten(-exponent);
    let unit = if scale.unit.is_empty() { String::new() } else { format!(" {}", scale.unit) };
    Scale { factor, unit: format!("10{}{unit}", superscript(&exponent.to_string())) }
}

/// A unit in Modelica's notation as print shows it: `m3/s` becomes `m³/s`, `N.m` becomes `N·m`, `1` becomes nothing.
pub fn pretty_unit(unit: &str) -> String {
    if unit == "1" {
        return String::new();
    }
    let mut text = String::new();
    let mut symbol = false;
    for (position, c) in unit.char_indices() {
        match c {
            '0'..='9' if symbol => text.push_str(&superscript(&c.to_string())),
            '-' if symbol && unit[position + 1..].starts_with(|c: char| c.is_ascii_digit()) => text.push('⁻'),
            '.' | '*' => text.push('·'),
            _ => text.push(c),
        }
        symbol = c.is_alphabetic() || symbol && (c.is_ascii_digit() || c == '-');
    }
    text.replace("Ohm", "Ω").replace("degC", "°C").replace("deg", "°")
}

fn superscript(digits: &str) -> String {
    const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    digits
        .chars()
        .map(|c| match c.to_digit(10) {
            Some(digit) => SUPERSCRIPTS[digit as usize],
            None => '⁻',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_follow_the_range() {
        let cases: &[(&str, f64, f64, &str)] = &[
            ("Pa", 1.0e7, 1e-6, "MPa"),
            ("Pa", 2.5e5, 1e-3, "kPa"),
            ("m", 1.5e-3, 1e3, "mm"),
            ("m", 20.0, 1.0, "m"),
            ("s", 0.04, 1e3, "ms"),
            ("s", 0.1, 1e3, "ms"),
            ("s", 0.5, 1.0, "s"),
            ("1", 0.15, 1.0, ""),
            ("s", 3600.0, 1.0, "s"),
            ("V", 24.0, 1.0, "V"),
            ("m3/s", 4.2e-4, 1e6, "cm³/s"),
            ("m3/s", 3e-3, 1e3, "L/s"),
            ("m2", 2e-6, 1e6, "mm²"),
            ("kg", 0.05, 1e3, "g"),
            ("kg/m3", 870.0, 1.0, "kg/m³"),
            ("kg/m3", 7.8e6, 1e-6, "10⁶ kg/m³"),
            ("N.m", 4.0e3, 1e-3, "kN·m"),
            ("1", 2e-5, 1e6, "10⁻⁶"),
            ("", 5e6, 1e-6, "10⁶"),
            ("", 0.0, 1.0, ""),
            ("degC", 60.0, 1.0, "°C"),
            ("Ohm", 2.2e4, 1e-3, "kΩ"),
            ("rad/s2", 12.0, 1.0, "rad/s²"),
        ];
        for &(unit, largest, factor, printed) in cases {
            let found = scale(unit, largest);
            assert_eq!(found.unit, printed, "{unit} {largest}");
            assert!((found.factor / factor - 1.0).abs() < 1e-12, "{unit} {largest}: {}", found.factor);
        }
    }

    #[test]
    fn units_are_printed_as_books_do() {
        for (unit, printed) in
            [("m3/(s.Pa)", "m³/(s·Pa)"), ("1/s", "1/s"), ("m.s-2", "m·s⁻²"), ("Pa.s2/m6", "Pa·s²/m⁶")]
        {
            assert_eq!(pretty_unit(unit), printed);
        }
    }
}

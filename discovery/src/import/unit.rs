//! Units as labs write them, and headings with a unit: `p [bar]`, `t (ms)`, `Q / l/min`, `h1/cm`, `p_bar`.
//!
//! A unit is a product and quotient of symbols with prefixes and powers; what it is in SI units is a factor and, for temperatures, an
//! offset.  Exact by the definitions of the SI (BIPM, "The International System of Units", 9th edition, tables 4, 7 and 8).

use hyd_system::math::powi;

/// Symbols: name, SI unit, factor, whether prefixes may stand before it.
const SYMBOLS: [(&str, &str, f64, bool); 45] = [
    ("m", "m", 1.0, true),
    ("s", "s", 1.0, true),
    ("sec", "s", 1.0, true),
    ("min", "s", 60.0, false),
    ("h", "s", 3600.0, false),
    ("kg", "kg", 1.0, false),
    ("A", "A", 1.0, true),
    ("V", "V", 1.0, true),
    ("N", "N", 1.0, true),
    ("Pa", "Pa", 1.0, true),
    ("bar", "Pa", 1e5, true),
    ("barg", "Pa", 1e5, false),
    ("bara", "Pa", 1e5, false),
    ("psi", "Pa", 6_894.757_293_168, false),
    ("atm", "Pa", 101_325.0, false),
    ("Hz", "Hz", 1.0, true),
    ("W", "W", 1.0, true),
    ("J", "J", 1.0, true),
    ("Ohm", "Ohm", 1.0, true),
    ("ohm", "Ohm", 1.0, true),
    ("\u{3a9}", "Ohm", 1.0, true),
    ("\u{2126}", "Ohm", 1.0, true),
    ("K", "K", 1.0, true),
    ("T", "T", 1.0, true),
    ("Wb", "Wb", 1.0, true),
    ("H", "H", 1.0, true),
    ("F", "F", 1.0, true),
    ("l", "m3", 1e-3, true),
    ("L", "m3", 1e-3, true),
    ("ccm", "m3", 1e-6, false),
    ("inch", "m", 0.0254, false),
    ("lpm", "m3/s", 1e-3 / 60.0, false),
    ("rad", "rad", 1.0, true),
    ("deg", "rad", std::f64::consts::PI / 180.0, false),
    ("\u{b0}", "rad", std::f64::consts::PI / 180.0, false),
    ("rpm", "rad/s", std::f64::consts::PI / 30.0, false),
    ("mps", "m/s", 1.0, false),
    ("radps", "rad/s", 1.0, false),
    ("degps", "rad/s", std::f64::consts::PI / 180.0, false),
    ("U", "1", 1.0, false),
    ("1", "1", 1.0, false),
    ("%", "1", 0.01, false),
    ("Nm", "N.m", 1.0, false),
    ("VA", "W", 1.0, false),
    ("Vs", "V.s", 1.0, false),
];
/// Prefixes.
const PREFIXES: [(&str, f64); 9] = [
    ("n", 1e-9),
    ("\u{b5}", 1e-6),
    ("\u{3bc}", 1e-6),
    ("u", 1e-6),
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("k", 1e3),
    ("M", 1e6),
];
/// Temperatures with an offset: name and factor, then offset in K.
const TEMPERATURES: [(&str, f64, f64); 5] = [
    ("\u{b0}C", 1.0, 273.15),
    ("degC", 1.0, 273.15),
    ("deg C", 1.0, 273.15),
    ("\u{b0}F", 5.0 / 9.0, 459.67 * 5.0 / 9.0),
    ("degF", 5.0 / 9.0, 459.67 * 5.0 / 9.0),
];
/// Units that a name may end in after `_`; other short symbols would be found in names that mean something else.
const ENDINGS: [&str; 38] = [
    "s", "ms", "us", "m", "mm", "um", "bar", "mbar", "Pa", "kPa", "MPa", "hPa", "psi", "A", "mA", "V", "mV", "kV", "N",
    "kN", "Hz", "kHz", "degC", "degF", "rpm", "kg", "Nm", "K", "Ohm", "lpm", "W", "cm", "rad", "mrad", "deg", "mps",
    "radps", "degps",
];

/// Symbols of quantities that are those of units, too, and the unit of such a quantity.
const QUANTITIES: [(&str, &str); 4] = [("U", "V"), ("T", "K"), ("F", "N"), ("V", "m3")];

/// A unit in terms of SI units: `SI = scale*value + offset`.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Unit {
    /// The SI unit.
    pub si: String,
    /// Factor.
    pub scale: f64,
    /// Offset, of temperatures.
    pub offset: f64,
}

/// What a unit is in SI units; none where it is not known.
pub(super) fn unit(text: &str) -> Option<Unit> {
    let text = text.trim();
    if let Some((_, scale, offset)) = TEMPERATURES.iter().find(|(name, _, _)| *name == text) {
        return Some(Unit { si: "K".into(), scale: *scale, offset: *offset });
    }
    if matches!(text, "-" | "" | "1" | "bool" | "boolean" | "count" | "counts") {
        return Some(Unit { si: "1".into(), scale: 1.0, offset: 0.0 });
    }
    let mut parts = text.split('/');
    let (above, below) = (parts.next()?, parts.next());
    if parts.next().is_some() {
        return None;
    }
    let (mut si, mut scale) = product(above)?;
    if let Some(below) = below {
        let (other, factor) = product(below.trim_start_matches('(').trim_end_matches(')'))?;
        scale /= factor;
        si = match (si.as_str(), other.as_str()) {
            (own, other) if own == other => "1".to_string(),
            (own, other) if other.contains('.') => format!("{own}/({other})"),
            (own, other) => format!("{own}/{other}"),
        };
    }
    Some(Unit { si, scale, offset: 0.0 })
}

fn product(text: &str) -> Option<(String, f64)> {
    let (mut names, mut scale) = (Vec::new(), 1.0);
    for factor in text.split(['.', '*', '\u{b7}']) {
        let (name, factor) = power(factor.trim())?;
        names.push(name);
        scale *= factor;
    }
    Some((names.join("."), scale))
}

/// A symbol with a power: `mm^2`, `cm3`, `m\u{b2}`.
fn power(text: &str) -> Option<(String, f64)> {
    if let Some(found) = symbol(text) {
        return Some((found.0.to_string(), found.1));
    }
    let last = text.chars().next_back()?;
    let exponent = match last {
        '2' | '\u{b2}' => 2,
        '3' | '\u{b3}' => 3,
        _ => return None,
    };
    let base = text[..text.len() - last.len_utf8()].trim_end_matches('^').trim_end_matches("**");
    let (name, factor) = symbol(base)?;
    let is_simple = name.chars().all(char::is_alphabetic);
    is_simple.then(|| (format!("{name}{exponent}"), powi(factor, exponent)))
}

fn symbol(text: &str) -> Option<(&'static str, f64)> {
    if let Some((_, si, factor, _)) = SYMBOLS.iter().find(|(name, ..)| *name == text) {
        return Some((si, *factor));
    }
    PREFIXES.iter().find_map(|(prefix, by)| {
        let rest = text.strip_prefix(prefix)?;
        let (_, si, factor, _) = SYMBOLS.iter().find(|(name, _, _, prefixed)| *prefixed && *name == rest)?;
        Some((*si, factor * by))
    })
}

/// A heading taken apart: name, and unit where it has one.
pub(super) fn heading(text: &str) -> (String, Option<String>) {
    let text = text.trim();
    if let Some((name, rest)) = text.rsplit_once('[')
        && let Some(own) = rest.strip_suffix(']')
        && !name.trim().is_empty()
    {
        return (name.trim().to_string(), Some(own.trim().to_string()));
    }
    let known = |name: &str, own: &str| {
        let own = own.trim();
        (!name.trim().is_empty() && !own.is_empty() && unit(own).is_some())
            .then(|| (name.trim().to_string(), Some(own.to_string())))
    };
    // A quotient of quantity and unit (ISO 80000-1, 7.1); what is a unit as a whole names nothing, but for symbols of quantities that are
    // symbols of units, too.
    let quotient = || {
        let (name, own) = text.split_once('/').filter(|(name, _)| name.starts_with(char::is_alphabetic))?;
        let is_of_quantity = || {
            let si = unit(own.trim()).map(|own| own.si);
            QUANTITIES.iter().any(|(quantity, of)| *quantity == name.trim() && si.as_deref() == Some(of))
        };
        if unit(text).is_some() && !is_of_quantity() { None } else { known(name, own) }
    };
    // `v/(m/s)` is a quotient, too.
    let in_brackets = text
        .rsplit_once('(')
        .and_then(|(name, rest)| known(name.trim().trim_end_matches('/'), rest.strip_suffix(')')?));
    let after = |mark: &str| text.split_once(mark).and_then(|(name, own)| known(name, own));
    let ending = || {
        let (_, own) = text.rsplit_once('_')?;
        // The name stays whole: `p0_Pa` is a name as good as any.
        ENDINGS.contains(&own).then(|| (text.to_string(), Some(own.to_string())))
    };
    in_brackets
        .or_else(|| after(" / "))
        .or_else(|| after(" in "))
        .or_else(|| after(", "))
        .or_else(quotient)
        .or_else(ending)
        .unwrap_or_else(|| (text.to_string(), None))
}

/// A name for a column of a table: letters, digits, points and underscores.
pub(super) fn clean(name: &str) -> String {
    let mut clean = String::new();
    for c in name.chars() {
        if c.is_alphanumeric() || c == '.' {
            clean.push(c);
        } else if !clean.ends_with('_') && !clean.is_empty() {
            clean.push('_');
        }
    }
    clean.trim_end_matches('_').to_string()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn units_become_si() {
        let cases = [
            ("bar", "Pa", 1e5),
            ("mbar", "Pa", 100.0),
            ("ms", "s", 1e-3),
            ("min", "s", 60.0),
            ("\u{b5}m", "m", 1e-6),
            ("l/min", "m3/s", 1e-3 / 60.0),
            ("mm/s", "m/s", 1e-3),
            ("m/s^2", "m/s2", 1.0),
            ("cm3/s", "m3/s", 1e-6),
            ("mm\u{b2}", "m2", 1e-6),
            ("N.m", "N.m", 1.0),
            ("kN", "N", 1e3),
            ("1/min", "1/s", 1.0 / 60.0),
            ("m/m", "1", 1.0),
            ("%", "1", 0.01),
            ("mps", "m/s", 1.0),
            ("degps", "rad/s", std::f64::consts::PI / 180.0),
        ];
        for (text, si, scale) in cases {
            let found = unit(text).unwrap();
            assert_eq!(found.si, si, "{text}");
            assert!((found.scale / scale - 1.0).abs() < 1e-12 && found.offset == 0.0, "{text}: {found:?}");
        }
        let warm = unit("\u{b0}F").unwrap();
        assert!((warm.scale * 212.0 + warm.offset - 373.15).abs() < 1e-9, "{warm:?}");
        assert_eq!([unit("furlong"), unit("a/b/c"), unit("mmm")], [None, None, None]);
    }

    #[test]
    fn headings_are_taken_apart() {
        let cases = [
            ("p [bar]", "p", Some("bar")),
            ("t (ms)", "t", Some("ms")),
            ("speed (left)", "speed (left)", None),
            ("Q / l/min", "Q", Some("l/min")),
            ("Weg in mm", "Weg", Some("mm")),
            ("h1/cm", "h1", Some("cm")),
            ("v/(m/s)", "v", Some("m/s")),
            ("U/mV", "U", Some("mV")),
            ("T/\u{b0}C", "T", Some("\u{b0}C")),
            ("m/s", "m/s", None),
            ("p1/p2", "p1/p2", None),
            ("p0_bar", "p0_bar", Some("bar")),
            ("theta_rad", "theta_rad", Some("rad")),
            ("omega_degps", "omega_degps", Some("degps")),
            ("k_x", "k_x", None),
            ("x [furlong]", "x", Some("furlong")),
        ];
        for (text, name, own) in cases {
            assert_eq!(heading(text), (name.to_string(), own.map(String::from)), "{text}");
        }
        assert_eq!([clean("Druck 1 (A)"), clean("  µ-x"), clean("***")], ["Druck_1_A", "µ_x", ""]);
    }
}

//! Units of coefficients: the unit of an equation over a power of that of a variable, as Modelica writes units.
//!
//! Grammar: Modelica specification 3.6, chapter 19 (`kg.m2/(s2.A)`); a numerator and at most one denominator, integer exponents.

/// A symbol and its exponent.
type Factor = (String, i32);

/// `own/unit^(power.0/power.1)`; none where one of them is unknown or is not a unit, or where an exponent would not be an integer.
pub(crate) fn quotient(own: &str, unit: &str, power: (i32, i32)) -> Option<String> {
    if unit.is_empty() {
        return None;
    }
    let mut factors = factors(own)?;
    for (symbol, exponent) in self::factors(unit)? {
        let taken = exponent * power.0;
        if taken % power.1 != 0 {
            return None;
        }
        match factors.iter_mut().find(|(known, _)| *known == symbol) {
            Some((_, known)) => *known -= taken / power.1,
            None => factors.push((symbol, -taken / power.1)),
        }
    }
    Some(written(&factors))
}

/// The factors of a unit; `1` has none.
fn factors(unit: &str) -> Option<Vec<Factor>> {
    let (above, below) = unit.split_once('/').map_or((unit, ""), |(above, below)| (above, below));
    let below = below.strip_prefix('(').and_then(|own| own.strip_suffix(')')).unwrap_or(below);
    let mut found: Vec<Factor> = Vec::new();
    for (text, sign) in [(above, 1), (below, -1)] {
        for one in text.split('.').filter(|one| !one.is_empty() && *one != "1") {
            let end = one.find(|c: char| c.is_ascii_digit() || c == '-' || c == '+').unwrap_or(one.len());
            let (symbol, exponent) = one.split_at(end);
            let is_symbol = !symbol.is_empty() && symbol.chars().all(|c| c.is_alphabetic() || "%'\"".contains(c));
            let exponent: i32 = if exponent.is_empty() { 1 } else { exponent.parse().ok()? };
            if !is_symbol {
                return None;
            }
            match found.iter_mut().find(|(known, _)| known == symbol) {
                Some((_, known)) => *known += sign * exponent,
                None => found.push((symbol.to_string(), sign * exponent)),
            }
        }
    }
    Some(found)
}

fn written(factors: &[Factor]) -> String {
    let of = |sign: i32| -> Vec<String> {
        let own = factors.iter().filter(|(_, exponent)| exponent * sign > 0);
        own.map(|(symbol, exponent)| match exponent * sign {
            1 => symbol.clone(),
            power => format!("{symbol}{power}"),
        })
        .collect()
    };
    let (above, below) = (of(1), of(-1));
    let above = if above.is_empty() { "1".to_string() } else { above.join(".") };
    match &below[..] {
        [] => above,
        [one] => format!("{above}/{one}"),
        several => format!("{above}/({})", several.join(".")),
    }
}

#[cfg(test)]
mod tests {
    use super::quotient;

    #[test]
    fn coefficients_have_units_that_can_be_written() {
        for (own, unit, power, expected) in [
            ("Pa", "m3/s", (2, 1), Some("Pa.s2/m6")),
            ("N", "m/s", (1, 1), Some("N.s/m")),
            ("m2", "m2", (2, 1), Some("1/m2")),
            ("V", "1", (3, 1), Some("V")),
            ("kg.m/s2", "m/(s.A)", (1, 1), Some("kg.A/s")),
            ("m3/s", "Pa", (1, 2), None),
            ("m", "Pa2", (1, 2), Some("m/Pa")),
            ("N.m", "rad/s", (1, 1), Some("N.m.s/rad")),
            ("N", "", (1, 1), None),
            ("N", "2", (1, 1), None),
        ] {
            assert_eq!(quotient(own, unit, power).as_deref(), expected, "{own} over {unit}");
        }
    }
}

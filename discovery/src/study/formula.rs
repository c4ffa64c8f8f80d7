//! Sums and products of the conditions of a shot, such as `trigger_time_s + pulse_s`.
//!
//! Recursive descent over `+ - * /`, signs, parentheses, numbers and names; a name is a condition that the set records.
//! A formula that is a number may be written as one.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};

use crate::Fault;

/// Signs and parentheses inside each other, each of which is a call inside a call.
const DEEPEST: usize = 64;

/// The value of a formula; `value_of` gives the value of a name.
pub(crate) fn evaluate(text: &str, value_of: &dyn Fn(&str) -> Option<f64>) -> Result<f64, Fault> {
    let mut reader = Reader { text, rest: text, value_of, depth: 0 };
    let value = reader.sum()?;
    match reader.rest.trim_start() {
        "" if value.is_finite() => Ok(value),
        "" => Err(reader.wrong(&format!("its value is {value}"))),
        rest => Err(reader.wrong(&format!("`{rest}` does not belong here"))),
    }
}

/// The names that stand in a formula.
pub(crate) fn names(text: &str) -> Vec<String> {
    let found = std::cell::RefCell::new(Vec::new());
    let known = evaluate(text, &|name| {
        found.borrow_mut().push(name.to_string());
        Some(1.0)
    });
    // What cannot be read says so when it is evaluated.
    if known.is_ok() { found.into_inner() } else { Vec::new() }
}

/// The text of a formula that a study writes as a text or as a number.
pub(crate) struct Written(pub String);

impl<'de> Deserialize<'de> for Written {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Either).map(Self)
    }
}

struct Either;

impl Visitor<'_> for Either {
    type Value = String;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a formula as text, or a number")
    }

    fn visit_str<E: Error>(self, formula: &str) -> Result<String, E> {
        Ok(formula.to_string())
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<String, E> {
        Ok(format!("{number:e}"))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<String, E> {
        Ok(number.to_string())
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<String, E> {
        Ok(number.to_string())
    }
}

/// A formula, where there is one.
pub(crate) fn written<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    Written::deserialize(deserializer).map(|formula| Some(formula.0))
}

/// Formulas by names.
pub(crate) fn all_written<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, String>, D::Error> {
    let all = BTreeMap::<String, Written>::deserialize(deserializer)?;
    Ok(all.into_iter().map(|(name, formula)| (name, formula.0)).collect())
}

struct Reader<'a> {
    text: &'a str,
    rest: &'a str,
    value_of: &'a dyn Fn(&str) -> Option<f64>,
    depth: usize,
}

impl Reader<'_> {
    fn wrong(&self, why: &str) -> Fault {
        Fault::new(format!("the formula `{}` cannot be evaluated: {why}", self.text))
    }

    fn accept(&mut self, symbols: &[char]) -> Option<char> {
        let rest = self.rest.trim_start();
        let found = rest.chars().next().filter(|c| symbols.contains(c))?;
        self.rest = &rest[found.len_utf8()..];
        Some(found)
    }

    fn sum(&mut self) -> Result<f64, Fault> {
        let mut value = self.product()?;
        while let Some(sign) = self.accept(&['+', '-']) {
            let next = self.product()?;
            value = if sign == '+' { value + next } else { value - next };
        }
        Ok(value)
    }

    fn product(&mut self) -> Result<f64, Fault> {
        let mut value = self.factor()?;
        while let Some(sign) = self.accept(&['*', '/']) {
            let next = self.factor()?;
            value = if sign == '*' { value * next } else { value / next };
        }
        Ok(value)
    }

    /// What stands behind a sign or within parentheses.
    fn inside(&mut self, part: fn(&mut Self) -> Result<f64, Fault>) -> Result<f64, Fault> {
        if self.depth == DEEPEST {
            // The formula itself may be as long as it is deep.
            let start: String = self.text.chars().take(DEEPEST).collect();
            return Err(Fault::new(format!(
                "the formula `{start}...` nests signs and parentheses deeper than {DEEPEST} levels"
            )));
        }
        self.depth += 1;
        let value = part(self)?;
        self.depth -= 1;
        Ok(value)
    }

    fn factor(&mut self) -> Result<f64, Fault> {
        if self.accept(&['-']).is_some() {
            return Ok(-self.inside(Self::factor)?);
        }
        if self.accept(&['(']).is_some() {
            let value = self.inside(Self::sum)?;
            return self.accept(&[')']).map(|_| value).ok_or_else(|| self.wrong("a `)` is missing"));
        }
        self.rest = self.rest.trim_start();
        let length =
            self.rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.')).unwrap_or(self.rest.len());
        let mut word = &self.rest[..length];
        if word.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            // An exponent may carry a sign.
            let longer = self.rest.len().min(length + 1);
            if word.ends_with(['e', 'E']) && self.rest[length..].starts_with(['+', '-']) {
                let digits =
                    self.rest[longer..].find(|c: char| !c.is_ascii_digit()).unwrap_or(self.rest.len() - longer);
                word = &self.rest[..longer + digits];
            }
            self.rest = &self.rest[word.len()..];
            return word.parse().map_err(|_| self.wrong(&format!("`{word}` is not a number")));
        }
        if word.is_empty() {
            return Err(self.wrong("a number or the name of a condition is missing"));
        }
        self.rest = &self.rest[word.len()..];
        (self.value_of)(word).ok_or_else(|| self.wrong(&format!("the shots record no condition `{word}`")))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::evaluate;

    fn value(text: &str) -> Result<f64, crate::Fault> {
        evaluate(text, &|name| match name {
            "a" => Some(2.0),
            "b_s" => Some(0.25),
            _ => None,
        })
    }

    #[test]
    fn sums_and_products() {
        assert_eq!(value("a + b_s").unwrap(), 2.25);
        assert_eq!(value("-(a - 1e-1*b_s)/2").unwrap(), -0.9875);
        assert_eq!(value("1.5E+2 * b_s").unwrap(), 37.5);
    }

    #[test]
    fn faults_name_the_culprit() {
        for (text, part) in
            [("a + c", "`c`"), ("a b_s", "`b_s`"), ("(a", "`)`"), ("a +", "missing"), ("1.2.3", "1.2.3")]
        {
            let fault = value(text).unwrap_err();
            assert!(fault.sentence.contains(part) && fault.sentence.contains(text), "{fault}");
        }
    }

    #[test]
    fn depth_has_a_limit() {
        let nested = |open: &str, close: &str, n: usize| value(&format!("{}a{}", open.repeat(n), close.repeat(n)));
        assert_eq!(nested("(", ")", 64).unwrap(), 2.0);
        assert_eq!(nested("-", "", 63).unwrap(), -2.0);
        // Parentheses and signs beside each other are not inside each other.
        assert_eq!(value(&vec!["(-a)"; 1000].join("+")).unwrap(), -2000.0);
        for (open, close, n) in [("(", ")", 65), ("(", ")", 50_000), ("-", "", 300_000), ("-(", ")", 33)] {
            let fault = nested(open, close, n).unwrap_err();
            assert!(fault.sentence.contains("64 levels") && fault.sentence.len() < 200, "{fault}");
        }
    }
}

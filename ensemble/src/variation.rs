//! What one parameter does over an ensemble, from a short text.
//!
//! `1:3:50` (from, to, count), `log:1e-3:1:20` (equal ratios), `1,2,5` or `slow,fast` (a list, read by the type of the parameter),
//! `uniform(1, 3)`, `loguniform(1e-3, 1)`, `normal(mean, deviation)`, `lognormal(median, deviation of the logarithm)`, `triangular(low, mode, high)`; `1:3` without a count
//! is `uniform(1, 3)`.

use std::fmt;

use hyd_system::{ValueKind, given};

use crate::normal::normal_quantile;
use hyd_system::math::{exp, ln};

/// Most values that one text may stand for.
const MOST: usize = 10_000_000;

/// Values of one parameter.
#[derive(Clone, PartialEq, Debug)]
pub enum Variation {
    /// Every one of these, crossed with the values of other parameters.
    Values(Vec<f64>),
    /// The same as literals, which mean nothing before the type of the parameter is known.
    Literals(Vec<String>),
    /// Between two numbers, all alike.
    Uniform(f64, f64),
    /// Between two positive numbers, the logarithm all alike.
    LogUniform(f64, f64),
    /// Mean and standard deviation.
    Normal(f64, f64),
    /// Median and standard deviation of the natural logarithm.
    LogNormal(f64, f64),
    /// Lowest, most frequent, highest.
    Triangular(f64, f64, f64),
}

/// A text that is not a variation: what is wrong with it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct VariationError(pub String);

impl fmt::Display for VariationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}; expected FROM:TO:COUNT, log:FROM:TO:COUNT, A,B,C, uniform(a, b), loguniform(a, b), normal(mean, \
             deviation), lognormal(median, deviation) or triangular(low, mode, high)",
            self.0
        )
    }
}

impl Variation {
    /// Reads a text.
    pub fn parse(text: &str) -> Result<Self, VariationError> {
        let text = text.trim();
        if let Some((name, rest)) = text.split_once('(') {
            let inner = rest.strip_suffix(')').ok_or_else(|| VariationError(format!("`{text}` has no closing `)`")))?;
            return distribution(name.trim(), &numbers(inner, ',')?);
        }
        if let Some(range) = text.strip_prefix("log:") {
            let (from, to, count) = range_of(range)?;
            if !(from > 0.0 && to > 0.0) {
                return Err(VariationError(format!("`{text}`: equal ratios need positive ends")));
            }
            let ratio = |power: f64| exp(ln(from) + (ln(to) - ln(from)) * power);
            let mut values: Vec<f64> = spaced(0.0, 1.0, count).map(ratio).collect();
            // The ends are what was asked for, to the last bit.
            values[0] = from;
            if count > 1 {
                values[count - 1] = to;
            }
            return Ok(Variation::Values(values));
        }
        if text.matches(':').count() == 1 {
            let ends = numbers(text, ':')?;
            return distribution("uniform", &ends);
        }
        if text.contains(':') {
            let (from, to, count) = range_of(text)?;
            return Ok(Variation::Values(spaced(from, to, count).collect()));
        }
        let literals: Vec<String> = text.split(',').map(|literal| literal.trim().to_string()).collect();
        if literals.iter().any(String::is_empty) {
            return Err(VariationError(format!("a value is missing in `{text}`")));
        }
        Ok(Variation::Literals(literals))
    }

    /// The same for a parameter of this type: literals become numbers.
    ///
    /// # Errors
    /// A sentence: no value of this type, or no list where the type has no values between.
    pub fn for_kind(&self, kind: &ValueKind) -> Result<Self, String> {
        match (self, kind) {
            (Variation::Literals(literals), _) => {
                literals.iter().map(|literal| value(kind, literal)).collect::<Result<_, _>>().map(Variation::Values)
            }
            (other, ValueKind::Real | ValueKind::Integer) => Ok(other.clone()),
            (_, ValueKind::Boolean) => {
                Err("a Boolean takes neither grid nor distribution; list: true,false".to_string())
            }
            (_, ValueKind::Enumeration(names)) => {
                Err(format!("an enumeration takes neither grid nor distribution; list: {}", names.join(",")))
            }
        }
    }

    /// How many values are listed; none where they are drawn.
    pub(crate) fn listed(&self) -> Option<usize> {
        match self {
            Variation::Values(values) => Some(values.len()),
            Variation::Literals(literals) => Some(literals.len()),
            _ => None,
        }
    }

    /// True if values are drawn rather than listed.
    pub fn is_drawn(&self) -> bool {
        self.listed().is_none()
    }

    /// The value that a draw is below with probability `p`, 0 < p < 1; listed values are taken as equally likely,
    /// literals are not numbers.
    pub fn quantile(&self, p: f64) -> f64 {
        match *self {
            Variation::Values(ref values) => values[((p * values.len() as f64) as usize).min(values.len() - 1)],
            Variation::Literals(_) => f64::NAN,
            Variation::Uniform(a, b) => a + (b - a) * p,
            Variation::LogUniform(a, b) => exp(ln(a) + (ln(b) - ln(a)) * p),
            Variation::Normal(mean, deviation) => mean + deviation * normal_quantile(p),
            Variation::LogNormal(median, deviation) => median * exp(deviation * normal_quantile(p)),
            Variation::Triangular(a, mode, b) => {
                let split = (mode - a) / (b - a);
                if p < split {
                    a + ((b - a) * (mode - a) * p).sqrt()
                } else {
                    b - ((b - a) * (b - mode) * (1.0 - p)).sqrt()
                }
            }
        }
    }
}

/// `count` numbers at equal distances, both ends included exactly.
fn spaced(from: f64, to: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| match k {
        0 => from,
        _ if k + 1 == count => to,
        _ => from + (to - from) * k as f64 / (count - 1) as f64,
    })
}

/// A literal as it is stored in a run.
fn value(kind: &ValueKind, literal: &str) -> Result<f64, String> {
    given::number(kind, literal).or_else(|why| {
        // Results hold the positions of literals, and integers of any form: what was read there may be written here.
        let whole = literal.parse::<f64>().ok().filter(|number| number.fract() == 0.0 && *kind != ValueKind::Real);
        whole.ok_or_else(|| format!("`{literal}`: {why}"))
    })
}

fn numbers(text: &str, separator: char) -> Result<Vec<f64>, VariationError> {
    let number = |part: &str| {
        let value = part.trim().parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| VariationError(format!("`{}` is not a finite number", part.trim())))
    };
    text.split(separator).map(number).collect()
}

fn range_of(text: &str) -> Result<(f64, f64, usize), VariationError> {
    let parts: Vec<&str> = text.split(':').collect();
    let [from, to, count] = parts[..] else {
        return Err(VariationError(format!("`{text}` has {} parts instead of 3", parts.len())));
    };
    let ends = numbers(&format!("{from}:{to}"), ':')?;
    let count = count.trim().parse::<usize>().ok().filter(|&count| (1..=MOST).contains(&count));
    let count =
        count.ok_or_else(|| VariationError(format!("the count in `{text}` is not a number from 1 to {MOST}")))?;
    if count == 1 && ends[0] != ends[1] {
        return Err(VariationError(format!("`{text}` asks for one value at two places")));
    }
    Ok((ends[0], ends[1], count))
}

fn distribution(name: &str, values: &[f64]) -> Result<Variation, VariationError> {
    let wrong = |why: &str| Err(VariationError(format!("{name}: {why}")));
    match (name, values) {
        ("uniform", &[a, b]) if a < b => Ok(Variation::Uniform(a, b)),
        ("uniform", &[_, _]) => wrong("the ends must ascend"),
        ("loguniform", &[a, b]) if 0.0 < a && a < b => Ok(Variation::LogUniform(a, b)),
        ("loguniform", &[_, _]) => wrong("the ends must be positive and ascend"),
        ("normal", &[mean, deviation]) if deviation > 0.0 => Ok(Variation::Normal(mean, deviation)),
        ("lognormal", &[median, deviation]) if median > 0.0 && deviation > 0.0 => {
            Ok(Variation::LogNormal(median, deviation))
        }
        ("normal" | "lognormal", &[_, _]) => wrong("the deviation (and a median) must be positive"),
        ("triangular", &[a, mode, b]) if a <= mode && mode <= b && a < b => Ok(Variation::Triangular(a, mode, b)),
        ("triangular", &[_, _, _]) => wrong("the three values must ascend"),
        ("uniform" | "loguniform" | "normal" | "lognormal" | "triangular", _) => wrong("another number of values"),
        _ => Err(VariationError(format!("`{name}` is not a distribution"))),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<f64> {
        match Variation::parse(text).unwrap().for_kind(&ValueKind::Real).unwrap() {
            Variation::Values(values) => values,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn ranges_and_lists() {
        assert_eq!(values("1:3:5"), [1.0, 1.5, 2.0, 2.5, 3.0]);
        assert_eq!(values("3:1:2"), [3.0, 1.0]);
        assert_eq!(values("7"), [7.0]);
        assert_eq!(values("1, 2,5e-1"), [1.0, 2.0, 0.5]);
        let log = values("log:1e-3:1:4");
        assert_eq!((log[0], log[3]), (1e-3, 1.0));
        for (value, expected) in log.iter().zip([1e-3, 1e-2, 1e-1, 1.0]) {
            assert!((value / expected - 1.0).abs() < 1e-14, "{log:?}");
        }
        assert_eq!(Variation::parse("1:3").unwrap(), Variation::Uniform(1.0, 3.0));
    }

    #[test]
    fn lists_are_read_by_the_type_of_the_parameter() {
        let mode = &ValueKind::Enumeration(["slow".into(), "fast".into()].into());
        let read = |kind: &ValueKind, text: &str| Variation::parse(text).unwrap().for_kind(kind);
        let listed = |values: &[f64]| Ok(Variation::Values(values.to_vec()));
        assert_eq!(read(mode, "fast, Mode.slow,2"), listed(&[2.0, 1.0, 2.0]));
        assert_eq!(read(&ValueKind::Boolean, "true,false,1"), listed(&[1.0, 0.0, 1.0]));
        assert_eq!(read(&ValueKind::Integer, "7,1e3"), listed(&[7.0, 1000.0]));
        assert_eq!(read(&ValueKind::Integer, "1:3:3"), listed(&[1.0, 2.0, 3.0]));
        let refused = [
            (mode, "warm", "`warm`: it is one of slow, fast"),
            (mode, "1.5", "`1.5`: it is one of slow, fast"),
            (mode, "1:2:2", "an enumeration takes neither grid nor distribution; list: slow,fast"),
            (mode, "uniform(1, 2)", "an enumeration takes neither grid nor distribution; list: slow,fast"),
            (&ValueKind::Boolean, "0:1:2", "a Boolean takes neither grid nor distribution; list: true,false"),
            (&ValueKind::Integer, "1.5", "`1.5`: it is an Integer and needs an integer value"),
            (&ValueKind::Real, "1,a", "`a`: it is a Real and needs a finite number"),
            (&ValueKind::Real, "inf", "`inf`: it is a Real and needs a finite number"),
        ];
        for (kind, text, reason) in refused {
            assert_eq!(read(kind, text), Err(reason.to_string()), "{text}");
        }
    }

    #[test]
    fn quantiles_in_closed_form() {
        let at = |text: &str, p: f64| Variation::parse(text).unwrap().quantile(p);
        assert_eq!(at("uniform(1, 3)", 0.25), 1.5);
        assert!((at("loguniform(1e-2, 1)", 0.5) - 0.1).abs() < 1e-15);
        assert!((at("normal(10, 2)", 0.975) - 13.919_927_969_080_108).abs() < 1e-12);
        assert!((at("lognormal(5, 1)", 0.5) - 5.0).abs() < 1e-15);
        // Half of a symmetric triangle lies below its mode; an eighth below a quarter of the way.
        assert!((at("triangular(0, 1, 2)", 0.5) - 1.0).abs() < 1e-15);
        assert!((at("triangular(0, 1, 2)", 0.125) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let wrong = |text: &str| Variation::parse(text).unwrap_err().0;
        assert_eq!(wrong("a:2"), "`a` is not a finite number");
        assert_eq!(wrong("1,,2"), "a value is missing in `1,,2`");
        assert_eq!(wrong("1:2:3:4"), "`1:2:3:4` has 4 parts instead of 3");
        assert_eq!(wrong("1:2:0"), "the count in `1:2:0` is not a number from 1 to 10000000");
        assert_eq!(wrong("log:0:1:3"), "`log:0:1:3`: equal ratios need positive ends");
        assert_eq!(wrong("normal(1, -1)"), "normal: the deviation (and a median) must be positive");
        assert_eq!(wrong("cauchy(0, 1)"), "`cauchy` is not a distribution");
        assert_eq!(wrong("uniform(1, 2"), "`uniform(1, 2` has no closing `)`");
    }
}

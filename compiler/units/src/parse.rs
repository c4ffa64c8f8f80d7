//! Unit strings to units: `kg.m/s2`, `m3/(s.Pa)`, `1/min`.
//!
//! Recursive descent over the grammar of the Modelica language specification 3.6, section 19.1: factors joined by `.`, at
//! most one `/` per level, exponents directly behind the symbol, a symbol tried first as it stands and then with a
//! prefix.  Beyond the specification an exponent may be a fraction in parentheses, `m(1/2)`, so that every unit can be
//! written down.  Anything else is an error that says what to write instead where that can be guessed.

use hyd_source::did_you_mean;

use crate::rational::Rational;
use crate::symbols::{NAMES, PREFIXES, SYMBOLS};
use crate::unit::{Dimension, Unit};

/// Longest unit string read.
const LONGEST: usize = 200;
/// Deepest nesting of parentheses.
const DEEPEST: usize = 16;

/// Why a string is not a unit.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct UnitError {
    /// What is wrong, as the end of a sentence that began with the string.
    pub reason: String,
    /// What to write instead, if that can be guessed.
    pub help: Option<String>,
    /// The whole string with another symbol in the place of one that does not exist, if that makes a unit of it.
    pub meant: Option<String>,
}

/// Reads a unit string.
///
/// # Errors
/// The reason and, where possible, a suggestion.
///
/// ```
/// let unit = hyd_units::parse_unit("kg.m/s2").expect("a unit");
/// assert_eq!(unit, hyd_units::parse_unit("N").expect("a unit"));
/// assert_eq!(hyd_units::parse_unit("Pascal").expect_err("a name").help.as_deref(), Some("did you mean `Pa`?"));
/// ```
pub fn parse_unit(text: &str) -> Result<Unit, UnitError> {
    if text.len() > LONGEST {
        return Err(error(format!("is longer than {LONGEST} characters")));
    }
    let mut parser = Parser { text, at: 0, depth: 0, angles: false };
    if let Some(unit) = parser.lone_symbol() {
        return Ok(unit);
    }
    let unit = parser.expression()?;
    match parser.peek() {
        None => Ok(unit),
        Some(c) => Err(parser.unexpected(c)),
    }
}

/// The exponent of the plane angle in a unit, which [`parse_unit`] counts as a number: 1 for `deg/s` and `rpm`, -1 for `N.m/rad`.
/// None where the string is not a unit, or the exponent is not whole.
pub fn plane_angle(text: &str) -> Option<i32> {
    parse_unit(text).ok()?;
    let mut parser = Parser { text, at: 0, depth: 0, angles: true };
    let [.., power] = parser.expression().ok()?.dimension.0;
    power.as_whole()
}

fn error(reason: impl Into<String>) -> UnitError {
    UnitError { reason: reason.into(), help: None, meant: None }
}

fn help(reason: impl Into<String>, help: impl Into<String>) -> UnitError {
    UnitError { reason: reason.into(), help: Some(help.into()), meant: None }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    /// Angles alone are counted, in the place of the last base unit.
    angles: bool,
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        if found {
            self.at += wanted.len_utf8();
        }
        found
    }

    fn take_while(&mut self, fits: impl Fn(char) -> bool) -> &'a str {
        let rest = &self.text[self.at..];
        let end = rest.find(|c| !fits(c)).unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }

    /// A symbol that is the whole string: only then an offset has a meaning.
    fn lone_symbol(&self) -> Option<Unit> {
        SYMBOLS.iter().find(|s| s.text == self.text).map(|s| s.unit())
    }

    fn unexpected(&self, c: char) -> UnitError {
        match c {
            '/' => help("has more than one `/` in a row", "put the denominator in parentheses: `J/(kg.K)`"),
            '*' | '\u{b7}' => help(format!("contains `{c}`"), "factors are joined by `.`: `N.m`"),
            '^' => help("contains `^`", "exponents stand directly behind the symbol: `m2`, `s-1`"),
            ' ' => help("contains a space", "factors are joined by `.`: `N.m`"),
            ')' => error("has a `)` without `(`"),
            '(' => help("has a `(` where none can stand", "factors are joined by `.`: `N.m`"),
            _ => error(format!("contains `{c}` where none can stand")),
        }
    }

    /// `factors`, `factors/factor`, `factors/(expression)`.
    fn expression(&mut self) -> Result<Unit, UnitError> {
        let numerator = self.factors()?;
        if !self.take('/') {
            return Ok(numerator);
        }
        let denominator = if self.peek() == Some('(') { self.parenthesised()? } else { self.factor()? };
        if self.peek() == Some('.') {
            return Err(help(
                "has a `.` behind the denominator, which can be read in two ways",
                "put several factors of the denominator in parentheses: `J/(kg.K)`",
            ));
        }
        product(&numerator, &denominator, -1)
    }

    fn factors(&mut self) -> Result<Unit, UnitError> {
        let mut unit = if self.peek() == Some('(') { self.parenthesised()? } else { self.factor()? };
        while self.take('.') {
            let factor = self.factor()?;
            unit = product(&unit, &factor, 1)?;
        }
        Ok(unit)
    }

    fn parenthesised(&mut self) -> Result<Unit, UnitError> {
        self.at += 1;
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(error(format!("nests deeper than {DEEPEST} levels")));
        }
        let unit = self.expression()?;
        self.depth -= 1;
        match self.peek() {
            Some(')') => {
                self.at += 1;
                Ok(unit)
            }
            Some(c) => Err(self.unexpected(c)),
            None => Err(error("has a `(` without `)`")),
        }
    }

    /// A symbol with its exponent, or `1`.
    fn factor(&mut self) -> Result<Unit, UnitError> {
        let symbol = self.take_while(|c| c.is_alphabetic() || "%\u{b0}\u{b5}'".contains(c));
        if symbol.is_empty() {
            return match self.peek() {
                Some('0'..='9') => self.number(),
                Some(c) => Err(self.unexpected(c)),
                None if self.text.is_empty() => Err(error("is empty")),
                None => Err(error("ends where a symbol should stand")),
            };
        }
        let unit = lookup(symbol).map_err(|error| self.with_meant(symbol, error))?;
        let unit = if self.angles { angle(symbol) } else { unit };
        let exponent = self.exponent()?;
        Unit::ONE.times(&unit, exponent).ok_or_else(too_large)
    }

    /// Adds the string that may be meant where the last symbol is not one.
    fn with_meant(&self, symbol: &str, error: UnitError) -> UnitError {
        let named = error.help.as_deref().and_then(|help| help.strip_prefix("did you mean `")?.split('`').next());
        let meant = named.map(|named| {
            let (before, behind) = (&self.text[..self.at - symbol.len()], &self.text[self.at..]);
            format!("{before}{named}{behind}")
        });
        // What is wrong elsewhere, too, is not made a unit by one symbol, and has its own message then.
        UnitError { meant: meant.filter(|meant| parse_unit(meant).is_ok()), ..error }
    }

    fn number(&mut self) -> Result<Unit, UnitError> {
        match self.take_while(|c| c.is_ascii_digit() || c == '.') {
            "1" => Ok(Unit::ONE),
            "1." => {
                self.at -= 1;
                Ok(Unit::ONE)
            }
            number => Err(help(
                format!("contains the number {number}"),
                "the only number in a unit is 1; use a prefix, such as `mm` or `kPa`",
            )),
        }
    }

    fn exponent(&mut self) -> Result<Rational, UnitError> {
        let fraction = self.text[self.at..].starts_with('(');
        if fraction {
            self.at += 1;
        }
        let negative = self.take('-');
        if !negative {
            self.take('+');
        }
        let digits = self.take_while(|c| c.is_ascii_digit());
        if digits.is_empty() && (negative || fraction) {
            return Err(error("has an exponent without digits"));
        }
        let whole = |digits: &str| -> Result<i64, UnitError> {
            digits.parse::<i64>().ok().filter(|n| *n < 1000).ok_or_else(too_large)
        };
        let numerator = if digits.is_empty() { 1 } else { whole(digits)? };
        let mut denominator = 1;
        if fraction {
            if self.take('/') {
                denominator = whole(self.take_while(|c| c.is_ascii_digit()))?;
            }
            if !self.take(')') {
                return Err(error("has a fraction as exponent that does not end with `)`"));
            }
        }
        let signed = if negative { -numerator } else { numerator };
        Rational::new(signed, denominator).ok_or_else(too_large)
    }
}

fn too_large() -> UnitError {
    error("has an exponent or a factor out of range")
}

fn product(a: &Unit, b: &Unit, exponent: i32) -> Result<Unit, UnitError> {
    a.times(b, Rational::whole(exponent)).ok_or_else(too_large)
}

/// A symbol as it stands, else with a prefix.
fn lookup(text: &str) -> Result<Unit, UnitError> {
    if let Some(symbol) = SYMBOLS.iter().find(|s| s.text == text) {
        return Ok(symbol.unit());
    }
    for &(prefix, power) in PREFIXES {
        let Some(rest) = text.strip_prefix(prefix) else { continue };
        if let Some(symbol) = SYMBOLS.iter().find(|s| s.prefixes && s.text == rest) {
            let unit = symbol.unit();
            return Ok(Unit { factor: power_of_ten(power, unit.factor), ..unit });
        }
    }
    Err(UnitError {
        reason: format!("has the symbol `{text}`, which is not a unit"),
        help: suggestion(text),
        meant: None,
    })
}

/// A unit with the last dimension for a symbol of a plane angle, the number one for all others.
fn angle(symbol: &str) -> Unit {
    let prefixed = || PREFIXES.iter().any(|(prefix, _)| symbol.strip_prefix(prefix) == Some("rad"));
    let is_angle = ["rad", "deg", "rev", "rpm"].contains(&symbol) || prefixed();
    Unit { dimension: Dimension::whole([0, 0, 0, 0, 0, 0, i32::from(is_angle)]), ..Unit::ONE }
}

/// `factor * 10^power` without the rounding of a power computed as such: kg is exactly 1.
fn power_of_ten(power: i32, factor: f64) -> f64 {
    if power >= 0 {
        let scale: f64 = (0..power).map(|_| 10.0).product();
        if factor == 1e-3 && power >= 3 { scale / 1000.0 } else { factor * scale }
    } else {
        let scale: f64 = (0..-power).map(|_| 10.0).product();
        factor / scale
    }
}

/// What the symbol may have been meant to be.
fn suggestion(text: &str) -> Option<String> {
    let lower = text.to_lowercase();
    let singular = lower.strip_suffix('s').unwrap_or(&lower);
    if let Some((_, help)) = NAMES.iter().find(|(name, _)| *name == lower || *name == singular) {
        return Some((*help).to_string());
    }
    if let Some(rest) = text.strip_prefix(['\u{b5}', '\u{3bc}'])
        && lookup(&format!("u{rest}")).is_ok()
    {
        return Some(format!("did you mean `u{rest}`? The letter u stands for micro"));
    }
    // Two symbols written without the point between them, such as `Nm`.
    for (split, _) in text.char_indices().skip(1) {
        let (a, b) = text.split_at(split);
        let both = [a, b].iter().all(|part| SYMBOLS.iter().any(|s| s.text == *part) || *part == "kg");
        if both {
            return Some(format!("did you mean `{a}.{b}`?"));
        }
    }
    let common = ["kg", "mm", "cm", "km", "ms", "us", "kPa", "MPa", "GPa", "kN", "mA", "kW", "kJ", "mV", "kHz", "uF"];
    did_you_mean(text, SYMBOLS.iter().map(|s| s.text).chain(common))
}

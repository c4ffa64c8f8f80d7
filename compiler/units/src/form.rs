//! What is known of the unit of an expression: nothing, a bare number, or a product of powers.
//!
//! A product holds a known unit and powers of the units of variables that have none declared; dimensions are exact, factors
//! are floating point.  Numeric factors of the text can be physics (`2*x`) or a conversion (`x/1000` from mm to m), so
//! a product carries, beside its plain factor, those it would have if such numbers were conversions.  Terms as in
//! Kennedy, "Dimension types" (ESOP 1994): unit variables in the free Abelian group of units, here over the rationals.

use hyd_system::math::pow;

use crate::rational::Rational;
use crate::unit::{Dimension, Unit, same_factor};

/// Most readings of a product's factor that are kept.
const MOST_READINGS: usize = 12;
/// Most unknown units in one product.
const MOST_UNKNOWNS: usize = 64;

/// Number of an unknown unit.
pub(crate) type UnknownId = u32;

/// A product of a known unit and powers of unknown ones.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Product {
    /// Dimension of the known part.
    pub dimension: Dimension,
    /// Factor of the known part, numbers of the text taken as physics.
    pub factor: f64,
    /// Factors if numbers of the text are conversions.
    pub readings: Vec<f64>,
    /// SI value at zero; `None` if it cannot be said.
    pub offset: Option<f64>,
    /// Unknown units with their exponents, ascending, exponents not zero.
    pub unknowns: Vec<(UnknownId, Rational)>,
    /// A declared unit takes part, not only the seconds of `der` and `time` or a rule.
    pub declared: bool,
}

impl Product {
    /// A unit of a variable.
    pub(crate) fn known(unit: &Unit) -> Self {
        Self { declared: true, ..Self::rule(unit) }
    }

    /// A unit that follows from a rule of the language.
    pub(crate) fn rule(unit: &Unit) -> Self {
        Self {
            dimension: unit.dimension,
            factor: unit.factor,
            readings: Vec::new(),
            offset: Some(unit.offset),
            unknowns: Vec::new(),
            declared: false,
        }
    }

    /// The unit of a variable without one.
    pub(crate) fn unknown(id: UnknownId) -> Self {
        Self { unknowns: vec![(id, Rational::ONE)], ..Self::rule(&Unit::ONE) }
    }

    /// True without unknown units.
    pub(crate) fn is_known(&self) -> bool {
        self.unknowns.is_empty()
    }

    /// The known part as a unit.
    pub(crate) fn unit(&self) -> Unit {
        Unit { dimension: self.dimension, factor: self.factor, offset: self.offset.unwrap_or(0.0) }
    }

    /// `self * other^exponent`; `None` if a number outgrows its type.
    pub(crate) fn times(&self, other: &Product, exponent: Rational) -> Option<Product> {
        let power = exponent.value();
        let mut result = self.clone();
        result.dimension = self.dimension.times(&other.dimension, exponent)?;
        result.factor = self.factor * pow(other.factor, power);
        result.readings.clear();
        for a in std::iter::once(self.factor).chain(self.readings.iter().copied()) {
            for b in std::iter::once(other.factor).chain(other.readings.iter().copied()) {
                result.note_reading(a * pow(b, power));
            }
        }
        for &(id, e) in &other.unknowns {
            let e = e.by(exponent)?;
            match result.unknowns.binary_search_by_key(&id, |u| u.0) {
                Ok(at) => result.unknowns[at].1 = result.unknowns[at].1.plus(e)?,
                Err(at) => result.unknowns.insert(at, (id, e)),
            }
        }
        result.unknowns.retain(|(_, e)| !e.is_zero());
        // A temperature in a product is a difference, if it has an offset nobody can say which.
        let plain = self.offset == Some(0.0) && other.offset == Some(0.0);
        result.offset = plain.then_some(0.0);
        result.declared |= other.declared;
        let fits = result.factor.is_finite() && result.factor > 0.0 && result.unknowns.len() <= MOST_UNKNOWNS;
        fits.then_some(result)
    }

    /// Multiplied by a number of the text; with `conversions`, the number may also change the unit.
    pub(crate) fn scaled(mut self, value: Option<f64>, conversions: bool) -> Self {
        self.offset = match (self.offset, value) {
            (Some(0.0), _) => Some(0.0),
            (Some(offset), Some(value)) => Some(offset * value),
            _ => None,
        };
        let factor = value.map_or(1.0, f64::abs);
        if conversions && factor.is_finite() && factor > 0.0 && factor != 1.0 {
            for old in std::iter::once(self.factor).chain(self.readings.clone()).collect::<Vec<_>>() {
                self.note_reading(old / factor);
            }
        }
        self
    }

    fn note_reading(&mut self, factor: f64) {
        let known = same_factor(factor, self.factor) || self.readings.iter().any(|r| same_factor(*r, factor));
        if !known && self.readings.len() < MOST_READINGS && factor.is_finite() && factor > 0.0 {
            self.readings.push(factor);
        }
    }

    /// A factor that both can have, the plain ones first.
    fn common_factors(&self, other: &Product) -> Vec<f64> {
        let mine = std::iter::once(self.factor).chain(self.readings.iter().copied());
        let theirs: Vec<f64> = std::iter::once(other.factor).chain(other.readings.iter().copied()).collect();
        mine.filter(|a| theirs.iter().any(|b| same_factor(*a, *b))).collect()
    }

    /// How two sides without unknown units in their quotient go together.
    pub(crate) fn compare(&self, other: &Product) -> Fit {
        if self.dimension != other.dimension {
            return Fit::Dimension;
        }
        if self.common_factors(other).is_empty() {
            return Fit::Factor(self.factor / other.factor);
        }
        match (self.offset, other.offset) {
            (Some(a), Some(b)) if (a - b).abs() > 1e-6 * self.factor => Fit::Offset((a - b) / self.factor),
            _ => Fit::Same,
        }
    }

    /// The unit of a sum of two terms that should agree: what both can be, the better known one first.
    pub(crate) fn join(&self, other: &Product, offset: Option<f64>) -> Product {
        let (better, worse) = if self.unknowns.len() <= other.unknowns.len() { (self, other) } else { (other, self) };
        let mut result = better.clone();
        if self.unknowns == other.unknowns && self.dimension == other.dimension {
            let mut common = self.common_factors(other).into_iter();
            if let Some(first) = common.next() {
                result.factor = first;
                result.readings = common.collect();
            }
        }
        result.offset = offset;
        result.declared |= worse.declared;
        result
    }
}

/// How two units go together.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Fit {
    /// They agree.
    Same,
    /// Same dimension; values of the first become values of the second when multiplied by this.
    Factor(f64),
    /// Same but for the zero point; values of the first become values of the second when this is added.
    Offset(f64),
    /// Different dimensions.
    Dimension,
}

/// What is known of an expression.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Form {
    /// Nothing: a number of the text that may have any unit takes part.
    Free,
    /// A bare number: adopts any unit in a sum, has none as a factor if it is plain.
    Number {
        /// Whole, a simple fraction, or with pi: no unit as a factor.
        plain: bool,
        /// Its value, if it is a literal.
        value: Option<f64>,
    },
    /// A quantity.
    Quantity(Product),
}

impl Form {
    /// A truth, a position, an integer.
    pub(crate) const COUNT: Self = Form::Number { plain: true, value: None };

    /// `a*b` or, with exponent -1, `a/b`.
    pub(crate) fn product(&self, other: &Form, exponent: Rational, conversions: bool) -> Form {
        let inverse = exponent == Rational::whole(-1);
        match (self, other) {
            (Form::Free, _) | (_, Form::Free) => Form::Free,
            (Form::Number { plain: a, .. }, Form::Number { plain: b, .. }) => {
                Form::Number { plain: *a && *b, value: None }
            }
            (Form::Number { plain: false, .. }, _) | (_, Form::Number { plain: false, .. }) => Form::Free,
            (Form::Number { value, .. }, Form::Quantity(b)) => {
                let power = Product::rule(&Unit::ONE).times(b, exponent);
                let power = if inverse { power } else { Some(b.clone()) };
                power.map_or(Form::Free, |p| Form::Quantity(p.scaled(*value, conversions)))
            }
            (Form::Quantity(a), Form::Number { value, .. }) => {
                let value = value.map(|v| if inverse { 1.0 / v } else { v });
                Form::Quantity(a.clone().scaled(value, conversions))
            }
            (Form::Quantity(a), Form::Quantity(b)) => a.times(b, exponent).map_or(Form::Free, Form::Quantity),
        }
    }

    /// To a constant power.
    pub(crate) fn power(&self, exponent: Rational) -> Form {
        match self {
            Form::Free => Form::Free,
            Form::Number { plain, .. } => Form::Number { plain: *plain, value: None },
            Form::Quantity(p) => Product::rule(&Unit::ONE).times(p, exponent).map_or(Form::Free, Form::Quantity),
        }
    }
}

/// True for numbers that have no unit as a factor: integers, fractions with powers of 2 and 3 below, these with a
/// power of pi, and square roots of the former.  Decimals such as 0.1 are widths and measured values as often as numbers.
pub(crate) fn is_plain(value: f64) -> bool {
    use std::f64::consts::PI;
    let near = |x: f64| x.round() != 0.0 && (x - x.round()).abs() <= 4.0 * f64::EPSILON * x.abs();
    let simple =
        |x: f64| [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 9.0, 12.0, 16.0, 32.0, 64.0, 128.0].iter().any(|q| near(x * q));
    let square = value * value;
    value == 0.0
        || simple(value)
        || [PI, 1.0 / PI, PI * PI, 1.0 / (PI * PI)].iter().any(|p| simple(value / p))
        || (simple(square) && square < 1000.0 && !few_digits(value))
}

/// True for numbers of few decimal digits, which nobody gets by taking a root.
fn few_digits(value: f64) -> bool {
    let scaled = value * 1e6;
    (scaled - scaled.round()).abs() < 1e-6
}

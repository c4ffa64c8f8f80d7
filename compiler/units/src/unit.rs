//! Units as powers of the seven SI base units with a factor and an offset.
//!
//! A value `v` in a unit stands for `factor*v + offset` in the coherent SI unit of its dimension (BIPM, "The International
//! System of Units", 9th edition, 2019, section 2.3).  Plane and solid angles count as numbers: rad = sr = 1.  Only
//! temperatures that are not differences have an offset.

use hyd_system::math::pow;

use crate::rational::Rational;

/// Symbols of the base units, in the order in which a [`Dimension`] counts them.
pub const BASE_SYMBOLS: [&str; 7] = ["kg", "m", "s", "A", "K", "mol", "cd"];

/// Exponents of kg, m, s, A, K, mol, cd.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
pub struct Dimension(pub [Rational; 7]);

impl Dimension {
    /// A number.
    pub const NONE: Self = Self([Rational::ZERO; 7]);

    /// From whole exponents of kg, m, s, A, K, mol, cd.
    pub const fn whole(exponents: [i32; 7]) -> Self {
        let mut result = [Rational::ZERO; 7];
        let mut k = 0;
        while k < 7 {
            result[k] = Rational::whole(exponents[k]);
            k += 1;
        }
        Self(result)
    }

    /// True for numbers.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Dimension of `a * b^exponent`; `None` if an exponent outgrows its type.
    pub fn times(&self, other: &Self, exponent: Rational) -> Option<Self> {
        let mut result = self.0;
        for (mine, theirs) in result.iter_mut().zip(other.0) {
            *mine = mine.plus(theirs.by(exponent)?)?;
        }
        Some(Self(result))
    }
}

/// A unit: dimension, factor and offset to the coherent SI unit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Unit {
    /// Powers of the base units.
    pub dimension: Dimension,
    /// SI value of one unit, above zero.
    pub factor: f64,
    /// SI value of zero units (degC: 273.15 K).
    pub offset: f64,
}

impl Unit {
    /// The number one.
    pub const ONE: Self = Self { dimension: Dimension::NONE, factor: 1.0, offset: 0.0 };
    /// The second.
    pub const SECOND: Self = Self { dimension: Dimension::whole([0, 0, 1, 0, 0, 0, 0]), factor: 1.0, offset: 0.0 };

    /// `self * other^exponent`, offsets dropped: in products a temperature is a difference.
    pub fn times(&self, other: &Unit, exponent: Rational) -> Option<Unit> {
        let factor = self.factor * pow(other.factor, exponent.value());
        let dimension = self.dimension.times(&other.dimension, exponent)?;
        (factor.is_finite() && factor > 0.0).then_some(Unit { dimension, factor, offset: 0.0 })
    }
}

/// True when two factors are the same up to rounding.
pub(crate) fn same_factor(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

//! Small exact fractions: the exponents of units.
//!
//! Halving exponents (`sqrt`) and solving for the unit of an unknown need fractions, and comparing units needs them exact.
//! Numerators and denominators that outgrow 32 bits give `None`; callers then know nothing about the unit.

/// A fraction in lowest terms with positive denominator.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
pub struct Rational {
    numerator: i32,
    denominator: i32,
}

impl Rational {
    /// 0.
    pub const ZERO: Self = Self { numerator: 0, denominator: 1 };
    /// 1.
    pub const ONE: Self = Self { numerator: 1, denominator: 1 };

    /// An integer.
    pub const fn whole(value: i32) -> Self {
        Self { numerator: value, denominator: 1 }
    }

    /// `numerator/denominator` in lowest terms; `None` for a zero denominator or if the terms outgrow 32 bits.
    pub fn new(numerator: i64, denominator: i64) -> Option<Self> {
        if denominator == 0 {
            return None;
        }
        let divisor = gcd(numerator.unsigned_abs(), denominator.unsigned_abs()).max(1) as i64 * denominator.signum();
        let (numerator, denominator) = (numerator / divisor, denominator / divisor);
        Some(Self { numerator: numerator.try_into().ok()?, denominator: denominator.try_into().ok()? })
    }

    /// The fraction with the smallest denominator up to `largest` that equals `value` to about 12 digits.
    pub fn near(value: f64, largest: i64) -> Option<Self> {
        if !value.is_finite() || value.abs() > 1e6 {
            return None;
        }
        (1..=largest).find_map(|denominator| {
            let scaled = value * denominator as f64;
            let rounded = scaled.round();
            let close = (scaled - rounded).abs() <= 1e-12 * scaled.abs().max(1.0);
            if close { Self::new(rounded as i64, denominator) } else { None }
        })
    }

    /// True for 0.
    pub fn is_zero(self) -> bool {
        self.numerator == 0
    }

    /// The integer, if it is one.
    pub fn as_whole(self) -> Option<i32> {
        (self.denominator == 1).then_some(self.numerator)
    }

    /// Numerator and denominator.
    pub fn parts(self) -> (i32, i32) {
        (self.numerator, self.denominator)
    }

    /// As a floating-point number.
    pub fn value(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    /// Sum.
    pub fn plus(self, other: Self) -> Option<Self> {
        let (a, b) = (i64::from(self.numerator), i64::from(self.denominator));
        let (c, d) = (i64::from(other.numerator), i64::from(other.denominator));
        Self::new((a * d).checked_add(c * b)?, b * d)
    }

    /// Product.
    pub fn by(self, other: Self) -> Option<Self> {
        let (a, b) = (i64::from(self.numerator), i64::from(self.denominator));
        let (c, d) = (i64::from(other.numerator), i64::from(other.denominator));
        Self::new(a * c, b * d)
    }

    /// Negative.
    pub fn negative(self) -> Option<Self> {
        Self::new(-i64::from(self.numerator), i64::from(self.denominator))
    }

    /// `1/self`; `None` for 0.
    pub fn recip(self) -> Option<Self> {
        Self::new(i64::from(self.denominator), i64::from(self.numerator))
    }
}

fn gcd(mut a: u64, mut b: u64) -> u64 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_are_exact_and_overflow_is_seen() {
        let third = Rational::new(-2, -6).expect("1/3");
        assert_eq!(third.parts(), (1, 3));
        assert_eq!(third.plus(Rational::new(1, 6).expect("1/6")), Rational::new(1, 2));
        assert_eq!(third.by(Rational::whole(3)), Some(Rational::ONE));
        assert_eq!(Rational::near(-1.25, 12), Rational::new(-5, 4));
        assert_eq!(Rational::near(std::f64::consts::PI, 1000), None);
        let large = Rational::whole(i32::MAX);
        assert_eq!(large.plus(Rational::ONE), None);
        assert_eq!(Rational::ZERO.recip(), None);
    }
}

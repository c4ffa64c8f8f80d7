//! Fractions: intervals and shifts of clocks, exact.

/// A fraction in lowest terms, its denominator positive.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Ratio {
    above: i128,
    below: i128,
}

fn divisor(a: i128, b: i128) -> i128 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl Ratio {
    pub(crate) const ZERO: Self = Self { above: 0, below: 1 };
    pub(crate) const ONE: Self = Self { above: 1, below: 1 };

    /// `above/below`; none if that leaves the range of exact numbers, or `below` is 0.
    pub(crate) fn new(above: i128, below: i128) -> Option<Self> {
        if below == 0 {
            return None;
        }
        let common = divisor(above, below).max(1) * below.signum();
        let (above, below) = (above / common, below / common);
        let fits = |n: i128| n.abs() < 1 << 53;
        (fits(above) && fits(below)).then_some(Self { above, below })
    }

    pub(crate) fn times(self, other: Self) -> Option<Self> {
        Self::new(self.above * other.above, self.below * other.below)
    }

    pub(crate) fn over(self, other: Self) -> Option<Self> {
        Self::new(self.above * other.below, self.below * other.above)
    }

    pub(crate) fn plus(self, other: Self) -> Option<Self> {
        Self::new(self.above * other.below + other.above * self.below, self.below * other.below)
    }

    pub(crate) fn minus(self, other: Self) -> Option<Self> {
        self.plus(Self { above: -other.above, below: other.below })
    }

    pub(crate) fn is_negative(self) -> bool {
        self.above < 0
    }

    /// The number, where it is one without a fraction.
    pub(crate) fn integer(self) -> Option<u64> {
        (self.below == 1).then(|| u64::try_from(self.above).ok()).flatten()
    }

    /// The largest fraction of which both are multiples.
    pub(crate) fn common(self, other: Self) -> Option<Self> {
        let above = divisor(self.above * other.below, other.above * self.below);
        Self::new(above, self.below * other.below)
    }

    pub(crate) fn above(self) -> f64 {
        self.above as f64
    }

    pub(crate) fn below(self) -> f64 {
        self.below as f64
    }

    pub(crate) fn value(self) -> f64 {
        self.above as f64 / self.below as f64
    }
}

#[cfg(test)]
mod tests {
    use super::Ratio;

    fn ratio(above: i128, below: i128) -> Ratio {
        Ratio::new(above, below).expect("it is small")
    }

    #[test]
    fn fractions_stay_in_lowest_terms() {
        assert_eq!(ratio(4, -6), ratio(-2, 3));
        assert_eq!(ratio(1, 10).plus(ratio(1, 15)), Some(ratio(1, 6)));
        assert_eq!(ratio(1, 10).minus(ratio(1, 10)), Some(Ratio::ZERO));
        assert_eq!(ratio(3, 10).over(ratio(1, 10)), Some(ratio(3, 1)));
        assert_eq!(ratio(1, 10).over(Ratio::ZERO), None);
        assert_eq!(Ratio::new(1, 0), None);
        assert_eq!(Ratio::new(1 << 60, 3), None);
    }

    #[test]
    fn common_parts_divide_both() {
        assert_eq!(ratio(1, 10).common(ratio(1, 15)), Some(ratio(1, 30)));
        assert_eq!(ratio(3, 2).common(ratio(9, 4)), Some(ratio(3, 4)));
        assert_eq!(ratio(3, 2).common(Ratio::ZERO), Some(ratio(3, 2)));
        assert_eq!(ratio(6, 3).integer(), Some(2));
        assert_eq!(ratio(-6, 3).integer(), None);
        assert_eq!(ratio(1, 3).integer(), None);
    }
}

//! Intervals, and what an operation makes of quantities that run through them together with their slopes.
//!
//! An [`Enclosure`] holds all values and all slopes that a quantity takes while the time runs through an interval (Moore,
//! Kearfott, Cloud, "Introduction to Interval Analysis", SIAM 2009, chapters 5 and 6).  Bounds of rounded results are moved outward
//! by a few roundings.  Where nothing is known, also about slopes across jumps, the bounds are infinite.

use hyd_symbolic::{Function, Node, NodeId, Relation};

/// Results of operations and elementary functions are wrong by less than this part.
const ROUNDED: f64 = 4.0 * f64::EPSILON;
/// The highest power that is bounded by its ends.
const HIGHEST_POWER: f64 = 64.0;

/// All numbers from `low` to `high`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// All numbers.
    pub(crate) const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
    const ZERO: Self = Self { low: 0.0, high: 0.0 };
    const UNIT: Self = Self { low: -1.0, high: 1.0 };

    /// One number; all numbers if it is not a number.
    pub(crate) fn point(value: f64) -> Self {
        Self::exact(value, value)
    }

    fn exact(low: f64, high: f64) -> Self {
        if low <= high { Self { low, high } } else { Self::ALL }
    }

    fn rounded(low: f64, high: f64) -> Self {
        Self::exact(low - ROUNDED * low.abs(), high + ROUNDED * high.abs())
    }

    /// A function that ascends.
    fn through(self, f: impl Fn(f64) -> f64) -> Self {
        Self::rounded(f(self.low), f(self.high))
    }

    fn contains(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    fn within(self, other: Self) -> bool {
        other.low <= self.low && self.high <= other.high
    }

    fn is(self, value: f64) -> bool {
        self.low == value && self.high == value
    }

    fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }

    fn add(self, other: Self) -> Self {
        Self::rounded(self.low + other.low, self.high + other.high)
    }

    fn sub(self, other: Self) -> Self {
        self.add(other.neg())
    }

    fn mul(self, other: Self) -> Self {
        // No bound is too much for a factor that is zero.
        let times = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let products = [
            times(self.low, other.low),
            times(self.low, other.high),
            times(self.high, other.low),
            times(self.high, other.high),
        ];
        Self::rounded(
            products.into_iter().fold(f64::INFINITY, f64::min),
            products.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    fn div(self, other: Self) -> Self {
        if other.contains(0.0) {
            return Self::ALL;
        }
        self.mul(Self::rounded(other.high.recip(), other.low.recip()))
    }

    fn abs(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            self.neg()
        } else {
            Self { low: 0.0, high: self.high.max(-self.low) }
        }
    }

    fn sin(self) -> Self {
        use std::f64::consts::{FRAC_PI_2, TAU};
        if self.high - self.low >= TAU || !self.within(Self { low: -1e15, high: 1e15 }) {
            return Self::UNIT;
        }
        // A top or bottom that rounding may have moved out of the interval counts.
        let slack = ROUNDED * self.low.abs().max(self.high.abs()).max(1.0);
        let holds = |place: f64| {
            let turn = ((self.low - slack - place) / TAU).ceil();
            place + turn * TAU <= self.high + slack
        };
        let (a, b) = (Function::Sin.apply(self.low, 0.0), Function::Sin.apply(self.high, 0.0));
        let low = if holds(-FRAC_PI_2) { -1.0 } else { a.min(b) };
        let high = if holds(FRAC_PI_2) { 1.0 } else { a.max(b) };
        let found = Self::rounded(low, high);
        Self { low: found.low.max(-1.0), high: found.high.min(1.0) }
    }

    fn cos(self) -> Self {
        self.add(Self::rounded(std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2)).sin()
    }

    fn sqrt(self) -> Self {
        if self.low < 0.0 { Self::ALL } else { self.through(f64::sqrt) }
    }

    /// A whole power, at least 0.
    fn power(self, n: f64) -> Self {
        let (a, b) = (Function::Pow.apply(self.low, n), Function::Pow.apply(self.high, n));
        if n == 0.0 {
            Self::point(1.0)
        } else if n % 2.0 != 0.0 || self.low >= 0.0 {
            Self::rounded(a, b)
        } else if self.high <= 0.0 {
            Self::rounded(b, a)
        } else {
            Self::rounded(0.0, a.max(b))
        }
    }
}

/// Values and slopes over an interval of time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Enclosure {
    /// All values.
    pub value: Interval,
    /// All slopes.
    pub slope: Interval,
}

impl Enclosure {
    /// Nothing is known.
    pub(crate) const ALL: Self = Self { value: Interval::ALL, slope: Interval::ALL };

    /// A number that does not change.
    pub(crate) fn constant(value: f64) -> Self {
        Self { value: Interval::point(value), slope: Interval::ZERO }
    }

    /// The time itself.
    pub(crate) fn time(low: f64, high: f64) -> Self {
        Self { value: Interval { low, high }, slope: Interval::point(1.0) }
    }

    fn truth(known: Option<bool>) -> Self {
        match known {
            Some(truth) => Self::constant(f64::from(u8::from(truth))),
            None => Self { value: Interval { low: 0.0, high: 1.0 }, slope: Interval::ALL },
        }
    }

    /// Whether it is true; none where it may be either.
    fn known(self) -> Option<bool> {
        if self.value.is(0.0) { Some(false) } else { (!self.value.contains(0.0)).then_some(true) }
    }

    /// An integer that jumps: one of those from `low` to `high`.
    fn whole(low: f64, high: f64) -> Self {
        match low == high {
            true => Self::constant(low),
            false => Self { value: Interval::exact(low, high), slope: Interval::ALL },
        }
    }

    /// The negative.
    pub(crate) fn neg(self) -> Self {
        Self { value: self.value.neg(), slope: self.slope.neg() }
    }

    fn add(self, other: Self) -> Self {
        Self { value: self.value.add(other.value), slope: self.slope.add(other.slope) }
    }

    fn mul(self, other: Self) -> Self {
        let slope = self.slope.mul(other.value).add(self.value.mul(other.slope));
        Self { value: self.value.mul(other.value), slope }
    }

    fn div(self, other: Self) -> Self {
        let value = self.value.div(other.value);
        Self { value, slope: self.slope.sub(value.mul(other.slope)).div(other.value) }
    }

    /// A function of this value and slope.
    fn chain(self, value: Interval, rate: Interval) -> Self {
        Self { value, slope: rate.mul(self.slope) }
    }

    fn abs(self) -> Self {
        let slope = match self.value {
            value if value.low >= 0.0 => self.slope,
            value if value.high <= 0.0 => self.slope.neg(),
            _ => self.slope.hull(self.slope.neg()),
        };
        Self { value: self.value.abs(), slope }
    }

    fn max(self, other: Self) -> Self {
        if self.value.low >= other.value.high {
            return self;
        }
        if other.value.low >= self.value.high {
            return other;
        }
        let (a, b) = (self.value, other.value);
        Self {
            value: Interval { low: a.low.max(b.low), high: a.high.max(b.high) },
            slope: self.slope.hull(other.slope),
        }
    }

    fn call(self, function: Function) -> Self {
        let (v, one) = (self.value, Interval::point(1.0));
        let reciprocal = |square: Interval| one.div(square);
        match function {
            Function::Sin => self.chain(v.sin(), v.cos()),
            Function::Cos => self.chain(v.cos(), v.sin().neg()),
            // Where the cosine has a sign, it ascends.
            Function::Tan if !v.cos().contains(0.0) => {
                let value = v.through(|x| Function::Tan.apply(x, 0.0));
                self.chain(value, one.add(value.power(2.0)))
            }
            Function::Asin if v.within(Interval::UNIT) => {
                self.chain(v.through(|x| Function::Asin.apply(x, 0.0)), reciprocal(one.sub(v.power(2.0)).sqrt()))
            }
            Function::Acos if v.within(Interval::UNIT) => {
                let value = Interval::rounded(Function::Acos.apply(v.high, 0.0), Function::Acos.apply(v.low, 0.0));
                self.chain(value, reciprocal(one.sub(v.power(2.0)).sqrt()).neg())
            }
            Function::Atan => {
                self.chain(v.through(|x| Function::Atan.apply(x, 0.0)), reciprocal(one.add(v.power(2.0))))
            }
            Function::Sinh => {
                let rate = v.abs().through(|x| Function::Cosh.apply(x, 0.0));
                self.chain(v.through(|x| Function::Sinh.apply(x, 0.0)), rate)
            }
            Function::Cosh => self
                .chain(v.abs().through(|x| Function::Cosh.apply(x, 0.0)), v.through(|x| Function::Sinh.apply(x, 0.0))),
            Function::Tanh => {
                let value = v.through(|x| Function::Tanh.apply(x, 0.0));
                self.chain(value, one.sub(value.power(2.0)))
            }
            Function::Exp => {
                let value = v.through(|x| Function::Exp.apply(x, 0.0));
                self.chain(value, value)
            }
            Function::Log if v.low > 0.0 => self.chain(v.through(|x| Function::Log.apply(x, 0.0)), reciprocal(v)),
            Function::Log10 if v.low > 0.0 => {
                let value = v.through(|x| Function::Log10.apply(x, 0.0));
                self.chain(
                    value,
                    reciprocal(v.mul(Interval::rounded(std::f64::consts::LN_10, std::f64::consts::LN_10))),
                )
            }
            Function::Sqrt => {
                let value = v.sqrt();
                self.chain(value, reciprocal(value.add(value)))
            }
            Function::Abs => self.abs(),
            Function::Sign => Self::whole(
                if v.low == 0.0 { 0.0 } else { v.low.signum() },
                if v.high == 0.0 { 0.0 } else { v.high.signum() },
            ),
            Function::Floor => Self::whole(v.low.floor(), v.high.floor()),
            Function::Ceil => Self::whole(v.low.ceil(), v.high.ceil()),
            _ => Self::ALL,
        }
    }

    fn call2(self, function: Function, other: Self) -> Self {
        let quotient = || self.value.div(other.value);
        // `x - q*y` may be a little less than nothing.
        let rounding = || {
            let most = ROUNDED * self.value.abs().high;
            Interval::exact(-most, most)
        };
        let less = |whole: Self| self.add(whole.mul(other).neg());
        match function {
            Function::Max => self.max(other),
            Function::Min => self.neg().max(other.neg()).neg(),
            Function::Pow => self.pow(other),
            Function::Div => Self::whole(quotient().low.trunc(), quotient().high.trunc()),
            Function::Mod => match quotient() {
                q if q.low.floor() == q.high.floor() => less(Self::constant(q.low.floor())),
                _ => Self { value: other.value.hull(Interval::ZERO).add(rounding()), slope: Interval::ALL },
            },
            Function::Rem => match quotient() {
                q if q.low.trunc() == q.high.trunc() => less(Self::constant(q.low.trunc())),
                _ => Self { value: other.value.hull(other.value.neg()).add(rounding()), slope: Interval::ALL },
            },
            Function::Atan2 => {
                let half = std::f64::consts::PI * (1.0 + ROUNDED);
                Self { value: Interval { low: -half, high: half }, slope: Interval::ALL }
            }
            _ => Self::ALL,
        }
    }

    fn pow(self, other: Self) -> Self {
        let n = other.value.low;
        if other.value.is(n) && n.fract() == 0.0 && n.abs() <= HIGHEST_POWER {
            let rate = |n: f64| self.value.power(n - 1.0).mul(Interval::point(n));
            return match n {
                0.0 => Self::constant(1.0),
                n if n > 0.0 => self.chain(self.value.power(n), rate(n)),
                n => Self::constant(1.0).div(self.chain(self.value.power(-n), rate(-n))),
            };
        }
        match self.value.low > 0.0 {
            true => other.mul(self.call(Function::Log)).call(Function::Exp),
            false => Self::ALL,
        }
    }

    fn compare(self, relation: Relation, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let decided = |yes: bool, no: bool| Self::truth(if yes { Some(true) } else { no.then_some(false) });
        match relation {
            Relation::Less => decided(a.high < b.low, a.low >= b.high),
            Relation::LessEqual => decided(a.high <= b.low, a.low > b.high),
            Relation::Greater => other.compare(Relation::Less, self),
            Relation::GreaterEqual => other.compare(Relation::LessEqual, self),
            Relation::Equal => decided(a.is(a.low) && b.is(a.low), a.high < b.low || b.high < a.low),
            Relation::NotEqual => self.compare(Relation::Equal, other).not(),
        }
    }

    fn not(self) -> Self {
        Self::truth(self.known().map(|truth| !truth))
    }

    fn and(self, other: Self) -> Self {
        match (self.known(), other.known()) {
            (Some(false), _) | (_, Some(false)) => Self::truth(Some(false)),
            (Some(true), Some(true)) => Self::truth(Some(true)),
            _ => Self::truth(None),
        }
    }

    /// What an operation makes of its operands; nothing is known of leaves and of compiled functions.
    pub(crate) fn operate(node: Node, value: impl Fn(NodeId) -> Self) -> Self {
        match node {
            Node::Const(number) => Self::constant(number.value()),
            Node::Slot(_) | Node::Time | Node::Initial | Node::Homotopy | Node::Pair(..) | Node::Apply(..) => Self::ALL,
            Node::Neg(a) => value(a).neg(),
            Node::Not(a) => value(a).not(),
            Node::Add(a, b) => value(a).add(value(b)),
            Node::Sub(a, b) => value(a).add(value(b).neg()),
            Node::Mul(a, b) if a == b => value(a).pow(Self::constant(2.0)),
            Node::Mul(a, b) => value(a).mul(value(b)),
            Node::Div(a, b) => value(a).div(value(b)),
            Node::And(a, b) => value(a).and(value(b)),
            Node::Or(a, b) => value(a).not().and(value(b).not()).not(),
            Node::Compare(relation, a, b) | Node::Event(relation, a, b) => value(a).compare(relation, value(b)),
            Node::If(c, a, b) => match value(c).known() {
                Some(true) => value(a),
                Some(false) => value(b),
                None => Self { value: value(a).value.hull(value(b).value), slope: Interval::ALL },
            },
            Node::Call1(function, a) => value(a).call(function),
            Node::Call2(function, a, b) => value(a).call2(function, value(b)),
        }
    }
}

#[cfg(test)]
mod tests {
    use hyd_index::TypedIndex;
    use hyd_symbolic::operate;

    use super::*;

    /// Values and slopes at points of intervals lie within the enclosures, for every operation.
    #[test]
    fn enclosures_hold_what_they_enclose() {
        let (a, b) = (NodeId::new(0), NodeId::new(1));
        let one = [
            Function::Sin,
            Function::Cos,
            Function::Tan,
            Function::Asin,
            Function::Acos,
            Function::Atan,
            Function::Sinh,
            Function::Cosh,
            Function::Tanh,
            Function::Exp,
            Function::Log,
            Function::Log10,
            Function::Sqrt,
            Function::Abs,
            Function::Sign,
            Function::Floor,
            Function::Ceil,
        ];
        let two =
            [Function::Atan2, Function::Pow, Function::Min, Function::Max, Function::Div, Function::Mod, Function::Rem];
        let relations = [
            Relation::Less,
            Relation::LessEqual,
            Relation::Greater,
            Relation::GreaterEqual,
            Relation::Equal,
            Relation::NotEqual,
        ];
        let mut nodes =
            vec![Node::Neg(a), Node::Add(a, b), Node::Sub(a, b), Node::Mul(a, b), Node::Mul(a, a), Node::Div(a, b)];
        nodes.extend(one.map(|f| Node::Call1(f, a)));
        nodes.extend(two.map(|f| Node::Call2(f, a, b)));
        nodes.extend(relations.map(|r| Node::Compare(r, a, b)));
        // a(t) = p + q*t and b(t) = r + s*t^2
        let numbers = [-3.0, -1.5, -0.4, 0.0, 0.3, 0.5, 1.0, 2.0, 7.0];
        let mut bounded = 0;
        for node in nodes {
            for (k, &p) in numbers.iter().enumerate() {
                for (l, &r) in numbers.iter().enumerate() {
                    let (q, s) = (numbers[(k + l) % 9], numbers[(k + 2 * l + 1) % 9]);
                    for (low, high) in [(0.0, 0.01), (-0.2, 0.3), (0.7, 0.7), (1.0, 4.0)] {
                        let time = Enclosure::time(low, high);
                        let line =
                            |p: f64, q: f64, t: Enclosure| Enclosure::constant(p).add(Enclosure::constant(q).mul(t));
                        let (x, y) = (line(p, q, time), line(r, s, time.pow(Enclosure::constant(2.0))));
                        let found = Enclosure::operate(node, |id| if id == a { x } else { y });
                        bounded += u32::from(found.value != Interval::ALL && found.slope != Interval::ALL);
                        let at = |t: f64| operate(node, |id| if id == a { p + q * t } else { r + s * (t * t) });
                        for part in 0..=8 {
                            let t = low + (high - low) * f64::from(part) / 8.0;
                            let value = at(t);
                            assert!(
                                value.is_nan() || found.value.contains(value),
                                "{node:?} {p} {q} {r} {s} {t}: {value} {found:?}"
                            );
                            let h = 1e-6;
                            if t - h < low || t + h > high || !value.is_finite() {
                                continue;
                            }
                            let slope = (at(t + h) - at(t - h)) / (2.0 * h);
                            let slack = 1e-4 * (1.0 + slope.abs());
                            let near =
                                slope.is_nan() || found.slope.low - slack <= slope && slope <= found.slope.high + slack;
                            assert!(near, "{node:?} {p} {q} {r} {s} {t}: slope {slope} {found:?}");
                        }
                    }
                }
            }
        }
        assert!(bounded > 5000, "most enclosures are bounded: {bounded}");
    }
}

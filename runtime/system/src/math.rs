//! Elementary functions with the same bits on every machine: those that models may call, and those that programs do.
//!
//! The methods of `f64` in the standard library call the C library of the machine, whose last digits are its own; a digit may decide
//! whether a step is accepted or where a fit ends.  All functions here are those of the crate `libm`, musl's written in Rust (of FDLIBM
//! by Sun Microsystems 1993, in part of CORE-MATH), which needs nothing of the machine but IEEE arithmetic.  `clippy.toml` disallows
//! the methods of the standard library and names this module.
//!
//! [`Function`] is one table for constant folding, interpretation and generated code.  `abs`, `min`, `max`, `sqrt`, `floor` and `ceil`
//! are exact everywhere, so generated code may inline them and everyone may call the methods.

/// An elementary function of one or two real arguments.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
#[repr(u8)]
pub enum Function {
    /// Sine of an angle in rad.
    Sin,
    /// Cosine of an angle in rad.
    Cos,
    /// Tangent of an angle in rad.
    Tan,
    /// Inverse sine.
    Asin,
    /// Inverse cosine.
    Acos,
    /// Inverse tangent.
    Atan,
    /// Four-quadrant inverse tangent of (y, x).
    Atan2,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// Exponential.
    Exp,
    /// Natural logarithm.
    Log,
    /// Logarithm to base 10.
    Log10,
    /// Square root.
    Sqrt,
    /// First argument to the power of the second.
    Pow,
    /// Absolute value.
    Abs,
    /// -1, 0 or 1.
    Sign,
    /// Smaller argument.
    Min,
    /// Larger argument.
    Max,
    /// Largest integer not above.
    Floor,
    /// Smallest integer not below.
    Ceil,
    /// Quotient truncated towards zero (Modelica `div`).
    Div,
    /// `x - floor(x/y)*y` (Modelica `mod`).
    Mod,
    /// `x - div(x, y)*y` (Modelica `rem`).
    Rem,
}

impl Function {
    /// All functions, in the order of their discriminants.
    pub const ALL: &'static [Function] = &[
        Function::Sin,
        Function::Cos,
        Function::Tan,
        Function::Asin,
        Function::Acos,
        Function::Atan,
        Function::Atan2,
        Function::Sinh,
        Function::Cosh,
        Function::Tanh,
        Function::Exp,
        Function::Log,
        Function::Log10,
        Function::Sqrt,
        Function::Pow,
        Function::Abs,
        Function::Sign,
        Function::Min,
        Function::Max,
        Function::Floor,
        Function::Ceil,
        Function::Div,
        Function::Mod,
        Function::Rem,
    ];

    /// Number of arguments: 1 or 2.
    pub fn arity(self) -> usize {
        match self {
            Function::Atan2
            | Function::Pow
            | Function::Min
            | Function::Max
            | Function::Div
            | Function::Mod
            | Function::Rem => 2,
            _ => 1,
        }
    }

    /// The name in model text.  `Pow` is the operator `^` there.
    pub fn name(self) -> &'static str {
        match self {
            Function::Sin => "sin",
            Function::Cos => "cos",
            Function::Tan => "tan",
            Function::Asin => "asin",
            Function::Acos => "acos",
            Function::Atan => "atan",
            Function::Atan2 => "atan2",
            Function::Sinh => "sinh",
            Function::Cosh => "cosh",
            Function::Tanh => "tanh",
            Function::Exp => "exp",
            Function::Log => "log",
            Function::Log10 => "log10",
            Function::Sqrt => "sqrt",
            Function::Pow => "pow",
            Function::Abs => "abs",
            Function::Sign => "sign",
            Function::Min => "min",
            Function::Max => "max",
            Function::Floor => "floor",
            Function::Ceil => "ceil",
            Function::Div => "div",
            Function::Mod => "mod",
            Function::Rem => "rem",
        }
    }

    /// The function with this name in model text (not `pow`, which text writes as `^`).
    pub fn from_name(name: &str) -> Option<Function> {
        Self::ALL.iter().copied().find(|f| f.name() == name && *f != Function::Pow)
    }

    /// The value; `b` is ignored by functions of one argument.  NaN where the function is not defined.
    #[inline]
    pub fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Function::Sin => libm::sin(a),
            Function::Cos => libm::cos(a),
            Function::Tan => libm::tan(a),
            Function::Asin => libm::asin(a),
            Function::Acos => libm::acos(a),
            Function::Atan => libm::atan(a),
            Function::Atan2 => libm::atan2(a, b),
            Function::Sinh => libm::sinh(a),
            Function::Cosh => libm::cosh(a),
            Function::Tanh => libm::tanh(a),
            Function::Exp => libm::exp(a),
            Function::Log => libm::log(a),
            Function::Log10 => libm::log10(a),
            Function::Sqrt => a.sqrt(),
            Function::Pow => libm::pow(a, b),
            Function::Abs => a.abs(),
            Function::Sign => f64::from(i8::from(a > 0.0) - i8::from(a < 0.0)),
            Function::Min => lesser(a, b),
            Function::Max => greater(a, b),
            Function::Floor => a.floor(),
            Function::Ceil => a.ceil(),
            Function::Div => (a / b).trunc(),
            Function::Mod => a - (a / b).floor() * b,
            Function::Rem => a - (a / b).trunc() * b,
        }
    }
}

/// Sine of an angle in rad.
#[inline]
pub fn sin(x: f64) -> f64 {
    libm::sin(x)
}

/// Cosine of an angle in rad.
#[inline]
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Sine and cosine of an angle in rad, with the bits of single calls.
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Exponential.
#[inline]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// Natural logarithm.
#[inline]
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// Logarithm to base 10.
#[inline]
pub fn log10(x: f64) -> f64 {
    libm::log10(x)
}

/// `x` to the power of `y`.
#[inline]
pub fn pow(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

/// `x` to a whole power by repeated squaring; the reciprocal of the positive power where `n` is negative.
pub fn powi(x: f64, n: i32) -> f64 {
    let (mut square, mut left, mut product) = (x, n.unsigned_abs(), 1.0);
    while left > 0 {
        if left & 1 == 1 {
            product *= square;
        }
        square *= square;
        left >>= 1;
    }
    if n < 0 { 1.0 / product } else { product }
}

/// `x*x`, for what is long to write twice.
#[inline(always)]
pub fn square(x: f64) -> f64 {
    x * x
}

/// Fourth root.
#[inline(always)]
pub fn fourth_root(x: f64) -> f64 {
    x.sqrt().sqrt()
}

/// `sqrt(x^2 + y^2)` without overflow on the way.
#[inline]
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

/// `min` that keeps NaN (a NaN must reach the solver, not vanish).
fn lesser(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) }
}

/// `max` that keeps NaN.
fn greater(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_division_follows_the_language() {
        // Values of the table in the Modelica specification, section 3.7.1.1.
        let at = |f: Function, a, b| f.apply(a, b);
        assert_eq!(at(Function::Mod, 3.0, 1.4), 3.0 - 2.0 * 1.4);
        assert_eq!(at(Function::Mod, -3.0, 1.4), -3.0 + 3.0 * 1.4);
        assert_eq!(at(Function::Mod, 3.0, -1.4), 3.0 - 3.0 * 1.4);
        assert_eq!(at(Function::Rem, -3.0, 1.4), -3.0 + 2.0 * 1.4);
        assert_eq!(at(Function::Div, -7.0, 2.0), -3.0);
        assert_eq!(at(Function::Sign, -2.0, 0.0), -1.0);
    }

    /// Near the machine's own functions; and of many values the bits are recorded, so that another version of the library that changes
    /// one does not go unseen.
    #[test]
    fn values_have_the_recorded_bits() {
        let found = [
            sin(2.5),
            cos(-40.25),
            exp(-3.75),
            ln(0.3),
            log10(7e-5),
            pow(0.037, -0.175),
            powi(1.1, 13),
            powi(1.1, -6),
            hypot(0.3, -4e-2),
        ];
        let known = [
            2.5f64.sin(),
            (-40.25f64).cos(),
            (-3.75f64).exp(),
            0.3f64.ln(),
            7e-5f64.log10(),
            0.037f64.powf(-0.175),
            1.1f64.powi(13),
            1.1f64.powi(-6),
            0.3f64.hypot(-4e-2),
        ];
        for (found, known) in found.into_iter().zip(known) {
            assert!((found - known).abs() <= 2.0 * f64::EPSILON * known.abs(), "{found:?} instead of {known:?}");
        }
        let mut hash = 0u64;
        for k in 0..2000 {
            let x = 1e-3 + 0.0171 * f64::from(k);
            let (sine, cosine) = sin_cos(x);
            assert_eq!((sine, cosine), (sin(x), cos(x)));
            let values = [sine, cosine, exp(-x), ln(x), log10(x), pow(x, -0.175), powi(x, 7 - k % 15), hypot(x, 3.0)];
            let others = Function::ALL.iter().map(|f| f.apply(0.7 * (x - 17.0) / 17.0, x));
            for value in values.into_iter().chain(others) {
                // Which NaN it is depends on the processor.
                let bits = if value.is_nan() { 0 } else { value.to_bits() };
                hash = (hash ^ bits).wrapping_mul(0x0100_0000_01b3).rotate_left(23);
            }
        }
        assert_eq!(hash, 0xaead_9bc8_6a4d_fd15, "{hash:#x}");
    }

    /// Who asks for the decade of a number rounds the logarithm down.
    #[test]
    fn powers_of_ten_have_whole_logarithms() {
        for k in -300i32..=300 {
            let power: f64 = format!("1e{k}").parse().expect("a number");
            assert_eq!(log10(power).floor(), f64::from(k), "{k}");
            assert!(k.abs() > 22 || powi(10.0, k) == power, "{k}");
        }
        assert_eq!((powi(-2.0, 3), powi(2.0, i32::MIN), powi(0.0, 0), square(-3.0)), (-8.0, 0.0, 1.0, 9.0));
    }

    #[test]
    fn names_are_found_again() {
        for &f in Function::ALL {
            if f != Function::Pow {
                assert_eq!(Function::from_name(f.name()), Some(f));
            }
        }
        assert!(Function::Max.apply(f64::NAN, 1.0).is_nan());
    }
}

//! The elementary functions that models may call.
//!
//! One table for constant folding, interpretation and generated code, all on the `libm` crate, so that a trajectory does
//! not depend on the C library of the machine.  `abs`, `min`, `max`, `sqrt`, `floor` and `ceil` are exact everywhere
//! and generated code may inline them.

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

//! Functions of the language on values known at translation (Modelica 3.6, sections 3.7 and 10.3).

use crate::array::array_function;
use crate::value::{LARGEST_INTEGER, Value, binary};
use crate::work::{MAX_VALUES, volume};
use hyd_syntax::tree::BinaryOp;
use hyd_system::math::Function;

/// Functions of the language on values.
pub(crate) fn builtin(name: &str, values: &[Value]) -> Option<Value> {
    let real = |k: usize| values.get(k).and_then(Value::as_real);
    let integer = |k: usize| values.get(k).and_then(Value::as_integer);
    let filled = |value: Value, sizes: &[Value]| {
        let sizes: Vec<usize> =
            sizes.iter().map(|size| usize::try_from(size.as_integer()?).ok()).collect::<Option<_>>()?;
        volume(&sizes)?;
        Some(sizes.iter().rev().fold(value, |inner, &count| Value::array(vec![inner; count])))
    };
    match name {
        "zeros" => return filled(Value::Integer(0), values),
        "ones" => return filled(Value::Integer(1), values),
        "fill" => return filled(values.first()?.clone(), values.get(1..)?),
        "identity" => {
            let n = usize::try_from(integer(0)?).ok().filter(|&n| volume(&[n, n]).is_some())?;
            let row = |i: usize| Value::array((0..n).map(|j| Value::Integer(i64::from(i == j))).collect());
            return Some(Value::array((0..n).map(row).collect()));
        }
        "linspace" => {
            let (a, b, n) = (real(0)?, real(1)?, integer(2)?);
            let count = usize::try_from(n).ok().filter(|&c| (2..=MAX_VALUES).contains(&c))?;
            let step = (b - a) / (count - 1) as f64;
            return Some(Value::array((0..count).map(|k| Value::Real(a + step * k as f64)).collect()));
        }
        "ndims" => return Some(Value::Integer(values.first()?.shape().len() as i64)),
        "diagonal" | "cat" | "vector" | "matrix" | "scalar" | "transpose" | "symmetric" | "outerProduct" | "cross"
        | "skew" => return array_function(name, values),
        "noEvent" | "homotopy" => return values.first().cloned(),
        "smooth" => return values.get(1).cloned(),
        "integer" => {
            let whole = real(0)?.floor();
            return (whole.abs() <= LARGEST_INTEGER as f64).then_some(Value::Integer(whole as i64));
        }
        "Integer" => {
            return match values.first()? {
                Value::Enumeration(_, k) => Some(Value::Integer(i64::from(*k))),
                _ => None,
            };
        }
        "sum" | "product" => {
            let (op, unit) = if name == "sum" { (BinaryOp::Add, 0) } else { (BinaryOp::Mul, 1) };
            return values.first()?.flatten().into_iter().try_fold(Value::Integer(unit), |a, b| binary(op, &a, b));
        }
        "min" | "max" => {
            let all: Vec<&Value> = values.iter().flat_map(Value::flatten).collect();
            let better = if name == "min" { BinaryOp::Less } else { BinaryOp::Greater };
            let mut best = *all.first()?;
            for value in all {
                if binary(better, value, best)? == Value::Boolean(true) {
                    best = value;
                }
            }
            return Some(best.clone());
        }
        "abs" => {
            if let Some(k) = integer(0) {
                return k.checked_abs().map(Value::Integer);
            }
        }
        "div" | "mod" | "rem" => {
            if let (Some(a), Some(b)) = (integer(0), integer(1)) {
                return match name {
                    "div" => a.checked_div(b),
                    "mod" => a.checked_rem_euclid(b).map(|m| if b < 0 && m != 0 { m + b } else { m }),
                    _ => a.checked_rem(b),
                }
                .map(Value::Integer);
            }
        }
        _ => {}
    }
    let function = Function::from_name(name)?;
    if values.len() != function.arity() {
        return None;
    }
    Some(Value::Real(function.apply(real(0)?, if function.arity() == 2 { real(1)? } else { 0.0 })))
}

/// True for functions of the language that have a value at translation.
pub(crate) fn is_known(name: &str) -> bool {
    const NAMES: &[&str] = &[
        "zeros",
        "ones",
        "fill",
        "identity",
        "linspace",
        "ndims",
        "size",
        "diagonal",
        "cat",
        "vector",
        "matrix",
        "scalar",
        "transpose",
        "symmetric",
        "outerProduct",
        "cross",
        "skew",
        "noEvent",
        "homotopy",
        "smooth",
        "integer",
        "Integer",
        "sum",
        "product",
        "min",
        "max",
        "String",
    ];
    NAMES.contains(&name) || Function::from_name(name).is_some()
}

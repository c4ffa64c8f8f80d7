//! Functions of the language on values known at translation (Modelica 3.6, sections 3.7 and 10.3).

use super::Builtin;
use super::arrays::array_function;
use crate::instantiation::work::{MAX_VALUES, volume};
use crate::values::arithmetic::binary;
use crate::values::value::{LARGEST_INTEGER, Value};
use hyd_syntax::tree::BinaryOp;
use hyd_system::math::Function;

/// A function of scalars called with arrays: once per element, scalars being the same for all (Modelica 3.6, section 12.4.6).
fn per_element(function: Builtin, values: &[Value]) -> Option<Value> {
    let count = values.iter().find_map(|value| match value {
        Value::Array(items) => Some(items.len()),
        _ => None,
    })?;
    let of = |k: usize| {
        let element = |given: &Value| match given {
            Value::Array(items) => (items.len() == count).then(|| items[k].clone()),
            scalar => Some(scalar.clone()),
        };
        value(function, &values.iter().map(element).collect::<Option<Vec<_>>>()?)
    };
    let list = (0..count).map(of).collect::<Option<_>>()?;
    let sizes = || values.iter().map(Value::shape).find(|sizes| !sizes.is_empty()).unwrap_or_default();
    Some(Value::array_of(list, || sizes().split_off(1)))
}

/// What a function of the language gives for these values; `None` where it gives none, or not for such values.
pub(crate) fn value(function: Builtin, values: &[Value]) -> Option<Value> {
    let real = |k: usize| values.get(k).and_then(Value::as_real);
    let integer = |k: usize| values.get(k).and_then(Value::as_integer);
    let filled = |value: Value, sizes: &[Value]| {
        let sizes: Vec<usize> =
            sizes.iter().map(|size| usize::try_from(size.as_integer()?).ok()).collect::<Option<_>>()?;
        volume(&sizes)?;
        Some(Value::filled(value, &sizes))
    };
    match function {
        Builtin::Zeros => return filled(Value::Integer(0), values),
        Builtin::Ones => return filled(Value::Integer(1), values),
        Builtin::Fill => return filled(values.first()?.clone(), values.get(1..)?),
        Builtin::Identity => return array_function(function, values),
        Builtin::Linspace => {
            let (a, b, n) = (real(0)?, real(1)?, integer(2)?);
            let count = usize::try_from(n).ok().filter(|&c| (2..=MAX_VALUES).contains(&c))?;
            let step = (b - a) / (count - 1) as f64;
            return Some(Value::array((0..count).map(|k| Value::Real(a + step * k as f64)).collect()));
        }
        Builtin::Ndims => return Some(Value::Integer(values.first()?.shape().len() as i64)),
        _ if function.is_array_function() => return array_function(function, values),
        Builtin::NoEvent | Builtin::Homotopy => return values.first().cloned(),
        Builtin::Smooth => return values.get(1).cloned(),
        Builtin::Floored if matches!(values.first(), Some(Value::Array(_))) => return per_element(function, values),
        Builtin::Floored => {
            let whole = real(0)?.floor();
            return (whole.abs() <= LARGEST_INTEGER as f64).then_some(Value::Integer(whole as i64));
        }
        Builtin::Ordinal => {
            return match values.first()? {
                Value::Enumeration(_, k) => Some(Value::Integer(i64::from(*k))),
                _ => None,
            };
        }
        Builtin::Sum | Builtin::Product => {
            let (op, unit) = if function == Builtin::Sum { (BinaryOp::Add, 0) } else { (BinaryOp::Mul, 1) };
            return values.first()?.flatten().into_iter().try_fold(Value::Integer(unit), |a, b| binary(op, &a, b));
        }
        Builtin::Min | Builtin::Max => {
            let all: Vec<&Value> = values.iter().flat_map(Value::flatten).collect();
            let better = if function == Builtin::Min { BinaryOp::Less } else { BinaryOp::Greater };
            let mut best = *all.first()?;
            for value in all {
                if binary(better, value, best)? == Value::Boolean(true) {
                    best = value;
                }
            }
            return Some(best.clone());
        }
        Builtin::Elementary(Function::Abs) => {
            if let Some(k) = integer(0) {
                return k.checked_abs().map(Value::Integer);
            }
        }
        Builtin::Elementary(whole @ (Function::Div | Function::Mod | Function::Rem)) => {
            if let (Some(a), Some(b)) = (integer(0), integer(1)) {
                return match whole {
                    Function::Div => a.checked_div(b),
                    Function::Mod => a.checked_rem_euclid(b).map(|m| if b < 0 && m != 0 { m + b } else { m }),
                    _ => a.checked_rem(b),
                }
                .map(Value::Integer);
            }
        }
        _ => {}
    }
    let Builtin::Elementary(function) = function else { return None };
    if values.iter().any(|value| matches!(value, Value::Array(_))) {
        return per_element(Builtin::Elementary(function), values);
    }
    if values.len() != function.arity() {
        return None;
    }
    Some(Value::Real(function.apply(real(0)?, if function.arity() == 2 { real(1)? } else { 0.0 })))
}

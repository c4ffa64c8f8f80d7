//! Functions of the language on values (3.7, 10.3).

use super::value::{Done, Dual, Value};

/// A function of one number, with its slope.
fn elementary(name: &str, x: Dual) -> Option<Dual> {
    let v = x.v;
    Some(match name {
        "sin" => x.map(v.sin(), v.cos()),
        "cos" => x.map(v.cos(), -v.sin()),
        "tan" => x.map(v.tan(), 1.0 + v.tan().powi(2)),
        "asin" => x.map(v.asin(), 1.0 / (1.0 - v * v).sqrt()),
        "acos" => x.map(v.acos(), -1.0 / (1.0 - v * v).sqrt()),
        "atan" => x.map(v.atan(), 1.0 / (1.0 + v * v)),
        "sinh" => x.map(v.sinh(), v.cosh()),
        "cosh" => x.map(v.cosh(), v.sinh()),
        "tanh" => x.map(v.tanh(), 1.0 - v.tanh().powi(2)),
        "exp" => x.map(v.exp(), v.exp()),
        "log" => x.map(v.ln(), 1.0 / v),
        "log10" => x.map(v.log10(), 1.0 / (v * std::f64::consts::LN_10)),
        "sqrt" => x.map(v.sqrt(), 0.5 / v.sqrt()),
        "abs" => x.map(v.abs(), if v < 0.0 { -1.0 } else { 1.0 }),
        "sign" => Dual::fixed(if v == 0.0 { 0.0 } else { v.signum() }),
        _ => return None,
    })
}

/// Whether this is a function of one number that causes no events.
pub(super) fn is_elementary(name: &str) -> bool {
    elementary(name, Dual::default()).is_some()
}

/// A function of one number, applied to each.
pub(super) fn one(name: &str, value: &Value) -> Done<Value> {
    if !is_elementary(name) {
        return Err(format!("no function {name}"));
    }
    Ok(value.each(&|x| elementary(name, x).unwrap_or(x)))
}

fn numbers(value: &Value) -> Vec<Dual> {
    let mut list = Vec::new();
    value.flat(&mut list);
    list
}

fn whole(value: &Value) -> Done<usize> {
    Ok(value.scalar()?.v as usize)
}

/// The extreme of a list; `larger`: the largest.
fn extreme(list: &[Dual], larger: bool) -> Done<Dual> {
    let better = |a: Dual, b: Dual| if (b.v > a.v) == larger && b.v != a.v { b } else { a };
    list.iter().copied().reduce(better).ok_or_else(|| "extreme of nothing".to_string())
}

/// Sum, product or extreme of a list.
pub(super) fn reduce(name: &str, list: &[Dual]) -> Done<Dual> {
    match name {
        "sum" => Ok(list.iter().fold(Dual::default(), |a, b| Dual { v: a.v + b.v, d: a.d + b.d })),
        "product" => Ok(list.iter().fold(Dual::fixed(1.0), |a, b| Dual { v: a.v * b.v, d: a.d * b.v + a.v * b.d })),
        "min" => extreme(list, false),
        "max" => extreme(list, true),
        _ => Err(format!("no reduction {name}")),
    }
}

fn filled(value: &Value, sizes: &[usize]) -> Value {
    match sizes {
        [] => value.clone(),
        [n, rest @ ..] => Value::Array(vec![filled(value, rest); *n]),
    }
}

/// Applies a function of the language that causes no events.
pub(super) fn apply(name: &str, arguments: &[Value]) -> Done<Value> {
    let first = arguments.first().ok_or("no argument")?;
    match (name, arguments) {
        ("sum" | "product" | "min" | "max", [one]) => Ok(Value::Scalar(reduce(name, &numbers(one))?)),
        ("min" | "max", [a, b]) => Ok(Value::Scalar(extreme(&[a.scalar()?, b.scalar()?], name == "max")?)),
        ("atan2", [y, x]) => {
            let (y, x) = (y.scalar()?, x.scalar()?);
            let square = x.v * x.v + y.v * y.v;
            Ok(Value::Scalar(Dual { v: y.v.atan2(x.v), d: (x.v * y.d - y.v * x.d) / square }))
        }
        ("zeros", sizes) => Ok(filled(&Value::number(0.0), &sizes.iter().map(whole).collect::<Done<Vec<_>>>()?)),
        ("ones", sizes) => Ok(filled(&Value::number(1.0), &sizes.iter().map(whole).collect::<Done<Vec<_>>>()?)),
        ("fill", [value, sizes @ ..]) => Ok(filled(value, &sizes.iter().map(whole).collect::<Done<Vec<_>>>()?)),
        ("identity", [n]) => {
            let n = whole(n)?;
            let row = |i: usize| Value::Array((0..n).map(|j| Value::number(f64::from(i == j))).collect());
            Ok(Value::Array((0..n).map(row).collect()))
        }
        ("linspace", [a, b, n]) => {
            let (a, b, n) = (a.scalar()?, b.scalar()?, whole(n)?);
            let at = |k: usize| {
                let share = k as f64 / (n - 1) as f64;
                Value::Scalar(Dual { v: a.v + share * (b.v - a.v), d: a.d + share * (b.d - a.d) })
            };
            Ok(Value::Array((0..n).map(at).collect()))
        }
        ("cat", [_, parts @ ..]) => {
            let mut all = Vec::new();
            for part in parts {
                all.extend_from_slice(part.elements()?);
            }
            Ok(Value::Array(all))
        }
        ("transpose", [matrix]) => {
            let rows = matrix.elements()?;
            let columns = rows.first().ok_or("empty matrix")?.elements()?.len();
            let column = |j: usize| rows.iter().map(|row| Ok(row.elements()?[j].clone())).collect::<Done<Vec<_>>>();
            Ok(Value::Array((0..columns).map(|j| column(j).map(Value::Array)).collect::<Done<_>>()?))
        }
        ("size", [array, dimension]) => {
            let mut value = array;
            for _ in 1..whole(dimension)? {
                value = value.elements()?.first().ok_or("empty array")?;
            }
            Ok(Value::number(value.elements()?.len() as f64))
        }
        (_, [value]) => one(name, value),
        _ => Err(format!("{name} of {} arguments, the first {first:?}", arguments.len())),
    }
}

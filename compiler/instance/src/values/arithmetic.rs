//! Arithmetic on values known at translation.
//!
//! Follows the element-wise rules of Modelica 3.6, section 10.6; an operation without a meaning gives `None` and the caller words the
//! message.

use hyd_syntax::tree::BinaryOp;

use crate::values::value::{Items, LARGEST_INTEGER, Value};

/// `a op b` for every operator of the language.
pub(crate) fn binary(op: BinaryOp, a: &Value, b: &Value) -> Option<Value> {
    use BinaryOp as Op;
    match (op, a, b) {
        (Op::Add | Op::Sub | Op::ElementAdd | Op::ElementSub, Value::Array(x), Value::Array(y)) => zip(op, x, y),
        (Op::ElementMul | Op::ElementDiv | Op::ElementPow, Value::Array(x), Value::Array(y)) => zip(op, x, y),
        (Op::Mul, Value::Array(x), Value::Array(y)) => product(x, y),
        (
            Op::Mul | Op::ElementAdd | Op::ElementSub | Op::ElementMul | Op::ElementDiv | Op::ElementPow,
            s,
            Value::Array(y),
        ) => y.try_map(|v| binary(op, s, v)),
        (
            Op::Mul | Op::Div | Op::ElementAdd | Op::ElementSub | Op::ElementMul | Op::ElementDiv | Op::ElementPow,
            Value::Array(x),
            s,
        ) => x.try_map(|v| binary(op, v, s)),
        (Op::And, Value::Boolean(x), Value::Boolean(y)) => Some(Value::Boolean(*x && *y)),
        (Op::Or, Value::Boolean(x), Value::Boolean(y)) => Some(Value::Boolean(*x || *y)),
        (Op::Add, Value::Text(x), Value::Text(y)) => Some(Value::Text(format!("{x}{y}").into())),
        (Op::Equal | Op::NotEqual | Op::Less | Op::LessEqual | Op::Greater | Op::GreaterEqual, _, _) => {
            compare(op, a, b).map(Value::Boolean)
        }
        (_, Value::Integer(x), Value::Integer(y)) => integers(op, *x, *y),
        _ => reals(op, a.as_real()?, b.as_real()?),
    }
}

fn zip(op: BinaryOp, x: &Items, y: &Items) -> Option<Value> {
    if x.len() != y.len() || x.is_empty() && x.sizes() != y.sizes() {
        return None;
    }
    let list = x.iter().zip(y.iter()).map(|(a, b)| binary(op, a, b)).collect::<Option<_>>()?;
    Some(Value::array_of(list, || x.sizes()))
}

/// Scalar product, matrix times vector, vector times matrix, matrix times matrix.
fn product(x: &Items, y: &Items) -> Option<Value> {
    let (of_x, of_y) = (x.sizes(), y.sizes());
    let inner = of_x.first().copied().unwrap_or(x.len());
    if inner != y.len() || of_x.len() > 1 || of_y.len() > 1 {
        return None;
    }
    if of_x.is_empty() {
        return match of_y.as_slice() {
            // Sums without terms.
            [columns, ..] if y.is_empty() => Some(Value::filled(Value::Integer(0), &[*columns])),
            _ => sum_of_products(x, y),
        };
    }
    let row = |row: &Value| match row {
        Value::Array(row) => product(row, y),
        _ => None,
    };
    let rows = x.iter().map(row).collect::<Option<_>>()?;
    Some(Value::array_of(rows, || of_y))
}

fn sum_of_products(x: &[Value], y: &[Value]) -> Option<Value> {
    let mut sum = None;
    for (a, b) in x.iter().zip(y) {
        let term = binary(BinaryOp::Mul, a, b)?;
        sum = Some(match sum {
            None => term,
            Some(before) => binary(BinaryOp::Add, &before, &term)?,
        });
    }
    Some(sum.unwrap_or(Value::Integer(0)))
}

fn compare(op: BinaryOp, a: &Value, b: &Value) -> Option<bool> {
    use std::cmp::Ordering;
    let order = match (a, b) {
        (Value::Boolean(x), Value::Boolean(y)) => x.cmp(y),
        (Value::Text(x), Value::Text(y)) => x.cmp(y),
        (Value::Integer(x), Value::Integer(y)) => x.cmp(y),
        (Value::Enumeration(t, x), Value::Enumeration(u, y)) if t == u => x.cmp(y),
        _ => a.as_real()?.partial_cmp(&b.as_real()?)?,
    };
    Some(match op {
        BinaryOp::Equal => order == Ordering::Equal,
        BinaryOp::NotEqual => order != Ordering::Equal,
        BinaryOp::Less => order == Ordering::Less,
        BinaryOp::LessEqual => order != Ordering::Greater,
        BinaryOp::Greater => order == Ordering::Greater,
        _ => order != Ordering::Less,
    })
}

fn integers(op: BinaryOp, x: i64, y: i64) -> Option<Value> {
    use BinaryOp as Op;
    let exact = |k: i64| (k.unsigned_abs() <= LARGEST_INTEGER as u64).then_some(Value::Integer(k));
    match op {
        Op::Add | Op::ElementAdd => x.checked_add(y).and_then(exact),
        Op::Sub | Op::ElementSub => x.checked_sub(y).and_then(exact),
        Op::Mul | Op::ElementMul => x.checked_mul(y).and_then(exact),
        _ => reals(op, x as f64, y as f64),
    }
}

fn reals(op: BinaryOp, x: f64, y: f64) -> Option<Value> {
    use BinaryOp as Op;
    let value = match op {
        Op::Add | Op::ElementAdd => x + y,
        Op::Sub | Op::ElementSub => x - y,
        Op::Mul | Op::ElementMul => x * y,
        Op::Div | Op::ElementDiv => x / y,
        Op::Pow | Op::ElementPow => hyd_system::math::Function::Pow.apply(x, y),
        _ => return None,
    };
    Some(Value::Real(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(values: &[i64]) -> Value {
        Value::array(values.iter().map(|&k| Value::Integer(k)).collect())
    }

    /// Sizes of section 10.7: sums over nothing are 0, and what has no elements keeps its sizes.
    #[test]
    fn arrays_without_elements_have_sizes() {
        let zeros = |sizes: &[usize]| Value::filled(Value::Integer(0), sizes);
        let multiply = |a: &Value, b: &Value| binary(BinaryOp::Mul, a, b);
        for sizes in [&[0, 2][..], &[2, 0], &[0, 0], &[2, 0, 3]] {
            let value = zeros(sizes);
            assert_eq!(value.shape(), sizes);
            assert_eq!(value.negate().map(|value| value.shape()).as_deref(), Some(sizes));
            assert_eq!(multiply(&Value::Real(2.0), &value).map(|value| value.shape()).as_deref(), Some(sizes));
            assert_eq!(binary(BinaryOp::Add, &value, &value).map(|value| value.shape()).as_deref(), Some(sizes));
        }
        assert_eq!(multiply(&zeros(&[2, 0]), &zeros(&[0, 3])), Some(zeros(&[2, 3])));
        assert_eq!(multiply(&zeros(&[0, 2]), &zeros(&[2, 3])), Some(zeros(&[0, 3])));
        assert_eq!(multiply(&zeros(&[0]), &zeros(&[0, 3])), Some(zeros(&[3])));
        assert_eq!(multiply(&zeros(&[0]), &zeros(&[0])), Some(Value::Integer(0)));
        assert_eq!(binary(BinaryOp::Add, &zeros(&[0, 2]), &zeros(&[0, 3])), None);
        assert_eq!(multiply(&zeros(&[0, 2]), &zeros(&[3, 3])), None);
    }

    #[test]
    fn products_follow_the_linear_algebra() {
        let a = Value::array(vec![row(&[1, 2]), row(&[3, 4])]);
        assert_eq!(binary(BinaryOp::Mul, &a, &row(&[5, 6])), Some(row(&[17, 39])));
        assert_eq!(binary(BinaryOp::Mul, &row(&[5, 6]), &a), Some(row(&[23, 34])));
        assert_eq!(binary(BinaryOp::Mul, &row(&[1, 2]), &row(&[3, 4])), Some(Value::Integer(11)));
        assert_eq!(binary(BinaryOp::Add, &row(&[1, 2]), &row(&[3])), None);
        assert_eq!(binary(BinaryOp::Div, &Value::Integer(1), &Value::Integer(2)), Some(Value::Real(0.5)));
    }
}

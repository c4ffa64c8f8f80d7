//! Constructors of arrays on values known at translation (Modelica 3.6, sections 10.3 and 10.4).

use hyd_syntax::tree::BinaryOp;

use super::Builtin;
use crate::instantiation::work::volume;
use crate::values::value::{Value, binary};

/// The value of a function that rearranges arrays; `None` if it is another one or the arguments do not fit.
pub(super) fn array_function(function: Builtin, values: &[Value]) -> Option<Value> {
    match (function, values) {
        (Builtin::Diagonal, [Value::Array(v)]) => {
            volume(&[v.len(), v.len()])?;
            let row = |i: usize| {
                Value::array((0..v.len()).map(|j| if i == j { v[i].clone() } else { Value::Integer(0) }).collect())
            };
            Some(Value::array((0..v.len()).map(row).collect()))
        }
        (Builtin::Cat, [k, rest @ ..]) => {
            let k = usize::try_from(k.as_integer()? - 1).ok()?;
            concatenate(k, rest)
        }
        (Builtin::Vector, [value]) => {
            let long = value.shape().iter().filter(|&&size| size > 1).count();
            (long <= 1).then(|| Value::array(value.flatten().into_iter().cloned().collect()))
        }
        (Builtin::Matrix, [value]) => promoted(value, 2),
        (Builtin::Scalar, [value]) => match value.flatten().as_slice() {
            [only] => Some((*only).clone()),
            _ => None,
        },
        (Builtin::Transpose, [Value::Array(rows)]) => {
            let columns = value_row(rows.first()?)?.len();
            let column = |j: usize| rows.iter().map(|r| value_row(r)?.get(j).cloned()).collect::<Option<_>>();
            (0..columns).map(|j| column(j).map(Value::array)).collect::<Option<_>>().map(Value::array)
        }
        (Builtin::Symmetric, [Value::Array(rows)]) => {
            let at = |i: usize, j: usize| value_row(rows.get(i.min(j))?)?.get(i.max(j)).cloned();
            let n = rows.len();
            let row = |i: usize| (0..n).map(|j| at(i, j)).collect::<Option<_>>().map(Value::array);
            (0..n).map(row).collect::<Option<_>>().map(Value::array)
        }
        (Builtin::OuterProduct, [Value::Array(a), b @ Value::Array(row)]) => {
            volume(&[a.len(), row.len()])?;
            a.iter().map(|x| binary(BinaryOp::Mul, x, b)).collect::<Option<_>>().map(Value::array)
        }
        (Builtin::Cross, [Value::Array(x), Value::Array(y)]) if x.len() == 3 && y.len() == 3 => {
            let minor = |i: usize, j: usize| {
                binary(BinaryOp::Sub, &binary(BinaryOp::Mul, &x[i], &y[j])?, &binary(BinaryOp::Mul, &x[j], &y[i])?)
            };
            Some(Value::array(vec![minor(1, 2)?, minor(2, 0)?, minor(0, 1)?]))
        }
        (Builtin::Skew, [Value::Array(x)]) if x.len() == 3 => {
            let (zero, minus) = (Value::Integer(0), |k: usize| x[k].negate());
            let rows = [
                vec![zero.clone(), minus(2)?, x[1].clone()],
                vec![x[2].clone(), zero.clone(), minus(0)?],
                vec![minus(1)?, x[0].clone(), zero],
            ];
            Some(Value::array(rows.map(Value::array).to_vec()))
        }
        _ => None,
    }
}

fn value_row(value: &Value) -> Option<&Vec<Value>> {
    match value {
        Value::Array(items) => Some(items),
        _ => None,
    }
}

/// A value with sizes of 1 added at the end up to `rank`; `None` if it has more dimensions.
fn promoted(value: &Value, rank: usize) -> Option<Value> {
    let missing = rank.checked_sub(value.shape().len())?;
    fn deepen(value: &Value, missing: usize) -> Value {
        match value {
            Value::Array(items) => Value::array(items.iter().map(|v| deepen(v, missing)).collect()),
            scalar => (0..missing).fold(scalar.clone(), |inner, _| Value::array(vec![inner])),
        }
    }
    Some(deepen(value, missing))
}

/// Arrays put together along dimension `k` (from 0); the other sizes must agree.
fn concatenate(k: usize, parts: &[Value]) -> Option<Value> {
    if k == 0 {
        let mut items = Vec::new();
        let inner = parts.iter().find_map(|p| value_row(p)?.first().map(Value::shape));
        for part in parts {
            let row = value_row(part)?;
            if row.first().map(Value::shape).is_some_and(|shape| Some(shape) != inner) {
                return None;
            }
            items.extend(row.iter().cloned());
        }
        return Some(Value::array(items));
    }
    let rows = value_row(parts.first()?)?.len();
    let mut result = Vec::with_capacity(rows);
    for i in 0..rows {
        let slices: Option<Vec<Value>> =
            parts.iter().map(|part| value_row(part).filter(|r| r.len() == rows)?.get(i).cloned()).collect();
        result.push(concatenate(k - 1, &slices?)?);
    }
    Some(Value::array(result))
}

/// `[a, b; c, d]`: parts side by side in rows, rows below each other; a vector is a column (10.4.2).
pub(crate) fn matrix(rows: &[Vec<Value>]) -> Option<Value> {
    let mut done = Vec::with_capacity(rows.len());
    for row in rows {
        let parts: Option<Vec<Value>> = row.iter().map(|value| promoted(value, 2)).collect();
        done.push(concatenate(1, &parts?)?);
    }
    concatenate(0, &done)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(values: &[i64]) -> Value {
        Value::array(values.iter().map(|&k| Value::Integer(k)).collect())
    }

    fn rows(values: &[&[i64]]) -> Value {
        Value::array(values.iter().map(|r| row(r)).collect())
    }

    /// Values worked out by hand from the definitions of section 10.3.5.
    #[test]
    fn constructors_follow_their_definitions() {
        let of = array_function;
        assert_eq!(of(Builtin::Diagonal, &[row(&[1, 2])]), Some(rows(&[&[1, 0], &[0, 2]])));
        assert_eq!(of(Builtin::Cross, &[row(&[1, 2, 3]), row(&[4, 5, 6])]), Some(row(&[-3, 6, -3])));
        assert_eq!(of(Builtin::Skew, &[row(&[1, 2, 3])]), Some(rows(&[&[0, -3, 2], &[3, 0, -1], &[-2, 1, 0]])));
        assert_eq!(of(Builtin::Symmetric, &[rows(&[&[1, 2], &[9, 3]])]), Some(rows(&[&[1, 2], &[2, 3]])));
        assert_eq!(of(Builtin::OuterProduct, &[row(&[1, 2]), row(&[3, 4])]), Some(rows(&[&[3, 4], &[6, 8]])));
        let two = Value::Integer(2);
        assert_eq!(
            of(Builtin::Cat, &[two, rows(&[&[1], &[2]]), rows(&[&[3, 4], &[5, 6]])]),
            Some(rows(&[&[1, 3, 4], &[2, 5, 6]]))
        );
        assert_eq!(of(Builtin::Cat, &[Value::Integer(1), row(&[1]), rows(&[&[2]])]), None);
        assert_eq!(matrix(&[vec![row(&[1, 2]), row(&[3, 4])]]), Some(rows(&[&[1, 3], &[2, 4]])));
    }
}

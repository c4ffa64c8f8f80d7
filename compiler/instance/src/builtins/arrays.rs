//! Constructors of arrays on values known at translation (Modelica 3.6, sections 10.3 and 10.4).

use hyd_syntax::tree::BinaryOp;

use super::elements::Element;
use super::{Builtin, SizeFault, SizesOf};
use crate::instantiation::work::volume;
use crate::values::arithmetic::binary;
use crate::values::value::{Items, Value};

/// Arguments that are values.
struct Given<'a>(&'a [Value]);

impl SizesOf for Given<'_> {
    type Fail = ();

    fn count(&self) -> usize {
        self.0.len()
    }

    fn sizes(&mut self, k: usize) -> Result<Vec<usize>, ()> {
        Ok(self.0[k].shape())
    }

    fn number(&mut self, k: usize) -> Result<usize, ()> {
        self.0[k].as_integer().and_then(|k| usize::try_from(k).ok()).ok_or(())
    }

    fn fault(&mut self, _: SizeFault) {}
}

/// The value of `identity` or of a function that rearranges arrays; `None` if it is another one or the arguments do not fit.
pub(super) fn array_function(function: Builtin, values: &[Value]) -> Option<Value> {
    match (function, values) {
        (Builtin::Cat, [k, rest @ ..]) => concatenate(usize::try_from(k.as_integer()? - 1).ok()?, rest),
        _ => {
            let sizes = function.sizes(&mut Given(values)).ok()?;
            volume(&sizes)?;
            elements(function, values, &sizes, &mut Vec::with_capacity(sizes.len()))
        }
    }
}

/// The elements whose index begins with `at`.
fn elements(function: Builtin, values: &[Value], sizes: &[usize], at: &mut Vec<usize>) -> Option<Value> {
    if let Some(&size) = sizes.get(at.len()) {
        let mut items = Vec::with_capacity(size);
        for k in 0..size {
            at.push(k);
            items.push(elements(function, values, sizes, at)?);
            at.pop();
        }
        return Some(Value::array_of(items, || sizes[at.len() + 1..].to_vec()));
    }
    let of = |k: usize, at: &[usize]| at.iter().try_fold(&values[k], |value, &k| value_row(value)?.get(k));
    let product = |a: &[usize], b: &[usize]| binary(BinaryOp::Mul, of(0, a)?, of(1, b)?);
    match function.element(&mut Given(values), at.as_slice()).ok()?? {
        Element::Number(k) => Some(Value::Integer(k)),
        Element::Of(k, at) => of(k, &at).cloned(),
        Element::Minus(at) => of(0, &at)?.negate(),
        Element::Product(a, b) => product(&a, &b),
        Element::Minor(j, k) => binary(BinaryOp::Sub, &product(&[j], &[k])?, &product(&[k], &[j])?),
    }
}

fn value_row(value: &Value) -> Option<&Items> {
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
            Value::Array(items) => {
                let sizes = || items.sizes().into_iter().chain(std::iter::repeat_n(1, missing)).collect();
                Value::array_of(items.iter().map(|v| deepen(v, missing)).collect(), sizes)
            }
            scalar => Value::filled(scalar.clone(), &vec![1; missing]),
        }
    }
    Some(deepen(value, missing))
}

/// Arrays put together along dimension `k` (from 0); the other sizes must agree.
fn concatenate(k: usize, parts: &[Value]) -> Option<Value> {
    let mut sizes = parts.first()?.shape();
    for part in &parts[1..] {
        let mut other = part.shape();
        let (all, more) = (sizes.get_mut(k)?, *other.get(k)?);
        *all += more;
        other[k] = *all;
        if sizes != other {
            return None;
        }
    }
    joined(k, parts, &sizes)
}

/// Arrays put together whose sizes fit, `sizes` together.
fn joined(k: usize, parts: &[Value], sizes: &[usize]) -> Option<Value> {
    let (&count, inner) = sizes.split_first()?;
    let mut items = Vec::with_capacity(count);
    if k == 0 {
        for part in parts {
            items.extend(value_row(part)?.iter().cloned());
        }
    } else {
        for i in 0..count {
            let slices: Option<Vec<Value>> = parts.iter().map(|part| value_row(part)?.get(i).cloned()).collect();
            items.push(joined(k - 1, &slices?, inner)?);
        }
    }
    Some(Value::array_of(items, || inner.to_vec()))
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
        let none = |sizes: &[usize]| Value::filled(Value::Integer(0), sizes);
        assert_eq!(of(Builtin::Transpose, &[none(&[0, 3])]), Some(none(&[3, 0])));
        assert_eq!(of(Builtin::Symmetric, &[none(&[0, 0])]), Some(none(&[0, 0])));
        assert_eq!(matrix(&[vec![none(&[0, 2])], vec![row(&[1]), row(&[2])]]), Some(rows(&[&[1, 2]])));
        assert_eq!(matrix(&[vec![none(&[0, 3])], vec![row(&[1]), row(&[2])]]), None);
        assert_eq!(matrix(&[vec![none(&[2, 0]), rows(&[&[1], &[2]])]]), Some(rows(&[&[1], &[2]])));
    }
}

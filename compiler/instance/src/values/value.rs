//! Values known at translation, and arithmetic on them.
//!
//! Used for array sizes, conditions, loop ranges, attributes and constants.  Follows the element-wise rules of
//! Modelica 3.6, section 10.6; an operation without a meaning gives `None` and the caller words the message.

use std::sync::Arc;

use hyd_syntax::tree::{BinaryOp, Name};

use crate::classes::class::ClassId;
use crate::external::Object;

/// An enumeration type.
#[derive(Debug, PartialEq, Eq)]
pub struct EnumType {
    /// Full name.
    pub name: Name,
    /// Literals in order.
    pub literals: Vec<Name>,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A real number.
    Real(f64),
    /// An integer.
    Integer(i64),
    /// A truth value.
    Boolean(bool),
    /// A string.
    Text(Name),
    /// A literal, counted from 1.
    Enumeration(Arc<EnumType>, u32),
    /// An array; all elements have the same shape.  Shared, so that a function may pass on and read a long one for nothing.
    Array(Arc<Items>),
    /// A record: its fields in order; one that has no value yet is not among them.
    Record(Arc<Fields>),
    /// An external object.
    Object(Arc<Object>),
}

/// The fields of a record, and the class that says what operators mean for it.
#[derive(Clone, Debug)]
pub struct Fields {
    /// Its class.
    pub class: ClassId,
    /// The fields.
    pub list: Vec<(Name, Value)>,
}

/// Records of the same fields are equal whatever their classes are called (Modelica 3.6, section 6.7).
impl PartialEq for Fields {
    fn eq(&self, other: &Self) -> bool {
        self.list == other.list
    }
}

/// The elements of an array along its first dimension.  An array without elements has sizes, too (Modelica 3.6, section 10.7): where there
/// are none, those that an element would have are kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Items {
    list: Vec<Value>,
    of_none: Vec<usize>,
}

impl Items {
    /// These elements; `sizes` says the sizes of one where there are none.
    fn new(list: Vec<Value>, sizes: impl FnOnce() -> Vec<usize>) -> Self {
        let of_none = if list.is_empty() { sizes() } else { Vec::new() };
        Self { list, of_none }
    }

    /// Sizes of an element.
    pub fn sizes(&self) -> Vec<usize> {
        self.list.first().map_or_else(|| self.of_none.clone(), Value::shape)
    }

    /// The array of what `f` makes of each element, of the same sizes; `None` where it makes nothing of one.
    pub(crate) fn try_map(&self, f: impl FnMut(&Value) -> Option<Value>) -> Option<Value> {
        self.list.iter().map(f).collect::<Option<_>>().map(|list| Value::array_of(list, || self.of_none.clone()))
    }
}

impl std::ops::Deref for Items {
    type Target = [Value];

    fn deref(&self) -> &[Value] {
        &self.list
    }
}

impl std::ops::DerefMut for Items {
    fn deref_mut(&mut self) -> &mut [Value] {
        &mut self.list
    }
}

/// The largest integer that is exact in the run, where an Integer is a double, together with all below.
pub const LARGEST_INTEGER: i64 = (1 << 53) - 1;

impl Value {
    /// An array of these elements; a vector if there are none.
    pub fn array(items: Vec<Value>) -> Self {
        Self::array_of(items, Vec::new)
    }

    /// An array of these elements, which have the sizes that `sizes` says if there are none.
    pub fn array_of(items: Vec<Value>, sizes: impl FnOnce() -> Vec<usize>) -> Self {
        Value::Array(Arc::new(Items::new(items, sizes)))
    }

    /// An array with these sizes whose elements are all `value`; without sizes the value itself.
    pub fn filled(value: Value, sizes: &[usize]) -> Self {
        sizes.iter().rev().fold(value, |inner, &count| Self::array_of(vec![inner.clone(); count], || inner.shape()))
    }

    /// An array with these sizes, of elements in the order of [`Value::flatten`], as many as the sizes say.
    pub fn nested(elements: Vec<Value>, sizes: &[usize]) -> Self {
        let Some((_, inner)) = sizes.split_first() else {
            return elements.into_iter().next().unwrap_or(Value::Real(0.0));
        };
        if elements.is_empty() {
            return Self::filled(Value::Real(0.0), sizes);
        }
        let mut values = elements;
        for &size in inner.iter().rev() {
            values = values.chunks(size.max(1)).map(|row| Value::array(row.to_vec())).collect();
        }
        Value::array(values)
    }

    /// The number, if it is one (Booleans and literals are not).
    pub fn as_real(&self) -> Option<f64> {
        match self {
            Value::Real(x) => Some(*x),
            Value::Integer(k) => Some(*k as f64),
            _ => None,
        }
    }

    /// The integer, if it is one.
    pub fn as_integer(&self) -> Option<i64> {
        match self {
            Value::Integer(k) => Some(*k),
            _ => None,
        }
    }

    /// How the value is stored in a run: Booleans as 0 and 1, literals by number.  `None` for strings and arrays.
    pub fn as_stored(&self) -> Option<f64> {
        match self {
            Value::Boolean(b) => Some(f64::from(u8::from(*b))),
            Value::Enumeration(_, k) => Some(f64::from(*k)),
            Value::Text(_) | Value::Array(_) | Value::Record(_) | Value::Object(_) => None,
            number => number.as_real(),
        }
    }

    /// Its elements along the first dimension; a scalar is one by itself.
    pub fn items(self) -> Arc<Items> {
        match self {
            Value::Array(items) => items,
            scalar => Arc::new(Items::new(vec![scalar], Vec::new)),
        }
    }

    /// The first scalar element.
    pub fn first(&self) -> Option<&Value> {
        match self {
            Value::Array(items) => items.first()?.first(),
            scalar => Some(scalar),
        }
    }

    /// Sizes, outermost first; empty for a scalar.
    pub fn shape(&self) -> Vec<usize> {
        match self {
            Value::Array(items) => {
                let mut shape = vec![items.len()];
                shape.extend(items.sizes());
                shape
            }
            _ => Vec::new(),
        }
    }

    /// All scalar elements, last subscript fastest.
    pub fn flatten(&self) -> Vec<&Value> {
        match self {
            Value::Array(items) => items.iter().flat_map(Value::flatten).collect(),
            scalar => vec![scalar],
        }
    }

    /// The scalar element at this position of [`Value::flatten`], found without going through those before it: the rows of an array
    /// have the same sizes.
    pub fn scalar_at(&self, position: usize) -> Option<&Value> {
        let Value::Array(items) = self else { return (position == 0).then_some(self) };
        let row: usize = items.first()?.shape().iter().product();
        items.get(position.checked_div(row)?)?.scalar_at(position % row)
    }

    /// The element if all are equal (an array counts as its elements).
    pub fn uniform(&self) -> Option<&Value> {
        let first = self.scalar_at(0)?;
        self.is_all(first).then_some(first)
    }

    fn is_all(&self, wanted: &Value) -> bool {
        match self {
            Value::Array(items) => items.iter().all(|item| item.is_all(wanted)),
            scalar => scalar == wanted,
        }
    }

    /// Name of its type for messages.
    pub fn type_name(&self) -> String {
        match self {
            Value::Real(_) => "Real".into(),
            Value::Integer(_) => "Integer".into(),
            Value::Boolean(_) => "Boolean".into(),
            Value::Text(_) => "String".into(),
            Value::Enumeration(e, _) => e.name.to_string(),
            Value::Array(items) => {
                let inner = items.first().map_or_else(|| "empty".into(), Value::type_name);
                format!("array of {}", inner.trim_start_matches("array of "))
            }
            Value::Record(_) => "a record".into(),
            Value::Object(_) => "an external object".into(),
        }
    }

    /// The value as it is written.
    pub fn text(&self) -> String {
        match self {
            Value::Real(x) => x.to_string(),
            Value::Integer(k) => k.to_string(),
            Value::Boolean(b) => b.to_string(),
            Value::Text(text) => format!("\"{text}\""),
            Value::Enumeration(e, k) => {
                e.literals.get((*k as usize).saturating_sub(1)).map(|l| l.to_string()).unwrap_or_default()
            }
            Value::Array(items) => format!("{{{}}}", items.iter().map(Value::text).collect::<Vec<_>>().join(",")),
            Value::Record(fields) => {
                let fields: Vec<String> = fields.list.iter().map(|(n, v)| format!("{n} = {}", v.text())).collect();
                format!("({})", fields.join(", "))
            }
            Value::Object(object) => format!("{}(...)", object.made_by),
        }
    }

    /// `-a`
    pub fn negate(&self) -> Option<Value> {
        match self {
            Value::Real(x) => Some(Value::Real(-x)),
            Value::Integer(k) => Some(Value::Integer(k.checked_neg()?)),
            Value::Array(items) => items.try_map(Value::negate),
            _ => None,
        }
    }

    /// A field of a record, or of each record of an array.
    pub fn field(&self, name: &str) -> Option<Value> {
        match self {
            Value::Record(fields) => fields.list.iter().find(|(n, _)| n.as_ref() == name).map(|(_, v)| v.clone()),
            Value::Array(items) => items.try_map(|v| v.field(name)),
            _ => None,
        }
    }

    /// The element at 1-based subscripts.
    pub fn element(&self, subscripts: &[usize]) -> Option<&Value> {
        match (self, subscripts.split_first()) {
            (value, None) => Some(value),
            (Value::Array(items), Some((&k, rest))) => items.get(k.checked_sub(1)?)?.element(rest),
            _ => None,
        }
    }
}

/// The first element along `depth` dimensions if all are equal.
pub(crate) fn first_if_uniform(value: &Value, depth: usize) -> Option<Value> {
    if depth == 0 {
        return Some(value.clone());
    }
    let Value::Array(items) = value else { return None };
    let first = first_if_uniform(items.first()?, depth - 1)?;
    items.iter().all(|v| first_if_uniform(v, depth - 1).as_ref() == Some(&first)).then_some(first)
}

/// Integers as reals, in arrays too.
pub(crate) fn widen(value: Value) -> Value {
    match value {
        Value::Integer(k) => Value::Real(k as f64),
        Value::Array(items) if items.iter().any(has_integers) => {
            Value::array(items.iter().cloned().map(widen).collect())
        }
        other => other,
    }
}

fn has_integers(value: &Value) -> bool {
    match value {
        Value::Integer(_) => true,
        Value::Array(items) => items.iter().any(has_integers),
        _ => false,
    }
}

/// `a op b` for every operator of the language.
pub fn binary(op: BinaryOp, a: &Value, b: &Value) -> Option<Value> {
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
    if x.len() != y.len() || x.is_empty() && x.of_none != y.of_none {
        return None;
    }
    let list = x.iter().zip(y.iter()).map(|(a, b)| binary(op, a, b)).collect::<Option<_>>()?;
    Some(Value::array_of(list, || x.of_none.clone()))
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

    #[test]
    fn elements_are_found_where_flattening_puts_them() {
        let array = |items: Vec<Value>| Value::array(items);
        let row = |first: i64| array((first..first + 3).map(Value::Integer).collect());
        let cube = array(vec![array(vec![row(0), row(3)]), array(vec![row(6), row(9)])]);
        for (k, value) in cube.flatten().into_iter().enumerate() {
            assert_eq!(cube.scalar_at(k), Some(value));
        }
        assert_eq!((cube.scalar_at(12), Value::Integer(7).scalar_at(0)), (None, Some(&Value::Integer(7))));
        assert_eq!((array(Vec::new()).scalar_at(0), Value::Integer(7).scalar_at(1)), (None, None));
        assert_eq!((cube.uniform(), array(vec![row(0), row(1)]).uniform()), (None, None));
        let same = array(vec![array(vec![Value::Integer(2)]), array(vec![Value::Integer(2)])]);
        assert_eq!(same.uniform(), Some(&Value::Integer(2)));
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

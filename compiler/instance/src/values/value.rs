//! Values known at translation: of array sizes, conditions, loop ranges, attributes and constants.

use std::sync::Arc;

use hyd_syntax::tree::Name;

use crate::classes::class::ClassId;
use crate::external::Object;

/// An enumeration type.
#[derive(Debug, PartialEq, Eq)]
pub struct EnumType {
    /// Full name.
    pub name: Name,
    /// Literals in order.
    pub literals: Vec<Name>,
    /// Their descriptions; one for each, or none at all.
    pub descriptions: Vec<Option<Name>>,
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
#[derive(Clone, Debug, Default)]
pub struct Items {
    list: Vec<Value>,
    element_sizes_if_empty: Vec<usize>,
    /// The class of the records that there are none of.
    record_if_empty: Option<ClassId>,
}

impl PartialEq for Items {
    fn eq(&self, other: &Self) -> bool {
        self.list == other.list && self.element_sizes_if_empty == other.element_sizes_if_empty
    }
}

impl Items {
    /// These elements; `sizes` says the sizes of one where there are none.
    fn new(list: Vec<Value>, sizes: impl FnOnce() -> Vec<usize>) -> Self {
        let element_sizes_if_empty = if list.is_empty() { sizes() } else { Vec::new() };
        Self { list, element_sizes_if_empty, record_if_empty: None }
    }

    /// The class of the records that it has, or that there are none of.
    pub(crate) fn record_class(&self) -> Option<ClassId> {
        self.list.first().map_or(self.record_if_empty, Value::record_class)
    }

    /// Sizes of an element.
    pub fn sizes(&self) -> Vec<usize> {
        self.list.first().map_or_else(|| self.element_sizes_if_empty.clone(), Value::shape)
    }

    /// The array of what `f` makes of each element, of the same sizes; `None` where it makes nothing of one.
    pub(crate) fn try_map(&self, f: impl FnMut(&Value) -> Option<Value>) -> Option<Value> {
        let list = self.list.iter().map(f).collect::<Option<_>>()?;
        Some(Value::array_of(list, || self.element_sizes_if_empty.clone()))
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

    /// The same of records of a class, if it is one of records.
    pub(crate) fn array_of_records(
        items: Vec<Value>,
        class: Option<ClassId>,
        sizes: impl FnOnce() -> Vec<usize>,
    ) -> Self {
        let record_if_empty = class.filter(|_| items.is_empty());
        Value::Array(Arc::new(Items { record_if_empty, ..Items::new(items, sizes) }))
    }

    /// An array with these sizes whose elements are all `value`; without sizes the value itself.
    pub fn filled(value: Value, sizes: &[usize]) -> Self {
        let of_these = |inner: Value, &count: &usize| {
            let items = vec![inner.clone(); count];
            Self::array_of_records(items, inner.record_class(), || inner.shape())
        };
        sizes.iter().rev().fold(value, of_these)
    }

    /// The class of a record, or of the records of an array.
    pub(crate) fn record_class(&self) -> Option<ClassId> {
        match self {
            Value::Record(fields) => Some(fields.class),
            Value::Array(items) => items.record_class(),
            _ => None,
        }
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

#[cfg(test)]
mod tests {
    use super::*;

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
}

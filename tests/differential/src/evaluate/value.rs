//! Values of the direct evaluation: numbers with their derivative in time, nested arrays, records.

use crate::model::Operator;

/// What an evaluation gives, or why it cannot.
pub(super) type Done<T> = Result<T, String>;

/// A number and its derivative in time.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Dual {
    /// The number.
    pub v: f64,
    /// Its derivative.
    pub d: f64,
}

/// A number, an array or a record.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Value {
    /// A number; Booleans are 0 and 1.
    Scalar(Dual),
    /// An array.
    Array(Vec<Value>),
    /// Fields by name.
    Record(Vec<(String, Value)>),
}

impl Dual {
    /// A number that does not change.
    pub(super) fn fixed(v: f64) -> Self {
        Self { v, d: 0.0 }
    }

    /// A function of this number, given with its slope here.
    #[must_use]
    pub(super) fn map(self, value: f64, slope: f64) -> Self {
        Self { v: value, d: if self.d == 0.0 { 0.0 } else { slope * self.d } }
    }

    /// `a op b` of numbers.
    pub(super) fn operate(operator: Operator, a: Dual, b: Dual) -> Done<Dual> {
        Ok(match operator {
            Operator::Add => Dual { v: a.v + b.v, d: a.d + b.d },
            Operator::Subtract => Dual { v: a.v - b.v, d: a.d - b.d },
            Operator::Multiply | Operator::MultiplyEach => Dual { v: a.v * b.v, d: a.d * b.v + a.v * b.d },
            Operator::Divide | Operator::DivideEach => Dual { v: a.v / b.v, d: (a.d - a.v / b.v * b.d) / b.v },
            Operator::Power | Operator::PowerEach if b.d == 0.0 => a.map(a.v.powf(b.v), b.v * a.v.powf(b.v - 1.0)),
            _ => return Err(format!("no numbers: {}", operator.text())),
        })
    }
}

impl Value {
    /// A number that does not change.
    pub(super) fn number(v: f64) -> Self {
        Value::Scalar(Dual::fixed(v))
    }

    /// The number.
    pub(super) fn scalar(&self) -> Done<Dual> {
        match self {
            Value::Scalar(dual) => Ok(*dual),
            _ => Err("an array where a number is needed".to_string()),
        }
    }

    /// The elements.
    pub(super) fn elements(&self) -> Done<&[Value]> {
        match self {
            Value::Array(list) => Ok(list),
            _ => Err("a number where an array is needed".to_string()),
        }
    }

    /// All numbers in their order.
    pub(super) fn flat(&self, into: &mut Vec<Dual>) {
        match self {
            Value::Scalar(dual) => into.push(*dual),
            Value::Array(list) => list.iter().for_each(|value| value.flat(into)),
            Value::Record(fields) => fields.iter().for_each(|(_, value)| value.flat(into)),
        }
    }

    /// An array of these sizes from its numbers.
    pub(super) fn shaped(numbers: &[Dual], sizes: &[usize]) -> Self {
        match sizes {
            [] => Value::Scalar(numbers[0]),
            [n, rest @ ..] => {
                let each: usize = rest.iter().product();
                Value::Array((0..*n).map(|k| Value::shaped(&numbers[k * each..(k + 1) * each], rest)).collect())
            }
        }
    }

    /// The same for every number.
    pub(super) fn each(&self, f: &dyn Fn(Dual) -> Dual) -> Value {
        match self {
            Value::Scalar(dual) => Value::Scalar(f(*dual)),
            Value::Array(list) => Value::Array(list.iter().map(|value| value.each(f)).collect()),
            Value::Record(fields) => Value::Record(fields.iter().map(|(n, v)| (n.clone(), v.each(f))).collect()),
        }
    }

    /// Number by number.
    pub(super) fn pairs(&self, other: &Value, f: &dyn Fn(Dual, Dual) -> Done<Dual>) -> Done<Value> {
        match (self, other) {
            (Value::Scalar(a), Value::Scalar(b)) => Ok(Value::Scalar(f(*a, *b)?)),
            (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
                Ok(Value::Array(a.iter().zip(b).map(|(a, b)| a.pairs(b, f)).collect::<Done<_>>()?))
            }
            _ => Err("sizes do not agree".to_string()),
        }
    }

    fn is_matrix(&self) -> bool {
        matches!(self, Value::Array(list) if matches!(list.first(), Some(Value::Array(_))))
    }

    /// `a op b` with the products of linear algebra (10.6).
    pub(super) fn operate(operator: Operator, a: &Value, b: &Value) -> Done<Value> {
        match (operator, a, b) {
            (_, Value::Scalar(a), Value::Scalar(b)) => Ok(Value::Scalar(Dual::operate(operator, *a, *b)?)),
            (
                Operator::Multiply | Operator::MultiplyEach | Operator::DivideEach | Operator::PowerEach,
                Value::Scalar(_),
                Value::Array(list),
            ) => Ok(Value::Array(list.iter().map(|e| Value::operate(operator, a, e)).collect::<Done<_>>()?)),
            (
                Operator::Multiply
                | Operator::Divide
                | Operator::MultiplyEach
                | Operator::DivideEach
                | Operator::PowerEach,
                Value::Array(list),
                Value::Scalar(_),
            ) => Ok(Value::Array(list.iter().map(|e| Value::operate(operator, e, b)).collect::<Done<_>>()?)),
            (Operator::Multiply, Value::Array(rows), Value::Array(_)) if a.is_matrix() => {
                Ok(Value::Array(rows.iter().map(|row| Value::operate(operator, row, b)).collect::<Done<_>>()?))
            }
            (Operator::Multiply, Value::Array(x), Value::Array(y)) => {
                if x.len() != y.len() || x.is_empty() {
                    return Err("sizes of a product do not agree".to_string());
                }
                // A vector by a vector is a number, a vector by a matrix a combination of its rows.
                let mut sum = Value::operate(operator, &x[0], &y[0])?;
                for (x, y) in x.iter().zip(y).skip(1) {
                    sum = Value::operate(Operator::Add, &sum, &Value::operate(operator, x, y)?)?;
                }
                Ok(sum)
            }
            (
                Operator::Add
                | Operator::Subtract
                | Operator::MultiplyEach
                | Operator::DivideEach
                | Operator::PowerEach,
                Value::Array(_),
                Value::Array(_),
            ) => a.pairs(b, &|a, b| Dual::operate(operator, a, b)),
            _ => Err(format!("operands of {}", operator.text())),
        }
    }
}

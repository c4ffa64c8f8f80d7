//! Functions of LAPACK by their names, computed at translation.
//!
//! Arguments stand as LAPACK has them, with sizes, leading dimensions and working memory, which nothing here needs.

use nalgebra::{DMatrix, DVector};

use crate::external::Given;
use crate::values::value::Value;

/// Calls the function of this name; `None` where it is not known.
pub(crate) fn call(name: &str, arguments: &[Value]) -> Option<Result<Given, String>> {
    match (name, arguments) {
        // m, n, nrhs, A, lda, B, ldb, jpvt, rcond, rank, work, lwork, info
        ("dgelsy", [_, _, _, a, _, b, _, _, rcond, ..]) => Some(least_squares(a, b, rcond.as_real().unwrap_or(0.0))),
        _ => None,
    }
}

/// An array of numbers as a matrix, a vector as one column.
fn matrix(value: &Value) -> Result<DMatrix<f64>, String> {
    let wrong = || "a function of LAPACK takes matrices of numbers".to_string();
    let shape = value.shape();
    let (rows, columns) = match *shape.as_slice() {
        [rows] => (rows, 1),
        [rows, columns] => (rows, columns),
        _ => return Err(wrong()),
    };
    let numbers: Option<Vec<f64>> = value.flatten().into_iter().map(Value::as_real).collect();
    let numbers = numbers.filter(|numbers| numbers.len() == rows * columns).ok_or_else(wrong)?;
    Ok(DMatrix::from_row_slice(rows, columns, &numbers))
}

/// The same as an array of this shape.
fn array(matrix: &DMatrix<f64>, shape: &[usize]) -> Value {
    let reals = |row: usize| (0..matrix.ncols()).map(|column| Value::Real(matrix[(row, column)])).collect::<Vec<_>>();
    let rows = (0..matrix.nrows()).map(reals);
    match shape.len() {
        1 => Value::array(rows.flatten().collect()),
        _ => Value::array(rows.map(Value::array).collect()),
    }
}

/// The shortest of the vectors that make `A*x - b` smallest, and the rank of A by its singular values beside the largest.
fn least_squares(a: &Value, b: &Value, rcond: f64) -> Result<Given, String> {
    let shape = b.shape();
    let (a, b) = (matrix(a)?, matrix(b)?);
    let (rows, columns) = a.shape();
    if b.nrows() < rows.max(columns) {
        return Err("the right side of a least squares problem is shorter than its matrix".to_string());
    }
    let parts = a.svd(true, true);
    let largest = parts.singular_values.iter().copied().fold(0.0, f64::max);
    let least = largest * rcond.max(f64::EPSILON);
    let rank = parts.singular_values.iter().filter(|&&value| value > least).count();
    let mut x = b.clone();
    for column in 0..b.ncols() {
        let right: DVector<f64> = b.column(column).rows(0, rows).into_owned();
        let solution = parts.solve(&right, least).map_err(str::to_string)?;
        x.column_mut(column).rows_mut(0, columns).copy_from(&solution);
    }
    let set = vec![(5, array(&x, &shape)), (9, Value::Integer(rank as i64)), (12, Value::Integer(0))];
    Ok(Given { value: None, set })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reals(numbers: &[f64]) -> Value {
        Value::array(numbers.iter().copied().map(Value::Real).collect())
    }

    fn given(name: &str, a: Value, b: Value) -> Vec<(usize, Value)> {
        let n = Value::Integer(0);
        let mut arguments = vec![n; 13];
        (arguments[3], arguments[5], arguments[8]) = (a, b, Value::Real(1e-10));
        call(name, &arguments).expect("known").expect("it fits").set
    }

    fn numbers(value: &Value) -> Vec<f64> {
        value.flatten().into_iter().filter_map(Value::as_real).collect()
    }

    /// A line through three points: 1 + 2 t with residuals (1, -2, 1)/10 that are orthogonal to both columns.
    #[test]
    fn least_squares_are_least_and_shortest() {
        let a = Value::array(vec![reals(&[1.0, 0.0]), reals(&[1.0, 1.0]), reals(&[1.0, 2.0])]);
        let set = given("dgelsy", a, reals(&[1.1, 2.8, 5.1]));
        let x = numbers(&set[0].1);
        assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12, "{x:?}");
        assert_eq!(set[1], (9, Value::Integer(2)));
        // Of all x with x1 + x2 = 2 the shortest is (1, 1).
        let flat = Value::array(vec![reals(&[1.0, 1.0])]);
        let set = given("dgelsy", flat, reals(&[2.0, 0.0]));
        let x = numbers(&set[0].1);
        assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 1.0).abs() < 1e-12, "{x:?}");
        assert_eq!(set[1], (9, Value::Integer(1)));
    }
}

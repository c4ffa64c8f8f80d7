//! Functions of LAPACK by their names, computed at translation.
//!
//! Arguments stand as LAPACK has them, with sizes, leading dimensions and working memory, which nothing here needs.

use nalgebra::{DMatrix, DVector};

use crate::external::Given;
use crate::values::value::Value;

/// Numbers beside which the iteration for singular values takes those off the diagonal for zero, relative.
const SMALL: f64 = 5.0 * f64::EPSILON;
/// Turns of that iteration; it takes a few for each value.
const MOST_TURNS: usize = 100_000;

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
        _ => Value::array_of(rows.map(Value::array).collect(), || vec![matrix.ncols()]),
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
    if a.is_empty() {
        // Nothing is asked for, or nothing is said: the shortest answer is zero.
        let mut x = b.clone();
        x.rows_mut(0, columns).fill(0.0);
        return Ok(Given {
            value: None,
            set: vec![(5, array(&x, &shape)), (9, Value::Integer(0)), (12, Value::Integer(0))],
        });
    }
    // The iteration would turn forever on numbers that are not finite.
    if !a.iter().chain(b.iter()).all(|number| number.is_finite()) {
        return Err("a least squares problem has numbers that are not finite".to_string());
    }
    let parts = a.try_svd(true, true, SMALL, MOST_TURNS);
    let parts = parts.ok_or("the singular values of a least squares problem are not found")?;
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

    #[test]
    fn what_is_not_finite_is_refused_and_nothing_has_the_answer_zero() {
        for bad in [f64::NAN, f64::INFINITY] {
            let a = Value::array(vec![reals(&[1.0, bad]), reals(&[1.0, 1.0])]);
            let n = Value::Integer(0);
            let mut arguments = vec![n; 13];
            (arguments[3], arguments[5], arguments[8]) = (a, reals(&[1.0, 2.0]), Value::Real(1e-10));
            let refused = call("dgelsy", &arguments).expect("known");
            assert!(refused.is_err_and(|why| why.contains("not finite")));
        }
        let set = given("dgelsy", reals(&[]), reals(&[3.0]));
        assert_eq!((numbers(&set[0].1), &set[1]), (vec![0.0], &(9, Value::Integer(0))));
    }
}

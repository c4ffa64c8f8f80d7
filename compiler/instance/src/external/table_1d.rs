//! Tables of one variable: the first column of a matrix is the variable, the others are values.

use crate::external::DataFiles;
use crate::external::hermite::slopes;
use crate::external::pieces::{Cubic, Outside, Pieces};
use crate::external::table_data::{self, Smoothness};
use crate::values::value::Value;

/// A table.
#[derive(Debug, PartialEq)]
pub struct Table1d {
    x: Vec<f64>,
    /// Values of each output.
    outputs: Vec<Vec<f64>>,
    smoothness: Smoothness,
    outside: Outside,
}

impl Table1d {
    /// `fileName, tableName, table, rows, columns of it, columns, number of columns, smoothness, extrapolation, verbose, delimiter,
    /// header lines`
    pub(crate) fn made(arguments: &[Value], files: DataFiles<'_>) -> Result<Self, String> {
        let rows = table_data::rows(arguments, (arguments.get(10), arguments.get(11)), files)?;
        let columns = table_data::columns(arguments.get(5))?;
        let smoothness = Smoothness::of(arguments.get(7))?;
        let (x, outputs) = columns_of(&rows, &columns)?;
        if let Some(k) = (1..x.len()).find(|&k| x[k] <= x[k - 1]) {
            return Err(format!(
                "the first column of a table must increase strictly, but it goes from {} to {} in rows {k} and {}",
                x[k - 1],
                x[k],
                k + 1
            ));
        }
        // Three points at least make a curve.
        let smoothness =
            if x.len() <= 2 && smoothness != Smoothness::Constant { Smoothness::Linear } else { smoothness };
        Ok(Self { x, outputs, smoothness, outside: table_data::outside(arguments.get(8))? })
    }

    /// The smallest and the largest value of the variable.
    pub fn range(&self) -> (f64, f64) {
        (self.x[0], self.x[self.x.len() - 1])
    }

    /// The function of an output, counted from 1.
    pub fn pieces(&self, output: usize) -> Result<Pieces, String> {
        let Some(y) = output.checked_sub(1).and_then(|k| self.outputs.get(k)) else {
            return Err(format!("the table has no output {output}"));
        };
        Ok(pieces(&self.x, y, self.smoothness, self.outside))
    }
}

/// The first column and the chosen ones.
pub(crate) fn columns_of(rows: &[Vec<f64>], columns: &[usize]) -> Result<(Vec<f64>, Vec<Vec<f64>>), String> {
    let width = rows[0].len();
    if let Some(column) = columns.iter().find(|&&column| column == 0 || column > width) {
        return Err(format!("the table has {width} columns, but column {column} is asked for"));
    }
    if rows.iter().any(|row| row.len() != width) {
        return Err("the rows of a table have different lengths".to_string());
    }
    let column = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
    Ok((column(0), columns.iter().map(|&k| column(k - 1)).collect()))
}

/// The function through points; two points of the same `x` make a jump where lines connect them.
pub(crate) fn pieces(x: &[f64], y: &[f64], smoothness: Smoothness, outside: Outside) -> Pieces {
    let n = x.len();
    if n == 1 {
        let same = Cubic::constant(y[0]);
        let outside = Outside::Hold;
        return Pieces { ends: vec![x[0], x[0]], cubics: vec![same], last: y[0], beyond: [same, same], outside };
    }
    let slope = |k: usize| if x[k + 1] > x[k] { (y[k + 1] - y[k]) / (x[k + 1] - x[k]) } else { 0.0 };
    let cubics: Vec<Cubic> = match smoothness {
        Smoothness::Linear => (0..n - 1).map(|k| Cubic::line(y[k], slope(k))).collect(),
        Smoothness::Constant => (0..n - 1).map(|k| Cubic::constant(y[k])).collect(),
        _ => {
            let at = slopes(x, y, smoothness);
            let cubic = |k: usize| {
                let (h, d) = (x[k + 1] - x[k], slope(k));
                let (a, b) = (at[k], at[k + 1]);
                Cubic([y[k], a, (3.0 * d - 2.0 * a - b) / h, (a + b - 2.0 * d) / (h * h)])
            };
            (0..n - 1).map(cubic).collect()
        }
    };
    let beyond = match (outside, smoothness) {
        (Outside::Line, Smoothness::Linear | Smoothness::Constant) => {
            [Cubic::line(y[0], slope(0)), Cubic::line(y[n - 1], slope(n - 2))]
        }
        (Outside::Line, _) => {
            let end = cubics[n - 2].derivative(1).at(x[n - 1] - x[n - 2]);
            [Cubic::line(y[0], cubics[0].0[1]), Cubic::line(y[n - 1], end)]
        }
        _ => [Cubic::constant(y[0]), Cubic::constant(y[n - 1])],
    };
    Pieces { ends: x.to_vec(), cubics, last: y[n - 1], beyond, outside }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const X: [f64; 6] = [0.0, 1.0, 2.0, 4.0, 5.0, 7.0];
    /// All that go through their points.
    const ALL: [Smoothness; 5] = [
        Smoothness::Linear,
        Smoothness::Akima,
        Smoothness::FritschButland,
        Smoothness::Steffen,
        Smoothness::ModifiedAkima,
    ];

    fn function(y: &[f64], smoothness: Smoothness, outside: Outside) -> Pieces {
        pieces(&X, y, smoothness, outside)
    }

    #[test]
    fn all_go_through_their_points_and_curves_have_no_kinks() {
        let y = [0.0, 1.0, 4.0, 4.0, 2.0, -3.0];
        for smoothness in ALL {
            let f = function(&y, smoothness, Outside::Line);
            for (x, y) in X.iter().zip(y) {
                assert!((f.value(*x).unwrap() - y).abs() < 1e-13, "{smoothness:?} at {x}");
            }
            if smoothness != Smoothness::Linear {
                let d = f.derivative(1);
                for x in X {
                    let (a, b) = (d.value(x - 1e-9).unwrap(), d.value(x + 1e-9).unwrap());
                    assert!((a - b).abs() < 1e-6, "{smoothness:?}: slope {a} and {b} at {x}");
                }
            }
        }
    }

    /// Akima's method reproduces a parabola on points of equal distance (Akima 1970, section 2); all of them a straight line.
    #[test]
    fn straight_lines_and_parabolas_are_reproduced() {
        let line: Vec<f64> = X.iter().map(|x| 2.0 - 0.5 * x).collect();
        for smoothness in ALL {
            let f = function(&line, smoothness, Outside::Line);
            for u in [-1.0, 0.3, 3.3, 6.9, 9.0] {
                assert!((f.value(u).unwrap() - (2.0 - 0.5 * u)).abs() < 1e-13, "{smoothness:?} at {u}");
            }
        }
        let x: Vec<f64> = (0..8).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| x * x - 3.0 * x).collect();
        let f = pieces(&x, &y, Smoothness::Akima, Outside::Line);
        for u in [0.25, 1.5, 3.75, 6.5] {
            assert!((f.value(u).unwrap() - (u * u - 3.0 * u)).abs() < 1e-12, "{u}");
        }
    }

    #[test]
    fn monotone_curves_stay_between_their_points() {
        let y = [0.0, 0.0, 1.0, 1.1, 5.0, 5.0];
        for smoothness in [Smoothness::FritschButland, Smoothness::Steffen] {
            let f = function(&y, smoothness, Outside::Hold);
            for k in 0..5 {
                for j in 0..=20 {
                    let u = X[k] + (X[k + 1] - X[k]) * f64::from(j) / 20.0;
                    let value = f.value(u).unwrap();
                    assert!(value >= y[k] - 1e-12 && value <= y[k + 1] + 1e-12, "{smoothness:?}: {value} at {u}");
                }
            }
        }
    }

    #[test]
    fn outside_each_choice_holds() {
        let y = [1.0, 2.0, 2.0, 2.0, 2.0, 0.0];
        let at = |outside, u| function(&y, Smoothness::Linear, outside).value(u);
        assert_eq!((at(Outside::Hold, -1.0), at(Outside::Hold, 9.0)), (Some(1.0), Some(0.0)));
        assert_eq!((at(Outside::Line, -1.0), at(Outside::Line, 9.0)), (Some(0.0), Some(-2.0)));
        assert_eq!((at(Outside::Repeat, -6.5), at(Outside::Repeat, 14.5)), (Some(1.5), Some(1.5)));
        assert_eq!((at(Outside::Nothing, -1.0), at(Outside::Nothing, 3.0)), (None, Some(2.0)));
        let constant = function(&y, Smoothness::Constant, Outside::Hold);
        assert_eq!([0.5, 1.0, 6.9, 7.0].map(|u| constant.value(u).unwrap()), [1.0, 2.0, 2.0, 0.0]);
    }
}

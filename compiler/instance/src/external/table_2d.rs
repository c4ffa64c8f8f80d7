//! Tables of two variables: the first column of a matrix is the first variable, its first row the second one.

use crate::external::DataFiles;
use crate::external::pieces::Outside;
use crate::external::table_data::{self, Smoothness};
use crate::values::value::Value;

/// A table.
#[derive(Debug, PartialEq)]
pub struct Table2d {
    /// Values of both variables, strictly increasing.
    pub x: [Vec<f64>; 2],
    y: Vec<Vec<f64>>,
    constant: bool,
    /// What holds outside.
    pub outside: Outside,
}

/// A function on a rectangle: `c[0] + c[1]*d1 + c[2]*d2 + c[3]*d1*d2` over the distances from its lower corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch(pub [f64; 4]);

impl Table2d {
    /// `fileName, tableName, table, rows, columns of it, smoothness, extrapolation, verbose, delimiter, header lines`
    pub(crate) fn made(arguments: &[Value], files: DataFiles<'_>) -> Result<Self, String> {
        let rows = table_data::rows(arguments, (arguments.get(8), arguments.get(9)), files)?;
        let width = rows[0].len();
        if rows.len() < 2 || width < 2 || rows.iter().any(|row| row.len() != width) {
            return Err("a table of two variables has two rows and two columns at least".to_string());
        }
        let x = [rows[1..].iter().map(|row| row[0]).collect::<Vec<f64>>(), rows[0][1..].to_vec()];
        for (axis, what) in x.iter().zip(["column", "row"]) {
            if axis.windows(2).any(|pair| pair[1] <= pair[0]) {
                return Err(format!("the first {what} of a table of two variables must increase strictly"));
            }
        }
        let constant = match Smoothness::of(arguments.get(5))? {
            Smoothness::Constant => true,
            Smoothness::Linear => false,
            // Two points in each direction have nothing but a plane between them.
            Smoothness::Akima if x.iter().all(|axis| axis.len() <= 2) => false,
            _ => return Err("smooth tables of two variables are outside the language profile".to_string()),
        };
        let outside = table_data::outside(arguments.get(6))?;
        if constant && outside == Outside::Line {
            return Err("a table of two variables with steps cannot be continued by straight lines".to_string());
        }
        let y = rows[1..].iter().map(|row| row[1..].to_vec()).collect();
        Ok(Self { x, y, constant, outside })
    }

    /// The smallest and the largest values of both variables.
    pub fn range(&self) -> [(f64, f64); 2] {
        [0, 1].map(|k| (self.x[k][0], self.x[k][self.x[k].len() - 1]))
    }

    /// The function between points `i` and `i + 1` of the first variable, `j` and `j + 1` of the second.
    pub fn patch(&self, i: usize, j: usize) -> Patch {
        let (a, b) = (self.width(0, i), self.width(1, j));
        let corner = |di: usize, dj: usize| {
            let row = &self.y[(i + di).min(self.y.len() - 1)];
            row[(j + dj).min(row.len() - 1)]
        };
        if self.constant {
            return Patch([corner(0, 0), 0.0, 0.0, 0.0]);
        }
        let (y00, y10, y01, y11) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
        Patch([y00, (y10 - y00) / a, (y01 - y00) / b, (y11 - y10 - y01 + y00) / (a * b)])
    }

    /// The distance to the next point; 1 where there is none.
    fn width(&self, axis: usize, k: usize) -> f64 {
        self.x[axis].get(k + 1).map_or(1.0, |next| next - self.x[axis][k])
    }

    /// The values are steps.
    pub fn is_constant(&self) -> bool {
        self.constant
    }
}

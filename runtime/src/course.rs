//! Values of all variables at a few points of a run that failed, for messages: how it began and how it ended.

use std::sync::Arc;

use hyd_system::{Place, Tables};

use crate::problem::Problem;

/// Rows of values with the names to read them by.
#[derive(Clone, PartialEq, Debug)]
pub struct Course {
    tables: Arc<Tables>,
    parameters: Vec<f64>,
    rows: Vec<(f64, Vec<f64>)>,
}

impl Course {
    /// The values at some points, each a time (s) with unknowns and their rates.
    pub(crate) fn new(problem: &mut Problem<'_>, points: &[(f64, &[f64], &[f64])]) -> Self {
        let mut rows = Vec::new();
        for &(t, y, yp) in points {
            let mut row = vec![0.0; problem.system.structure().outputs];
            problem.system.outputs(t, y, yp, &mut row);
            rows.push((t, row));
        }
        Self { tables: problem.system.tables().clone(), parameters: problem.system.parameters().to_vec(), rows }
    }

    /// The times of the rows (s), the start first, the last point last.
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.rows.iter().map(|(time, _)| *time)
    }

    /// The value of a variable, derivative, parameter or constant in a row.  Linear in the number of variables.
    pub fn value(&self, row: usize, name: &str) -> Option<f64> {
        let (variable, element) = self.tables.find(name)?;
        let source = variable.sources.get(element)?;
        let value = match source.place {
            Place::Output(place) => *self.rows.get(row)?.1.get(place as usize)?,
            Place::Parameter(place) => *self.parameters.get(place as usize)?,
            Place::Constant(value) => value,
        };
        Some(if source.negated { -value } else { value })
    }
}

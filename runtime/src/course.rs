//! Values of all variables at a few points of a run that failed, for messages: how it began and how it ended.
//! The points of the last steps are kept while a run goes on.

use std::sync::Arc;

use hyd_system::{Place, Tables};

use crate::problem::Problem;

/// Points that are kept, and those of them that are shown, counted back from the last.
const KEPT: usize = 17;
const SHOWN: [usize; 5] = [16, 8, 4, 2, 1];
/// The last points of larger systems are not kept.
const MOST_UNKNOWNS: usize = 2000;

/// The points at the ends of the last steps, one after the other in a ring.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Recent {
    unknowns: usize,
    /// Points noted in the run.
    count: usize,
    times: [f64; KEPT],
    /// Values and rates of each point.
    values: Vec<f64>,
}

impl Recent {
    /// A run begins.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// A step has been done; its point takes the room of the oldest.
    pub(crate) fn note(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        let unknowns = y.len();
        if unknowns > MOST_UNKNOWNS {
            return;
        }
        if self.unknowns != unknowns {
            (self.unknowns, self.count) = (unknowns, 0);
            self.values.resize(KEPT * 2 * unknowns, 0.0);
        }
        let place = self.count % KEPT;
        self.count += 1;
        self.times[place] = t;
        let values = &mut self.values[place * 2 * unknowns..(place + 1) * 2 * unknowns];
        values[..unknowns].copy_from_slice(y);
        values[unknowns..].copy_from_slice(yp);
    }

    /// Some of them, ever closer to the last one, which is not among them.
    pub(crate) fn points(&self) -> impl Iterator<Item = (f64, &[f64], &[f64])> {
        let kept = self.count.min(KEPT);
        SHOWN.into_iter().filter(move |&back| back < kept).map(|back| {
            let place = (self.count - back - 1) % KEPT;
            let values = &self.values[place * 2 * self.unknowns..(place + 1) * 2 * self.unknowns];
            let (y, yp) = values.split_at(self.unknowns);
            (self.times[place], y, yp)
        })
    }
}

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

    /// What is integrated, or solved for, with its values at the start and at the end.
    pub(crate) fn unknowns(&self) -> impl Iterator<Item = (usize, f64, f64)> {
        let ends = self.rows.first().zip(self.rows.last());
        self.tables.unknowns.iter().enumerate().filter_map(move |(k, &(variable, element))| {
            let source = self.tables.variables.get(variable as usize)?.sources.get(element as usize)?;
            let (Place::Output(place), Some((first, last))) = (source.place, ends) else { return None };
            let sign = if source.negated { -1.0 } else { 1.0 };
            Some((k, sign * first.1.get(place as usize)?, sign * last.1.get(place as usize)?))
        })
    }

    /// The name of such a variable.
    pub(crate) fn unknown_name(&self, k: usize) -> String {
        self.tables.unknown_name(k)
    }
}

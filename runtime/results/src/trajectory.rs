//! A run in memory.
//!
//! Rows are stored one after the other as the solver delivers them; a [`Series`] is a view of one variable, found by its full
//! name (outputs, aliases with their sign, parameters and constants alike).  A trajectory is a [`Sink`] and can be
//! used for run after run.

use std::io;
use std::sync::Arc;

use hyd_system::{Source, Tables, VariableInfo};

use crate::column::source_value;
use crate::{RowKind, Side, Sink, Table, columns, interpolate};

/// All rows of one run.
#[derive(Clone, Debug, Default)]
pub struct Trajectory {
    tables: Arc<Tables>,
    parameters: Vec<f64>,
    times: Vec<f64>,
    kinds: Vec<RowKind>,
    width: usize,
    values: Vec<f64>,
}

impl Trajectory {
    /// An empty trajectory.
    pub fn new() -> Self {
        Self::default()
    }

    /// Names and places of the system that ran.
    pub fn tables(&self) -> &Arc<Tables> {
        &self.tables
    }

    /// Parameter values of the run.
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Time of each row (s), ascending; events stand twice.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// What each row stands for.
    pub fn kinds(&self) -> &[RowKind] {
        &self.kinds
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// True if there are no rows.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// All recorded values of row `k`.
    pub fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.width..(k + 1) * self.width]
    }

    /// The variable with this full name.
    pub fn series(&self, name: &str) -> Option<Series<'_>> {
        let (variable, element) = self.tables.find(name)?;
        Some(self.series_of(*variable.sources.get(element)?))
    }

    /// The values behind a source of the tables.
    pub fn series_of(&self, source: Source) -> Series<'_> {
        Series { trajectory: self, source }
    }

    /// The elements that `keep` accepts as a table of columns.
    pub fn table(&self, keep: impl FnMut(&VariableInfo, &str) -> bool) -> Table {
        let columns = columns(&self.tables, keep);
        Table {
            times: self.times.clone(),
            columns: columns.iter().map(|column| self.series_of(column.source).values()).collect(),
            names: columns.into_iter().map(|column| column.name).collect(),
            constants: Vec::new(),
        }
    }

    /// The last value of a variable, if there is one.
    pub fn last(&self, name: &str) -> Option<f64> {
        let series = self.series(name)?;
        self.len().checked_sub(1).map(|k| series.at(k))
    }
}

impl Sink for Trajectory {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.tables = Arc::clone(tables);
        self.parameters.clear();
        self.parameters.extend_from_slice(parameters);
        self.times.clear();
        self.kinds.clear();
        self.values.clear();
        self.width = 0;
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], kind: RowKind) -> io::Result<()> {
        self.width = values.len();
        self.times.push(t);
        self.kinds.push(kind);
        self.values.extend_from_slice(values);
        Ok(())
    }
}

/// One variable over a trajectory.
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    trajectory: &'a Trajectory,
    source: Source,
}

impl Series<'_> {
    /// Value in row `k`.
    pub fn at(&self, k: usize) -> f64 {
        source_value(self.source, self.trajectory.row(k), &self.trajectory.parameters)
    }

    /// Value at time `t` (s), linear between rows.
    pub fn value(&self, t: f64, side: Side) -> f64 {
        interpolate(&self.trajectory.times, |k| self.at(k), t, side)
    }

    /// The values of all rows.
    pub fn values(&self) -> Vec<f64> {
        (0..self.trajectory.len()).map(|k| self.at(k)).collect()
    }
}

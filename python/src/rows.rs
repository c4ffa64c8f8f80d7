//! The rows of a run in memory, column by column, so that numpy and Arrow see each variable as one stretch of numbers without a copy.
//!
//! Variables that are equal by declaration share a column, one that is the negative of another has a column of its own.  Rows come one by one; a few
//! are kept as they come and then spread over the columns together, so that a row of many variables does not touch as many lines of memory.
//! The columns are made for the rows that the options promise and grow where events add more.  Their memory is that of an earlier run of the same
//! model that nobody looks at any more, which the system need not map and clear again.

use std::collections::HashMap;
use std::io;
use std::sync::{Arc, Mutex};

use arrow_buffer::ScalarBuffer;
use hyd_results::{RowKind, Sink, described_columns};
use hyd_run::Selection;
use hyd_system::{Place, Source, Tables, ValueKind};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::interface;

/// Rows that are kept before they are spread.
const BLOCK: usize = 64;
/// Numbers for which there is room at first, at most: a quarter of a gigabyte, which 60,000 variables at 500 times need.
const MOST_AT_FIRST: usize = 1 << 25;
/// Rows beyond what the options promise for which there is room from the beginning: events.
const SPARE: usize = 16;
/// Most numbers whose memory is kept for the next run (16 MB).
const MOST_KEPT: usize = 1 << 21;

/// A variable of a run.
#[derive(Clone, Debug)]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) description: String,
    pub(crate) slot: Slot,
}

/// Where the values of a variable are.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Slot {
    /// In a column.
    Column(usize),
    /// The same all the time: a parameter or a number.
    Fixed(Source),
}

/// Which variables have which columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    pub(crate) variables: Vec<Variable>,
    pub(crate) index: HashMap<String, usize>,
    /// Position in the row of outputs, and true where the column is its negative.
    columns: Vec<(u32, bool)>,
}

impl Layout {
    fn new(tables: &Tables, selection: &Selection) -> Self {
        let mut layout = Self::default();
        let mut known: HashMap<(u32, bool), usize> = HashMap::new();
        for (column, variable) in described_columns(tables, |variable, name| selection.keeps(variable, name)) {
            let slot = match column.source.place {
                Place::Output(place) => {
                    let key = (place, column.source.negated);
                    Slot::Column(*known.entry(key).or_insert_with(|| {
                        layout.columns.push(key);
                        layout.columns.len() - 1
                    }))
                }
                Place::Parameter(_) | Place::Constant(_) => Slot::Fixed(column.source),
            };
            let unit = if variable.kind == ValueKind::Real { variable.unit.to_string() } else { String::new() };
            layout.index.insert(column.name.clone(), layout.variables.len());
            let description = variable.description.to_string();
            layout.variables.push(Variable { name: column.name, unit, description, slot });
        }
        layout
    }
}

/// The layout of the last run of a model, which the next run most likely has as well, and memory of runs that are gone.  Nobody waits for either: a
/// process that was forked while a thread held a lock would wait for ever.
#[derive(Default)]
pub(crate) struct LastLayout(Mutex<Option<Laid>>, Arc<Kept>);

/// Memory for columns, with what stands in it.
#[derive(Default, Debug)]
struct Kept(Mutex<Vec<f64>>);

impl Kept {
    fn take(&self) -> Vec<f64> {
        self.0.try_lock().map(|mut kept| std::mem::take(&mut *kept)).unwrap_or_default()
    }

    fn put(&self, values: Vec<f64>) {
        if let Ok(mut kept) = self.0.try_lock()
            && values.len() > kept.len()
            && values.capacity() <= MOST_KEPT
        {
            *kept = values;
        }
    }
}

/// Tables, the pattern of names, and the layout of both.
type Laid = (Arc<Tables>, Option<String>, Arc<Layout>);

impl LastLayout {
    fn get(&self, tables: &Arc<Tables>, pattern: Option<&str>, selection: &Selection) -> Arc<Layout> {
        if let Ok(last) = self.0.try_lock()
            && let Some((known, own, layout)) = &*last
            && Arc::ptr_eq(known, tables)
            && own.as_deref() == pattern
        {
            return layout.clone();
        }
        let layout = Arc::new(Layout::new(tables, selection));
        if let Ok(mut last) = self.0.try_lock() {
            *last = Some((tables.clone(), pattern.map(str::to_string), layout.clone()));
        }
        layout
    }
}

/// Takes the rows of one run.
pub(crate) struct Collector<'a> {
    last: &'a LastLayout,
    pattern: Option<&'a str>,
    selection: Selection,
    promised: usize,
    layout: Arc<Layout>,
    tables: Arc<Tables>,
    parameters: Vec<f64>,
    times: Vec<f64>,
    /// Columns one after the other, `room` numbers each.
    values: Vec<f64>,
    room: usize,
    /// Rows in columns.
    spread: usize,
    /// Rows that are not in columns yet.
    pending: Vec<f64>,
}

impl<'a> Collector<'a> {
    /// `pattern`: which variables, as `--variables` has it; `promised`: number of rows without events.
    pub(crate) fn new(
        last: &'a LastLayout,
        (pattern, selection): (Option<&'a str>, Selection),
        promised: usize,
    ) -> Self {
        Self {
            last,
            pattern,
            selection,
            promised,
            layout: Arc::default(),
            tables: Arc::default(),
            parameters: Vec::new(),
            times: Vec::new(),
            values: Vec::new(),
            room: 0,
            spread: 0,
            pending: Vec::new(),
        }
    }

    /// The rows so far.
    pub(crate) fn finish(mut self) -> Rows {
        if self.spread().is_err() {
            // The rows that found no room are lost, as are those after them.
            self.times.truncate(self.spread);
        }
        Rows {
            layout: self.layout,
            tables: self.tables,
            parameters: self.parameters,
            times: self.times.into(),
            values: self.values.into(),
            room: self.room,
            kept: Some(self.last.1.clone()),
        }
    }

    fn spread(&mut self) -> io::Result<()> {
        let width = self.layout.columns.len();
        let rows = self.pending.len().checked_div(width).unwrap_or(0);
        if self.spread + rows > self.room {
            self.grow((self.spread + rows).max(self.room + self.room / 2))?;
        }
        for column in 0..width {
            let from = column * self.room + self.spread;
            let target = &mut self.values[from..from + rows];
            for (target, row) in target.iter_mut().zip(self.pending.chunks_exact(width)) {
                *target = row[column];
            }
        }
        self.spread += rows;
        self.pending.clear();
        Ok(())
    }

    fn grow(&mut self, room: usize) -> io::Result<()> {
        let width = self.layout.columns.len();
        let mut values = of_length(Vec::new(), width, room)?;
        for column in 0..width {
            let old = &self.values[column * self.room..column * self.room + self.spread];
            values[column * room..column * room + self.spread].copy_from_slice(old);
        }
        (self.values, self.room) = (values, room);
        Ok(())
    }
}

/// Room for so many columns of so many rows, with whatever stands in it, made of this memory if that is enough.
///
/// # Errors
/// When there is not so much memory.
fn of_length(mut values: Vec<f64>, columns: usize, rows: usize) -> io::Result<Vec<f64>> {
    let count = columns.checked_mul(rows).ok_or(io::ErrorKind::OutOfMemory)?;
    if values.capacity() < count {
        // Not what stands in it: that would be copied.
        values = Vec::new();
        values.try_reserve_exact(count).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    }
    values.resize(count, 0.0);
    Ok(values)
}

impl Sink for Collector<'_> {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.layout = self.last.get(tables, self.pattern, &self.selection);
        self.tables = tables.clone();
        self.parameters = parameters.to_vec();
        self.times.clear();
        self.pending.clear();
        self.spread = 0;
        let width = self.layout.columns.len();
        self.room = self.promised.min((MOST_AT_FIRST / width.max(1)).max(BLOCK)) + SPARE;
        self.values = of_length(self.last.1.take(), width, self.room)?;
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        self.times.push(t);
        let value = |&(place, negated): &(u32, bool)| {
            let value = values.get(place as usize).copied().unwrap_or(f64::NAN);
            if negated { -value } else { value }
        };
        self.pending.extend(self.layout.columns.iter().map(value));
        if self.pending.len() >= BLOCK * self.layout.columns.len() {
            self.spread()?;
        }
        Ok(())
    }
}

/// The rows of a run.
#[derive(Debug)]
pub(crate) struct Rows {
    pub(crate) layout: Arc<Layout>,
    pub(crate) tables: Arc<Tables>,
    pub(crate) parameters: Vec<f64>,
    pub(crate) times: ScalarBuffer<f64>,
    pub(crate) values: ScalarBuffer<f64>,
    room: usize,
    /// Where the memory of `values` goes.
    kept: Option<Arc<Kept>>,
}

impl Drop for Rows {
    fn drop(&mut self) {
        // Tables of Arrow may still read what they were given.
        if let (Some(kept), Ok(values)) = (&self.kept, std::mem::take(&mut self.values).into_inner().into_vec()) {
            kept.put(values);
        }
    }
}

impl Rows {
    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.times.len()
    }

    /// Number of columns.
    pub(crate) fn columns(&self) -> usize {
        self.layout.columns.len()
    }

    /// A column as a part of what is kept.
    pub(crate) fn column(&self, column: usize) -> ScalarBuffer<f64> {
        self.values.slice(column * self.room, self.len())
    }

    /// The value behind a place that does not change.
    pub(crate) fn fixed(&self, source: Source) -> f64 {
        let value = match source.place {
            Place::Parameter(k) => self.parameters.get(k as usize).copied().unwrap_or(f64::NAN),
            Place::Constant(value) => value,
            Place::Output(_) => f64::NAN,
        };
        if source.negated { -value } else { value }
    }

    /// Columns and parameters as they were, in memory that another process has read.
    pub(crate) fn restored(layout: Layout, tables: Arc<Tables>, times: Vec<f64>, values: Vec<f64>) -> Self {
        let room = times.len();
        let (times, values) = (times.into(), values.into());
        Self { layout: Arc::new(layout), tables, parameters: Vec::new(), times, values, room, kept: None }
    }
}

impl Layout {
    /// A layout of variables whose columns are numbered already.
    pub(crate) fn restored(variables: Vec<Variable>, columns: usize) -> Self {
        let index = variables.iter().enumerate().map(|(k, own)| (own.name.clone(), k)).collect();
        Self { variables, index, columns: vec![(0, false); columns] }
    }
}

/// A column of a run for numpy, or its times.
#[pyclass(frozen, module = "hyd._hyd")]
pub(crate) struct Column {
    rows: Arc<Rows>,
    column: Option<usize>,
}

impl Column {
    /// The times where `column` is none.
    pub(crate) fn new(rows: Arc<Rows>, column: Option<usize>) -> Self {
        Self { rows, column }
    }
}

#[pymethods]
impl Column {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let rows = &self.rows;
        let values = self.column.map_or_else(|| rows.times.clone(), |column| rows.column(column));
        interface(py, &values, &[values.len()], None)
    }
}

/// All columns of a run for numpy: one line for each column.
#[pyclass(frozen, module = "hyd._hyd")]
pub(crate) struct Matrix {
    rows: Arc<Rows>,
}

impl Matrix {
    pub(crate) fn new(rows: Arc<Rows>) -> Self {
        Self { rows }
    }
}

#[pymethods]
impl Matrix {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        const SIZE: usize = size_of::<f64>();
        let rows = &self.rows;
        interface(py, &rows.values, &[rows.columns(), rows.len()], Some(&[rows.room * SIZE, SIZE]))
    }
}

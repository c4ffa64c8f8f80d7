//! A run: its rows and its report.

use std::borrow::Cow;
use std::sync::Arc;

use hyd_run::RunSummary;
use hyd_system::{Place, Source, Tables};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict};

use crate::arrow::stream;
use crate::model::near;
use crate::rows::{Column, Layout, Matrix, Rows, Slot, Variable};

/// `hyd.Run` below its documentation.
#[pyclass(frozen, module = "hyd._hyd")]
pub(crate) struct Run {
    rows: Arc<Rows>,
    summary: Report,
}

/// What `hyd simulate --json` prints; its text is made where somebody asks.
enum Report {
    Own(Box<RunSummary>),
    /// From a pickle.
    Text(String),
}

/// A variable in a pickle: name, unit, description, column; or the value that it has all the time.
type Kept = (String, String, String, Option<usize>, f64);

/// A run in a pickle: summary, variables, times, columns, parameters.
type State<'py> = (String, Vec<Kept>, Column, Matrix, Bound<'py, PyDict>);

impl Run {
    pub(crate) fn new(rows: Arc<Rows>, summary: RunSummary) -> Self {
        Self { rows, summary: Report::Own(Box::new(summary)) }
    }

    /// A parameter or constant of the tables, whatever was recorded.
    fn fixed(&self, name: &str) -> Option<f64> {
        let (variable, element) = self.rows.tables.find(name)?;
        let source: Source = *variable.sources.get(element)?;
        match source.place {
            Place::Output(_) => None,
            Place::Parameter(_) | Place::Constant(_) => Some(self.rows.fixed(source)),
        }
    }
}

#[pymethods]
impl Run {
    /// The summary as JSON.
    #[getter]
    fn summary(&self) -> Cow<'_, str> {
        match &self.summary {
            Report::Own(summary) => Cow::Owned(summary.json()),
            Report::Text(text) => Cow::Borrowed(text),
        }
    }

    /// Names, units and descriptions of the variables that were recorded.
    fn variables(&self) -> Vec<(&str, &str, &str)> {
        let all = self.rows.layout.variables.iter();
        all.map(|own| (own.name.as_str(), own.unit.as_str(), own.description.as_str())).collect()
    }

    /// Number of rows.
    fn __len__(&self) -> usize {
        self.rows.len()
    }

    /// True if values of this name were recorded.
    fn __contains__(&self, name: &str) -> bool {
        self.rows.layout.index.contains_key(name)
    }

    /// The times of the rows.
    #[getter]
    fn time(&self) -> Column {
        Column::new(self.rows.clone(), None)
    }

    /// The values of a variable, or the one value of what does not change.
    fn values(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let rows = &self.rows;
        if let Some(&k) = rows.layout.index.get(name) {
            return Ok(match rows.layout.variables[k].slot {
                Slot::Column(column) => Py::new(py, Column::new(rows.clone(), Some(column)))?.into_any(),
                Slot::Fixed(source) => rows.fixed(source).into_pyobject(py)?.into_any().unbind(),
            });
        }
        if let Some(value) = self.fixed(name) {
            return Ok(value.into_pyobject(py)?.into_any().unbind());
        }
        let hint = near(&rows.tables, name).map_or_else(String::new, |hint| format!("; {hint}"));
        let sentence = match rows.tables.find(name) {
            Some(_) => format!("the variable `{name}` was not recorded"),
            None => format!("the model has no variable `{name}`{hint}"),
        };
        Err(PyKeyError::new_err(sentence))
    }

    /// For each variable its line in `matrix`, none for what does not change.
    fn lines(&self) -> Vec<Option<usize>> {
        let line = |own: &Variable| match own.slot {
            Slot::Column(column) => Some(column),
            Slot::Fixed(_) => None,
        };
        self.rows.layout.variables.iter().map(line).collect()
    }

    /// All columns, a line for each; variables that are equal share one.
    fn matrix(&self) -> Matrix {
        Matrix::new(self.rows.clone())
    }

    /// Parameters and constants with their values in this run.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for info in &self.rows.tables.variables {
            for (element, &source) in info.sources.iter().enumerate() {
                if !matches!(source.place, Place::Output(_)) {
                    dict.set_item(info.name.element(element), self.rows.fixed(source))?;
                }
            }
        }
        Ok(dict)
    }

    /// Times and variables for readers of the Arrow C stream interface.
    fn arrow<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let mut columns = vec![("time".to_string(), "s".to_string(), self.rows.times.clone())];
        for own in self.rows.layout.variables.iter().filter(|own| own.name != "time") {
            let values = match own.slot {
                Slot::Column(column) => self.rows.column(column),
                Slot::Fixed(source) => vec![self.rows.fixed(source); self.rows.len()].into(),
            };
            columns.push((own.name.clone(), own.unit.clone(), values));
        }
        stream(py, columns)
    }

    /// Everything but parameters, for pickles: summary, variables, times, columns one after the other, fixed values by name.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<State<'py>> {
        let kept = |own: &Variable| {
            let (column, value) = match own.slot {
                Slot::Column(column) => (Some(column), f64::NAN),
                Slot::Fixed(source) => (None, self.rows.fixed(source)),
            };
            (own.name.clone(), own.unit.clone(), own.description.clone(), column, value)
        };
        let variables = self.rows.layout.variables.iter().map(kept).collect();
        Ok((self.summary().into_owned(), variables, self.time(), self.matrix(), self.parameters(py)?))
    }

    /// A run from what `state` gave, arrays as lists.
    #[staticmethod]
    fn of_state(
        summary: String,
        variables: Vec<Kept>,
        times: Vec<f64>,
        values: Vec<f64>,
        parameters: Vec<(String, f64)>,
    ) -> PyResult<Self> {
        // A run may have failed before its first row.
        let columns = variables.iter().filter_map(|own| own.3).max().map_or(0, |last| last.saturating_add(1));
        if columns.checked_mul(times.len()) != Some(values.len()) {
            return Err(PyValueError::new_err("this is not the state of a run"));
        }
        let fixed = |value: f64| Source { place: Place::Constant(value), negated: false };
        let variables = variables.into_iter().map(|(name, unit, description, column, value)| Variable {
            name,
            unit,
            description,
            slot: column.map_or(Slot::Fixed(fixed(value)), Slot::Column),
        });
        let layout = Layout::restored(variables.collect(), columns);
        let tables =
            Arc::new(Tables { variables: parameters.into_iter().map(parameter).collect(), ..Tables::default() });
        Ok(Self { rows: Arc::new(Rows::restored(layout, tables, times, values)), summary: Report::Text(summary) })
    }
}

/// A parameter of a run that came by pickle: its name and value are all that is known.
fn parameter((name, value): (String, f64)) -> hyd_system::VariableInfo {
    hyd_system::VariableInfo {
        name: hyd_system::NamePattern::scalar(name),
        unit: "".into(),
        display_unit: "".into(),
        description: "".into(),
        kind: hyd_system::ValueKind::Real,
        variability: hyd_system::Variability::Parameter,
        settable: hyd_system::Settable::No,
        protected: false,
        sources: vec![Source { place: Place::Constant(value), negated: false }],
    }
}

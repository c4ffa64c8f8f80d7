//! Numbers that Python sees without a copy, by numpy's array interface (version 3).

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// An array of numbers, row by row.
#[pyclass(frozen, module = "hyd._hyd")]
pub(crate) struct Array {
    values: Vec<f64>,
    shape: Vec<usize>,
}

impl Array {
    /// An array of this shape.
    pub(crate) fn new(values: Vec<f64>, shape: Vec<usize>) -> Self {
        debug_assert_eq!(values.len(), shape.iter().product::<usize>(), "invariant: a value for each place");
        Self { values, shape }
    }

    /// A matrix from its rows.
    pub(crate) fn matrix(rows: &[Vec<f64>], columns: usize) -> Self {
        Self::new(rows.concat(), vec![rows.len(), columns])
    }

    /// A list of numbers.
    pub(crate) fn vector(values: Vec<f64>) -> Self {
        let shape = vec![values.len()];
        Self::new(values, shape)
    }
}

#[pymethods]
impl Array {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        interface(py, &self.values, &self.shape, None)
    }
}

/// What numpy wants to know of numbers that nobody changes any more.  `strides` in bytes; none: row by row without gaps.
pub(crate) fn interface<'py>(
    py: Python<'py>,
    values: &[f64],
    shape: &[usize],
    strides: Option<&[usize]>,
) -> PyResult<Bound<'py, PyDict>> {
    const READ_ONLY: bool = true;
    let description = PyDict::new(py);
    description.set_item("version", 3)?;
    description.set_item("typestr", if cfg!(target_endian = "little") { "<f8" } else { ">f8" })?;
    description.set_item("shape", PyTuple::new(py, shape)?)?;
    description.set_item("data", (values.as_ptr() as usize, READ_ONLY))?;
    if let Some(strides) = strides {
        description.set_item("strides", PyTuple::new(py, strides)?)?;
    }
    Ok(description)
}

//! A linear model as a dictionary of arrays and names.

use hyd_verbs::linear::Linear;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::Array;

/// The linear model for Python.
pub(crate) fn to_dict(py: Python<'_>, linear: Linear) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("json", linear.json())?;
    let (states, inputs) = (linear.states.len(), linear.inputs.len());
    let matrices = &linear.linear;
    for (name, rows, columns) in
        [("A", &matrices.a, states), ("B", &matrices.b, inputs), ("C", &matrices.c, states), ("D", &matrices.d, inputs)]
    {
        dict.set_item(name, Py::new(py, Array::matrix(rows, columns))?)?;
    }
    let (real, imaginary): (Vec<f64>, Vec<f64>) = matrices.eigenvalues.iter().copied().unzip();
    for (name, values) in [("x", linear.x), ("u", linear.u), ("y", linear.y), ("real", real), ("imaginary", imaginary)]
    {
        dict.set_item(name, Py::new(py, Array::vector(values))?)?;
    }
    dict.set_item("states", linear.states)?;
    dict.set_item("inputs", linear.inputs)?;
    dict.set_item("outputs", linear.outputs)?;
    dict.set_item("time", linear.time)?;
    dict.set_item("model", linear.model)?;
    Ok(dict)
}

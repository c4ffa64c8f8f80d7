//! Pictures of series of numbers, drawn as `hyd plot` draws them.

use std::sync::Arc;

use hyd_report::{Curve, Figure};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Image pixels per pixel of the drawing: 192 dpi.
const PNG_SCALE: f64 = 2.0;

/// A curve: its name, its unit, the number of its run, its times (s), its values.
type PyCurve = (String, String, usize, Vec<f64>, Vec<f64>);

/// A picture of curves, one panel for each unit, as the text of an SVG file or the bytes of a PNG file.
#[pyfunction]
pub(crate) fn picture(
    py: Python<'_>,
    curves: Vec<PyCurve>,
    title: Option<String>,
    runs: Vec<String>,
    png: bool,
) -> PyResult<Vec<u8>> {
    if curves.is_empty() {
        return Err(PyValueError::new_err("there is nothing to draw"));
    }
    py.detach(|| {
        let curves = curves
            .into_iter()
            .map(|(name, unit, run, times, values)| (unit, Curve { name, run, times: Arc::from(times), values }));
        let drawing = Figure { title, ..Figure::by_unit(runs, curves) }.draw();
        match png {
            true => drawing.png(PNG_SCALE).map_err(|error| PyValueError::new_err(error.to_string())),
            false => Ok(drawing.svg().into_bytes()),
        }
    })
}

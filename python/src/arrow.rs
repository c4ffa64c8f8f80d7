//! Tables for readers of the Arrow C stream interface (polars, pyarrow, pandas, DuckDB): columns are handed over without a copy.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{ArrayRef, Float64Array, RecordBatch, RecordBatchIterator};
use arrow_buffer::ScalarBuffer;
use arrow_schema::{ArrowError, DataType, Field, Schema};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

/// Key of a unit in the metadata of a column.
const UNIT: &str = "unit";

/// A stream of one batch of columns: name, unit (`""` if unknown), values.
pub(crate) fn stream<'py>(
    py: Python<'py>,
    columns: Vec<(String, String, ScalarBuffer<f64>)>,
) -> PyResult<Bound<'py, PyCapsule>> {
    let mut fields = Vec::with_capacity(columns.len());
    let mut arrays: Vec<ArrayRef> = Vec::with_capacity(columns.len());
    for (name, unit, values) in columns {
        let unit = Some(unit).filter(|unit| !unit.is_empty()).map(|unit| (UNIT.to_string(), unit));
        fields.push(
            Field::new(name, DataType::Float64, false).with_metadata(unit.into_iter().collect::<HashMap<_, _>>()),
        );
        arrays.push(Arc::new(Float64Array::new(values, None)));
    }
    let schema = Arc::new(Schema::new(fields));
    let batch = RecordBatch::try_new(schema.clone(), arrays);
    let batch = batch.map_err(|error| PyValueError::new_err(error.to_string()))?;
    let reader = RecordBatchIterator::new([Ok::<_, ArrowError>(batch)], schema);
    let stream = FFI_ArrowArrayStream::new(Box::new(reader));
    PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
}

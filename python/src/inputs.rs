//! Recorded inputs: a file, or columns that Python brings.

use std::path::PathBuf;

use hyd_run::{Failure, InputArguments, InputTable};
use pyo3::prelude::*;

/// What messages call a table that stands in no file.
const NAME: &str = "inputs";

/// A file, or times and named columns.
#[derive(FromPyObject)]
pub(crate) enum Inputs {
    /// The name of a file.
    File(PathBuf),
    /// Times in s, and the columns.
    Columns(Vec<f64>, Vec<(String, Vec<f64>)>),
}

/// The table of inputs.
///
/// # Errors
/// As for the table of `--input`.
pub(crate) fn table(inputs: Option<Inputs>, hold: Vec<String>) -> Result<Option<InputTable>, Failure> {
    match inputs {
        None if hold.is_empty() => Ok(None),
        None => Err(Failure::Usage("hold says what inputs do between samples, and there are no inputs".to_string())),
        Some(Inputs::File(path)) => InputArguments { input: Some(path), hold }.read(),
        Some(Inputs::Columns(times, columns)) => InputTable::of_columns(NAME, times, columns, &hold).map(Some),
    }
}

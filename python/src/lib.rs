//! The extension module `hyd._hyd`: models, runs, sweeps and studies as Python objects.
//!
//! What users call stands in the Python files beside this folder, with its documentation; here are thin classes over the crates that the command uses.
//! Numbers leave as views of memory that Rust owns (`array`, `rows`), messages as exceptions and warnings (`messages`), long work releases the
//! interpreter's lock and looks for signals meanwhile (`signals`).

mod array;
mod arrow;
mod function;
mod inputs;
mod linear;
mod messages;
mod model;
mod picture;
mod rows;
mod run;
mod run_options;
mod signals;
mod sources;
mod study;
mod sweep;
mod translated;

use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::prelude::*;

/// Runs the command `hyd` with these arguments, the first being the name of the program; gives its exit code.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| hyd::exit_code(arguments))
}

/// Names the folder of the programs that were made with the package: the launcher of executables, and the library of units.
#[pyfunction]
fn prebuilt_in(folder: PathBuf) {
    hyd::prebuilt_in(folder);
}

/// What a misspelt name may have been meant to be, as a sentence.
#[pyfunction]
fn did_you_mean(wrong: &str, candidates: Vec<String>) -> Option<String> {
    hyd_compiler::did_you_mean(wrong, candidates.iter().map(String::as_str))
}

/// The module.
#[pymodule]
fn _hyd(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(prebuilt_in, module)?)?;
    module.add_function(wrap_pyfunction!(did_you_mean, module)?)?;
    module.add_function(wrap_pyfunction!(picture::picture, module)?)?;
    module.add_class::<array::Array>()?;
    module.add_class::<rows::Column>()?;
    module.add_class::<rows::Matrix>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<run::Run>()?;
    module.add_class::<function::Function>()?;
    module.add_class::<study::Study>()
}

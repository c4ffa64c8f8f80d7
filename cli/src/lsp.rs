//! `hyd lsp`: the language server on standard input and output.

use crate::Failure;
use crate::arguments::Lsp;

/// Runs the verb.
pub(crate) fn lsp(arguments: &Lsp) -> Result<(), Failure> {
    let Lsp { libraries, strict_units, .. } = arguments;
    let options = hyd_lsp::Options { libraries: libraries.libraries(), strict_units: *strict_units, built_in: None };
    hyd_lsp::serve_stdio(&options)
        .map_err(|sentence| Failure::Usage(format!("the editor cannot be served: {sentence}")))
}

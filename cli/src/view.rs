//! `hyd view FILE`: a model or results as a page, served on the loopback or written as a file.

use crate::arguments::View;
use crate::terminal::Terminal;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn view(arguments: &View) -> Result<(), Failure> {
    let View { files, bench, model, set, stop, output, port, libraries, strict_units } = arguments;
    let options = hyd_view::Options {
        files: files.clone(),
        class: model.clone(),
        set: set.clone(),
        stop: *stop,
        libraries: libraries.libraries(),
        strict_units: *strict_units,
        output: output.clone(),
        port: port.unwrap_or(0),
        bench: bench.clone(),
        // Where this program cannot find itself, only units miss it.
        host: crate::unit::host(None).ok(),
    };
    hyd_view::view(&options, &Terminal::TEXT, &output::print)
}

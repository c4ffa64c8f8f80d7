//! `hyd mcp FOLDER`: the server for agents on standard input and output.

use hyd_verbs::Libraries;

use crate::Failure;
use crate::arguments::Mcp;

/// Runs the verb.
pub(crate) fn mcp(arguments: &Mcp) -> Result<(), Failure> {
    let Mcp { folder, library, strict_units } = arguments;
    let libraries = Libraries { folders: library.clone(), ..Libraries::default() };
    let options = hyd_mcp::Options { folder: folder.clone(), libraries, strict_units: *strict_units };
    hyd_mcp::serve_stdio(&options).map_err(Failure::Usage)
}

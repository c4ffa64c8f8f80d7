//! Names of files that are to be written, looked at before any work.
//!
//! No verb writes over a file that it reads (`hyd_results::refuse_read`, which every file that is written goes through), nor a
//! result over a source text.

use std::path::Path;

use hyd_results::{note_read, refuse_read};

use crate::Failure;

/// Endings of source texts, none of which `hyd` writes at a user's word.
const TEXTS: [&str; 3] = ["hyd", "mo", "toml"];

/// Refuses the file of an option if it would replace a source text or one of the files that are read.  `read`: those that are
/// known to be read later.
///
/// # Errors
/// Wrong usage.
pub fn check_target(option: &str, path: &Path, read: &[&Path]) -> Result<(), Failure> {
    read.iter().for_each(|file| note_read(file));
    let shown = path.display();
    refuse_read(path).map_err(|error| Failure::Usage(format!("{option} `{shown}` cannot be written: {error}")))?;
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    if extension.is_some_and(|extension| TEXTS.contains(&extension.as_str())) {
        return Err(Failure::Usage(format!("{option} `{shown}` would replace a source text")));
    }
    Ok(())
}

//! The language server, `hyd lsp`: what an editor asks about model texts, answered by the compiler.
//!
//! [`serve`] speaks the Language Server Protocol (3.17) over a connection.  The thread that reads messages (`server`) keeps the documents
//! (`documents`, `lines`); `checker` translates what is open and tells what is wrong (`check`, `diagnostics`), `requests` answers questions,
//! each kind in a file of its own.  Both work in a `session`: the documents as they are in the editor, libraries as `--library` finds
//! them, syntax trees that are kept as long as their texts do not change.  What names mean is asked of the compiler; only what is being typed
//! is read from tokens (`context`), since the tree of half a line tells nothing.

mod actions;
mod annotations;
mod capabilities;
mod check;
mod checker;
mod completion;
mod context;
mod definition;
mod diagnostics;
mod documents;
mod folding;
mod formatting;
mod hints;
mod hover;
mod lenses;
mod lines;
mod math;
mod modifiers;
mod predefined;
mod references;
mod renaming;
mod requests;
mod server;
mod session;
mod signature;
mod symbols;
mod tokens;

#[cfg(test)]
mod tests;

use std::path::PathBuf;

use lsp_server::Connection;

use hyd_verbs::Libraries;
use session::Settings;

/// What the command line says.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Where classes come from beside the package of each document.
    pub libraries: Libraries,
    /// Units that do not fit are errors in libraries, too.
    pub strict_units: bool,
    /// Where texts of the built-in library are laid down for editors to open; none: beside the caches of the user.
    pub built_in: Option<PathBuf>,
}

/// Serves standard input and output until the client ends.
///
/// # Errors
/// What is wrong with the connection.
pub fn serve_stdio(options: &Options) -> Result<(), String> {
    let (connection, threads) = Connection::stdio();
    let is_quiet = serve(&connection, options)?;
    drop(connection);
    // What a thread at work may still say interests nobody, and the end of the process ends it.
    if is_quiet { threads.join().map_err(|error| error.to_string()) } else { Ok(()) }
}

/// Serves a connection until the client ends it; false where a translation is still going on then, whose thread ends with it.
///
/// # Errors
/// What is wrong with the connection.
pub fn serve(connection: &Connection, options: &Options) -> Result<bool, String> {
    let libraries = options.libraries.fixed();
    let settings = Settings {
        libraries: libraries.folders,
        allow_outside: libraries.allow_outside,
        strict_units: options.strict_units,
        built_in: options.built_in.clone().unwrap_or_else(server::built_in_folder),
        ..Settings::default()
    };
    server::serve(connection, settings)
}

//! The server for agents, `hyd mcp FOLDER`: the verbs as tools of the Model Context Protocol, over lines of standard input and output.
//!
//! `lines` cuts what comes into messages, `protocol` says what they mean in the versions that are spoken, `server` answers them: questions about
//! the server at once, calls of tools one after the other on a thread of their own (`calls`).  A tool is a name, a list of arguments, from which
//! its schema and the reading of its arguments are made (`arguments`), and a function; each stands in a file below `tools`.  Names of files lead
//! nowhere but into the folder (`folder`).  What verbs say on the way is kept for the answer and told as progress (`kept`).

mod answer;
mod arguments;
mod calls;
mod folder;
mod kept;
mod lines;
mod progress;
mod protocol;
mod server;
mod tools;

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use hyd_verbs::Libraries;

use folder::Folder;
use protocol::Outgoing;

/// What the command line says.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The folder that the tools work in.
    pub folder: PathBuf,
    /// Where classes come from beside it.
    pub libraries: Libraries,
    /// Units that do not fit are errors in libraries, too.
    pub strict_units: bool,
}

/// Serves standard input and output until the client ends or Ctrl-C is pressed.  The folder becomes the current one of the process, so that names in
/// answers are those that were given.
///
/// # Errors
/// The folder is none, or no thread can be started.
pub fn serve_stdio(options: &Options) -> Result<(), String> {
    let libraries = options.libraries.fixed();
    let folder = Folder::enter(&options.folder)?;
    let libraries = Libraries { allow_outside: false, fence: Some(folder.root().to_path_buf()), ..libraries };
    let strict_units = options.strict_units;
    let workplace = move || calls::Workplace::new(folder, libraries, strict_units);
    server::serve(|| io::BufReader::new(io::stdin()), Arc::new(Outgoing::new(io::stdout())), workplace)
}

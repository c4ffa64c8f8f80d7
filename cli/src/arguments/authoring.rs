//! Arguments of the verbs that work on texts: `fmt`, `new`, `doc`, and of the servers: `lsp`, `mcp`.

use std::path::PathBuf;

use clap::Args;

use super::{LibraryArguments, MessageFormat};

/// `hyd fmt`
#[derive(Args, Debug)]
#[command(
    after_help = "Prints the names of the files it changes.  Comments stay, and so does one empty line where there \
                        were some.\nA file with a syntax error is left as it is."
)]
pub struct Fmt {
    /// Files, folders (all .hyd and .mo files in them and below), or - for standard input to standard output
    #[arg(value_name = "PATH", required = true)]
    pub paths: Vec<PathBuf>,
    /// Changes nothing; names the files that are not formatted and ends with exit code 1 if there are any
    #[arg(long)]
    pub check: bool,
    /// How messages are written to standard error
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub message_format: MessageFormat,
}

/// `hyd new`
#[derive(Args, Debug)]
pub struct New {
    /// The folder to make; its name becomes that of the model
    #[arg(value_name = "NAME")]
    pub name: PathBuf,
}

/// `hyd unit`
#[derive(Args, Debug)]
pub struct UnitFile {
    /// The unit
    #[arg(value_name = "X.fmu")]
    pub file: PathBuf,
    /// Writes the unit as a block, for models in which it is a component
    #[arg(long, short, value_name = "F.hyd")]
    pub output: Option<PathBuf>,
    /// Also gives the block this variable, which is not an output
    #[arg(long, value_name = "NAME", requires = "output")]
    pub read: Vec<String>,
    /// Prints all of it as JSON
    #[arg(long, conflicts_with = "output")]
    pub json: bool,
}

/// `hyd doc`
#[derive(Args, Debug)]
pub struct Doc {
    /// A folder with a library [default: the built-in library]
    #[arg(value_name = "DIR")]
    pub library: Option<PathBuf>,
    /// The page
    #[arg(long, short, value_name = "F.html", default_value = "library.html")]
    pub output: PathBuf,
    /// Runs no examples
    #[arg(long)]
    pub no_pictures: bool,
}

/// `hyd lsp`
#[derive(Args, Debug)]
#[command(
    after_help = "Editors start it; see docs/guides/editor.md.  They may give it `library` (a list of folders), `strictUnits` and \
                        `allowOutside` as initialization options, too."
)]
pub struct Lsp {
    #[command(flatten)]
    pub libraries: LibraryArguments,
    /// Units that do not fit are errors in the texts of libraries, too, not only in those of the model
    #[arg(long)]
    pub strict_units: bool,
    /// Standard input and output, which is the only way; editors that always say so may
    #[arg(long, hide = true)]
    pub stdio: bool,
}

/// `hyd mcp`
#[derive(Args, Debug)]
#[command(
    after_help = "Clients of agents start it; see docs/guides/agent.md.  Names of files that an agent gives lead nowhere but into FOLDER, and nothing that is \
                        there is written over.  The server ends with its input, or by Ctrl-C."
)]
pub struct Mcp {
    /// The folder that is served: models, studies and tables are read there, results written there
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    /// Folder with libraries, or one library (repeatable; then HYD_LIBRARY, MODELICAPATH and the built-in library)
    #[arg(long = "library", value_name = "DIR")]
    pub library: Vec<PathBuf>,
    /// Units that do not fit are errors in the texts of libraries, too, not only in those of the model
    #[arg(long)]
    pub strict_units: bool,
}

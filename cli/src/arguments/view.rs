//! The options of `hyd view`.

use std::path::PathBuf;

use clap::Args;
use hyd_run::arguments::assignment;

use super::LibraryArguments;

/// `hyd view`
#[derive(Args, Debug)]
#[command(
    after_help = "The page is served on the loopback alone, at an address with a random token, until Ctrl-C; nothing is written and no request leaves the machine.  \
                  `--output` writes the same as one file that needs neither hyd nor a network, in which parameters are fixed.  See docs/guides/view.md."
)]
pub struct View {
    /// A model (.hyd, .mo) or a unit (.fmu), then results that are overlaid and the folder of a report of it; or a study (.toml), with --bench; or results (.csv, .parquet, .mat); or
    /// the folder of a report
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// The set of shots of a study, drawn beside its model
    #[arg(long, value_name = "SET.json")]
    pub bench: Option<PathBuf>,
    /// The class to take [default: the last complete model of the file]
    #[arg(long, value_name = "CLASS")]
    pub model: Option<String>,
    /// Sets a parameter by its full name (repeatable)
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Stop time of runs in s [default: the model's experiment annotation, else 1]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub stop: Option<f64>,
    /// Writes the page instead of serving it
    #[arg(long, short, value_name = "PAGE.html")]
    pub output: Option<PathBuf>,
    /// The port of the loopback [default: a free one]
    #[arg(long, value_name = "PORT", conflicts_with = "output")]
    pub port: Option<u16>,
    #[command(flatten)]
    pub libraries: LibraryArguments,
    /// Units that do not fit are errors in the texts of libraries, too, not only in those of the model
    #[arg(long)]
    pub strict_units: bool,
}

//! The command line of executables as data.

use std::path::PathBuf;

use clap::Parser;
use hyd_run::arguments::assignment;
use hyd_run::{MessageFormat, RunArguments, SweepArguments};

/// `EXE ...`
#[derive(Parser, Debug)]
#[command(disable_version_flag = true)]
pub struct Run {
    /// Sets a parameter by its full name (repeatable)
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Sets parameters from a file of lines NAME = VALUE, in TOML; `--set` overrides it
    #[arg(long, value_name = "FILE.toml")]
    pub parameters: Option<PathBuf>,
    /// The run and what becomes of it
    #[command(flatten)]
    pub run: RunArguments,
    /// How messages are written to standard error
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub message_format: MessageFormat,
    /// Prints which model this is, and what made it
    #[arg(long)]
    pub version: bool,
}

/// `EXE shard ...`
#[derive(Parser, Debug)]
#[command(disable_version_flag = true)]
pub struct Shard {
    /// The folder of the results, as `hyd sweep --shards` has made it
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Which share, from 0
    #[arg(value_name = "I")]
    pub index: usize,
    /// Number of threads [default: as many as the sweep was shared out for]
    #[arg(long, value_name = "N")]
    pub threads: Option<std::num::NonZeroUsize>,
}

/// `EXE sweep ...`
#[derive(Parser, Debug)]
#[command(disable_version_flag = true)]
pub struct Sweep {
    /// A plan, or `merge`
    #[arg(value_name = "PLAN.toml|merge")]
    pub plan: Option<PathBuf>,
    /// The folder whose parts `merge` joins
    #[arg(value_name = "DIR")]
    pub folder: Option<PathBuf>,
    /// The runs and what becomes of them
    #[command(flatten)]
    pub sweep: SweepArguments,
}

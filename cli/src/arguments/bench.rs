//! Arguments of `hyd bench`: measured data from a lab's files to a set of shots.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

/// `hyd bench ...`
#[derive(Args, Debug)]
pub struct BenchArguments {
    /// What to do
    #[command(subcommand)]
    pub verb: BenchVerb,
}

/// What to do with measured data.
#[derive(Subcommand, Debug)]
pub enum BenchVerb {
    /// Read a folder of a lab's files, say what was assumed, write tables, a set and a first study
    Import(Import),
    /// Write a page that shows all shots and channels of a set, before any model
    Show(Show),
    /// Print the JSON Schema of studies or sets
    Schema(Schema),
}

/// `hyd bench import`
#[derive(Args, Debug)]
#[command(
    after_help = "Reads .csv, .tsv, .txt, .dat, .asc, .parquet and .mat files. What it assumes stands in import.toml, which can be edited \
                        and imported again; set.json is what --bench of `hyd fit` and `hyd discover` takes."
)]
pub struct Import {
    /// A folder of files, or an import file
    #[arg(value_name = "FOLDER|IMPORT.toml")]
    pub source: PathBuf,
    /// The folder to write [default: FOLDER_bench; for an import file its own folder]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Samples per second, where no column holds times
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// The column of times (repeatable, where columns have times of their own) [default: those that look like times]
    #[arg(long, value_name = "COLUMN", conflicts_with = "rate")]
    pub time: Vec<String>,
    /// Leaves out rows whose time is that of the row before
    #[arg(long)]
    pub drop_repeated: bool,
    /// The column whose first edge becomes time 0 [default: the only column that looks like a trigger]
    #[arg(long, value_name = "COLUMN")]
    pub trigger: Option<String>,
    /// Takes no column for a trigger: times stay as they are
    #[arg(long, conflicts_with = "trigger")]
    pub no_trigger: bool,
    /// Leaves a column out (repeatable)
    #[arg(long, value_name = "COLUMN")]
    pub skip: Vec<String>,
}

/// `hyd bench show`
#[derive(Args, Debug)]
pub struct Show {
    /// The set of shots
    #[arg(value_name = "SET.json")]
    pub set: PathBuf,
    /// The study, for words, units and the column of times [default: all columns, with times in time_s]
    #[arg(long, value_name = "STUDY.toml")]
    pub study: Option<PathBuf>,
    /// The page
    #[arg(long, short, value_name = "F.html", default_value = "bench.html")]
    pub output: PathBuf,
    /// Lets the set name files outside of its own folder
    #[arg(long)]
    pub allow_outside: bool,
}

/// `hyd bench schema`
#[derive(Args, Debug)]
pub struct Schema {
    /// Which one
    #[arg(value_name = "study|set")]
    pub kind: SchemaKind,
}

/// Files that have a schema.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum SchemaKind {
    /// Studies, TOML.
    Study,
    /// Sets, JSON.
    Set,
}

//! Options of runs and sweeps as data: their defaults and help.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::InputArguments;

/// How messages are written.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum MessageFormat {
    /// For people.
    Text,
    /// One JSON object per line.
    Json,
}

/// Full names of variables, in the order of the command line.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Names(pub Vec<String>);

/// Methods of integration.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum Solver {
    /// Chosen during the run: BDF, esdirk where lightly damped oscillations limit it.
    Auto,
    /// Backward differentiation formulas of order 1 to 5.
    Bdf,
    /// An L-stable one-step method of order 4.
    Esdirk,
}

impl Solver {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Solver::Auto => "auto",
            Solver::Bdf => "bdf",
            Solver::Esdirk => "esdirk",
        }
    }
}

/// Options of one run.
#[derive(Args, Clone, Debug)]
pub struct RunArguments {
    /// Start time in s, when the model has its start values [default: the model's experiment annotation, else 0]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub start: Option<f64>,
    /// Stop time in s [default: the model's experiment annotation, else the end of the table of inputs, else 1 s after the start]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub stop: Option<f64>,
    /// Relative tolerance [default: the model's experiment annotation, else 1e-6]
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// Number of equal output intervals [default: the model's experiment annotation, else 500]
    #[arg(long, value_name = "N", conflicts_with = "every_step", allow_negative_numbers = true)]
    pub intervals: Option<usize>,
    /// Output at every step of the solver
    #[arg(long)]
    pub every_step: bool,
    /// Number of steps after which the run is given up [default: 50 million]
    #[arg(long, value_name = "N")]
    pub max_steps: Option<std::num::NonZeroU64>,
    /// Method of integration
    #[arg(long, value_name = "METHOD", default_value = "auto")]
    pub solver: Solver,
    #[allow(missing_docs)] // a comment here would become the help of the command
    #[command(flatten)]
    pub inputs: InputArguments,
    /// Writes results in the format of the name
    #[arg(long, value_name = "F.csv|.mat|.parquet")]
    pub result: Option<PathBuf>,
    /// Variables that are written, drawn and listed: those whose full name matches
    #[arg(long, value_name = "REGEX")]
    pub variables: Option<String>,
    /// Adds derivatives d(x)/d(P) of all recorded variables; P is a parameter, or a variable for its start value
    #[arg(long, value_name = "P,...", value_parser = names)]
    pub sensitivity: Option<Names>,
    /// What runs the code: native, or vm, the interpreter
    #[arg(long, value_name = "BACKEND", default_value = "native")]
    pub backend: BackendName,
    /// Says where the time of the run went, and which variables, equations and relations kept its steps short
    #[arg(long)]
    pub profile: bool,
    /// Prints the summary as JSON
    #[arg(long)]
    pub json: bool,
}

impl Default for RunArguments {
    /// A run as the model says, of which nothing is written or printed.
    fn default() -> Self {
        Self {
            start: None,
            stop: None,
            tolerance: None,
            intervals: None,
            every_step: false,
            max_steps: None,
            solver: Solver::Auto,
            inputs: InputArguments::default(),
            result: None,
            variables: None,
            sensitivity: None,
            backend: BackendName::Native,
            profile: false,
            json: false,
        }
    }
}

/// What runs the code.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum BackendName {
    /// Machine code; interpreted where the system refuses executable memory.
    Native,
    /// The interpreter.
    Vm,
}

impl BackendName {
    /// What it stands for.
    pub fn backend(self) -> hyd_payload::Backend {
        match self {
            BackendName::Native => hyd_payload::Backend::Native,
            BackendName::Vm => hyd_payload::Backend::Vm,
        }
    }
}

/// Options of many runs.
#[derive(Args, Clone, Debug)]
pub struct SweepArguments {
    /// Varies a parameter (repeatable; the first changes slowest)
    #[arg(long = "vary", value_name = "NAME=VALUES", value_parser = assignment)]
    pub vary: Vec<(String, String)>,
    /// Number of draws from distributions
    #[arg(long, value_name = "N")]
    pub samples: Option<usize>,
    /// How draws fill their space: lhs (Latin hypercube) or random [default: lhs]
    #[arg(long, value_name = "METHOD")]
    pub method: Option<DrawMethod>,
    /// Seed of the draws [default: 0]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Folder of the results
    #[arg(long, value_name = "DIR")]
    pub result: Option<PathBuf>,
    /// Keeps all rows of every run, not only the last
    #[arg(long)]
    pub rows: bool,
    /// Measures every run, such as `max(y)`, `when(y > 4e-3)` or `mean(p)/2` (repeatable); members.parquet gets a column for it
    #[arg(long = "measure", value_name = "EXPRESSION", allow_hyphen_values = true)]
    pub measure: Vec<String>,
    /// Runs only share I of N, I from 0
    #[arg(long, value_name = "I/N")]
    pub shard: Option<String>,
    #[allow(missing_docs)] // a comment here would become the help of the command
    #[command(flatten)]
    pub inputs: InputArguments,
    /// Number of threads [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<std::num::NonZeroUsize>,
    /// Variables that are kept: those whose full name matches
    #[arg(long, value_name = "REGEX")]
    pub variables: Option<String>,
    /// Stop time in s
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub stop: Option<f64>,
    /// Relative tolerance
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// Number of equal output intervals per run
    #[arg(long, value_name = "N")]
    pub intervals: Option<usize>,
    /// Sets a parameter that does not vary, by its full name (repeatable)
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Sets parameters from a file of lines NAME = VALUE, in TOML; `--set` overrides it, and so does what is varied
    #[arg(long, value_name = "FILE.toml")]
    pub parameters: Option<PathBuf>,
    /// How messages are written to standard error
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub message_format: MessageFormat,
    /// Prints the summary as JSON
    #[arg(long)]
    pub json: bool,
}

/// How draws are made.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum DrawMethod {
    /// Latin hypercube.
    Lhs,
    /// Independent draws.
    Random,
}

/// `NAME=VALUE`.
///
/// # Errors
/// A sentence.
pub fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().to_string(), value.trim().to_string()))
        }
        _ => Err("expected NAME=VALUE".to_string()),
    }
}

/// Names between commas; commas inside brackets belong to subscripts.
///
/// # Errors
/// A sentence.
pub fn names(text: &str) -> Result<Names, String> {
    let mut depth = 0;
    let mut list = vec![String::new()];
    for c in text.chars() {
        match c {
            '[' => depth += 1,
            ']' => depth -= 1,
            _ => {}
        }
        match list.last_mut() {
            Some(last) if c != ',' || depth > 0 => last.push(c),
            _ => list.push(String::new()),
        }
    }
    let list: Vec<String> = list.iter().map(|name| name.trim().to_string()).collect();
    if list.iter().any(String::is_empty) { Err("expected names between commas".into()) } else { Ok(Names(list)) }
}

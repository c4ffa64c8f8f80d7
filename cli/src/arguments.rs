//! The command line as data: verbs, options, their defaults and help.

mod authoring;
mod bench;
mod shell;
mod view;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use hyd_run::arguments::{assignment, names};
pub(crate) use hyd_run::{MessageFormat, Names, RunArguments, SweepArguments};

pub(crate) use authoring::{Doc, Fmt, Lsp, Mcp, New, UnitFile};
pub(crate) use bench::{BenchArguments, BenchVerb, Import, Schema, SchemaKind, Show};
pub(crate) use shell::{Completions, ManPages};
pub(crate) use view::View;

/// `hyd VERB ...`
#[derive(Parser, Debug)]
#[command(
    name = "hyd",
    version,
    about = "Compiler and solver for equation-based models of physical systems",
    after_help = "Exit codes: 0 done; 1 the model or the data is at fault; 2 wrong usage; 3 the solver gave up or was \
                  stopped.\nMessages go to standard error, results to standard output."
)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
}

impl Arguments {
    /// How messages are to be written.
    pub(crate) fn message_format(&self) -> MessageFormat {
        match &self.verb {
            Verb::Check(verb) => verb.model.message_format,
            Verb::Simulate(verb) => verb.model.message_format,
            Verb::Build(verb) => verb.model.message_format,
            Verb::Linearize(verb) => verb.model.message_format,
            Verb::Equations(verb) => verb.model.message_format,
            Verb::Sweep(verb) => verb.sweep.message_format,
            Verb::Fmt(verb) => verb.message_format,
            Verb::Plot(_)
            | Verb::Compare(_)
            | Verb::Test(_)
            | Verb::Diff(_)
            | Verb::Explain(_)
            | Verb::New(_)
            | Verb::Unit(_)
            | Verb::Doc(_)
            | Verb::Lsp(_)
            | Verb::Mcp(_)
            | Verb::View(_)
            | Verb::Completions(_)
            | Verb::Man(_)
            | Verb::Bench(_)
            | Verb::Fit(_)
            | Verb::Discover(_)
            | Verb::Next(_) => MessageFormat::Text,
        }
    }
}

/// What to do.
#[derive(Subcommand, Debug)]
pub enum Verb {
    /// Check a model: types, units, balance, structure; print the counts
    Check(Check),
    /// Simulate a model, or a unit of another tool (*.fmu)
    Simulate(Box<Simulate>),
    /// Make an executable of a model that runs without hyd
    Build(Build),
    /// Linearize a model at a point of a run, with its eigenvalues
    Linearize(Linearize),
    /// Print a stage of the translation
    Equations(Equations),
    /// Draw results, several runs overlaid
    Plot(Plot),
    /// Look at a model or at results in a browser: diagram, curves, parameters as sliders
    View(View),
    /// Run a model many times with varied parameters, on all cores
    Sweep(Box<Sweep>),
    /// Turn a lab's files into a set of shots, and inspect it
    Bench(BenchArguments),
    /// Fit what may be off to the shots of a bench
    Fit(Fit),
    /// Find where model and bench disagree, name what is missing, write the model that has it
    Discover(Discover),
    /// Propose the shots that settle what a search leaves open
    Next(Next),
    /// Compare two results
    Compare(Compare),
    /// What changed in the models of two texts, whatever changed in layout, comments, order and graphics
    Diff(Diff),
    /// Run models and compare with the results that are stored beside them
    Test(Test),
    /// Explain an error code, or list all of them
    Explain(Explain),
    /// Format the texts of models
    Fmt(Fmt),
    /// Write the map of a library as one HTML page
    Doc(Doc),
    /// Say what a unit of another tool (*.fmu) has, or write it as a block for models
    Unit(UnitFile),
    /// Make a folder with a small drive, a study and a README
    New(New),
    /// Serve an editor on standard input and output (Language Server Protocol)
    Lsp(Lsp),
    /// Serve an agent on standard input and output (Model Context Protocol)
    Mcp(Mcp),
    /// Print the completions of a shell
    Completions(Completions),
    /// Write manual pages
    Man(ManPages),
}

/// What all verbs that translate a model share.
#[derive(Args, Debug)]
pub struct ModelArguments {
    /// The model's file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The class to take [default: the last complete model of the file]
    #[arg(long, value_name = "CLASS")]
    pub model: Option<String>,
    /// Sets a parameter by its full name (repeatable)
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// Sets parameters from a file of lines NAME = VALUE, in TOML; `--set` overrides it
    #[arg(long, value_name = "FILE.toml")]
    pub parameters: Option<PathBuf>,
    #[command(flatten)]
    pub libraries: LibraryArguments,
    /// Units that do not fit are errors in the texts of libraries, too, not only in those of the model
    #[arg(long)]
    pub strict_units: bool,
    /// How messages are written to standard error
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub message_format: MessageFormat,
}

impl ModelArguments {
    /// Puts what the file of parameters says before what is set one by one.
    ///
    /// # Errors
    /// The file cannot be read or holds what is not a value.
    pub fn read_parameters(&mut self) -> Result<(), hyd_run::Failure> {
        if let Some(path) = &self.parameters {
            let mut set = hyd_run::parameter_file::read(path)?;
            set.append(&mut self.set);
            self.set = set;
        }
        Ok(())
    }
}

/// Where classes come from.
#[derive(Args, Clone, Debug, Default)]
pub struct LibraryArguments {
    /// Folder with libraries, or one library: class A is DIR/A/package.hyd or DIR/A.hyd, .mo serves too (repeatable; then
    /// HYD_LIBRARY, MODELICAPATH and the built-in library)
    #[arg(long = "library", value_name = "DIR")]
    pub library: Vec<PathBuf>,
    /// Lets models, studies, sets and plans name files outside of their own folder and those of the libraries
    #[arg(long)]
    pub allow_outside: bool,
}

/// `hyd check`
#[derive(Args, Debug)]
pub struct Check {
    #[command(flatten)]
    pub model: ModelArguments,
    /// Lists the variables of unknown unit
    #[arg(long)]
    pub unknown_units: bool,
    /// Makes the changes that messages propose in FILE, or one after which the model runs: shows them, then writes them
    #[arg(long)]
    pub fix: bool,
    /// End of the run that has to succeed after --fix (s) [default: as the model says]
    #[arg(long, value_name = "T", requires = "fix", allow_negative_numbers = true)]
    pub stop: Option<f64>,
}

/// `hyd equations`
#[derive(Args, Debug)]
pub struct Equations {
    #[command(flatten)]
    pub model: ModelArguments,
    #[command(flatten)]
    pub wanted: EquationsWanted,
}

/// What is shown of the equations; one of them.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
pub struct EquationsWanted {
    /// Prints a stage of the translation
    #[arg(long, value_name = "STAGE")]
    pub stage: Option<StageName>,
    /// Explains a variable: what it equals, what it is solved from, in which block, and where that stands in the text
    #[arg(long, value_name = "VARIABLE")]
    pub explain: Option<String>,
    /// Writes a page that shows the structure of the equations with the text they come from
    #[arg(long, value_name = "F.html")]
    pub html: Option<PathBuf>,
}

/// Stages of the translation.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum StageName {
    /// Variables and equations without components.
    Flat,
    /// After elimination of aliases.
    System,
    /// After index reduction.
    Reduced,
    /// In the order of computation.
    Sorted,
    /// Partial derivatives and their pattern.
    Jacobian,
    /// C of residual, Jacobian and events.
    C,
}

/// `hyd simulate`
#[derive(Args, Debug)]
pub struct Simulate {
    #[command(flatten)]
    pub model: ModelArguments,
    #[command(flatten)]
    pub run: RunArguments,
    /// Draws the results
    #[arg(long, value_name = "F.svg|F.png")]
    pub plot: Option<PathBuf>,
    /// Writes where the time of the run went as a page: parts, components, variables, equations, relations, cost of the code
    #[arg(long, value_name = "F.html")]
    pub profile_page: Option<PathBuf>,
    /// Which of its two kinds a unit of another tool (FILE.fmu) is used as [default: model-exchange where it offers that]
    #[arg(long = "as", value_name = "KIND", value_enum)]
    pub kind: Option<UnitKind>,
    /// Distance of the communication points of co-simulation in s [default: as the unit proposes, else an output interval]
    #[arg(long, value_name = "H", allow_negative_numbers = true)]
    pub step: Option<f64>,
    /// Seconds after which a call of a unit is given up [default: 60]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub call_limit: Option<f64>,
}

/// Kinds of use of a unit.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum UnitKind {
    /// The unit gives rates, the solver of hyd integrates.
    ModelExchange,
    /// The unit integrates by itself from one communication point to the next.
    CoSimulation,
}

/// `hyd build`
#[derive(Args, Debug)]
#[command(
    after_help = "Parameters that are set here are the executable's defaults; those that decide sizes or structure can be set \
                        nowhere else."
)]
pub struct Build {
    #[command(flatten)]
    pub model: ModelArguments,
    /// Inputs of the model that the executable reads from a table (--input DATA.csv): their names, an array by any of its elements
    #[arg(long, value_name = "NAME,...", value_parser = names)]
    pub input: Option<Names>,
    /// Makes a unit for other tools (model exchange and co-simulation) by this version of the Functional Mock-up Interface instead of an
    /// executable; inputs of type Real are its inputs
    #[arg(long, value_name = "2.0|3.0", value_enum, conflicts_with = "input")]
    pub fmu: Option<FmiVersion>,
    /// The executable, or the unit
    #[arg(long, short, value_name = "EXE|FMU")]
    pub output: PathBuf,
    /// Makes all variables of loops of equations unknowns of the solver: slower, for values of the parameters with which rounding errors
    /// grow along a loop
    #[arg(long)]
    pub whole_loops: bool,
    /// Prints what was made as JSON
    #[arg(long)]
    pub json: bool,
}

/// Versions of the Functional Mock-up Interface.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum FmiVersion {
    /// 2.0
    #[value(name = "2.0", alias = "2")]
    Two,
    /// 3.0
    #[value(name = "3.0", alias = "3")]
    Three,
}

/// `hyd linearize`
#[derive(Args, Debug)]
pub struct Linearize {
    #[command(flatten)]
    pub model: ModelArguments,
    /// Time of the point in s: the run goes there from its start
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub at: f64,
    /// A parameter that is an input of the linear model (repeatable) [default: the inputs of the model]
    #[arg(long, value_name = "NAME")]
    pub input: Vec<String>,
    /// A variable that is an output of the linear model (repeatable) [default: the outputs of the model]
    #[arg(long, value_name = "NAME")]
    pub output: Vec<String>,
    /// Relative tolerance of the run [default: the model's experiment annotation, else 1e-6]
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// Writes the matrices, the point and the names
    #[arg(long, value_name = "F.json|F.mat")]
    pub result: Option<PathBuf>,
    /// Prints the linear model as JSON
    #[arg(long)]
    pub json: bool,
}

/// `hyd plot`
#[derive(Args, Debug)]
pub struct Plot {
    /// Result files; several are overlaid
    #[arg(value_name = "F.csv|.mat|.parquet", required = true)]
    pub files: Vec<PathBuf>,
    /// Variables to draw: those whose full name matches
    #[arg(long, value_name = "REGEX")]
    pub variables: Option<String>,
    /// The picture [default: the first file's name with .svg]
    #[arg(long, short, value_name = "F.svg|F.png")]
    pub output: Option<PathBuf>,
    /// Line above the picture
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Unit of a variable, such as hy.p=Pa (repeatable)
    #[arg(long = "unit", value_name = "NAME=UNIT", value_parser = assignment)]
    pub unit: Vec<(String, String)>,
    /// Takes units from the model that was simulated
    #[arg(long, value_name = "FILE")]
    pub model_file: Option<PathBuf>,
    /// The class in the model's file [default: the last complete model of the file]
    #[arg(long, value_name = "CLASS", requires = "model_file")]
    pub model: Option<String>,
    #[command(flatten)]
    pub libraries: LibraryArguments,
}

/// `hyd sweep`
#[derive(Args, Debug)]
#[command(after_help = "VALUES: FROM:TO:COUNT, log:FROM:TO:COUNT, A,B,C (numbers, names of an enumeration, true and \
                        false), or a distribution drawn --samples times: uniform(a, b), \
                        loguniform(a, b), normal(mean, deviation), lognormal(median, deviation), triangular(low, mode, high).\n\
                        A folder that holds part of the same sweep is completed.  `hyd sweep merge DIR` joins the parts of shards, `hyd sweep cancel \
                        DIR` ends what --on has submitted.")]
pub struct Sweep {
    /// The model's file, a plan (PLAN.toml), `merge` or `cancel`
    #[arg(value_name = "FILE|PLAN.toml|merge|cancel")]
    pub file: PathBuf,
    /// The folder whose parts `merge` joins, or whose tasks `cancel` ends
    #[arg(value_name = "DIR")]
    pub folder: Option<PathBuf>,
    #[command(flatten)]
    pub sweep: SweepArguments,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Number of shares for --on [default: one for each thousand runs, at most 1000]; without --on they are only made ready
    #[arg(long, value_name = "N")]
    pub shards: Option<std::num::NonZeroUsize>,
    /// Goes on with what --on has shared out before into the same folder
    #[arg(long, requires = "on")]
    pub resume: bool,
    /// The class to take [default: the last complete model of the file]
    #[arg(long, value_name = "CLASS")]
    pub model: Option<String>,
    #[command(flatten)]
    pub libraries: LibraryArguments,
}

/// Work on other machines.
#[derive(Args, Clone, Debug, Default)]
pub struct EngineArguments {
    /// Shares the work out to other machines: hq[=SERVER_DIR] (HyperQueue), slurm, or dask[=ADDRESS]; or to processes on this one: here
    #[arg(long, value_name = "ENGINE")]
    pub on: Option<String>,
    /// Seconds that a file may take to become visible on a file system that machines share [default: 30]
    #[arg(long, value_name = "S", requires = "on", allow_negative_numbers = true)]
    pub settle: Option<f64>,
}

/// `hyd compare`
#[derive(Args, Debug)]
pub struct Compare {
    /// A result file
    #[arg(value_name = "A.csv|A.mat|A.parquet")]
    pub first: PathBuf,
    /// Another one
    #[arg(value_name = "B.csv|B.mat|B.parquet")]
    pub second: PathBuf,
    /// Largest deviation, as a fraction of a variable's range, that counts as equal
    #[arg(long, value_name = "R", default_value_t = 1e-3, allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Jumps may lie this far apart in s [default: 1e-4 of the common time]
    #[arg(long, value_name = "W", allow_negative_numbers = true)]
    pub time_tolerance: Option<f64>,
    /// Variables to compare: those whose full name matches
    #[arg(long, value_name = "REGEX")]
    pub variables: Option<String>,
    /// Compares only what both results have: a shorter run or a variable that one of them lacks is not a difference then
    #[arg(long)]
    pub common: bool,
    /// Lists all variables, not only those that deviate most
    #[arg(long)]
    pub all: bool,
    /// Prints the deviations as JSON
    #[arg(long)]
    pub json: bool,
}

/// `hyd diff`
#[derive(Args, Debug)]
pub struct Diff {
    /// Two files or folders (or the arguments by which git calls: git config diff.hyd.command "hyd diff")
    #[arg(value_name = "PATH", required = true, num_args = 2..=9)]
    pub paths: Vec<PathBuf>,
    /// Prints the changes as JSON
    #[arg(long)]
    pub json: bool,
    /// Writes the changes as a page, too: what was said beside what is said, class by class
    #[arg(long, value_name = "F.html")]
    pub html: Option<PathBuf>,
}

/// `hyd test`
#[derive(Args, Debug)]
pub struct Test {
    /// Models, or folders that are searched for models with a stored result (NAME.expected.csv) or an experiment annotation
    #[arg(value_name = "PATH", required = true)]
    pub paths: Vec<PathBuf>,
    /// Stores what the models give now, with a picture of what changed (NAME.changed.svg)
    #[arg(long)]
    pub accept: bool,
    /// Variables to store: those whose full name matches [default: those stored already, else those of the model itself]
    #[arg(long, value_name = "REGEX", requires = "accept")]
    pub variables: Option<String>,
    /// Largest deviation, as a fraction of a variable's range, that counts as equal
    #[arg(long, value_name = "R", default_value_t = 1e-3, allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Seconds after which a run is stopped and counts as failed
    #[arg(long, value_name = "S", default_value_t = 300.0, allow_negative_numbers = true)]
    pub limit: f64,
    /// Runs at a time [default: all cores]
    #[arg(long, value_name = "N")]
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Writes the answer in the form of JUnit
    #[arg(long, value_name = "FILE.xml")]
    pub junit: Option<PathBuf>,
    #[command(flatten)]
    pub libraries: LibraryArguments,
}

/// `hyd explain`
#[derive(Args, Debug)]
pub struct Explain {
    /// The code, such as E0201
    #[arg(value_name = "CODE")]
    pub code: Option<String>,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
    }
}

/// What the verbs that compare a model with a bench share.
#[derive(Args, Debug)]
pub struct StudyArguments {
    /// The study: which model, which channel is which variable, what may be off
    #[arg(value_name = "STUDY.toml")]
    pub study: PathBuf,
    /// The set of shots: what the lab knows of its bench, and its tables
    #[arg(long, value_name = "SET.json")]
    pub bench: PathBuf,
    /// Libraries
    #[command(flatten)]
    pub libraries: LibraryArguments,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N")]
    pub threads: Option<std::num::NonZeroUsize>,
    /// Seed of random starts
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// `hyd fit`
#[derive(Args, Debug)]
pub struct Fit {
    /// Study and set
    #[command(flatten)]
    pub study: StudyArguments,
    /// The 95 % interval of what may be off, from its profile likelihood (repeatable)
    #[arg(long, value_name = "NAME")]
    pub profile: Vec<String>,
    /// Writes the parameters as fitted, with the conditions of the first fitted shot, for `hyd simulate --parameters`
    #[arg(long, value_name = "FILE.toml")]
    pub write_parameters: Option<PathBuf>,
    /// Folder of a report (a page, a picture, curves, values), made if it is not there
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Print the outcome as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `hyd discover`
#[derive(Args, Debug)]
pub struct Discover {
    /// Study and set
    #[command(flatten)]
    pub study: StudyArguments,
    /// Folder of the report; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub report: PathBuf,
    /// Go on where an earlier call for the same report was ended; with --on a search always does
    #[arg(long)]
    pub resume: bool,
    /// First search so many sets simulated with the fitted model; a name then needs a larger drop of the cost than 95 of 100 of them show by chance
    #[arg(long, value_name = "SETS")]
    pub calibrate: Option<std::num::NonZeroUsize>,
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Processes of --on that search together, of one thread each unless --threads says more [default: 4]; the answer does not depend on how many there are
    #[arg(long, value_name = "N", requires = "on")]
    pub shards: Option<usize>,
    /// Searches along with other processes that meet in DIR/search: what a task of --on does
    #[arg(long, value_name = "K", conflicts_with_all = ["on", "calibrate", "resume"], hide = true)]
    pub member: Option<usize>,
    /// The word by which the command that has submitted it calls its search
    #[arg(long, value_name = "WORD", requires = "member", default_value = "", hide = true)]
    pub search: String,
    /// Seconds for which that process waits for what another one has begun
    #[arg(long, value_name = "S", requires = "member", default_value_t = 30.0, hide = true)]
    pub patience: f64,
    /// Searches one of the sets of --calibrate and keeps what came out in DIR/calibration: what a task of --on does
    #[arg(long, value_name = "K", requires = "calibrate", conflicts_with = "on", hide = true)]
    pub trial: Option<usize>,
    /// Print the outcome as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `hyd next`
#[derive(Args, Debug)]
pub struct Next {
    /// Study and set
    #[command(flatten)]
    pub study: StudyArguments,
    /// A condition of the shots that can be set, and its ends (repeatable) [default: what differs among the shots, as far as it does]
    #[arg(long, value_name = "NAME=LOW:HIGH")]
    pub vary: Vec<String>,
    /// How many shots to propose
    #[arg(long, value_name = "N", default_value_t = std::num::NonZeroUsize::MIN)]
    pub shots: std::num::NonZeroUsize,
    /// Number of the shot that the new ones are like in all that does not vary [default: the longest]
    #[arg(long, value_name = "SHOT")]
    pub like: Option<usize>,
    /// Folder for a page (next.html) and the numbers (next.json); made if it is not there
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Print the outcome as one JSON object
    #[arg(long)]
    pub json: bool,
}

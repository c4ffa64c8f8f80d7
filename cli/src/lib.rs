//! The command `hyd`: arguments, files, exit codes, progress, Ctrl-C; no mathematics.
//!
//! One file per verb (`check`, `simulate`, `equations`, `plot`, `sweep`, `fit`, `discover`, `compare`, `explain`,
//! `fmt`, `new`, `doc`); `translate` takes a model file to the compiler with
//! the libraries of `library`.  Results go to standard output, messages to standard error.  Exit codes: 0 done, 1 the
//! model or the data is at fault, 2 wrong usage, 3 the solver gave up or was stopped.

mod arguments;
mod check;
pub mod clock;
mod compare;
mod discover;
mod discovery_memory;
mod discovery_page;
mod discovery_picture;
mod doc;
mod equations;
mod explain;
mod fit;
mod fmt;
mod interrupt;
mod library;
mod new;
mod output;
mod parameters;
mod picture;
mod plot;
mod progress;
mod run_failure;
mod run_summary;
mod selection;
mod simulate;
mod study;
mod sweep;
mod text_file;
mod translate;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

pub use arguments::{Arguments, Verb};
pub use library::LibraryPath;
pub use text_file::{TextError, read_text};

/// How a command ended short of success; what there is to say has been printed or is carried along.
#[derive(Debug)]
pub enum Failure {
    /// The model or the data is at fault, and the messages are out.
    Reported,
    /// The model or the data is at fault: a sentence to print.
    Fault(String),
    /// Wrong usage: a sentence to print.
    Usage(String),
    /// The solver gave up or was stopped: a sentence to print.
    Solver(String),
    /// The solver gave up, and the messages are out.
    SolverReported,
    /// The reader of our output has gone; nothing is left to do.
    OutputClosed,
}

impl Failure {
    /// The exit code.
    pub fn code(&self) -> u8 {
        match self {
            Failure::OutputClosed => 0,
            Failure::Reported | Failure::Fault(_) => 1,
            Failure::Usage(_) => 2,
            Failure::Solver(_) | Failure::SolverReported => 3,
        }
    }
}

/// Runs the command with its arguments, the first being the name of the program.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // `--help` and `--version` come this way, too; a closed output is no reason to complain.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    let result = match &arguments.verb {
        Verb::Check(verb) => check::check(verb),
        Verb::Simulate(verb) => simulate::simulate(verb),
        Verb::Equations(verb) => equations::equations(verb),
        Verb::Plot(verb) => plot::plot(verb),
        Verb::Sweep(verb) => sweep::sweep(verb),
        Verb::Fit(verb) => fit::fit(verb),
        Verb::Discover(verb) => discover::discover(verb),
        Verb::Compare(verb) => compare::compare(verb),
        Verb::Explain(verb) => explain::explain(verb),
        Verb::Doc(verb) => doc::doc(verb),
        Verb::Fmt(verb) => fmt::fmt(verb),
        Verb::New(verb) => new::new(verb),
    };
    let Err(failure) = result else { return ExitCode::SUCCESS };
    if let Failure::Fault(message) | Failure::Usage(message) | Failure::Solver(message) = &failure {
        output::sentence("error", message, arguments.message_format());
    }
    ExitCode::from(failure.code())
}

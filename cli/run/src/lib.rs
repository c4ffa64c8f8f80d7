//! What `hyd` and the executables that it builds share: options of a run, choice of variables, parameters by name, files, sweeps,
//! summaries, exit codes, progress, Ctrl-C.
//!
//! A system comes from the caller; whether the compiler made it in this process or a launcher found it in its own file makes no
//! difference here.  No mathematics and no text of models.

pub mod arguments;
pub mod clock;
mod inputs;
pub mod interrupt;
pub mod output;
pub mod parameter_file;
pub mod parameters;
mod progress;
mod recorder;
mod run_profile;
mod run_summary;
pub mod selection;
mod shard;
mod simulate;
mod sweep;
mod target;
mod text_file;
mod whole_loops;

pub use arguments::{BackendName, DrawMethod, MessageFormat, Names, RunArguments, Solver, SweepArguments};
pub use hyd_ensemble::{Folder, Manifest, Plan, Shard, Shipped, Submission, SubmissionError, hash};
pub use hyd_results::note_read;
pub use inputs::{InputArguments, InputTable, Recorded, SetInput};
pub use recorder::Recorder;
pub use run_profile::{RunProfile, Share};
pub use run_summary::{Counters, FinalValues, MethodUse, RunSummary, Status, UnitUse};
pub use selection::{MOST_CURVES, Selection, Shown};
pub use shard::ShardOf;
pub use simulate::{
    Beside, Facts, Outcome, Ran, Running, Sizes, check_usage, finish, options, record, simulate, tell, warning_texts,
};
pub use sweep::{Line, Prepared, Subject, Swept, WholeLoops, failures_told, join, override_plan, prepare, read_plan};
pub use target::check_target;
pub use text_file::{SIZE_LIMIT, TextError, decode, read_text, read_to_limit};
pub use whole_loops::{BUILT_WHOLE, DONE_AGAIN, REBUILD, WHOLE_LOOPS, runs_done_again};

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

    /// Prints the sentence, if there is one, and gives the exit code.
    pub fn report(&self, format: MessageFormat) -> std::process::ExitCode {
        std::process::ExitCode::from(self.tell(format))
    }

    /// The same as a number.
    pub fn tell(&self, format: MessageFormat) -> u8 {
        if let Failure::Fault(message) | Failure::Usage(message) | Failure::Solver(message) = self {
            output::sentence("error", message, format);
        }
        self.code()
    }
}

//! The command `hyd`: arguments, files, exit codes, progress, Ctrl-C; no mathematics.
//!
//! One file per verb (`check`, `simulate`, `build`, `linearize`, `equations`, `plot`, `sweep`, `bench_*`, `fit`, `discover`, `compare`,
//! `explain`, `fmt`, `new`, `doc`, `lsp`, `mcp`, `view`, `shell`), each of which turns its arguments into a call of a library and prints what came of it.  Results go to
//! standard output, messages to standard error (`terminal`).  Exit codes: 0 done, 1 the model or the data is at fault, 2 wrong usage, 3 the
//! solver gave up or was stopped.

mod arguments;
mod bench_import;
mod bench_schema;
mod bench_show;
mod build;
mod build_fmu;
mod check;
mod compare;
mod describe_unit;
mod diff;
mod discover;
mod doc;
mod equations;
mod explain;
mod fit;
mod fix;
mod fmt;
mod linearize;
mod lsp;
mod mcp;
mod new;
mod next;
mod plot;
mod shell;
mod simulate;
mod sweep;
mod terminal;
mod test_models;
mod translate;
mod unit;
mod view;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

use arguments::BenchVerb;
pub use arguments::{Arguments, Verb};
pub use build::{launcher, prebuilt_in};
pub(crate) use hyd_run::output;
pub use hyd_run::{Failure, TextError, clock, read_text};
pub use hyd_verbs::LibraryPath;

/// Runs the command with its arguments, the first being the name of the program.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    unit::serve(&arguments).unwrap_or_else(|| ExitCode::from(exit_code(arguments)))
}

/// The same for callers that go on afterwards.
pub fn exit_code(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let mut arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // `--help` and `--version` come this way, too; a closed output is no reason to complain.
            let _ = error.print();
            return if error.use_stderr() { 2 } else { 0 };
        }
    };
    let read = match &mut arguments.verb {
        Verb::Check(verb) => verb.model.read_parameters(),
        Verb::Simulate(verb) => verb.model.read_parameters(),
        Verb::Build(verb) => verb.model.read_parameters(),
        Verb::Linearize(verb) => verb.model.read_parameters(),
        Verb::Equations(verb) => verb.model.read_parameters(),
        _ => Ok(()),
    };
    let is_text = match &arguments.verb {
        Verb::Check(verb) => unit::refuse(&verb.model.file),
        Verb::Build(verb) => unit::refuse(&verb.model.file),
        Verb::Linearize(verb) => unit::refuse(&verb.model.file),
        Verb::Equations(verb) => unit::refuse(&verb.model.file),
        Verb::Sweep(verb) => unit::refuse(&verb.file),
        _ => Ok(()),
    };
    if let Err(failure) = read.and(is_text) {
        return failure.tell(arguments.message_format());
    }
    let result = match &arguments.verb {
        Verb::Check(verb) => check::check(verb),
        Verb::Simulate(verb) => simulate::simulate(verb),
        Verb::Build(verb) => build::build(verb),
        Verb::Linearize(verb) => linearize::linearize(verb),
        Verb::Equations(verb) => equations::equations(verb),
        Verb::Plot(verb) => plot::plot(verb),
        Verb::Sweep(verb) => sweep::sweep(verb),
        Verb::Bench(verb) => match &verb.verb {
            BenchVerb::Import(verb) => bench_import::import(verb),
            BenchVerb::Show(verb) => bench_show::show(verb),
            BenchVerb::Schema(verb) => bench_schema::schema(verb),
        },
        Verb::Fit(verb) => fit::fit(verb),
        Verb::Discover(verb) => discover::discover(verb),
        Verb::Next(verb) => next::next(verb),
        Verb::Compare(verb) => compare::compare(verb),
        Verb::Diff(verb) => diff::diff(verb),
        Verb::Test(verb) => test_models::test(verb),
        Verb::Explain(verb) => explain::explain(verb),
        Verb::Doc(verb) => doc::doc(verb),
        Verb::Fmt(verb) => fmt::fmt(verb),
        Verb::New(verb) => new::new(verb),
        Verb::Unit(verb) => describe_unit::describe(verb),
        Verb::Lsp(verb) => lsp::lsp(verb),
        Verb::Mcp(verb) => mcp::mcp(verb),
        Verb::View(verb) => view::view(verb),
        Verb::Completions(verb) => shell::completions(verb),
        Verb::Man(verb) => shell::man(verb),
    };
    let Err(failure) = result else { return 0 };
    failure.tell(arguments.message_format())
}

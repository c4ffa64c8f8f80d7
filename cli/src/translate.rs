//! From a file on the command line to a compilation, with all messages out on standard error.

use hyd_compiler::render::{render, render_json};
use hyd_compiler::{Code, Compilation, Diagnostic, Extras, Files, Goal};
use hyd_verbs::{Libraries, Request, compile_file, first_name};

use crate::arguments::{LibraryArguments, MessageFormat, ModelArguments, StudyArguments};
use crate::{Failure, output};
use hyd_verbs::study::StudyFiles;

/// Compiles the model up to `goal`; its messages are printed, errors among them end the command.
pub(crate) fn translate(arguments: &ModelArguments, goal: Goal) -> Result<Compilation, Failure> {
    translate_with(arguments, goal, &Extras::default(), &[])
}

/// The same with what the text does not say; `later`: what gets its value after the translation, so that an input without one is not reported.
pub(crate) fn translate_with(
    arguments: &ModelArguments,
    goal: Goal,
    extras: &Extras<'_>,
    later: &[String],
) -> Result<Compilation, Failure> {
    let mut compilation = compile_by(arguments, goal, extras)?;
    let is_later = |message: &str| first_name(message).is_some_and(|own| later.iter().any(|name| name == own));
    compilation.diagnostics.retain(|own| own.code != Code::OpenInput || !is_later(&own.message));
    report(&compilation.files, &compilation.diagnostics, arguments.message_format);
    if compilation.has_errors() { Err(Failure::Reported) } else { Ok(compilation) }
}

/// The same without a word on what the compiler says.
pub(crate) fn compiled(arguments: &ModelArguments, goal: Goal) -> Result<Compilation, Failure> {
    compile_by(arguments, goal, &Extras::default())
}

fn compile_by(arguments: &ModelArguments, goal: Goal, extras: &Extras<'_>) -> Result<Compilation, Failure> {
    let extras = Extras { strict_units: arguments.strict_units, ..*extras };
    let request = Request { class: arguments.model.clone(), set: arguments.set.clone(), goal };
    compile_file(&arguments.file, &arguments.libraries.libraries(), &request, &extras).map_err(|refused| {
        report(&Files::new(), &[refused], arguments.message_format);
        Failure::Reported
    })
}

/// Prints messages to standard error.
pub(crate) fn report(files: &Files, diagnostics: &[Diagnostic], format: MessageFormat) {
    if diagnostics.is_empty() {
        return;
    }
    output::message(&match format {
        MessageFormat::Text => render(files, diagnostics, output::colored()),
        MessageFormat::Json => render_json(files, diagnostics),
    });
}

impl LibraryArguments {
    /// The same as data.
    pub(crate) fn libraries(&self) -> Libraries {
        Libraries { folders: self.library.clone(), allow_outside: self.allow_outside, ..Libraries::default() }
    }
}

impl StudyArguments {
    /// The files that are named.
    pub(crate) fn files(&self) -> StudyFiles {
        StudyFiles {
            study: self.study.clone(),
            bench: self.bench.clone(),
            libraries: self.libraries.libraries(),
            threads: self.threads,
            // Where this program cannot find itself, only units miss it.
            host: crate::unit::host(None).ok(),
        }
    }
}

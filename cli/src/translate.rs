//! From a file on the command line to a compilation, with all messages out on standard error.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_compiler::render::{render, render_json};
use hyd_compiler::{Code, Compilation, CompiledModel, Diagnostic, Extras, Files, Goal, Options, compile_extended};

use crate::arguments::{LibraryArguments, MessageFormat, ModelArguments};
use crate::inside::refuse_outside;
use crate::library::LibraryPath;
use crate::{Failure, clock, output, parameters};
use hyd_run::read_text;

/// Environment variable with further library folders, separated as in `PATH`.
const LIBRARY_VARIABLE: &str = "HYD_LIBRARY";

/// Compiles the model up to `goal`; its messages are printed, errors among them end the command.
pub(crate) fn translate(arguments: &ModelArguments, goal: Goal) -> Result<Compilation, Failure> {
    translate_with(arguments, goal, &Extras::default())
}

/// The same with what the text does not say.
pub(crate) fn translate_with(
    arguments: &ModelArguments,
    goal: Goal,
    extras: &Extras<'_>,
) -> Result<Compilation, Failure> {
    let compilation = compile_by(arguments, goal, extras)?;
    report(&compilation.files, &compilation.diagnostics, arguments.message_format);
    if compilation.has_errors() { Err(Failure::Reported) } else { Ok(compilation) }
}

/// Code of a model once more, with all variables of loops as unknowns of the solver; none where there are no loops whose variables
/// are computed one after the other, or where that cannot be translated.
pub(crate) fn with_whole_loops(compilation: &Compilation, set: &[(String, String)]) -> Option<Arc<CompiledModel>> {
    let (flat, model) = (compilation.flat.as_ref()?, compilation.model.as_ref()?);
    if !model.payload().has_torn_loops() {
        return None;
    }
    let options = Options {
        model: compilation.model_name.as_deref().map(str::to_string),
        set: set.to_vec(),
        goal: Goal::Run,
        clock: clock::cpu_seconds,
    };
    hyd_compiler::with_whole_loops(flat, &compilation.files, &options).ok()
}

/// The same without a word on what the compiler says.
pub(crate) fn compiled(arguments: &ModelArguments, goal: Goal) -> Result<Compilation, Failure> {
    compile_by(arguments, goal, &Extras::default())
}

fn compile_by(arguments: &ModelArguments, goal: Goal, extras: &Extras<'_>) -> Result<Compilation, Failure> {
    let format = arguments.message_format;
    let refused = |sentence: String| {
        report(&Files::new(), &[Diagnostic::error(Code::FileAccess, sentence)], format);
        Failure::Reported
    };
    let text = read_text(&arguments.file).map_err(|error| refused(error.to_string()))?;
    let mut sources = library_path(&arguments.libraries, &arguments.file, &text).map_err(refused)?;
    let options =
        Options { model: arguments.model.clone(), set: arguments.set.clone(), goal, clock: clock::cpu_seconds };
    let name = arguments.file.display().to_string();
    let extras = Extras { strict_units: arguments.strict_units, ..*extras };
    let mut compilation = compile_extended(&mut sources, &name, &text, &options, &extras);
    if let (Some(flat), false) = (&compilation.flat, compilation.has_errors()) {
        let wrong = parameters::refuse_unknown(flat, &arguments.set, &compilation.set_at_translation);
        compilation.diagnostics.extend(wrong);
    }
    Ok(compilation)
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

pub(crate) fn library_path(arguments: &LibraryArguments, file: &Path, text: &str) -> Result<LibraryPath, String> {
    let mut library = LibraryPath::new();
    if arguments.allow_outside {
        library.allow_outside();
    }
    if let Ok(folder) = std::env::current_dir() {
        library.name_from(&folder);
    }
    library.add_main_file(file, text);
    for folder in arguments.folders() {
        library.add_folder(&folder)?;
    }
    Ok(library)
}

impl LibraryArguments {
    /// All folders of libraries, those of the environment last.
    fn folders(&self) -> Vec<PathBuf> {
        let listed = std::env::var_os(LIBRARY_VARIABLE).unwrap_or_default();
        let listed = std::env::split_paths(&listed).filter(|folder| !folder.as_os_str().is_empty());
        self.library.iter().cloned().chain(listed).collect()
    }

    /// The file that a text in `folder` names.  `Err`: why it is not read.
    pub(crate) fn file_of(&self, folder: &Path, name: &str) -> Result<PathBuf, String> {
        let path = folder.join(name);
        if !self.allow_outside {
            let own = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder.to_path_buf() };
            let folders: Vec<PathBuf> = [own].into_iter().chain(self.folders()).collect();
            refuse_outside(name, &path, &folders)?;
        }
        Ok(path)
    }
}

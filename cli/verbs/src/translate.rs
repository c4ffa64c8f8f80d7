//! From a model's file, or a text, to a compilation; its messages are data.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_compiler::{Code, Compilation, CompiledModel, Diagnostic, Extras, Goal, Options, Sources, compile_extended};
use hyd_run::read_text;

use crate::inside::refuse_outside;
use crate::library::LibraryPath;
use crate::{clock, parameters};

/// Environment variable with further library folders, separated as in `PATH`.
const LIBRARY_VARIABLE: &str = "HYD_LIBRARY";
/// The same for all tools that read Modelica (Modelica 3.6, section 13.4.1); its folders come last and need not exist.
const COMMON_VARIABLE: &str = "MODELICAPATH";

/// Where classes come from beside the folder of a model's file and the built-in library.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Libraries {
    /// Folders with libraries, or libraries; those of the environment come after them.
    pub folders: Vec<PathBuf>,
    /// The folders of the environment stand among the others already.
    pub complete: bool,
    /// Texts may name files outside of their own folder and those of the libraries.
    pub allow_outside: bool,
    /// Classes are read below this folder and those of the libraries only, whatever packages texts say that they belong to.
    pub fence: Option<PathBuf>,
}

/// What is to be translated of a text, and how far.
#[derive(Clone, Debug)]
pub struct Request {
    /// The class; none: the last complete model of the text.
    pub class: Option<String>,
    /// Parameters by full name, with their values as text.
    pub set: Vec<(String, String)>,
    /// How far.
    pub goal: Goal,
}

/// Compiles the model of a file.
///
/// # Errors
/// A message where the file or a folder of libraries cannot be read; what is wrong with texts stands in the compilation.
pub fn compile_file(
    file: &Path,
    libraries: &Libraries,
    request: &Request,
    extras: &Extras<'_>,
) -> Result<Compilation, Diagnostic> {
    let refused = |sentence: String| Diagnostic::error(Code::FileAccess, sentence);
    let text = read_text(file).map_err(|error| refused(error.to_string()))?;
    let mut sources = libraries.path(file, &text).map_err(refused)?;
    Ok(compile_text(&mut sources, &file.display().to_string(), &text, request, extras))
}

/// The first name that a message speaks of.
pub fn first_name(message: &str) -> Option<&str> {
    message.split('`').nth(1)
}

/// Compiles a text that messages call `name`; values that cannot be set are among its messages.
pub fn compile_text(
    sources: &mut dyn Sources,
    name: &str,
    text: &str,
    request: &Request,
    extras: &Extras<'_>,
) -> Compilation {
    let mut compilation = compile_extended(sources, name, text, &options(request), extras);
    if let (Some(flat), false) = (&compilation.flat, compilation.has_errors()) {
        let wrong = parameters::refuse_unknown(flat, &request.set, &compilation.set_at_translation);
        compilation.diagnostics.extend(wrong);
    }
    compilation.diagnostics.extend(sources.remarks());
    compilation
}

fn options(request: &Request) -> Options {
    let Request { class, set, goal } = request.clone();
    Options { model: class, set, goal, clock: clock::cpu_seconds }
}

/// Code of a model once more, with all variables of loops as unknowns of the solver; none where there are no loops whose variables
/// are computed one after the other, or where that cannot be translated.
pub fn with_whole_loops(compilation: &Compilation, set: &[(String, String)]) -> Option<Arc<CompiledModel>> {
    let (flat, model) = (compilation.flat.as_ref()?, compilation.model.as_ref()?);
    if !model.payload().has_torn_loops() {
        return None;
    }
    let class = compilation.model_name.as_deref().map(str::to_string);
    let request = Request { class, set: set.to_vec(), goal: Goal::Run };
    hyd_compiler::with_whole_loops(flat, &compilation.files, &options(&request)).ok()
}

impl Libraries {
    /// The way to the classes that a file with this text may name.  `Err`: why a folder cannot be used.
    pub fn path(&self, file: &Path, text: &str) -> Result<LibraryPath, String> {
        let mut library = LibraryPath::new();
        if self.allow_outside {
            library.allow_outside();
        }
        if let Some(fence) = &self.fence {
            library.fence(fence, &self.all_folders());
        }
        if let Ok(folder) = std::env::current_dir() {
            library.name_from(&folder);
        }
        library.add_main_file(file, text);
        for folder in self.named_folders() {
            library.add_folder(&folder)?;
        }
        for folder in self.common_folders() {
            library.add_common_folder(&folder);
        }
        Ok(library)
    }

    /// The same folders wherever the process goes and whatever becomes of its environment.
    pub fn fixed(&self) -> Self {
        let absolute = |folder: PathBuf| std::path::absolute(&folder).unwrap_or(folder);
        let folders = self.all_folders().into_iter().map(absolute).collect();
        Self { folders, complete: true, ..self.clone() }
    }

    /// All folders of libraries, those of the environment last.
    fn all_folders(&self) -> Vec<PathBuf> {
        [self.named_folders(), self.common_folders()].concat()
    }

    /// Those that the user has named for this program.
    fn named_folders(&self) -> Vec<PathBuf> {
        let listed = if self.complete { Vec::new() } else { listed(LIBRARY_VARIABLE) };
        self.folders.iter().cloned().chain(listed).collect()
    }

    /// Those that other tools look into as well, as far as they exist.
    fn common_folders(&self) -> Vec<PathBuf> {
        let listed = if self.complete { Vec::new() } else { listed(COMMON_VARIABLE) };
        listed.into_iter().filter(|folder| folder.is_dir()).collect()
    }

    /// The file that a text in `folder` names.  `Err`: why it is not read.
    pub fn file_of(&self, folder: &Path, name: &str) -> Result<PathBuf, String> {
        let path = folder.join(name);
        if !self.allow_outside {
            let own = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder.to_path_buf() };
            let folders: Vec<PathBuf> = [own].into_iter().chain(self.all_folders()).collect();
            refuse_outside(name, &path, &folders)?;
        }
        Ok(path)
    }
}

/// The folders that an environment variable lists.
fn listed(variable: &str) -> Vec<PathBuf> {
    let listed = std::env::var_os(variable).unwrap_or_default();
    std::env::split_paths(&listed).filter(|folder| !folder.as_os_str().is_empty()).collect()
}

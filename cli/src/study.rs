//! A study and a set from their files, with the model's libraries: what `fit` and `discover` begin with.

use std::path::{Path, PathBuf};

use hyd_compiler::Sources;
use hyd_discovery::variant::Workshop;
use hyd_discovery::{Bench, Fault, Setup, Study};

use crate::Failure;
use crate::arguments::StudyArguments;
use crate::library::LibraryPath;
use crate::translate::library_path;
use hyd_run::read_text;

/// A study and a set, opened.
pub(crate) struct Opened {
    /// Both together.
    pub setup: Setup,
    /// Name of the study's file.
    study_file: String,
    /// The model's file.
    pub model_file: PathBuf,
    /// Its text.
    pub model_text: String,
    /// Full name of the base model.
    pub class: String,
    libraries: Vec<PathBuf>,
}

/// A fault of a study as the end of a command.
pub(crate) fn failure(fault: Fault) -> Failure {
    if fault.solver { Failure::Solver(fault.sentence) } else { Failure::Fault(fault.sentence) }
}

/// Opens the files of a study.
pub(crate) fn open(arguments: &StudyArguments) -> Result<Opened, Failure> {
    let text = |path: &Path| read_text(path).map_err(|error| Failure::Fault(error.to_string()));
    let study = Study::parse(&text(&arguments.study)?);
    let study = study.map_err(|fault| Failure::Fault(format!("`{}`: {fault}", arguments.study.display())))?;
    let folder = arguments.bench.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut read = |name: &str| read_text(&folder.join(name)).map_err(|error| Fault::new(error.to_string()));
    let bench = Bench::parse(&arguments.bench, &text(&arguments.bench)?, &study, &mut read).map_err(failure)?;
    let class = study.class(bench.base_model.as_deref()).map_err(failure)?.to_string();
    let model_file = arguments.study.parent().unwrap_or(Path::new("")).join(&study.file);
    let model_text = text(&model_file)?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let threads = arguments.threads.map_or(cores, std::num::NonZeroUsize::get);
    let setup = Setup::new(study, bench, threads).map_err(failure)?;
    let study_file = arguments.study.display().to_string();
    Ok(Opened { setup, study_file, model_file, model_text, class, libraries: arguments.libraries.library.clone() })
}

impl Opened {
    /// A new way to the libraries.
    pub(crate) fn sources(&self) -> Box<dyn Sources> {
        // The same folders have been listed once before; a folder that is gone since then has no classes.
        let arguments = crate::arguments::LibraryArguments { library: self.libraries.clone() };
        Box::new(library_path(&arguments, &self.model_file, &self.model_text).unwrap_or_else(|_| LibraryPath::new()))
    }

    /// Writer of models over the libraries that `sources` gives.
    pub(crate) fn workshop<'a>(&self, sources: &'a (dyn Fn() -> Box<dyn Sources> + Sync)) -> Workshop<'a> {
        Workshop {
            study: self.study_file.clone(),
            sources,
            preamble: self.preamble(),
            file: self.model_file.display().to_string(),
            class: self.class.clone(),
            channels: self.setup.expressions(),
        }
    }

    /// What must stand before a text that names the base model: the model's file, unless a package holds it.
    fn preamble(&self) -> String {
        if self.model_text.trim_start().starts_with("within") { String::new() } else { self.model_text.clone() }
    }
}

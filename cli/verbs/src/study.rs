//! A study and a set from their files, with the model's libraries: what `fit` and `discover` begin with.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use hyd_compiler::{ForeignBlock, Severity, Sources};
use hyd_discovery::{Bench, Fault, Machine, Opaque, OtherFiles, Owner, Setup, Study, Translated, Workshop};
use hyd_fmi_import::{Host, Unit};

use hyd_run::read_text;

use crate::joined::{StudyUnits, file_of};
use crate::library::LibraryPath;
use crate::study_unit;
use crate::unit::is_unit;
use crate::{Failure, Libraries, Listener};

/// Warnings of the model that are shown; the rest is counted.
const MOST_WARNINGS: usize = 8;

/// A study and a set, opened.
pub struct Opened {
    /// Both together.
    pub setup: Setup,
    /// Name of the study's file.
    study_file: String,
    /// The model's file.
    pub model_file: PathBuf,
    /// Its text; of a unit of another tool one that declares what the study names of it.
    pub model_text: String,
    /// What is known of the model where it is a unit of another tool.
    pub unit: Option<Opaque>,
    /// Full name of the base model.
    pub class: String,
    libraries: Libraries,
}

/// A fault of a study as the end of a command.
pub fn failure(fault: Fault) -> Failure {
    if fault.solver { Failure::Solver(fault.sentence) } else { Failure::Fault(fault.sentence) }
}

/// Says how many runs were done again because a loop could not be solved one variable after the other; returns the number.
pub fn tell_whole_loops(setup: &Setup, listener: &dyn Listener) -> usize {
    let runs = setup.watch.whole_loops.load(Ordering::Relaxed);
    if runs > 0 {
        listener.sentence(Severity::Warning, &hyd_run::runs_done_again(runs));
    }
    runs
}

/// The files of a study, and how it is worked on.
#[derive(Clone, Debug)]
pub struct StudyFiles {
    /// The study: which model, which channel is which variable, what may be off.
    pub study: PathBuf,
    /// The set of shots.
    pub bench: PathBuf,
    /// Libraries.
    pub libraries: Libraries,
    /// Threads; none: one for each core.
    pub threads: Option<NonZeroUsize>,
    /// How processes of units of other tools are begun; none where they cannot be.
    pub host: Option<Host>,
}

/// Opens the files of a study.
///
/// # Errors
/// A file that cannot be read or makes no sense.
pub fn open(arguments: &StudyFiles, listener: &dyn Listener) -> Result<Opened, Failure> {
    let text = |path: &Path| read_text(path).map_err(|error| Failure::Fault(error.to_string()));
    let study = Study::parse(&text(&arguments.study)?);
    let study = study.map_err(|fault| Failure::Fault(format!("`{}`: {fault}", arguments.study.display())))?;
    let folder = arguments.bench.parent().unwrap_or(Path::new("")).to_path_buf();
    let libraries = &arguments.libraries;
    let mut read = |name: &str| {
        let path = libraries
            .file_of(&folder, name)
            .map_err(|why| Fault::new(format!("`{}`: the table {why}", arguments.bench.display())))?;
        read_text(&path).map_err(|error| Fault::new(error.to_string()))
    };
    let mut bench = Bench::parse(&arguments.bench, &text(&arguments.bench)?, &study, &mut read).map_err(failure)?;
    let class = study.class(bench.base_model.as_deref()).map_err(failure)?.to_string();
    for sentence in &bench.warnings {
        listener.sentence(Severity::Warning, sentence);
    }
    let folder = arguments.study.parent().unwrap_or(Path::new(""));
    let model_file = libraries.file_of(folder, &study.file);
    let model_file =
        model_file.map_err(|why| Failure::Fault(format!("`{}`: the model's file {why}", arguments.study.display())))?;
    let units = StudyUnits::new(libraries, arguments.host.as_ref());
    let (mut study, mut class, mut opaque) = (study, class, None);
    let model_text = if is_unit(&model_file) {
        hyd_run::note_read(&model_file);
        let unit = Unit::open(&model_file).map_err(|fault| Failure::Fault(fault.to_string()))?;
        let text = study_unit::text(&model_file, &unit, &class, &mut study)?;
        study_unit::name_inputs(&unit, &mut study, &mut bench);
        for sentence in unit.notes.iter().chain(&text.notes) {
            listener.sentence(Severity::Warning, sentence);
        }
        if let Some(sentence) = study_unit::connectors(&unit, &study) {
            listener.sentence(Severity::Note, &sentence);
        }
        units.keep(model_file.clone(), unit);
        (class, opaque) = (text.class, Some(Opaque { moved: text.moved }));
        text.text
    } else {
        text(&model_file)?
    };
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let threads = arguments.threads.map_or(cores, std::num::NonZeroUsize::get);
    let mut setup = Setup::new(study, bench, threads).map_err(failure)?;
    setup.foreign = Some(Arc::new(units));
    for sentence in setup.notes() {
        listener.sentence(Severity::Note, &sentence);
    }
    for sentence in setup.warnings().into_iter().chain(setup.other_starts()) {
        listener.sentence(Severity::Warning, &sentence);
    }
    let study_file = arguments.study.display().to_string();
    Ok(Opened { setup, study_file, model_file, model_text, unit: opaque, class, libraries: libraries.clone() })
}

impl Opened {
    /// The base model, translated; says which of its inputs nothing drives.
    ///
    /// # Errors
    /// What the compiler says.
    pub fn translated(&self, workshop: &Workshop<'_>, listener: &dyn Listener) -> Result<Translated, Failure> {
        let model = workshop.translate(&[]).map_err(failure)?;
        for sentence in self.setup.idle_inputs(&model).into_iter().chain(self.setup.unset_states(&model)) {
            listener.sentence(Severity::Warning, &sentence);
        }
        for sentence in model.warnings.iter().take(MOST_WARNINGS) {
            listener.sentence(Severity::Warning, sentence);
        }
        if let Some(more) = model.warnings.len().checked_sub(MOST_WARNINGS).filter(|&more| more > 0) {
            let file = self.model_file.display();
            listener.sentence(Severity::Warning, &format!("`hyd check {file}` says {more} more warnings of the model"));
        }
        Ok(model)
    }

    /// The machine of the base model; says which of its inputs nothing drives.
    ///
    /// # Errors
    /// What the compiler says, or why a unit of another tool cannot be used.
    pub fn machine(&self, workshop: &Workshop<'_>, listener: &dyn Listener) -> Result<Machine, Failure> {
        self.setup.machine(self.translated(workshop, listener)?).map_err(failure)
    }

    /// Archives of units of other tools, by the names under which a model reads them.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(crate) fn units(&self, blocks: &[ForeignBlock]) -> Result<Vec<(String, Vec<u8>)>, Failure> {
        let mut found: Vec<(String, Vec<u8>)> = Vec::new();
        let mut paths: Vec<std::path::PathBuf> = Vec::new();
        for block in blocks {
            let path = file_of(block, &self.libraries)?;
            if let Some(k) = found.iter().position(|(name, _)| **name == *block.file) {
                if paths[k] != path {
                    return Err(Failure::Fault(format!(
                        "`{}` and `{}` are two units of one name, which cannot stand in one folder with the model that is found; rename one",
                        paths[k].display(),
                        path.display()
                    )));
                }
                continue;
            }
            let read = std::fs::read(&path);
            let bytes =
                read.map_err(|error| Failure::Fault(format!("`{}` cannot be read: {error}", path.display())))?;
            found.push((block.file.to_string(), bytes));
            paths.push(path);
        }
        Ok(found)
    }

    /// A new way to the libraries.
    pub fn sources(&self) -> Box<dyn Sources> {
        // The same folders have been listed once before; a folder that is gone since then has no classes.
        Box::new(self.libraries.path(&self.model_file, &self.model_text).unwrap_or_else(|_| LibraryPath::new()))
    }

    /// Writer of models over the libraries that `sources` gives.
    pub fn workshop<'a>(&self, sources: &'a (dyn Fn() -> Box<dyn Sources> + Sync)) -> Workshop<'a> {
        Workshop {
            study: self.study_file.clone(),
            sources,
            preamble: self.preamble(),
            file: self.model_file.display().to_string(),
            class: self.class.clone(),
            channels: self.setup.expressions(),
            starts: self.setup.starts(),
            driven: self.setup.driven(),
            library_classes: sources().class_names().into(),
            opaque: self.unit.clone(),
            others: self.other_files(),
        }
    }

    /// Whose the files are that the model is made of.
    fn other_files(&self) -> OtherFiles {
        let path = self.libraries.path(&self.model_file, &self.model_text).ok();
        let package = path.and_then(|path| std::fs::canonicalize(path.main_package()?).ok());
        OtherFiles::of(Arc::new(move |file| {
            // What is built in is not a file.
            let file = std::fs::canonicalize(file).ok()?;
            let is_own = package.as_ref().is_some_and(|package| file.starts_with(package));
            Some(if is_own { Owner::User } else { Owner::Library })
        }))
    }

    /// What must stand before a text that names the base model: the model's file, unless a package holds it.
    fn preamble(&self) -> String {
        if self.model_text.trim_start().starts_with("within") { String::new() } else { self.model_text.clone() }
    }
}

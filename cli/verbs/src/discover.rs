//! Where do a model and a bench differ, what is missing, and the model that has it: the search, and the folder of its report.

use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use hyd_compiler::inquiry::annotated_classes;
use hyd_compiler::{Code, Severity};
use hyd_discovery::{Calibration, Candidate, Folder, Forgetful, Memory, Report, Search, Setup, Tasks, Workshop};
use hyd_results::{refuse_read, write_whole};

use crate::discovered_files::ReportFolder;
use crate::discovery_calibration as calibration;
use crate::discovery_crew::{CrewFolder, shared_search};
use crate::discovery_memory::{FitsFile, MEMORY, hash};
use crate::discovery_page::page;
use crate::discovery_picture::gap_picture;
use crate::discovery_shared::SharedSearch;
use crate::discovery_trials::shared_trials;
use crate::picture::write_picture;
use crate::study::{Opened, StudyFiles, failure, tell_whole_loops};
use crate::{Failure, Listener};

/// The files of a report.
pub(crate) const FILES: [&str; 7] =
    ["report.json", "trajectories.csv", "report.html", "gap.svg", "parameters.toml", Report::MODEL, MEMORY];

/// The message of a search that was ended from outside.
const INTERRUPTED: &str = "interrupted; a search that resumes goes on where it was stopped";

/// How a search is done.
#[derive(Clone, Debug)]
pub struct SearchOptions {
    /// Folder of the report; made if it is not there.
    pub report: PathBuf,
    /// Goes on where an earlier search for the same report was ended.
    pub resume: bool,
    /// Searches so many sets made from the fitted model first; a name then needs a larger drop of the cost than 95 of 100 of them
    /// show by chance.
    pub calibrate: Option<NonZeroUsize>,
    /// Other machines search, these sets and the bench itself.
    pub shared: Option<SharedSearch>,
    /// Seed of random starts.
    pub seed: u64,
}

/// What a search has found and written.
#[derive(Clone, Debug)]
pub struct Found {
    /// For people, with the command that runs the model.
    pub text: String,
    /// `report.json`.
    pub json: String,
    /// The file of the model that has what was found, if something was named.
    pub model: Option<PathBuf>,
}

/// Searches for what a model lacks and writes the report.  A search that `watch.stop` of the setup ends leaves its fits for `resume`.
///
/// # Errors
/// A model that cannot be translated or run, texts of effects that cannot be read, files that cannot be written.
pub fn discover(
    study: &StudyFiles,
    opened: &Opened,
    options: &SearchOptions,
    listener: &dyn Listener,
) -> Result<Found, Failure> {
    let setup = &opened.setup;
    std::fs::create_dir_all(&options.report).map_err(|error| {
        Failure::Fault(format!("the folder `{}` cannot be made: {error}", options.report.display()))
    })?;
    let make = || opened.sources();
    let workshop = opened.workshop(&make);
    let begin = Instant::now();
    let progress = |text: &str| listener.progress(begin.elapsed().as_secs_f64(), text);
    let base = opened.translated(&workshop, listener)?;
    let units = opened.units(base.blocks())?;
    let candidates = all_candidates(opened, &workshop, listener)?;
    let hash = fingerprint(opened, (&workshop, &units), &candidates, options.seed)?;
    // By now all texts and tables have been read; better here than after a long search.
    for name in FILES {
        let path = options.report.join(name);
        refuse_read(&path).map_err(|error| unwritable(&path, &error))?;
    }
    let folder = ReportFolder::new(&options.report);
    let read = workshop.data_files(&[]).map_err(failure)?;
    folder.check(&read, setup.bench.shots.iter().map(|shot| shot.number))?;
    let needed = threshold((study, options), (setup, &workshop, &candidates), (hash, listener), &progress)?;
    let fits = FitsFile::open(&options.report, hash, options.resume, &setup.watch);
    let fits = fits.map_err(|error| {
        Failure::Fault(format!("the folder `{}` cannot be written: {error}", options.report.display()))
    })?;
    if options.resume && options.shared.is_none() {
        progress(&format!("{} fits are taken over", fits.taken_over()));
    }
    let crew = match &options.shared {
        Some(shared) => {
            let stop = || setup.watch.stopped();
            Some(shared_search(study, options, (shared, hash, needed), listener, &progress, &stop)?)
        }
        None => None,
    };
    let seed = options.seed;
    let ends = hyd_discovery::Ends::default();
    let tasks = crew.as_ref().map_or(Tasks::ALONE, |crew| Tasks::of(crew));
    // Where others search, their answers are all that is taken over.
    let memory: &dyn Memory = if crew.is_some() { &Forgetful } else { &fits };
    let search =
        Search { setup, workshop: &workshop, candidates, seed, needed, progress: &progress, memory, ends, tasks };
    let settled = search.settled();
    if setup.watch.stopped() {
        return Err(Failure::Solver(INTERRUPTED.to_string()));
    }
    let (findings, other) = settled.map_err(failure)?;
    let setup = other.as_ref().unwrap_or(setup);
    if let Some(made) = crew.as_ref().map(CrewFolder::made).filter(|&made| made > 0) {
        let sentence = format!(
            "{made} tasks of the search were made here, although others had got to the end: nodes of another kind have other last digits, or answers could \
             not be read; the report is that of this machine"
        );
        listener.sentence(Severity::Warning, &sentence);
    }
    progress("writing the report");
    let built_in = |name: &str| name.starts_with("<built-in>/");
    let seconds = begin.elapsed().as_secs_f64();
    let place = Folder { built_in: &built_in, taken: &FILES };
    let report = Report::of(setup, &workshop, &findings, seconds, place);
    if setup.watch.stopped() {
        return Err(Failure::Solver(INTERRUPTED.to_string()));
    }
    let mut report = report.map_err(failure)?;
    tell_whole_loops(setup, listener);
    let units = opened.units(&report.units)?;
    folder.write(&mut report, &units, listener)?;
    let json = format!("{:#}\n", report.json);
    write(&options.report, setup, &report, &json)?;
    fits.remove();
    if let Some(crew) = crew {
        crew.remove();
    }
    let command = folder.command(&report).unwrap_or_default();
    let model = report.model.is_some().then(|| options.report.join(Report::MODEL));
    Ok(Found { text: report.summary + &command, json, model })
}

/// The drop of the cost that a name needs: the usual one, or what was found for this study.
fn threshold(
    (files, options): (&StudyFiles, &SearchOptions),
    (setup, workshop, candidates): (&Setup, &Workshop<'_>, &[Candidate]),
    (hash, listener): (u64, &dyn Listener),
    progress: &dyn Fn(&str),
) -> Result<f64, Failure> {
    let study: &Path = &files.study;
    let known = match options.calibrate {
        None => calibration::known(study, hash),
        Some(sets) => {
            let by = (sets.get(), options.seed);
            let made = match &options.shared {
                Some(shared) => {
                    let stop = || setup.watch.stopped();
                    shared_trials(files, options, (shared, sets.get(), hash), listener, progress, &stop)?
                }
                None => {
                    let made = Calibration::of(setup, workshop, candidates, by, progress);
                    if setup.watch.stopped() {
                        return Err(Failure::Solver(INTERRUPTED.to_string()));
                    }
                    made.map_err(failure)?
                }
            };
            calibration::keep(study, hash, &made)?;
            Some(made)
        }
    };
    Ok(known.map_or(Search::NEEDED, |known| known.needed()))
}

/// Writes the files of a report.
fn write(folder: &Path, setup: &Setup, report: &Report, json: &str) -> Result<(), Failure> {
    let save = |name: &str, text: &str| {
        let path = folder.join(name);
        write_whole(&path, text.as_bytes()).map_err(|error| unwritable(&path, &error))
    };
    save("report.json", json)?;
    save("trajectories.csv", &report.table())?;
    save("report.html", &page(report))?;
    save("parameters.toml", &report.parameters)?;
    if let Some(figure) = gap_picture(setup, report) {
        write_picture(&folder.join("gap.svg"), &figure)?;
    }
    let stale = folder.join(Report::MODEL);
    match &report.model {
        Some(text) => save(Report::MODEL, text)?,
        // The model of an earlier call is not that of this one.
        None if stale.exists() => std::fs::remove_file(&stale)
            .map_err(|error| Failure::Fault(format!("`{}` cannot be removed: {error}", stale.display())))?,
        None => {}
    }
    Ok(())
}

pub(crate) fn unwritable(path: &Path, error: &io::Error) -> Failure {
    Failure::Fault(format!("`{}` cannot be written: {error}", path.display()))
}

/// All effects of the libraries at all places of the base model.
pub(crate) fn all_candidates(
    opened: &Opened,
    workshop: &Workshop<'_>,
    listener: &dyn Listener,
) -> Result<Vec<Candidate>, Failure> {
    let setup = &opened.setup;
    let (classes, files, mut diagnostics) = annotated_classes(&mut *opened.sources(), "effect");
    // What lies in a folder of libraries under another name than its own is not a class of it.
    for diagnostic in diagnostics.iter_mut().filter(|diagnostic| diagnostic.code == Code::UnknownClass) {
        diagnostic.severity = Severity::Warning;
    }
    // An effect that cannot be read is missing among the answers.
    listener.diagnostics(&files, &diagnostics);
    if diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error) {
        return Err(Failure::Reported);
    }
    let mut warn = |sentence: &str| listener.sentence(Severity::Warning, sentence);
    Candidate::all(setup, workshop, &classes, &mut warn).map_err(failure)
}

/// A number that changes with whatever decides a search, and not with the folder in which it is called.
pub(crate) fn fingerprint(
    opened: &Opened,
    (workshop, units): (&Workshop<'_>, &[(String, Vec<u8>)]),
    candidates: &[Candidate],
    seed: u64,
) -> Result<u64, Failure> {
    let setup = &opened.setup;
    let settings = format!("{seed} {:?} {:?}", setup.study.of_search(), setup.bench);
    let effect = |own: &Candidate| {
        let mut effect = (*own.effect).clone();
        // Shown as seen from where the command is called.
        effect.file = "".into();
        format!("{effect:?}")
    };
    let effects: Vec<String> = candidates.iter().map(effect).collect();
    let numbers = setup.data.shots.iter().flat_map(|shot| shot.traces.iter().flatten().flat_map(|trace| &trace.values));
    let numbers: Vec<u8> = numbers.flat_map(|value| value.to_le_bytes()).collect();
    let files = workshop.files(&[]).map_err(failure)?;
    let texts = effects.iter().chain(files.iter().map(|(_, text)| text)).map(|text| text.as_bytes());
    let units = units.iter().map(|(_, bytes)| bytes.as_slice());
    Ok(hash([settings.as_bytes(), &numbers].into_iter().chain(texts).chain(units)))
}

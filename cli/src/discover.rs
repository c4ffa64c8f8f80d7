//! `hyd discover STUDY.toml --bench SET.json --report DIR`: where do they differ, what is missing, and the model that has it.

use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::time::Instant;

use hyd_compiler::inquiry::annotated_classes;
use hyd_compiler::{Code, Severity};
use hyd_discovery::{Calibration, Candidate, Folder, Report, Search, Setup, Workshop};
use hyd_results::{refuse_read, write_whole};

use crate::arguments::{Discover, MessageFormat};
use crate::discovered_files::ReportFolder;
use crate::discovery_calibration as calibration;
use crate::discovery_memory::{FitsFile, MEMORY, hash};
use crate::discovery_page::page;
use crate::discovery_picture::gap_picture;
use crate::picture::write_picture;
use crate::study::{Opened, failure, open, tell_whole_loops};
use crate::translate::report as report_all;
use crate::{Failure, output};

/// The files of a report.
pub(crate) const FILES: [&str; 7] =
    ["report.json", "trajectories.csv", "report.html", "gap.svg", "parameters.toml", Report::MODEL, MEMORY];

/// Runs the verb.
pub(crate) fn discover(arguments: &Discover) -> Result<(), Failure> {
    let opened = open(&arguments.study)?;
    let setup = &opened.setup;
    std::fs::create_dir_all(&arguments.report).map_err(|error| {
        Failure::Fault(format!("the folder `{}` cannot be made: {error}", arguments.report.display()))
    })?;
    let make = || opened.sources();
    let workshop = opened.workshop(&make);
    let begin = Instant::now();
    let line = io::stderr().is_terminal();
    let progress = |text: &str| {
        if line {
            // A terminal that cannot be written to shows no progress; the work goes on.
            let _ = writeln!(io::stderr(), "{:6.1} s  {text}", begin.elapsed().as_secs_f64());
        }
    };
    opened.translated(&workshop)?;
    let candidates = all_candidates(&opened, &workshop)?;
    let seed = arguments.study.seed;
    let hash = fingerprint(&opened, &workshop, &candidates, seed)?;
    // By now all texts and tables have been read; better here than after a long search.
    for name in FILES {
        let path = arguments.report.join(name);
        refuse_read(&path).map_err(|error| unwritable(&path, &error))?;
    }
    let folder = ReportFolder::new(&arguments.report);
    let read = workshop.data_files(&[]).map_err(failure)?;
    folder.check(&read, setup.bench.shots.iter().map(|shot| shot.number))?;
    let needed = threshold(arguments, (setup, &workshop, &candidates), hash, &progress)?;
    let memory = FitsFile::open(&arguments.report, hash, arguments.resume);
    let memory = memory.map_err(|error| {
        Failure::Fault(format!("the folder `{}` cannot be written: {error}", arguments.report.display()))
    })?;
    if arguments.resume {
        progress(&format!("{} fits are taken over", memory.taken_over()));
    }
    let search = Search { setup, workshop: &workshop, candidates, seed, needed, progress: &progress, memory: &memory };
    let (findings, other) = search.settled().map_err(failure)?;
    let setup = other.as_ref().unwrap_or(setup);
    progress("writing the report");
    let built_in = |name: &str| name.starts_with("<built-in>/");
    let seconds = begin.elapsed().as_secs_f64();
    let place = Folder { built_in: &built_in, taken: &FILES };
    let mut report = Report::of(setup, &workshop, &findings, seconds, place).map_err(failure)?;
    tell_whole_loops(setup);
    folder.write(&mut report)?;
    let json = format!("{:#}\n", report.json);
    write(arguments, setup, &report, &json)?;
    memory.remove();
    let command = folder.command(&report).unwrap_or_default();
    output::print(if arguments.json { json } else { report.summary + &command }.as_str())
}

/// The drop of the cost that a name needs: the usual one, or what was found for this study.
fn threshold(
    arguments: &Discover,
    (setup, workshop, candidates): (&Setup, &Workshop<'_>, &[Candidate]),
    hash: u64,
    progress: &dyn Fn(&str),
) -> Result<f64, Failure> {
    let known = match arguments.calibrate {
        None => calibration::known(&arguments.study.study, hash),
        Some(sets) => {
            let by = (sets.get(), arguments.study.seed);
            let made = Calibration::of(setup, workshop, candidates, by, progress).map_err(failure)?;
            calibration::keep(&arguments.study.study, hash, &made)?;
            Some(made)
        }
    };
    Ok(known.map_or(Search::NEEDED, |known| known.needed()))
}

/// Writes the files of a report.
fn write(arguments: &Discover, setup: &Setup, report: &Report, json: &str) -> Result<(), Failure> {
    let save = |name: &str, text: &str| {
        let path = arguments.report.join(name);
        write_whole(&path, text.as_bytes()).map_err(|error| unwritable(&path, &error))
    };
    save("report.json", json)?;
    save("trajectories.csv", &report.table())?;
    save("report.html", &page(report))?;
    save("parameters.toml", &report.parameters)?;
    if let Some(figure) = gap_picture(setup, report) {
        write_picture(&arguments.report.join("gap.svg"), &figure)?;
    }
    let stale = arguments.report.join(Report::MODEL);
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
fn all_candidates(opened: &Opened, workshop: &Workshop<'_>) -> Result<Vec<Candidate>, Failure> {
    let setup = &opened.setup;
    let (classes, files, mut diagnostics) = annotated_classes(&mut *opened.sources(), "effect");
    // What lies in a folder of libraries under another name than its own is not a class of it.
    for diagnostic in diagnostics.iter_mut().filter(|diagnostic| diagnostic.code == Code::UnknownClass) {
        diagnostic.severity = Severity::Warning;
    }
    // An effect that cannot be read is missing among the answers.
    report_all(&files, &diagnostics, MessageFormat::Text);
    if diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error) {
        return Err(Failure::Reported);
    }
    let mut warn = |sentence: &str| output::sentence("warning", sentence, MessageFormat::Text);
    Candidate::all(setup, workshop, &classes, &mut warn).map_err(failure)
}

/// A number that changes with whatever decides a search.
fn fingerprint(opened: &Opened, workshop: &Workshop<'_>, candidates: &[Candidate], seed: u64) -> Result<u64, Failure> {
    let setup = &opened.setup;
    let settings = format!("{seed} {:?} {:?}", setup.study, setup.bench);
    let effects: Vec<String> = candidates.iter().map(|own| format!("{:?}", own.effect)).collect();
    let numbers = setup.data.shots.iter().flat_map(|shot| shot.traces.iter().flatten().flat_map(|trace| &trace.values));
    let numbers: Vec<u8> = numbers.flat_map(|value| value.to_le_bytes()).collect();
    let files = workshop.files(&[]).map_err(failure)?;
    let texts = effects.iter().chain(files.iter().map(|(_, text)| text)).map(|text| text.as_bytes());
    Ok(hash([settings.as_bytes(), &numbers].into_iter().chain(texts)))
}

//! One search made by several processes, which other machines may run.
//!
//! `REPORT/search/HASH`, named by all that decides the search, holds `answers/TASK`, what members have found so far, `taken/TASK`, who is at
//! what, and `ended` when one of them has got to the end.  Answers appear whole, and whoever writes one twice writes the same, so members take no
//! lock and miss none that dies.  Who has ended has seen all answers; the command then makes the search once more out of them, and writes the report.

use std::cell::Cell;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use hyd_cluster::{Done, Ended, Patience, Seen, carry_out};
use hyd_compiler::{Diagnostic, Files, Severity};
use hyd_discovery::{Crew, Ends, Fault, Forgetful, Search, Tasks};
use hyd_results::write_whole;

use crate::discover::{SearchOptions, all_candidates, fingerprint, unwritable};
use crate::discovery_shared::{LOGS, PROGRAM, SharedSearch, patience, submission};
use crate::study::{Opened, StudyFiles, failure};
use crate::{Failure, Listener};

/// Folder of what is shared out, in that of the report.
const FOLDER: &str = "search";
/// Members of a search if nobody says how many.
const USUAL: usize = 4;
/// The parts of the folder, and the file that says that all answers are there.
const PARTS: [&str; 2] = ["answers", "taken"];
const ENDED: &str = "ended";

/// Time after which the command looks for an answer again.
const BEAT: Duration = Duration::from_millis(200);

/// Which search it is, as the command knows it.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Identity {
    /// Of all that decides the search but the next.
    hash: u64,
    /// Drop of the cost that a name needs.
    needed: f64,
    /// Of the program, because another one may search in another way.
    program: u64,
}

impl Identity {
    /// One word of a command line.
    fn word(&self) -> String {
        format!("{:016x}-{:016x}-{:016x}", self.hash, self.needed.to_bits(), self.program)
    }

    fn read(word: &str) -> Option<Self> {
        let parts: Option<Vec<u64>> = word.split('-').map(|own| u64::from_str_radix(own, 16).ok()).collect();
        let [hash, needed, program] = parts?[..] else { return None };
        Some(Self { hash, needed: f64::from_bits(needed), program })
    }
}

/// The folder where members meet.
pub(crate) struct CrewFolder {
    folder: PathBuf,
    /// Number of this member; none for the command.
    member: Option<usize>,
    patience: Duration,
    /// Time for which the command has waited for answers.
    waited: Cell<Duration>,
    /// Tasks that the command has made itself.
    made: Cell<usize>,
}

impl CrewFolder {
    /// Tasks that the command has made itself, although members have got to the end.
    pub(crate) fn made(&self) -> usize {
        self.made.get()
    }

    /// Makes the folder of a search, if it is not there.
    fn make(report: &Path, identity: Identity, member: Option<usize>, patience: Duration) -> Result<Self, Failure> {
        let name = format!("{} {}", identity.word(), env!("CARGO_PKG_VERSION"));
        let folder = report.join(FOLDER).join(&hyd_run::hash(name.as_bytes())[..16]);
        for part in PARTS.map(|part| folder.join(part)) {
            fs::create_dir_all(&part).map_err(|error| unwritable(&part, &error))?;
        }
        Ok(Self { folder, member, patience, waited: Cell::default(), made: Cell::default() })
    }

    fn file(&self, part: &str, name: &str) -> PathBuf {
        self.folder.join(part).join(name)
    }

    /// Number of answers; those that are being written have other names.
    fn answers(&self) -> usize {
        let is_whole = |name: &std::ffi::OsStr| name.to_str().is_some_and(|name| name.len() == 16);
        let entries = fs::read_dir(self.folder.join("answers")).into_iter().flatten().flatten();
        entries.filter(|entry| is_whole(&entry.file_name())).count()
    }

    fn ended(&self) -> PathBuf {
        self.folder.join(ENDED)
    }

    /// The search is finished.
    pub(crate) fn remove(self) {
        // What stays behind is only taken for the same search again; what others have put beside it stays.
        let _ = fs::remove_dir_all(&self.folder);
        if let Some(all) = self.folder.parent() {
            let _ = fs::remove_dir_all(all.join(LOGS));
            let _ = fs::remove_file(all.join(PROGRAM));
            let _ = fs::remove_dir(all);
        }
    }
}

impl Crew for CrewFolder {
    fn number(&self) -> usize {
        self.member.unwrap_or(0)
    }

    fn answer(&self, task: &str) -> Option<Vec<u8>> {
        let path = self.file("answers", task);
        let begin = Instant::now();
        loop {
            // All answers are there when the command asks, but a file system that machines share may show them late.
            let is_over = self.member.is_some() || self.waited.get() + begin.elapsed() >= self.patience;
            match fs::read(&path) {
                Ok(bytes) => return Some(bytes),
                Err(_) if is_over => {
                    self.waited.set(self.waited.get() + begin.elapsed());
                    return None;
                }
                Err(_) => std::thread::sleep(BEAT),
            }
        }
    }

    fn take(&self, task: &str) -> bool {
        let Some(own) = self.member else {
            self.made.set(self.made.get() + 1);
            return true;
        };
        let path = self.file("taken", task);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            // Who cannot write here makes the task all the same, and says so when the answer cannot be written either.
            Ok(mut file) => file.write_all(own.to_string().as_bytes()).map_or(true, |()| true),
            // This member has begun it before, and died.
            Err(_) => fs::read_to_string(&path).map_or(true, |text| text == own.to_string()),
        }
    }

    fn give(&self, task: &str, answer: &[u8]) -> Result<(), Fault> {
        // Nobody reads what the command makes.
        if self.member.is_none() {
            return Ok(());
        }
        let path = self.file("answers", task);
        write_whole(&path, answer)
            .map_err(|error| Fault::new(format!("`{}` cannot be written: {error}", path.display())))
    }

    fn patience(&self) -> Duration {
        self.patience
    }
}

/// Passes errors on; the command has told the warnings.
struct Errors<'a>(&'a dyn Listener);

impl Listener for Errors<'_> {
    fn sentence(&self, severity: Severity, text: &str) {
        if severity == Severity::Error {
            self.0.sentence(severity, text);
        }
    }

    fn diagnostics(&self, files: &Files, diagnostics: &[Diagnostic]) {
        if diagnostics.iter().any(|own| own.severity == Severity::Error) {
            self.0.diagnostics(files, diagnostics);
        }
    }
}

/// Makes a search as one of several members; its answers are what counts, and no report is written.  `search` is the word by which the
/// command calls it.
///
/// # Errors
/// As the search; another search than that of the command; a file that cannot be written.
pub fn search_along(
    opened: &Opened,
    options: &SearchOptions,
    (member, search, patience): (usize, &str, f64),
    listener: &dyn Listener,
) -> Result<(), Failure> {
    let listener = &Errors(listener);
    let setup = &opened.setup;
    let make = || opened.sources();
    let workshop = opened.workshop(&make);
    let base = opened.translated(&workshop, listener)?;
    let units = opened.units(base.blocks())?;
    let candidates = all_candidates(opened, &workshop, listener)?;
    let seed = options.seed;
    let hash = fingerprint(opened, (&workshop, &units), &candidates, seed)?;
    let identity = Identity::read(search).filter(|own| own.hash == hash).ok_or_else(|| {
        let words =
            "this process sees another study, set, table, model or library than the command that has submitted it";
        Failure::Fault(format!("{words}; a file was changed, or is not the same on all machines"))
    })?;
    let needed = identity.needed;
    let patience = Duration::try_from_secs_f64(patience).unwrap_or(Patience::USUAL.settle);
    let crew = CrewFolder::make(&options.report, identity, Some(member), patience)?;
    let (progress, memory, ends) = (&|_: &str| {}, &Forgetful, Ends::default());
    let tasks = Tasks::of(&crew);
    let search = Search { setup, workshop: &workshop, candidates, seed, needed, progress, memory, ends, tasks };
    let settled = search.settled();
    if setup.watch.stopped() {
        return Err(Failure::Solver("interrupted".to_string()));
    }
    settled.map_err(failure)?;
    let path = crew.ended();
    write_whole(&path, b"").map_err(|error| unwritable(&path, &error))
}

/// Has other machines make a search together and waits for them; the folder with all their answers.
///
/// # Errors
/// An engine that cannot be reached, members that were given up, an interrupt.
pub(crate) fn shared_search(
    files: &StudyFiles,
    options: &SearchOptions,
    (shared, hash, needed): (&SharedSearch, u64, f64),
    listener: &dyn Listener,
    progress: &dyn Fn(&str),
    stop: &dyn Fn() -> bool,
) -> Result<CrewFolder, Failure> {
    let members = shared.sharing.shards.unwrap_or(USUAL);
    let patience = patience(shared);
    let program = fs::read(&shared.program).map_err(|error| {
        Failure::Fault(format!("the program `{}` cannot be read: {error}", shared.program.display()))
    })?;
    let identity = Identity { hash, needed, program: crate::hash([program.as_slice()]) };
    let crew = CrewFolder::make(&options.report, identity, None, patience.settle)?;
    let seconds = patience.settle.as_secs_f64().to_string();
    let last = ["--search".to_string(), identity.word(), "--patience".to_string(), seconds, "--member".to_string()];
    let (by, name) = ((files, options, shared), crew.folder.display().to_string());
    let (mut engine, work) = submission(by, (&options.report.join(FOLDER), &name), (members, &last))?;
    let mut done = || {
        // One that has ended is enough: others may not even have begun, where the engine has no room for them.
        Ok(Done { parts: crew.answers(), tasks: vec![crew.ended().exists(); members] })
    };
    let mut last = usize::MAX;
    let mut told = |seen: Seen<'_>| match seen {
        Seen::Parts(parts) if parts != last => {
            last = parts;
            progress(&format!("{parts} tasks of the search are done"));
        }
        Seen::Parts(_) | Seen::Submitted(..) => {}
        Seen::Failed(member, reason, again) => {
            let then = if again { "begins again" } else { "is given up" };
            listener
                .sentence(Severity::Warning, &format!("process {member} of the search failed and {then}: {reason}"));
        }
        Seen::Outage(sentence) => listener.sentence(Severity::Warning, &format!("{sentence}; it is asked again")),
        Seen::Left(sentence) => listener.sentence(Severity::Warning, sentence),
    };
    // What an earlier call has submitted for the same search is known by its name.
    let ended = carry_out(engine.as_mut(), &work, (patience, true), &mut done, &mut told, stop);
    match ended.map_err(Failure::Fault)? {
        Ended::Done => {
            if let Err(error) = engine.cancel(&work) {
                let sentence = format!("tasks that are no longer needed could not be cancelled: {error}");
                listener.sentence(Severity::Warning, &sentence);
            }
            Ok(crew)
        }
        Ended::GivenUp(given) => {
            let first = given.first().map(|own| format!("; process {}: {}", own.task, own.reason)).unwrap_or_default();
            Err(Failure::Fault(format!(
                "all {members} processes of the search were given up; the same command goes on with what they have found{first}"
            )))
        }
        Ended::Stopped(_) => {
            Err(Failure::Solver("interrupted; the same command goes on with what was found".to_string()))
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_task_is_taken_by_one_member_and_by_that_one_again() {
        let report = std::env::temp_dir().join(format!("hyd-crew-{}", std::process::id()));
        let member = |number: Option<usize>, hash: u64| {
            let identity = Identity { hash, needed: 25.0, program: 3 };
            assert_eq!(Identity::read(&identity.word()), Some(identity));
            CrewFolder::make(&report, identity, number, Duration::from_millis(300)).unwrap()
        };
        let (first, second, command) = (member(Some(1), 7), member(Some(2), 7), member(None, 7));
        let name = "0123456789abcdef";
        assert!(first.take(name) && !second.take(name) && first.take(name) && command.take(name));
        assert_eq!((second.answer(name), second.answers()), (None, 0));
        first.give(name, b"answer").unwrap();
        assert_eq!((second.answer(name).unwrap(), second.answers()), (b"answer".to_vec(), 1));
        let begin = Instant::now();
        assert!(command.answer("missing").is_none() && begin.elapsed() >= Duration::from_millis(300));
        assert!(command.answer("missing").is_none() && begin.elapsed() < Duration::from_millis(600), "it waits once");
        assert_eq!(command.made(), 1);
        // Another search has answers of its own.
        assert!(member(Some(2), 8).answer(name).is_none() && member(Some(2), 8).take(name));
        command.remove();
        assert!(report.join(FOLDER).exists(), "the other search is not over");
        member(None, 8).remove();
        assert!(!report.join(FOLDER).exists());
        fs::remove_dir_all(&report).unwrap();
    }
}

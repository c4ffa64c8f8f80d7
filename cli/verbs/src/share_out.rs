//! A sweep shared out to other machines: what is shipped, what is submitted, and when all of it is there.
//!
//! The folder of the results holds the chunks (`hyd-ensemble`), and in `submission/` the executable with its plan.  Nothing here decides what
//! a run is or how it is written: a shard is the sweep of an executable over its chunks, and when all chunks are there the sweep of the command
//! finds nothing left to run, joins them and reports on them.  So the tables are those of one machine.

use std::cell::RefCell;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use hyd_cluster::{Done, Ended, Engine, Patience, Place, Seen, Work, carry_out};
use hyd_compiler::{Compilation, Severity};
use hyd_payload::{executable, format};
use hyd_run::{Folder, InputTable, Manifest, Prepared, Subject, Submission, SubmissionError};

use crate::translate::with_whole_loops;
use crate::{Failure, Listener};

/// Runs of a shard if nobody says how many shards there are: some seconds of work, of which a kill loses no more.
const RUNS: usize = 1000;
/// Most shards if nobody says how many: what Slurm takes for one array, if it was not told otherwise.
const USUAL_MOST: usize = 1000;
/// Most shards.  Large ones are resumed in pieces, so that more of them are of no use.
const MOST: usize = 10_000;
/// Failures that are listed one by one.
const TOLD: usize = 5;
/// Names in the folder of the submission.
const MODEL: &str = if cfg!(windows) { "model.exe" } else { "model" };
const WHOLE_LOOPS: &str = "whole_loops.payload";
const INPUTS: &str = "inputs.csv";
/// Interpreter that talks to Dask, if this variable does not name another one.
const PYTHON_VARIABLE: &str = "HYD_PYTHON";

/// How a sweep is shared out.
#[derive(Clone, Debug)]
pub struct Sharing {
    /// By what; none: it is only made ready.
    pub place: Option<Place>,
    /// Number of shards.
    pub shards: Option<usize>,
    /// Goes on with what was shared out before.
    pub resume: bool,
    /// How long files may take to become visible.
    pub settle: Option<Duration>,
    /// Threads of a shard.
    pub threads: usize,
    /// The interpreter that talks to Dask [default: that of the environment, else `python3`].
    pub python: Option<OsString>,
}

impl Sharing {
    /// Reads how a sweep is shared out from what users write; none where it is not.
    ///
    /// # Errors
    /// A sentence.
    pub fn read(
        on: Option<&str>,
        shards: Option<usize>,
        (resume, settle): (bool, Option<f64>),
        threads: Option<usize>,
    ) -> Result<Option<Self>, Failure> {
        let place = on.map(Place::parse).transpose();
        let place = place.map_err(|error| Failure::Usage(format!("--on: {error}")))?;
        if place.is_none() && shards.is_none() {
            return Ok(None);
        }
        let settle = settle.map(Duration::try_from_secs_f64).transpose();
        let settle = settle.map_err(|_| Failure::Usage("--settle: expected seconds, 0 or more".to_string()))?;
        if let Some(wrong) = shards.filter(|shards| !(1..=MOST).contains(shards)) {
            let sentence = format!(
                "--shards: {wrong} is not a number from 1 to {MOST}; a large shard is resumed in pieces of {RUNS} runs, so that more are of no use"
            );
            return Err(Failure::Usage(sentence));
        }
        Ok(Some(Self { place, shards, resume, settle, threads: threads.unwrap_or(1), python: None }))
    }
}

/// What came of it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Shared {
    /// All chunks are there; so many runs had been done before.
    All(usize),
    /// It is ready to be started by hand: the number of shards, and what is called with the number of each.
    Ready(usize, Vec<String>),
}

/// A model with what its sweep takes.
pub struct Model<'a> {
    /// The translation.
    pub compilation: &'a Compilation,
    /// What is set for all runs.
    pub set: &'a [(String, String)],
    /// Recorded inputs.
    pub table: Option<&'a InputTable>,
    /// The bytes of the program that executables are copies of.
    pub launcher: &'a dyn Fn() -> Result<Vec<u8>, Failure>,
}

/// Shares a sweep out and waits for it.  `progress` gets the numbers of runs done and of all.
///
/// # Errors
/// What the sweep itself refuses, an engine that cannot be reached, shards that were given up, an interrupt.
pub fn share_out(
    model: &Model<'_>,
    (prepared, subject): (&Prepared<'_>, &Subject<'_>),
    sharing: &Sharing,
    listener: &dyn Listener,
    progress: &dyn Fn(usize, usize),
    stop: &dyn Fn() -> bool,
) -> Result<Shared, Failure> {
    let members = prepared.count(subject)?;
    let shards = sharing.shards.unwrap_or_else(|| members.div_ceil(RUNS).clamp(1, USUAL_MOST)).min(members);
    let root = prepared.root();
    let known = Submission::exists(root);
    if known && !sharing.resume {
        let advice = if sharing.place.is_some() { "--resume" } else { "--on ENGINE --resume" };
        let sentence =
            format!("`{}` holds a sweep that was shared out before; {advice} goes on with it", root.display());
        return Err(Failure::Fault(sentence));
    }
    if sharing.resume && !known {
        return Err(fault(&SubmissionError::None(root.to_path_buf())));
    }
    // An engine that is out of reach leaves no folder behind.
    let mut engine = match &sharing.place {
        Some(_) => Some(engine(sharing, shards)?),
        None => None,
    };
    let folder = prepared.shared(subject, members, shards)?;
    let root = root.canonicalize().map_err(|error| Failure::Fault(format!("`{}`: {error}", root.display())))?;
    let submission = match known {
        true => earlier(&root, sharing, subject)?,
        false => shipped(&root, model, prepared, (members, shards, sharing.threads))?,
    };
    let work = work(&submission);
    let Some(engine) = &mut engine else {
        let program = std::iter::once(work.program.display().to_string());
        return Ok(Shared::Ready(submission.manifest.shards, program.chain(work.arguments).collect()));
    };
    let place = sharing.place.as_ref().map(Place::to_string).unwrap_or_default();
    let mut patience = Patience::USUAL;
    patience.settle = sharing.settle.unwrap_or(patience.settle);
    let chunks = RefCell::new(Chunks::new(&folder, submission.manifest.shards, patience.settle));
    let before = RefCell::new(None);
    let mut done = || {
        let done = chunks.borrow_mut().look(listener)?;
        before.borrow_mut().get_or_insert(done.parts);
        Ok(done)
    };
    let mut failures = 0;
    let mut told = |seen: Seen<'_>| match seen {
        Seen::Parts(parts) => progress(parts, members),
        Seen::Submitted(count, jobs) => {
            if let Err(error) = submission.note(&place, jobs, count) {
                listener.sentence(Severity::Warning, &error.to_string());
            }
        }
        Seen::Failed(shard, reason, again) => {
            failures += 1;
            let then = if again { "is run again" } else { "is given up" };
            let rest = if failures == TOLD { "\nfurther failures are counted and not told" } else { "" };
            if failures <= TOLD {
                let sentence = format!("shard {shard} failed and {then}: {reason}{rest}");
                listener.sentence(Severity::Warning, &sentence);
            }
        }
        Seen::Outage(sentence) => listener.sentence(Severity::Warning, &format!("{sentence}; it is asked again")),
        Seen::Left(sentence) => listener.sentence(Severity::Warning, sentence),
    };
    let how = (patience, sharing.resume);
    let ended = carry_out(engine.as_mut(), &work, how, &mut done, &mut told, stop).map_err(Failure::Fault)?;
    match ended {
        Ended::Done => {
            folder.sweep_out();
            Ok(Shared::All(before.into_inner().unwrap_or(0)))
        }
        Ended::GivenUp(given) => {
            let all = submission.manifest.shards;
            let first = given.first().map(|own| format!("; shard {}: {}", own.task, own.reason)).unwrap_or_default();
            let sentence = format!(
                "{} of {all} shards failed {} times each and were given up; --resume tries them again{first}",
                given.len(),
                patience.tries
            );
            Err(Failure::Fault(sentence))
        }
        Ended::Stopped(cancelled) => {
            let tasks = match cancelled {
                Ok(()) => "its tasks were cancelled".to_string(),
                Err(error) => format!("its tasks could not be cancelled ({error})"),
            };
            Err(Failure::Solver(format!("interrupted; {tasks}, and --resume goes on")))
        }
    }
}

/// Ends the tasks of a sweep that was shared out into a folder.
///
/// # Errors
/// There is none, or its engine cannot be reached.
pub fn cancel(root: &Path) -> Result<String, Failure> {
    let submission = Submission::read(root).map_err(|error| fault(&error))?;
    let root = root.canonicalize().map_err(|error| Failure::Fault(format!("`{}`: {error}", root.display())))?;
    let submission = Submission { root, ..submission };
    let last = submission.last_engine();
    let place = last.as_deref().and_then(|text| Place::parse(text).ok());
    let place = place.ok_or_else(|| Failure::Fault("nothing has been submitted".to_string()))?;
    if matches!(place, Place::Dask(_) | Place::Here) {
        let sentence = format!("tasks of `{place}` belong to the command that has submitted them; interrupt that one");
        return Err(Failure::Fault(sentence));
    }
    let mut engine = place.engine(&python(None)).map_err(Failure::Fault)?;
    engine.cancel(&work(&submission)).map_err(Failure::Fault)?;
    Ok(format!("the tasks of {} ({place}) were cancelled; what they have done stays\n", submission.manifest.name))
}

fn fault(error: &SubmissionError) -> Failure {
    Failure::Fault(error.to_string())
}

fn python(own: Option<&OsString>) -> OsString {
    let named = std::env::var_os(PYTHON_VARIABLE).filter(|name| !name.is_empty());
    own.cloned().or(named).unwrap_or_else(|| OsString::from("python3"))
}

/// The engine, which must take so many tasks.
pub(crate) fn engine(sharing: &Sharing, shards: usize) -> Result<Box<dyn Engine>, Failure> {
    let place = sharing.place.as_ref();
    let place = place.ok_or_else(|| Failure::Usage("--on: which engine?".to_string()))?;
    let mut engine = place.engine(&python(sharing.python.as_ref())).map_err(Failure::Fault)?;
    match engine.most().map_err(Failure::Fault)? {
        Some((most, by)) if shards > most => Err(Failure::Usage(format!(
            "{shards} tasks are more than {most}, which is {by}; a large shard of a sweep is resumed in pieces of {RUNS} runs"
        ))),
        _ => Ok(engine),
    }
}

/// What was shared out before, as far as it is the same.
fn earlier(root: &Path, sharing: &Sharing, subject: &Subject<'_>) -> Result<Submission, Failure> {
    let submission = Submission::read(root).map_err(|error| fault(&error))?;
    let manifest = &submission.manifest;
    if let Some(other) = sharing.shards.filter(|&shards| shards.min(manifest.members) != manifest.shards) {
        let sentence = format!("--shards: the sweep was shared out to {} and not to {other}", manifest.shards);
        return Err(Failure::Usage(sentence));
    }
    // With a table of inputs the number of the subject stands for both; the folder has compared it already.
    if manifest.inputs.is_none() && manifest.sources != format!("{:016x}", subject.sources) {
        return Err(fault(&SubmissionError::Changed(Submission::folder_in(root))));
    }
    // The program that has made the other chunks goes on, whichever version of this one calls it.
    let inputs = manifest.inputs.as_ref().map(|(shipped, _)| shipped);
    for shipped in [Some(&manifest.executable), manifest.whole_loops.as_ref(), inputs].into_iter().flatten() {
        submission.bytes(shipped).map_err(|error| fault(&error))?;
    }
    Ok(submission)
}

/// Writes what is shipped, the manifest last.
fn shipped(
    root: &Path,
    model: &Model<'_>,
    prepared: &Prepared<'_>,
    (members, shards, threads): (usize, usize, usize),
) -> Result<Submission, Failure> {
    let compilation = model.compilation;
    let translated = compilation.model.as_ref();
    let translated = translated.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let payload = translated.payload();
    let ship =
        |file: &str, bytes: &[u8], runs: bool| Submission::ship(root, file, bytes, runs).map_err(|error| fault(&error));
    let executable = ship(MODEL, &executable::join(&(model.launcher)()?, &format::write(payload)), true)?;
    let whole = with_whole_loops(compilation, model.set);
    let whole_loops = whole.map(|whole| ship(WHOLE_LOOPS, &format::write(whole.payload()), false)).transpose()?;
    let inputs = match model.table {
        None => None,
        Some(table) => {
            let (bytes, holds) = table.pack()?;
            Some((ship(INPUTS, &bytes, false)?, holds))
        }
    };
    let mut plan = prepared.plan().clone();
    // The executable is its own model, and values that the translation took are in it.
    (plan.model, plan.class) = (None, None);
    plan.set.retain(|name, _| !compilation.set_at_translation.contains(name));
    let plan = plan.to_text().map_err(|error| Failure::Fault(format!("the plan: {error}")))?;
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |own| own.as_nanos());
    let own = format!("{} {} {now}", root.display(), std::process::id());
    let manifest = Manifest {
        format: Manifest::FORMAT,
        name: format!("hyd-{}", &hyd_run::hash(own.as_bytes())[..12]),
        hyd: env!("CARGO_PKG_VERSION").to_string(),
        model: payload.tables.model.to_string(),
        sources: format!("{:016x}", payload.identity.sources),
        plan,
        shards,
        members,
        threads,
        executable,
        whole_loops,
        inputs,
    };
    Submission::begin(root, manifest).map_err(|error| fault(&error))
}

fn work(submission: &Submission) -> Work {
    let manifest = &submission.manifest;
    Work {
        name: manifest.name.clone(),
        folder: submission.root.clone(),
        program: submission.path(&manifest.executable),
        arguments: vec!["shard".to_string(), submission.root.display().to_string()],
        processors: manifest.threads,
        logs: submission.logs(),
        goes_on: Some(manifest.shards),
    }
}

/// Which chunks are there and whole.
struct Chunks<'a> {
    folder: &'a Folder,
    shards: usize,
    settle: Duration,
    /// Seen in a list of the folder.
    listed: Vec<bool>,
    /// Read, and found to hold what it should.
    whole: Vec<bool>,
    /// Since when one is there and cannot be read, or holds something else.
    doubtful: Vec<(usize, Instant)>,
    /// Chunks of each shard that are missing.
    missing: Vec<usize>,
    parts: usize,
}

impl<'a> Chunks<'a> {
    fn new(folder: &'a Folder, shards: usize, settle: Duration) -> Self {
        let chunks = folder.chunks();
        let mut missing = vec![0; shards];
        (0..chunks).for_each(|chunk| missing[chunk % shards] += 1);
        let none = vec![false; chunks];
        Self { folder, shards, settle, listed: none.clone(), whole: none, doubtful: Vec::new(), missing, parts: 0 }
    }

    /// Looks at what is new.  A chunk that stays damaged is set aside, so that its shard runs again.
    fn look(&mut self, listener: &dyn Listener) -> Result<Done, String> {
        let unreadable = |error: std::io::Error| format!("the folder of the results cannot be read: {error}");
        self.folder.mark_done(&mut self.listed).map_err(unreadable)?;
        for chunk in 0..self.listed.len() {
            if !self.listed[chunk] || self.whole[chunk] {
                continue;
            }
            let Some(reason) = self.folder.damage(chunk) else {
                self.whole[chunk] = true;
                self.doubtful.retain(|&(own, _)| own != chunk);
                self.parts += self.folder.members_of(chunk).len();
                self.missing[chunk % self.shards] -= 1;
                continue;
            };
            let since = match self.doubtful.iter().find(|(own, _)| *own == chunk) {
                Some(&(_, since)) => since,
                None => {
                    self.doubtful.push((chunk, Instant::now()));
                    continue;
                }
            };
            if since.elapsed() >= self.settle {
                let aside: PathBuf = self.folder.set_aside(chunk).map_err(unreadable)?;
                let sentence =
                    format!("a part of the results is damaged ({reason}); it was set aside as `{}`", aside.display());
                listener.sentence(Severity::Warning, &sentence);
                self.listed[chunk] = false;
                self.doubtful.retain(|&(own, _)| own != chunk);
            }
        }
        let tasks = self.missing.iter().map(|&missing| missing == 0).collect();
        Ok(Done { tasks, parts: self.parts })
    }
}

#[cfg(test)]
mod tests {
    use hyd_run::Shard;

    use super::*;

    #[test]
    fn both_sides_agree_on_who_holds_a_chunk() {
        for (chunk, shards) in [(0, 1), (7, 3), (8, 3), (9, 3), (4, 10)] {
            let holder = (0..shards).find(|&index| Shard { index, count: shards }.holds(chunk));
            assert_eq!(holder, Some(chunk % shards));
        }
    }

    #[test]
    fn how_a_sweep_is_shared_out_is_read() {
        let read = |on, shards, settle| Sharing::read(on, shards, (false, settle), None);
        assert!(read(None, None, None).is_ok_and(|own| own.is_none()));
        assert!(read(Some("slurm"), Some(3), Some(0.5)).is_ok_and(|own| own.is_some()));
        for (on, shards, settle) in [
            (Some("pbs"), None, None),
            (Some("hq"), Some(0), None),
            (None, Some(MOST + 1), None),
            (Some("hq"), None, Some(-1.0)),
        ] {
            assert!(matches!(read(on, shards, settle), Err(Failure::Usage(_))));
        }
    }
}

//! One target under mutated cases until the time is over: what shows something new is kept, what fails is cut down and written.
//!
//! New is a message or a stage that the target has not told of before, or with counters (`coverage`) an edge of the control flow.
//! Findings are cut down by removing ever smaller pieces (Zeller and Hildebrandt, "Simplifying and isolating failure-inducing
//! input", 2002).  What was kept is stored below `fuzz/corpus` and is where the next run begins; [`distil`] takes from it the few
//! cases that reach as much, for the tests to go through again.

use std::collections::HashSet;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use hyd::clock::cpu_seconds;

use crate::coverage::Seen;
use crate::mutate::Source;
use crate::targets::{self, Target};

/// Findings of one run after which it ends.
const MOST_FINDINGS: usize = 20;
/// Tries to cut a finding down.
const MOST_CUTS: usize = 400;
/// Bytes of a case that is kept for the tests, and cases of a target.
const LARGEST: usize = 4096;
const MOST_DISTILLED: usize = 150;

/// What runs now, for the watch: when it began, target and case.
pub(crate) static NOW: Mutex<Option<(f64, &'static str, Vec<u8>)>> = Mutex::new(None);
/// Where the last panic was.
pub(crate) static PLACE: Mutex<String> = Mutex::new(String::new());

/// What has been reached by the cases so far.
#[derive(Default)]
struct Reached {
    told: HashSet<u64>,
    edges: Seen,
}

impl Reached {
    /// How much a case adds that has just been called and told this.
    fn add(&mut self, told: &[u64]) -> usize {
        let new = told.iter().filter(|feature| self.told.insert(**feature)).count();
        // Messages quote the text, so that counters, where there are any, say better what is new.
        if Seen::are_counted() { self.edges.take() } else { new }
    }
}

/// Calls the target with one case of a file; the number of findings.
pub(crate) fn replay(target: &'static Target, path: &Path) -> usize {
    let case = std::fs::read(path).unwrap_or_default();
    let outcome = call(target, &case);
    println!("{}: {outcome:?}", target.name);
    usize::from(outcome.is_err())
}

/// Runs one target; the number of different findings.
pub(crate) fn fuzz(target: &'static Target, seconds: u64, seed: u64) -> usize {
    let mut texts = (target.texts)();
    texts.extend(stored(&corpus(target)).into_iter().map(|(_, case)| case));
    let given = texts.len();
    let mut source = Source::new(seed);
    let mut reached = Reached::default();
    let _ = std::fs::create_dir_all(folder("findings"));
    let mut findings: Vec<String> = Vec::new();
    let begin = cpu_seconds();
    let mut cases = 0usize;
    while cpu_seconds() - begin < seconds as f64 && findings.len() < MOST_FINDINGS {
        // The texts as they are come first.
        let case = if cases < given { texts[cases].clone() } else { source.mutate(&texts) };
        cases += 1;
        match call(target, &case) {
            Ok(told) if reached.add(&told) > 0 && cases > given => {
                keep(target, &case);
                texts.push(case);
            }
            Ok(_) => {}
            Err(place) => {
                let known = place.split(": ").next().unwrap_or_default().to_string();
                if !findings.contains(&known) {
                    findings.push(known);
                    let small = cut(target, case, &place);
                    println!(
                        "{}: {place}\n  {}",
                        target.name,
                        write(&folder("findings"), target.name, &small).display()
                    );
                }
                reached.add(&[]);
            }
        }
    }
    let (edges, all) = reached.edges.edges();
    let (kept, told, seconds) = (texts.len() - given, reached.told.len(), cpu_seconds() - begin);
    println!(
        "{}: {cases} cases in {seconds:.0} CPU seconds, {kept} kept, {told} messages, {edges} of {all} edges, {} findings",
        target.name,
        findings.len()
    );
    findings.len()
}

/// Writes the smallest cases that together reach what the corpus reaches to `folder`, in place of what was there.
pub(crate) fn distil(target: &'static Target, folder: &Path) -> io::Result<()> {
    let mut cases = (target.texts)();
    // The repository's own texts are there anyway.
    let mut reached = Reached::default();
    for case in cases.drain(..) {
        if let Ok(told) = call(target, &case) {
            reached.add(&told);
        }
    }
    let mut stored = stored(&corpus(target));
    stored.retain(|(_, case)| case.len() <= LARGEST);
    stored.sort_by_key(|(_, case)| case.len());
    let mut adding: Vec<(usize, Vec<u8>)> = Vec::new();
    for (_, case) in stored {
        if let Ok(told) = call(target, &case) {
            adding.push((reached.add(&told), case));
        }
    }
    adding.retain(|(new, _)| *new > 0);
    adding.sort_by_key(|(new, case)| (std::cmp::Reverse(*new), case.len()));
    adding.truncate(MOST_DISTILLED);
    if folder.exists() {
        std::fs::remove_dir_all(folder)?;
    }
    std::fs::create_dir_all(folder)?;
    for (_, case) in &adding {
        std::fs::write(folder.join(format!("{:016x}", targets::hash(case))), case)?;
    }
    println!("{}: {} cases in {}", target.name, adding.len(), folder.display());
    Ok(())
}

/// What a target tells about a case, or where it failed.
fn call(target: &'static Target, case: &[u8]) -> Result<Vec<u64>, String> {
    if let Ok(mut now) = NOW.lock() {
        *now = Some((cpu_seconds(), target.name, case.to_vec()));
    }
    // What ends the whole process, such as a stack that is used up, leaves its case here.
    let running = folder("findings").join(format!("{}-running", target.name));
    let _ = std::fs::write(&running, case);
    let outcome = catch_unwind(AssertUnwindSafe(|| (target.call)(case)));
    if let Ok(mut now) = NOW.lock() {
        *now = None;
    }
    let _ = std::fs::remove_file(&running);
    outcome.map_err(|_| PLACE.lock().map(|place| place.clone()).unwrap_or_default())
}

/// Removes ever smaller pieces while the case fails at the same place.
fn cut(target: &'static Target, mut case: Vec<u8>, place: &str) -> Vec<u8> {
    let mut piece = case.len() / 2;
    let mut tries = 0;
    while piece > 0 && tries < MOST_CUTS {
        let mut at = 0;
        while at + piece <= case.len() && tries < MOST_CUTS {
            let mut smaller = case.clone();
            smaller.drain(at..at + piece);
            tries += 1;
            if call(target, &smaller).is_err_and(|other| other.split(": ").next() == place.split(": ").next()) {
                case = smaller;
            } else {
                at += piece;
            }
        }
        piece /= 2;
    }
    case
}

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn corpus(target: &Target) -> PathBuf {
    folder("corpus").join(target.name)
}

/// Names and contents of the files of a folder, in the order of names.
fn stored(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    paths.sort();
    paths.into_iter().filter_map(|path| std::fs::read(&path).ok().map(|case| (path, case))).collect()
}

fn keep(target: &Target, case: &[u8]) {
    let folder = corpus(target);
    let path = folder.join(format!("{:016x}", targets::hash(case)));
    let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, case));
    if let Err(error) = written {
        eprintln!("{}: {error}", path.display());
    }
}

/// Writes a case; its path.
pub(crate) fn write(folder: &Path, target: &str, case: &[u8]) -> PathBuf {
    let path = folder.join(format!("{target}-{:016x}", targets::hash(case)));
    let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, case));
    if let Err(error) = written {
        eprintln!("{}: {error}", path.display());
    }
    path
}

//! A driver that mutates the repository's texts and calls one target with them until the time is over.
//!
//! `targets` says what is called and what must hold, `mutate` how cases are made.  Feedback takes the place of coverage: what a target
//! says about a case is hashed, and a case with something new is kept for further mutation (the idea of evolutionary fuzzing,
//! Miller and others, "The Fuzzing Book", chapter "Greybox Fuzzing").  Findings are cut down by removing ever smaller pieces
//! (Zeller and Hildebrandt, "Simplifying and isolating failure-inducing input", 2002).

mod mutate;
mod targets;

use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use mutate::Source;
use targets::{TARGETS, Target};

/// Seconds for one case.
const PATIENCE: u64 = 60;
/// Findings of one run after which it ends.
const MOST_FINDINGS: usize = 20;
/// Tries to cut a finding down.
const MOST_CUTS: usize = 400;

/// What runs now, for the watch: when it began, target and case.
static NOW: Mutex<Option<(Instant, &'static str, Vec<u8>)>> = Mutex::new(None);
/// Where the last panic was.
static PLACE: Mutex<String> = Mutex::new(String::new());

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_default();
    let (mut seconds, mut seed, mut replay) = (60, 1, None);
    while let (Some(option), Some(value)) = (arguments.next(), arguments.next()) {
        match option.as_str() {
            "--seconds" => seconds = value.parse().unwrap_or(seconds),
            "--seed" => seed = value.parse().unwrap_or(seed),
            "--replay" => replay = Some(PathBuf::from(value)),
            _ => eprintln!("unknown option {option}"),
        }
    }
    let chosen: Vec<&'static Target> = TARGETS.iter().filter(|target| name == "all" || target.name == name).collect();
    if chosen.is_empty() {
        let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
        eprintln!("targets: {}, all", names.join(", "));
        return ExitCode::from(2);
    }
    std::panic::set_hook(Box::new(|info| {
        let place = info.location().map(ToString::to_string).unwrap_or_default();
        if let Ok(mut last) = PLACE.lock() {
            *last = format!("{place}: {}", info.payload_as_str().unwrap_or_default());
        }
    }));
    std::thread::spawn(watch);
    // Deep recursion is allowed as much stack as the program's own main thread has.
    let work = std::thread::Builder::new()
        .stack_size(8 << 20)
        .spawn(move || chosen.iter().map(|target| fuzz(target, seconds, seed, replay.as_deref())).sum::<usize>());
    match work.map(|thread| thread.join()) {
        Ok(Ok(0)) => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}

/// Ends the program when a case takes too long.
fn watch() {
    loop {
        std::thread::sleep(Duration::from_millis(500));
        let now = NOW.lock().ok().and_then(|now| now.clone());
        if let Some((begin, target, case)) = now
            && begin.elapsed() > Duration::from_secs(PATIENCE)
        {
            let path = write(target, &case);
            eprintln!("{target}: no end after {PATIENCE} s: {}", path.display());
            std::process::exit(1);
        }
    }
}

/// What a target said about a case, or where it failed.
fn call(target: &'static Target, case: &[u8]) -> Result<Vec<u64>, String> {
    if let Ok(mut now) = NOW.lock() {
        *now = Some((Instant::now(), target.name, case.to_vec()));
    }
    let outcome = catch_unwind(AssertUnwindSafe(|| (target.call)(case)));
    if let Ok(mut now) = NOW.lock() {
        *now = None;
    }
    outcome.map_err(|_| PLACE.lock().map(|place| place.clone()).unwrap_or_default())
}

/// Runs one target; the number of different findings.
fn fuzz(target: &'static Target, seconds: u64, seed: u64, replay: Option<&Path>) -> usize {
    if let Some(path) = replay {
        let case = std::fs::read(path).unwrap_or_default();
        let outcome = call(target, &case);
        println!("{}: {outcome:?}", target.name);
        return usize::from(outcome.is_err());
    }
    let mut texts = (target.texts)();
    let mut source = Source::new(seed);
    let mut seen: HashSet<u64> = HashSet::new();
    let mut findings: Vec<String> = Vec::new();
    let begin = Instant::now();
    let (mut cases, mut kept) = (0usize, 0usize);
    while begin.elapsed() < Duration::from_secs(seconds) && findings.len() < MOST_FINDINGS {
        // The texts as they are come first.
        let case = if cases < texts.len() - kept { texts[cases].clone() } else { source.mutate(&texts) };
        cases += 1;
        match call(target, &case) {
            Ok(said) => {
                let new = said.iter().filter(|feature| seen.insert(**feature)).count();
                if new > 0 && cases > texts.len() - kept {
                    texts.push(case);
                    kept += 1;
                }
            }
            Err(place) => {
                let known = place.split(": ").next().unwrap_or_default().to_string();
                if !findings.contains(&known) {
                    findings.push(known);
                    let small = cut(target, case, &place);
                    println!("{}: {place}\n  {}", target.name, write(target.name, &small).display());
                }
            }
        }
    }
    println!("{}: {cases} cases, {kept} kept, {} features, {} findings", target.name, seen.len(), findings.len());
    findings.len()
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

fn write(target: &str, case: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("findings");
    let path = folder.join(format!("{target}-{:016x}", targets::hash(case)));
    let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, case));
    if let Err(error) = written {
        eprintln!("{}: {error}", path.display());
    }
    path
}

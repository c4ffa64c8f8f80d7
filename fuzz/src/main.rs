//! A driver that mutates the repository's texts and calls one target with them until the time is over.
//!
//! `targets` says what is called and what must hold, `texts` what cases are made from, `mutate` how, `campaign` goes through them,
//! and `coverage` tells which ways through the program are new.

mod campaign;
mod coverage;
mod mutate;
mod targets;
mod texts;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use campaign::{NOW, PLACE};
use hyd::clock::cpu_seconds;
use targets::{TARGETS, Target};

/// CPU seconds for one case.
const PATIENCE: f64 = 60.0;

/// What is to be done with the targets.
enum Job {
    Fuzz { seconds: u64, seed: u64 },
    Replay(PathBuf),
    Distil,
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_default();
    let (mut seconds, mut seed, mut job) = (60, 1, None);
    while let Some(option) = arguments.next() {
        let mut value = || arguments.next().unwrap_or_default();
        match option.as_str() {
            "--seconds" => seconds = value().parse().unwrap_or(seconds),
            "--seed" => seed = value().parse().unwrap_or(seed),
            "--replay" => job = Some(Job::Replay(value().into())),
            "--distil" => job = Some(Job::Distil),
            _ => eprintln!("unknown option {option}"),
        }
    }
    let job = job.unwrap_or(Job::Fuzz { seconds, seed });
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
        .spawn(move || chosen.iter().map(|target| work(target, &job)).sum::<usize>());
    match work.map(|thread| thread.join()) {
        Ok(Ok(0)) => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}

/// The number of findings and faults.
fn work(target: &'static Target, job: &Job) -> usize {
    match job {
        Job::Fuzz { seconds, seed } => campaign::fuzz(target, *seconds, *seed),
        Job::Replay(path) => campaign::replay(target, path),
        Job::Distil => {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/corpus").join(target.name);
            campaign::distil(target, &folder).map_or_else(
                |error| {
                    eprintln!("{}: {error}", folder.display());
                    1
                },
                |()| 0,
            )
        }
    }
}

/// Ends the program when a case takes too long.
fn watch() {
    loop {
        std::thread::sleep(Duration::from_millis(500));
        let now = NOW.lock().ok().and_then(|now| now.clone());
        if let Some((begin, target, case)) = now
            && cpu_seconds() - begin > PATIENCE
        {
            let path = campaign::write(&Path::new(env!("CARGO_MANIFEST_DIR")).join("findings"), target, &case);
            eprintln!("{target}: no end after {PATIENCE} CPU seconds: {}", path.display());
            std::process::exit(1);
        }
    }
}

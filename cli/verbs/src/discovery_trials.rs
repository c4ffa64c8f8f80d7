//! The sets of a calibration shared out to other machines: one task for each.
//!
//! `REPORT/calibration` holds what each has found, `trials/K.json`, until all are there.  A set is drawn by its number and the seed, and a file says of which
//! search it is, so that neither the number of machines nor the order in which they end can be seen in the result.

use std::fs;
use std::path::{Path, PathBuf};

use hyd_cluster::{Done, Ended, Seen, carry_out};
use hyd_compiler::Severity;
use hyd_discovery::Calibration;
use hyd_results::write_whole;
use serde_json::{Value, json};

use crate::discover::{SearchOptions, all_candidates, fingerprint, unwritable};
use crate::discovery_shared::{SharedSearch, patience, submission};
use crate::study::{Opened, StudyFiles, failure};
use crate::{Failure, Listener};

/// Folder of what is shared out, in that of the report.
const FOLDER: &str = "calibration";

/// Searches one set and keeps what came out.
///
/// # Errors
/// As the search; a file that cannot be written.
pub fn keep_trial(
    opened: &Opened,
    options: &SearchOptions,
    trial: usize,
    listener: &dyn Listener,
) -> Result<(), Failure> {
    let setup = &opened.setup;
    let make = || opened.sources();
    let workshop = opened.workshop(&make);
    let base = opened.translated(&workshop, listener)?;
    let units = opened.units(base.blocks())?;
    let candidates = all_candidates(opened, &workshop, listener)?;
    let hash = fingerprint(opened, (&workshop, &units), &candidates, options.seed)?;
    let sets = (trial..trial + 1, options.seed);
    let drops = Calibration::drops(setup, &workshop, &candidates, sets, &|_| {}).map_err(failure)?;
    let drop = drops.first().copied().unwrap_or(0.0);
    // Bits, so that the number comes back as it was.
    let text = json!({"search": format!("{hash:016x}"), "bits": format!("{:016x}", drop.to_bits()), "cost_drop": drop});
    let path = path(&options.report.join(FOLDER), trial);
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder).map_err(|error| unwritable(folder, &error))?;
    write_whole(&path, format!("{text}\n").as_bytes()).map_err(|error| unwritable(&path, &error))
}

fn path(folder: &Path, trial: usize) -> PathBuf {
    folder.join("trials").join(format!("{trial}.json"))
}

/// What a set has shown, if it is there and of this search.
fn kept(folder: &Path, trial: usize, hash: u64) -> Option<f64> {
    let own: Value = serde_json::from_str(&fs::read_to_string(path(folder, trial)).ok()?).ok()?;
    let bits = u64::from_str_radix(own["bits"].as_str()?, 16).ok()?;
    (own["search"] == format!("{hash:016x}")).then(|| f64::from_bits(bits))
}

/// Has all sets searched by other machines.
///
/// # Errors
/// An engine that cannot be reached, sets that were given up, an interrupt.
pub(crate) fn shared_trials(
    files: &StudyFiles,
    options: &SearchOptions,
    (shared, sets, hash): (&SharedSearch, usize, u64),
    listener: &dyn Listener,
    progress: &dyn Fn(&str),
    stop: &dyn Fn() -> bool,
) -> Result<Calibration, Failure> {
    let folder = options.report.join(FOLDER);
    let (trials, by) = (folder.join("trials"), (files, options, shared));
    fs::create_dir_all(&trials).map_err(|error| unwritable(&trials, &error))?;
    let last = ["--calibrate".to_string(), sets.to_string(), "--trial".to_string()];
    let (mut engine, work) = submission(by, (&folder, &format!("{hash:016x}")), (sets, &last))?;
    let folder = work.folder.clone();
    let mut done = || {
        let tasks: Vec<bool> = (0..sets).map(|trial| kept(&folder, trial, hash).is_some()).collect();
        Ok(Done { parts: tasks.iter().filter(|&&done| done).count(), tasks })
    };
    let mut last = usize::MAX;
    let mut told = |seen: Seen<'_>| match seen {
        Seen::Parts(parts) if parts != last => {
            last = parts;
            progress(&format!("{parts} of {sets} sets on which nothing is missing"));
        }
        Seen::Parts(_) | Seen::Submitted(..) => {}
        Seen::Failed(trial, reason, again) => {
            let then = if again { "is searched again" } else { "is given up" };
            listener.sentence(Severity::Warning, &format!("set {trial} failed and {then}: {reason}"));
        }
        Seen::Outage(sentence) => listener.sentence(Severity::Warning, &format!("{sentence}; it is asked again")),
        Seen::Left(sentence) => listener.sentence(Severity::Warning, sentence),
    };
    let patience = patience(shared);
    // What an earlier call has submitted for the same search is known by its name.
    let ended = carry_out(engine.as_mut(), &work, (patience, true), &mut done, &mut told, stop);
    match ended.map_err(Failure::Fault)? {
        Ended::Done => {
            let drops = (0..sets).map(|trial| kept(&folder, trial, hash)).collect::<Option<Vec<f64>>>();
            let drops = drops.ok_or_else(|| Failure::Fault("a file of a set is gone".to_string()))?;
            // What stays behind is only taken for the same search again.
            let _ = fs::remove_dir_all(&folder);
            Ok(Calibration::new(drops))
        }
        Ended::GivenUp(given) => {
            let first = given.first().map(|own| format!("; set {}: {}", own.task, own.reason)).unwrap_or_default();
            Err(Failure::Fault(format!(
                "{} of {sets} sets were given up; the same command tries them again{first}",
                given.len()
            )))
        }
        Ended::Stopped(_) => {
            Err(Failure::Solver("interrupted; the same command goes on with the sets that are left".to_string()))
        }
    }
}

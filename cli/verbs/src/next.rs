//! The shots to make next: the search, what it leaves open, and the conditions under which most is learned of it.

use std::path::PathBuf;
use std::time::Instant;

use hyd_discovery::{NextShots, Search, Wish, next_shots};
use hyd_results::{refuse_read, write_whole};

use crate::discover::{all_candidates, fingerprint, unwritable};
use crate::discovery_calibration as calibration;
use crate::next_page::page;
use crate::study::{Opened, StudyFiles, failure, tell_whole_loops};
use crate::{Failure, Listener};

/// The files of an answer.
const FILES: [&str; 2] = ["next.json", "next.html"];

/// What is wanted.
#[derive(Clone, Debug)]
pub struct NextOptions {
    /// Conditions that may be set, each `NAME=LOW:HIGH`.
    pub vary: Vec<String>,
    /// How many shots.
    pub shots: usize,
    /// Number of the shot that is like the new ones in all else.
    pub like: Option<usize>,
    /// Folder for `next.json` and `next.html`; made if it is not there.
    pub report: Option<PathBuf>,
    /// Seed of random starts of the search.
    pub seed: u64,
}

/// What is proposed.
#[derive(Clone, Debug)]
pub struct Next {
    /// For people.
    pub text: String,
    /// `next.json`.
    pub json: String,
}

/// Searches for what a model lacks, and proposes shots that settle what the search leaves open.
///
/// # Errors
/// As a search; conditions that are not there, nothing that a further shot could settle, files that cannot be written.
pub fn next(
    study: &StudyFiles,
    opened: &Opened,
    options: &NextOptions,
    listener: &dyn Listener,
) -> Result<Next, Failure> {
    let setup = &opened.setup;
    let vary = options.vary.iter().map(|text| Wish::range(text)).collect::<Result<_, _>>();
    let wish =
        Wish { vary: vary.map_err(|fault| Failure::Usage(fault.sentence))?, shots: options.shots, like: options.like };
    // Conditions that are not there are told before a search of minutes.
    wish.check(setup).map_err(failure)?;
    if let Some(folder) = &options.report {
        let made = std::fs::create_dir_all(folder);
        made.map_err(|error| Failure::Fault(format!("the folder `{}` cannot be made: {error}", folder.display())))?;
    }
    let make = || opened.sources();
    let workshop = opened.workshop(&make);
    let begin = Instant::now();
    let progress = |text: &str| listener.progress(begin.elapsed().as_secs_f64(), text);
    let base = opened.translated(&workshop, listener)?;
    let units = opened.units(base.blocks())?;
    let candidates = all_candidates(opened, &workshop, listener)?;
    // By now all texts and tables have been read; better here than after a long search.
    for path in options.report.iter().flat_map(|folder| FILES.map(|name| folder.join(name))) {
        refuse_read(&path).map_err(|error| unwritable(&path, &error))?;
    }
    let hash = fingerprint(opened, (&workshop, &units), &candidates, options.seed)?;
    let needed = calibration::known(&study.study, hash).map_or(Search::NEEDED, |known| known.needed());
    let search = Search {
        setup,
        workshop: &workshop,
        candidates,
        seed: options.seed,
        needed,
        progress: &progress,
        memory: &hyd_discovery::Forgetful,
        ends: hyd_discovery::Ends::default(),
        tasks: hyd_discovery::Tasks::ALONE,
    };
    let settled = search.settled();
    let interrupted = || Failure::Solver("interrupted".to_string());
    if setup.watch.stopped() {
        return Err(interrupted());
    }
    let (findings, other) = settled.map_err(failure)?;
    let setup = other.as_ref().unwrap_or(setup);
    let proposed = next_shots(setup, &workshop, &findings, &wish, &progress);
    if setup.watch.stopped() {
        return Err(interrupted());
    }
    let mut proposed: NextShots = proposed.map_err(failure)?;
    tell_whole_loops(setup, listener);
    proposed.json["seconds"] = begin.elapsed().as_secs_f64().into();
    let json = format!("{:#}\n", proposed.json);
    let mut text = format!("{}: {}", findings.word(), proposed.summary);
    if let Some(folder) = &options.report {
        for (name, content) in FILES.into_iter().zip([&json, &page(&proposed)]) {
            let path = folder.join(name);
            write_whole(&path, content.as_bytes()).map_err(|error| unwritable(&path, &error))?;
        }
        text.push_str(&format!("{}\n", folder.join("next.html").display()));
    }
    Ok(Next { text, json })
}

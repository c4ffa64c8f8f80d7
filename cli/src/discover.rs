//! `hyd discover STUDY.toml --bench SET.json --report DIR`: where do they differ, what is missing, and the model that has it.

use hyd_verbs::discover::{SearchOptions, discover as search};
use hyd_verbs::discovery_crew::search_along;
use hyd_verbs::discovery_shared::SharedSearch;
use hyd_verbs::discovery_trials::keep_trial;
use hyd_verbs::share_out::Sharing;
use hyd_verbs::study::open;

use crate::arguments::Discover;
use crate::terminal::Terminal;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn discover(arguments: &Discover) -> Result<(), Failure> {
    let (files, terminal) = (arguments.study.files(), Terminal::TEXT);
    let engine = &arguments.engine;
    let threads = arguments.study.threads.map(std::num::NonZeroUsize::get);
    let sharing = Sharing::read(engine.on.as_deref(), arguments.shards, (arguments.resume, engine.settle), threads)?;
    let opened = open(&files, &terminal)?;
    hyd_run::interrupt::listen_for(opened.setup.watch.stop.clone());
    let own = std::env::current_exe();
    let own = own.map_err(|error| Failure::Fault(format!("the place of this program is not known: {error}")))?;
    let shared = sharing.filter(|own| own.place.is_some()).map(|sharing| SharedSearch {
        sharing,
        program: own,
        before: Vec::new(),
        copied: true,
    });
    let options = SearchOptions {
        report: arguments.report.clone(),
        resume: arguments.resume,
        calibrate: arguments.calibrate,
        shared,
        seed: arguments.study.seed,
    };
    if let Some(trial) = arguments.trial {
        return keep_trial(&opened, &options, trial, &terminal);
    }
    if let Some(member) = arguments.member {
        return search_along(&opened, &options, (member, &arguments.search, arguments.patience), &terminal);
    }
    let found = search(&files, &opened, &options, &terminal)?;
    output::print(if arguments.json { &found.json } else { &found.text })
}

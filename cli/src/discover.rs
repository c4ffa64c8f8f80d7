//! `hyd discover STUDY.toml --bench SET.json --report DIR`: where do they differ, what is missing, and the model that has it.

use hyd_verbs::discover::{SearchOptions, discover as search};
use hyd_verbs::discovery_trials::{SharedTrials, keep_trial};
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
    let sharing = Sharing::read(engine.on.as_deref(), None, (arguments.resume, engine.settle), threads)?;
    if sharing.is_some() && arguments.calibrate.is_none() {
        let sentence = "--on: it shares out the sets of --calibrate; the search itself runs on this machine, so --calibrate SETS is needed";
        return Err(Failure::Usage(sentence.to_string()));
    }
    let opened = open(&files, &terminal)?;
    let own = std::env::current_exe();
    let own = own.map_err(|error| Failure::Fault(format!("the place of this program is not known: {error}")))?;
    let shared = sharing.map(|sharing| SharedTrials { sharing, program: own, before: Vec::new(), copied: true });
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
    let found = search(&files, &opened, &options, &terminal)?;
    output::print(if arguments.json { &found.json } else { &found.text })
}

//! `hyd discover STUDY.toml --bench SET.json --report DIR`: where do they differ, what is missing, and the model that has it.

use hyd_verbs::discover::{SearchOptions, discover as search};
use hyd_verbs::study::open;

use crate::arguments::Discover;
use crate::terminal::Terminal;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn discover(arguments: &Discover) -> Result<(), Failure> {
    let (files, terminal) = (arguments.study.files(), Terminal::TEXT);
    let opened = open(&files, &terminal)?;
    let options = SearchOptions {
        report: arguments.report.clone(),
        resume: arguments.resume,
        calibrate: arguments.calibrate,
        seed: arguments.study.seed,
    };
    let found = search(&files, &opened, &options, &terminal)?;
    output::print(if arguments.json { &found.json } else { &found.text })
}

//! `hyd next STUDY.toml --bench SET.json --vary NAME=LOW:HIGH`: the shots that settle what a search leaves open.

use hyd_verbs::next::{NextOptions, next as proposed};
use hyd_verbs::study::open;

use crate::arguments::Next;
use crate::terminal::Terminal;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn next(arguments: &Next) -> Result<(), Failure> {
    let (files, terminal) = (arguments.study.files(), Terminal::TEXT);
    let opened = open(&files, &terminal)?;
    hyd_run::interrupt::listen_for(opened.setup.watch.stop.clone());
    let options = NextOptions {
        vary: arguments.vary.clone(),
        shots: arguments.shots.get(),
        like: arguments.like,
        report: arguments.report.clone(),
        seed: arguments.study.seed,
    };
    let found = proposed(&files, &opened, &options, &terminal)?;
    output::print(if arguments.json { &found.json } else { &found.text })
}

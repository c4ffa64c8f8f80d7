//! `hyd fit STUDY.toml --bench SET.json`: what may be off, fitted to the shots, and what is left.

use hyd_verbs::fit::{FitOptions, fit as fitted};
use hyd_verbs::study::open;

use crate::arguments::Fit;
use crate::terminal::Terminal;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn fit(arguments: &Fit) -> Result<(), Failure> {
    let terminal = Terminal::TEXT;
    let opened = open(&arguments.study.files(), &terminal)?;
    let options = FitOptions {
        seed: arguments.study.seed,
        profile: arguments.profile.clone(),
        write_parameters: arguments.write_parameters.clone(),
        report: arguments.report.clone(),
    };
    let found = fitted(&opened, &options, &terminal)?;
    output::print(&if arguments.json { format!("{}\n", found.json) } else { found.text })?;
    found.unconverged.map_or(Ok(()), |sentence| Err(Failure::Solver(sentence)))
}

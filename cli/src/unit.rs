//! `hyd simulate X.fmu`: a unit of another tool, run in a process of its own.
//!
//! That process is this program again, with a first argument that no user types.

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use hyd_fmi_import::Host;
use hyd_run::{InputTable, Status, check_usage, finish, interrupt, tell};
use hyd_verbs::unit::{Kind, UnitRun, is_unit};

use crate::arguments::{Simulate, UnitKind};
use crate::{Failure, output};

/// The first argument of the process of a unit.
const SERVE: &str = "serve-unit-of-another-tool";
/// Seconds after which a call of a unit is given up.
const PATIENCE: f64 = 60.0;

/// Serves a unit if that is what this process is for.
pub(crate) fn serve(arguments: &[OsString]) -> Option<ExitCode> {
    let [_, verb, area, folder] = arguments else { return None };
    if verb != SERVE {
        return None;
    }
    // Ctrl-C is for the process that began this one, which ends it in order.
    interrupt::ignore();
    Some(match hyd_fmi_import::serve(Path::new(area), Path::new(folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => {
            output::sentence("error", &sentence, hyd_run::MessageFormat::Text);
            ExitCode::FAILURE
        }
    })
}

/// Refuses a unit where a text is wanted.
pub(crate) fn refuse(file: &Path) -> Result<(), Failure> {
    match is_unit(file) {
        true => Err(Failure::Usage(format!(
            "`{}` is a unit of another tool, not a text; `hyd simulate` runs units",
            file.display()
        ))),
        false => Ok(()),
    }
}

/// How the process of a unit is begun.
pub(crate) fn host(patience: Option<f64>) -> Result<Host, Failure> {
    let patience = patience.unwrap_or(PATIENCE);
    let wrong = || Failure::Usage(format!("--call-limit {patience}: the limit must be a positive number of seconds"));
    let positive = if patience > 0.0 { Duration::try_from_secs_f64(patience).ok() } else { None };
    let patience = positive.ok_or_else(wrong)?;
    let program = std::env::current_exe();
    let program = program.map_err(|error| Failure::Fault(format!("this program cannot find its own file: {error}")))?;
    let own = crate::build_fmu::own_library();
    Ok(Host { program, arguments: vec![SERVE.into()], patience, interrupted: interrupt::requested, own })
}

/// Runs the unit.
pub(crate) fn simulate(arguments: &Simulate) -> Result<(), Failure> {
    let file = &arguments.model.file;
    check_usage(&arguments.run, Some(file))?;
    if let Some(path) = &arguments.plot {
        hyd_verbs::picture::check_picture("--plot", path)?;
    }
    refuse_text_options(arguments)?;
    hyd_run::note_read(file);
    let table = arguments.run.inputs.read()?;
    check_usage(&arguments.run, None)?;
    let host = host(arguments.call_limit)?;
    interrupt::listen();
    let run = UnitRun {
        file,
        kind: arguments.kind.map(|kind| match kind {
            UnitKind::ModelExchange => Kind::ModelExchange,
            UnitKind::CoSimulation => Kind::CoSimulation,
        }),
        step: arguments.step,
        host: &host,
        set: &arguments.model.set,
        table: table.as_ref() as Option<&InputTable>,
        arguments: &arguments.run,
        drawn: arguments.plot.is_some(),
    };
    let ended = run.simulate(&interrupt::requested)?;
    let (mut outcome, format) = (ended.outcome, arguments.model.message_format);
    if let Some(path) = arguments.plot.as_ref().filter(|_| outcome.recorder.rows > 0) {
        let is_whole = matches!(outcome.summary.status, Status::Done | Status::Terminated);
        outcome.summary.plot = Some(crate::simulate::draw(path, is_whole, &mut outcome.recorder)?);
    }
    let printed = tell(&outcome.summary, arguments.run.json, format);
    let Err(error) = outcome.result else { return printed };
    let is_lost = ended.fault.is_some();
    let failure = finish(&outcome.summary, error, &|error, kept| {
        // What became of the unit says more than what the solver made of it.
        let sentence = ended.fault.as_ref().map_or_else(|| error.to_string(), ToString::to_string);
        output::sentence("error", &sentence, format);
        if let Some(kept) = kept {
            output::sentence("note", &kept, format);
        }
    });
    Err(match failure {
        Failure::SolverReported if is_lost => Failure::Reported,
        other => other,
    })
}

/// Options that are about texts of models.
fn refuse_text_options(arguments: &Simulate) -> Result<(), Failure> {
    let model = &arguments.model;
    let given = [
        ("--model", model.model.is_some()),
        ("--library", !model.libraries.library.is_empty()),
        ("--allow-outside", model.libraries.allow_outside),
        ("--strict-units", model.strict_units),
        ("--profile", arguments.run.profile),
        ("--profile-page", arguments.profile_page.is_some()),
        ("--backend", arguments.run.backend != hyd_run::BackendName::Native),
    ];
    match given.iter().find(|(_, given)| *given) {
        Some((option, _)) => {
            Err(Failure::Usage(format!("{option} is about texts of models, and `{}` is a unit", model.file.display())))
        }
        None => Ok(()),
    }
}

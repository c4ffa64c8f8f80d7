//! `hyd simulate FILE`: translate, run, write results, draw, say what happened.

use std::path::Path;
use std::sync::Arc;

use hyd_compiler::{Compilation, Diagnostic, Extras, Goal, unused_parameters};
use hyd_report::{Curve, Figure};
use hyd_results::{Discard, partial, write_whole};
use hyd_run::{InputTable, Recorder, RunArguments, Status, check_target, check_usage, finish, interrupt, tell};
use hyd_runtime::SolveError;
use hyd_verbs::picture::{check_picture, write_picture};
use hyd_verbs::unit::is_unit;
use hyd_verbs::{
    Healing, Joined, Request, Run, Trials, profile_page, rescue_diagnostic, run_diagnostic, with_whole_loops,
};

use crate::arguments::Simulate;
use crate::translate::{self, translate_with};
use crate::{Failure, clock, output, unit};

/// Runs the verb.
pub(crate) fn simulate(arguments: &Simulate) -> Result<(), Failure> {
    if is_unit(&arguments.model.file) {
        return unit::simulate(arguments);
    }
    refuse_unit_options(arguments)?;
    check_usage(&arguments.run, Some(&arguments.model.file))?;
    if let Some(path) = &arguments.plot {
        check_picture("--plot", path)?;
    }
    if let Some(path) = &arguments.profile_page {
        if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("html")) {
            return Err(Failure::Usage(format!("`{}`: a page ends in .html", path.display())));
        }
        check_target("--profile-page", path, &[&arguments.model.file])?;
    }
    let begin = clock::cpu_seconds();
    let table = arguments.run.inputs.read()?;
    let driven = table.as_ref().map(InputTable::names).unwrap_or_default();
    let extras = Extras { driven: &driven, joined: true, ..Extras::default() };
    let compilation = translate_with(&arguments.model, Goal::Run, &extras, &[]).inspect_err(|_| {
        if arguments.run.json {
            let _ = output::print("{\"status\":\"rejected\"}\n");
        }
    })?;
    // Only now is it known which files are read; better here than after a long run.
    check_usage(&arguments.run, None)?;
    if let Some(path) = &arguments.plot {
        check_picture("--plot", path)?;
    }
    let units = match compilation.flat.as_deref() {
        Some(flat) => Joined::open(flat, &arguments.model.libraries.libraries(), Some(&unit::host(None)?))?,
        None => None,
    };
    let counted =
        RunArguments { profile: arguments.run.profile || arguments.profile_page.is_some(), ..arguments.run.clone() };
    let run = Run {
        units: units.as_ref(),
        compilation: &compilation,
        set: &arguments.model.set,
        table: table.as_ref(),
        arguments: &counted,
        drawn: arguments.plot.is_some(),
        only_shown: true,
        translate_s: clock::cpu_seconds() - begin,
        progress: true,
    };
    interrupt::listen();
    let whole = || with_whole_loops(&compilation, &arguments.model.set);
    let (mut outcome, _) = run.simulate(&whole, &|| Discard, &interrupt::requested)?;
    let format = arguments.model.message_format;
    if let Some(rescue) = &outcome.rescue {
        let diagnostic = rescue_diagnostic(rescue, &compilation.files, compilation.flat.as_deref());
        translate::report(&compilation.files, &[diagnostic], format);
        outcome.summary.told = Some(rescue.to_string());
    }
    if let Some(path) = arguments.plot.as_ref().filter(|_| outcome.recorder.rows > 0) {
        let is_whole = matches!(outcome.summary.status, Status::Done | Status::Terminated);
        outcome.summary.plot = Some(draw(path, is_whole, &mut outcome.recorder)?);
    }
    if let Some(path) = &arguments.profile_page
        && let Some(page) = profile_page(&outcome.summary, &compilation.files, compilation.flat.as_deref())
    {
        write_whole(path, page.as_bytes())
            .map_err(|error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display())))?;
        outcome.summary.profile_page = Some(path.display().to_string());
        outcome.summary.profile = outcome.summary.profile.take().filter(|_| arguments.run.profile);
    }
    let printed = tell(&outcome.summary, arguments.run.json, format);
    let Err(error) = outcome.result else { return printed };
    Err(finish(&outcome.summary, error, &|error, kept| {
        let mut diagnostic = run_diagnostic(error, &compilation.files, compilation.flat.as_deref(), kept);
        let is_of_the_model =
            !matches!(error, SolveError::Interrupted { .. } | SolveError::Sink { .. } | SolveError::Option(_));
        let unused = unused_parameters(&compilation.files, &arguments.model.file.display().to_string());
        if let Some(sentence) = unused.filter(|_| is_of_the_model) {
            diagnostic.notes.insert(0, sentence);
        }
        // What reads a recording or another tool's unit is no small thing to run again.
        if table.is_none() && units.is_none() {
            let model = &arguments.model;
            let request = Request { class: model.model.clone(), set: model.set.clone(), goal: Goal::Run };
            let trials = Trials {
                file: &model.file,
                libraries: &model.libraries.libraries(),
                request: &request,
                strict_units: model.strict_units,
                run: &arguments.run,
            };
            if matches!(error, SolveError::Assertion { .. }) {
                trials.tell_course(&compilation, &mut diagnostic);
            }
            tell_healing(healing(&trials, &compilation, error, &diagnostic), &mut diagnostic);
        }
        translate::report(&compilation.files, &[diagnostic], format);
    }))
}

/// Small changes of the text after which the model runs to its end.
fn healing(trials: &Trials<'_>, compilation: &Compilation, error: &SolveError, diagnostic: &Diagnostic) -> Healing {
    let mut messages = compilation.diagnostics.clone();
    messages.push(diagnostic.clone());
    trials.healing(compilation, &messages, Some(error))
}

/// Says what heals a run that failed; what is clear stands in the first sentence.
fn tell_healing(healing: Healing, diagnostic: &mut Diagnostic) {
    if healing.is_vague {
        return;
    }
    if let (true, Some(first)) = (healing.is_clear, healing.proposals.first()) {
        diagnostic.notes.retain(|own| *own != first.message);
        diagnostic.message.push_str(&format!("; it runs after this change: {}", first.message));
    }
    for proposal in healing.proposals.iter().skip(usize::from(healing.is_clear)) {
        let also = if healing.is_clear { "also " } else { "" };
        diagnostic.notes.push(format!("it {also}runs after this change: {}", proposal.message));
    }
    diagnostic.proposals.extend(healing.proposals);
}

/// Options that are about units.
fn refuse_unit_options(arguments: &Simulate) -> Result<(), Failure> {
    let given = [
        ("--as", arguments.kind.is_some()),
        ("--step", arguments.step.is_some()),
        ("--call-limit", arguments.call_limit.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        Some((option, _)) => {
            let file = arguments.model.file.display();
            Err(Failure::Usage(format!("{option} is about units of other tools (*.fmu), and `{file}` is a text")))
        }
        None => Ok(()),
    }
}

/// Draws the shown variables; gives the name of the picture.
pub(crate) fn draw(path: &Path, is_whole: bool, recorder: &mut Recorder) -> Result<String, Failure> {
    // The picture of a part replaces that of a whole run no more than its rows do.
    let path = if is_whole { path.to_path_buf() } else { partial(path) };
    write_picture(&path, &figure(recorder))?;
    Ok(path.display().to_string())
}

/// The picture of the shown variables.
fn figure(recorder: &mut Recorder) -> Figure {
    let (times, title): (Arc<[f64]>, String) = (recorder.times().into(), recorder.model().to_string());
    let curves = recorder.take_curves().map(|(shown, values)| {
        let curve = Curve { name: shown.column.name.clone(), run: 0, times: times.clone(), values };
        (shown.unit.clone(), curve)
    });
    Figure { title: Some(title), ..Figure::by_unit(Vec::new(), curves) }
}

//! `hyd simulate FILE`: translate, run, write results, draw, say what happened.
//!
//! A run that ends because rounding errors grow along a torn loop is done again with the loops whole.

use std::sync::Arc;

use hyd_compiler::{Compilation, Extras, FlatModel, Goal};
use hyd_report::{Curve, Figure};
use hyd_results::partial;
use hyd_run::{
    DONE_AGAIN, Facts, InputTable, Outcome, Recorder, Status, WHOLE_LOOPS, check_usage, finish, options, tell,
};
use hyd_runtime::SolveError;

use crate::arguments::Simulate;
use crate::picture::{check_picture, write_picture};
use crate::translate::{self, translate_with, with_whole_loops};
use crate::{Failure, clock, output, parameters, run_failure};

/// Runs the verb.
pub(crate) fn simulate(arguments: &Simulate) -> Result<(), Failure> {
    check_usage(&arguments.run, Some(&arguments.model.file))?;
    if let Some(path) = &arguments.plot {
        check_picture("--plot", path)?;
    }
    let begin = clock::cpu_seconds();
    let table = arguments.run.inputs.read()?;
    let driven = table.as_ref().map(InputTable::names).unwrap_or_default();
    let extras = Extras { driven: &driven, ..Extras::default() };
    let compilation = translate_with(&arguments.model, Goal::Run, &extras).inspect_err(|_| {
        if arguments.run.json {
            let _ = output::print("{\"status\":\"rejected\"}\n");
        }
    })?;
    // Only now is it known which files are read; better here than after a long run.
    check_usage(&arguments.run, None)?;
    if let Some(path) = &arguments.plot {
        check_picture("--plot", path)?;
    }
    let mut compilation = compilation;
    let mut outcome = run((arguments, table.as_ref()), &compilation, begin, Vec::new())?;
    if outcome.result.as_ref().is_err_and(SolveError::may_be_rounding)
        && let Some(whole) = with_whole_loops(&compilation, &arguments.model.set)
    {
        let torn = compilation.model.replace(whole);
        let again = run(
            (arguments, table.as_ref()),
            &compilation,
            begin,
            vec![format!("{WHOLE_LOOPS}; the run was {DONE_AGAIN}")],
        )?;
        match again.result {
            Ok(_) => outcome = again,
            Err(_) => compilation.model = torn,
        }
    }
    let format = arguments.model.message_format;
    if let Some(path) = arguments.plot.as_ref().filter(|_| outcome.recorder.rows > 0) {
        // The picture of a part replaces that of a whole run no more than its rows do.
        let is_whole = matches!(outcome.summary.status, Status::Done | Status::Terminated);
        let path = if is_whole { path.clone() } else { partial(path) };
        write_picture(&path, &figure(&mut outcome.recorder))?;
        outcome.summary.plot = Some(path.display().to_string());
    }
    let printed = tell(&outcome.summary, arguments.run.json, format);
    let Err(error) = outcome.result else { return printed };
    Err(finish(&outcome.summary, error, &|error, kept| {
        let diagnostic = run_failure::diagnostic(error, &compilation.files, compilation.flat.as_deref(), kept);
        translate::report(&compilation.files, &[diagnostic], format);
    }))
}

/// One run; `warnings` are said of it beside its own.
fn run(
    (arguments, table): (&Simulate, Option<&InputTable>),
    compilation: &Compilation,
    begin: f64,
    mut warnings: Vec<String>,
) -> Result<Outcome, Failure> {
    let model = compilation.model.clone();
    let model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let model = model.on(arguments.run.backend.backend()).map_err(Failure::Fault)?;
    let mut system = model.instantiate();
    parameters::apply(&mut system, &arguments.model.set, &compilation.set_at_translation).map_err(Failure::Fault)?;
    let code = model.statistics();
    warnings.extend(model.fallback().map(|reason| format!("the code is interpreted: {reason}")));
    let experiment = InputTable::experiment(table, &model.payload().experiment, arguments.run.start);
    let options = options(&arguments.run, &experiment)?;
    if let Some(table) = table {
        let known = compilation.flat.as_deref().map(FlatModel::real_inputs).unwrap_or_default();
        warnings.extend(table.recorded(&mut system, (options.start, options.stop), &known)?.warnings);
        warnings.extend(table.left_over(arguments.run.stop, options.stop));
    }
    let facts = Facts {
        model: compilation.model_name.as_deref().unwrap_or_default().to_string(),
        templates: code.templates,
        code_bytes: code.code_bytes,
        translate_s: clock::cpu_seconds() - begin,
        warnings,
    };
    hyd_run::simulate(&mut system, &arguments.run, &options, facts, arguments.plot.is_some())
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

//! `hyd simulate FILE`: translate, run, write results, draw, say what happened.

use std::sync::Arc;

use hyd_compiler::Goal;
use hyd_report::{Curve, Figure};
use hyd_run::{Facts, Recorder, check_usage, finish, options, tell};

use crate::arguments::Simulate;
use crate::picture::{picture_format, write_picture};
use crate::translate::{self, translate};
use crate::{Failure, clock, output, parameters, run_failure};

/// Runs the verb.
pub(crate) fn simulate(arguments: &Simulate) -> Result<(), Failure> {
    check_usage(&arguments.run, Some(&arguments.model.file))?;
    if let Some(path) = &arguments.plot {
        picture_format(path)?;
    }
    let begin = clock::cpu_seconds();
    let compilation = translate(&arguments.model, Goal::Run).inspect_err(|_| {
        if arguments.run.json {
            let _ = output::print("{\"status\":\"rejected\"}\n");
        }
    })?;
    let model = compilation.model.clone();
    let model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let model = model.on(arguments.run.backend.backend()).map_err(Failure::Fault)?;
    let mut system = model.instantiate();
    parameters::apply(&mut system, &arguments.model.set, &compilation.set_at_translation).map_err(Failure::Fault)?;
    let code = model.statistics();
    let facts = Facts {
        model: compilation.model_name.as_deref().unwrap_or_default().to_string(),
        templates: code.templates,
        code_bytes: code.code_bytes,
        translate_s: clock::cpu_seconds() - begin,
        warnings: model.fallback().map(|reason| format!("the code is interpreted: {reason}")).into_iter().collect(),
    };
    let sensitivity = arguments.sensitivity.clone().unwrap_or_default().0;
    let options = options(&arguments.run, &model.payload().experiment, sensitivity)?;
    let drawn = arguments.plot.is_some();
    let mut outcome = hyd_run::simulate(&mut system, &arguments.run, &options, facts, drawn)?;
    if let Some(path) = arguments.plot.as_ref().filter(|_| outcome.recorder.rows > 0) {
        write_picture(path, &figure(&mut outcome.recorder))?;
        outcome.summary.plot = Some(path.display().to_string());
    }
    let format = arguments.model.message_format;
    let printed = tell(&outcome.summary, arguments.run.json, format);
    let Err(error) = outcome.result else { return printed };
    Err(finish(&outcome.summary, error, &|error, kept| {
        let diagnostic = run_failure::diagnostic(error, &compilation.files, compilation.flat.as_deref(), kept);
        translate::report(&compilation.files, &[diagnostic], format);
    }))
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

//! `hyd sweep FILE --vary NAME=VALUES ... --result DIR`: many runs on all cores, resumable; `hyd sweep merge DIR` joins shards.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use hyd_compiler::{CompiledModel, Extras, FlatModel, Goal};
use hyd_ensemble::Plan;
use hyd_run::{InputTable, Recorded, Subject, WholeLoops, join, override_plan, prepare, read_plan};
use hyd_system::DaeSystem;

use crate::arguments::{ModelArguments, Sweep};
use crate::translate::{translate_with, with_whole_loops};
use crate::{Failure, output, parameters};

/// Runs the verb.
pub(crate) fn sweep(arguments: &Sweep) -> Result<(), Failure> {
    if arguments.file.as_os_str() == "merge" {
        let folder = arguments.folder.as_ref();
        return join(folder.ok_or_else(|| Failure::Usage("hyd sweep merge DIR: which folder?".to_string()))?);
    }
    if let Some(folder) = &arguments.folder {
        return Err(Failure::Usage(format!(
            "`{}` is one argument too many; results go to --result DIR",
            folder.display()
        )));
    }
    let (plan, file) = plan(arguments)?;
    let prepared = prepare(&arguments.sweep, plan)?;
    let table = arguments.sweep.inputs.read()?;
    let driven = table.as_ref().map(InputTable::names).unwrap_or_default();
    let extras = Extras { driven: &driven, ..Extras::default() };
    let compilation = translate_with(&model_arguments(arguments, prepared.plan(), file), Goal::Run, &extras)?;
    let model = compilation.model.clone();
    let model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let set: Vec<(String, String)> = prepared.plan().set.clone().into_iter().collect();
    let experiment = InputTable::experiment(table.as_ref(), &model.payload().experiment, None);
    let recorded = match &table {
        Some(table) => {
            let known = compilation.flat.as_deref().map(FlatModel::real_inputs).unwrap_or_default();
            table.recorded(&mut model.instantiate(), prepared.span(&experiment)?, &known)?
        }
        None => Recorded::default(),
    };
    for warning in &recorded.warnings {
        output::sentence("warning", warning, arguments.sweep.message_format);
    }
    let make = || {
        let mut system = model.instantiate();
        parameters::apply(&mut system, &set, &compilation.set_at_translation)?;
        recorded.hand_over(&mut system)?;
        Ok(Box::new(system) as Box<dyn DaeSystem>)
    };
    let payload = model.payload();
    let limits = &payload.parameters.limits;
    // Translated once, by whichever run needs it first.
    let whole: OnceLock<Option<Arc<CompiledModel>>> = OnceLock::new();
    let make_whole = || {
        let model = whole.get_or_init(|| with_whole_loops(&compilation, &set)).as_ref()?;
        let mut system = model.instantiate();
        parameters::apply(&mut system, &set, &compilation.set_at_translation).ok()?;
        recorded.hand_over(&mut system).ok()?;
        Some(Box::new(system) as Box<dyn DaeSystem>)
    };
    let whole_loops = if payload.has_torn_loops() { WholeLoops::Made(&make_whole) } else { WholeLoops::Needless };
    let sources = payload.identity.sources ^ table.as_ref().map_or(0, InputTable::fingerprint);
    let subject = Subject { sources, experiment, limits, make: &make, whole_loops };
    prepared.run(&subject, "hyd sweep merge")
}

/// The plan of the file or of the options, and the model's file.
fn plan(arguments: &Sweep) -> Result<(Plan, PathBuf), Failure> {
    let is_plan = arguments.file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let (mut plan, mut file) = (Plan::default(), arguments.file.clone());
    if is_plan {
        plan = read_plan(&arguments.file)?;
        let path = arguments.file.display();
        let model = plan.model.clone();
        let model = model.ok_or_else(|| Failure::Fault(format!("`{path}` names no model (model = \"FILE\")")))?;
        let folder = arguments.file.parent().unwrap_or(Path::new(""));
        file = arguments.libraries.file_of(folder, &model).map_err(Failure::Fault)?;
    }
    plan.class = arguments.model.clone().or(plan.class);
    override_plan(&mut plan, &arguments.sweep);
    Ok((plan, file))
}

fn model_arguments(arguments: &Sweep, plan: &Plan, file: PathBuf) -> ModelArguments {
    ModelArguments {
        file,
        model: plan.class.clone(),
        parameters: None,
        set: plan.set.clone().into_iter().collect(),
        libraries: arguments.libraries.clone(),
        strict_units: false,
        message_format: arguments.sweep.message_format,
    }
}

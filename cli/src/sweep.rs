//! `hyd sweep FILE --vary NAME=VALUES ... --result DIR`: many runs on all cores, resumable, with `--on` on other machines; `hyd sweep merge DIR`
//! joins shards, `hyd sweep cancel DIR` ends what `--on` has submitted.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use hyd_compiler::{Extras, Goal};
use hyd_ensemble::Plan;
use hyd_run::{InputTable, Line, Prepared, Subject, interrupt, join, override_plan, prepare, read_plan};
use hyd_verbs::share_out::{Model, Shared, Sharing, cancel, share_out};
use hyd_verbs::sweep::sweep as sweep_model;
use serde_json::json;

use crate::arguments::{ModelArguments, Sweep};
use crate::build::LAUNCHER;
use crate::terminal::Terminal;
use crate::translate::translate_with;
use crate::{Failure, output};

/// What joins shards.
const MERGE: &str = "hyd sweep merge";

/// Runs the verb.
pub(crate) fn sweep(arguments: &Sweep) -> Result<(), Failure> {
    if arguments.file.as_os_str() == "merge" {
        let folder = arguments.folder.as_ref();
        return join(folder.ok_or_else(|| Failure::Usage("hyd sweep merge DIR: which folder?".to_string()))?);
    }
    if arguments.file.as_os_str() == "cancel" {
        let folder = arguments.folder.as_ref();
        let folder = folder.ok_or_else(|| Failure::Usage("hyd sweep cancel DIR: which folder?".to_string()))?;
        return output::print(&cancel(folder)?);
    }
    if let Some(folder) = &arguments.folder {
        return Err(Failure::Usage(format!(
            "`{}` is one argument too many; results go to --result DIR",
            folder.display()
        )));
    }
    let (own, threads) = (&arguments.engine, arguments.sweep.threads.map(NonZeroUsize::get));
    let (shards, how) = (arguments.shards.map(NonZeroUsize::get), (arguments.resume, own.settle));
    let sharing = Sharing::read(own.on.as_deref(), shards, how, threads)?;
    let (plan, file) = plan(arguments)?;
    let prepared = prepare(&arguments.sweep, plan)?;
    let table = arguments.sweep.inputs.read()?;
    let driven = table.as_ref().map(InputTable::names).unwrap_or_default();
    let extras = Extras { driven: &driven, ..Extras::default() };
    let varied: Vec<String> = prepared.plan().vary.iter().map(|own| own.parameter.clone()).collect();
    let compilation = translate_with(&model_arguments(arguments, prepared.plan(), file), Goal::Run, &extras, &varied)?;
    let set: Vec<(String, String)> = prepared.plan().set.clone().into_iter().collect();
    let terminal = Terminal(arguments.sweep.message_format);
    sweep_model((&compilation, &set), table.as_ref(), &prepared, &terminal, |subject| match &sharing {
        None => prepared.run(subject, MERGE),
        Some(sharing) => {
            let launcher = || LAUNCHER.read(&prepared.root().join("submission"));
            let model = Model { compilation: &compilation, set: &set, table: table.as_ref(), launcher: &launcher };
            shared(&model, &prepared, subject, sharing, &terminal)
        }
    })
}

/// Shares the sweep out; when all is there it is as if it had been run here.
fn shared(
    model: &Model<'_>,
    prepared: &Prepared<'_>,
    subject: &Subject<'_>,
    sharing: &Sharing,
    terminal: &Terminal,
) -> Result<(), Failure> {
    interrupt::listen();
    let line = Line::default();
    let progress = |done: usize, all: usize| line.show(done, all);
    let shared = share_out(model, (prepared, subject), sharing, terminal, &progress, &interrupt::requested);
    line.wipe();
    match shared? {
        Shared::All(before) => prepared.collect(subject, before, MERGE),
        Shared::Ready(shards, command) if prepared.is_json() => {
            let object = json!({"status": "ready", "shards": shards, "command": command});
            output::print(&format!("{object}\n"))
        }
        Shared::Ready(shards, command) => {
            let (command, last) = (command.join(" "), shards - 1);
            let root = prepared.root().display();
            output::print(&format!(
                "{shards} shards are ready; I from 0 to {last}:\n  {command} I\n  `{MERGE} {root}` joins them when all are done\n"
            ))
        }
    }
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
        file = arguments.libraries.libraries().file_of(folder, &model).map_err(Failure::Fault)?;
    }
    plan.class = arguments.model.clone().or(plan.class);
    override_plan(&mut plan, &arguments.sweep)?;
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

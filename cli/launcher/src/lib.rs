//! What every executable of `hyd build` is: finds the model at the end of its own file, checks it, runs it.
//!
//! The program is made once, with the workspace; an executable is a copy of it with a payload behind.  It needs no other file, no
//! compiler and no environment.  Exit codes are those of `hyd`: 0 done, 1 the model or the data is at fault, 2 wrong usage, 3 the
//! solver gave up or was stopped.

pub mod arguments;
pub mod habits;
mod help;

use std::ffi::OsString;
use std::mem::ManuallyDrop;
use std::path::Path;
use std::process::ExitCode;
use std::sync::{Arc, OnceLock};

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches};
use hyd_payload::{Backend, Loaded, Model, executable, format};
use hyd_run::{
    Beside, Facts, Failure, InputTable, MessageFormat, Prepared, REBUILD, Recorded, ShardOf, Subject, WholeLoops,
    clock, output, parameter_file, parameters,
};
use hyd_runtime::SolveError;
use hyd_system::DaeSystem;

use arguments::{Run, Shard, Sweep};

/// By this `hyd build` knows which payloads the program reads.
#[used]
static MARK: [u8; executable::LAUNCHER_MARK.len()] = {
    let mut mark = [0; executable::LAUNCHER_MARK.len()];
    mark.copy_from_slice(executable::LAUNCHER_MARK);
    mark
};

/// Runs the program with its arguments, the first being its name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let begin = clock::cpu_seconds();
    let mut arguments: Vec<OsString> = arguments.into_iter().collect();
    let name = program_name(arguments.first());
    let bytes = match own_payload() {
        Ok(bytes) => bytes,
        Err(reason) => return Failure::Fault(reason).report(MessageFormat::Text),
    };
    let backend = habits::backend(&arguments);
    let model = bytes.and_then(|bytes| format::read(&bytes, backend == Backend::Native));
    let model = match model {
        Ok(model) => model,
        Err(format::FormatError::Foreign) => {
            let text = "this is the launcher of hyd and holds no model, or the file was cut off; `hyd build FILE -o EXE` \
                        makes an executable";
            return Failure::Fault(text.to_string()).report(MessageFormat::Text);
        }
        Err(error) => return Failure::Fault(format!("`{name}` cannot run: {error}")).report(MessageFormat::Text),
    };
    let loaded = match Loaded::new(model, backend) {
        // It lives as long as the process, which gives back all of its memory at once and not name by name.
        Ok(loaded) => ManuallyDrop::new(Arc::new(loaded)),
        Err(reason) => return Failure::Fault(format!("`{name}` cannot run: {reason}")).report(MessageFormat::Text),
    };
    let verb = arguments.get(1).and_then(|verb| verb.to_str()).map(str::to_string);
    match verb.as_deref() {
        Some("sweep") => {
            arguments.remove(1);
            sweep(&arguments, &name, &loaded)
        }
        Some("shard") => {
            arguments.remove(1);
            share(&arguments, &name, &loaded, backend)
        }
        _ => single(&arguments, &name, &loaded, begin),
    }
}

fn program_name(first: Option<&OsString>) -> String {
    let stem = first.and_then(|path| Path::new(path).file_name());
    stem.map_or_else(|| "model".to_string(), |stem| stem.to_string_lossy().into_owned())
}

fn own_payload() -> Result<Result<Vec<u8>, format::FormatError>, String> {
    let path = std::env::current_exe().map_err(|error| format!("this program cannot find its own file: {error}"))?;
    hyd_run::note_read(&path);
    let bytes = std::fs::File::open(&path).and_then(|mut program| executable::payload(&mut program));
    bytes.map_err(|error| format!("`{}` cannot be read: {error}", path.display()))
}

/// Reads the command line; prints help and messages itself.  `texts` are the head and the foot of the help, made only where it is
/// shown: the list of a model's parameters takes longer than many a run.
fn parse<T: CommandFactory + FromArgMatches>(
    arguments: &[OsString],
    name: &str,
    texts: impl Fn() -> (String, String),
) -> Result<T, ExitCode> {
    let read = |command: clap::Command| {
        let parsed = command.bin_name(name.to_string()).try_get_matches_from(arguments);
        parsed.and_then(|matches| T::from_arg_matches(&matches))
    };
    let parsed = read(T::command()).or_else(|error| match error.kind() {
        ErrorKind::DisplayHelp => {
            let (about, after) = texts();
            read(T::command().about(about).after_help(after))
        }
        _ => Err(error),
    });
    parsed.map_err(|error| {
        // `--help` and `--version` come this way, too; a closed output is no reason to complain.
        let _ = error.print();
        ExitCode::from(if error.use_stderr() { 2 } else { 0 })
    })
}

fn single(arguments: &[OsString], name: &str, loaded: &Arc<Loaded>, begin: f64) -> ExitCode {
    let arguments = match habits::rewrite(arguments) {
        Ok(arguments) => arguments,
        Err(reason) => return Failure::Usage(reason).report(MessageFormat::Text),
    };
    let texts = || (help::about(&loaded.model), help::parameters(loaded));
    let arguments = match parse::<Run>(&arguments, name, texts) {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    match simulate(&arguments, loaded, begin) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(arguments.message_format),
    }
}

fn simulate(arguments: &Run, loaded: &Arc<Loaded>, begin: f64) -> Result<(), Failure> {
    if arguments.version {
        return output::print(&help::version(&loaded.model));
    }
    hyd_run::check_usage(&arguments.run, None)?;
    let mut set = match &arguments.parameters {
        Some(path) => parameter_file::read(path)?,
        None => Vec::new(),
    };
    set.extend(arguments.set.iter().cloned());
    let table = arguments.run.inputs.read()?;
    let experiment = InputTable::experiment(table.as_ref(), &loaded.model.experiment, arguments.run.start);
    let options = hyd_run::options(&arguments.run, &experiment)?;
    let mut system = loaded.instantiate();
    let recorded = recorded(table.as_ref(), &mut system, (options.start, options.stop))?;
    let cut = table.as_ref().and_then(|table| table.left_over(arguments.run.stop, options.stop));
    set_parameters(&mut system, loaded, &set, options.start)?;
    let facts = Facts {
        model: loaded.model.tables.model.to_string(),
        templates: loaded.model.identity.templates as usize,
        code_bytes: loaded.engine.code_bytes,
        translate_s: clock::cpu_seconds() - begin,
        warnings: fallback(loaded).into_iter().chain(recorded.warnings).chain(cut).collect(),
        unit: None,
    };
    let outcome = hyd_run::simulate(&mut system, &arguments.run, &options, facts, Beside::command(false))?;
    let format = arguments.message_format;
    let printed = hyd_run::tell(&outcome.summary, arguments.run.json, format);
    let Err(error) = outcome.result else { return printed };
    Err(hyd_run::finish(&outcome.summary, error, &|error: &SolveError, kept| {
        output::sentence("error", &error.to_string(), format);
        if error.may_be_of_loops() && loaded.model.has_torn_loops() {
            output::sentence("note", REBUILD, format);
        }
        if let Some(kept) = kept {
            output::sentence("note", &kept, format);
        }
    }))
}

/// Hands recorded inputs to a system.
fn recorded(
    table: Option<&InputTable>,
    system: &mut hyd_payload::Instance,
    span: (f64, f64),
) -> Result<Recorded, Failure> {
    let names: Vec<String> = system.structure().inputs.iter().map(|site| site.name.to_string()).collect();
    match table {
        Some(_) if names.is_empty() => {
            let reason =
                "the executable was built without recorded inputs; `hyd build FILE --input NAME -o EXE` names them";
            Err(Failure::Usage(format!("--input: {reason}")))
        }
        Some(table) => table.recorded(system, span, &names),
        None if names.is_empty() => Ok(Recorded::default()),
        None => {
            Err(Failure::Usage(format!("the inputs {} are recorded: --input DATA.csv is needed", names.join(", "))))
        }
    }
}

fn fallback(loaded: &Loaded) -> Option<String> {
    loaded.engine.fallback.as_ref().map(|reason| format!("the code is interpreted: {reason}"))
}

/// Sets parameters and refuses values outside of their limits.
fn set_parameters(
    system: &mut hyd_payload::Instance,
    loaded: &Loaded,
    set: &[(String, String)],
    start: f64,
) -> Result<(), Failure> {
    parameters::apply(system, set, &[]).map_err(Failure::Fault)?;
    if set.is_empty() {
        return Ok(());
    }
    // Where values make no sense the run will say so.
    if system.bind(start).is_err() {
        return Ok(());
    }
    match parameters::outside(&loaded.model.parameters.limits, system) {
        Some(reason) => Err(Failure::Fault(reason)),
        None => Ok(()),
    }
}

fn sweep(arguments: &[OsString], name: &str, loaded: &Arc<Loaded>) -> ExitCode {
    let about = || format!("Runs {} many times with varied parameters, on all cores", loaded.model.tables.model);
    let arguments = match parse::<Sweep>(arguments, &format!("{name} sweep"), || (about(), String::new())) {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    match many(&arguments, name, loaded) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(arguments.sweep.message_format),
    }
}

fn many(arguments: &Sweep, name: &str, loaded: &Arc<Loaded>) -> Result<(), Failure> {
    if arguments.plan.as_ref().is_some_and(|plan| plan.as_os_str() == "merge") {
        let folder = arguments.folder.as_ref();
        return hyd_run::join(folder.ok_or_else(|| Failure::Usage(format!("{name} sweep merge DIR: which folder?")))?);
    }
    let mut plan = match &arguments.plan {
        Some(path) => hyd_run::read_plan(path)?,
        None => hyd_run::Plan::default(),
    };
    check_class(&plan, &loaded.model)?;
    hyd_run::override_plan(&mut plan, &arguments.sweep)?;
    let prepared = hyd_run::prepare(&arguments.sweep, plan)?;
    let set: Vec<(String, String)> = prepared.plan().set.clone().into_iter().collect();
    let table = arguments.sweep.inputs.read()?;
    let warn = |sentence: &str| output::sentence("warning", sentence, arguments.sweep.message_format);
    let advised = if loaded.model.has_torn_loops() { WholeLoops::Advised } else { WholeLoops::Needless };
    swept((loaded, &set, table.as_ref()), &prepared, &warn, advised, |subject| {
        prepared.run(subject, &format!("{name} sweep merge"))
    })
}

/// Hands `work` the model as the subject of many runs.
fn swept(
    (loaded, set, table): (&Arc<Loaded>, &[(String, String)], Option<&InputTable>),
    prepared: &Prepared<'_>,
    warn: &dyn Fn(&str),
    whole_loops: WholeLoops<'_>,
    work: impl FnOnce(&Subject<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let experiment = InputTable::experiment(table, &loaded.model.experiment, None);
    let span = prepared.span(&experiment)?;
    let mut first = loaded.instantiate();
    let recorded = recorded(table, &mut first, span)?;
    recorded.warnings.iter().for_each(|warning| warn(warning));
    // Values that hold for all runs are refused before the first of them.
    set_parameters(&mut first, loaded, set, span.0)?;
    let make = || made(loaded, set, &recorded);
    let model = &loaded.model;
    let limits = &model.parameters.limits;
    let sources = model.identity.sources ^ table.map_or(0, InputTable::fingerprint);
    work(&Subject { sources, experiment, limits, make: &make, whole_loops })
}

/// A system ready but for what varies.
fn made(loaded: &Arc<Loaded>, set: &[(String, String)], recorded: &Recorded) -> Result<Box<dyn DaeSystem>, String> {
    let mut system = loaded.instantiate();
    parameters::apply(&mut system, set, &[])?;
    recorded.hand_over(&mut system)?;
    Ok(Box::new(system) as Box<dyn DaeSystem>)
}

fn share(arguments: &[OsString], name: &str, loaded: &Arc<Loaded>, backend: Backend) -> ExitCode {
    let about = || format!("Works off a share of a sweep of {} that was shared out", loaded.model.tables.model);
    let arguments = match parse::<Shard>(arguments, &format!("{name} shard"), || (about(), String::new())) {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    match shard(&arguments, loaded, backend) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(MessageFormat::Text),
    }
}

fn shard(arguments: &Shard, loaded: &Arc<Loaded>, backend: Backend) -> Result<(), Failure> {
    let share = ShardOf::find(&arguments.folder, arguments.index, arguments.threads)?;
    let manifest = &share.submission.manifest;
    let own = format!("{:016x}", loaded.model.identity.sources);
    if manifest.sources != own {
        let (wanted, model) = (&manifest.sources, &manifest.model);
        let sentence = format!("the sweep is one of {model} (texts {wanted}), and this is another model (texts {own})");
        return Err(Failure::Fault(sentence));
    }
    // Read by whichever run needs it first.
    let whole: OnceLock<Option<Arc<Loaded>>> = OnceLock::new();
    let prepared = share.prepare()?;
    let table = share.table.as_ref();
    let span = prepared.span(&InputTable::experiment(table, &loaded.model.experiment, None))?;
    let inputs = recorded(table, &mut loaded.instantiate(), span)?;
    let make_whole = || {
        let read = || {
            let model = format::read(share.whole_loops.as_ref()?, backend == Backend::Native).ok()?;
            Loaded::new(model, backend).ok().map(Arc::new)
        };
        made(whole.get_or_init(read).as_ref()?, &share.set, &inputs).ok()
    };
    let whole_loops = if loaded.model.has_torn_loops() { WholeLoops::Made(&make_whole) } else { WholeLoops::Needless };
    // What is to be said of the inputs has been said where the sweep was shared out.
    swept((loaded, &share.set, table), &prepared, &|_| {}, whole_loops, |subject| prepared.run_shard(subject))
}

/// A plan for another class is not for this executable.
fn check_class(plan: &hyd_run::Plan, model: &Model) -> Result<(), Failure> {
    match &plan.class {
        Some(class) if **class != *model.tables.model => {
            let own = &model.tables.model;
            Err(Failure::Fault(format!("the plan is for `{class}`, and this is an executable of `{own}`")))
        }
        _ => Ok(()),
    }
}

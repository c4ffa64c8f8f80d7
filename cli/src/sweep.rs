//! `hyd sweep FILE --vary NAME=VALUES ... --result DIR`: many runs on all cores, resumable; `hyd sweep merge DIR` joins shards.
//!
//! The command line and a plan file say the same things; options override the plan.  The folder remembers which sweep it
//! holds (plan and texts of the model), completes it when called again, and refuses another one.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use hyd_compiler::{Compilation, Goal};
use hyd_ensemble::{Folder, Job, Kept, Members, MergeError, Method, Plan, PlanError, Report, Shard, merge, run};
use hyd_results::is_variable;
use hyd_runtime::Options;
use hyd_system::{DaeSystem, VariableInfo};
use serde_json::json;

use crate::arguments::{DrawMethod, ModelArguments, Sweep};
use crate::selection::Selection;
use crate::text_file::read_text;
use crate::translate::translate;
use crate::{Failure, interrupt, output, parameters};

/// Members per chunk: few enough that little is lost by a kill, many enough that files are not tiny.
const CHUNK: usize = 32;

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
    let members = plan.members().map_err(|error| usage(&error))?;
    let shard = match arguments.shard.as_deref().map(Shard::parse) {
        None => Shard::WHOLE,
        Some(Some(shard)) => shard,
        Some(None) => return Err(Failure::Usage("--shard: expected I/N with I from 0 to N-1".to_string())),
    };
    let root = arguments.result.as_ref();
    let root = root.ok_or_else(|| Failure::Usage("--result DIR is needed: the folder of the results".to_string()))?;
    let selection = Selection::new(plan.variables.as_deref())?;
    let compilation = translate(&model_arguments(arguments, &plan, file), Goal::Run)?;
    let identity = format!("{} {:016x}", plan.canonical(), fingerprint(&compilation));
    let open = || {
        let opened = Folder::open(root, &identity, members.count(), CHUNK);
        opened.map_err(|error| Failure::Fault(error.to_string()))
    };
    let (folder, report) = work(arguments, &plan, &members, &compilation, &selection, (&open, shard))?;
    finish(arguments, &folder, shard, report)
}

fn usage(error: &PlanError) -> Failure {
    Failure::Usage(error.to_string())
}

/// The plan of the file or of the options, and the model's file.
fn plan(arguments: &Sweep) -> Result<(Plan, PathBuf), Failure> {
    let is_plan = arguments.file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let (mut plan, mut file) = (Plan::default(), arguments.file.clone());
    if is_plan {
        let path = arguments.file.display();
        let text = read_text(&arguments.file).map_err(|error| Failure::Fault(error.to_string()))?;
        plan = Plan::parse(&text).map_err(|error| Failure::Fault(format!("`{path}`: {error}")))?;
        let model = plan.model.clone();
        let model = model.ok_or_else(|| Failure::Fault(format!("`{path}` names no model (model = \"FILE\")")))?;
        file = arguments.file.parent().unwrap_or(Path::new("")).join(model);
    }
    plan.class = arguments.model.clone().or(plan.class);
    plan.set.extend(arguments.set.iter().cloned());
    plan.samples = arguments.samples.or(plan.samples);
    plan.seed = arguments.seed.unwrap_or(plan.seed);
    plan.stop = arguments.stop.or(plan.stop);
    plan.tolerance = arguments.tolerance.or(plan.tolerance);
    plan.intervals = arguments.intervals.or(plan.intervals);
    plan.variables = arguments.variables.clone().or(plan.variables);
    plan.rows |= arguments.rows;
    plan.method = match arguments.method {
        Some(DrawMethod::Lhs) => Method::Lhs,
        Some(DrawMethod::Random) => Method::Random,
        None => plan.method,
    };
    let vary = arguments.vary.iter().cloned();
    plan.vary.extend(vary.map(|(parameter, values)| hyd_ensemble::Vary { parameter, values }));
    Ok((plan, file))
}

fn model_arguments(arguments: &Sweep, plan: &Plan, file: PathBuf) -> ModelArguments {
    ModelArguments {
        file,
        model: plan.class.clone(),
        set: plan.set.clone().into_iter().collect(),
        libraries: crate::arguments::LibraryArguments { library: arguments.libraries.library.clone() },
        message_format: arguments.message_format,
    }
}

/// A number that is another one, all but surely, when a text of the model is (Fowler, Noll, Vo: FNV-1a).
fn fingerprint(compilation: &Compilation) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let files = &compilation.files;
    for byte in files.ids().flat_map(|file| files.text(file).bytes()) {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
    hash
}

fn work(
    arguments: &Sweep,
    plan: &Plan,
    members: &Members,
    compilation: &Compilation,
    selection: &Selection,
    (open, shard): (&dyn Fn() -> Result<Folder, Failure>, Shard),
) -> Result<(Folder, Report), Failure> {
    let model = compilation.model.clone();
    let model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let set: Vec<(String, String)> = plan.set.clone().into_iter().collect();
    let make = || {
        let mut system = model.instantiate();
        parameters::apply(&mut system, &set, &compilation.set_at_translation).map(|()| system)
    };
    let system = make().map_err(Failure::Fault)?;
    let names: Vec<String> = plan.vary.iter().map(|vary| vary.parameter.clone()).collect();
    let places = names.iter().map(|name| parameters::varied(system.tables(), name));
    let places = places.collect::<Result<Vec<_>, String>>().map_err(Failure::Fault)?;
    let keep = |variable: &VariableInfo, name: &str| match selection.is_explicit() {
        true => selection.matches(name),
        false => is_variable(variable, name),
    };
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let options = options(plan, compilation)?;
    // Only now, so that a command that is refused leaves no folder behind.
    let folder = open()?;
    let job = Job {
        members,
        names,
        places,
        system: &|| match make() {
            Ok(system) => Box::new(system) as Box<dyn DaeSystem>,
            // The same call has just succeeded with the same values.
            Err(_) => Box::new(model.instantiate()),
        },
        options,
        keep: &keep,
        kept: if plan.rows { Kept::Rows } else { Kept::Final },
        folder: &folder,
        shard,
        threads: arguments.threads.map_or(cores, std::num::NonZeroUsize::get),
    };
    interrupt::listen();
    let line = Line::new();
    let report = run(&job, &|done, all| line.show(done, all), &interrupt::requested);
    line.wipe();
    let report = report.map_err(|error| Failure::Fault(format!("results cannot be written: {error}")))?;
    Ok((folder, report))
}

fn options(plan: &Plan, compilation: &Compilation) -> Result<Options, Failure> {
    let experiment = compilation.flat.as_ref().map(|flat| flat.experiment.clone()).unwrap_or_default();
    let start = experiment.start.unwrap_or(0.0);
    let mut options = Options::new(start, plan.stop.or(experiment.stop).unwrap_or(start + 1.0));
    options.tolerance = plan.tolerance.or(experiment.tolerance).unwrap_or(options.tolerance);
    // Without rows only the end counts.
    options.intervals = plan.intervals.unwrap_or(if plan.rows { options.intervals } else { 1 });
    options.check().map_err(|error| Failure::Usage(error.to_string()))?;
    Ok(options)
}

fn finish(arguments: &Sweep, folder: &Folder, shard: Shard, report: Report) -> Result<(), Failure> {
    let mut files: Vec<String> = Vec::new();
    let mut whole = false;
    if !report.interrupted {
        match merge(folder) {
            Ok(written) => {
                whole = true;
                files = written.iter().map(|path| path.display().to_string()).collect();
            }
            Err(MergeError::Missing(..)) if shard != Shard::WHOLE => {}
            Err(error) => return Err(Failure::Fault(error.to_string())),
        }
    }
    let Report { members, before, now, failed, interrupted } = report;
    let text = if arguments.json {
        let status = if interrupted { "interrupted" } else { "done" };
        let object = json!({"status": status, "members": members, "before": before, "now": now, "failed": failed,
            "complete": whole, "files": files});
        format!("{object}\n")
    } else {
        let earlier = if before > 0 { format!(", {before} of them before") } else { String::new() };
        let mut text = format!("{} of {members} runs done{earlier}; {failed} failed\n", before + now);
        files.iter().for_each(|file| text.push_str(&format!("  results in {file}\n")));
        if !whole && !interrupted {
            text.push_str("  other shards are missing; `hyd sweep merge` joins them when they are there\n");
        }
        text
    };
    output::print(&text)?;
    if interrupted {
        return Err(Failure::Solver("interrupted; the same command goes on where it was stopped".to_string()));
    }
    Ok(())
}

fn join(root: &Path) -> Result<(), Failure> {
    let folder = Folder::existing(root).map_err(|error| Failure::Fault(error.to_string()))?;
    let files = merge(&folder).map_err(|error| Failure::Fault(error.to_string()))?;
    let mut text = format!("{} runs joined\n", folder.members());
    files.iter().for_each(|file| text.push_str(&format!("  results in {}\n", file.display())));
    output::print(&text)
}

/// The line of progress: members done and time left, on a terminal only.
struct Line {
    state: Mutex<(Instant, usize)>,
    begin: Instant,
    active: bool,
}

impl Line {
    const PERIOD: Duration = Duration::from_millis(200);

    fn new() -> Self {
        let now = Instant::now();
        Self { state: Mutex::new((now, usize::MAX)), begin: now, active: io::stderr().is_terminal() }
    }

    fn show(&self, done: usize, all: usize) {
        let Ok(mut state) = self.state.lock() else { return };
        // What was done before this call takes no time now.
        let first = if state.1 == usize::MAX { done.saturating_sub(1) } else { state.1 };
        state.1 = first;
        if !self.active || state.0.elapsed() < Self::PERIOD {
            return;
        }
        state.0 = Instant::now();
        let rate = (done - first) as f64 / self.begin.elapsed().as_secs_f64().max(1e-3);
        let left = (all - done) as f64 / rate.max(1e-9);
        // A terminal that cannot be written to shows no progress; the runs go on.
        let _ = write!(io::stderr(), "\r\u{1b}[K{done} of {all} runs, {left:.0} s left");
    }

    fn wipe(&self) {
        if self.active {
            let _ = write!(io::stderr(), "\r\u{1b}[K");
        }
    }
}

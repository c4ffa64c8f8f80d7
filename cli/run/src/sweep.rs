//! Many runs of one system: the plan of options and file, work on all cores, resumable, summary; joining the parts of shards.
//!
//! The command line and a plan file say the same things; options override the plan.  The folder remembers which sweep it
//! holds (plan and texts of the model), completes it when called again, and refuses another one.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use hyd_ensemble::{
    Folder, Job, Kept, Measure, Members, MergeError, Method, Places, Plan, PlanError, Report, Shard, merge, run,
};
use hyd_payload::{Experiment, Limit};
use hyd_results::{columns, is_variable};
use hyd_runtime::Options;
use hyd_system::{DaeSystem, ValueKind, VariableInfo};
use serde_json::json;

use crate::arguments::{DrawMethod, SweepArguments};
use crate::selection::Selection;
use crate::simulate::stated_intervals;
use crate::whole_loops::{REBUILD, runs_done_again};
use crate::{Failure, interrupt, output, parameter_file, parameters};

/// Longest text of a plan (bytes): reading it takes fifty times as much memory.
const LONGEST_PLAN: usize = 4 << 20;
/// Reasons of failed runs that are shown.
const MOST_REASONS: usize = 3;

/// What is run many times.
pub struct Subject<'a> {
    /// A number that is another one, all but surely, when a text of the model is.
    pub sources: u64,
    /// When the model runs if nobody says otherwise.
    pub experiment: Experiment,
    /// The limits of its parameters.
    pub limits: &'a [Limit],
    /// Makes a system, ready but for the varied parameters.
    pub make: &'a (dyn Fn() -> Result<Box<dyn DaeSystem>, String> + Sync),
    /// What is done where a torn loop may be at fault.
    pub whole_loops: WholeLoops<'a>,
}

/// What is done where a loop may not be solvable one variable after the other.
pub enum WholeLoops<'a> {
    /// Nothing: there is no such loop.
    Needless,
    /// Runs are done again by systems with whole loops; none where that cannot be translated.
    Made(&'a (dyn Fn() -> Option<Box<dyn DaeSystem>> + Sync)),
    /// Without a compiler the user is told what to do.
    Advised,
}

/// A sweep that makes sense as far as can be told without a model.
pub struct Prepared<'a> {
    arguments: &'a SweepArguments,
    plan: Plan,
    shard: Shard,
    root: &'a Path,
    selection: Selection,
    role: Role,
}

/// What a sweep does with its folder.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Role {
    /// Opens it, and joins the chunks where they are all there.
    Alone,
    /// Finds it as it was made by who shares the sweep out, and leaves joining to them.
    Shard,
}

/// A sweep that makes sense with its model.
struct Ready {
    names: Vec<String>,
    places: Places,
    members: Members,
    measures: Vec<Measure>,
    options: Options,
}

/// Reads a plan.
///
/// # Errors
/// A sentence.
pub fn read_plan(path: &Path) -> Result<Plan, Failure> {
    let text = crate::read_text(path).map_err(|error| Failure::Fault(error.to_string()))?;
    if text.len() > LONGEST_PLAN {
        let sentence =
            format!("`{}` has more than {} MB, which is too long for a plan", path.display(), LONGEST_PLAN >> 20);
        return Err(Failure::Fault(sentence));
    }
    Plan::parse(&text).map_err(|error| Failure::Fault(format!("`{}`: {error}", path.display())))
}

/// Puts the options over a plan.
///
/// # Errors
/// The file of parameters cannot be read or holds what is not a value.
pub fn override_plan(plan: &mut Plan, arguments: &SweepArguments) -> Result<(), Failure> {
    if let Some(path) = &arguments.parameters {
        // A fit writes all of its parameters, and one of them may be what varies.
        let is_varied = |name: &String| {
            plan.vary
                .iter()
                .map(|own| &own.parameter)
                .chain(arguments.vary.iter().map(|own| &own.0))
                .any(|own| own == name)
        };
        let given: Vec<_> = parameter_file::read(path)?.into_iter().filter(|(name, _)| !is_varied(name)).collect();
        plan.set.extend(given);
    }
    plan.set.extend(arguments.set.iter().cloned());
    plan.samples = arguments.samples.or(plan.samples);
    plan.seed = arguments.seed.unwrap_or(plan.seed);
    plan.stop = arguments.stop.or(plan.stop);
    plan.tolerance = arguments.tolerance.or(plan.tolerance);
    plan.intervals = arguments.intervals.or(plan.intervals);
    plan.variables = arguments.variables.clone().or(plan.variables.take());
    plan.rows |= arguments.rows;
    plan.measure.extend(arguments.measure.iter().cloned());
    plan.method = match arguments.method {
        Some(DrawMethod::Lhs) => Method::Lhs,
        Some(DrawMethod::Random) => Method::Random,
        None => plan.method,
    };
    let vary = arguments.vary.iter().cloned();
    plan.vary.extend(vary.map(|(parameter, values)| hyd_ensemble::Vary { parameter, values }));
    Ok(())
}

/// Checks what can be checked without a model.
///
/// # Errors
/// Wrong usage.
pub fn prepare(arguments: &SweepArguments, plan: Plan) -> Result<Prepared<'_>, Failure> {
    plan.check().map_err(usage)?;
    if let Some(own) = plan.vary.iter().find(|own| plan.set.contains_key(&own.parameter)) {
        let sentence = format!("`{}` is varied and set; a parameter is one or the other", own.parameter);
        return Err(Failure::Usage(sentence));
    }
    let shard = match arguments.shard.as_deref().map(Shard::parse) {
        None => Shard::WHOLE,
        Some(Some(shard)) => shard,
        Some(None) => return Err(Failure::Usage("--shard: expected I/N with I from 0 to N-1".to_string())),
    };
    let root = arguments.result.as_deref();
    let root = root.ok_or_else(|| Failure::Usage("--result DIR is needed: the folder of the results".to_string()))?;
    let selection = Selection::new(plan.variables.as_deref())?;
    Ok(Prepared { arguments, plan, shard, root, selection, role: Role::Alone })
}

/// A plan that makes no sense is wrong usage.
fn usage(error: PlanError) -> Failure {
    Failure::Usage(error.to_string())
}

impl Prepared<'_> {
    /// The same for a shard of a sweep that was shared out: the folder must be there, and nothing is joined.
    pub(crate) fn into_shard(self) -> Self {
        Self { role: Role::Shard, ..self }
    }

    /// The folder of the results.
    pub fn root(&self) -> &Path {
        self.root
    }

    /// Is the summary asked for as JSON?
    pub fn is_json(&self) -> bool {
        self.arguments.json
    }

    /// What is to be done.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Start and stop of the runs (s).
    ///
    /// # Errors
    /// Wrong usage.
    pub fn span(&self, experiment: &Experiment) -> Result<(f64, f64), Failure> {
        options(&self.plan, experiment).map(|options| (options.start, options.stop))
    }

    /// Runs the share and says what came out.  `command`: what joins shards.
    ///
    /// # Errors
    /// A parameter that cannot be varied, a folder of another sweep, results that cannot be written, Ctrl-C.
    pub fn run(&self, subject: &Subject<'_>, command: &str) -> Result<(), Failure> {
        interrupt::listen();
        let line = Line::default();
        let swept = self.work(subject, &|done, all| line.show(done, all), &interrupt::requested);
        line.wipe();
        self.tell(subject, swept?, command)
    }

    /// Collects what others have run, `before` members of it before this command, and says what came out.
    ///
    /// # Errors
    /// As [`Prepared::run`].
    pub fn collect(&self, subject: &Subject<'_>, before: usize, command: &str) -> Result<(), Failure> {
        let mut swept = self.work(subject, &|_, _| {}, &interrupt::requested)?;
        swept.credit(before);
        self.tell(subject, swept, command)
    }

    fn tell(&self, subject: &Subject<'_>, swept: Swept, command: &str) -> Result<(), Failure> {
        let report = &swept.report;
        if report.whole_loops > 0 {
            output::sentence("warning", &runs_done_again(report.whole_loops), self.arguments.message_format);
        }
        for (severity, sentence) in failures_told(report) {
            output::sentence(severity, &sentence, self.arguments.message_format);
        }
        self.advise(subject, report);
        self.finish(&swept, command)
    }

    /// Runs the share without a word, and joins the chunks where they are all there.  `progress` gets the numbers of members done and of
    /// the whole share.
    ///
    /// # Errors
    /// As [`Prepared::run`]; runs that fail stand in the report, and so does that `stop` ended the work.
    pub fn work(
        &self,
        subject: &Subject<'_>,
        progress: &(dyn Fn(usize, usize) + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Swept, Failure> {
        let Ready { names, places, members, measures, options } = self.ready(subject)?;
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
        let keep = |variable: &VariableInfo, name: &str| self.keeps(variable, name);
        let start = options.start;
        // Where values make no sense the run says so itself.
        let refuse = |system: &mut dyn DaeSystem| match subject.limits.is_empty() || system.bind(start).is_err() {
            true => None,
            false => parameters::outside(subject.limits, system),
        };
        // Only now, so that a command that is refused leaves no folder behind.
        let folder = self.open(subject, members.count())?;
        let whole_loops = || {
            let WholeLoops::Made(make) = &subject.whole_loops else { return None };
            let system = make()?;
            let places = names.iter().map(|name| parameters::varied(system.tables(), name).map(|(_, places)| places));
            let places = places.collect::<Result<Vec<_>, String>>().ok()?;
            Some((system, places))
        };
        let job = Job {
            members: &members,
            names: names.clone(),
            places,
            refuse: &refuse,
            // The same call has just succeeded with the same values.
            system: &|| (subject.make)().expect("invariant: systems are made of the same values every time"),
            whole_loops: &whole_loops,
            options,
            keep: &keep,
            kept: if self.plan.rows { Kept::Rows } else { Kept::Final },
            measures,
            folder: &folder,
            shard: self.shard,
            threads: self.arguments.threads.map_or(cores, std::num::NonZeroUsize::get),
        };
        let report = run(&job, progress, stop);
        let report = report.map_err(|error| Failure::Fault(format!("results cannot be written: {error}")))?;
        let mut files = None;
        if !report.interrupted && self.role != Role::Shard {
            match merge(&folder) {
                Ok(written) => files = Some(written),
                Err(MergeError::Missing(..)) if self.shard != Shard::WHOLE => {}
                Err(error) => return Err(Failure::Fault(error.to_string())),
            }
        }
        Ok(Swept { report, files })
    }

    /// Checks a sweep that is to be shared out, and gives its number of runs.
    ///
    /// # Errors
    /// As [`Prepared::work`], before the first run.
    pub fn count(&self, subject: &Subject<'_>) -> Result<usize, Failure> {
        if self.shard != Shard::WHOLE {
            return Err(Failure::Usage("--shard: a share of a sweep is not shared out again".to_string()));
        }
        self.ready(subject).map(|ready| ready.members.count())
    }

    /// Opens the folder of a sweep of so many runs that is to be shared out to so many shards.
    ///
    /// # Errors
    /// It cannot be made, or holds another sweep.
    pub fn shared(&self, subject: &Subject<'_>, members: usize, shards: usize) -> Result<Folder, Failure> {
        let folder = Folder::open_shared(self.root, &self.identity(subject), members, shards);
        folder.map_err(|error| Failure::Fault(error.to_string()))
    }

    fn identity(&self, subject: &Subject<'_>) -> String {
        format!("{} {:016x}", self.plan.canonical(), subject.sources)
    }

    fn open(&self, subject: &Subject<'_>, members: usize) -> Result<Folder, Failure> {
        let folder = match self.role {
            Role::Alone => Folder::open(self.root, &self.identity(subject), members),
            Role::Shard => Folder::existing(self.root),
        };
        let folder = folder.map_err(|error| Failure::Fault(error.to_string()))?;
        if folder.members() != members {
            let (root, own) = (self.root.display(), folder.members());
            return Err(Failure::Fault(format!(
                "`{root}` holds a sweep of {own} runs, and the plan asks for {members}"
            )));
        }
        Ok(folder)
    }

    fn keeps(&self, variable: &VariableInfo, name: &str) -> bool {
        match self.selection.is_explicit() {
            true => self.selection.matches(name),
            false => is_variable(variable, name),
        }
    }

    /// Checks all that can be checked before the first run.
    fn ready(&self, subject: &Subject<'_>) -> Result<Ready, Failure> {
        let plan = &self.plan;
        let system = (subject.make)().map_err(Failure::Fault)?;
        let names: Vec<String> = plan.vary.iter().map(|vary| vary.parameter.clone()).collect();
        let varied = names.iter().map(|name| parameters::varied(system.tables(), name));
        let varied = varied.collect::<Result<Vec<_>, String>>().map_err(Failure::Fault)?;
        let (kinds, places): (Vec<ValueKind>, Vec<_>) = varied.into_iter().unzip();
        let members = plan.members(&kinds).map_err(usage)?;
        let keep = |variable: &VariableInfo, name: &str| self.keeps(variable, name);
        if let Some(pattern) = plan.variables.as_deref().filter(|_| columns(system.tables(), keep).is_empty()) {
            return Err(Failure::Usage(format!("no variable of the model matches `{pattern}`")));
        }
        let measures = plan.measures().map_err(usage)?;
        let unknown = measures.iter().try_for_each(|measure| measure.resolve(system.tables()).map(|_| ()));
        unknown.map_err(|error| Failure::Usage(error.to_string()))?;
        let options = options(plan, &subject.experiment)?;
        Ok(Ready { names, places, members, measures, options })
    }

    fn finish(&self, swept: &Swept, command: &str) -> Result<(), Failure> {
        let Report { before, now, failed, interrupted, .. } = swept.report;
        let text = if self.arguments.json {
            format!("{}\n", swept.json())
        } else {
            let mut text = swept.text();
            if swept.files.is_none() && !interrupted {
                text.push_str(&format!("  other shards are missing; `{command}` joins them when they are there\n"));
            }
            text
        };
        let hopeless = failed > 0 && failed == before + now;
        output::print(&text)?;
        if interrupted {
            return Err(Failure::Solver("interrupted; the same command goes on where it was stopped".to_string()));
        }
        // A run that fails is a result; where all do, model or plan are wrong, and a script must see it.
        if hopeless { Err(Failure::Reported) } else { Ok(()) }
    }

    /// What is to be done about torn loops that may be at fault, where there is no compiler.
    fn advise(&self, subject: &Subject<'_>, report: &Report) {
        if report.rounding > 0 && matches!(subject.whole_loops, WholeLoops::Advised) {
            let runs = if report.rounding == 1 { "1 run".to_string() } else { format!("{} runs", report.rounding) };
            output::sentence("note", &format!("{runs}: {REBUILD}"), self.arguments.message_format);
        }
    }
}

/// What came out of a share.
pub struct Swept {
    /// Numbers of runs, and why some failed.
    pub report: Report,
    /// The joined files: a row for each member, and all rows where they are kept; none while chunks are missing.
    pub files: Option<Vec<PathBuf>>,
}

impl Swept {
    /// What came out, for programs.
    pub fn json(&self) -> serde_json::Value {
        let Report { members, before, now, failed, failures, interrupted, whole_loops, .. } = &self.report;
        let status = if *interrupted { "interrupted" } else { "done" };
        json!({"status": status, "members": members, "before": before, "now": now, "failed": failed,
            "failures": failures.iter().map(failure_json).collect::<Vec<_>>(), "whole_loops": whole_loops,
            "complete": self.files.is_some(), "files": self.names()})
    }

    /// The same for people: how many runs, and where their results are.
    pub fn text(&self) -> String {
        let Report { members, before, now, failed, .. } = &self.report;
        let earlier = if *before > 0 { format!(", {before} of them before") } else { String::new() };
        let mut text = format!("{} of {members} runs done{earlier}; {failed} failed\n", before + now);
        self.names().iter().for_each(|file| text.push_str(&format!("  results in {file}\n")));
        text
    }

    fn names(&self) -> Vec<String> {
        self.files.iter().flatten().map(|path| path.display().to_string()).collect()
    }

    /// Only `before` of the runs that were found had been done before the command that others have worked for.
    pub fn credit(&mut self, before: usize) {
        let all = self.report.before + self.report.now;
        (self.report.before, self.report.now) = (before.min(all), all - before.min(all));
    }
}

/// The report on runs that failed: how many, as an error where all did, and the commonest reasons.
pub fn failures_told(report: &Report) -> Vec<(&'static str, String)> {
    let &Report { failed, ref failures, .. } = report;
    let hopeless = failed > 0 && failed == report.before + report.now;
    let mut told = match (failed, hopeless) {
        (0, _) => return Vec::new(),
        (1, true) => vec![("error", "the only run failed".to_string())],
        (_, true) => vec![("error", format!("all {failed} runs failed"))],
        (1, false) => vec![("warning", "1 run failed".to_string())],
        (_, false) => vec![("warning", format!("{failed} runs failed"))],
    };
    for hyd_ensemble::Failure { count, member, message } in failures.iter().take(MOST_REASONS) {
        let who = if *count == 1 { format!("member {member}") } else { format!("{count} such as member {member}") };
        told.push(("note", format!("{who}: {message}")));
    }
    if let Some(more @ 1..) = failures.len().checked_sub(MOST_REASONS) {
        told.push(("note", format!("{more} more reasons: column `message` of the results")));
    }
    told
}

fn failure_json(failure: &hyd_ensemble::Failure) -> serde_json::Value {
    json!({"count": failure.count, "member": failure.member, "message": failure.message})
}

fn options(plan: &Plan, experiment: &Experiment) -> Result<Options, Failure> {
    let start = experiment.start.unwrap_or(0.0);
    let mut options = Options::new(start, plan.stop.or(experiment.stop).unwrap_or(start + 1.0));
    options.tolerance = plan.tolerance.or(experiment.tolerance).unwrap_or(options.tolerance);
    // Without rows only the end counts.
    let stated = || stated_intervals(experiment, start, options.stop).unwrap_or(options.intervals);
    options.intervals = plan.intervals.unwrap_or_else(|| if plan.rows { stated() } else { 1 });
    options.within_steps = !plan.measure.is_empty();
    options.check().map_err(|error| Failure::Usage(error.to_string()))?;
    Ok(options)
}

/// Joins the parts of shards and says where the results are.
///
/// # Errors
/// A folder that holds no sweep, missing parts, files that cannot be written.
pub fn join(root: &Path) -> Result<(), Failure> {
    let folder = Folder::existing(root).map_err(|error| Failure::Fault(error.to_string()))?;
    let files = merge(&folder).map_err(|error| Failure::Fault(error.to_string()))?;
    let mut text = format!("{} runs joined\n", folder.members());
    files.iter().for_each(|file| text.push_str(&format!("  results in {}\n", file.display())));
    output::print(&text)
}

/// The line of progress: members done and time left, on a terminal only.
pub struct Line {
    state: Mutex<(Instant, usize)>,
    begin: Instant,
    active: bool,
}

impl Default for Line {
    /// Nothing is shown yet.
    fn default() -> Self {
        let now = Instant::now();
        Self { state: Mutex::new((now, usize::MAX)), begin: now, active: io::stderr().is_terminal() }
    }
}

impl Line {
    const PERIOD: Duration = Duration::from_millis(200);

    /// So many are done.
    pub fn show(&self, done: usize, all: usize) {
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

    /// Nothing is shown any more.
    pub fn wipe(&self) {
        if self.active {
            let _ = write!(io::stderr(), "\r\u{1b}[K");
        }
    }
}

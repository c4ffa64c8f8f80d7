//! `hyd test PATH...`: models run against results that are stored beside them.
//!
//! `drive.hyd` is compared with `drive.expected.csv` in the tubes of `hyd compare`: what the stored result has must be met, what else the model
//! computes does not count.  Every model runs in a process of its own, so that one that crashes or takes too long is one line of the answer.
//! `--accept` stores what the models give now, with a picture of what changed.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use hyd_doc::html::escape;
use hyd_results::{Deviation, Table, deviations, write_whole};

use crate::arguments::Test;
use crate::{Failure, output};
use hyd_run::read_text;

/// What stored results are called: the model's file name with this ending.
const EXPECTED: &str = "expected.csv";
/// Jumps may lie this far apart, as a part of the time.
const WINDOW: f64 = 1e-4;
/// Variables that are drawn and named when they changed.
const SHOWN: usize = 3;
/// How often a run is looked after.
const GLANCE: Duration = Duration::from_millis(5);

/// What came of a model.
enum Verdict {
    /// It gives what is stored.
    Same,
    /// It gives something else, or nothing; a sentence and further lines.
    Different(Vec<String>),
    /// Nothing is stored.
    New,
    /// What it gives was stored; what changed.
    Stored(Vec<String>),
}

/// A model and what came of it.
struct Tested {
    file: PathBuf,
    verdict: Verdict,
    seconds: f64,
}

/// Runs the verb.
pub(crate) fn test(arguments: &Test) -> Result<(), Failure> {
    if !(arguments.tolerance >= 0.0 && arguments.tolerance.is_finite()) {
        return Err(Failure::Usage("--tolerance: expected a number that is not negative".to_string()));
    }
    if !(arguments.limit > 0.0 && arguments.limit.is_finite()) {
        return Err(Failure::Usage("--limit: expected a positive number of seconds".to_string()));
    }
    let files = models(&arguments.paths)?;
    let own = std::env::current_exe();
    let own = own.map_err(|error| Failure::Fault(format!("the place of this program is not known: {error}")))?;
    let folder = Folder::new()?;
    let next = AtomicUsize::new(0);
    let made: Mutex<Vec<Option<Tested>>> = Mutex::new((0..files.len()).map(|_| None).collect());
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let jobs = arguments.jobs.map_or(cores, std::num::NonZeroUsize::get).min(files.len());
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some(k) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&k| k < files.len()) {
                    let begin = Instant::now();
                    // Called as the picture of what changed is to call it.
                    let result = folder.0.join(k.to_string()).join("now.csv");
                    let verdict = one(arguments, &own, &files[k], &result);
                    let seconds = begin.elapsed().as_secs_f64();
                    let tested = Tested { file: files[k].clone(), verdict, seconds };
                    made.lock().unwrap_or_else(std::sync::PoisonError::into_inner)[k] = Some(tested);
                }
            });
        }
    });
    let made = made.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let tested: Vec<Tested> = made.into_iter().flatten().collect();
    if let Some(path) = &arguments.junit {
        write_whole(path, junit(&tested).as_bytes())
            .map_err(|error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display())))?;
    }
    output::print(&text(&tested))?;
    let is_done = |own: &Tested| matches!(own.verdict, Verdict::Same | Verdict::Stored(_));
    if tested.iter().all(is_done) { Ok(()) } else { Err(Failure::Reported) }
}

/// A folder for results, which goes with the command.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Self, Failure> {
        let path = std::env::temp_dir().join(format!("hyd-test-{}", std::process::id()));
        std::fs::create_dir_all(&path)
            .map_err(|error| Failure::Fault(format!("the folder `{}` cannot be made: {error}", path.display())))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed lies where the system clears up.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The models of these paths: files as they are, of folders those that have a stored result or say how long they run.
fn models(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut found = BTreeSet::new();
    for path in paths {
        if path.is_dir() {
            collect(path, &mut found)?;
        } else if path.exists() {
            found.insert(path.clone());
        } else {
            return Err(Failure::Fault(format!("there is no file or folder `{}`", path.display())));
        }
    }
    if found.is_empty() {
        let shown: Vec<String> = paths.iter().map(|path| format!("`{}`", path.display())).collect();
        return Err(Failure::Fault(format!(
            "no model to test in {}: none has a stored result (NAME.{EXPECTED}) or an annotation `experiment(StopTime = ...)`",
            shown.join(", ")
        )));
    }
    Ok(found.into_iter().collect())
}

fn collect(folder: &Path, found: &mut BTreeSet<PathBuf>) -> Result<(), Failure> {
    let wrong =
        |error: std::io::Error| Failure::Fault(format!("the folder `{}` cannot be read: {error}", folder.display()));
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        let (path, kind) = (entry.path(), entry.file_type().map_err(wrong)?);
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        // Links to folders are passed over, so that the search ends.
        if kind.is_dir() {
            collect(&path, found)?;
        } else if path.extension().is_some_and(|ending| ending == "hyd" || ending == "mo") {
            let runs = || read_text(&path).is_ok_and(|text| text.contains("experiment(") && text.contains("StopTime"));
            if expected(&path).exists() || runs() {
                found.insert(path);
            }
        }
    }
    Ok(())
}

/// Where the stored result of a model stands.
fn expected(model: &Path) -> PathBuf {
    model.with_extension(EXPECTED)
}

/// Runs a model and compares.
fn one(arguments: &Test, own: &Path, model: &Path, result: &Path) -> Verdict {
    let stored = expected(model);
    let different = |sentence: String| Verdict::Different(vec![sentence]);
    // Not noted as an input: what is accepted takes its place.
    let before = match stored.exists().then(|| Table::read(&stored)).transpose() {
        Ok(before) => before,
        Err(error) => return different(format!("`{}`: {error}", stored.display())),
    };
    let names = before.as_ref().map(names);
    let variables = match (&names, &arguments.variables) {
        (Some(names), None) => exactly(names),
        (_, Some(pattern)) => pattern.clone(),
        // The variables of the model itself, not those of its components.
        (None, None) => "^[^.]*$".to_string(),
    };
    if before.is_none() && !arguments.accept {
        return Verdict::New;
    }
    if let Err(lines) = simulate(arguments, own, (model, result), &variables) {
        return Verdict::Different(lines);
    }
    let now = match Table::read(result) {
        Ok(now) => now,
        Err(error) => return different(format!("the result cannot be read: {error}")),
    };
    let changes = before.as_ref().map_or_else(Vec::new, |before| changes(before, &now, arguments.tolerance));
    if before.is_some() && changes.is_empty() {
        return Verdict::Same;
    }
    let mut lines: Vec<String> = changes.iter().take(SHOWN).map(Change::words).collect();
    if changes.len() > SHOWN {
        lines.push(format!("and {} more", changes.len() - SHOWN));
    }
    if !arguments.accept {
        return Verdict::Different(lines);
    }
    if before.is_some() {
        let names: Vec<String> = changes.iter().filter_map(Change::drawn).take(SHOWN).collect();
        if !names.is_empty() {
            let picture = model.with_extension("changed.svg");
            let drawn = Command::new(own)
                .arg("plot")
                .args([&stored, &result.to_path_buf()])
                .args(["--variables", &exactly(&names), "--output"])
                .arg(&picture)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status();
            if drawn.is_ok_and(|status| status.success()) {
                lines.push(format!("before and now: {}", picture.display()));
            }
        }
    }
    let kept = std::fs::read(result).and_then(|bytes| write_whole(&stored, &bytes));
    match kept {
        Ok(()) => Verdict::Stored(lines),
        Err(error) => different(format!("`{}` cannot be written: {error}", stored.display())),
    }
}

/// Names of a result.
fn names(table: &Table) -> Vec<String> {
    table.names.iter().chain(table.constants.iter().map(|(name, _)| name)).cloned().collect()
}

/// A pattern for these names and no others.
fn exactly(names: &[String]) -> String {
    let list: Vec<String> = names.iter().map(|name| regex::escape(name)).collect();
    format!("^({})$", list.join("|"))
}

/// Runs the model in a process of its own, within the limit of time; else lines on why not.
fn simulate(arguments: &Test, own: &Path, (model, result): (&Path, &Path), variables: &str) -> Result<(), Vec<String>> {
    let mut command = Command::new(own);
    command.arg("simulate").arg(model).arg("--result").arg(result).args(["--variables", variables]);
    for library in &arguments.libraries.library {
        command.arg("--library").arg(library);
    }
    if arguments.libraries.allow_outside {
        command.arg("--allow-outside");
    }
    let messages = result.with_extension("messages");
    let made = result.parent().map_or(Ok(()), std::fs::create_dir_all);
    let said = made
        .and_then(|()| std::fs::File::create(&messages))
        .map_err(|error| vec![format!("no room for messages: {error}")])?;
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(said).spawn();
    let mut child = child.map_err(|error| vec![format!("the run cannot be begun: {error}")])?;
    let begin = Instant::now();
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if begin.elapsed().as_secs_f64() > arguments.limit => {
                // One that has just ended cannot be stopped, and need not.
                let _ = child.kill();
                let _ = child.wait();
                return Err(vec![format!("stopped after {} s (--limit)", arguments.limit)]);
            }
            Ok(None) => std::thread::sleep(GLANCE),
            Err(error) => return Err(vec![format!("the run cannot be followed: {error}")]),
        }
    };
    if status.success() {
        return Ok(());
    }
    let text = std::fs::read(&messages).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let error = text.lines().find(|line| line.starts_with("error")).or_else(|| text.lines().next());
    let place =
        text.lines().map(str::trim).find_map(|line| line.strip_prefix("┌─ ")).map(|place| format!("at {place}"));
    let error = error.map_or_else(|| format!("the run ended with {status}"), str::to_string);
    Err(std::iter::once(error).chain(place).collect())
}

/// A difference from what is stored.
enum Change {
    /// A variable leaves its tube.
    Value(Deviation),
    /// A variable that is stored is not there.
    Gone(String),
    /// The run covers another time: stored and now (s).
    Span((f64, f64), (f64, f64)),
}

impl Change {
    fn words(&self) -> String {
        match self {
            Change::Value(own) => format!(
                "{} differs by {:.3e}, {:.3e} of its range, at {} s",
                own.name,
                own.largest,
                own.relative(),
                own.time
            ),
            Change::Gone(name) => format!("there is no `{name}` any more"),
            Change::Span(before, now) => {
                format!("it runs from {} to {} s, and what is stored from {} to {} s", now.0, now.1, before.0, before.1)
            }
        }
    }

    /// The variable that shows it.
    fn drawn(&self) -> Option<String> {
        match self {
            Change::Value(own) => Some(own.name.clone()),
            Change::Gone(_) | Change::Span(..) => None,
        }
    }
}

/// Differences of a result from the one that is stored, the largest first.
fn changes(before: &Table, now: &Table, tolerance: f64) -> Vec<Change> {
    let span = |table: &Table| {
        (table.times.first().copied().unwrap_or(f64::NAN), table.times.last().copied().unwrap_or(f64::NAN))
    };
    let (of_before, of_now) = (span(before), span(now));
    let window = WINDOW * (of_before.1 - of_before.0);
    let mut found = Vec::new();
    let apart = |a: f64, b: f64| (a - b).abs() > window || a.is_nan() || b.is_nan();
    if apart(of_before.0, of_now.0) || apart(of_before.1, of_now.1) {
        found.push(Change::Span(of_before, of_now));
    }
    let known: BTreeSet<String> = names(now).into_iter().collect();
    found.extend(names(before).into_iter().filter(|name| !known.contains(name)).map(Change::Gone));
    let mut values = deviations(before, now, window);
    values.retain(|own| own.relative() > tolerance);
    values.sort_by(|a, b| b.relative().total_cmp(&a.relative()));
    found.extend(values.into_iter().map(Change::Value));
    found
}

/// A line a model, and what is to be done.
fn text(tested: &[Tested]) -> String {
    let mut text = String::new();
    let (mut failed, mut new) = (0, 0);
    for own in tested {
        let (word, lines): (&str, &[String]) = match &own.verdict {
            Verdict::Same => ("ok", &[]),
            Verdict::Different(lines) => {
                failed += 1;
                ("FAILED", lines)
            }
            Verdict::New => {
                new += 1;
                ("new", &[])
            }
            Verdict::Stored(lines) => ("stored", lines),
        };
        text.push_str(&format!("{word:<7} {} ({:.2} s)\n", own.file.display(), own.seconds));
        lines.iter().for_each(|line| text.push_str(&format!("        {line}\n")));
    }
    let count = tested.len();
    text.push_str(&format!("{count} model{}, {failed} failed", if count == 1 { "" } else { "s" }));
    text.push_str(&if new > 0 {
        format!(", {new} without a stored result (--accept stores one)\n")
    } else {
        "\n".to_string()
    });
    text
}

/// The answer for programs that gather tests: JUnit's XML.
fn junit(tested: &[Tested]) -> String {
    let failed = tested.iter().filter(|own| matches!(own.verdict, Verdict::Different(_))).count();
    let new = tested.iter().filter(|own| matches!(own.verdict, Verdict::New)).count();
    let seconds: f64 = tested.iter().map(|own| own.seconds).sum();
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"hyd test\" tests=\"{}\" failures=\"{failed}\" skipped=\"{new}\" time=\"{seconds:.3}\">\n",
        tested.len()
    );
    for own in tested {
        let name = escape(&own.file.display().to_string());
        text.push_str(&format!("  <testcase classname=\"hyd\" name=\"{name}\" time=\"{:.3}\">", own.seconds));
        match &own.verdict {
            Verdict::Same | Verdict::Stored(_) => {}
            Verdict::New => text.push_str("<skipped message=\"no stored result\"/>"),
            Verdict::Different(lines) => {
                // XML has no control characters.
                let line = |line: &String| escape(&line.replace(|c: char| c.is_control(), " "));
                let shown: Vec<String> = lines.iter().map(line).collect();
                let first = shown.first().cloned().unwrap_or_default();
                text.push_str(&format!("<failure message=\"{first}\">{}</failure>", shown.join("\n")));
            }
        }
        text.push_str("</testcase>\n");
    }
    text + "</testsuite>\n"
}

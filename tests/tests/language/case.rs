//! Reading cases, running them and saying how they differ from what is expected.
//!
//! Compilation is the one of the command (package folder of the main file, then the built-in library), in process.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use hyd::LibraryPath;
use hyd_compiler::{Compilation, Diagnostic, Files, Goal, Options, Severity, compile};
use hyd_results::{Side, Trajectory};
use hyd_runtime::{Options as SolveOptions, simulate};
use hyd_tests::models::root;
use hyd_tests::runs::{instance, on_grid};

use crate::closed_form;

/// A case that is not reached yet: `topic/name` and why.
pub(crate) type Known = (&'static str, &'static str);

/// A message: severity, line (0: none), code and text, as `error E0201: ...`.
type Said = (String, u32, String);

struct Value {
    variable: String,
    time: f64,
    value: f64,
    allowed: f64,
    text: String,
}

/// What the comments of a case say.
#[derive(Default)]
pub(crate) struct Expected {
    pub said: Vec<Said>,
    notes: bool,
    values: Vec<Value>,
    absent: Vec<String>,
    model: Option<String>,
    stop: Option<f64>,
    set: Vec<(String, String)>,
    pub run_error: Option<String>,
    stopped_at: Option<f64>,
    ok: bool,
}

/// The folder of the cases of this name (`language`, `stdlib`).
pub(crate) fn folder(name: &str) -> PathBuf {
    root().join("tests").join(name)
}

/// Every folder of cases is a known topic, and every case known to be open exists.
pub(crate) fn check_topics(folder: &Path, known: &[String], open: &[Known]) {
    let unknown: Vec<String> = entries(folder).iter().map(|p| name_of(p)).filter(|n| !known.contains(n)).collect();
    assert!(unknown.is_empty(), "no test for {unknown:?}");
    for (name, reason) in open {
        let path = folder.join(name);
        let exists = [path.clone(), path.with_extension("hyd"), path.with_extension("mo")].iter().any(|p| p.exists());
        assert!(exists && !reason.is_empty(), "{name} is listed as open and does not exist");
    }
}

/// Runs all cases of a topic and panics with all differences.
pub(crate) fn run_topic(folder: &Path, topic: &str, open: &[Known]) {
    let mut report = String::new();
    let cases = entries(&folder.join(topic));
    assert!(!cases.is_empty(), "no cases of {topic}");
    for path in cases {
        let name = format!("{topic}/{}", path.file_stem().unwrap_or_default().to_string_lossy());
        let found = std::panic::catch_unwind(|| differences(&path)).unwrap_or_else(|_| vec!["panicked".to_string()]);
        match (open.iter().find(|(known, _)| *known == name), found.is_empty()) {
            (None, true) => {}
            (Some((_, reason)), false) => println!("{name}: still open ({reason})"),
            (Some(_), true) => report += &format!("\n{name}: passes now; take it off the list KNOWN_OPEN\n"),
            (None, false) => report += &format!("\n{name}:\n  {}\n", found.join("\n  ")),
        }
    }
    assert!(report.is_empty(), "{report}");
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let list = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = list.map(|entry| entry.expect("listed").path()).collect();
    paths.retain(|path| path.is_dir() || is_text(path));
    paths.sort();
    paths
}

fn is_text(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "hyd" || extension == "mo")
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// All texts of a case, the main one first.
pub(crate) fn texts(path: &Path) -> Vec<(PathBuf, String)> {
    if path.is_file() {
        return vec![(path.to_path_buf(), read(path))];
    }
    let mut all = Vec::new();
    for inner in entries(path) {
        all.extend(texts(&inner));
    }
    all.sort_by_key(|(_, text)| !text.contains("// main file"));
    all
}

/// How a case differs from what it expects; empty if it does not.
fn differences(path: &Path) -> Vec<String> {
    let texts = texts(path);
    let mut expected = Expected::default();
    for (file, text) in &texts {
        expected.read(&name_of(file), text);
    }
    check(&texts[0].0, &texts[0].1, &expected)
}

/// Compiles a text as the main file `path` and compares with what is expected.
pub(crate) fn check(path: &Path, text: &str, expected: &Expected) -> Vec<String> {
    let asks = expected.ok || expected.run_error.is_some() || expected.stopped_at.is_some();
    if !asks && expected.said.is_empty() && expected.values.is_empty() && expected.absent.is_empty() {
        return vec!["expects nothing".to_string()];
    }
    let mut library = LibraryPath::new();
    library.add_main_file(path, text);
    let options = Options { model: expected.model.clone(), set: expected.set.clone(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut library, &name_of(path), text, &options);
    let mut report = expected.compare_messages(&compilation);
    let wants_run = asks || !expected.values.is_empty() || !expected.absent.is_empty();
    if report.is_empty() && wants_run {
        report =
            if compilation.has_errors() { vec!["nothing to run".into()] } else { expected.compare_run(&compilation) };
    }
    report
}

/// A message in the form of an expectation.
fn said(files: &Files, diagnostic: &Diagnostic) -> Said {
    let severity = match diagnostic.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    };
    let label = diagnostic.labels.iter().find(|label| label.primary).or(diagnostic.labels.first());
    let (file, line) = match label {
        Some(label) => {
            let name = files.name(label.span.file).to_string();
            (name.rsplit(['/', '\\']).next().unwrap_or_default().to_string(), files.location(label.span).line)
        }
        None => (String::new(), 0),
    };
    // Paths of files begin at the root of the repository, wherever that is.
    let message = diagnostic.message.replace(&format!("{}/", root().display()), "");
    (file, line, format!("{severity} {}: {message}", diagnostic.code))
}

fn shown((file, line, text): &Said) -> String {
    if *line == 0 { format!("without line: {text}") } else { format!("{file}:{line}: {text}") }
}

impl Expected {
    /// Adds what the comments of a text say.
    pub(crate) fn read(&mut self, file: &str, text: &str) {
        let mut waiting: Vec<String> = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let number = number as u32 + 1;
            let Some(at) = comment(line) else {
                self.said.extend(waiting.drain(..).map(|text| (file.to_string(), number, text)));
                continue;
            };
            let (before, comment) = (line[..at].trim(), line[at + 2..].trim());
            let message = ["error E", "warning ", "note N"].iter().any(|word| comment.starts_with(word));
            if message && comment.contains(" without line:") {
                self.said.push((String::new(), 0, comment.replacen(" without line:", ":", 1)));
            } else if message && before.is_empty() {
                waiting.push(comment.to_string());
            } else if !before.is_empty() {
                self.said.extend(waiting.drain(..).map(|text| (file.to_string(), number, text)));
                if message {
                    self.said.push((file.to_string(), number, comment.to_string()));
                }
            }
            self.setting(comment);
        }
        assert!(waiting.is_empty(), "{file}: no line below {waiting:?}");
        self.notes = self.said.iter().any(|(_, _, text)| text.starts_with("note "));
    }

    fn setting(&mut self, comment: &str) {
        let pair = |text: &str| {
            let (name, value) = text.split_once('=').unwrap_or_else(|| panic!("no `=` in `{text}`"));
            (name.trim().to_string(), value.trim().to_string())
        };
        if comment == "ok" {
            self.ok = true;
        }
        let Some((word, rest)) = comment.split_once(':') else { return };
        let rest = rest.trim();
        match word {
            "expect" => self.values.push(expectation(rest)),
            "absent" => self.absent.push(rest.to_string()),
            "model" => self.model = Some(rest.to_string()),
            "stop" => self.stop = Some(closed_form::value(rest)),
            "set" => self.set.push(pair(rest)),
            "run error" => self.run_error = Some(rest.to_string()),
            "stopped at" => self.stopped_at = Some(closed_form::value(rest)),
            _ => {}
        }
    }

    /// Messages that are missing and messages too many.
    fn compare_messages(&self, compilation: &Compilation) -> Vec<String> {
        let mut open: BTreeMap<Said, i32> = BTreeMap::new();
        for diagnostic in &compilation.diagnostics {
            if self.notes || diagnostic.severity != Severity::Note {
                *open.entry(said(&compilation.files, diagnostic)).or_default() += 1;
            }
        }
        for message in &self.said {
            *open.entry(message.clone()).or_default() -= 1;
        }
        let mut report = Vec::new();
        for (message, count) in &open {
            if *count < 0 {
                report.push(format!("missing  {}", shown(message)));
            } else if *count > 0 {
                report.push(format!("too much {}", shown(message)));
            }
        }
        report
    }

    /// Runs the model and compares the values.
    fn compare_run(&self, compilation: &Compilation) -> Vec<String> {
        let set: Vec<(&str, &str)> = self.set.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        let mut system = instance(compilation, &set);
        let mut rows = Trajectory::new();
        // As the command does: an event has a row before and a row after it.
        let options = SolveOptions { event_rows: true, ..on_grid(self.stop.unwrap_or(1.0), 500, 1e-8) };
        let result = simulate(&mut system, &options, &mut rows, &|| false);
        match (result, &self.run_error) {
            (Ok(_), None) => {}
            (Err(error), Some(part)) if error.to_string().contains(part) => {}
            (Ok(_), Some(part)) => return vec![format!("the run does not fail with `{part}`")],
            (Err(error), _) => return vec![format!("the run fails: {error}")],
        }
        let mut report = Vec::new();
        let end = rows.times().last().copied().unwrap_or(f64::NAN);
        if let Some(time) = self.stopped_at.filter(|time| (end - time).abs() >= 1e-6 || time.is_nan()) {
            report.push(format!("ends at {end} instead of {time}"));
        }
        report.extend(self.values.iter().filter_map(|expected| expected.difference(&rows)));
        let present = self.absent.iter().filter(|name| rows.series(name).is_some());
        report.extend(present.map(|name| format!("`{name}` exists")));
        report
    }
}

impl Value {
    fn difference(&self, rows: &Trajectory) -> Option<String> {
        let Some(series) = rows.series(&self.variable) else {
            return Some(format!("there is no variable `{}`", self.variable));
        };
        let actual = series.value(self.time, Side::After);
        let close = (actual - self.value).abs() <= self.allowed;
        (!close).then(|| format!("{}: is {actual}", self.text))
    }
}

/// `VARIABLE @ TIME = VALUE [rel R] [abs A]`
fn expectation(text: &str) -> Value {
    let (variable, rest) = text.split_once('@').unwrap_or_else(|| panic!("no `@` in `{text}`"));
    let (time, rest) = rest.split_once('=').unwrap_or_else(|| panic!("no `=` in `{text}`"));
    let (mut rest, mut rel, mut abs) = (rest.trim(), 1e-6, 1e-9);
    while let Some((before, number)) = rest.rsplit_once(' ') {
        match before.trim().rsplit_once(' ') {
            Some((value, "rel")) => (rest, rel) = (value, closed_form::value(number)),
            Some((value, "abs")) => (rest, abs) = (value, closed_form::value(number)),
            _ => break,
        }
    }
    let value = closed_form::value(rest);
    Value {
        variable: variable.trim().to_string(),
        time: closed_form::value(time),
        value,
        allowed: rel * value.abs() + abs,
        text: text.to_string(),
    }
}

/// Where `//` begins a comment: outside of strings.
fn comment(line: &str) -> Option<usize> {
    let mut inside = false;
    let bytes = line.as_bytes();
    for at in 0..bytes.len() {
        match bytes[at] {
            b'"' if at == 0 || bytes[at - 1] != b'\\' => inside = !inside,
            b'/' if !inside && bytes.get(at + 1) == Some(&b'/') => return Some(at),
            _ => {}
        }
    }
    None
}

#[test]
fn comments_are_read() {
    let mut expected = Expected::default();
    expected.read(
        "a.hyd",
        "// stop: 2\n// error E0201: one\n// error E0202: two\nReal x = y; // error E0203: three\n// ok",
    );
    let of = |line, text: &str| ("a.hyd".to_string(), line, text.to_string());
    assert_eq!(expected.said, [of(4, "error E0201: one"), of(4, "error E0202: two"), of(4, "error E0203: three")]);
    assert!(expected.ok && expected.stop == Some(2.0));
    let value = expectation("a.b[1] @ 0.5 = 2*exp(-1) rel 1e-3 abs 0");
    assert_eq!((value.variable.as_str(), value.time), ("a.b[1]", 0.5));
    assert!((value.allowed - 1e-3 * value.value).abs() < 1e-15 && (value.value - 0.7357588823428847).abs() < 1e-15);
}

#[test]
fn differences_are_seen() {
    let seen = |text: &str| {
        let mut expected = Expected::default();
        expected.read("m.hyd", text);
        check(Path::new("m.hyd"), text, &expected)
    };
    assert_eq!(seen("model M Real x = 2; end M;"), ["expects nothing"]);
    assert_eq!(seen("model M Real x = 2; end M; // expect: x @ 1 = 2"), Vec::<String>::new());
    assert_eq!(seen("model M Real x = 2; end M; // expect: x @ 1 = 3"), ["x @ 1 = 3: is 2"]);
    assert_eq!(seen("model M Real x = 2; end M; // expect: y @ 1 = 3"), ["there is no variable `y`"]);
    assert_eq!(seen("model M Real x = 2; end M; // absent: x"), ["`x` exists"]);
    assert_eq!(seen("model M Real x = y; end M; // ok").len(), 1);
    assert_eq!(seen("model M Real x = 2; end M; // error E0201: `y` is not declared").len(), 1);
}

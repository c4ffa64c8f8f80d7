//! What is called with a case, and what must hold; a target panics when it does not.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::time::{Duration, Instant};

use hyd::LibraryPath;
use hyd_compiler::{Diagnostic, Goal, Options, Sources, compile};
use hyd_discovery::{Bench, Fault, Setup, Study, Workshop};
use hyd_frames::Frame;
use hyd_results::{Table, Trajectory};
use hyd_runtime::Simulator;
use hyd_source::Files;
use hyd_system::DaeSystem;

use crate::texts::{frames, models, payloads, studies, tables};

/// A target.
pub(crate) struct Target {
    pub(crate) name: &'static str,
    /// Calls it; what it tells, as hashes.
    pub(crate) call: fn(&[u8]) -> Vec<u64>,
    /// What cases are made from.
    pub(crate) texts: fn() -> Vec<Vec<u8>>,
}

/// All targets.
pub(crate) const TARGETS: [Target; 8] = [
    Target { name: "front", call: front, texts: models },
    Target { name: "format", call: format, texts: models },
    Target { name: "doc", call: doc, texts: models },
    Target { name: "run", call: run, texts: models },
    Target { name: "results", call: results, texts: tables },
    Target { name: "frame", call: frame, texts: frames },
    Target { name: "payload", call: payload, texts: payloads },
    Target { name: "study", call: study, texts: studies },
];

/// Bytes of all messages of a case: some hundred with a few lines each.
const MESSAGES: usize = 1_000_000;

/// Seconds of a simulation.
const RUN: Duration = Duration::from_millis(300);

pub(crate) fn hash(value: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

/// A message without what differs from text to text: names in backticks and numbers.
fn feature(message: &str) -> u64 {
    let words = message.split('`').enumerate().filter(|(k, _)| k % 2 == 0).map(|(_, part)| part);
    let plain: String = words.flat_map(str::chars).filter(|c| !c.is_ascii_digit()).collect();
    hash(plain)
}

fn features(diagnostics: &[Diagnostic]) -> Vec<u64> {
    diagnostics.iter().map(|diagnostic| feature(&diagnostic.message)).collect()
}

fn compiled(case: &[u8], goal: Goal) -> hyd_compiler::Compilation {
    let text = String::from_utf8_lossy(case);
    let options = Options { model: None, set: Vec::new(), goal, clock: || 0.0 };
    let compilation = compile(&mut LibraryPath::new(), "case.hyd", &text, &options);
    // Messages must be printable, wherever they point, and short enough to be read.
    let messages = hyd_compiler::render::render(&compilation.files, &compilation.diagnostics, false);
    assert!(messages.len() < MESSAGES, "{} bytes of messages", messages.len());
    compilation
}

fn front(case: &[u8]) -> Vec<u64> {
    let compilation = compiled(case, Goal::Flat);
    let mut said = features(&compilation.diagnostics);
    said.push(u64::from(compilation.flat.is_some()));
    said
}

fn format(case: &[u8]) -> Vec<u64> {
    let text = String::from_utf8_lossy(case);
    let file = Files::new().add("case", "");
    let outcome = hyd_format::format(file, &text);
    let Some(formatted) = outcome.value else {
        assert!(!outcome.diagnostics.is_empty(), "refused without a message");
        let said: Vec<&str> = outcome.diagnostics.iter().map(|d| d.message.as_str()).collect();
        assert!(!said.iter().any(|message| message.starts_with("the formatter would")), "tokens have changed");
        return features(&outcome.diagnostics);
    };
    let again = hyd_format::format(file, &formatted);
    assert!(again.value.as_deref() == Some(&*formatted), "formatting is not idempotent");
    vec![hash(formatted.lines().map(|line| line.len() - line.trim_start().len()).collect::<Vec<_>>())]
}

fn doc(case: &[u8]) -> Vec<u64> {
    let text = String::from_utf8_lossy(case).into_owned();
    let library =
        hyd_doc::Library::new(vec![hyd_doc::Source { name: "case".into(), text, shown: true, order: Vec::new() }]);
    let page = hyd_doc::Page::default().html(&library);
    vec![hash((library.count(), library.examples().len(), page.len() / 4096))]
}

fn run(case: &[u8]) -> Vec<u64> {
    let compilation = compiled(case, Goal::Run);
    let mut said = features(&compilation.diagnostics);
    let Some(model) = compilation.model.filter(|_| !compilation.diagnostics.iter().any(is_error)) else { return said };
    let mut system = model.instantiate();
    let experiment = compilation.flat.as_ref().map(|flat| flat.experiment.clone()).unwrap_or_default();
    let start = experiment.start.unwrap_or(0.0);
    let mut options = hyd_runtime::Options::new(start, experiment.stop.unwrap_or(start + 1.0));
    options.tolerance = experiment.tolerance.unwrap_or(options.tolerance);
    let begin = Instant::now();
    let outcome = Simulator::new(system.structure())
        .run(&mut system, &options, &mut Trajectory::new(), &|| begin.elapsed() > RUN);
    said.push(outcome.map_or_else(|error| feature(&error.to_string()), |_| 1));
    said
}

fn is_error(diagnostic: &Diagnostic) -> bool {
    diagnostic.severity == hyd_compiler::Severity::Error
}

fn results(case: &[u8]) -> Vec<u64> {
    let csv = Table::parse(case).map(|table| table.names.len());
    let mat = Table::from_mat(case).map(|table| table.names.len());
    [csv, mat].map(|read| read.map_or_else(|error| feature(&error.to_string()), |names| names as u64)).to_vec()
}

/// A Parquet file, which the library behind can only read from a file.
fn frame(case: &[u8]) -> Vec<u64> {
    let path = std::env::temp_dir().join(format!("hyd-fuzz-{}.parquet", std::process::id()));
    if std::fs::write(&path, case).is_err() {
        return Vec::new();
    }
    let told = Frame::read(&path).map(|frame| frame.columns.len());
    let _ = std::fs::remove_file(&path);
    vec![told.map_or_else(|error| feature(&error.to_string()), |columns| columns as u64)]
}

/// A model in bytes whose length and check sum are right, so that what stands inside is read.
fn payload(case: &[u8]) -> Vec<u64> {
    let mut bytes = case.to_vec();
    hyd_payload::format::seal(&mut bytes);
    vec![hyd_payload::format::read(&bytes, false).map_or_else(|error| feature(&error.to_string()), |_| 1)]
}

/// A study, and after the first line of dashes a set.
fn study(case: &[u8]) -> Vec<u64> {
    match setup(case).and_then(|setup| unknowns(&setup)) {
        Err(fault) => vec![feature(&fault.to_string())],
        Ok(count) => vec![count as u64],
    }
}

/// Study and set put together, with masks applied.
pub(crate) fn setup(case: &[u8]) -> Result<Setup, Fault> {
    let text = String::from_utf8_lossy(case);
    let (study, bench) = text.split_once("\n-----\n").unwrap_or((&text, ""));
    let study = Study::parse(study)?;
    let mut shot = 0;
    let table = shot_table(&study);
    let mut read = |_: &str| -> Result<String, Fault> {
        shot += 1;
        Ok(table(shot))
    };
    let bench = Bench::parse(Path::new("set.json"), bench, &study, &mut read)?;
    Setup::new(study, bench, 1)
}

/// Rows of a table of a shot: a set with fewer than twenty is refused, however right it is.
const ROWS: usize = 40;

/// Makes the table of a shot that a study asks for: every channel goes up and comes back, with gaps.
fn shot_table(study: &Study) -> impl Fn(usize) -> String + use<> {
    let quoted = |name: &str| format!("\"{}\"", name.replace('"', "\"\""));
    let columns: Vec<String> =
        study.channels.keys().filter(|name| **name != study.shots.time).map(|name| quoted(name)).collect();
    let header = std::iter::once(quoted(&study.shots.time)).chain(columns.iter().cloned()).collect::<Vec<_>>();
    let (header, width) = (header.join(","), columns.len());
    move |shot| {
        let mut text = header.clone();
        for row in 0..ROWS {
            text += &format!("\n{}", row as f64 * 5e-4 - 2e-3);
            for column in 0..width {
                let value = (row.min(ROWS - row) * shot) as f64 * 1e-6;
                text += &if row == 7 + column { ",".to_string() } else { format!(",{value}") };
            }
        }
        text
    }
}

/// A model small enough to be translated for every case, with the names that the study of a new project has.
const DRIVE: &str = "model Drive\n  record Spring\n    parameter Real k = 1e4;\n  end Spring;\n  record Valve\n    \
    parameter Real m = 0.1;\n  end Valve;\n  record Friction\n    parameter Real d = 10;\n  end Friction;\n  \
    parameter Real p0 = 1e7;\n  Spring spring;\n  Valve valve;\n  Friction friction;\n  Real y(start = 0, fixed = true);\n  \
    Real p;\nequation\n  friction.d*der(y) = valve.m*p - spring.k*y;\n  p = p0;\nend Drive;\n";

/// How many unknowns the comparison of a small model with the shots has; conditions and nuisances are what makes them.
pub(crate) fn unknowns(setup: &Setup) -> Result<usize, Fault> {
    let sources = || -> Box<dyn Sources> { Box::new(LibraryPath::new()) };
    let workshop = Workshop {
        driven: Vec::new(),
        starts: Vec::new(),
        study: "bench.toml".to_string(),
        sources: &sources,
        preamble: DRIVE.to_string(),
        file: setup.study.file.clone(),
        class: "Drive".to_string(),
        channels: setup.expressions(),
        library_classes: [].into(),
        opaque: None,
        others: hyd_discovery::OtherFiles::default(),
    };
    let machine = setup.machine(workshop.translate(&[])?)?;
    Ok(setup.problem(&machine, &[])?.unknowns.len())
}

//! The conformance cases: models with published or independently computed values, and texts that must be rejected.
//!
//! `tests/language/conformance/NAME.mo` with `NAME.json` beside it.  For a model that simulates the sidecar has `model`, `stop` and
//! `references` (variable, time, value, reltol, abstol); it is run at tolerance 1e-8 with 500 intervals.  For a rejected one all
//! words of `mention_all` and one of `mention_any` must stand in the messages, which must mark one of `lines_any`.

use hyd::LibraryPath;
use hyd_compiler::{Compilation, Goal, Options, compile, render};
use hyd_results::{Side, Trajectory};
use hyd_runtime::simulate;
use hyd_tests::runs::{instance, on_grid};
use serde_json::Value as Json;

use crate::case::{Known, folder};

/// Cases not reached yet.  They must fail: who reaches one takes it off the list.
const OPEN: &[Known] = &[];

#[test]
fn conformance_cases() {
    let mut report = String::new();
    let list = std::fs::read_dir(folder("language").join("conformance")).expect("the folder exists");
    let mut paths: Vec<_> = list.map(|entry| entry.expect("listed").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    assert!(paths.len() >= 21, "cases are missing: {paths:?}");
    for path in paths {
        let sidecar: Json = serde_json::from_str(&std::fs::read_to_string(&path).expect("readable")).expect("JSON");
        let text = std::fs::read_to_string(path.with_extension("mo")).expect("readable");
        let name = sidecar["name"].as_str().expect("a name");
        let found = differences(&sidecar, &text);
        match (OPEN.iter().find(|(known, _)| *known == name), found.is_empty()) {
            (None, true) => {}
            (Some((_, reason)), false) => println!("{name}: still open ({reason}): {}", found[0]),
            (Some(_), true) => report += &format!("\n{name}: passes now; take it off the list OPEN\n"),
            (None, false) => report += &format!("\n{name}:\n  {}\n", found.join("\n  ")),
        }
    }
    assert!(report.is_empty(), "{report}");
}

fn differences(sidecar: &Json, text: &str) -> Vec<String> {
    let model = sidecar["model"].as_str().map(String::from);
    let options = Options { model, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut LibraryPath::new(), "case.mo", text, &options);
    match sidecar["expect"].as_str() {
        Some("simulates") => values(sidecar, &compilation),
        _ => rejection(sidecar, &compilation),
    }
}

fn values(sidecar: &Json, compilation: &Compilation) -> Vec<String> {
    if compilation.has_errors() {
        let first = compilation.diagnostics.iter().find(|d| d.severity == hyd_compiler::Severity::Error);
        return first.map(|d| format!("{}: {}", d.code, d.message)).into_iter().collect();
    }
    let mut system = instance(compilation, &[]);
    let mut rows = Trajectory::new();
    let options = on_grid(sidecar["stop"].as_f64().expect("a stop time"), 500, 1e-8);
    if let Err(error) = simulate(&mut system, &options, &mut rows, &|| false) {
        return vec![format!("the run fails: {error}")];
    }
    let mut report = Vec::new();
    let references = sidecar["references"].as_array().expect("references");
    assert!(!references.is_empty(), "no references");
    for reference in references {
        let number = |key: &str| reference[key].as_f64().expect("a number");
        let name = reference["variable"].as_str().expect("a name");
        let (time, value) = (number("time"), number("value"));
        let Some(series) = rows.series(name) else {
            report.push(format!("there is no variable `{name}`"));
            continue;
        };
        let actual = series.value(time, Side::After);
        let near = (actual - value).abs() <= number("reltol") * value.abs() + number("abstol");
        if !near {
            report.push(format!("{name} at {time} s: {actual} instead of {value}"));
        }
    }
    report
}

fn rejection(sidecar: &Json, compilation: &Compilation) -> Vec<String> {
    let text = render::render(&compilation.files, &compilation.diagnostics, false);
    if !compilation.has_errors() && (sidecar["exit"] != "any" || compilation.diagnostics.is_empty()) {
        return vec!["is not rejected".to_string()];
    }
    let texts = |key: &str| -> Vec<String> {
        let list = sidecar[key].as_array().map(Vec::as_slice).unwrap_or_default();
        list.iter().map(|item| item.as_str().expect("a text").to_string()).collect()
    };
    let mut report = Vec::new();
    report.extend(texts("mention_all").iter().filter(|w| !mentions(&text, w)).map(|w| format!("does not name {w}")));
    let any = texts("mention_any");
    if !any.is_empty() && !any.iter().any(|word| mentions(&text, word)) {
        report.push(format!("names none of {any:?}"));
    }
    let labels = compilation.diagnostics.iter().flat_map(|d| &d.labels);
    let marked: Vec<u64> = labels.map(|l| u64::from(compilation.files.location(l.span).line)).collect();
    let lines = sidecar["lines_any"].as_array().map(Vec::as_slice).unwrap_or_default();
    if !lines.is_empty() && !lines.iter().any(|line| line.as_u64().is_some_and(|line| marked.contains(&line))) {
        report.push(format!("marks lines {marked:?}"));
    }
    if !report.is_empty() {
        report.push(text);
    }
    report
}

/// Whether a word stands in the text as a whole word.
fn mentions(text: &str, word: &str) -> bool {
    let inside = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    let word_of_letters = word.chars().all(|c| c.is_alphanumeric() || c == '_');
    text.match_indices(word).any(|(at, _)| {
        let (before, after) = (text[..at].chars().next_back(), text[at + word.len()..].chars().next());
        !word_of_letters || !(inside(before) || inside(after))
    })
}

//! What the parser says of a text, as lines that a test can hold.

use hyd_source::{Diagnostic, Files};

fn render(files: &Files, diagnostic: &Diagnostic) -> String {
    let place = diagnostic.labels.iter().find(|l| l.primary).map(|l| files.location(l.span));
    let place = place.map_or_else(|| "-".into(), |at| format!("{}:{}", at.line, at.column));
    let mut text = format!("{} {place} {}", diagnostic.code, diagnostic.message);
    for label in diagnostic.labels.iter().filter(|l| !l.primary) {
        let at = files.location(label.span);
        text += &format!("\n  at {}:{} {}", at.line, at.column, label.message);
    }
    for note in &diagnostic.notes {
        text += &format!("\n  note: {note}");
    }
    text
}

pub(crate) fn messages(text: &str) -> String {
    let mut files = Files::new();
    let id = files.add("case.hyd", text);
    let outcome = crate::parse(id, text);
    outcome.diagnostics.iter().map(|d| render(&files, d)).collect::<Vec<_>>().join("\n")
}

#[track_caller]
pub(crate) fn check(text: &str, expected: &str) {
    assert_eq!(messages(text), expected, "\n--- text ---\n{text}");
}

//! What verbs have to say while they work: kept for the answer, and told as progress.

use std::cell::RefCell;

use hyd_compiler::render::{render, render_json};
use hyd_compiler::{Diagnostic, Files, Severity};
use hyd_verbs::Listener;
use serde_json::{Value, json};

use crate::progress::Progress;

/// Most messages of an answer.
const MOST: usize = 100;

/// Keeps messages.
pub(crate) struct Kept<'a> {
    progress: &'a Progress,
    messages: RefCell<Vec<Value>>,
    text: RefCell<String>,
}

impl<'a> Kept<'a> {
    pub(crate) fn new(progress: &'a Progress) -> Self {
        Self { progress, messages: RefCell::default(), text: RefCell::default() }
    }

    /// The messages as `--message-format json` has them, the first hundred; and how many there are.
    pub(crate) fn messages(&self) -> (Value, usize) {
        let messages = self.messages.borrow();
        (messages.iter().take(MOST).cloned().collect(), messages.len())
    }

    /// The messages as people read them.
    pub(crate) fn text(&self) -> String {
        self.text.borrow().clone()
    }
}

impl Listener for Kept<'_> {
    fn sentence(&self, severity: Severity, text: &str) {
        let word = match severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        };
        let text = text.trim_end();
        self.messages.borrow_mut().push(json!({"severity": word, "code": Value::Null, "message": text}));
        self.text.borrow_mut().push_str(&format!("{word}: {text}\n"));
    }

    fn diagnostics(&self, files: &Files, diagnostics: &[Diagnostic]) {
        let lines = render_json(files, diagnostics);
        self.messages.borrow_mut().extend(lines.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok()));
        self.text.borrow_mut().push_str(&render(files, diagnostics, false));
    }

    fn progress(&self, _seconds: f64, text: &str) {
        self.progress.step(text);
    }
}

//! Messages of compiler and solver as Python's exceptions and warnings.
//!
//! The classes of exceptions are Python's (`hyd/errors.py`); here they are filled: code, sentence, file, line, and the excerpt that the command
//! would print.

use std::sync::{Mutex, PoisonError};

use hyd_compiler::render::render;
use hyd_compiler::{Code, Diagnostic, Files, Severity};
use hyd_run::Failure;
use hyd_verbs::Listener;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// The Python module of exceptions.
const ERRORS: &str = "hyd.errors";

/// One message.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    pub(crate) severity: Severity,
    code: Option<String>,
    text: String,
    notes: Vec<String>,
    file: Option<String>,
    line: Option<usize>,
    column: Option<usize>,
    excerpt: Option<String>,
}

impl Message {
    /// A sentence without a place.
    pub(crate) fn sentence(severity: Severity, text: &str) -> Self {
        let (code, file, line, column, excerpt) = (None, None, None, None, None);
        Self { severity, code, text: text.trim_end().to_string(), notes: Vec::new(), file, line, column, excerpt }
    }

    /// A diagnostic with the place of its first primary mark.
    pub(crate) fn of(files: &Files, diagnostic: &Diagnostic) -> Self {
        let mark = diagnostic.labels.iter().find(|label| label.primary).or(diagnostic.labels.first());
        let place = mark.map(|label| (files.name(label.span.file).to_string(), files.location(label.span)));
        Self {
            severity: diagnostic.severity,
            code: Some(diagnostic.code.number().to_string()),
            text: diagnostic.message.clone(),
            notes: diagnostic.notes.clone(),
            file: place.as_ref().map(|(file, _)| file.clone()),
            line: place.as_ref().map(|(_, at)| at.line as usize),
            column: place.as_ref().map(|(_, at)| at.column as usize),
            excerpt: Some(render(files, std::slice::from_ref(diagnostic), false)),
        }
    }

    /// True for a message with this code.
    pub(crate) fn has(&self, code: Code) -> bool {
        self.code.as_deref() == Some(code.number())
    }

    /// True for a message about an input without a value that has one of these names.
    pub(crate) fn is_of_open_input(&self, names: &[String]) -> bool {
        self.has(Code::OpenInput)
            && hyd_verbs::first_name(&self.text).is_some_and(|own| names.iter().any(|name| name == own))
    }

    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("severity", name(self.severity))?;
        dict.set_item("code", &self.code)?;
        dict.set_item("message", &self.text)?;
        dict.set_item("notes", &self.notes)?;
        dict.set_item("file", &self.file)?;
        dict.set_item("line", self.line)?;
        dict.set_item("column", self.column)?;
        dict.set_item("excerpt", &self.excerpt)?;
        Ok(dict)
    }
}

fn name(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}

/// Keeps what verbs say, until it becomes an exception or warnings.
#[derive(Default)]
pub(crate) struct Kept {
    messages: Mutex<Vec<Message>>,
    progress: Mutex<Vec<(f64, String)>>,
}

impl Kept {
    /// What was said so far; it is handed over.
    pub(crate) fn take(&self) -> Vec<Message> {
        std::mem::take(&mut self.messages.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// How far the work has come since this was asked last.
    pub(crate) fn take_progress(&self) -> Vec<(f64, String)> {
        std::mem::take(&mut self.progress.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn push(&self, message: Message) {
        self.messages.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}

impl Listener for Kept {
    fn sentence(&self, severity: Severity, text: &str) {
        self.push(Message::sentence(severity, text));
    }

    fn diagnostics(&self, files: &Files, diagnostics: &[Diagnostic]) {
        diagnostics.iter().for_each(|diagnostic| self.push(Message::of(files, diagnostic)));
    }

    fn progress(&self, seconds: f64, text: &str) {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).push((seconds, text.to_string()));
    }
}

/// Gives warnings among messages to Python's warnings, as far as its filters let them through.
pub(crate) fn warn(py: Python<'_>, messages: &[Message]) -> PyResult<()> {
    let list = warnings(py, messages)?;
    if list.is_empty() {
        return Ok(());
    }
    py.import(ERRORS)?.call_method1("_warn", (list,)).map(|_| ())
}

/// The warnings and notes among messages, for the package to give them together with what the work has made.
pub(crate) fn warnings<'py>(py: Python<'py>, messages: &[Message]) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for message in messages.iter().filter(|message| message.severity != Severity::Error) {
        list.append(message.to_dict(py)?)?;
    }
    Ok(list)
}

/// The exception of work that a handler of a signal has ended: [`exception`] for Ctrl-C, else what the handler has raised.
pub(crate) fn stopped(
    py: Python<'_>,
    caught: PyErr,
    sentence: Option<&str>,
    messages: &[Message],
    run: Option<Py<PyAny>>,
) -> PyErr {
    match caught.is_instance_of::<PyKeyboardInterrupt>(py) {
        true => exception(py, "interrupted", sentence, messages, run),
        false => caught,
    }
}

/// The exception of messages with errors among them.
pub(crate) fn rejected(py: Python<'_>, messages: &[Message]) -> PyErr {
    exception(py, "model", None, messages, None)
}

/// The exception of a failure; `messages` were said before.
pub(crate) fn failed(py: Python<'_>, failure: &Failure, messages: &[Message]) -> PyErr {
    match failure {
        Failure::Reported | Failure::OutputClosed => exception(py, "model", None, messages, None),
        Failure::SolverReported => exception(py, "run", None, messages, None),
        Failure::Fault(sentence) => exception(py, "model", Some(sentence), messages, None),
        Failure::Usage(sentence) => exception(py, "usage", Some(sentence), messages, None),
        Failure::Solver(sentence) => exception(py, "run", Some(sentence), messages, None),
    }
}

/// An exception of this kind (`model`, `usage`, `run`, `interrupted`), with the run that was kept.
pub(crate) fn exception(
    py: Python<'_>,
    kind: &str,
    sentence: Option<&str>,
    messages: &[Message],
    run: Option<Py<PyAny>>,
) -> PyErr {
    let made = || {
        let list = PyList::empty(py);
        for message in messages {
            list.append(message.to_dict(py)?)?;
        }
        py.import(ERRORS)?.call_method1("_exception", (kind, sentence, list, run))
    };
    made().map_or_else(|error| error, PyErr::from_value)
}

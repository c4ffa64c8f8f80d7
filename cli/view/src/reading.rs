//! What a server shows: read when it begins, and again whenever the page is reloaded, so that an edited text is seen, and so that parameters which
//! decide sizes or structure count.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use hyd_compiler::render::render;
use hyd_compiler::{Diagnostic, Files, Severity};
use hyd_run::Failure;
use hyd_verbs::Listener;
use serde_json::{Value, json};

use crate::session::Session;
use crate::{Options, open};

/// A session with its data.
pub(crate) struct Read {
    pub(crate) session: Session,
    pub(crate) data: Value,
    /// Pages of other readings refer to columns that may be others by now.
    pub(crate) number: u64,
}

/// The newest reading.
pub(crate) struct Reading {
    options: Options,
    newest: Mutex<Arc<Read>>,
    /// Nobody has seen it.
    is_new: AtomicBool,
}

impl Reading {
    pub(crate) fn new(options: Options, session: Session, data: Value) -> Self {
        let read = Arc::new(Read { session, data, number: 1 });
        Self { options, newest: Mutex::new(read), is_new: AtomicBool::new(true) }
    }

    /// What was read last.
    pub(crate) fn newest(&self) -> Arc<Read> {
        // Whoever panicked while holding it has replaced it or not.
        self.newest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// What is shown to whoever loads the page; `set`: parameters that its address sets, beside those of the command line and before them.
    ///
    /// # Errors
    /// What the compiler says of the texts as they are now.
    pub(crate) fn again(&self, set: Vec<(String, String)>) -> Result<Arc<Read>, String> {
        if self.is_new.swap(false, Ordering::Relaxed) && set.is_empty() {
            return Ok(self.newest());
        }
        let mut options = self.options.clone();
        options.set.retain(|(name, _)| set.iter().all(|(other, _)| other != name));
        options.set.extend(set);
        let heard = Heard::default();
        match open(&options, &heard) {
            Ok((session, data)) => {
                let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
                let number = newest.number + 1;
                *newest = Arc::new(Read { session, data, number });
                Ok(newest.clone())
            }
            Err(failure) => {
                let told = heard.0.into_inner();
                Err(match failure {
                    Failure::Fault(text) | Failure::Usage(text) | Failure::Solver(text) => format!("{told}{text}"),
                    _ => told,
                })
            }
        }
    }
}

/// The data of a page that has nothing to show but this.
pub(crate) fn failed(title: &str, words: &str) -> Value {
    json!({"title": title, "files": [], "variables": [], "leftOut": 0, "failed": words})
}

/// Keeps messages.
#[derive(Default)]
struct Heard(RefCell<String>);

impl Listener for Heard {
    fn sentence(&self, _severity: Severity, text: &str) {
        self.0.borrow_mut().push_str(&format!("{}\n", text.trim_end()));
    }

    fn diagnostics(&self, files: &Files, diagnostics: &[Diagnostic]) {
        self.0.borrow_mut().push_str(&render(files, diagnostics, false));
    }
}

//! Who hears what verbs have to say while they work.

use hyd_compiler::{Diagnostic, Files, Severity};

/// Takes messages; the command prints them, a program keeps them.
pub trait Listener {
    /// A sentence without a place in a text.
    fn sentence(&self, severity: Severity, text: &str);

    /// Messages with the texts that they point into.
    fn diagnostics(&self, files: &Files, diagnostics: &[Diagnostic]);

    /// How far long work has come after so many seconds.
    fn progress(&self, _seconds: f64, _text: &str) {}
}

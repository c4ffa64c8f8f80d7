//! Messages of verbs on standard error.

use std::io::{self, IsTerminal, Write};

use hyd_compiler::{Diagnostic, Files, Severity};
use hyd_verbs::Listener;

use crate::arguments::MessageFormat;
use crate::{output, translate};

/// Prints what it hears in this format.
pub(crate) struct Terminal(pub(crate) MessageFormat);

impl Terminal {
    /// For people.
    pub(crate) const TEXT: Self = Self(MessageFormat::Text);
}

impl Listener for Terminal {
    fn sentence(&self, severity: Severity, text: &str) {
        let severity = match severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        };
        output::sentence(severity, text, self.0);
    }

    fn diagnostics(&self, files: &Files, diagnostics: &[Diagnostic]) {
        translate::report(files, diagnostics, self.0);
    }

    fn progress(&self, seconds: f64, text: &str) {
        if io::stderr().is_terminal() {
            // A terminal that cannot be written to shows no progress; the work goes on.
            let _ = writeln!(io::stderr(), "{seconds:6.1} s  {text}");
        }
    }
}

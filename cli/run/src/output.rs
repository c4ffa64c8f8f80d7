//! Writing to standard output and standard error.
//!
//! A reader that closes its end early (`hyd ... | head`) is not an error of ours and never a panic.

use std::io::{self, IsTerminal, Write};

use crate::Failure;
use crate::MessageFormat;

/// Writes results to standard output.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(Failure::OutputClosed),
        Err(error) => Err(Failure::Fault(format!("cannot write to standard output: {error}"))),
    }
}

/// Writes a message to standard error; if that fails, there is nobody to tell.
pub fn message(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// Writes one sentence to standard error, as text or as a JSON object like those of diagnostics.
pub fn sentence(severity: &str, text: &str, format: MessageFormat) {
    let text = text.trim_end();
    message(&match format {
        MessageFormat::Text => format!("{severity}: {text}\n"),
        MessageFormat::Json => {
            let code = serde_json::Value::Null;
            format!("{}\n", serde_json::json!({ "severity": severity, "code": code, "message": text }))
        }
    });
}

/// True if messages may be coloured: a terminal reads them and `NO_COLOR` is not set (see no-color.org).
pub fn colored() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

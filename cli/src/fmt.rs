//! `hyd fmt PATH...`: brings model texts into their layout, in place.
//!
//! Folders are searched for `.hyd` and `.mo` files; hidden folders and links to folders are passed over, so that a search ends.  A file is
//! replaced as a whole, with the rights it had, and only when its text changes; one with a syntax error stays as it is.  What was
//! changed is printed when all is done, so that a closed pipe stops nothing half-way.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hyd_compiler::{Code, Diagnostic, Files};
use hyd_results::WholeFile;

use crate::arguments::Fmt;
use crate::translate::report;
use crate::{Failure, output};
use hyd_run::{decode, read_text, read_to_limit};

/// Runs the verb.
pub(crate) fn fmt(arguments: &Fmt) -> Result<(), Failure> {
    let (stdin, paths): (Vec<&PathBuf>, Vec<&PathBuf>) = arguments.paths.iter().partition(|path| is_stdin(path));
    if !stdin.is_empty() {
        if !paths.is_empty() {
            return Err(Failure::Usage("`-` stands alone: standard input goes to standard output".into()));
        }
        return filter(arguments);
    }
    let mut run = Run { arguments, failed: false };
    let mut files = BTreeSet::new();
    for path in paths {
        let before = files.len();
        match collect(path, &mut files) {
            Err(sentence) => run.refuse(sentence),
            Ok(()) if path.is_dir() && files.len() == before => {
                let message = format!("there is no .hyd or .mo file in `{}`", path.display());
                output::sentence("warning", &message, arguments.message_format);
            }
            Ok(()) => {}
        }
    }
    let mut changed = String::new();
    for file in &files {
        if run.file(file) {
            changed.push_str(&format!("{}\n", file.display()));
        }
    }
    output::print(&changed)?;
    let unformatted = arguments.check && !changed.is_empty();
    if run.failed || unformatted { Err(Failure::Reported) } else { Ok(()) }
}

fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Standard input to standard output; with `--check` only the exit code tells.
fn filter(arguments: &Fmt) -> Result<(), Failure> {
    let name = Path::new("<stdin>");
    let mut run = Run { arguments, failed: false };
    let text = read_to_limit(name, io::stdin().lock()).and_then(|bytes| decode(name, bytes));
    let text = text.map_err(|error| {
        run.refuse(error.to_string());
        Failure::Reported
    })?;
    match run.formatted(name, &text) {
        None => Err(Failure::Reported),
        Some(formatted) if !arguments.check => output::print(&formatted),
        Some(formatted) if formatted == text => Ok(()),
        Some(_) => {
            output::print("<stdin>\n")?;
            Err(Failure::Reported)
        }
    }
}

/// One run over files.
struct Run<'a> {
    arguments: &'a Fmt,
    /// A file could not be read, understood or written.
    failed: bool,
}

impl Run<'_> {
    /// Formats a file; true if its text is not what it was, or with `--check`, would not be.
    fn file(&mut self, path: &Path) -> bool {
        let text = match read_text(path) {
            Ok(text) => text,
            Err(error) => {
                self.refuse(error.to_string());
                return false;
            }
        };
        match self.formatted(path, &text) {
            Some(formatted) if formatted != text => {
                if !self.arguments.check
                    && let Err(error) = replace(path, &formatted)
                {
                    self.refuse(format!("`{}` cannot be written: {error}", path.display()));
                    return false;
                }
                true
            }
            _ => false,
        }
    }

    /// The text in its layout; messages are printed.
    fn formatted(&mut self, path: &Path, text: &str) -> Option<String> {
        let mut files = Files::new();
        let id = files.add(path.display().to_string(), text.to_string());
        let outcome = hyd_format::format(id, text);
        report(&files, &outcome.diagnostics, self.arguments.message_format);
        self.failed |= outcome.value.is_none();
        outcome.value
    }

    fn refuse(&mut self, sentence: String) {
        self.failed = true;
        report(&Files::new(), &[Diagnostic::error(Code::FileAccess, sentence)], self.arguments.message_format);
    }
}

/// The files that a path of the command line stands for.
pub(crate) fn collect(path: &Path, files: &mut BTreeSet<PathBuf>) -> Result<(), String> {
    if !path.is_dir() {
        files.insert(path.to_path_buf());
        return Ok(());
    }
    let failed = |error: io::Error| format!("the folder `{}` cannot be read: {error}", path.display());
    for entry in fs::read_dir(path).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let kind = entry.file_type().map_err(failed)?;
        let inner = entry.path();
        if kind.is_dir() {
            if !entry.file_name().as_encoded_bytes().starts_with(b".") {
                collect(&inner, files)?;
            }
        } else if inner.extension().is_some_and(|ending| ending == "hyd" || ending == "mo") && inner.is_file() {
            files.insert(inner);
        }
    }
    Ok(())
}

/// Replaces the text of a file by its layout: the one writing over what was read.
fn replace(path: &Path, text: &str) -> io::Result<()> {
    let whole = WholeFile::rewrite(path)?;
    whole.writer()?.write_all(text.as_bytes())?;
    whole.finish().map(|_| ())
}

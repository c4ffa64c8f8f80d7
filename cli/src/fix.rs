//! `hyd check --fix`: the changes that messages propose, shown and then written.
//!
//! Of each message the first proposal is taken, as far as it lies in the file that is checked and does not meet another one.  The changed
//! text is translated before it is written: a change after which its message is still there heals nothing and is refused.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use hyd_compiler::{Compilation, Diagnostic, Edit, Extras, FileId, Files, Goal, Proposal, Severity};
use hyd_results::WholeFile;
use hyd_verbs::{Request, compile_text, start_warning};

use crate::arguments::ModelArguments;
use crate::{Failure, output};

/// Applies what `compilation` proposes; gives the compilation of the changed text, none if nothing was proposed.
pub(crate) fn fix(arguments: &ModelArguments, compilation: &Compilation) -> Result<Option<Compilation>, Failure> {
    let path = arguments.file.as_path();
    let name = path.display().to_string();
    let Some(file) = compilation.files.ids().find(|&id| compilation.files.name(id).as_ref() == name.as_str()) else {
        return Ok(None);
    };
    let chosen = chosen(&compilation.diagnostics, file);
    if chosen.is_empty() {
        output::print(&format!("{name}: no message proposes a change that can be made here\n"))?;
        return Ok(None);
    }
    let text = changed(compilation.files.text(file), &chosen);
    let mut sources = arguments.libraries.libraries().path(path, &text).map_err(Failure::Usage)?;
    // What is wrong with start values shows only where the start is looked for.
    let goal = if compilation.model.is_some() { Goal::Run } else { Goal::Check };
    let request = Request { class: arguments.model.clone(), set: arguments.set.clone(), goal };
    let extras = Extras { strict_units: arguments.strict_units, ..Extras::default() };
    let mut after = compile_text(&mut sources, &name, &text, &request, &extras);
    let found = start_warning(&after);
    after.diagnostics.extend(found);
    let still = |message: &&Diagnostic| after.diagnostics.iter().any(|own| own.message == message.message);
    if let Some(message) = chosen.iter().map(|(message, _)| *message).find(still) {
        let sentence = format!("the proposed changes do not heal this, and nothing was written: {}", message.message);
        return Err(Failure::Fault(sentence));
    }
    let mut shown = String::new();
    for (_, proposal) in &chosen {
        show(&mut shown, &compilation.files, proposal);
    }
    output::print(&shown)?;
    write(path, &text).map_err(|error| Failure::Fault(format!("`{name}` cannot be written: {error}")))?;
    output::print(&format!("{name}: {} made\n", if chosen.len() == 1 { "1 change" } else { "the changes" }))?;
    Ok(Some(after))
}

/// The proposals that can be made together, with their messages.
fn chosen(diagnostics: &[Diagnostic], file: FileId) -> Vec<(&Diagnostic, &Proposal)> {
    let mut taken: Vec<(&Diagnostic, &Proposal)> = Vec::new();
    for message in diagnostics.iter().filter(|message| message.severity >= Severity::Warning) {
        let Some(proposal) = message.proposals.first() else { continue };
        let known = taken.iter().flat_map(|(_, proposal)| &proposal.edits);
        let is_free = |edit: &Edit| edit.span.file == file && known.clone().all(|other| apart(edit, other));
        if !proposal.edits.is_empty() && proposal.edits.iter().all(is_free) {
            taken.push((message, proposal));
        }
    }
    taken
}

/// Two changes do not touch the same text; what is put in at the same place may be put in twice.
fn apart(a: &Edit, b: &Edit) -> bool {
    let is_empty = |edit: &Edit| edit.span.start == edit.span.end;
    a.span.file != b.span.file
        || a.span.end < b.span.start
        || b.span.end < a.span.start
        || (is_empty(a) || is_empty(b)) && (a.span.end == b.span.start || b.span.end == a.span.start)
}

/// The text with all changes made, the last first.
fn changed(text: &str, chosen: &[(&Diagnostic, &Proposal)]) -> String {
    let mut edits: Vec<&Edit> = chosen.iter().flat_map(|(_, proposal)| &proposal.edits).collect();
    edits.sort_by_key(|edit| (edit.span.start, edit.span.end));
    let mut text = text.to_string();
    for edit in edits.into_iter().rev() {
        text.replace_range(edit.span.start as usize..edit.span.end as usize, &edit.text);
    }
    text
}

/// What a proposal does, and the lines that it changes.
fn show(out: &mut String, files: &Files, proposal: &Proposal) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{}", proposal.message);
    for edit in &proposal.edits {
        let text = files.text(edit.span.file);
        let (start, end) = (edit.span.start as usize, edit.span.end as usize);
        let from = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let to = text[end..].find('\n').map_or(text.len(), |at| end + at);
        let at = files.location(edit.span);
        let _ = writeln!(out, "  {}:{}", files.name(edit.span.file), at.line);
        let (before, after) = (&text[from..to], format!("{}{}{}", &text[from..start], edit.text, &text[end..to]));
        // Of what is put in before a line only that is new.
        let (before, after) = match after.strip_suffix(before.trim_start()) {
            Some(put_in) => ("", put_in.trim_end().to_string()),
            None => (before, after),
        };
        before.lines().for_each(|line| {
            let _ = writeln!(out, "  - {}", line.trim_start());
        });
        after.lines().for_each(|line| {
            let _ = writeln!(out, "  + {}", line.trim_start());
        });
    }
}

/// Replaces the text of a file: the one writing over what was read.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    let whole = WholeFile::rewrite(path)?;
    whole.writer()?.write_all(text.as_bytes())?;
    whole.finish().map(|_| ())
}

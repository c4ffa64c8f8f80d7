//! `hyd check --fix`: the changes that messages propose, shown and then written.
//!
//! Of each message the first proposal is taken, as far as it lies in the file that is checked and does not meet another one.  The changed
//! text is translated before it is written: a change after which its message is still there heals nothing and is refused.  Where no message
//! proposes anything that heals, small changes are tried ([`Trials`]), and one after which the model translates and runs is made.

use std::fmt::Write as _;
use std::io::{Read as _, Write as _};
use std::path::Path;

use hyd_compiler::{Compilation, Diagnostic, Edit, Extras, FileId, Files, Goal, Proposal, Severity};
use hyd_results::WholeFile;
use hyd_runtime::SolveError;
use hyd_verbs::{Healing, Request, Trials, compile_text, edited, start_warning};

use crate::arguments::ModelArguments;
use crate::{Failure, output};

/// Applies what `compilation` and the run with this failure propose, or what trying brings; gives the compilation of the changed text, none
/// if nothing was changed.
pub(crate) fn fix(
    arguments: &ModelArguments,
    compilation: &Compilation,
    trials: &Trials<'_>,
    failure: Option<&SolveError>,
) -> Result<Option<Compilation>, Failure> {
    let path = arguments.file.as_path();
    let name = path.display().to_string();
    let Some(file) = compilation.files.ids().find(|&id| compilation.files.name(id).as_ref() == name.as_str()) else {
        return Ok(None);
    };
    let before = compilation.files.text(file);
    let chosen = chosen(&compilation.diagnostics, file);
    let mut refused = None;
    if !chosen.is_empty() {
        let edits: Vec<&Edit> = chosen.iter().flat_map(|(_, proposal)| &proposal.edits).collect();
        let text = edited(before, &edits);
        let after = translated(arguments, compilation, &name, &text)?;
        let still = |message: &&Diagnostic| after.diagnostics.iter().any(|own| own.message == message.message);
        let is_open = after.diagnostics.iter().any(|own| own.severity >= Severity::Warning);
        match chosen.iter().map(|(message, _)| *message).find(still) {
            Some(message) => refused = Some(message.message.clone()),
            // What is left to say may be the cause of what is healed by these changes alone.
            None if is_open && tried(compilation, trials, failure).is_clear => {}
            None => {
                let proposals: Vec<&Proposal> = chosen.iter().map(|(_, proposal)| *proposal).collect();
                made(compilation, &name, &proposals, path, &text)?;
                return Ok(Some(after));
            }
        }
    }
    let healing = tried(compilation, trials, failure);
    if let (Some(proposal), true) = (healing.proposals.first(), healing.is_clear && !healing.is_a_guess) {
        let text = edited(before, &proposal.edits.iter().collect::<Vec<_>>());
        let after = translated(arguments, compilation, &name, &text)?;
        made(compilation, &name, &[proposal], path, &text)?;
        others(&compilation.files, &healing.proposals[1..], "it also runs after this change, which was not made")?;
        return Ok(Some(after));
    }
    match (refused, healing.tried) {
        (Some(message), _) => {
            let sentence = format!("the proposed changes do not heal this, and nothing was written: {message}");
            return Err(Failure::Fault(sentence));
        }
        (None, 0) => output::print(&format!("{name}: no message proposes a change that can be made here\n"))?,
        (None, tried) => {
            let words = match healing.proposals.len() {
                0 if tried == 1 => "the one small change that was tried does not make it run".to_string(),
                0 => format!("none of the {tried} small changes that were tried makes it run"),
                1 => format!(
                    "one of the {tried} small changes that were tried makes it run, which may not be what is meant, and was not made"
                ),
                _ => format!("several of the {tried} small changes that were tried make it run, and none was made"),
            };
            output::print(&format!("{name}: no message proposes a change that can be made here; {words}\n"))?;
        }
    }
    others(&compilation.files, &healing.proposals, "it runs after this change")?;
    Ok(None)
}

fn tried(compilation: &Compilation, trials: &Trials<'_>, failure: Option<&SolveError>) -> Healing {
    trials.healing(compilation, &compilation.diagnostics, failure)
}

/// The changed text, translated as far as the first one was.
fn translated(
    arguments: &ModelArguments,
    compilation: &Compilation,
    name: &str,
    text: &str,
) -> Result<Compilation, Failure> {
    let mut sources = arguments.libraries.libraries().path(&arguments.file, text).map_err(Failure::Usage)?;
    // What is wrong with start values shows only where the start is looked for.
    let goal = if compilation.model.is_some() { Goal::Run } else { Goal::Check };
    let request = Request { class: arguments.model.clone(), set: arguments.set.clone(), goal };
    let extras = Extras { strict_units: arguments.strict_units, ..Extras::default() };
    let mut after = compile_text(&mut sources, name, text, &request, &extras);
    let found = start_warning(&after);
    after.diagnostics.extend(found);
    Ok(after)
}

/// Shows changes and writes the text with them.
fn made(
    compilation: &Compilation,
    name: &str,
    proposals: &[&Proposal],
    path: &Path,
    text: &str,
) -> Result<(), Failure> {
    let mut shown = String::new();
    for proposal in proposals {
        show(&mut shown, &compilation.files, proposal);
    }
    output::print(&shown)?;
    write(path, text).map_err(|error| Failure::Fault(format!("`{name}` cannot be written: {error}")))?;
    output::print(&format!("{name}: {} made\n", if proposals.len() == 1 { "1 change" } else { "the changes" }))
}

/// Shows changes that are not made.
fn others(files: &Files, proposals: &[Proposal], words: &str) -> Result<(), Failure> {
    let mut shown = String::new();
    for proposal in proposals {
        // Writing to a string cannot fail.
        let _ = write!(shown, "{words}: ");
        show(&mut shown, files, proposal);
    }
    output::print(&shown)
}

/// The proposals that can be made together, with their messages; the same change is made once.
fn chosen(diagnostics: &[Diagnostic], file: FileId) -> Vec<(&Diagnostic, &Proposal)> {
    let mut taken: Vec<(&Diagnostic, &Proposal)> = Vec::new();
    for message in diagnostics.iter().filter(|message| message.severity >= Severity::Warning) {
        let Some(proposal) = message.proposals.first() else { continue };
        if taken.iter().any(|(_, known)| known.edits == proposal.edits) {
            continue;
        }
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

/// What a proposal does, and the lines that it changes; changes of one line are shown together.
fn show(out: &mut String, files: &Files, proposal: &Proposal) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{}", proposal.message);
    let mut edits: Vec<&Edit> = proposal.edits.iter().collect();
    edits.sort_by_key(|edit| (edit.span.file, edit.span.start, edit.span.end));
    let lines = |edit: &Edit| {
        let text = files.text(edit.span.file);
        let (start, end) = (edit.span.start as usize, edit.span.end as usize);
        let from = text[..start].rfind('\n').map_or(0, |at| at + 1);
        (from, text[end..].find('\n').map_or(text.len(), |at| end + at))
    };
    for group in edits.chunk_by(|a, b| a.span.file == b.span.file && lines(b).0 <= lines(a).1) {
        let (Some(first), Some(last)) = (group.first(), group.last()) else { continue };
        let text = files.text(first.span.file);
        let ((from, _), (_, to)) = (lines(first), lines(last));
        let at = files.location(first.span);
        let _ = writeln!(out, "  {}:{}", files.name(first.span.file), at.line);
        let mut after = String::new();
        let mut done = from;
        for edit in group {
            after.push_str(&text[done..edit.span.start as usize]);
            after.push_str(&edit.text);
            done = edit.span.end as usize;
        }
        after.push_str(&text[done..to]);
        let before = &text[from..to];
        // Of what is put in before a line only that is new.
        let (before, after) = match after.strip_suffix(before.trim_start()) {
            Some(put_in) if put_in.trim_end_matches([' ', '\t']).ends_with('\n') => ("", put_in.trim_end().to_string()),
            _ => (before, after),
        };
        let mut print = |sign: char, lines: &str| {
            for line in lines.lines().filter(|line| !line.trim().is_empty()) {
                let _ = writeln!(out, "  {sign} {}", line.trim_start());
            }
        };
        print('-', before);
        print('+', &after);
    }
}

/// Replaces the text of a file: the one writing over what was read.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    // The byte order mark at the beginning does not belong to the text.
    const MARK: &[u8] = b"\xef\xbb\xbf";
    let mut first = [0; 3];
    let has_mark = std::fs::File::open(path)?.read_exact(&mut first).is_ok() && first == MARK;
    let whole = WholeFile::rewrite(path)?;
    let mut writer = whole.writer()?;
    if has_mark {
        writer.write_all(MARK)?;
    }
    writer.write_all(text.as_bytes())?;
    whole.finish().map(|_| ())
}

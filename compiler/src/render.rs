//! Diagnostics as text for people and as JSON for programs.
//!
//! Text is made by codespan-reporting, which only this file uses; JSON is one object per line with lines and columns counted
//! from 1 (columns in characters) and byte offsets from 0.  Spans that do not fit their file are cut to it, so that a
//! message is never lost to a mistake of ours.  Text for people is kept to what people read: so many messages of each kind, and no
//! excerpts of lines as long as machines write them.

use std::fmt::Write as _;

use codespan_reporting::diagnostic as out;
use codespan_reporting::files::SimpleFiles;
use codespan_reporting::term::{self, termcolor};
use hyd_index::TypedIndex;
use hyd_source::{Diagnostic, Files, Label, Proposal, Severity, Span};

use crate::json::push_string;

/// Most errors, warnings and notes that are shown as text.
const MOST: usize = 100;
/// Bytes of a line of which an excerpt is shown.
const LONGEST_LINE: usize = 1000;

/// Messages as text with the marked places, an empty line after each; `color`: with ANSI escapes for terminals.  Of
/// each severity the first hundred, with the number of all others at the end.
pub fn render(files: &Files, diagnostics: &[Diagnostic], color: bool) -> String {
    let mut shown = SimpleFiles::new();
    for id in files.ids() {
        shown.add(files.name(id).to_string(), files.text(id).to_string());
    }
    let config = term::Config { tab_width: 4, ..Default::default() };
    let mut text = String::new();
    let mut counts = [0; 3];
    for diagnostic in diagnostics {
        let count = &mut counts[diagnostic.severity as usize];
        *count += 1;
        if *count > MOST {
            continue;
        }
        if has_long_line(files, diagnostic) {
            text.push_str(&plain(files, diagnostic));
            continue;
        }
        let message = translate(files, diagnostic);
        let emitted = if color {
            let mut buffer = termcolor::Ansi::new(Vec::new());
            term::emit_to_write_style(&mut buffer, &config, &shown, &message)
                .map(|()| String::from_utf8_lossy(buffer.get_ref()).into_owned())
        } else {
            term::emit_into_string(&config, &shown, &message)
        };
        text.push_str(&emitted.unwrap_or_else(|_| plain(files, diagnostic)));
    }
    for severity in [Severity::Error, Severity::Warning, Severity::Note] {
        let count = counts[severity as usize];
        if count > MOST {
            let (more, are) =
                if count == MOST + 1 { ("one more", "is") } else { (&*format!("{} more", count - MOST), "are") };
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{more} {}s, which `--message-format json` shows, {are} left out here\n",
                name_of(severity)
            );
        }
    }
    text
}

/// True if a line that would be shown is too long: one that is marked, or a single one between two marked ones.
fn has_long_line(files: &Files, diagnostic: &Diagnostic) -> bool {
    let is_long = |lines: &str| lines.len() > LONGEST_LINE && lines.lines().any(|line| line.len() > LONGEST_LINE);
    let marked: Vec<_> = diagnostic.labels.iter().map(|label| (label.span.file, lines(files, label.span))).collect();
    marked.iter().any(|(file, lines)| {
        let text = files.text(*file);
        let after = text.get(lines.end + 1..).and_then(|rest| rest.split('\n').next()).unwrap_or_default();
        let next = lines.end + 1 + after.len() + 1;
        let is_between = || marked.iter().any(|(other, lines)| other == file && lines.start == next);
        is_long(&text[lines.clone()]) || is_long(after) && is_between()
    })
}

/// Bytes of the lines that a span touches.
fn lines(files: &Files, span: Span) -> std::ops::Range<usize> {
    let text = files.text(span.file);
    let range = cut(files, span);
    let begin = text[..range.start].rfind('\n').map_or(0, |at| at + 1);
    let end = text[range.end..].find('\n').map_or(text.len(), |at| range.end + at);
    begin..end
}

fn translate(files: &Files, diagnostic: &Diagnostic) -> out::Diagnostic<usize> {
    let severity = match diagnostic.severity {
        Severity::Error => out::Severity::Error,
        Severity::Warning => out::Severity::Warning,
        Severity::Note => out::Severity::Note,
    };
    let labels = diagnostic.labels.iter().map(|label| {
        let style = if label.primary { out::LabelStyle::Primary } else { out::LabelStyle::Secondary };
        out::Label::new(style, label.span.file.index(), cut(files, label.span)).with_message(label.message.as_str())
    });
    out::Diagnostic::new(severity)
        .with_code(diagnostic.code.number())
        .with_message(diagnostic.message.as_str())
        .with_labels(labels.collect())
        .with_notes(diagnostic.notes.clone())
}

/// The span's bytes, cut to the file and to whole characters.
fn cut(files: &Files, span: Span) -> std::ops::Range<usize> {
    let text = files.text(span.file);
    let start = text.floor_char_boundary(span.start as usize);
    start..text.ceil_char_boundary(span.end as usize).max(start)
}

/// Message, places and notes without the source text.
fn plain(files: &Files, diagnostic: &Diagnostic) -> String {
    let mut text = format!("{}[{}]: {}\n", severity_name(diagnostic), diagnostic.code, diagnostic.message);
    for label in &diagnostic.labels {
        let at = files.location(label.span);
        let says = if label.message.is_empty() { String::new() } else { format!(": {}", label.message) };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {}:{}:{}{says}", files.name(label.span.file), at.line, at.column);
    }
    for note in &diagnostic.notes {
        let _ = writeln!(text, "  = {note}");
    }
    text.push('\n');
    text
}

fn severity_name(diagnostic: &Diagnostic) -> &'static str {
    name_of(diagnostic.severity)
}

fn name_of(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}

/// All messages as JSON, one object per line:
/// `{"severity", "code", "message", "labels": [{"file", "line", "column", "end_line", "end_column", "start", "end",
/// "primary", "message"}], "notes": [...], "proposals": [{"message", "edits": [{"file", "line", ..., "end", "text"}]}]}`; the edits of a
/// proposal belong together, each puts `text` in the place of what stands there, and `proposals` is absent where there are none.
pub fn render_json(files: &Files, diagnostics: &[Diagnostic]) -> String {
    let mut json = String::new();
    for diagnostic in diagnostics {
        json.push_str("{\"severity\":");
        push_string(&mut json, severity_name(diagnostic));
        json.push_str(",\"code\":");
        push_string(&mut json, diagnostic.code.number());
        json.push_str(",\"message\":");
        push_string(&mut json, &diagnostic.message);
        json.push_str(",\"labels\":[");
        for (k, label) in diagnostic.labels.iter().enumerate() {
            json.push_str(if k == 0 { "" } else { "," });
            push_label(&mut json, files, label);
        }
        json.push_str("],\"notes\":[");
        for (k, note) in diagnostic.notes.iter().enumerate() {
            json.push_str(if k == 0 { "" } else { "," });
            push_string(&mut json, note);
        }
        json.push(']');
        if !diagnostic.proposals.is_empty() {
            json.push_str(",\"proposals\":[");
            for (k, proposal) in diagnostic.proposals.iter().enumerate() {
                json.push_str(if k == 0 { "" } else { "," });
                push_proposal(&mut json, files, proposal);
            }
            json.push(']');
        }
        json.push_str("}\n");
    }
    json
}

fn push_proposal(json: &mut String, files: &Files, proposal: &Proposal) {
    json.push_str("{\"message\":");
    push_string(json, &proposal.message);
    json.push_str(",\"edits\":[");
    for (k, edit) in proposal.edits.iter().enumerate() {
        json.push_str(if k == 0 { "{" } else { ",{" });
        push_place(json, files, edit.span);
        json.push_str(",\"text\":");
        push_string(json, &edit.text);
        json.push('}');
    }
    json.push_str("]}");
}

fn push_label(json: &mut String, files: &Files, label: &Label) {
    json.push('{');
    push_place(json, files, label.span);
    // Writing to a string cannot fail.
    let _ = write!(json, ",\"primary\":{},\"message\":", label.primary);
    push_string(json, &label.message);
    json.push('}');
}

fn push_place(json: &mut String, files: &Files, span: Span) {
    let range = cut(files, span);
    let span = Span::new(span.file, range.start, range.end);
    let (from, to) = (files.location(span), files.location(Span { start: span.end, ..span }));
    json.push_str("\"file\":");
    push_string(json, files.name(span.file));
    // Writing to a string cannot fail.
    let _ = write!(
        json,
        ",\"line\":{},\"column\":{},\"end_line\":{},\"end_column\":{},\"start\":{},\"end\":{}",
        from.line, from.column, to.line, to.column, span.start, span.end
    );
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use hyd_source::{Code, FileId};

    use super::*;

    fn example() -> (Files, Vec<Diagnostic>) {
        let mut files = Files::new();
        let text = "model Fall\n  Real h; // Höhe\n  Real v;\nequation\n  der(h) = w;\nend Fall;\n";
        let a = files.add("fall.hyd", text);
        let b = files.add("other.hyd", "model A end A;\n");
        let at = text.find("w;").unwrap();
        let v = text.find("Real v").unwrap();
        let wrong = Diagnostic::error(Code::UnknownName, "`w` is not declared")
            .at(Span::new(a, at, at + 1), "used here")
            .with(Span::new(a, v, v + 6), "perhaps this one")
            .with(Span::new(b, 6, 7), "")
            .help("did you mean `v`?");
        let bare = Diagnostic::warning(Code::Unused, "nothing is used\nat all");
        (files, vec![wrong, bare])
    }

    #[test]
    fn text_shows_places_codes_and_notes() {
        let (files, diagnostics) = example();
        let expected = "\
error[E0201]: `w` is not declared
  ┌─ fall.hyd:5:12
  │
3 │   Real v;
  │   ------ perhaps this one
4 │ equation
5 │   der(h) = w;
  │            ^ used here
  │
  ┌─ other.hyd:1:7
  │
1 │ model A end A;
  │       -
  │
  = did you mean `v`?

warning[W0201]: nothing is used
at all

";
        assert_eq!(render(&files, &diagnostics, false), expected);
    }

    #[test]
    fn color_adds_escapes_and_nothing_else() {
        let (files, diagnostics) = example();
        let colored = render(&files, &diagnostics, true);
        let mut bare = String::new();
        let mut rest = colored.as_str();
        while let Some((before, after)) = rest.split_once('\u{1b}') {
            bare.push_str(before);
            rest = after.split_once('m').unwrap().1;
        }
        bare.push_str(rest);
        assert_ne!(colored, bare);
        assert_eq!(bare, render(&files, &diagnostics, false));
    }

    #[test]
    fn json_is_one_escaped_object_per_line() {
        let (files, diagnostics) = example();
        let expected = concat!(
            r#"{"severity":"error","code":"E0201","message":"`w` is not declared","labels":["#,
            r#"{"file":"fall.hyd","line":5,"column":12,"end_line":5,"end_column":13,"start":60,"end":61,"primary":true,"message":"used here"},"#,
            r#"{"file":"fall.hyd","line":3,"column":3,"end_line":3,"end_column":9,"start":32,"end":38,"primary":false,"message":"perhaps this one"},"#,
            r#"{"file":"other.hyd","line":1,"column":7,"end_line":1,"end_column":8,"start":6,"end":7,"primary":false,"message":""}],"#,
            r#""notes":["did you mean `v`?"]}"#,
            "\n",
            r#"{"severity":"warning","code":"W0201","message":"nothing is used\nat all","labels":[],"notes":[]}"#,
            "\n"
        );
        assert_eq!(render_json(&files, &diagnostics), expected);
    }

    #[test]
    fn of_many_messages_the_first_are_shown_and_of_long_lines_the_place() {
        let mut files = Files::new();
        let id = files.add("long.hyd", format!("model A\n{}\n", "x ".repeat(40_000)));
        let at = |k: usize| Span::new(id, 8 + 2 * k, 9 + 2 * k);
        let mut diagnostics: Vec<_> = (0..5000).map(|k| Diagnostic::error(Code::Unused, "odd").at(at(k), "")).collect();
        diagnostics.push(Diagnostic::warning(Code::Syntax, "the last").at(at(5000), "here"));
        let text = render(&files, &diagnostics, false);
        assert!(text.len() < 10_000, "{} bytes", text.len());
        assert!(text.starts_with("error[W0201]: odd\n  long.hyd:2:1\n"), "{}", &text[..60]);
        assert!(text.contains("warning[E0101]: the last\n  long.hyd:2:10001: here\n"));
        assert!(text.ends_with("4900 more errors, which `--message-format json` shows, are left out here\n\n"));
        assert_eq!(render_json(&files, &diagnostics).lines().count(), 5001);
    }

    /// An excerpt shows the one line between two marked ones, but dots for several.
    #[test]
    fn a_long_line_between_two_marked_ones_is_no_excerpt() {
        let message = |between: &str| {
            let mut files = Files::new();
            let first = "model A\n";
            let id = files.add("long.hyd", format!("{first}{between}end B;\n"));
            let end = first.len() + between.len();
            let odd = Diagnostic::error(Code::Syntax, "odd").at(Span::new(id, end + 4, end + 5), "here");
            render(&files, &[odd.with(Span::new(id, 6, 7), "there")], false)
        };
        let long = "x ".repeat(1000) + "\n";
        assert_eq!(message(&long), "error[E0101]: odd\n  long.hyd:3:5: here\n  long.hyd:1:7: there\n\n");
        assert!(message(&(long.clone() + "\n")).contains("·"), "several lines are not shown");
        assert!(message(&("y\n".to_string() + &long)).contains("·"));
        assert!(message("x = 1;\n").contains("2 │ x = 1;"));
    }

    /// What is long is the line, not the place.
    #[test]
    fn of_many_short_lines_an_excerpt_is_shown() {
        let mut files = Files::new();
        let text = "x = 1;\n".repeat(1000);
        let id = files.add("short.hyd", text.clone());
        let whole = Diagnostic::error(Code::Syntax, "odd").at(Span::new(id, 0, text.len() - 1), "all of this");
        let shown = render(&files, &[whole], false);
        assert!(shown.contains("1 │ ╭ x = 1;") && shown.contains("all of this"), "{shown}");
    }

    #[test]
    fn spans_beyond_the_text_are_cut() {
        let mut files = Files::new();
        let id: FileId = files.add("ä.hyd", "ä");
        let diagnostics = [Diagnostic::error(Code::Syntax, "odd").at(Span::new(id, 1, 99), "here")];
        let expected = "error[E0101]: odd\n  ┌─ ä.hyd:1:1\n  │\n1 │ ä\n  │ ^ here\n\n";
        assert_eq!(render(&files, &diagnostics, false), expected);
        assert!(render_json(&files, &diagnostics).contains(r#""start":0,"end":2,"#));
    }
}

//! The examples of `docs/language.md`: every block of the language is translated and run, or gives the error it names.
//!
//! A block opens with ```` ```modelica ````, then nothing (runs without errors), `error E0201` (this code must be among its
//! errors, and no other), `warning W0201` likewise or `fragment` (not looked at; only for grammar that is not text of its own).  Comments such as
//! `// expect: x @ 1 = 2` work as in the cases.

use std::path::Path;

use hyd::LibraryPath;
use hyd_compiler::{Goal, Options, Severity, compile};
use hyd_tests::models::text_of;

use crate::case::{Expected, check};

#[test]
fn examples_of_the_reference() {
    let text = text_of("docs/language.md");
    let mut report = String::new();
    let mut count = 0;
    for (line, kind, block) in blocks(&text) {
        let found = match kind.split_once(' ') {
            Some(("error", code)) => wrong_messages(&block, Severity::Error, code.trim()),
            Some(("warning", code)) => wrong_messages(&block, Severity::Warning, code.trim()),
            _ if kind.is_empty() => {
                let mut expected = Expected::default();
                expected.read("example.hyd", &format!("{block}\n// ok"));
                check(Path::new("example.hyd"), &block, &expected)
            }
            _ => vec![format!("`{kind}` is not a kind of block")],
        };
        count += 1;
        if !found.is_empty() {
            report += &format!("\nline {line}:\n  {}\n", found.join("\n  "));
        }
    }
    assert!(count > 40, "only {count} examples");
    assert!(report.is_empty(), "{report}");
}

/// Line, kind and text of each block.
fn blocks(text: &str) -> Vec<(usize, String, String)> {
    let mut blocks = Vec::new();
    let mut open: Option<(usize, String, String)> = None;
    for (number, line) in text.lines().enumerate() {
        if let Some(block) = &mut open {
            if line.trim() == "```" {
                blocks.extend(open.take());
            } else {
                block.2 += line;
                block.2.push('\n');
            }
        } else if let Some(kind) = line.strip_prefix("```modelica") {
            open = Some((number + 1, kind.trim().to_string(), String::new()));
        }
    }
    assert!(open.is_none(), "a block is not closed");
    blocks
}

fn wrong_messages(text: &str, least: Severity, code: &str) -> Vec<String> {
    let options = Options { model: None, set: Vec::new(), goal: Goal::Check, clock: || 0.0 };
    let compilation = compile(&mut LibraryPath::new(), "example.hyd", text, &options);
    let errors: Vec<_> = compilation.diagnostics.iter().filter(|d| d.severity >= least).collect();
    let mut report: Vec<String> =
        errors.iter().filter(|d| d.code.number() != code).map(|d| format!("{}: {}", d.code, d.message)).collect();
    if errors.is_empty() {
        report.push(format!("no message, {code} is expected"));
    }
    report
}

#[test]
fn blocks_are_found() {
    let text = "a\n```modelica\nmodel M end M;\n```\n```sh\nx\n```\n```modelica error E0101\nmodel\n```\n";
    let found = blocks(text);
    assert_eq!(found.len(), 2);
    assert_eq!(found[0], (2, String::new(), "model M end M;\n".to_string()));
    assert_eq!(found[1].1, "error E0101");
    assert!(wrong_messages("model", Severity::Error, "E0101").is_empty());
    assert_eq!(wrong_messages("model M end M;", Severity::Error, "E0101").len(), 1);
}

//! Wrong models and what is said about them: `cases/bad_input/*.hyd`, the messages in `snapshots/bad_input`.
//!
//! A case begins with lines `// hyd ARGUMENTS => CODE`, each a command with its exit code; `FILE` stands for the case's own
//! file, `OUT` for an empty folder.  The snapshot is the text of the case followed by each command with its whole
//! standard error, for a reader who judges: is it true, does the caret stand under the fault, does it help?  Numbers that
//! depend on the solver's steps are blanked.

use std::path::Path;

use crate::process::{Scratch, assert_no_panic, names, run};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/bad_input");

#[test]
fn messages_for_wrong_models() {
    let before = names(Path::new(FOLDER));
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../../snapshots/bad_input");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| {
        insta::glob!("../../cases/bad_input", "*.hyd", |path| {
            let name = path.file_name().unwrap().to_str().unwrap();
            insta::assert_snapshot!("case", transcript(name, &std::fs::read_to_string(path).unwrap()));
        });
    });
    assert_eq!(names(Path::new(FOLDER)), before, "a command left a file behind");
}

/// The case's text and what each of its commands says.
fn transcript(name: &str, text: &str) -> String {
    let commands: Vec<&str> = text.lines().map_while(|line| line.strip_prefix("// hyd ")).collect();
    assert!(!commands.is_empty(), "{name}: the first line is not a command");
    let mut result = text.to_string();
    for line in commands {
        let (arguments, code) = line.rsplit_once("=>").unwrap();
        result += &format!("\n-------- hyd {line}\n{}", said(name, arguments, code.trim()));
    }
    result
}

fn said(name: &str, arguments: &str, code: &str) -> String {
    let out = Scratch::new();
    let folder = out.path().to_str().unwrap();
    let words: Vec<String> =
        arguments.split_whitespace().map(|word| word.replace("FILE", name).replace("OUT", folder)).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let outcome = run(Path::new(FOLDER), &words);
    assert_no_panic(&outcome);
    let said = outcome.stderr.replace(folder, "OUT");
    assert_eq!(outcome.code, code.parse().ok(), "{name}: hyd {arguments}\n{}{said}", outcome.stdout);
    assert_eq!(outcome.code == Some(0), !said.contains("error"), "{name}: hyd {arguments}\n{said}");
    let lines: String = said.lines().map(|line| blank_numbers(line).trim_end().to_string() + "\n").collect();
    let files = out.names();
    if files.is_empty() { lines } else { format!("{lines}files: {}\n", files.join(", ")) }
}

/// `0.9999849210676519` and `3.394e-15` to `#`: numbers with more digits than people write come from the solver.
fn blank_numbers(line: &str) -> String {
    let quoted = line.trim_start().starts_with(|c: char| c.is_ascii_digit() || "│┌·^".contains(c));
    if quoted {
        return line.to_string();
    }
    let mut result = String::new();
    let mut rest = line;
    // What the solver says of itself: every number in it is computed.
    let of_solver = ["last step tried", "last good values", "values where the search ended", "[E0601]"]
        .iter()
        .any(|words| line.contains(words));
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let number = |c: char| c.is_ascii_digit() || ".e-".contains(c);
        let end = rest[start..].find(|c| !number(c)).map_or(rest.len(), |n| start + n);
        let text = rest[start..end].trim_end_matches(['.', '-', 'e']);
        let computed = text.contains('.') && (of_solver || text.len() > 8 || text.contains('e'))
            || of_solver && text.contains("e-");
        result += &rest[..start];
        result += if computed { "#" } else { text };
        rest = &rest[start + text.len()..];
    }
    let line = result + rest;
    match line.split_once(" at order ") {
        Some((head, _)) => format!("{head} at order #"),
        None => line,
    }
}

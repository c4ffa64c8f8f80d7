//! Every text of the repository, and the same texts with their layout disturbed: the tree stays as it was, formatting twice is
//! formatting once, and the library and the models are formatted.

use std::path::{Path, PathBuf};

use hyd_source::{FileId, Files, Severity};
use proptest::prelude::*;

use crate::{WIDTH, format};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// All `.hyd` files below a folder of the repository, sorted.
fn files(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder of the repository") {
            let path = entry.expect("listed").path();
            if path.is_dir() {
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                if name != "target" && !name.starts_with('.') {
                    folders.push(path);
                }
            } else if path.extension().is_some_and(|extension| extension == "hyd") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Files that hold text at all; some cases of tests are not text on purpose.
fn texts(folder: &str) -> Vec<(PathBuf, String)> {
    files(folder).into_iter().filter_map(|path| Some((path.clone(), std::fs::read_to_string(path).ok()?))).collect()
}

fn file() -> FileId {
    Files::new().add("test", "")
}

/// The tree without its places; none for a text with errors.
fn tree(text: &str) -> Option<String> {
    let parsed = hyd_syntax::parse(file(), text);
    if parsed.diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error) {
        return None;
    }
    let shown = format!("{:?}", parsed.value);
    let mut without = String::with_capacity(shown.len());
    let mut parts = shown.split("Span {");
    without.push_str(parts.next().unwrap_or_default());
    for part in parts {
        without.push_str(part.split_once('}').map_or("", |(_, rest)| rest));
    }
    Some(without)
}

/// The formatted text, after what must hold for every text has been checked; none for a text with errors.
fn checked(text: &str, name: &str) -> Option<String> {
    let outcome = format(file(), text);
    let Some(before) = tree(text) else {
        assert!(outcome.value.is_none() && !outcome.diagnostics.is_empty(), "{name}: a text with errors is formatted");
        return None;
    };
    let formatted = outcome.value.unwrap_or_else(|| panic!("{name}: {:?}", outcome.diagnostics));
    assert!(tree(&formatted) == Some(before), "{name}: the tree has changed\n{formatted}");
    let again = format(file(), &formatted).value;
    assert!(again.as_ref() == Some(&formatted), "{name}: not idempotent\n{formatted}\n----\n{again:?}");
    Some(formatted)
}

#[test]
fn trees_stay_and_once_is_enough_for_all_texts() {
    let texts = texts(".");
    let formatted = texts.iter().filter_map(|(path, text)| checked(text, &path.display().to_string())).count();
    assert!(formatted > 1000 && texts.len() - formatted > 20, "{formatted} of {}", texts.len());
}

#[test]
fn symbols_that_stand_side_by_side_stay_two() {
    let text = "model A\nequation\n  external \"\" : = end A;\n";
    assert!(checked(text, "external").is_some_and(|formatted| formatted.contains(": =")));
}

#[test]
fn the_library_and_the_models_are_formatted() {
    for (path, text) in texts("stdlib").into_iter().chain(texts("models")) {
        let formatted = format(file(), &text).value;
        assert!(formatted.as_ref() == Some(&text), "`hyd fmt {}` has not been run", path.display());
    }
}

#[test]
fn lines_are_longer_than_the_width_only_for_strings_and_comments() {
    for (path, text) in texts(".") {
        let Some(formatted) = format(file(), &text).value else { continue };
        let mut in_text = false;
        for line in formatted.lines() {
            let alone = !line.contains('"') && !line.contains("//") && !line.contains("/*") && !in_text;
            assert!(!alone || line.chars().count() <= WIDTH, "{}: {line}", path.display());
            in_text ^= line.matches('"').count() % 2 == 1;
        }
    }
}

/// A text with its blanks and line ends outside of strings and comments disturbed as `changes` say.
fn disturbed(text: &str, changes: &[u8]) -> String {
    let mut out = String::new();
    let mut changes = changes.iter().cycle();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let length = match c {
            '"' => 1 + end_of_string(&rest[1..]),
            '/' if rest.starts_with("//") => rest.find('\n').map_or(rest.len(), |end| end + 1),
            '/' if rest.starts_with("/*") => rest[2..].find("*/").map_or(rest.len(), |end| end + 4),
            _ if c.is_whitespace() => {
                out.push_str(match changes.next().unwrap_or(&0) % 16 {
                    0 => "\n",
                    1 => "\r\n",
                    2 => "\n\n\n",
                    3 => " /* c */ ",
                    4 => " // c\n",
                    5 => "\n  // c\n",
                    6 => "\n/* c\n c */\n",
                    7 => "\t",
                    _ => " ",
                });
                rest = rest.trim_start();
                continue;
            }
            ';' | ',' | '(' if changes.next().is_some_and(|change| change % 8 == 0) => {
                out.push(c);
                out.push('\n');
                rest = &rest[1..];
                continue;
            }
            _ => c.len_utf8(),
        };
        out.push_str(&rest[..length]);
        rest = &rest[length..];
    }
    out
}

fn end_of_string(text: &str) -> usize {
    let mut escaped = false;
    let end = text.find(|c| {
        let ends = c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
        ends
    });
    end.map_or(text.len(), |end| end + 1)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn any_layout_of_a_text_keeps_its_tree(which in any::<prop::sample::Index>(), changes in prop::collection::vec(any::<u8>(), 1..200)) {
        let texts = texts(".");
        let (path, text) = which.get(&texts);
        // Quoted names and strings in comments are beyond the little scanner above.
        prop_assume!(!text.contains('\'') && tree(text).is_some() && text.len() < 20_000);
        let other = disturbed(text, &changes);
        prop_assert_eq!(tree(&other), tree(text), "{}", path.display());
        checked(&other, &path.display().to_string());
    }
}

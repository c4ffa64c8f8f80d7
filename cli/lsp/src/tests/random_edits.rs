//! Random edits, taken back at the end: whatever was typed before, a server answers as one that sees the text for the first time.

use std::path::Path;

use lsp_types::{Position, Range};
use proptest::prelude::*;
use serde_json::{Value, json};

use super::client::{Client, address};
use crate::lines::{Encoding, Lines};

const LIBRARY: &str = "package Lib\n  connector Pin\n    Real v;\n    flow Real i;\n  end Pin;\n  model Part\n    Pin p;\n    Pin n;\n    \
    parameter Real R(unit = \"Ohm\") = 1 \"resistance\";\n  equation\n    p.v - n.v = R*p.i;\n    p.i + n.i = 0;\n  end Part;\nend Lib;\n";
const MODEL: &str = "model M \"ä𝄞\"\r\n  // two parts\n  Lib.Part a(R = 2), b;\n  Real x(start = 1);\n  parameter Real k = 3*2;\n\
    equation\n  connect(a.p, b.n);\n  connect(b.p, a.n);\n  a.n.v = 0;\n  der(x) = if x > k then -a.p.v else sum({1, 2});\nend M;\n";
/// What is typed.
const PIECES: [&str; 14] =
    ["a", ".", "(", ")", ";", "\n", "\"", " end ", "equation", "Real y;", "/*", "𝄞", "b.p.v = ", "model N end N;"];
const POSITIONAL: [&str; 5] = [
    "textDocument/hover",
    "textDocument/completion",
    "textDocument/definition",
    "textDocument/signatureHelp",
    "textDocument/documentHighlight",
];
const OF_DOCUMENTS: [&str; 6] = [
    "textDocument/documentSymbol",
    "textDocument/semanticTokens/full",
    "textDocument/foldingRange",
    "textDocument/codeLens",
    "textDocument/inlayHint",
    "textDocument/formatting",
];

/// A change: where it begins and how long it is, as parts of the text, and what is put in.
#[derive(Clone, Debug)]
struct Edit(f64, usize, usize);

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let edit = (0.0..1.0, 0usize..6, 0..PIECES.len()).prop_map(|(at, length, piece)| Edit(at, length, piece));
    prop::collection::vec(edit, 1..12)
}

fn position(text: &str, byte: usize) -> Position {
    Lines::new(text).position(text, byte, Encoding::Utf16)
}

/// Everything that can be asked about a document.
fn answers(client: &mut Client, file: &Path, text: &str, version: i64) -> Vec<Value> {
    let document = json!({ "uri": address(file) });
    let mut found = vec![client.messages(file, version)];
    let mut ask = |method: &str, more: Value| {
        let mut params = json!({ "textDocument": document });
        for (key, value) in more.as_object().into_iter().flatten() {
            params[key] = value.clone();
        }
        found.push(client.ask(method, params).expect("an answer"));
    };
    let range = json!(Range { start: Position::new(0, 0), end: Position::new(1000, 0) });
    let options = json!({ "tabSize": 2, "insertSpaces": true });
    OF_DOCUMENTS.iter().for_each(|method| ask(method, json!({ "range": range, "options": options })));
    let places = (0..text.len()).step_by(29).filter(|&byte| text.is_char_boundary(byte));
    for place in places.map(|byte| position(text, byte)) {
        POSITIONAL.iter().for_each(|method| ask(method, json!({ "position": place })));
    }
    found
}

fn changed(client: &Client, file: &Path, version: i64, range: Range, text: &str) {
    let document = json!({ "uri": address(file), "version": version });
    let changes = json!([{ "range": range, "text": text }]);
    client.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": changes }));
}

fn check(folder: &Path, edits: &[Edit]) {
    let file = folder.join("m.hyd");
    let mut client = Client::start(folder);
    client.open(&file, MODEL);
    let mut text = MODEL.to_string();
    let mut undo = Vec::new();
    let mut version = 0;
    for Edit(at, length, piece) in edits {
        let boundary = |mut byte: usize| {
            while !text.is_char_boundary(byte) {
                byte -= 1;
            }
            byte
        };
        let start = boundary((at * text.len() as f64) as usize);
        let end = boundary((start + length).min(text.len())).max(start);
        // A line end of two characters is one place for the protocol.
        if text[..end].ends_with('\r') || text[..start].ends_with('\r') {
            continue;
        }
        let range = Range { start: position(&text, start), end: position(&text, end) };
        version += 1;
        changed(&client, &file, version, range, PIECES[*piece]);
        undo.push((start, PIECES[*piece], text[start..end].to_string()));
        text.replace_range(start..end, PIECES[*piece]);
    }
    let compare = |client: &mut Client, text: &str, version: i64| {
        let mut fresh = Client::start(folder);
        fresh.open(&file, text);
        let (known, new) = (answers(client, &file, text, version), answers(&mut fresh, &file, text, 0));
        assert_eq!(known, new, "{text}");
    };
    compare(&mut client, &text, version);
    while let Some((start, put, taken)) = undo.pop() {
        let range = Range { start: position(&text, start), end: position(&text, start + put.len()) };
        version += 1;
        changed(&client, &file, version, range, &taken);
        text.replace_range(start..start + put.len(), &taken);
    }
    assert_eq!(text, MODEL);
    compare(&mut client, MODEL, version);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn answers_do_not_depend_on_what_was_typed_before(edits in edits()) {
        let folder = std::env::temp_dir().join(format!("hyd-lsp-edits-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("Lib")).expect("a folder for the test");
        std::fs::write(folder.join("Lib").join("package.hyd"), LIBRARY).expect("a file for the test");
        check(&folder, &edits);
    }
}

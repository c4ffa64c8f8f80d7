//! An open document that is asked about: places are written as a piece of its text with a `|` where the cursor stands.

use std::path::PathBuf;

use lsp_types::Position;
use serde_json::{Value, json};

use super::client::{Client, address};
use crate::lines::{Encoding, Lines};

pub(super) struct Desk {
    pub(super) client: Client,
    pub(super) file: PathBuf,
    text: String,
    version: i64,
    folder: PathBuf,
}

impl Desk {
    /// `name`: of a folder that no other test has.
    pub(super) fn open(name: &str, text: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("hyd-lsp-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for the test");
        let file = folder.join("m.hyd");
        let client = Client::start(&folder);
        client.open(&file, text);
        Self { client, file, text: text.to_string(), version: 0, folder }
    }

    /// Another text in the place of the one that is open.
    pub(super) fn write(&mut self, text: &str) {
        self.version += 1;
        self.text = text.to_string();
        let document = json!({ "uri": address(&self.file), "version": self.version });
        self.client
            .tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": [{ "text": text }] }));
    }

    pub(super) fn position(&self, marked: &str) -> Position {
        let (before, behind) = marked.split_once('|').expect("a mark");
        let piece = format!("{before}{behind}");
        let start = self.text.find(&piece).unwrap_or_else(|| panic!("`{piece}` in\n{}", self.text));
        Lines::new(&self.text).position(&self.text, start + before.len(), Encoding::Utf16)
    }

    /// The answer to a request about a place.
    pub(super) fn ask(&mut self, method: &str, marked: &str, more: Value) -> Result<Value, String> {
        let document = json!({ "uri": address(&self.file) });
        let mut params = json!({ "textDocument": document, "position": self.position(marked) });
        for (key, value) in more.as_object().into_iter().flatten() {
            params[key] = value.clone();
        }
        self.client.ask(&format!("textDocument/{method}"), params)
    }

    /// The same of the whole document.
    pub(super) fn ask_all(&mut self, method: &str) -> Value {
        let range = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 1000, "character": 0 } });
        let params = json!({ "textDocument": { "uri": address(&self.file) }, "range": range });
        self.client.ask(&format!("textDocument/{method}"), params).expect("an answer")
    }

    /// The stretch of the document that a range of an answer covers.
    pub(super) fn piece(&self, range: &Value) -> &str {
        let lines = Lines::new(&self.text);
        let byte = |at: &Value| {
            let position: Position = serde_json::from_value(at.clone()).expect("a position");
            lines.byte(&self.text, position, Encoding::Utf16)
        };
        &self.text[byte(&range["start"])..byte(&range["end"])]
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

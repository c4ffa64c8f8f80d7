//! The open documents and the paths of files: what an editor has, whether saved or not.
//!
//! [`Documents`] is a value that is cheap to copy: each thread works on the copy that it was handed, however the editor goes on.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use lsp_types::{TextDocumentContentChangeEvent, Uri};

use crate::lines::{Encoding, Lines};

/// An open document.
#[derive(Clone, Debug)]
pub(crate) struct Document {
    /// Its address as the editor spells it.
    pub(crate) uri: Uri,
    /// Its file; for a document without a file, a name.
    pub(crate) path: PathBuf,
    /// The number that the editor gave this state of it.
    pub(crate) version: i32,
    /// Its text.
    pub(crate) text: Arc<str>,
    /// The lines of the text.
    pub(crate) lines: Arc<Lines>,
}

/// All open documents, by file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Documents {
    open: BTreeMap<PathBuf, Document>,
    texts: Arc<BTreeMap<PathBuf, Arc<str>>>,
}

impl Document {
    /// A document with this text.
    pub(crate) fn new(uri: Uri, version: i32, text: String) -> Self {
        let path = path_of(&uri);
        let lines = Arc::new(Lines::new(&text));
        Self { uri, path, version, text: text.into(), lines }
    }

    /// The document after changes, one after the other.
    #[must_use]
    pub(crate) fn changed(&self, version: i32, changes: &[TextDocumentContentChangeEvent], encoding: Encoding) -> Self {
        let mut text = self.text.to_string();
        let mut lines = self.lines.clone();
        for change in changes {
            match change.range {
                None => text.clone_from(&change.text),
                Some(range) => text.replace_range(lines.bytes(&text, range, encoding), &change.text),
            }
            lines = Arc::new(Lines::new(&text));
        }
        Self { version, text: text.into(), lines, uri: self.uri.clone(), path: self.path.clone() }
    }
}

impl Documents {
    /// Adds a document or its new state.
    pub(crate) fn put(&mut self, document: Document) {
        let mut texts = BTreeMap::clone(&self.texts);
        texts.insert(document.path.clone(), document.text.clone());
        self.texts = Arc::new(texts);
        self.open.insert(document.path.clone(), document);
    }

    /// Forgets a document.
    pub(crate) fn close(&mut self, uri: &Uri) {
        let path = path_of(uri);
        self.open.remove(&path);
        let mut texts = BTreeMap::clone(&self.texts);
        texts.remove(&path);
        self.texts = Arc::new(texts);
    }

    /// The document of an address.
    pub(crate) fn get(&self, uri: &Uri) -> Option<&Document> {
        self.open.get(&path_of(uri))
    }

    /// True while a file is open.
    pub(crate) fn is_open(&self, path: &Path) -> bool {
        self.open.contains_key(path)
    }

    /// All of them.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Document> {
        self.open.values()
    }

    /// Their texts by file.
    pub(crate) fn texts(&self) -> &Arc<BTreeMap<PathBuf, Arc<str>>> {
        &self.texts
    }

    /// The address of a file: as the editor spells it if it is open.
    pub(crate) fn uri(&self, path: &Path) -> Option<Uri> {
        match self.open.get(path) {
            Some(document) => Some(document.uri.clone()),
            None => uri_of(path),
        }
    }
}

/// The file that an address names; of an address that is none of a file, all of it.
pub(crate) fn path_of(uri: &Uri) -> PathBuf {
    let text = uri.as_str();
    let Some(rest) = text.strip_prefix("file://") else { return PathBuf::from(text) };
    // A host before the path is that of this machine.
    let path = rest.find('/').map_or(rest, |at| &rest[at..]);
    let decoded = decoded(path);
    // `/C:/folder` of Windows.
    let bytes = decoded.as_bytes();
    let drive = bytes.len() > 2 && bytes[0] == b'/' && bytes[1].is_ascii_alphabetic() && bytes[2] == b':';
    PathBuf::from(if drive { &decoded[1..] } else { &decoded })
}

/// The address of a file.
pub(crate) fn uri_of(path: &Path) -> Option<Uri> {
    let path = std::path::absolute(path).ok()?;
    let mut text = String::from("file://");
    let shown = path.to_str()?.replace('\\', "/");
    if !shown.starts_with('/') {
        text.push('/');
    }
    for byte in shown.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'.' | b'_' | b'~' => text.push(byte as char),
            other => text.push_str(&format!("%{other:02X}")),
        }
    }
    Uri::from_str(&text).ok()
}

/// A text without its percent signs; what is no Unicode text stays as it is.
fn decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let hex = text.get(at + 1..at + 3).filter(|_| bytes[at] == b'%');
        match hex.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) => {
                out.push(byte);
                at += 3;
            }
            None => {
                out.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8(out).unwrap_or_else(|_| text.to_string())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use lsp_types::{Position, Range};

    use super::*;

    #[test]
    fn addresses_are_files_and_back() {
        for path in ["/a/b c/ö.hyd", "/100%/x.mo", "/plain"] {
            assert_eq!(path_of(&uri_of(Path::new(path)).unwrap()), Path::new(path));
        }
        let odd = |text: &str| path_of(&Uri::from_str(text).unwrap());
        assert_eq!(odd("file:///C%3A/models/m.hyd"), Path::new("C:/models/m.hyd"));
        assert_eq!(odd("untitled:Untitled-1"), Path::new("untitled:Untitled-1"));
        assert_eq!(odd("file:///a%FF"), Path::new("/a%FF"));
    }

    #[test]
    fn changes_follow_each_other() {
        let document = Document::new(uri_of(Path::new("/m.hyd")).unwrap(), 1, "ab\ncd\n".into());
        let change = |from: (u32, u32), to: (u32, u32), text: &str| TextDocumentContentChangeEvent {
            range: Some(Range { start: Position::new(from.0, from.1), end: Position::new(to.0, to.1) }),
            range_length: None,
            text: text.into(),
        };
        let changes = [change((0, 1), (1, 1), "x\ny"), change((1, 1), (1, 2), ""), change((9, 0), (9, 9), "end")];
        let after = document.changed(2, &changes, Encoding::Utf16);
        assert_eq!((&*after.text, after.version), ("ax\ny\nend", 2));
    }
}

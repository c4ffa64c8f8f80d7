//! The file table, spans and origins.
//!
//! Spans are byte offsets in a file of the table; lines and columns are computed when somebody asks.

use std::sync::Arc;

use hyd_index::{IndexVec, TypedIndex, typed_index};

typed_index!(
    /// A text in the file table.
    FileId,
    "file"
);

/// A stretch of text: byte offsets `start..end` in `file`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// A span from byte offsets.
    pub fn new(file: FileId, start: usize, end: usize) -> Self {
        Self { file, start: start as u32, end: end as u32 }
    }

    /// The smallest span that covers both (of the first one's file).
    pub fn to(self, other: Span) -> Span {
        Span { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}

/// Line and column, both counted from 1; the column counts characters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Location {
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
}

/// Where a variable or an equation comes from: the instance it belongs to and the text that declares it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Origin {
    /// Instance path of the component, `""` for the top model.
    pub path: Arc<str>,
    /// The text.
    pub span: Span,
}

#[derive(Clone)]
struct Entry {
    name: Arc<str>,
    text: Arc<str>,
    line_starts: Arc<[u32]>,
}

impl Entry {
    fn new(name: Arc<str>, text: Arc<str>) -> Self {
        let mut line_starts = vec![0];
        line_starts.extend(text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(k, _)| k as u32 + 1));
        Entry { name, text, line_starts: line_starts.into() }
    }
}

/// All texts read so far; a copy shares them.
#[derive(Clone, Default)]
pub struct Files {
    entries: IndexVec<FileId, Entry>,
}

impl Files {
    /// An empty table.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a text under the name that messages show.
    pub fn add(&mut self, name: impl Into<Arc<str>>, text: impl Into<Arc<str>>) -> FileId {
        self.entries.push(Entry::new(name.into(), text.into()))
    }

    /// Puts another text in the place of that of a file, whose name it keeps.
    pub fn replace(&mut self, file: FileId, text: impl Into<Arc<str>>) {
        self.entries[file] = Entry::new(self.entries[file].name.clone(), text.into());
    }

    /// Takes over a file from a table that this one is an earlier copy of.
    pub fn adopt(&mut self, later: &Files, file: FileId) {
        for id in (self.entries.len()..=file.index()).map(FileId::new) {
            self.entries.push(later.entries[id].clone());
        }
        self.entries[file] = later.entries[file].clone();
    }

    /// Number of texts.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// True before the first text.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The name shown in messages.
    pub fn name(&self, file: FileId) -> &Arc<str> {
        &self.entries[file].name
    }

    /// The whole text.
    pub fn text(&self, file: FileId) -> &Arc<str> {
        &self.entries[file].text
    }

    /// All files in the order they were added.
    pub fn ids(&self) -> impl Iterator<Item = FileId> {
        (0..self.entries.len()).map(FileId::new)
    }

    /// Line and column of a span's start.
    pub fn location(&self, span: Span) -> Location {
        let entry = &self.entries[span.file];
        let line = entry.line_starts.partition_point(|&start| start <= span.start).max(1) - 1;
        let from = entry.line_starts[line] as usize;
        let column = entry.text.get(from..span.start as usize).map_or(0, |t| t.chars().count());
        Location { line: line as u32 + 1, column: column as u32 + 1 }
    }

    /// The spanned text (empty if the span does not fit the file).
    pub fn snippet(&self, span: Span) -> &str {
        self.entries[span.file].text.get(span.start as usize..span.end as usize).unwrap_or("")
    }
}

//! Syntax trees that outlive one class table: a text that has not changed since it was last read is not parsed again.
//!
//! For callers that ask about the same library again and again.  A file keeps its place in the file table for good, so that spans of
//! trees that were kept agree with those of trees that are made later.

use std::sync::Arc;

use hyd_source::{Diagnostic, FileId, Files, Outcome};
use hyd_syntax::tree::StoredDefinition;
use rustc_hash::FxHashMap;

/// Texts by name, each with its tree.
#[derive(Default)]
pub struct Trees {
    files: Files,
    by_name: FxHashMap<Arc<str>, Tree>,
}

struct Tree {
    file: FileId,
    stored: StoredDefinition,
    diagnostics: Vec<Diagnostic>,
}

impl Trees {
    /// No trees.
    pub fn new() -> Self {
        Self::default()
    }

    /// All texts that were ever read, each as it was read last.
    pub fn files(&self) -> &Files {
        &self.files
    }

    /// The tree of a text; parsed only if the text that was last read under this name is another one.
    pub fn parse(&mut self, name: &Arc<str>, text: &Arc<str>) -> (FileId, Outcome<StoredDefinition>) {
        let file = match self.by_name.get(name) {
            Some(known) if self.files.text(known.file) == text => {
                let outcome = Outcome { value: known.stored.clone(), diagnostics: known.diagnostics.clone() };
                return (known.file, outcome);
            }
            Some(known) => {
                self.files.replace(known.file, text.clone());
                known.file
            }
            None => self.files.add(name.clone(), text.clone()),
        };
        let Outcome { value: stored, diagnostics } = hyd_syntax::parse(file, text);
        let outcome = Outcome { value: stored.clone(), diagnostics: diagnostics.clone() };
        self.by_name.insert(name.clone(), Tree { file, stored, diagnostics });
        (file, outcome)
    }
}

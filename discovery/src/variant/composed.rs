//! Messages about a text that was put together from a study, for who wrote the study.
//!
//! The text begins with the model's file, and its lines are those of that file.  What follows nobody has written, so
//! nobody can look at it: a mark there becomes a sentence that says what stands in that place, and names that only
//! exist there give way to the user's.

use hyd_compiler::render::render;
use hyd_compiler::{Diagnostic, Files, Severity};

/// A text that was put together.
pub(crate) struct Composed {
    /// Its name in the table of files: that of the model's file.
    pub(crate) name: String,
    /// All of it.
    pub(crate) text: String,
    /// Bytes that are the model's file.
    pub(crate) own: usize,
    /// What follows: the byte after it, and what it is.
    pub(crate) parts: Vec<(usize, String)>,
    /// Names of classes that exist in it only, and which class of the user's stands for them.
    pub(crate) names: Vec<(String, String)>,
    /// Names of the variables of channels.
    pub(crate) channels: Vec<String>,
}

impl Composed {
    /// What the compiler says about it, as text.
    pub(crate) fn told(&self, files: &Files, diagnostics: &[Diagnostic]) -> String {
        let mut shown = Files::new();
        let mut own = None;
        for id in files.ids() {
            // The text itself comes first; a library may have a file of the same name.
            let is_own = own.is_none() && **files.name(id) == *self.name && **files.text(id) == *self.text;
            own = if is_own { Some(id) } else { own };
            let text = if is_own { &self.text[..self.own] } else { files.text(id) };
            shown.add(files.name(id).clone(), text);
        }
        let retold: Vec<Diagnostic> = diagnostics
            .iter()
            .map(|diagnostic| {
                let mut diagnostic = diagnostic.clone();
                // No advice with names that nobody has written.
                diagnostic.notes.retain(|note| !self.channels.iter().any(|name| note.contains(&format!("`{name}`"))));
                let mut marks = Vec::new();
                diagnostic.labels.retain(|label| {
                    let is_written = Some(label.span.file) != own || (label.span.start as usize) < self.own;
                    marks.extend((!is_written).then_some(label.span.start as usize));
                    is_written
                });
                let mut places: Vec<&str> = marks.into_iter().map(|mark| self.part(mark)).collect();
                places.dedup();
                diagnostic.notes.extend(places.into_iter().map(|place| format!("in {place}")));
                self.rename(&mut diagnostic.message);
                diagnostic.notes.iter_mut().for_each(|note| self.rename(note));
                diagnostic.labels.iter_mut().for_each(|label| self.rename(&mut label.message));
                diagnostic
            })
            .collect();
        render(&shown, &retold, false)
    }

    /// The warnings of the compiler, one sentence each, with the place where it stands in a text of the user's or of a library.
    pub(crate) fn warnings(&self, files: &Files, diagnostics: &[Diagnostic]) -> Vec<String> {
        let sentence = |diagnostic: &Diagnostic| {
            let mut message = diagnostic.message.clone();
            self.rename(&mut message);
            let mut spans = diagnostic.labels.iter().map(|label| label.span);
            let written = spans.find(|span| **files.name(span.file) != *self.name || (span.start as usize) < self.own);
            match written {
                Some(span) => format!("`{}`, line {}: {message}", files.name(span.file), files.location(span).line),
                None => message,
            }
        };
        let warnings = diagnostics.iter().filter(|own| own.severity == Severity::Warning);
        warnings.map(sentence).collect()
    }

    /// What stands at a byte behind the model's file.
    fn part(&self, at: usize) -> &str {
        let part = self.parts.iter().find(|(end, _)| at < *end).or(self.parts.last());
        part.map_or("", |(_, words)| words)
    }

    fn rename(&self, text: &mut String) {
        for (name, user) in &self.names {
            *text = text.replace(&format!("`{name}`"), &format!("`{user}`"));
        }
        for name in &self.channels {
            *text = text.replace(&format!("`{name}`"), "the channel");
        }
    }
}

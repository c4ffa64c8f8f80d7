//! Messages in the order in which they are given, and attempts whose messages count only if the attempt does.
//!
//! Whoever tries something calls [`Messages::begin`] before and [`Messages::end`] after it, and owns what was said in between: it
//! is given with [`Messages::report_all`], or dropped.  Attempts may stand within attempts.

use std::collections::HashMap;

use crate::{Diagnostic, FileId, Severity, Span};

/// Messages given so far, those of open attempts on top.
#[derive(Clone, Debug)]
pub struct Messages {
    given: Vec<Diagnostic>,
    tried: Vec<Vec<Diagnostic>>,
    /// How often [`Messages::is_repeated`] was asked of a place of which something had been said.
    repeated: HashMap<(FileId, u32), u32>,
}

impl Default for Messages {
    fn default() -> Self {
        Self::new()
    }
}

impl Messages {
    /// No messages.
    pub fn new() -> Self {
        Self { given: Vec::new(), tried: Vec::new(), repeated: HashMap::new() }
    }

    /// Adds a message; an error that was given before is not given again, since one mistake in a class that is instantiated many times
    /// is one message.
    pub fn report(&mut self, diagnostic: Diagnostic) {
        if diagnostic.severity == Severity::Error && self.iter().any(|known| *known == diagnostic) {
            return;
        }
        self.tried.last_mut().unwrap_or(&mut self.given).push(diagnostic);
    }

    /// True if this was said of this place so often that what would be proposed with it is not looked for again.  What is proposed may differ
    /// between instances of a class, but not between thousands.
    pub fn is_repeated(&mut self, message: &str, at: Span) -> bool {
        const OFTEN: u32 = 100;
        let is_there = |known: &Diagnostic| known.labels.first().is_some_and(|label| label.span == at);
        if !self.iter().any(|known| known.message == message && is_there(known)) {
            return false;
        }
        let count = self.repeated.entry((at.file, at.start)).or_insert(0);
        *count += 1;
        *count > OFTEN
    }

    /// Adds all messages of an attempt.
    pub fn report_all(&mut self, said: Vec<Diagnostic>) {
        said.into_iter().for_each(|diagnostic| self.report(diagnostic));
    }

    /// All messages, those of open attempts last.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.given.iter().chain(self.tried.iter().flatten())
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.given.len() + self.tried.iter().map(Vec::len).sum::<usize>()
    }

    /// True if one of them is an error.
    pub fn has_errors(&self) -> bool {
        self.iter().any(|known| known.severity == Severity::Error)
    }

    /// Takes back what was said in error.
    pub fn withdraw(&mut self, wrong: impl Fn(&Diagnostic) -> bool) {
        let layers = std::iter::once(&mut self.given).chain(&mut self.tried);
        layers.for_each(|layer| layer.retain(|known| !wrong(known)));
    }

    /// Begins an attempt.
    pub fn begin(&mut self) {
        self.tried.push(Vec::new());
    }

    /// Ends the attempt begun last and hands over what was said in it.
    pub fn end(&mut self) -> Vec<Diagnostic> {
        self.tried.pop().unwrap_or_default()
    }

    /// The messages, when all attempts have ended.
    pub fn into_given(self) -> Vec<Diagnostic> {
        debug_assert!(self.tried.is_empty(), "invariant: attempts end");
        self.given
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Code;

    fn error(text: &str) -> Diagnostic {
        Diagnostic::error(Code::Value, text)
    }

    #[test]
    fn what_is_said_in_an_attempt_counts_when_it_is_given() {
        let mut messages = Messages::new();
        messages.report(error("first"));
        messages.begin();
        messages.report(error("dropped"));
        messages.begin();
        // Said before, outside: an attempt does not say it again.
        messages.report(error("first"));
        messages.report(error("kept"));
        let inner = messages.end();
        assert_eq!(inner, [error("kept")]);
        messages.end();
        messages.report_all(inner);
        assert_eq!(messages.into_given(), [error("first"), error("kept")]);
    }
}

//! Slips that cost a section its head or a block its end: `equaton`, and `end;` where `end if;` is meant.
//!
//! Each makes good text unreadable up to the end of its class: what follows stands in the wrong place.  One message says what
//! is wrong; after it the class is *lost*, and nothing is said of misplaced text until it ends.

use hyd_source::{Code, Diagnostic, Span, did_you_mean};

use crate::build::Builder;
use crate::build_code::BlockKind;
use crate::grammar::Node;
use crate::recovery::is_keyword;

/// Words that stand on a line of their own and open a section.
const HEADS: [&str; 4] = ["equation", "algorithm", "protected", "public"];

impl<'t> Builder<'t> {
    /// Reports a misspelt word that should open a section; true if there is one.
    pub(crate) fn misspelt_head(&mut self, node: &Node<'t>) -> bool {
        let mut at = node.as_span().start();
        let mut word = self.token(at);
        if word == "initial" {
            at += word.len();
            at += self.text[at..].len() - self.text[at..].trim_start().len();
            word = self.token(at);
        }
        let rest = &self.text[(at + word.len()).min(self.text.len())..];
        let alone = rest.lines().next().is_some_and(|line| line.trim().is_empty());
        let is_word = word.starts_with(|c: char| c.is_ascii_alphabetic());
        if !alone || !is_word || is_keyword(word) {
            return false;
        }
        let Some(help) = did_you_mean(word, HEADS) else { return false };
        let span = Span::new(self.file, at, at + word.len());
        self.error(span, format!("`{word}` opens no section")).notes.push(help);
        self.lost = true;
        true
    }

    /// Reports `end;` after a section in which a block is open, which it was to close; `from` is the end of the section.
    pub(crate) fn bare_end(&mut self, from: usize, kind: BlockKind, head: Span) -> bool {
        let at = from + (self.text[from..].len() - self.text[from..].trim_start().len());
        if self.token(at) != "end" || !self.text[at + 3..].trim_start().starts_with(';') {
            return false;
        }
        let word = kind.word();
        let message = format!("`end` does not say what it closes: `end {word};`");
        let diagnostic = Diagnostic::error(Code::Syntax, message).at(Span::new(self.file, at, at + 3), "");
        self.report(diagnostic.with(head, format!("this `{word}` is open")));
        self.lost = true;
        true
    }
}

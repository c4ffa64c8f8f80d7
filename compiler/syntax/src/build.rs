//! What all parts of the tree builder share: the file, the messages, names and spans.
//!
//! The builders walk pest's nodes.  A node that the grammar guarantees is taken with a fallback instead of a panic, so
//! that a mistake in a builder shows as a wrong tree in a test and never as a crash for the user.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, FileId, Span};
use rustc_hash::FxHashMap;

use crate::grammar::{Node, Rule};
use crate::scan::MAX_BLOCKS;
use crate::tree::{Ident, Name, Path};

/// State of building one file.
pub(crate) struct Builder<'t> {
    /// The file.
    pub(crate) file: FileId,
    /// Its cleaned text.
    pub(crate) text: &'t str,
    /// Messages so far.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// A `;` was missing after the item before, so that the next one may be its rest: no message about it.
    pub(crate) recovered: bool,
    /// The text ends in a string or comment without end: what is missing at its end is no news.
    pub(crate) truncated: bool,
    /// Subscript brackets around the place that is being built.
    pub(crate) subscripts: usize,
    /// Annotations around it: lists may be empty there, because they are data and no arrays.
    pub(crate) annotations: usize,
    /// A limit was exceeded: the rest of the text is not looked at.
    pub(crate) gave_up: bool,
    /// A section lacks its head or a block its end: what follows in the class stands in the wrong place without fault.
    pub(crate) lost: bool,
    /// Offset of the last `end Name` for each name.
    pub(crate) ends: FxHashMap<&'t str, usize>,
    names: FxHashMap<&'t str, Name>,
}

impl<'t> Builder<'t> {
    pub(crate) fn new(file: FileId, text: &'t str) -> Self {
        Self {
            file,
            text,
            diagnostics: Vec::new(),
            recovered: false,
            truncated: false,
            gave_up: false,
            lost: false,
            subscripts: 0,
            annotations: 0,
            ends: FxHashMap::default(),
            names: FxHashMap::default(),
        }
    }

    /// The shared copy of a name.
    pub(crate) fn name(&mut self, text: &'t str) -> Name {
        self.names.entry(text).or_insert_with(|| Arc::from(text)).clone()
    }

    /// The span of a node without the blanks that pest counts to it.
    pub(crate) fn span(&self, node: &Node<'t>) -> Span {
        let start = node.as_span().start();
        Span::new(self.file, start, start + node.as_str().trim_end().len())
    }

    /// The span of a node whose last token may be a `;` or blanks: without them.
    pub(crate) fn trimmed_span(&self, node: &Node<'t>) -> Span {
        let start = node.as_span().start();
        let text = node.as_str().trim_end();
        let text = text.strip_suffix(';').unwrap_or(text).trim_end();
        Span::new(self.file, start, start + text.len())
    }

    pub(crate) fn error(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.report(Diagnostic::error(Code::Syntax, message).at(span, ""))
    }

    pub(crate) fn outside_profile(&mut self, span: Span, message: impl Into<String>) {
        self.report(Diagnostic::error(Code::OutsideProfile, message).at(span, ""));
    }

    pub(crate) fn report(&mut self, diagnostic: Diagnostic) -> &mut Diagnostic {
        self.diagnostics.push(diagnostic);
        let last = self.diagnostics.len() - 1;
        &mut self.diagnostics[last]
    }

    /// Reports nesting beyond the limit if `depth` classes or blocks are open, and gives up.
    pub(crate) fn check_depth(&mut self, depth: usize, span: Span) {
        if depth >= MAX_BLOCKS && !self.gave_up {
            self.gave_up = true;
            let message = format!("classes or blocks are nested more than {MAX_BLOCKS} deep");
            self.report(Diagnostic::error(Code::Limit, message).at(span, ""));
        }
    }

    pub(crate) fn ident(&mut self, node: &Node<'t>) -> Ident {
        Ident { name: self.name(node.as_str()), span: self.span(node) }
    }

    pub(crate) fn path(&mut self, node: Node<'t>) -> Path {
        let span = self.span(&node);
        let mut path = Path { global: false, parts: Vec::new(), span };
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::dot => path.global = true,
                _ => path.parts.push(self.ident(&part)),
            }
        }
        path
    }

    /// The text of a description, its parts joined; `None` if it is empty.
    pub(crate) fn description(&mut self, node: Node<'t>) -> Option<Name> {
        let text: String = node.into_inner().map(|part| unescape(part.as_str())).collect();
        Some(Arc::from(text))
    }
}

/// The value of a string literal, given with its quotes.
pub(crate) fn unescape(literal: &str) -> String {
    let inner = literal.strip_prefix('"').unwrap_or(literal);
    let inner = inner.strip_suffix('"').unwrap_or(inner);
    let mut text = String::with_capacity(inner.len());
    let mut chars = inner.chars();
    while let Some(c) = chars.next() {
        if c != '\\' {
            text.push(c);
            continue;
        }
        match chars.next() {
            Some('n') => text.push('\n'),
            Some('t') => text.push('\t'),
            Some('r') => text.push('\r'),
            Some('a') => text.push('\u{7}'),
            Some('b') => text.push('\u{8}'),
            Some('f') => text.push('\u{c}'),
            Some('v') => text.push('\u{b}'),
            Some(other) => text.push(other),
            None => {}
        }
    }
    text
}

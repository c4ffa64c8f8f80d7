//! Elements of a document with messages that name file and line.
//!
//! Documents are read whole; declarations of types (`<!DOCTYPE`) and with them entities that grow are refused by the reader.

use std::str::FromStr;

use roxmltree::{Document, Node, ParsingOptions};

use crate::fault::Fault;

/// Elements and texts that a document may have: a unit with a million variables has three million.
const MOST_NODES: u32 = 50_000_000;

/// An element, and which file it stands in.
#[derive(Clone, Copy)]
pub(crate) struct Element<'a> {
    node: Node<'a, 'a>,
    place: &'a str,
}

/// Reads a document.  `place`: what messages call it.
pub(crate) fn read<'a>(text: &'a str, place: &str) -> Result<Document<'a>, Fault> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| {
        let line = error.pos().row;
        // The reader ends its sentences with a place of its own.
        let reason = error.to_string();
        let is_place = |tail: &str| tail.chars().all(|c| c.is_ascii_digit() || c == ':');
        let reason = match reason.rsplit_once(" at ") {
            Some((sentence, tail)) if is_place(tail) => sentence,
            _ => reason.as_str(),
        };
        Fault::new(format!("{place}, line {line}: {reason}"))
    })
}

/// Takes bytes as text.
pub(crate) fn text<'a>(bytes: &'a [u8], place: &str) -> Result<&'a str, Fault> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
        Fault::new(format!("{place}, line {line}: the text is not in UTF-8"))
    })?;
    Ok(text.trim_start_matches('\u{feff}'))
}

impl<'a> Element<'a> {
    pub(crate) fn root(document: &'a Document<'a>, place: &'a str) -> Self {
        Self { node: document.root_element(), place }
    }

    pub(crate) fn name(self) -> &'a str {
        self.node.tag_name().name()
    }

    /// The line on which it begins, from 1.
    pub(crate) fn line(self) -> u32 {
        self.node.document().text_pos_at(self.node.range().start).row
    }

    /// What is wrong with it.
    pub(crate) fn fault(self, sentence: impl std::fmt::Display) -> Fault {
        Fault::new(format!("{}, line {}: {sentence}", self.place, self.line()))
    }

    pub(crate) fn children(self) -> impl Iterator<Item = Element<'a>> {
        let place = self.place;
        self.node.children().filter(Node::is_element).map(move |node| Element { node, place })
    }

    pub(crate) fn child(self, name: &str) -> Option<Element<'a>> {
        self.children().find(|child| child.name() == name)
    }

    pub(crate) fn attribute(self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    pub(crate) fn required(self, name: &str) -> Result<&'a str, Fault> {
        self.attribute(name).ok_or_else(|| self.fault(format!("`{}` has no `{name}`", self.name())))
    }

    pub(crate) fn flag(self, name: &str) -> Result<bool, Fault> {
        match self.attribute(name).map(str::trim) {
            None | Some("false" | "0") => Ok(false),
            Some("true" | "1") => Ok(true),
            Some(other) => Err(self.fault(format!("`{name}` is `{other}`, which is neither true nor false"))),
        }
    }

    /// An attribute that is a number.
    pub(crate) fn number<T: FromStr>(self, name: &str) -> Result<Option<T>, Fault> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        let wrong = || self.fault(format!("`{name}` is `{}`, which is not a number of its kind", shortened(text)));
        text.trim().parse().map(Some).map_err(|_| wrong())
    }

    /// An attribute that is a list of numbers.
    pub(crate) fn numbers<T: FromStr>(self, name: &str) -> Result<Option<Vec<T>>, Fault> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        let one = |word: &str| {
            word.parse()
                .map_err(|_| self.fault(format!("`{}` in `{name}` is not a number of its kind", shortened(word))))
        };
        text.split_whitespace().map(one).collect::<Result<_, _>>().map(Some)
    }
}

/// The beginning of a text, for messages.
pub(crate) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_string(),
    }
}

//! Elements written one after the other; what XML 1.0 cannot hold is left out of texts.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, Event};

/// Attributes of an element, in their order.
#[derive(Default)]
pub(crate) struct Attributes(Vec<(&'static str, String)>);

impl Attributes {
    pub(crate) fn with(mut self, name: &'static str, value: impl ToString) -> Self {
        self.0.push((name, legal(&value.to_string())));
        self
    }

    /// A text of which line ends and tabs stay what they are.
    pub(crate) fn exact(mut self, name: &'static str, value: &str) -> Self {
        let keep = |c: &char| matches!(c, '\t' | '\n' | '\r') || legal(&c.to_string()).starts_with(*c);
        self.0.push((name, value.chars().filter(keep).collect()));
        self
    }

    /// Only if there is a value.
    pub(crate) fn maybe(self, name: &'static str, value: Option<impl ToString>) -> Self {
        match value {
            Some(value) => self.with(name, value),
            None => self,
        }
    }

    /// Only if the text is not empty.
    pub(crate) fn text(self, name: &'static str, value: &str) -> Self {
        if value.is_empty() { self } else { self.with(name, value) }
    }

    /// Only if it holds.
    pub(crate) fn flag(self, name: &'static str, value: bool) -> Self {
        if value { self.with(name, true) } else { self }
    }
}

/// A document in work, in memory: writing cannot fail.
pub(crate) struct Document(Writer<Vec<u8>>);

impl Document {
    pub(crate) fn new() -> Self {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        put(&mut writer, Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)));
        Self(writer)
    }

    /// An element without content.
    pub(crate) fn empty(&mut self, name: &str, attributes: Attributes) {
        put(&mut self.0, Event::Empty(start(name, attributes)));
    }

    /// An element with content; empty ones come out short.
    pub(crate) fn element(&mut self, name: &str, attributes: Attributes, content: impl FnOnce(&mut Self)) {
        put(&mut self.0, Event::Start(start(name, attributes)));
        content(self);
        put(&mut self.0, Event::End(BytesEnd::new(name)));
    }

    pub(crate) fn finish(self) -> Vec<u8> {
        let mut bytes = self.0.into_inner();
        bytes.push(b'\n');
        bytes
    }
}

fn start(name: &str, attributes: Attributes) -> BytesStart<'_> {
    let mut element = BytesStart::new(name);
    attributes.0.iter().for_each(|(name, value)| element.push_attribute((*name, value.as_str())));
    element
}

fn put(writer: &mut Writer<Vec<u8>>, event: Event<'_>) {
    // A vector takes every byte.
    let _ = writer.write_event(event);
}

/// Without characters that no document may hold; line ends become spaces, as readers make them.
fn legal(text: &str) -> String {
    let keep = |c: char| match c {
        '\t' | '\n' | '\r' => Some(' '),
        '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => None,
        _ => Some(c),
    };
    text.chars().filter_map(keep).collect()
}

/// A number so that reading it gives the same bits.
pub(crate) fn number(value: f64) -> String {
    format!("{value:?}")
}

/// Numbers with spaces between.
pub(crate) fn list(values: impl IntoIterator<Item = String>) -> String {
    values.into_iter().collect::<Vec<_>>().join(" ")
}

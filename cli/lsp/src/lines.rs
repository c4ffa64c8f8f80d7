//! Positions of the protocol and bytes of a text: lines from 0, columns in UTF-16 units or in bytes, whatever was agreed on.
//!
//! A line ends at `\n`, `\r\n` or a lone `\r` (LSP 3.17, "Text Documents").  Any position has a byte: one behind the end of a line stands
//! at that end, one inside a character at its beginning.

use hyd_source::Span;
use lsp_types::{Position, Range};

/// How columns are counted.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Encoding {
    /// In units of UTF-16, which all clients know.
    #[default]
    Utf16,
    /// In bytes.
    Utf8,
}

impl Encoding {
    /// Columns that a stretch of a line takes.
    pub(crate) fn width(self, text: &str) -> u32 {
        match self {
            Encoding::Utf8 => text.len() as u32,
            Encoding::Utf16 => text.chars().map(|c| c.len_utf16() as u32).sum(),
        }
    }
}

/// Where the lines of a text begin.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lines {
    starts: Vec<u32>,
    /// Every character is one byte, and one unit of UTF-16: columns need not be counted, however long a line is.
    plain: bool,
}

impl Lines {
    /// The lines of a text.
    pub(crate) fn new(text: &str) -> Self {
        let bytes = text.as_bytes();
        let ends = |k: usize| bytes[k] == b'\n' || bytes[k] == b'\r' && bytes.get(k + 1) != Some(&b'\n');
        let starts = std::iter::once(0).chain((0..bytes.len()).filter(|&k| ends(k)).map(|k| k as u32 + 1));
        Self { starts: starts.collect(), plain: text.is_ascii() }
    }

    /// The text of a line without its end, and where it begins.
    fn line<'t>(&self, text: &'t str, line: u32) -> Option<(usize, &'t str)> {
        let start = *self.starts.get(line as usize)? as usize;
        let end = self.starts.get(line as usize + 1).map_or(text.len(), |&next| next as usize);
        let line = text.get(start..end)?;
        Some((start, line.trim_end_matches(['\n', '\r'])))
    }

    /// The byte at a position.
    pub(crate) fn byte(&self, text: &str, position: Position, encoding: Encoding) -> usize {
        let Some((start, line)) = self.line(text, position.line) else { return text.len() };
        if self.plain {
            return start + line.len().min(position.character as usize);
        }
        let mut column = 0;
        for (at, c) in line.char_indices() {
            column += encoding.width(&line[at..at + c.len_utf8()]);
            if column > position.character {
                return start + at;
            }
        }
        start + line.len()
    }

    /// The position of a byte.
    pub(crate) fn position(&self, text: &str, byte: usize, encoding: Encoding) -> Position {
        let byte = byte.min(text.len());
        let line = self.line_of(byte);
        let start = self.starts.get(line as usize).map_or(0, |&start| start as usize);
        if self.plain {
            return Position { line, character: (byte - start) as u32 };
        }
        let mut end = byte;
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let column = encoding.width(text.get(start..end).unwrap_or_default());
        Position { line, character: column }
    }

    /// The line that a byte stands in.
    pub(crate) fn line_of(&self, byte: usize) -> u32 {
        self.starts.partition_point(|&start| start as usize <= byte).max(1) as u32 - 1
    }

    /// The range of a stretch of the text.
    pub(crate) fn range(&self, text: &str, span: Span, encoding: Encoding) -> Range {
        Range {
            start: self.position(text, span.start as usize, encoding),
            end: self.position(text, span.end as usize, encoding),
        }
    }

    /// The bytes of a range; one that ends before it begins is empty.
    pub(crate) fn bytes(&self, text: &str, range: Range, encoding: Encoding) -> std::ops::Range<usize> {
        let start = self.byte(text, range.start, encoding);
        start..self.byte(text, range.end, encoding).max(start)
    }

    /// How many lines there are.
    pub(crate) fn count(&self) -> u32 {
        self.starts.len() as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_texts_are_counted_alike() {
        let text = "ab\r\nc\n";
        for line in 0..4 {
            for character in 0..5 {
                let position = Position { line, character };
                let counted = Lines { plain: false, ..Lines::new(text) };
                let byte = Lines::new(text).byte(text, position, Encoding::Utf16);
                assert_eq!(byte, counted.byte(text, position, Encoding::Utf16));
                let back = Lines::new(text).position(text, byte, Encoding::Utf16);
                assert_eq!(back, counted.position(text, byte, Encoding::Utf16));
            }
        }
    }

    #[test]
    fn positions_and_bytes_agree() {
        let text = "a𝄞ö\r\nzwei\rdrei\n";
        let lines = Lines::new(text);
        let at = |line, character, encoding| lines.byte(text, Position { line, character }, encoding);
        // One character beyond the basic plane is two units and four bytes.
        assert_eq!((at(0, 1, Encoding::Utf16), at(0, 3, Encoding::Utf16), at(0, 4, Encoding::Utf16)), (1, 5, 7));
        assert_eq!((at(0, 2, Encoding::Utf16), at(0, 5, Encoding::Utf8), at(0, 99, Encoding::Utf8)), (1, 5, 7));
        assert_eq!((at(1, 0, Encoding::Utf16), at(2, 4, Encoding::Utf16), at(3, 0, Encoding::Utf16)), (9, 18, 19));
        assert_eq!(at(9, 9, Encoding::Utf16), text.len());
        for encoding in [Encoding::Utf16, Encoding::Utf8] {
            for byte in (0..=text.len()).filter(|&k| text.is_char_boundary(k) && !matches!(k, 8)) {
                let position = lines.position(text, byte, encoding);
                assert_eq!(lines.byte(text, position, encoding), byte, "{position:?}");
            }
        }
    }
}

//! The layout of `hyd fmt`, as changes of the blanks between tokens: of the whole text, or of those in a range.

use hyd_source::Files;
use hyd_syntax::tokens::{Token, tokens};
use lsp_types::{Position, Range, TextEdit};

use crate::documents::Document;
use crate::session::Session;

/// The changes.  None where the text has a syntax error, so that it is left as it is.
pub(crate) fn formatting(session: &Session, document: &Document, range: Option<Range>) -> Option<Vec<TextEdit>> {
    let text = &document.text;
    let mut files = Files::new();
    let file = files.add("text", text.clone());
    let formatted = hyd_format::format(file, text).value?;
    let (before, after): (Vec<Token<'_>>, Vec<Token<'_>>) = (tokens(text).collect(), tokens(&formatted).collect());
    let bytes = match range {
        // Whole lines, as what is laid out.
        Some(Range { start, end }) => {
            let whole = Range { start: Position::new(start.line, 0), end: Position::new(end.line, u32::MAX) };
            document.lines.bytes(text, whole, session.settings.encoding)
        }
        None => 0..text.len(),
    };
    let (old, new) = (gaps(text, &before), gaps(&formatted, &after));
    let changed = old.into_iter().zip(new).filter(|((at, old), (_, new))| {
        old != new && bytes.start <= at + old.len() && (*at < bytes.end || range.is_none())
    });
    let edits = changed.map(|((at, old), (_, new))| {
        let start = document.lines.position(text, at, session.settings.encoding);
        let end = document.lines.position(text, at + old.len(), session.settings.encoding);
        TextEdit { range: Range { start, end }, new_text: new.to_string() }
    });
    Some(edits.collect())
}

/// What stands before each token and behind the last, and where.
fn gaps<'t>(text: &'t str, tokens: &[Token<'t>]) -> Vec<(usize, &'t str)> {
    let mut end = 0;
    let mut found = Vec::new();
    for token in tokens {
        found.push((end, &text[end..token.at]));
        end = token.at + token.text.len();
    }
    found.push((end, &text[end..]));
    found
}

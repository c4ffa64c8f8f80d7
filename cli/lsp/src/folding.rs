//! What can be folded: classes, their sections, loops and branches, brackets over several lines, comments.

use hyd_syntax::is_keyword;
use hyd_syntax::tokens::{Kind, Token, tokens};
use lsp_types::{FoldingRange, FoldingRangeKind};

use crate::documents::Document;
use crate::session::Session;

/// The stretches of lines of a document.
pub(crate) fn folding(session: &mut Session, document: &Document) -> Vec<FoldingRange> {
    let names = session.parsed(&document.path, &document.text);
    let text = &*document.text;
    let line = |byte: usize| document.lines.line_of(byte);
    let mut found: Vec<(u32, u32, Option<FoldingRangeKind>)> = Vec::new();
    for class in &names.classes {
        // The line of the end stays in sight.
        found.push((line(class.def.span.start as usize), line(class.def.span.end as usize).saturating_sub(1), None));
    }
    let mut open: Vec<(&str, usize)> = Vec::new();
    let mut comments: Option<(u32, u32)> = None;
    // The first line of a section that has not ended.
    let mut section: Option<u32> = None;
    let all: Vec<Token<'_>> = tokens(text).collect();
    for (k, token) in all.iter().enumerate() {
        let from = line(token.at);
        let word = |at: usize| all.get(at).filter(|next| next.kind == Kind::Word);
        let begins = token.is_one_of(&["equation", "algorithm"]);
        let is_initial =
            token.is("initial") && word(k + 1).is_some_and(|next| next.is_one_of(&["equation", "algorithm"]));
        let ends_class = token.is("end") && word(k + 1).is_some_and(|next| !is_keyword(next.text));
        if begins && k > 0 && all[k - 1].is("initial") {
            // It has begun with that word.
        } else if begins || is_initial || ends_class || token.is_one_of(&["public", "protected", "external"]) {
            found.extend(section.take().map(|first| (first, from.saturating_sub(1), None)));
            section = (begins || is_initial).then_some(from);
        }
        if token.kind == Kind::LineComment && token.breaks > 0 {
            comments = match comments {
                Some((first, last)) if last + 1 == from => Some((first, from)),
                earlier => {
                    found.extend(earlier.map(|(first, last)| (first, last, Some(FoldingRangeKind::Comment))));
                    Some((from, from))
                }
            };
        } else if token.kind == Kind::BlockComment {
            found.push((from, line(token.at + token.text.len()), Some(FoldingRangeKind::Comment)));
        } else if token.opens() {
            open.push(("(", token.at));
        } else if token.closes() {
            if let Some(at) = open.iter().rposition(|(what, _)| *what == "(") {
                found.push((line(open[at].1), from.saturating_sub(1), None));
                open.truncate(at);
            }
        } else if token.is_one_of(&["for", "if", "when", "while"]) {
            let ends = k > 0 && all[k - 1].is("end");
            let begins_line = token.breaks > 0 || k == 0;
            if ends {
                if let Some(at) = open.iter().rposition(|(what, _)| *what == token.text) {
                    found.push((line(open[at].1), from.saturating_sub(1), None));
                    open.truncate(at);
                }
            } else if begins_line {
                open.push((token.text, token.at));
            }
        }
    }
    found.extend(comments.map(|(first, last)| (first, last, Some(FoldingRangeKind::Comment))));
    found.retain(|(first, last, _)| first < last);
    found.sort_by_key(|(first, last, _)| (*first, *last));
    found.dedup_by_key(|(first, last, _)| (*first, *last));
    let range = |(start_line, end_line, kind)| FoldingRange { start_line, end_line, kind, ..FoldingRange::default() };
    found.into_iter().map(range).collect()
}

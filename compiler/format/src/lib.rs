//! The text of a model laid out in one way: `hyd fmt`.
//!
//! [`format`] parses the text, and leaves it alone if that finds errors.  Then it works on the tokens and not on the
//! tree, so that comments, spellings of numbers and strings stay as they were written: tokens ([`hyd_syntax::tokens`]),
//! grouped to items of one indentation each (`items`), spaces between them (`spacing`), places where a line may end
//! (`breaks`), and the cheapest choice among these places (`lines`).  Only the space between tokens changes, which is
//! checked before the text is handed out.  Line ends of the author are not kept, but for an empty line between items
//! and for the rows of tables.

mod breaks;
mod items;
mod lines;
mod spacing;

#[cfg(test)]
mod tests;

use hyd_source::{Code, Diagnostic, FileId, Outcome, Severity};
use hyd_syntax::tokens::{Kind, Token, tokens};

/// Columns of a line; a line is longer only where it holds what cannot be broken.
pub const WIDTH: usize = 120;
/// Columns of a level of nesting.
const STEP: usize = 2;

/// The text in its layout; `None`, with messages, if it is not syntactically correct.
///
/// `file` is the file that messages name.  Formatting the result changes nothing.
pub fn format(file: FileId, text: &str) -> Outcome<Option<String>> {
    let mut parsed = hyd_syntax::parse(file, text).diagnostics;
    parsed.retain(|diagnostic| diagnostic.severity == Severity::Error);
    if !parsed.is_empty() {
        return Outcome { value: None, diagnostics: parsed };
    }
    let before: Vec<Token<'_>> = tokens(text).collect();
    let formatted = lay_out(&before, if text.contains("\r\n") { "\r\n" } else { "\n" });
    if same_tokens(&before, &tokens(&formatted).collect::<Vec<_>>()) {
        return Outcome { value: Some(formatted), diagnostics: Vec::new() };
    }
    let message = "the formatter would change more than the layout of this text, so the text is left as it is";
    Outcome { value: None, diagnostics: vec![Diagnostic::error(Code::Limit, message)] }
}

fn lay_out(tokens: &[Token<'_>], line_end: &str) -> String {
    let mut text = String::new();
    for item in items::items(tokens) {
        if item.blank && !text.is_empty() {
            text.push_str(line_end);
        }
        lines::write_item(&mut text, &tokens[item.tokens.clone()], &item, line_end);
    }
    text
}

/// Both texts consist of the same tokens; comments count, but not the blanks at the ends of their lines.
fn same_tokens(before: &[Token<'_>], after: &[Token<'_>]) -> bool {
    before.len() == after.len()
        && before.iter().zip(after).all(|(a, b)| a.kind == b.kind && a.text == b.text)
        && !after.iter().any(|token| token.kind == Kind::Symbol && token.text.is_empty())
}

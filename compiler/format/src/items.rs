//! Tokens to items: what begins on a line of its own, with its depth.
//!
//! An item is a declaration or an equation up to its `;`, the head of a class or of a block (`if c then`), a section word, an
//! `end`, or a comment between those.  Keywords and brackets decide, as the text is known to be correct.  A comment on the line on
//! which an item ends belongs to the item.

use std::ops::Range;

use hyd_syntax::tokens::{Kind, Token};

/// What begins on a line of its own.
#[derive(Debug)]
pub(crate) struct Item {
    /// Levels of nesting.
    pub(crate) depth: usize,
    pub(crate) tokens: Range<usize>,
    /// An empty line stood before it.
    pub(crate) blank: bool,
    /// It opens a level: lines that continue it are set off from what follows.
    pub(crate) head: bool,
    /// It stands in a section of equations or statements.
    pub(crate) code: bool,
}

/// An open class or block.
enum Open {
    Class { code: bool },
    Block,
}

/// All items of a file.
pub(crate) fn items(tokens: &[Token<'_>]) -> Vec<Item> {
    let mut reader = Reader { tokens, at: 0, open: Vec::new(), items: Vec::new() };
    while reader.at < tokens.len() {
        reader.item();
    }
    reader.items
}

const KINDS: [&str; 8] = ["class", "model", "block", "connector", "record", "type", "package", "function"];
const CLASS_PREFIXES: [&str; 6] = ["encapsulated", "partial", "expandable", "pure", "impure", "operator"];
const ELEMENT_PREFIXES: [&str; 5] = ["redeclare", "final", "inner", "outer", "replaceable"];

struct Reader<'a, 't> {
    tokens: &'a [Token<'t>],
    at: usize,
    open: Vec<Open>,
    items: Vec<Item>,
}

impl Reader<'_, '_> {
    /// Reads one item.
    fn item(&mut self) {
        let start = self.at;
        let first = self.after_comments(start);
        if first > start && self.tokens.get(first).is_none_or(|token| token.breaks > 0) {
            return self.push(first, self.open.len(), false);
        }
        let Some(token) = self.tokens.get(first) else { return self.push(first, self.open.len(), false) };
        match token.text {
            "end" => {
                self.open.pop();
                self.push(self.statement(first), self.open.len(), false);
            }
            "public" | "protected" => self.section(first + 1, false),
            "equation" | "algorithm" => self.section(first + 1, true),
            "initial" if self.word(self.next(first), &["equation", "algorithm"]) => {
                self.section(self.next(first) + 1, true);
            }
            _ => match self.class_head(first) {
                Some(end) => {
                    self.push(end, self.open.len(), true);
                    self.open.push(Open::Class { code: false });
                }
                None if self.in_code() => self.code(first),
                None => self.push(self.statement(first), self.open.len(), false),
            },
        }
    }

    /// A word that begins a section of a class.
    fn section(&mut self, end: usize, equations: bool) {
        if let Some(Open::Class { code }) = self.open.last_mut() {
            *code = equations;
        }
        self.push(end, self.open.len().saturating_sub(1), false);
    }

    /// An equation, a statement, or the head of a block of such.
    fn code(&mut self, first: usize) {
        let depth = self.open.len();
        let inner = depth.saturating_sub(1);
        match self.tokens[first].text {
            "if" | "when" => {
                self.push(self.past_then(first), depth, true);
                self.open.push(Open::Block);
            }
            "for" | "while" => {
                self.push(self.past(first, "loop"), depth, true);
                self.open.push(Open::Block);
            }
            "elseif" | "elsewhen" => self.push(self.past_then(first), inner, true),
            "else" => self.push(first + 1, inner, true),
            _ => self.push(self.statement(first), depth, false),
        }
    }

    /// Ends an item, with the comments that stand on its last line.
    fn push(&mut self, end: usize, depth: usize, head: bool) {
        let start = self.at;
        let mut end = end.max(start + 1).min(self.tokens.len());
        while self.tokens.get(end).is_some_and(|token| token.is_comment() && token.breaks == 0) {
            end += 1;
        }
        let code = self.in_code();
        self.items.push(Item { depth, tokens: start..end, blank: self.tokens[start].breaks > 1, head, code });
        self.at = end;
    }

    fn in_code(&self) -> bool {
        matches!(self.open.last(), Some(Open::Block | Open::Class { code: true }))
    }

    /// The first token that is not a comment or stands on another line than the comments before it.
    fn after_comments(&self, start: usize) -> usize {
        let mut at = start;
        while self.tokens.get(at).is_some_and(|token| token.is_comment() && (at == start || token.breaks == 0)) {
            at += 1;
        }
        at
    }

    /// The next token that is not a comment.
    fn next(&self, at: usize) -> usize {
        let after = self.tokens.get(at + 1..).unwrap_or_default();
        at + 1 + after.iter().take_while(|token| token.is_comment()).count()
    }

    fn word(&self, at: usize, list: &[&str]) -> bool {
        self.tokens.get(at).is_some_and(|token| token.is_one_of(list))
    }

    /// The end of what goes up to a `;` outside of brackets.
    fn statement(&self, first: usize) -> usize {
        self.past(first, ";")
    }

    /// The place after the first `text` outside of brackets.
    fn past(&self, first: usize, text: &str) -> usize {
        let mut depth = 0usize;
        for (at, token) in self.tokens.iter().enumerate().skip(first) {
            if token.opens() {
                depth += 1;
            } else if token.closes() {
                depth = depth.saturating_sub(1);
            } else if depth == 0 && token.is(text) {
                return at + 1;
            }
        }
        self.tokens.len()
    }

    /// The place after the `then` that belongs to the word at `first`; the condition may hold `if` expressions.
    fn past_then(&self, first: usize) -> usize {
        let mut wanted = 0usize;
        for (at, token) in self.tokens.iter().enumerate().skip(first) {
            if at == first || token.is_one_of(&["if", "elseif"]) {
                wanted += 1;
            } else if token.is("then") {
                wanted -= 1;
                if wanted == 0 {
                    return at + 1;
                }
            }
        }
        self.tokens.len()
    }

    /// The end of the head if a class with a body of its own begins here: `partial model Name "text"`.
    fn class_head(&self, first: usize) -> Option<usize> {
        let mut at = first;
        while self.word(at, &ELEMENT_PREFIXES) {
            at = self.next(at);
        }
        let prefixes = at;
        while self.word(at, &CLASS_PREFIXES) {
            at = self.next(at);
        }
        if self.word(at, &KINDS) {
            at = self.next(at);
        } else if at == prefixes {
            return None;
        }
        let extends = self.word(at, &["extends"]);
        let name = if extends { self.next(at) } else { at };
        let after = self.next(name);
        if !extends && self.word(after, &["="]) {
            return None;
        }
        let mut last = if extends && self.word(after, &["("]) { self.closing(after) } else { name };
        let mut text = self.next(last);
        while self.tokens.get(text).is_some_and(|token| token.kind == Kind::Text) {
            last = text;
            let plus = self.next(text);
            text = if self.word(plus, &["+"]) { self.next(plus) } else { self.tokens.len() };
        }
        Some(last + 1)
    }

    /// The bracket that closes the one at `open`.
    fn closing(&self, open: usize) -> usize {
        let mut depth = 0usize;
        for (at, token) in self.tokens.iter().enumerate().skip(open) {
            if token.opens() {
                depth += 1;
            } else if token.closes() {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return at;
                }
            }
        }
        self.tokens.len()
    }
}

#[cfg(test)]
mod tests {
    use super::items;
    use hyd_syntax::tokens::{Token, tokens};

    fn outline(text: &str) -> Vec<String> {
        let tokens: Vec<Token<'_>> = tokens(text).collect();
        let line = |item: &super::Item| {
            let words: Vec<&str> = tokens[item.tokens.clone()].iter().map(|token| token.text).collect();
            format!("{}{} {}", if item.blank { "+" } else { "" }, item.depth, words.join(" "))
        };
        items(&tokens).iter().map(line).collect()
    }

    #[test]
    fn classes_sections_and_blocks_nest() {
        let text = "within P; model A \"a\" + \"b\" // c\n Real x; model B = C; initial equation\n\n if if a then b else c then x = 1; \
                    elseif d then\n// e\n else end if; equation for i in 1:2 loop y[i] = 0; end for; end A;";
        assert_eq!(
            outline(text),
            [
                "0 within P ;",
                "0 model A \"a\" + \"b\" // c",
                "1 Real x ;",
                "1 model B = C ;",
                "0 initial equation",
                "+1 if if a then b else c then",
                "2 x = 1 ;",
                "1 elseif d then",
                "2 // e",
                "1 else",
                "1 end if ;",
                "0 equation",
                "1 for i in 1 : 2 loop",
                "2 y [ i ] = 0 ;",
                "1 end for ;",
                "0 end A ;"
            ]
        );
    }

    #[test]
    fn comments_before_something_on_their_line_belong_to_it() {
        assert_eq!(
            outline("/* a */ /* b */ type T = Real; /* c */ /* d */\n/* e */\npackage extends P(x = 1) end P;"),
            [
                "0 /* a */ /* b */ type T = Real ; /* c */ /* d */",
                "0 /* e */",
                "0 package extends P ( x = 1 )",
                "0 end P ;"
            ]
        );
    }
}

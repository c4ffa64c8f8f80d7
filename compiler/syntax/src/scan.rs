//! A linear pass over the text before the grammar: comments become blanks, and what no grammar rule could explain well is
//! reported here: characters outside the language, strings and comments without an end, nesting beyond the limits.
//!
//! The cleaned text has the same byte offsets as the original.  The limits bound the recursion of the parser and the
//! depth of every tree built from the text, because both use the stack.  Brackets are not matched here.

use hyd_source::{Code, Diagnostic, FileId, Span};
use rustc_hash::FxHashSet;

/// Brackets and `if`s inside each other.
pub(crate) const MAX_NESTING: usize = 200;
/// Operators of one expression, counted along the deepest path of nested brackets: a bound of the depth of its tree.
pub(crate) const MAX_OPERATORS: usize = 1000;
/// So many operators of the chains between two brackets count; longer chains make no deeper trees (see `build_expr`).
const MAX_CHAINED: usize = 256;
/// Terms of a chain such as `a + b + c`.
const MAX_TERMS: usize = 100_000;
/// Classes in classes, and likewise blocks (`for`, `if`, `when`) in blocks.
pub(crate) const MAX_BLOCKS: usize = 100;
/// Bytes of one file; spans count in 32 bits, and the parser needs some 100 bytes per byte of text.
pub(crate) const MAX_BYTES: usize = 32 << 20;

/// The cleaned text and what was found.
pub(crate) struct Scan {
    /// Same length as the original; comments and foreign characters replaced.
    pub(crate) text: String,
    /// Messages.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// Parsing must not be tried.
    pub(crate) fatal: bool,
    /// Starts of lines with foreign characters: other messages about these lines are consequences.
    pub(crate) foreign_lines: FxHashSet<usize>,
    /// A string or comment without end: messages about the text from here on are consequences.
    pub(crate) unreliable_from: Option<usize>,
}

/// Depth counts of one open bracket.
#[derive(Default)]
struct Level {
    open: u8,
    operators: usize,
    terms: usize,
    inner: usize,
    deepest: usize,
    ifs: usize,
}

struct Scanner<'t> {
    file: FileId,
    source: &'t str,
    clean: Vec<u8>,
    diagnostics: Vec<Diagnostic>,
    fatal: bool,
    foreign_lines: FxHashSet<usize>,
    unreliable_from: Option<usize>,
    levels: Vec<Level>,
    ifs: usize,
    first_long_string: Option<Span>,
}

/// Scans a whole file.
pub(crate) fn scan(file: FileId, source: &str) -> Scan {
    let mut scanner = Scanner {
        file,
        source,
        clean: source.as_bytes().to_vec(),
        diagnostics: Vec::new(),
        fatal: false,
        foreign_lines: FxHashSet::default(),
        unreliable_from: None,
        levels: vec![Level::default()],
        ifs: 0,
        first_long_string: None,
    };
    if source.len() > MAX_BYTES {
        scanner.fatal = true;
        let message = format!("the file has {} bytes; at most {MAX_BYTES} are read", source.len());
        scanner.diagnostics.push(Diagnostic::error(Code::Limit, message).at(Span::new(file, 0, 0), ""));
    } else {
        scanner.run();
    }
    let text = String::from_utf8(scanner.clean).unwrap_or_default();
    Scan {
        text,
        diagnostics: scanner.diagnostics,
        fatal: scanner.fatal,
        foreign_lines: scanner.foreign_lines,
        unreliable_from: scanner.unreliable_from,
    }
}

impl Scanner<'_> {
    fn run(&mut self) {
        let bytes = self.source.as_bytes();
        let mut at = if self.source.starts_with('\u{feff}') { self.blank(0, 3) } else { 0 };
        while at < bytes.len() && !self.fatal {
            at = match bytes[at] {
                b'/' if bytes.get(at + 1) == Some(&b'/') => {
                    let end = self.source[at..].find('\n').map_or(bytes.len(), |n| at + n);
                    self.blank(at, end)
                }
                b'/' if bytes.get(at + 1) == Some(&b'*') => self.block_comment(at),
                b'"' => self.string(at),
                b'\'' => self.quoted_name(at),
                b'a'..=b'z' | b'A'..=b'Z' | b'_' | 0x80.. => self.word(at),
                b'0'..=b'9' => number_end(bytes, at),
                b'@' | b'#' | b'$' | b'%' | b'&' | b'!' | b'?' | b'\\' | b'~' | b'`' | b'|' => self.foreign_ascii(at),
                0..=8 | 11 | 14..=31 | 127 => self.blank(at, at + 1),
                byte => {
                    self.punctuation(byte, at);
                    at + 1
                }
            };
        }
    }

    /// Replaces bytes by blanks, keeping line ends; returns `end`.
    fn blank(&mut self, start: usize, end: usize) -> usize {
        for byte in &mut self.clean[start..end] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
        end
    }

    fn block_comment(&mut self, at: usize) -> usize {
        if let Some(length) = self.source[at + 2..].find("*/") {
            return self.blank(at, at + 2 + length + 2);
        }
        self.unreliable_from.get_or_insert(at);
        let diagnostic = Diagnostic::error(Code::Syntax, "this comment has no end: `*/` is missing");
        self.diagnostics.push(diagnostic.at(self.span(at, at + 2), "the comment begins here"));
        self.blank(at, self.source.len())
    }

    fn string(&mut self, at: usize) -> usize {
        let bytes = self.source.as_bytes();
        let mut end = at + 1;
        while end < bytes.len() && bytes[end] != b'"' {
            end += if bytes[end] == b'\\' { 2 } else { 1 };
        }
        if end < bytes.len() {
            if self.first_long_string.is_none() && bytes[at..end].contains(&b'\n') {
                self.first_long_string = Some(self.span(at, at + 1));
            }
            return end + 1;
        }
        let mut diagnostic = Diagnostic::error(Code::Syntax, "this string has no end: a closing `\"` is missing")
            .at(self.span(at, at + 1), "the last string begins here");
        if let Some(long) = self.first_long_string {
            diagnostic = diagnostic.with(long, "this string goes on over several lines; its end may be missing");
        }
        self.diagnostics.push(diagnostic);
        self.unreliable_from.get_or_insert(self.first_long_string.map_or(at, |long| long.start as usize));
        self.blank(at, self.source.len())
    }

    fn quoted_name(&mut self, at: usize) -> usize {
        let bytes = self.source.as_bytes();
        let mut end = at + 1;
        while end < bytes.len() && bytes[end] != b'\'' && bytes[end] != b'\n' {
            end += if bytes[end] == b'\\' { 2 } else { 1 };
        }
        if bytes.get(end) == Some(&b'\'') {
            return end + 1;
        }
        let diagnostic =
            Diagnostic::error(Code::Syntax, "this quoted name has no end: a closing `'` is missing on the line")
                .at(self.span(at, at + 1), "")
                .help("strings stand in double quotes: \"text\"");
        self.diagnostics.push(diagnostic);
        self.foreign_lines.insert(line_start(self.source, at));
        self.blank(at, at + 1)
    }

    /// A word; letters beyond ASCII are reported once per word and replaced, so that parsing can go on.
    fn word(&mut self, at: usize) -> usize {
        let rest = &self.source[at..];
        let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        if length == 0 {
            return self.foreign_symbol(at);
        }
        let word = &rest[..length];
        if word.is_ascii() {
            self.keyword(word, at);
            return at + length;
        }
        let letter = word.chars().find(|c| !c.is_ascii()).unwrap_or(' ');
        let message = format!("`{letter}` cannot stand in a name");
        let diagnostic = Diagnostic::error(Code::Syntax, message)
            .at(self.span(at, at + length), "")
            .help(format!(
                "names consist of the letters A to Z and a to z, digits and `_`; other characters need single quotes: '{word}'"
            ));
        self.diagnostics.push(diagnostic);
        for byte in &mut self.clean[at..at + length] {
            if !byte.is_ascii() {
                *byte = b'_';
            }
        }
        at + length
    }

    fn foreign_symbol(&mut self, at: usize) -> usize {
        let symbol = self.source[at..].chars().next().unwrap_or(' ');
        let end = at + symbol.len_utf8();
        if symbol.is_whitespace() || symbol == '\u{200b}' || symbol == '\u{feff}' {
            return self.blank(at, end);
        }
        let hint = match symbol {
            '\u{201c}' | '\u{201d}' | '\u{201e}' | '\u{ab}' | '\u{bb}' => {
                ("", "strings stand in straight double quotes: \"text\"")
            }
            '\u{2212}' | '\u{2013}' | '\u{2014}' => ("-", "minus is the plain character `-`"),
            '\u{d7}' | '\u{b7}' | '\u{22c5}' => ("*", "multiplication is `*`"),
            '\u{2264}' => ("<=", "write `<=`"),
            '\u{2265}' => (">=", "write `>=`"),
            '\u{2260}' => ("<>", "write `<>`"),
            _ => ("", ""),
        };
        self.foreign(at, end, symbol, hint)
    }

    fn foreign_ascii(&mut self, at: usize) -> usize {
        let bytes = self.source.as_bytes();
        let next = bytes.get(at + 1).copied();
        let (length, hint) = match (bytes[at], next) {
            (b'&', Some(b'&')) => (2, ("or", "write `and`")),
            (b'|', Some(b'|')) => (2, ("or", "write `or`")),
            (b'!', Some(b'=')) => (2, ("<>", "write `<>`")),
            (b'!', _) => (1, ("", "write `not`")),
            (b'#' | b'%', _) => (1, ("", "comments begin with `//`")),
            _ => (1, ("", "")),
        };
        self.foreign(at, at + length, bytes[at] as char, hint)
    }

    /// Reports a character and puts what was meant in its place, if that is known, so that parsing can go on.
    fn foreign(&mut self, at: usize, end: usize, symbol: char, (meant, hint): (&str, &str)) -> usize {
        let diagnostic =
            Diagnostic::error(Code::Syntax, format!("the character `{symbol}` has no meaning in Modelica"))
                .at(self.span(at, end), "")
                .maybe_help((!hint.is_empty()).then(|| hint.to_string()));
        self.diagnostics.push(diagnostic);
        self.foreign_lines.insert(line_start(self.source, at));
        self.blank(at, end);
        self.clean[at..at + meant.len()].copy_from_slice(meant.as_bytes());
        end
    }

    fn keyword(&mut self, word: &str, at: usize) {
        match word {
            "and" | "or" => self.chained(at),
            "not" => self.operator(at),
            "if" => {
                self.operator(at);
                self.top().ifs += 1;
                self.ifs += 1;
                self.check_nesting(at);
            }
            _ => {}
        }
    }

    fn punctuation(&mut self, byte: u8, at: usize) {
        match byte {
            b'(' | b'[' | b'{' => {
                self.levels.push(Level { open: byte, ..Level::default() });
                self.check_nesting(at);
            }
            b')' | b']' | b'}' => self.close(byte),
            b',' => self.next_item(),
            b';' => {
                if self.top().open == b'[' {
                    self.next_item();
                } else {
                    self.levels.clear();
                    self.levels.push(Level::default());
                    self.ifs = 0;
                }
            }
            b'+' | b'-' | b'*' | b'/' | b'^' | b'<' | b'>' | b'=' => self.chained(at),
            b':' => self.operator(at),
            _ => {}
        }
    }

    fn top(&mut self) -> &mut Level {
        if self.levels.is_empty() {
            self.levels.push(Level::default());
        }
        let last = self.levels.len() - 1;
        &mut self.levels[last]
    }

    fn next_item(&mut self) {
        let level = self.top();
        level.deepest = level.deepest.max(level.operators + level.inner);
        level.operators = 0;
        level.terms = 0;
        level.inner = 0;
        let ifs = std::mem::take(&mut level.ifs);
        self.ifs -= ifs;
    }

    /// A closing bracket; one that does not fit the innermost open bracket is left to the grammar.
    fn close(&mut self, byte: u8) {
        if !matches!((self.top().open, byte), (b'(', b')') | (b'[', b']') | (b'{', b'}')) {
            return;
        }
        self.next_item();
        if let Some(level) = self.levels.pop() {
            let outer = self.top();
            outer.inner = outer.inner.max(level.deepest + 1);
        }
    }

    /// An operator of a chain of any length.
    fn chained(&mut self, at: usize) {
        let level = self.top();
        level.terms += 1;
        let terms = level.terms;
        if terms <= MAX_CHAINED {
            self.operator(at);
        } else if terms == MAX_TERMS {
            let message = format!("this expression has more than {MAX_TERMS} terms");
            self.stop(at, message, "use `sum` over an array");
        }
    }

    fn operator(&mut self, at: usize) {
        let level = self.top();
        level.operators += 1;
        if level.operators + level.inner > MAX_OPERATORS {
            let message = format!("this expression has more than {MAX_OPERATORS} operators inside each other");
            self.stop(at, message, "split it into several equations, or use `sum` over an array");
        }
    }

    fn check_nesting(&mut self, at: usize) {
        // The first level is outside of all brackets.
        if self.levels.len().saturating_sub(1) + self.ifs > MAX_NESTING {
            let message = format!("brackets and `if`s are nested more than {MAX_NESTING} deep");
            self.stop(at, message, "give parts of the expression their own variables");
        }
    }

    fn stop(&mut self, at: usize, message: String, help: &str) {
        self.fatal = true;
        self.diagnostics.push(Diagnostic::error(Code::Limit, message).at(self.span(at, at + 1), "").help(help));
    }

    fn span(&self, start: usize, end: usize) -> Span {
        Span::new(self.file, start, end)
    }
}

/// The first byte of the line that holds `at`.
pub(crate) fn line_start(text: &str, at: usize) -> usize {
    text.as_bytes()[..at.min(text.len())].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1)
}

/// The end of the number that begins at `at`.
pub(crate) fn number_end(bytes: &[u8], at: usize) -> usize {
    let digits = |mut k: usize| {
        while bytes.get(k).is_some_and(u8::is_ascii_digit) {
            k += 1;
        }
        k
    };
    let mut end = digits(at);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if bytes.get(end + 1 + sign).is_some_and(u8::is_ascii_digit) {
            end = digits(end + 1 + sign);
        }
    }
    end
}

//! A text to its tokens, comments among them, each with the number of line ends before it.
//!
//! Nothing is reported here: that is what [`crate::parse`] is for.  Characters that the language does not know (blanks of
//! other alphabets, control characters) separate tokens and are dropped, as the parser does.

use crate::scan::number_end;

/// What a token is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// A keyword or a name, quoted or not.
    Word,
    /// A number without sign.
    Number,
    /// A string with its quotes.
    Text,
    /// Operators, brackets, separators.
    Symbol,
    /// `// ...`, without blanks at its end.
    LineComment,
    /// `/* ... */`
    BlockComment,
}

/// A token.
#[derive(Clone, Copy, Debug)]
pub struct Token<'t> {
    /// What it is.
    pub kind: Kind,
    /// Its text.
    pub text: &'t str,
    /// Where it begins, in bytes.
    pub at: usize,
    /// Line ends between the token before and this one; 2 stands for more.
    pub breaks: u8,
}

impl Token<'_> {
    /// True for this word or symbol.
    pub fn is(&self, text: &str) -> bool {
        self.text == text && matches!(self.kind, Kind::Word | Kind::Symbol)
    }

    /// True for one of these words and symbols.
    pub fn is_one_of(&self, list: &[&str]) -> bool {
        matches!(self.kind, Kind::Word | Kind::Symbol) && list.contains(&self.text)
    }

    /// True for both kinds of comments.
    pub fn is_comment(&self) -> bool {
        matches!(self.kind, Kind::LineComment | Kind::BlockComment)
    }

    /// True for an opening bracket.
    pub fn opens(&self) -> bool {
        self.is_one_of(&["(", "[", "{"])
    }

    /// True for a closing bracket.
    pub fn closes(&self) -> bool {
        self.is_one_of(&[")", "]", "}"])
    }
}

/// Operators of more than one character.
const LONG_SYMBOLS: [&str; 10] = [":=", "==", "<>", "<=", ">=", ".+", ".-", ".*", "./", ".^"];

/// True if the two symbols side by side would be read as one.
pub fn is_long_symbol(first: &str, second: &str) -> bool {
    LONG_SYMBOLS.iter().any(|symbol| symbol.strip_prefix(first) == Some(second))
}

/// The tokens of a text, one after the other.
#[derive(Clone, Debug)]
pub struct Tokens<'t> {
    text: &'t str,
    at: usize,
}

/// All tokens of a text.
pub fn tokens(text: &str) -> Tokens<'_> {
    Tokens { text, at: 0 }
}

impl<'t> Iterator for Tokens<'t> {
    type Item = Token<'t>;

    fn next(&mut self) -> Option<Token<'t>> {
        let mut breaks = 0u8;
        loop {
            let (at, rest) = (self.at, &self.text[self.at..]);
            let first = rest.chars().next()?;
            let Some((kind, length)) = token(rest, first) else {
                breaks = if first == '\n' { (breaks + 1).min(2) } else { breaks };
                self.at += first.len_utf8();
                continue;
            };
            self.at += length;
            let text = if kind == Kind::LineComment { rest[..length].trim_end() } else { &rest[..length] };
            return Some(Token { kind, text, at, breaks });
        }
    }
}

/// Kind and length of the token at the start of `rest`; none for what only separates.
fn token(rest: &str, first: char) -> Option<(Kind, usize)> {
    let bytes = rest.as_bytes();
    Some(match first {
        '/' if bytes.get(1) == Some(&b'/') => (Kind::LineComment, rest.find('\n').unwrap_or(rest.len())),
        '/' if bytes.get(1) == Some(&b'*') => {
            (Kind::BlockComment, rest[2..].find("*/").map_or(rest.len(), |end| end + 4))
        }
        '"' => (Kind::Text, quoted(bytes, b'"')),
        '\'' => (Kind::Word, quoted(bytes, b'\'')),
        'a'..='z' | 'A'..='Z' | '_' => {
            let inside = |c: char| c.is_ascii_alphanumeric() || c == '_';
            (Kind::Word, rest.find(|c| !inside(c)).unwrap_or(rest.len()))
        }
        '0'..='9' => (Kind::Number, number_end(bytes, 0)),
        '!'..='~' => {
            // Comments are taken out first: in `.//` and `./*` the dot stands alone.
            let comment = bytes.get(1) == Some(&b'/') && matches!(bytes.get(2), Some(b'/' | b'*'));
            let long = LONG_SYMBOLS.iter().find(|symbol| rest.starts_with(**symbol) && !comment);
            (Kind::Symbol, long.map_or(1, |symbol| symbol.len()))
        }
        _ => return None,
    })
}

/// Length with both quotes; a backslash makes the next byte part of the text.
fn quoted(bytes: &[u8], quote: u8) -> usize {
    let mut end = 1;
    while end < bytes.len() && bytes[end] != quote {
        end += if bytes[end] == b'\\' { 2 } else { 1 };
    }
    // A character beyond ASCII after a backslash is skipped byte by byte, and so ends on its border.
    (end + 1).min(bytes.len())
}

#[cfg(test)]
mod tests {
    use super::{Kind, Token, tokens};

    fn texts(text: &str) -> Vec<&str> {
        tokens(text).map(|token| token.text).collect()
    }

    #[test]
    fn tokens_are_the_longest_possible() {
        assert_eq!(texts("a:=b.*2.*c<=1e-3"), ["a", ":=", "b", ".*", "2.", "*", "c", "<=", "1e-3"]);
        assert_eq!(texts("1:n 3.5E+2 4e x"), ["1", ":", "n", "3.5E+2", "4", "e", "x"]);
        assert_eq!(texts(r#"'a b' "say \"so\"" 'it\'s'"#), ["'a b'", r#""say \"so\"""#, r"'it\'s'"]);
    }

    #[test]
    fn a_comment_behind_a_dot_is_a_comment() {
        assert_eq!(
            texts("a ./b; .// c\n.D d; ./* e */ F f"),
            ["a", "./", "b", ";", ".", "// c", ".", "D", "d", ";", ".", "/* e */", "F", "f"]
        );
        assert_eq!(texts("a*/* b */c-//d\ne"), ["a", "*", "/* b */", "c", "-", "//d", "e"]);
    }

    #[test]
    fn comments_end_where_they_end() {
        let found: Vec<Token> = tokens("a // one  \r\n\n\n/* two\n */ b").collect();
        let kinds: Vec<(Kind, &str, u8)> = found.iter().map(|token| (token.kind, token.text, token.breaks)).collect();
        assert_eq!(
            kinds,
            [
                (Kind::Word, "a", 0),
                (Kind::LineComment, "// one", 0),
                (Kind::BlockComment, "/* two\n */", 2),
                (Kind::Word, "b", 0)
            ]
        );
    }
}

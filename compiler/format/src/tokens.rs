//! A text to its tokens, comments among them, each with the number of line ends before it.
//!
//! The text is known to be correct, so that nothing is reported here; characters that the language does not know (blanks of
//! other alphabets, control characters) separate tokens and are dropped, as the parser does.

/// What a token is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// A keyword or a name, quoted or not.
    Word,
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
pub(crate) struct Token<'t> {
    pub(crate) kind: Kind,
    pub(crate) text: &'t str,
    /// Line ends between the token before and this one; 2 stands for more.
    pub(crate) breaks: u8,
}

impl Token<'_> {
    pub(crate) fn is(&self, text: &str) -> bool {
        self.text == text && matches!(self.kind, Kind::Word | Kind::Symbol)
    }

    pub(crate) fn is_one_of(&self, list: &[&str]) -> bool {
        matches!(self.kind, Kind::Word | Kind::Symbol) && list.contains(&self.text)
    }

    pub(crate) fn is_comment(&self) -> bool {
        matches!(self.kind, Kind::LineComment | Kind::BlockComment)
    }

    pub(crate) fn opens(&self) -> bool {
        self.is_one_of(&["(", "[", "{"])
    }

    pub(crate) fn closes(&self) -> bool {
        self.is_one_of(&[")", "]", "}"])
    }
}

/// Operators of more than one character.
const LONG_SYMBOLS: [&str; 10] = [":=", "==", "<>", "<=", ">=", ".+", ".-", ".*", "./", ".^"];

/// True if the two symbols side by side would be read as one.
pub(crate) fn is_long_symbol(first: &str, second: &str) -> bool {
    LONG_SYMBOLS.iter().any(|symbol| symbol.strip_prefix(first) == Some(second))
}

/// All tokens of a text.
pub(crate) fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    let mut breaks = 0u8;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let Some((kind, length)) = token(rest, first) else {
            breaks = if first == '\n' { (breaks + 1).min(2) } else { breaks };
            at += first.len_utf8();
            continue;
        };
        let found = if kind == Kind::LineComment { rest[..length].trim_end() } else { &rest[..length] };
        tokens.push(Token { kind, text: found, breaks });
        breaks = 0;
        at += length;
    }
    tokens
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
        '0'..='9' => (Kind::Number, number(bytes)),
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

fn number(bytes: &[u8]) -> usize {
    let digits = |mut k: usize| {
        while bytes.get(k).is_some_and(u8::is_ascii_digit) {
            k += 1;
        }
        k
    };
    let mut end = digits(0);
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

#[cfg(test)]
mod tests {
    use super::{Kind, tokens};

    fn texts(text: &str) -> Vec<&str> {
        tokens(text).iter().map(|token| token.text).collect()
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
        let found = tokens("a // one  \r\n\n\n/* two\n */ b");
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

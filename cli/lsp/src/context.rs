//! What is being typed at a place: read from the tokens before it, since the tree of a half-typed line tells nothing.

use hyd_syntax::is_keyword;
use hyd_syntax::tokens::{Kind, Token, tokens};

/// What is being typed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Context {
    /// The names before the last dot: `a`, `b` in `a.b.c`.
    pub(crate) chain: Vec<String>,
    /// The name as far as it is typed.
    pub(crate) partial: String,
    /// What may stand here.
    pub(crate) place: Slot,
}

/// What may stand at a place.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Slot {
    /// A declaration, an equation or a statement begins.
    Statement,
    /// An expression, or the rest of something.
    Expression,
    /// The name of a class, as after `extends`.
    Class,
    /// A name is declared: nobody can know it.
    Declared,
    /// A name in the list of a modification or call.
    Argument(Head),
    /// A string that is the value of this attribute.
    Text(Option<String>),
    /// A comment.
    Comment,
}

/// What a list in parentheses belongs to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Head {
    /// A call of this function.
    Call(Vec<String>),
    /// A modification of the elements `chain` of a class, each inside the one before.
    Modified {
        /// The name of the class.
        class: Vec<String>,
        /// The elements.
        chain: Vec<String>,
    },
    /// `annotation(...)`, inside of these entries.
    Annotation(Vec<String>),
}

/// Words that may stand before the type in a declaration.
const PREFIXES: [&str; 16] = [
    "redeclare",
    "replaceable",
    "final",
    "inner",
    "outer",
    "flow",
    "stream",
    "discrete",
    "parameter",
    "constant",
    "input",
    "output",
    "each",
    "encapsulated",
    "partial",
    "public",
];
const CLASS_WORDS: [&str; 10] =
    ["class", "model", "block", "connector", "record", "type", "package", "function", "operator", "expandable"];
/// Words behind which something begins.
const OPENING: [&str; 12] = [
    "equation",
    "algorithm",
    "public",
    "protected",
    "initial",
    "then",
    "else",
    "loop",
    "within",
    "import",
    "external",
    "end",
];

/// What is being typed at a byte of a text.
pub(crate) fn context(text: &str, byte: usize) -> Context {
    let before = text.get(..byte).unwrap_or_default();
    let all: Vec<Token<'_>> = tokens(before).collect();
    let nothing = |place| Context { chain: Vec::new(), partial: String::new(), place };
    if let Some(last) = all.last() {
        let open_line = last.kind == Kind::LineComment && !before[last.at..].contains('\n');
        if open_line || last.kind == Kind::BlockComment && !last.text.ends_with("*/") {
            return nothing(Slot::Comment);
        }
    }
    let mut words: Vec<Token<'_>> = all.into_iter().filter(|token| !token.is_comment()).collect();
    if let Some(last) = words.last().filter(|last| last.kind == Kind::Text && is_open(last.text)) {
        let inside = last.text[1..].to_string();
        words.pop();
        let attribute = match &words[..] {
            [.., name, equals] if equals.is("=") => Some(name.text.to_string()),
            _ => None,
        };
        return Context { chain: Vec::new(), partial: inside, place: Slot::Text(attribute) };
    }
    let mut partial = String::new();
    if let Some(last) = words.last().copied().filter(|last| last.kind == Kind::Word && end(last) == byte) {
        partial = last.text.to_string();
        words.pop();
    }
    let chain = take_chain(&mut words);
    let place = slot(&words, !chain.is_empty());
    Context { chain, partial, place }
}

/// The list in parentheses around a byte: what it belongs to, the number of the argument, and its name if it has one.
pub(crate) fn call_around(text: &str, byte: usize) -> Option<(Vec<String>, usize, Option<String>)> {
    let before = text.get(..byte).unwrap_or_default();
    let words: Vec<Token<'_>> = tokens(before).filter(|token| !token.is_comment()).collect();
    let mut until = words.len();
    loop {
        let at = opener(&words[..until])?;
        if words[at].is("(")
            && let Some(Head::Call(name)) = head(&words[..at])
        {
            let (mut depth, mut count, mut first) = (0usize, 0, at + 1);
            for (k, token) in words.iter().enumerate().skip(at + 1) {
                if token.opens() {
                    depth += 1;
                } else if token.closes() {
                    depth = depth.saturating_sub(1);
                } else if depth == 0 && token.is(",") {
                    count += 1;
                    first = k + 1;
                }
            }
            let named = match words.get(first..) {
                Some([name, equals, ..]) if equals.is("=") => Some(name.text.to_string()),
                _ => None,
            };
            return Some((name, count, named));
        }
        until = at;
    }
}

fn is_open(text: &str) -> bool {
    let inside = &text[1..];
    let escaped = inside.bytes().rev().skip(1).take_while(|&byte| byte == b'\\').count() % 2 == 1;
    !inside.ends_with('"') || escaped
}

fn end(token: &Token<'_>) -> usize {
    token.at + token.text.len()
}

/// Takes `a.b[1].` from the end.
fn take_chain(words: &mut Vec<Token<'_>>) -> Vec<String> {
    let mut chain = Vec::new();
    while words.last().is_some_and(|last| last.is(".")) {
        words.pop();
        if words.last().is_some_and(|last| last.is("]")) {
            let mut depth = 0;
            while let Some(token) = words.pop() {
                depth += i32::from(token.is("]")) - i32::from(token.is("["));
                if depth == 0 {
                    break;
                }
            }
        }
        match words.last().copied().filter(|last| last.kind == Kind::Word) {
            Some(name) => {
                chain.insert(0, name.text.to_string());
                words.pop();
            }
            None => break,
        }
    }
    chain
}

/// The last bracket that is not closed within its statement.
fn opener(words: &[Token<'_>]) -> Option<usize> {
    let mut depth = 0usize;
    for (k, token) in words.iter().enumerate().rev() {
        if token.closes() {
            depth += 1;
        } else if token.opens() {
            if depth == 0 {
                return Some(k);
            }
            depth -= 1;
        } else if depth == 0 && token.is(";") {
            return None;
        }
    }
    None
}

fn slot(words: &[Token<'_>], behind_dot: bool) -> Slot {
    let Some(last) = words.last() else { return Slot::Statement };
    if let Some(at) = opener(words)
        && words[at].is("(")
        && (last.is("(") || last.is(",") || last.is_one_of(&["each", "final"]))
        && !behind_dot
    {
        return head(&words[..at]).map_or(Slot::Expression, Slot::Argument);
    }
    if last.is_one_of(&["extends", "constrainedby", "import", "within", "redeclare", "replaceable"]) {
        return Slot::Class;
    }
    if last.is(";") || last.is_one_of(&OPENING) || last.kind == Kind::Text || last.is_one_of(&PREFIXES) {
        return Slot::Statement;
    }
    let is_name = |token: &Token<'_>| token.kind == Kind::Word && !is_keyword(token.text);
    if is_name(last) && !behind_dot {
        // The name of a class that begins, behind which its elements stand, or a type, behind which a name stands.
        let heads = words.len() > 1 && words[words.len() - 2].is_one_of(&CLASS_WORDS);
        return if heads { Slot::Statement } else { Slot::Declared };
    }
    if last.is_one_of(&CLASS_WORDS) {
        return Slot::Declared;
    }
    Slot::Expression
}

/// What the list belongs to that begins behind these tokens.
fn head(words: &[Token<'_>]) -> Option<Head> {
    let last = words.last().filter(|last| last.kind == Kind::Word)?;
    if last.is("annotation") {
        return Some(Head::Annotation(Vec::new()));
    }
    let mut rest = words.to_vec();
    rest.pop();
    let mut name = take_chain(&mut rest);
    name.push(last.text.to_string());
    if rest.last().is_some_and(|before| before.is_one_of(&["extends", "constrainedby"])) {
        return Some(Head::Modified { class: name, chain: Vec::new() });
    }
    if let [.., word, _, equals] = &rest[..]
        && equals.is("=")
        && word.is_one_of(&CLASS_WORDS)
    {
        return Some(Head::Modified { class: name, chain: Vec::new() });
    }
    if let Some(class) = declared_type(&rest) {
        return Some(Head::Modified { class, chain: Vec::new() });
    }
    let around = opener(&rest).filter(|&at| rest[at].is("(")).and_then(|at| head(&rest[..at]));
    let begins =
        rest.last().is_some_and(|before| before.is("(") || before.is(",") || before.is_one_of(&["each", "final"]));
    match around {
        Some(Head::Modified { class, mut chain }) if begins => {
            chain.extend(name);
            Some(Head::Modified { class, chain })
        }
        Some(Head::Annotation(mut inside)) if begins => {
            inside.extend(name);
            Some(Head::Annotation(inside))
        }
        _ if is_keyword(last.text) && !matches!(last.text, "connect" | "der" | "initial" | "pure") => None,
        _ => Some(Head::Call(name)),
    }
}

/// The type of the declaration that these tokens begin, up to the name before the list.
fn declared_type(words: &[Token<'_>]) -> Option<Vec<String>> {
    let mut depth = 0usize;
    let mut start = 0;
    for (k, token) in words.iter().enumerate().rev() {
        if token.closes() {
            depth += 1;
        } else if token.opens() && depth > 0 {
            depth -= 1;
        } else if depth == 0 && (token.is(";") || token.is("(") || token.is_one_of(&OPENING) || token.is("redeclare")) {
            start = k + 1;
            break;
        } else if depth == 0 && token.is_one_of(&["=", "{", "["]) {
            return None;
        }
    }
    let mut rest = words.get(start..)?.iter().peekable();
    loop {
        let token = rest.peek()?;
        if token.is_one_of(&PREFIXES) {
            rest.next();
        } else if token.is_one_of(&CLASS_WORDS) {
            rest.next();
            rest.next();
        } else if token.kind == Kind::Text {
            rest.next();
        } else {
            break;
        }
    }
    let mut class = Vec::new();
    while let Some(token) = rest.peek() {
        let expected = class.is_empty() || token.is(".");
        if !expected {
            break;
        }
        if token.is(".") {
            rest.next();
        }
        let name = rest.next().filter(|name| name.kind == Kind::Word && !is_keyword(name.text))?;
        class.push(name.text.to_string());
    }
    // Behind the type stand sizes, or names that were declared before this one.
    let rest: Vec<_> = rest.collect();
    let plausible = rest.is_empty() || rest[0].is("[") || rest.last().is_some_and(|last| last.is(","));
    (plausible && !class.is_empty()).then_some(class)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Context {
        let byte = text.find('|').unwrap_or(text.len());
        context(&text.replace('|', ""), byte)
    }

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn what_is_typed_is_known() {
        let modified = |class: &[&str], chain: &[&str]| {
            Slot::Argument(Head::Modified { class: names(class), chain: names(chain) })
        };
        for (text, chain, partial, place) in [
            ("model M\n  |", &[][..], "", Slot::Statement),
            ("model M \"d\"\n  Re|", &[], "Re", Slot::Statement),
            ("model M\n  Real |", &[], "", Slot::Declared),
            ("model M\n  parameter Hyd.Units.|", &["Hyd", "Units"], "", Slot::Statement),
            ("equation\n  a[1, 2].b.c| = 3;", &["a", "b"], "c", Slot::Statement),
            ("x = a.|", &["a"], "", Slot::Expression),
            ("; extends P.|", &["P"], "", Slot::Class),
            ("model M\n  P.Resistor r(|", &[], "", modified(&["P", "Resistor"], &[])),
            ("; parameter Box[3] x, b(size = 1, in|", &[], "in", modified(&["Box"], &[])),
            ("; Box b(inner_part(each |", &[], "", modified(&["Box"], &["inner_part"])),
            ("; extends Box(held(|", &[], "", modified(&["Box"], &["held"])),
            ("type A = Real(|", &[], "", modified(&["Real"], &[])),
            ("; Box b(redeclare Large other(|", &[], "", modified(&["Large"], &[])),
            ("; Box b(size = f(|", &[], "", Slot::Argument(Head::Call(names(&["f"])))),
            ("equation x = P.f(1, |", &[], "", Slot::Argument(Head::Call(names(&["P", "f"])))),
            ("equation connect(|", &[], "", Slot::Argument(Head::Call(names(&["connect"])))),
            ("; annotation(experiment(|", &[], "", Slot::Argument(Head::Annotation(names(&["experiment"])))),
            ("; Real x(unit = \"kg|", &[], "kg", Slot::Text(Some("unit".into()))),
            ("x // a.|", &[], "", Slot::Comment),
            ("x /* a.|", &[], "", Slot::Comment),
            ("", &[], "", Slot::Statement),
        ] {
            let expected = Context { chain: names(chain), partial: partial.into(), place };
            assert_eq!(at(text), expected, "{text}");
        }
    }

    #[test]
    fn calls_are_found_around_a_place() {
        let call = |text: &str| {
            let byte = text.find('|').unwrap_or(text.len());
            call_around(&text.replace('|', ""), byte)
        };
        assert_eq!(call("x = P.f(1, g(2), |"), Some((names(&["P", "f"]), 2, None)));
        assert_eq!(call("x = f({1, 2}, b = |"), Some((names(&["f"]), 1, Some("b".into()))));
        assert_eq!(call("x = f((a + |"), Some((names(&["f"]), 0, None)));
        assert_eq!(call("; Real x(start = |"), None);
        assert_eq!(call("f(1);\n x = |"), None);
    }
}

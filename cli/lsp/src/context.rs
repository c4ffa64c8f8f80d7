//! What is being typed at a place: read from the tokens before it, since the tree of a half-typed line tells nothing.

use hyd_syntax::is_keyword;
use hyd_syntax::tokens::{Kind, Token, tokens};

use crate::annotations::{Entry, entry};

/// What is being typed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Context {
    /// The names before the last dot: `a`, `b` in `a.b.c`.
    pub(crate) chain: Vec<String>,
    /// The name as far as it is typed.
    pub(crate) partial: String,
    /// What may stand here.
    pub(crate) place: Slot,
    /// It is an end of a connection.
    pub(crate) connects: bool,
    /// Loop variables around it, outermost first.
    pub(crate) loops: Vec<String>,
    /// Elements that the list around it gives something already.
    pub(crate) given: Vec<String>,
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
    /// The value of this element in the list of a modification.
    Value(Head, String),
    /// The name of the element that a redeclaration in such a list is for, of a class or a component.
    Redeclared(Head, Element),
    /// In an annotation.
    Annotation(Entry),
    /// A string.
    Text(Text),
    /// A comment.
    Comment,
}

/// What is redeclared.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Element {
    /// `redeclare A.B name`
    Component,
    /// `redeclare model name`
    Class,
}

/// A string that is being written.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Text {
    /// The attribute whose value it is.
    pub(crate) attribute: Option<String>,
    /// What is modified.
    pub(crate) of: Option<Head>,
    /// The unit that is given before in the same list.
    pub(crate) unit: Option<String>,
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
    let nothing = |place| Context {
        chain: Vec::new(),
        partial: String::new(),
        place,
        connects: false,
        loops: Vec::new(),
        given: Vec::new(),
    };
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
        return Context { partial: inside, ..nothing(Slot::Text(written(&words))) };
    }
    let mut partial = String::new();
    if let Some(last) = words.last().copied().filter(|last| last.kind == Kind::Word && end(last) == byte) {
        partial = last.text.to_string();
        words.pop();
    }
    let chain = take_chain(&mut words);
    let place = slot(&words, !chain.is_empty());
    let connects = opener(&words).is_some_and(|at| at > 0 && words[at].is("(") && words[at - 1].is("connect"));
    let given = given(&words, text.get(byte..).unwrap_or_default());
    Context { chain, partial, place, connects, loops: loops(&words), given }
}

/// A string behind these tokens.
fn written(words: &[Token<'_>]) -> Text {
    let [.., name, equals] = words else { return Text::default() };
    if !equals.is("=") {
        return Text::default();
    }
    let attribute = Some(name.text.to_string());
    let Some(at) = opener(words).filter(|&at| words[at].is("(")) else {
        return Text { attribute, ..Text::default() };
    };
    let unit = words[at..].windows(3).find_map(|three| match three {
        [name, equals, text] if name.is("unit") && equals.is("=") && text.kind == Kind::Text => {
            Some(text.text.trim_matches('"').to_string())
        }
        _ => None,
    });
    Text { attribute, of: head(&words[..at]), unit }
}

/// The names in a list that stand before `=` or `(`, in the part before a place and in the one behind it.
fn given(words: &[Token<'_>], behind: &str) -> Vec<String> {
    let Some(at) = opener(words) else { return Vec::new() };
    // What is behind belongs to the list up to its end, or to that of the statement.
    let rest: Vec<Token<'_>> = tokens(behind).take(MOST_BEHIND).filter(|token| !token.is_comment()).collect();
    let mut found = Vec::new();
    for part in [&words[at + 1..], &rest[..]] {
        let mut depth = 0usize;
        for (k, token) in part.iter().enumerate() {
            if token.closes() && depth == 0 || token.is(";") {
                break;
            }
            if token.closes() {
                depth -= 1;
            }
            let gives = part.get(k + 1).is_some_and(|next| next.is("=") || next.is("("));
            if depth == 0 && gives && token.kind == Kind::Word && !is_keyword(token.text) {
                found.push(token.text.to_string());
            }
            if token.opens() {
                depth += 1;
            }
        }
    }
    found
}

/// Tokens behind a place that are looked at.
const MOST_BEHIND: usize = 400;

/// The loop variables of what is open behind these tokens.
fn loops(words: &[Token<'_>]) -> Vec<String> {
    let mut open: Vec<(usize, Vec<String>)> = Vec::new();
    let mut depth = 0usize;
    for (k, token) in words.iter().enumerate() {
        let next = words.get(k + 1).filter(|next| next.kind == Kind::Word && !is_keyword(next.text));
        if token.opens() {
            depth += 1;
        } else if token.closes() {
            depth = depth.saturating_sub(1);
            open.retain(|(own, _)| *own <= depth);
        } else if token.is("for") && k > 0 && words[k - 1].is("end") {
            open.pop();
        } else if token.is("for") {
            open.push((depth, next.iter().map(|next| next.text.to_string()).collect()));
        } else if token.is(",") && words.get(k + 2).is_some_and(|word| word.is("in")) {
            // `for i in 1:2, j in 1:3`
            if let (Some((_, names)), Some(next)) = (open.last_mut(), next) {
                names.push(next.text.to_string());
            }
        } else if token.is("end") && next.is_some() {
            open.clear();
        }
    }
    open.into_iter().flat_map(|(_, names)| names).collect()
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
pub(crate) fn opener(words: &[Token<'_>]) -> Option<usize> {
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
    if let Some(entry) = entry(words).filter(|_| !behind_dot) {
        return Slot::Annotation(entry);
    }
    if let Some(modified) = modified(words).filter(|_| !behind_dot) {
        return modified;
    }
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

/// What stands in the list of a modification and is no name of an element to modify: a value, or the name that a redeclaration is for.
fn modified(words: &[Token<'_>]) -> Option<Slot> {
    let at = opener(words).filter(|&at| words[at].is("("))?;
    let is_name = |token: &Token<'_>| token.kind == Kind::Word && !is_keyword(token.text);
    let inside = &words[at + 1..];
    let begin = inside.iter().rposition(|token| token.is(",")).map_or(0, |comma| comma + 1);
    let own = &inside[begin..];
    let list = || head(&words[..at]).filter(|head| matches!(head, Head::Modified { .. }));
    if let [.., name, equals] = own
        && equals.is("=")
        && is_name(name)
    {
        return list().map(|head| Slot::Value(head, name.text.to_string()));
    }
    let redeclares = own.iter().position(|token| token.is("redeclare"))?;
    let behind: Vec<_> = own[redeclares + 1..].iter().skip_while(|token| token.is_one_of(&PREFIXES)).collect();
    match &behind[..] {
        [word] if word.is_one_of(&CLASS_WORDS) => list().map(|head| Slot::Redeclared(head, Element::Class)),
        [.., last] if is_name(last) && behind.iter().all(|token| is_name(token) || token.is(".")) => {
            list().map(|head| Slot::Redeclared(head, Element::Component))
        }
        _ => None,
    }
}

/// What the list belongs to that begins behind these tokens.
fn head(words: &[Token<'_>]) -> Option<Head> {
    let last = words.last().filter(|last| last.kind == Kind::Word)?;
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
        let list = |class: &[&str], chain: &[&str]| Head::Modified { class: names(class), chain: names(chain) };
        let modified = |class: &[&str], chain: &[&str]| Slot::Argument(list(class, chain));
        let (real, boxed) = (list(&["Real"], &[]), list(&["Box"], &[]));
        let drawn = |name: &str, of: &str| Slot::Annotation(Entry::Value { name: name.into(), of: of.into() });
        let text = |attribute: &str, unit: Option<&str>| {
            let (attribute, unit) = (Some(attribute.to_string()), unit.map(str::to_string));
            Slot::Text(Text { attribute, of: Some(list(&["Real"], &[])), unit })
        };
        let cases: Vec<(&str, &[&str], &str, Slot)> = vec![
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
            ("; annotation(experiment(|", &[], "", Slot::Annotation(Entry::Inside("experiment".into()))),
            ("; annotation(Icon(graphics = {Line(), |", &[], "", drawn("graphics", "Icon")),
            (
                "; annotation(Documentation(figures = {Figure(plots = {Plot(curves = {Curve(y = |",
                &[],
                "",
                drawn("y", "Curve"),
            ),
            ("; Real x(unit = \"kg|", &[], "kg", text("unit", None)),
            ("; Real x(unit = \"Pa\", displayUnit = \"b|", &[], "b", text("displayUnit", Some("Pa"))),
            ("; Real x(stateSelect = |", &[], "", Slot::Value(real.clone(), "stateSelect".into())),
            ("; Box b(size = 1, redeclare A.B |", &[], "", Slot::Redeclared(boxed.clone(), Element::Component)),
            ("; Box b(redeclare replaceable model |", &[], "", Slot::Redeclared(boxed.clone(), Element::Class)),
            ("x // a.|", &[], "", Slot::Comment),
            ("x /* a.|", &[], "", Slot::Comment),
            ("", &[], "", Slot::Statement),
        ];
        for (text, chain, partial, place) in cases {
            let found = at(text);
            assert_eq!((found.chain, &*found.partial, found.place), (names(chain), partial, place), "{text}");
        }
    }

    #[test]
    fn loops_and_given_names_are_known() {
        let loops = |text: &str| at(text).loops.join(" ");
        assert_eq!(loops("; for i in 1:3, j in 1:2 loop x[i] = f(|"), "i j");
        assert_eq!(loops("; for i in 1:3 loop a = 1; end for; for k loop b = sum(n for n in 1:2) + |"), "k");
        assert_eq!(loops("; for i in 1:3 loop a = 1; end for; x = |"), "");
        assert_eq!(at("; Box b(size = 1, redeclare A.B c(d = 2), |, e = 3);").given, ["size", "c", "e"]);
        assert!(at("; connect(a.|, b);").connects && !at("; x = f(|").connects);
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

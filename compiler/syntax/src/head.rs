//! The first words of a model text: `within P.Q;`, the name of a package, its description.
//!
//! They decide where other files lie and where classes of a package are written into it.  Faults are left to
//! [`crate::parse`]: what is not understood is left out.

use crate::is_keyword;
use crate::tokens::{Kind, Token, tokens};

/// What the head of a text says.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Head {
    /// Names of the enclosing package; empty without `within` or with an empty one.
    pub within: Vec<String>,
    /// Where the text goes on after `within ...;`, in bytes.
    pub after_within: usize,
    /// Name of the package that the text declares, if its first class is one.
    pub package: Option<String>,
    /// Where the elements of that package may begin: after its name and description, in bytes.  None for a package that
    /// is another one by a new name (`package P = Q`), which has no elements of its own.
    pub elements: Option<usize>,
}

/// Reads the head of a text.
pub fn head(text: &str) -> Head {
    let mut head = Head::default();
    let mut words = tokens(text).filter(|token| !token.is_comment());
    let mut word = words.next();
    if is(word, "within") {
        word = words.next();
        while let Some(part) = word.filter(|part| part.is(".") || is_name(part)) {
            if is_name(&part) {
                head.within.push(part.text.to_string());
            }
            head.after_within = end(&part);
            word = words.next();
        }
        if let Some(semicolon) = word.filter(|word| word.is(";")) {
            head.after_within = end(&semicolon);
            word = words.next();
        }
    }
    while word.is_some_and(|word| word.is_one_of(&["encapsulated", "partial", "final"])) {
        word = words.next();
    }
    if !is(word, "package") {
        return head;
    }
    let Some(name) = words.next().filter(is_name) else { return head };
    head.package = Some(name.text.to_string());
    word = words.next();
    if is(word, "=") {
        return head;
    }
    // A description is one string or several that are added.
    let mut elements = end(&name);
    while let Some(string) = word.filter(|word| word.kind == Kind::Text) {
        elements = end(&string);
        word = words.next();
        if is(word, "+") {
            word = words.next();
        } else {
            break;
        }
    }
    head.elements = Some(elements);
    head
}

fn is(word: Option<Token<'_>>, text: &str) -> bool {
    word.is_some_and(|word| word.is(text))
}

fn is_name(token: &Token<'_>) -> bool {
    token.kind == Kind::Word && !is_keyword(token.text)
}

fn end(token: &Token<'_>) -> usize {
    token.at + token.text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_are_read() {
        let check = |text: &str, within: &[&str], package: Option<&str>| {
            let found = head(text);
            assert_eq!(
                (&*found.within, found.package.as_deref()),
                (&*within.iter().map(|name| name.to_string()).collect::<Vec<_>>(), package),
                "{text}"
            );
        };
        check("within A.B;\nmodel C end C;", &["A", "B"], None);
        check("// within X;\n/* within Y; */ within A ; package P end P;", &["A"], Some("P"));
        check("within ; partial package P", &[], Some("P"));
        check("encapsulated package 'my lib' end", &[], Some("'my lib'"));
        check("final package P end P;", &[], Some("P"));
        check("within P . 'a; b' ; model C", &["P", "'a; b'"], None);
        check("within P package Q", &["P"], Some("Q"));
        check("model within end within;", &[], None);
        check("", &[], None);
        check("within A.B", &["A", "B"], None);
        check("/* open", &[], None);
        check("'open", &[], None);
        check("package", &[], None);
    }

    #[test]
    fn places_stand_after_what_they_name() {
        let parts = |text: &'static str| {
            let found = head(text);
            (&text[found.after_within..], found.elements.map(|at| &text[at..]))
        };
        assert_eq!(parts("within P . Q ; model A end A;"), (" model A end A;", None));
        assert_eq!(parts("within; package P end P;"), (" package P end P;", Some(" end P;")));
        assert_eq!(parts("package 'a b' \"c\" + // d\n \"e\\\"\" end 'a b';").1, Some(" end 'a b';"));
        assert_eq!(parts("package P = Q \"d\";"), ("package P = Q \"d\";", None));
    }
}

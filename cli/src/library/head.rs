//! The first words of a model text: `within P.Q;` and the name of a package.
//!
//! Only what decides where other files lie; the compiler parses the text properly.

/// What the head of a text says.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Head {
    /// Names of the enclosing package; empty without `within` or with an empty one.
    pub(super) within: Vec<String>,
    /// Name of the package that the text declares, if its first class is one.
    pub(super) package: Option<String>,
}

/// Reads the head of a text; what it does not understand it leaves out.
pub(super) fn head(text: &str) -> Head {
    let mut words = Words { rest: text };
    let mut head = Head::default();
    let mut word = words.next();
    if word == Some("within") {
        word = words.next();
        while let Some(name) = word.filter(|name| *name != ";") {
            if name != "." {
                head.within.push(name.to_string());
            }
            word = words.next();
        }
        word = words.next();
    }
    while matches!(word, Some("encapsulated" | "partial" | "final")) {
        word = words.next();
    }
    if word == Some("package") {
        head.package = words.next().map(str::to_string);
    }
    head
}

/// Identifiers and single other characters, without spaces and comments.
struct Words<'a> {
    rest: &'a str,
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        self.rest = skip_blank(self.rest);
        let first = self.rest.chars().next()?;
        let length = if first == '\'' {
            self.rest[1..].find('\'').map_or(self.rest.len(), |end| end + 2)
        } else if first.is_alphanumeric() || first == '_' {
            self.rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(self.rest.len())
        } else {
            first.len_utf8()
        };
        let (word, rest) = self.rest.split_at(length);
        self.rest = rest;
        Some(word)
    }
}

fn skip_blank(text: &str) -> &str {
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        rest = if rest.starts_with("//") {
            rest.split_once('\n').map_or("", |(_, after)| after)
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.split_once("*/").map_or("", |(_, after)| after)
        } else {
            return rest;
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_are_read() {
        let check = |text: &str, within: &[&str], package: Option<&str>| {
            let expected =
                Head { within: within.iter().map(|s| s.to_string()).collect(), package: package.map(String::from) };
            assert_eq!(head(text), expected, "{text}");
        };
        check("within A.B;\nmodel C end C;", &["A", "B"], None);
        check("// within X;\n/* within Y; */ within A ; package P end P;", &["A"], Some("P"));
        check("within ; partial package P", &[], Some("P"));
        check("encapsulated package 'my lib' end", &[], Some("'my lib'"));
        check("model within end within;", &[], None);
        check("", &[], None);
        check("within A.B", &["A", "B"], None);
        check("/* open", &[], None);
    }
}

//! One text out of the files of a package, so that a model runs where its package is not.
//!
//! Files of a package stored as a folder begin with `within P;`; here each class is written into its package, right after the
//! package's description.  Only the heads of the files are read: a scanner that knows comments and strings finds them.

/// Puts texts together: packages first, each with its classes, then texts that belong to no package.
pub fn bundle(texts: &[String]) -> String {
    let mut root = Package::default();
    for text in texts {
        let (within, rest) = split_within(text);
        match package_name(rest) {
            Some(name) => {
                let mut path = within.clone();
                path.push(name);
                root.at(&path).own = Some(rest.trim().to_string());
            }
            None => root.at(&within).classes.push(rest.trim().to_string()),
        }
    }
    root.print_inside()
}

#[derive(Default)]
struct Package {
    own: Option<String>,
    classes: Vec<String>,
    inside: Vec<(String, Package)>,
}

impl Package {
    fn at(&mut self, path: &[String]) -> &mut Package {
        let Some((first, rest)) = path.split_first() else { return self };
        let position = match self.inside.iter().position(|(name, _)| name == first) {
            Some(position) => position,
            None => {
                self.inside.push((first.clone(), Package::default()));
                self.inside.len() - 1
            }
        };
        self.inside[position].1.at(rest)
    }

    fn print_inside(&self) -> String {
        let mut text = String::new();
        for (name, package) in &self.inside {
            let inside = package.print_inside();
            match &package.own {
                None => text.push_str(&format!("package {name}\n{inside}end {name};\n")),
                Some(own) => {
                    let at = head_end(own);
                    text.push_str(&format!("{}\n{inside}{}\n", &own[..at], own[at..].trim_start()));
                }
            }
        }
        for class in &self.classes {
            text.push_str(class);
            text.push_str("\n\n");
        }
        text
    }
}

/// A word, a string or a symbol of a text with its end; comments are passed over.
fn token(text: &str, from: usize) -> Option<(&str, usize)> {
    let mut at = from;
    loop {
        at += text[at..].len() - text[at..].trim_start().len();
        let rest = &text[at..];
        if let Some(comment) = rest.strip_prefix("//") {
            at += 2 + comment.find('\n').unwrap_or(comment.len());
        } else if let Some(comment) = rest.strip_prefix("/*") {
            at += 2 + comment.find("*/").map_or(comment.len(), |end| end + 2);
        } else {
            break;
        }
    }
    let rest = &text[at..];
    let first = rest.chars().next()?;
    let length = if first == '"' {
        let mut escaped = false;
        let close = rest[1..].find(|c: char| {
            let closes = c == '"' && !escaped;
            escaped = c == '\\' && !escaped;
            closes
        });
        close.map_or(rest.len(), |close| close + 2)
    } else if first.is_alphanumeric() || first == '_' {
        rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.')).unwrap_or(rest.len())
    } else {
        first.len_utf8()
    };
    Some((&rest[..length], at + length))
}

/// The package that a text says it stands in, and what follows.
fn split_within(text: &str) -> (Vec<String>, &str) {
    let Some(("within", at)) = token(text, 0) else { return (Vec::new(), text) };
    match token(text, at) {
        Some((";", end)) => (Vec::new(), &text[end..]),
        Some((path, at)) => {
            let end = token(text, at).map_or(at, |(_, end)| end);
            (path.split('.').map(str::to_string).collect(), &text[end..])
        }
        None => (Vec::new(), text),
    }
}

/// The name of the package that a text defines.
fn package_name(text: &str) -> Option<String> {
    let (mut word, mut at) = token(text, 0)?;
    while word == "encapsulated" || word == "partial" {
        (word, at) = token(text, at)?;
    }
    if word == "package" { token(text, at).map(|(name, _)| name.to_string()) } else { None }
}

/// Where the elements of a package may begin: after its name and description.
fn head_end(text: &str) -> usize {
    let mut at = 0;
    while let Some((word, end)) = token(text, at) {
        at = end;
        if word == "package" {
            break;
        }
    }
    at = token(text, at).map_or(at, |(_, end)| end);
    match token(text, at) {
        Some((word, end)) if word.starts_with('"') => end,
        _ => at,
    }
}

#[cfg(test)]
mod tests {
    use super::bundle;

    #[test]
    fn classes_go_into_their_packages() {
        let texts = [
            "// first\nwithin;\npackage P \"it says \\\"within\\\"\"\n  annotation(version = \"1\");\nend P;\n"
                .to_string(),
            "within P;\nmodel A \"a\"\nend A;\n".to_string(),
            "within P.Q;\nmodel B\nend B;\n".to_string(),
            "model C\nend C;\n".to_string(),
        ];
        let text = bundle(&texts);
        let at = |part: &str| text.find(part).unwrap_or_else(|| panic!("`{part}` is missing in {text}"));
        assert!(at("package P") < at("package Q") && at("model B") < at("end Q;") && at("end Q;") < at("model A"));
        assert!(at("model A") < at("annotation(version") && at("end P;") < at("model C"));
        assert!(!text.contains("within P"));
    }
}

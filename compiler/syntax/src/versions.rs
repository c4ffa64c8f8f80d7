//! Versions of libraries as texts state them (Modelica 3.6, section 18.8): `annotation(version = "1.2.0", uses(Other(version = "2.0")))`.
//!
//! Reads words only, so that which library is meant is known before any text is parsed.

use std::cmp::Ordering;

use crate::tokens::{Kind, Token, tokens};

/// The libraries that a text says it uses, and the versions, in their order.
pub fn uses(text: &str) -> Vec<(String, String)> {
    if !text.contains("uses") {
        return Vec::new();
    }
    let mut found = Vec::new();
    annotated(text, &mut |path, value| {
        if let [uses, library, version] = path
            && (*uses, *version) == ("uses", "version")
        {
            found.push((library.to_string(), value.to_string()));
        }
    });
    found
}

/// The version of the library that a text is.
pub fn version(text: &str) -> Option<String> {
    let mut found = None;
    // That of a package stands behind those of the classes in it.
    annotated(text, &mut |path, value| {
        if path == ["version"] {
            found = Some(value.to_string());
        }
    });
    found
}

/// Goes through the strings in annotations: the names around each, and the string.
fn annotated(text: &str, visit: &mut dyn FnMut(&[&str], &str)) {
    let words: Vec<Token<'_>> = tokens(text).filter(|token| !token.is_comment()).collect();
    let mut k = 0;
    while k + 1 < words.len() {
        if !(words[k].is("annotation") && words[k + 1].is("(")) {
            k += 1;
            continue;
        }
        k += 2;
        // A name for each open parenthesis but the first; none where something else stands before it.
        let mut path: Vec<&str> = Vec::new();
        let mut depth = 1;
        while depth > 0 && k < words.len() {
            let word = &words[k];
            if word.is_one_of(&["(", "{", "["]) {
                let before = &words[k - 1];
                path.push(if word.is("(") && before.kind == Kind::Word { before.text } else { "" });
                depth += 1;
            } else if word.is_one_of(&[")", "}", "]"]) {
                path.pop();
                depth -= 1;
            } else if word.kind == Kind::Text && words[k - 1].is("=") && words[k - 2].kind == Kind::Word {
                path.push(words[k - 2].text);
                visit(&path, word.text.trim_matches('"'));
                path.pop();
            }
            k += 1;
        }
    }
}

/// Compares versions by their numbers: `1.10` comes after `1.9`, `2.0 beta` before `2.0`, and what a packager adds (`1.2.0+maint.om`) does not count.
pub fn compare_versions(one: &str, other: &str) -> Ordering {
    let parts = |version: &str| -> (Vec<u64>, bool, String) {
        let version = version.split('+').next().unwrap_or_default().trim();
        let end = version.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(version.len());
        let mut numbers: Vec<u64> = version[..end].split('.').map(|part| part.parse().unwrap_or(0)).collect();
        while numbers.last() == Some(&0) {
            numbers.pop();
        }
        (numbers, end == version.len(), version[end..].to_string())
    };
    parts(one).cmp(&parts(other))
}

#[cfg(test)]
mod tests {
    use std::cmp::Ordering;

    use super::{compare_versions, uses, version};

    #[test]
    fn what_a_text_uses_and_is() {
        let text = "package P \"version = \\\"9\\\"\"\n  model A\n    annotation(uses(Modelica(version = \"4.0.0\", x(y = {1})), Other(version=\"1.0\")), \
                    experiment(StopTime = 2));\n  end A;\n  // annotation(version = \"7\")\n  annotation(version = \"1.2.0\", conversion(from(version = \"1.0\", \
                    script = \"a.mos\")), Icon(graphics = {Text(textString = \"%name\")}));\nend P;\n";
        let expected = [("Modelica", "4.0.0"), ("Other", "1.0")].map(|(a, b)| (a.to_string(), b.to_string()));
        assert_eq!(uses(text), expected);
        assert_eq!(version(text), Some("1.2.0".to_string()));
        for text in [
            "",
            "annotation(",
            "annotation(uses(",
            "annotation(version =",
            "model uses end uses;",
            "annotation(= \"x\")",
        ] {
            assert!(uses(text).is_empty() && version(text).is_none(), "{text}");
        }
    }

    #[test]
    fn versions_have_an_order() {
        for (one, other, expected) in [
            ("1.10", "1.9", Ordering::Greater),
            ("4.0.0", "4.0.0", Ordering::Equal),
            ("2.0 beta", "2.0", Ordering::Less),
            ("3.2.3", "4.1.0", Ordering::Less),
            ("1.0.1", "1.0", Ordering::Greater),
            ("1.2.0+maint.om", "1.2.0", Ordering::Equal),
            ("1.2", "1.2.0", Ordering::Equal),
        ] {
            assert_eq!(compare_versions(one, other), expected, "{one} {other}");
        }
    }
}

//! Strings of JSON (RFC 8259, section 7), on their own and inside the script of a page.

use std::fmt::Write;

/// Adds a string with its quotes.
pub(crate) fn push_string(json: &mut String, text: &str) {
    json.push('"');
    for c in text.chars() {
        match c {
            '"' => json.push_str("\\\""),
            '\\' => json.push_str("\\\\"),
            '\n' => json.push_str("\\n"),
            '\r' => json.push_str("\\r"),
            '\t' => json.push_str("\\t"),
            c if c < ' ' => {
                let _ = write!(json, "\\u{:04x}", c as u32);
            }
            c => json.push(c),
        }
    }
    json.push('"');
}

/// A string that may stand inside a script element: nothing in it ends the element, or a line of the script.
pub(crate) fn quote(text: &str) -> String {
    let mut string = String::with_capacity(text.len() + 2);
    push_string(&mut string, text);
    let mut quoted = String::with_capacity(string.len());
    for c in string.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => {
                // Writing to a string cannot fail.
                let _ = write!(quoted, "\\u{:04x}", c as u32);
            }
            c => quoted.push(c),
        }
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_characters_are_escaped() {
        let mut odd = String::new();
        push_string(&mut odd, "\"\\\t\u{1}ö");
        assert_eq!(odd, r#""\"\\\t\u0001ö""#);
    }

    #[test]
    fn text_cannot_leave_the_script() {
        assert_eq!(quote("a\"\\</script>\n\u{2028}&\u{2029}"), r#""a\"\\\u003c/script\u003e\n\u2028\u0026\u2029""#);
    }
}

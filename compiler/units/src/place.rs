//! Where in the text of an equation an operand stands.
//!
//! Nodes carry no places, so operands are looked for by the names in them, as whole words with their dots, in the text of the
//! equation.  A place is given only where it is certain: every name of the operand once, and no name of the other
//! operand in between.

use hyd_source::Span;
use rustc_hash::FxHashSet;

/// The integers of a text that are written in digits: `100000` counts something, `1e5` measures it.
pub(crate) struct WholeNumbers(FxHashSet<u64>);

impl WholeNumbers {
    /// Those of a text, looked for once.
    pub(crate) fn of(text: &str) -> Self {
        let bytes = text.as_bytes();
        let mut found = FxHashSet::default();
        let mut at = 0;
        while at < bytes.len() {
            let word = bytes[at].is_ascii_alphabetic() || bytes[at] == b'_';
            if word {
                at += bytes[at..].iter().take_while(|b| b.is_ascii_alphanumeric() || **b == b'_').count();
            } else if bytes[at].is_ascii_digit() {
                let length = number_length(&bytes[at..]);
                let digits = text.get(at..at + length).filter(|t| t.bytes().all(|b| b.is_ascii_digit()));
                found.extend(digits.and_then(|t| t.parse::<f64>().ok()).map(f64::to_bits));
                at += length;
            } else {
                at += 1;
            }
        }
        Self(found)
    }

    /// True if a positive number is among them.
    pub(crate) fn has(&self, value: f64) -> bool {
        self.0.contains(&value.to_bits())
    }
}

fn number_length(bytes: &[u8]) -> usize {
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    if bytes.get(length) == Some(&b'.') {
        length += 1 + digits(length + 1);
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits((length + 1 + sign).min(bytes.len()));
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    length
}

/// Byte ranges at which a dotted name without subscripts stands in the text, subscripts in the text skipped.
fn occurrences(text: &str, name: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        if !(bytes[at].is_ascii_alphabetic() || bytes[at] == b'_') {
            at += if bytes[at].is_ascii_digit() { number_length(&bytes[at..]).max(1) } else { 1 };
            continue;
        }
        let start = at;
        let (end, plain) = reference(text, at);
        if plain == name {
            found.push((start, end));
        }
        // References inside subscripts count too.
        at += bytes[at..].iter().take_while(|b| b.is_ascii_alphanumeric() || **b == b'_').count();
        while at < end && bytes[at] == b'.' {
            at += 1;
            at += bytes[at..].iter().take_while(|b| b.is_ascii_alphanumeric() || **b == b'_').count();
        }
    }
    found
}

/// The reference that begins here: its end and its text without subscripts.
fn reference(text: &str, start: usize) -> (usize, String) {
    let bytes = text.as_bytes();
    let mut plain = String::new();
    let mut at = start;
    loop {
        let length = bytes[at..].iter().take_while(|b| b.is_ascii_alphanumeric() || **b == b'_').count();
        plain.push_str(text.get(at..at + length).unwrap_or(""));
        at += length;
        if bytes.get(at) == Some(&b'[') {
            match closing(bytes, at) {
                Some(end) => at = end + 1,
                None => return (at, plain),
            }
        }
        let more =
            bytes.get(at) == Some(&b'.') && bytes.get(at + 1).is_some_and(|b| b.is_ascii_alphabetic() || *b == b'_');
        if !more {
            return (at, plain);
        }
        plain.push('.');
        at += 1;
    }
}

fn closing(bytes: &[u8], open: usize) -> Option<usize> {
    let mut depth = 0;
    for (k, b) in bytes.iter().enumerate().skip(open) {
        match b {
            b'[' => depth += 1,
            b']' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some(k);
        }
    }
    None
}

/// The name without subscripts.
pub(crate) fn without_subscripts(name: &str) -> String {
    let mut depth = 0;
    name.chars()
        .filter(|c| {
            depth += i32::from(*c == '[');
            let keep = depth == 0;
            depth -= i32::from(*c == ']');
            keep
        })
        .collect()
}

/// The only place of a variable in the text: by its name in the component, else (in a connection) by the longest part of it
/// that occurs.
fn place_of(text: &str, connection: bool, name: &str) -> Option<(usize, usize)> {
    let parts: Vec<&str> = name.split('.').collect();
    for length in (1..=parts.len()).rev() {
        for from in (0..=parts.len() - length).rev() {
            let whole = from + length == parts.len();
            if !whole && !connection {
                continue;
            }
            match occurrences(text, &parts[from..from + length].join("."))[..] {
                [] => {}
                [only] => return Some(only),
                _ => return None,
            }
        }
    }
    None
}

/// The place of an operand with the names `mine`, apart from another with the names `others`.
pub(crate) fn operand(
    (text, span): (&str, Span),
    connection: bool,
    mine: &[String],
    others: &[String],
) -> Option<Span> {
    let places: Vec<(usize, usize)> =
        mine.iter().map(|name| place_of(text, connection, name)).collect::<Option<_>>()?;
    let mut start = places.iter().map(|p| p.0).min()?;
    let mut end = places.iter().map(|p| p.1).max()?;
    let between = |name: &String| {
        let plain = occurrences(text, name);
        plain.iter().any(|&(from, _)| from >= start && from < end)
    };
    if others.iter().any(between) {
        return None;
    }
    for opening in ["der(", "sqrt(", "abs("] {
        if text.get(..start).is_some_and(|t| t.ends_with(opening))
            && text.get(end..).is_some_and(|t| t.starts_with(')'))
        {
            start -= opening.len();
            end += 1;
        }
    }
    let offset = span.start as usize;
    Some(Span::new(span.file, offset + start, offset + end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_by_value_and_not_inside_words() {
        let has_number = |text, value| WholeNumbers::of(text).has(value);
        assert!(has_number("x1000 + 1000*y", 1000.0));
        assert!(!has_number("x1000 + 1e3*y", 1000.0));
        assert!(!has_number("x1000 + a", 1000.0));
        assert!(!has_number("2.50e+1", 25.0));
        assert!(has_number("25", 25.0));
    }

    #[test]
    fn references_are_whole_and_subscripts_may_stand_between() {
        assert_eq!(occurrences("ab.c + b.c[k] + b[2].c", "b.c"), [(7, 13), (16, 22)]);
        assert_eq!(occurrences("p[k] + k", "k"), [(2, 3), (7, 8)]);
        assert_eq!(without_subscripts("a[1,2].b[3]"), "a.b");
    }
}

//! Values given as text from outside (`--set a=1.2`, a plan, a file of parameters): literals and lists of literals,
//! read by the type of what they are for.

use std::fmt;
use std::ops::Range;

use crate::tables::{NamePattern, ValueKind};
use crate::text::told_apart;

/// Lists are nested no deeper.
const DEEPEST: usize = 32;
/// Larger integers are not exact as they are stored.
const LARGEST: u64 = 1 << 53;

/// A value as it was written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Given<'t> {
    /// A literal without the blanks around it.
    Leaf(&'t str),
    /// A list in braces.
    List(Vec<Given<'t>>),
}

impl<'t> Given<'t> {
    /// Reads `1.2`, `b`, `"text"` or `{1, {2, 3}}`.
    ///
    /// # Errors
    /// Why it is not a value.
    pub fn read(text: &'t str) -> Result<Self, String> {
        let (value, rest) = Self::part(text.trim(), 0)?;
        if rest.is_empty() { Ok(value) } else { Err(format!("`{rest}` follows its end")) }
    }

    /// The value at the beginning of a text, and what follows it.
    fn part(text: &'t str, depth: usize) -> Result<(Self, &'t str), String> {
        let Some(mut rest) = text.strip_prefix('{') else { return leaf(text, depth) };
        if depth == DEEPEST {
            // Deeper lists than any model has would only exhaust the stack.
            return Err(format!("its lists are nested more than {DEEPEST} levels deep"));
        }
        let mut items = Vec::new();
        rest = rest.trim_start();
        if let Some(after) = rest.strip_prefix('}') {
            return Ok((Given::List(items), after.trim_start()));
        }
        loop {
            let (item, after) = Self::part(rest, depth + 1)?;
            items.push(item);
            if let Some(after) = after.strip_prefix('}') {
                return Ok((Given::List(items), after.trim_start()));
            }
            rest = after.strip_prefix(',').ok_or("its braces do not match")?.trim_start();
        }
    }

    /// The sizes of nested lists; none of a literal.
    ///
    /// # Errors
    /// Lists side by side have different sizes.
    pub fn sizes(&self) -> Result<Vec<usize>, String> {
        let Given::List(items) = self else { return Ok(Vec::new()) };
        let mut sizes = vec![items.len()];
        let mut all = items.iter().map(Given::sizes);
        if let Some(first) = all.next().transpose()? {
            for other in all {
                if other? != first {
                    return Err("its lists have different sizes".to_string());
                }
            }
            sizes.extend(first);
        }
        Ok(sizes)
    }

    /// The literals, row by row.
    pub fn leaves(&self) -> Vec<&'t str> {
        match self {
            Given::Leaf(text) => vec![text],
            Given::List(items) => items.iter().flat_map(Given::leaves).collect(),
        }
    }
}

impl fmt::Display for Given<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Given::Leaf(text) => f.write_str(text),
            Given::List(items) => {
                let items: Vec<String> = items.iter().map(Given::to_string).collect();
                write!(f, "{{{}}}", items.join(", "))
            }
        }
    }
}

/// A literal: up to a comma or brace if it stands in a list, quotes and what they hold as one.
fn leaf(text: &str, depth: usize) -> Result<(Given<'_>, &str), String> {
    let end = match text.strip_prefix('"') {
        Some(inside) => {
            let mut escaped = false;
            let close = inside.find(|c| {
                let closes = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                closes
            });
            close.ok_or("its quotes do not match")? + 2
        }
        None if depth == 0 => text.len(),
        None => text.find([',', '{', '}']).ok_or("its braces do not match")?,
    };
    let (leaf, rest) = (text[..end].trim_end(), text[end..].trim_start());
    if leaf.is_empty() { Err("a value is missing".to_string()) } else { Ok((Given::Leaf(leaf), rest)) }
}

/// Elements of a variable that a name means: one of them, or all where the name is that of a whole array.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Elements {
    /// An element, or the only one.
    One(usize),
    /// All of an array.
    All,
}

impl Elements {
    /// Which elements of a variable a name means.
    pub fn of(pattern: &NamePattern, name: &str) -> Option<Self> {
        let bare: String = pattern.parts.iter().map(|(text, _)| &**text).collect();
        if pattern.derivative || !name.starts_with(&*pattern.parts.first()?.0) {
            None
        } else if pattern.parts.iter().all(|(_, dims)| dims.is_empty()) {
            (bare == name).then_some(Elements::One(0))
        } else if bare == name {
            Some(Elements::All)
        } else {
            let spaceless: String = name.chars().filter(|c| !c.is_whitespace()).collect();
            (0..pattern.count()).find(|&k| pattern.element(k) == spaceless).map(Elements::One)
        }
    }

    /// Their positions.
    pub fn range(self, pattern: &NamePattern) -> Range<usize> {
        match self {
            Elements::One(k) => k..k + 1,
            Elements::All => 0..pattern.count(),
        }
    }

    /// The sizes of what a value for them has; none of a single one.
    pub fn sizes(self, pattern: &NamePattern) -> Vec<usize> {
        match self {
            Elements::One(_) => Vec::new(),
            Elements::All => pattern.parts.iter().flat_map(|(_, sizes)| sizes).map(|&size| size as usize).collect(),
        }
    }
}

/// A literal as it is stored in a run.
///
/// # Errors
/// Why it is not a value of this type.
pub fn number(kind: &ValueKind, leaf: &str) -> Result<f64, String> {
    match kind {
        ValueKind::Real => {
            // `inf` and `nan` parse as numbers in Rust and are not values here.
            let number = leaf.parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| "it is a Real and needs a finite number".to_string())
        }
        ValueKind::Integer => {
            let number = leaf.parse::<i64>().map_err(|_| "it is an Integer and needs an integer value".to_string())?;
            if number.unsigned_abs() > LARGEST {
                return Err("it is an Integer, and integers this large are not exact".to_string());
            }
            Ok(number as f64)
        }
        ValueKind::Boolean => match leaf {
            "true" => Ok(1.0),
            "false" => Ok(0.0),
            _ => Err("it is a Boolean: `true` or `false`".to_string()),
        },
        ValueKind::Enumeration(literals) => {
            let last = leaf.rsplit('.').next().unwrap_or(leaf);
            let position = literals.iter().position(|literal| **literal == *last);
            position.map(|k| (k + 1) as f64).ok_or_else(|| format!("it is one of {}", literals.join(", ")))
        }
    }
}

/// What a literal says as a String: the text in quotes, or the bare one.
pub fn string(leaf: &str) -> String {
    let Some(inside) = leaf.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) else { return leaf.to_string() };
    let mut text = String::with_capacity(inside.len());
    let mut characters = inside.chars();
    while let Some(c) = characters.next() {
        match (c, if c == '\\' { characters.next() } else { None }) {
            (_, Some('n')) => text.push('\n'),
            (_, Some('t')) => text.push('\t'),
            (_, Some(escaped)) => text.push(escaped),
            (c, None) => text.push(c),
        }
    }
    text
}

/// The numbers of an array of these sizes, row by row: a list nested as the array is, or one value for all.
///
/// # Errors
/// Why it is not a value of this type and these sizes.
pub fn numbers(kind: &ValueKind, text: &str, sizes: &[usize]) -> Result<Vec<f64>, String> {
    let given = Given::read(text)?;
    match &given {
        Given::Leaf(leaf) => Ok(vec![number(kind, leaf)?; sizes.iter().product()]),
        Given::List(_) => {
            let found = given.sizes()?;
            if found != sizes {
                return Err(wrong_sizes(sizes, &found));
            }
            given.leaves().into_iter().map(|leaf| number(kind, leaf)).collect()
        }
    }
}

/// Says that sizes differ.
pub fn wrong_sizes(wanted: &[usize], found: &[usize]) -> String {
    let text = |sizes: &[usize]| sizes.iter().map(usize::to_string).collect::<Vec<_>>().join(" by ");
    match wanted {
        [] => "it is not an array".to_string(),
        _ => format!("it has {} elements, not {}", text(wanted), text(found)),
    }
}

/// How a value is outside its limits.
pub struct Outside {
    /// A sentence: name, value, limit.
    pub message: String,
    /// The limit is `min`, not `max`.
    pub is_below: bool,
}

/// What is to be said of a value that is below `min` or above `max`; only then its name is asked for.
pub fn outside(name: impl FnOnce() -> String, kind: &ValueKind, value: f64, (min, max): (f64, f64)) -> Option<Outside> {
    let (words, attribute, limit) = match value {
        value if value < min => ("below", "min", min),
        value if value > max => ("above", "max", max),
        _ => return None,
    };
    let [value, limit] = match kind {
        ValueKind::Enumeration(literals) => [value, limit].map(|value| {
            let literal = literals.get((value as usize).wrapping_sub(1));
            literal.map_or_else(|| value.to_string(), |literal| format!("`{literal}`"))
        }),
        _ => told_apart(value, limit),
    };
    let message = format!("`{}` is {value}, {words} its `{attribute}` {limit}", name());
    Some(Outside { message, is_below: attribute == "min" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_mean_elements_or_whole_arrays() {
        let array = NamePattern { parts: vec![("a".into(), vec![4]), (".b".into(), vec![2, 3])], derivative: false };
        assert_eq!(Elements::of(&array, "a[2].b[1, 3]"), Some(Elements::One(8)));
        assert_eq!(Elements::of(&array, "a.b"), Some(Elements::All));
        assert_eq!(Elements::of(&array, "a[5].b[1,1]"), None);
        assert_eq!(Elements::of(&NamePattern::scalar("m"), "m"), Some(Elements::One(0)));
        assert_eq!(Elements::of(&NamePattern::scalar("m"), "mm"), None);
        assert_eq!((Elements::All.range(&array), Elements::All.sizes(&array)), (0..24, vec![4, 2, 3]));
        assert_eq!((Elements::One(8).range(&array), Elements::One(8).sizes(&array)), (8..9, vec![]));
    }

    #[test]
    fn values_fit_type_and_sizes() {
        let modes = ValueKind::Enumeration(["off".into(), "on".into()].into());
        let real = &ValueKind::Real;
        assert_eq!(numbers(real, " 1.5e-3 ", &[]), Ok(vec![1.5e-3]));
        assert_eq!(numbers(real, "{{1, 2}, {3, 4} }", &[2, 2]), Ok(vec![1.0, 2.0, 3.0, 4.0]));
        assert_eq!(numbers(real, "7", &[3]), Ok(vec![7.0; 3]));
        assert_eq!(numbers(real, "{}", &[0]), Ok(vec![]));
        assert_eq!(numbers(&ValueKind::Integer, "-3000000000", &[]), Ok(vec![-3e9]));
        assert_eq!(numbers(&ValueKind::Boolean, "{true, false}", &[2]), Ok(vec![1.0, 0.0]));
        assert_eq!(numbers(&modes, "Pkg.Mode.on", &[]), Ok(vec![2.0]));
        let refused: [(&ValueKind, &str, &[usize], &str); 18] = [
            (real, "abc", &[], "it is a Real and needs a finite number"),
            (real, "inf", &[], "it is a Real and needs a finite number"),
            (real, "1,5", &[], "it is a Real and needs a finite number"),
            (real, "", &[], "a value is missing"),
            (real, "{1,,2}", &[3], "a value is missing"),
            (real, "{1, 2", &[2], "its braces do not match"),
            (real, "{{{1,2}", &[2], "its braces do not match"),
            (real, "{1, 2}}", &[2], "`}` follows its end"),
            (real, "{1}, 2", &[1], "`, 2` follows its end"),
            (real, "{{1, 2}, {3}}", &[2, 2], "its lists have different sizes"),
            (real, "{{1, 2}, 3}", &[2, 2], "its lists have different sizes"),
            (real, "{1, 2}", &[3], "it has 3 elements, not 2"),
            (real, "{1, 2, 3, 4}", &[2, 2], "it has 2 by 2 elements, not 4"),
            (real, "{1}", &[], "it is not an array"),
            (&ValueKind::Integer, "1.5", &[], "it is an Integer and needs an integer value"),
            (&ValueKind::Integer, "9007199254740993", &[], "it is an Integer, and integers this large are not exact"),
            (&ValueKind::Boolean, "1", &[], "it is a Boolean: `true` or `false`"),
            (&modes, "auto", &[], "it is one of off, on"),
        ];
        for (kind, text, sizes, reason) in refused {
            assert_eq!(numbers(kind, text, sizes), Err(reason.to_string()), "{text}");
        }
        let deep = format!("{}1{}", "{".repeat(100_000), "}".repeat(100_000));
        assert_eq!(numbers(real, &deep, &[1]), Err("its lists are nested more than 32 levels deep".to_string()));
    }

    #[test]
    fn strings_are_bare_or_in_quotes() {
        let read = |text| Given::read(text).map(|given| given.leaves().into_iter().map(string).collect::<Vec<_>>());
        assert_eq!(read("oil, new.txt"), Ok(vec!["oil, new.txt".to_string()]));
        assert_eq!(read(r#"{"a, {b}", c d , "e\"\\\n"}"#), Ok(["a, {b}", "c d", "e\"\\\n"].map(String::from).to_vec()));
        assert_eq!(read("\"two"), Err("its quotes do not match".to_string()));
        assert_eq!(read("\"a\" b"), Err("`b` follows its end".to_string()));
    }

    #[test]
    fn limits_are_told_apart_from_values() {
        let said = |value, min| outside(|| "k".into(), &ValueKind::Real, value, (min, 1.0)).map(|said| said.message);
        assert_eq!(said(-1.0, 0.0).as_deref(), Some("`k` is -1, below its `min` 0"));
        assert_eq!(said(0.1 + 0.2, 0.0), None);
        assert_eq!(said(0.3, 0.1 + 0.2).as_deref(), Some("`k` is 0.3, below its `min` 0.30000000000000004"));
        assert_eq!(said(6e23, 0.0).as_deref(), Some("`k` is 6e23, above its `max` 1"));
    }
}

//! Values set from outside (`--set a.b=1.2`), read by the type of what they are for: literals and lists of literals.

use hyd_syntax::tree::Name;

use crate::instance::ScalarType;
use crate::value::Value;

/// Lists are nested no deeper.
const DEEPEST: usize = 32;

/// Reads `1.2`, `3`, `true`, `"text"` or bare text, the name of a literal, or `{1, 2}`.
///
/// # Errors
/// Why it is no value of this type.
pub(crate) fn read_value(scalar: &ScalarType, text: &str) -> Result<Value, String> {
    read(scalar, text.trim(), 0)
}

fn read(scalar: &ScalarType, text: &str, depth: usize) -> Result<Value, String> {
    let Some(inner) = text.strip_prefix('{').and_then(|t| t.strip_suffix('}')) else { return leaf(scalar, text) };
    // Deeper lists than any model has would only exhaust the stack.
    let items = split_list(inner).filter(|_| depth < DEEPEST).ok_or_else(|| "its braces do not pair".to_string())?;
    items.into_iter().map(|item| read(scalar, item.trim(), depth + 1)).collect::<Result<_, _>>().map(Value::Array)
}

fn leaf(scalar: &ScalarType, text: &str) -> Result<Value, String> {
    let whole = text.parse::<i64>().ok();
    match scalar {
        ScalarType::Real => {
            // `inf` and `nan` parse as numbers in Rust and are no values here.
            let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
            let value = whole.map(Value::Integer).or(number.map(Value::Real));
            value.ok_or_else(|| "it is a Real and needs a finite number".to_string())
        }
        ScalarType::Integer => {
            whole.map(Value::Integer).ok_or_else(|| "it is an Integer and needs a whole number".to_string())
        }
        ScalarType::Boolean => match text {
            "true" => Ok(Value::Boolean(true)),
            "false" => Ok(Value::Boolean(false)),
            _ => Err("it is a Boolean: `true` or `false`".to_string()),
        },
        ScalarType::Text => {
            let inner = text.strip_prefix('"').and_then(|t| t.strip_suffix('"'));
            Ok(Value::Text(inner.unwrap_or(text).into()))
        }
        ScalarType::Enumeration(kind) => {
            let last = text.rsplit('.').next().unwrap_or(text);
            let position = kind.literals.iter().position(|literal| **literal == *last);
            let value = position.map(|k| Value::Enumeration(kind.clone(), k as u32 + 1));
            value.ok_or_else(|| {
                let literals: Vec<&str> = kind.literals.iter().map(Name::as_ref).collect();
                format!("it is one of {}", literals.join(", "))
            })
        }
    }
}

/// Items between commas outside braces; `None` if the braces do not pair.
fn split_list(text: &str) -> Option<Vec<&str>> {
    let (mut items, mut depth, mut start) = (Vec::new(), 0usize, 0);
    for (k, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth = depth.checked_sub(1)?,
            ',' if depth == 0 => {
                items.push(&text[start..k]);
                start = k + 1;
            }
            _ => {}
        }
    }
    if depth != 0 {
        return None;
    }
    items.push(&text[start..]);
    Some(items)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::value::EnumType;

    #[test]
    fn literals_and_lists_are_read_and_nothing_else() {
        let real = |text: &str| read_value(&ScalarType::Real, text);
        assert_eq!(real(" 1e-3 "), Ok(Value::Real(1e-3)));
        assert_eq!(real("-4"), Ok(Value::Integer(-4)));
        let rows = |a, b| Value::Array(vec![Value::Integer(a), Value::Integer(b)]);
        assert_eq!(real("{{1,2}, {3,4}}"), Ok(Value::Array(vec![rows(1, 2), rows(3, 4)])));
        let deep = format!("{}1{}", "{".repeat(100_000), "}".repeat(100_000));
        for bad in ["", "x", "1..2", "{1", "nan", "inf", "{1}}", "true", &deep] {
            assert!(real(bad).is_err(), "{bad}");
        }
        assert!(read_value(&ScalarType::Integer, "2.0").is_err());
    }

    #[test]
    fn literals_and_strings_need_no_more_than_their_name() {
        let kind = Arc::new(EnumType { name: "P.E".into(), literals: vec!["a".into(), "b".into()] });
        let scalar = ScalarType::Enumeration(kind.clone());
        for text in ["b", "E.b", "P.E.b"] {
            assert_eq!(read_value(&scalar, text), Ok(Value::Enumeration(kind.clone(), 2)), "{text}");
        }
        assert_eq!(read_value(&scalar, "c"), Err("it is one of a, b".to_string()));
        for text in ["oil.txt", "\"oil.txt\""] {
            assert_eq!(read_value(&ScalarType::Text, text), Ok(Value::Text("oil.txt".into())));
        }
    }
}

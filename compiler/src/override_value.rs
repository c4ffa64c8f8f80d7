//! Values set from outside (`--set a.b=1.2`): literals and lists of literals.

use hyd_instance::Value;

/// Reads `1.2`, `3`, `true`, `"text"` or `{1, 2}`; `None` if the text is none of these.
pub fn read_value(text: &str) -> Option<Value> {
    let text = text.trim();
    if let Some(inner) = text.strip_prefix('{').and_then(|t| t.strip_suffix('}')) {
        return split_list(inner)?.into_iter().map(read_value).collect::<Option<_>>().map(Value::Array);
    }
    match text {
        "true" => return Some(Value::Boolean(true)),
        "false" => return Some(Value::Boolean(false)),
        _ => {}
    }
    if let Some(inner) = text.strip_prefix('"').and_then(|t| t.strip_suffix('"')) {
        return Some(Value::Text(inner.into()));
    }
    if let Ok(whole) = text.parse::<i64>() {
        return Some(Value::Integer(whole));
    }
    // `inf` and `nan` parse as numbers in Rust and are no values here.
    let number = text.parse::<f64>().ok()?;
    number.is_finite().then_some(Value::Real(number))
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
        // Deeper lists than any model has would only exhaust the stack.
        if depth > 32 {
            return None;
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
    use super::*;

    #[test]
    fn literals_and_lists_are_read_and_nothing_else() {
        assert_eq!(read_value(" 1e-3 "), Some(Value::Real(1e-3)));
        assert_eq!(read_value("-4"), Some(Value::Integer(-4)));
        let rows = |a, b| Value::Array(vec![Value::Integer(a), Value::Integer(b)]);
        assert_eq!(read_value("{{1,2},{3,4}}"), Some(Value::Array(vec![rows(1, 2), rows(3, 4)])));
        for bad in ["", "x", "1..2", "{1", "nan", "inf", "{1}}"] {
            assert_eq!(read_value(bad), None, "{bad}");
        }
    }
}

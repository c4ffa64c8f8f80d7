//! Parameters from a TOML file: `"valve.m" = 0.02`, `valve.m = 0.02`, or a table `[valve]` with `m = 0.02`.

use std::path::Path;

use toml::{Table, Value};

use crate::{Failure, read_text};

/// Longest text (bytes): reading it takes fifty times as much memory.
const LONGEST: usize = 4 << 20;

/// Names with their values as text, as `--set` takes them.
///
/// # Errors
/// The file cannot be read, is not TOML, or holds what is not a value of a parameter.
pub fn read(path: &Path) -> Result<Vec<(String, String)>, Failure> {
    let text = read_text(path).map_err(|error| Failure::Fault(error.to_string()))?;
    parse(&text).map_err(|reason| Failure::Fault(format!("`{}`: {reason}", path.display())))
}

/// The parameters of a text and their values, as `--set` takes them.
///
/// # Errors
/// A sentence: the text is too long or no TOML, or a value is of a kind that no parameter has.
pub fn parse(text: &str) -> Result<Vec<(String, String)>, String> {
    if text.len() > LONGEST {
        return Err(format!("it is longer than {} MB, as no file of parameters is", LONGEST >> 20));
    }
    let table: Table = text.parse().map_err(|error: toml::de::Error| error.to_string().trim_end().to_string())?;
    let mut list = Vec::new();
    collect(&table, "", &mut list)?;
    Ok(list)
}

fn collect(table: &Table, prefix: &str, list: &mut Vec<(String, String)>) -> Result<(), String> {
    for (key, value) in table {
        let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            Value::Table(inner) => collect(inner, &name, list)?,
            _ => list.push((
                name.clone(),
                value_text(value).ok_or_else(|| format!("`{name}` is not a value that a parameter can have"))?,
            )),
        }
    }
    Ok(())
}

fn value_text(value: &Value) -> Option<String> {
    match value {
        Value::Float(number) => Some(format!("{number:?}")),
        Value::Integer(number) => Some(number.to_string()),
        Value::Boolean(truth) => Some(truth.to_string()),
        Value::String(text) => Some(text.clone()),
        Value::Array(list) => {
            let texts = list.iter().map(value_text).collect::<Option<Vec<String>>>()?;
            Some(format!("{{{}}}", texts.join(", ")))
        }
        Value::Datetime(_) | Value::Table(_) => None,
    }
}

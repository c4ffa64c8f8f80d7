//! The arguments that constructors of tables share: the matrix, from the text or a file, and the choices.

use hyd_syntax::tree::Name;

use crate::external::DataFiles;
use crate::external::pieces::Outside;
use crate::external::table_file::matrix_of_file;
use crate::values::value::Value;

/// How a table goes between its points; the order is that of the enumeration `Smoothness` of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Smoothness {
    Linear,
    Akima,
    Constant,
    FritschButland,
    Steffen,
    ModifiedAkima,
}

impl Smoothness {
    pub(crate) fn of(value: Option<&Value>) -> Result<Self, String> {
        match number(value) {
            Some(1) => Ok(Smoothness::Linear),
            Some(2) => Ok(Smoothness::Akima),
            Some(3) => Ok(Smoothness::Constant),
            Some(4) => Ok(Smoothness::FritschButland),
            Some(5) => Ok(Smoothness::Steffen),
            Some(6) => Ok(Smoothness::ModifiedAkima),
            _ => Err("a table has an unknown smoothness".to_string()),
        }
    }
}

/// The number of a literal, or an Integer.
pub(crate) fn number(value: Option<&Value>) -> Option<i64> {
    match value? {
        Value::Enumeration(_, k) => Some(i64::from(*k)),
        other => other.as_integer(),
    }
}

pub(crate) fn outside(value: Option<&Value>) -> Result<Outside, String> {
    match number(value) {
        Some(1) => Ok(Outside::Hold),
        Some(2) => Ok(Outside::Line),
        Some(3) => Ok(Outside::Repeat),
        Some(4) => Ok(Outside::Nothing),
        _ => Err("a table has an unknown extrapolation".to_string()),
    }
}

pub(crate) fn real(value: Option<&Value>, what: &str) -> Result<f64, String> {
    value.and_then(Value::as_real).ok_or_else(|| format!("a table lacks {what}"))
}

fn text(value: Option<&Value>) -> Option<&Name> {
    match value? {
        Value::Text(text) => Some(text),
        _ => None,
    }
}

/// Names that stand for no file.
fn is_no_name(name: &str) -> bool {
    name.trim().is_empty() || name == "NoName"
}

/// The columns of output, counted from 1 in the matrix.
pub(crate) fn columns(value: Option<&Value>) -> Result<Vec<usize>, String> {
    let Some(Value::Array(items)) = value else { return Err("a table lacks its columns".to_string()) };
    let whole = |item: &Value| item.as_integer().and_then(|k| usize::try_from(k).ok());
    items.iter().map(|item| whole(item).ok_or_else(|| "a column of a table is not a number".to_string())).collect()
}

/// The rows of a table: `arguments` begin with the file's name, the table's name and the matrix; `delimiter` and `header_lines` matter for
/// files of separated values.
pub(crate) fn rows(
    arguments: &[Value],
    (delimiter, header_lines): (Option<&Value>, Option<&Value>),
    files: DataFiles<'_>,
) -> Result<Vec<Vec<f64>>, String> {
    let file = text(arguments.first()).filter(|name| !is_no_name(name));
    let name = text(arguments.get(1)).filter(|name| !is_no_name(name));
    let rows = match file {
        Some(file) => {
            let content = files(file)?;
            let separated = file.to_ascii_lowercase().ends_with(".csv");
            let delimiter = text(delimiter).and_then(|d| d.chars().next()).unwrap_or(',');
            let skipped = header_lines.and_then(Value::as_integer).and_then(|k| usize::try_from(k).ok()).unwrap_or(0);
            let separated = separated.then_some((delimiter, skipped));
            matrix_of_file(&content, name.map_or("", |name| name), separated)
                .map_err(|sentence| format!("`{file}`: {sentence}"))?
        }
        None if name.is_some() => {
            let name = name.map_or("", |name| name);
            return Err(format!("the table `{name}` would come from a function in C, which is not available"));
        }
        None => matrix(arguments.get(2)).ok_or_else(|| "the matrix of a table is not made of numbers".to_string())?,
    };
    if rows.is_empty() || rows[0].is_empty() {
        return Err("a table is empty".to_string());
    }
    Ok(rows)
}

fn matrix(value: Option<&Value>) -> Option<Vec<Vec<f64>>> {
    let Value::Array(rows) = value? else { return None };
    let row = |row: &Value| match row {
        Value::Array(items) => items.iter().map(Value::as_real).collect::<Option<Vec<f64>>>(),
        _ => None,
    };
    rows.iter().map(row).collect()
}

//! Lines of text files, read at translation (functions of `Modelica.Utilities.Streams`).
//!
//! Lines end with LF or CR LF, which do not belong to them; a file that ends with one has no line behind it.

use hyd_syntax::tree::Name;

use crate::external::{DataFiles, Given};
use crate::values::value::Value;

/// Calls the function of this name; `None` where it is not known.
pub(crate) fn call(name: &str, arguments: &[Value], files: DataFiles<'_>) -> Option<Result<Given, String>> {
    let function = name.strip_prefix("ModelicaInternal_")?;
    if !matches!(function, "readLine" | "countLines" | "readFile" | "stat") {
        return None;
    }
    let Some(Value::Text(file)) = arguments.first() else { return None };
    let text = files(file);
    if function == "stat" {
        // Literals of an enumeration: no file, a file, a folder, something else.
        return Some(Ok(Value::Integer(if text.is_ok() { 2 } else { 1 }).into()));
    }
    let text = match text {
        Ok(text) => text,
        Err(sentence) => return Some(Err(sentence)),
    };
    let mut lines = text.lines().map(Name::from);
    Some(match function {
        "countLines" => Ok(Value::Integer(lines.count() as i64).into()),
        "readFile" => {
            let (found, wanted) = (text.lines().count(), arguments.get(2).and_then(Value::as_integer)?);
            if usize::try_from(wanted) != Ok(found) {
                return Some(Err(format!("`{file}` has {found} lines, and {wanted} are asked for")));
            }
            Ok(Given { value: None, set: vec![(1, Value::array(lines.map(Value::Text).collect()))] })
        }
        _ => {
            let number = arguments.get(1).and_then(Value::as_integer)?;
            let Some(place) = usize::try_from(number).ok().and_then(|number| number.checked_sub(1)) else {
                return Some(Err(format!("line {number} of `{file}` is asked for: lines count from 1")));
            };
            let line = lines.nth(place);
            let ended = Value::Boolean(line.is_none());
            Ok(Given { value: Some(Value::Text(line.unwrap_or_default())), set: vec![(2, ended)] })
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(name: &str, further: &[Value]) -> Result<Given, String> {
        let mut arguments = vec![Value::Text("a.txt".into())];
        arguments.extend_from_slice(further);
        let mut files = |file: &Name| match &**file {
            "a.txt" => Ok("one\r\n\nthree\n".into()),
            _ => Err("not found".to_string()),
        };
        call(&format!("ModelicaInternal_{name}"), &arguments, &mut files).expect("known")
    }

    #[test]
    fn lines_are_counted_and_read() {
        let text = |text: &str| Value::Text(text.into());
        assert_eq!(asked("countLines", &[]), Ok(Value::Integer(3).into()));
        let line = |k: i64| asked("readLine", &[Value::Integer(k), Value::Boolean(false)]);
        let given = |line: &str, ended| Ok(Given { value: Some(text(line)), set: vec![(2, Value::Boolean(ended))] });
        assert_eq!(
            [line(1), line(2), line(3), line(4)],
            [given("one", false), given("", false), given("three", false), given("", true)]
        );
        assert!(line(0).is_err_and(|sentence| sentence.contains("lines count from 1")));
        let all = Value::array(["one", "", "three"].map(text).to_vec());
        let read = |n: i64| asked("readFile", &[text(""), Value::Integer(n)]);
        assert!(read(2).is_err_and(|sentence| sentence.contains("has 3 lines, and 2 are asked for")));
        assert_eq!(read(3), Ok(Given { value: None, set: vec![(1, all)] }));
    }
}

//! Matrices of files, read at translation (functions of `Modelica.Utilities.Streams`).

use hyd_syntax::tree::Name;

use super::table_file::matrix_of_file;
use crate::external::{DataFiles, Given};
use crate::values::value::Value;

/// Calls the function of this name; `None` where it is not known.
pub(crate) fn call(name: &str, arguments: &[Value], files: DataFiles<'_>) -> Option<Result<Given, String>> {
    let function = name.strip_prefix("ModelicaIO_")?;
    let [Value::Text(file), Value::Text(matrix), rest @ ..] = arguments else { return None };
    match function {
        "readMatrixSizes" => Some(read(file, matrix, files).map(|rows| {
            let sizes = [rows.len(), rows.first().map_or(0, Vec::len)];
            Given { value: None, set: vec![(2, Value::array(sizes.map(|n| Value::Integer(n as i64)).to_vec()))] }
        })),
        "readRealMatrix" => {
            let (lines, columns) = (rest.get(1).and_then(Value::as_integer)?, rest.get(2).and_then(Value::as_integer)?);
            Some(read(file, matrix, files).and_then(|rows| {
                let found = (rows.len() as i64, rows.first().map_or(0, Vec::len) as i64);
                if found != (lines, columns) {
                    return Err(format!(
                        "`{matrix}` of `{file}` has {} by {} numbers, and {lines} by {columns} are asked for",
                        found.0, found.1
                    ));
                }
                let row = |row: Vec<f64>| Value::array(row.into_iter().map(Value::Real).collect());
                Ok(Given { value: None, set: vec![(2, Value::array(rows.into_iter().map(row).collect()))] })
            }))
        }
        _ => None,
    }
}

fn read(file: &Name, matrix: &Name, files: DataFiles<'_>) -> Result<Vec<Vec<f64>>, String> {
    matrix_of_file(&files(file)?, matrix, None).map_err(|sentence| format!("`{file}`: {sentence}"))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn asked(name: &str, matrix: &str, further: &[i64]) -> Result<Value, String> {
        let mut arguments = vec![Value::Text("a.txt".into()), Value::Text(matrix.into())];
        // What the call sets, and what it is told.
        arguments.push(Value::Integer(0));
        arguments.extend(further.iter().map(|&n| Value::Integer(n)));
        let mut files = |file: &Name| match &**file {
            "a.txt" => Ok("#1\ndouble m(2,3)\n1 2 3\n4 5 6\n".into()),
            _ => Err("not found".to_string()),
        };
        call(&format!("ModelicaIO_{name}"), &arguments, &mut files)
            .expect("known")
            .map(|mut given| given.set.remove(0).1)
    }

    #[test]
    fn sizes_and_numbers_are_read() {
        assert_eq!(
            asked("readMatrixSizes", "m", &[]).unwrap(),
            Value::array(vec![Value::Integer(2), Value::Integer(3)])
        );
        assert_eq!(asked("readRealMatrix", "m", &[2, 3]).unwrap().flatten().len(), 6);
        let sentence = asked("readRealMatrix", "m", &[3, 2]).unwrap_err();
        assert_eq!(sentence, "`m` of `a.txt` has 2 by 3 numbers, and 3 by 2 are asked for");
        assert_eq!(asked("readMatrixSizes", "n", &[]).unwrap_err(), "`a.txt`: there is no table `n`; its tables are m");
    }
}

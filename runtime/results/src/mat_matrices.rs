//! The matrices of a MAT file of version 4 or 5 by their names, as tables of models read them.
//!
//! Matrices within structures have the names of all that they stand in, with dots.  What holds no real numbers is left out.

use crate::mat_reader;
use crate::mat5::{self, Value};

/// A matrix by rows, with its name.
pub type NamedMatrix = (String, Vec<Vec<f64>>);

/// Reads the bytes of a MAT file.
///
/// # Errors
/// A sentence without the name of the file.
pub fn mat_matrices(bytes: &[u8]) -> Result<Vec<NamedMatrix>, String> {
    if bytes.starts_with(b"MATLAB 7.3") || bytes.starts_with(b"\x89HDF") {
        return Err("it is a MAT file of version 7.3, which is not supported; save it with -v7".to_string());
    }
    let mut found = Vec::new();
    if mat5::is_mat5(bytes) {
        for (name, value) in mat5::variables(bytes)? {
            take(name, value, &mut found);
        }
    } else {
        for (name, columns) in mat_reader::numbers(bytes)? {
            take(name, Value::Numbers(columns), &mut found);
        }
    }
    Ok(found)
}

fn take(name: String, value: Value, found: &mut Vec<NamedMatrix>) {
    match value {
        Value::Numbers(columns) => {
            let rows = columns.first().map_or(0, Vec::len);
            if rows > 0 && columns.iter().all(|column| column.len() == rows) {
                let row = |k: usize| columns.iter().map(|column| column[k]).collect();
                found.push((name, (0..rows).map(row).collect()));
            }
        }
        Value::Structures { fields, rows } if rows.len() == 1 => {
            for (field, value) in fields.iter().zip(rows.into_iter().flatten()) {
                take(format!("{name}.{field}"), value, found);
            }
        }
        Value::Structures { .. } | Value::Cells(_) | Value::Text(_) | Value::Object(_) | Value::Other => {}
    }
}

#[cfg(test)]
mod tests {
    use super::mat_matrices;
    use crate::Matrices;

    #[test]
    fn matrices_are_read_by_rows() {
        let mut file = Matrices::new();
        let (table, column) = (vec![vec![0.0, 1.5], vec![1.0, -2e-300], vec![2.0, 0.1]], vec![vec![7.0], vec![8.0]]);
        file.matrix("tab", &table, 2);
        file.matrix("column", &column, 1);
        file.names("texts", &["one".to_string()]);
        let found = mat_matrices(file.bytes()).expect("a MAT file");
        assert_eq!(found, [("tab".to_string(), table), ("column".to_string(), column)]);
    }

    #[test]
    fn what_is_no_mat_file_is_refused() {
        assert!(mat_matrices(b"#1\ndouble tab(1,1)\n0\n").is_err());
        assert!(mat_matrices(b"\x89HDF and so on").is_err_and(|sentence| sentence.contains("-v7")));
    }
}

//! Matrices and lists of names as a MAT file of version 4.
//!
//! Source: MathWorks, "MAT-File Format", chapter "MAT-File Version 4".  Runs have a layout of their own, see `mat_stream`.

use crate::mat_stream::{header, text_matrix};

/// Double precision numbers, little-endian.
const DOUBLES: u32 = 0;

/// The bytes of a file that grows by a matrix at a time.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Matrices(Vec<u8>);

impl Matrices {
    /// No matrices yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends a matrix given row by row; `columns` counts where there are no rows.
    pub fn matrix(&mut self, name: &str, rows: &[Vec<f64>], columns: usize) {
        header(&mut self.0, DOUBLES, rows.len(), columns, name);
        for column in 0..columns {
            for row in rows {
                let value = row.get(column).copied().unwrap_or(f64::NAN);
                self.0.extend_from_slice(&value.to_le_bytes());
            }
        }
    }

    /// Appends names, a row of characters each.
    pub fn names(&mut self, name: &str, texts: &[String]) {
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        text_matrix(&mut self.0, name, &texts, false);
    }

    /// The file.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_column_by_column_behind_their_header() {
        let mut file = Matrices::new();
        file.matrix("A", &[vec![1.0, 2.0], vec![3.0, 4.0]], 2);
        let bytes = file.bytes();
        let number =
            |k: usize| u32::from_le_bytes([bytes[4 * k], bytes[4 * k + 1], bytes[4 * k + 2], bytes[4 * k + 3]]);
        assert_eq!([0, 1, 2, 3, 4].map(number), [0, 2, 2, 0, 2]);
        assert_eq!(&bytes[20..22], b"A\0");
        let values: Vec<f64> = bytes[22..]
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]))
            .collect();
        assert_eq!(values, [1.0, 3.0, 2.0, 4.0]);
    }
}

//! The numbers of any MAT file of version 4 or 5 as columns, whatever wrote it.
//!
//! Vectors are columns, matrices as many as they have columns.  Version 5 as described by The MathWorks, "MAT-File Format" (R2023b):
//! elements with a tag of type and length, compressed ones inflated up to a limit.  Version 7.3 is HDF5, which is not read.

use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

use crate::mat_reader;

/// Bytes of the header of version 5.
const HEADER: usize = 128;
/// Most bytes that one element may inflate to.
const MOST_BYTES: usize = 256 << 20;
/// Most columns of all matrices.
const MOST_COLUMNS: usize = 10_000;
/// Type of an element: a matrix.
const MATRIX: u32 = 14;
/// Type of an element: another one, compressed.
const COMPRESSED: u32 = 15;

/// Columns of a MAT file.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MatColumns {
    /// Names and values.
    pub columns: Vec<(String, Vec<f64>)>,
    /// Names of what is no vector or matrix of real numbers.
    pub others: Vec<String>,
}

/// Reads the bytes of a MAT file.
///
/// # Errors
/// A sentence without the name of the file.
pub fn mat_columns(bytes: &[u8]) -> Result<MatColumns, String> {
    if bytes.starts_with(b"MATLAB 7.3") || bytes.starts_with(b"\x89HDF") {
        return Err("it is a MAT file of version 7.3, which is not read; save it with -v7".to_string());
    }
    let mut found = MatColumns::default();
    if bytes.len() >= HEADER && matches!(&bytes[126..128], b"IM" | b"MI") {
        let reader = Reader { big: &bytes[126..128] == b"MI" };
        reader.elements(&bytes[HEADER..], &mut found, false)?;
    } else {
        for (name, columns) in mat_reader::numbers(bytes)? {
            found.add(name, columns)?;
        }
    }
    if found.columns.is_empty() {
        let others = found.others.join(", ");
        let others = if others.is_empty() { String::new() } else { format!("; it has: {others}") };
        return Err(format!("it holds no vectors of real numbers{others}"));
    }
    Ok(found)
}

impl MatColumns {
    fn add(&mut self, name: String, columns: Vec<Vec<f64>>) -> Result<(), String> {
        if self.columns.len() + columns.len() > MOST_COLUMNS {
            return Err(format!("`{name}`: there are more than {MOST_COLUMNS} columns"));
        }
        match columns.as_slice() {
            [] => self.others.push(name),
            [only] if only.len() < 2 => self.others.push(name),
            _ if columns.iter().all(|column| column.len() == 1) => {
                self.columns.push((name, columns.into_iter().flatten().collect()));
            }
            [_] => self.columns.extend(columns.into_iter().map(|column| (name.clone(), column))),
            _ => {
                let numbered = columns.into_iter().enumerate();
                self.columns.extend(numbered.map(|(k, column)| (format!("{name}_{}", k + 1), column)));
            }
        }
        Ok(())
    }
}

/// The order of bytes of a file.
#[derive(Clone, Copy)]
struct Reader {
    big: bool,
}

/// One element: type and contents.
type Element<'a> = (u32, &'a [u8]);

impl Reader {
    fn word(self, bytes: &[u8], at: usize) -> Result<u32, String> {
        let word = bytes.get(at..at + 4).and_then(|word| <[u8; 4]>::try_from(word).ok());
        let word = word.ok_or("the file ends within an element")?;
        Ok(if self.big { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
    }

    /// The first element and what comes after it.
    fn element(self, bytes: &[u8]) -> Result<(Element<'_>, &[u8]), String> {
        let first = self.word(bytes, 0)?;
        let ends = || "the file ends within an element".to_string();
        if first >> 16 != 0 {
            // Up to four bytes stand within the tag.
            let (kind, length) = (first & 0xffff, (first >> 16) as usize);
            let own = bytes.get(4..4 + length).filter(|_| length <= 4).ok_or_else(ends)?;
            return Ok(((kind, own), bytes.get(8..).unwrap_or_default()));
        }
        let length = self.word(bytes, 4)? as usize;
        let end = length.checked_add(8).filter(|&end| end <= bytes.len()).ok_or_else(ends)?;
        let next = if first == COMPRESSED { end } else { end.next_multiple_of(8) };
        Ok(((first, &bytes[8..end]), bytes.get(next..).unwrap_or_default()))
    }

    fn elements(self, mut bytes: &[u8], found: &mut MatColumns, is_inflated: bool) -> Result<(), String> {
        while !bytes.is_empty() {
            let ((kind, own), rest) = self.element(bytes)?;
            match kind {
                MATRIX => self.matrix(own, found)?,
                COMPRESSED if !is_inflated => {
                    let inflated = decompress_to_vec_zlib_with_limit(own, MOST_BYTES);
                    let inflated = inflated.map_err(|error| format!("a compressed element cannot be read: {error}"))?;
                    self.elements(&inflated, found, true)?;
                }
                _ => {}
            }
            bytes = rest;
        }
        Ok(())
    }

    fn matrix(self, bytes: &[u8], found: &mut MatColumns) -> Result<(), String> {
        let ((_, flags), rest) = self.element(bytes)?;
        let ((_, dimensions), rest) = self.element(rest)?;
        let ((_, name), rest) = self.element(rest)?;
        let name = String::from_utf8_lossy(name).into_owned();
        let flags = self.word(flags, 0)?;
        let (class, is_complex) = (flags & 0xff, flags & 0x0800 != 0);
        // Classes 6 to 15 are numbers; cells, structures, texts and sparse matrices come before.
        if !(6..=15).contains(&class) || is_complex || dimensions.len() != 8 {
            found.others.push(name);
            return Ok(());
        }
        let (rows, columns) = (self.word(dimensions, 0)? as usize, self.word(dimensions, 4)? as usize);
        let (real, _) = self.element(rest)?;
        let values = self.numbers(real).map_err(|why| format!("`{name}`: {why}"))?;
        if rows.checked_mul(columns) != Some(values.len()) {
            return Err(format!("`{name}` has {rows} rows, {columns} columns and {} numbers", values.len()));
        }
        if values.is_empty() {
            found.others.push(name);
            return Ok(());
        }
        found.add(name, values.chunks(rows).map(<[f64]>::to_vec).collect())
    }

    fn numbers(self, (kind, bytes): Element<'_>) -> Result<Vec<f64>, String> {
        macro_rules! read {
            ($kind:ty) => {{
                let chunks = bytes.chunks_exact(size_of::<$kind>());
                let value = |chunk: &[u8]| {
                    let own = chunk.try_into().unwrap_or_default();
                    (if self.big { <$kind>::from_be_bytes(own) } else { <$kind>::from_le_bytes(own) }) as f64
                };
                Ok(chunks.map(value).collect())
            }};
        }
        match kind {
            1 => read!(i8),
            2 => read!(u8),
            3 => read!(i16),
            4 => read!(u16),
            5 => read!(i32),
            6 => read!(u32),
            7 => read!(f32),
            9 => read!(f64),
            12 => read!(i64),
            13 => read!(u64),
            other => Err(format!("it holds values of type {other}, which are no numbers")),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
        let mut all = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
        all.extend(bytes);
        if kind != COMPRESSED {
            all.resize(all.len().next_multiple_of(8), 0);
        }
        all
    }

    fn matrix(name: &str, class: u32, rows: u32, columns: u32, numbers: &[u8]) -> Vec<u8> {
        let dimensions = [rows.to_le_bytes(), columns.to_le_bytes()].concat();
        let flags = [class.to_le_bytes(), [0; 4]].concat();
        element(
            MATRIX,
            &[element(6, &flags), element(5, &dimensions), element(1, name.as_bytes()), numbers.to_vec()].concat(),
        )
    }

    fn file(elements: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
        bytes.resize(124, b' ');
        bytes.extend(b"\x00\x01IM");
        bytes.extend(elements.concat());
        bytes
    }

    #[test]
    fn vectors_and_matrices_become_columns() {
        let doubles = |values: &[f64]| element(9, &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
        // Numbers are often written as a smaller type; two bytes stand within the tag.
        let small = [&(1_u32 | 2 << 16).to_le_bytes()[..], &[5, 0xff, 0, 0]].concat();
        let packed =
            miniz_oxide::deflate::compress_to_vec_zlib(&matrix("p", 6, 2, 2, &doubles(&[1.0, 2.0, 3.0, 4.0])), 6);
        let bytes = file(&[
            matrix("t", 6, 2, 1, &doubles(&[0.0, 0.5])),
            element(COMPRESSED, &packed),
            matrix("n", 8, 1, 2, &small),
            matrix("fs", 6, 1, 1, &doubles(&[1e4])),
            matrix("words", 4, 1, 2, &small),
        ]);
        let found = mat_columns(&bytes).unwrap();
        let expected = [("t", [0.0, 0.5]), ("p_1", [1.0, 2.0]), ("p_2", [3.0, 4.0]), ("n", [5.0, -1.0])];
        let expected: Vec<(String, Vec<f64>)> =
            expected.iter().map(|(name, values)| ((*name).to_string(), values.to_vec())).collect();
        assert_eq!((found.columns, found.others), (expected, vec!["fs".to_string(), "words".to_string()]));
        for end in 0..bytes.len() {
            // Whatever is cut off, there is an answer.
            let _ = mat_columns(&bytes[..end]);
        }
    }

    #[test]
    fn what_is_not_read_is_said() {
        assert!(mat_columns(b"MATLAB 7.3 MAT-file").unwrap_err().contains("-v7"));
        assert!(mat_columns(&file(&[])).unwrap_err().starts_with("it holds no vectors"));
        assert!(mat_columns(&file(&[element(COMPRESSED, b"nonsense")])).is_err());
        assert!(mat_columns(b"").is_err());
    }
}

//! The variables of a MAT file of version 5: numbers, texts, structures and cells.
//!
//! As described by The MathWorks, "MAT-File Format" (R2023b): elements with a tag of type and length, compressed ones inflated up to a
//! limit.

use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

/// Bytes of the header.
const HEADER: usize = 128;
/// Most bytes that one element may inflate to.
const MOST_BYTES: usize = 256 << 20;
/// Most levels of structures and cells within each other.
const DEEPEST: usize = 16;
/// Most structures of an array, and most fields of one.
const MOST_PARTS: usize = 10_000;
/// Type of an element: a matrix.
const MATRIX: u32 = 14;
/// Type of an element: another one, compressed.
const COMPRESSED: u32 = 15;

/// What a variable or a field holds.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Value {
    /// A matrix of real numbers by columns, none of them empty.
    Numbers(Vec<Vec<f64>>),
    /// A row of characters.
    Text(String),
    /// An array of structures with the same fields.
    Structures {
        /// Names of the fields.
        fields: Vec<String>,
        /// Their values, structure by structure.
        rows: Vec<Vec<Value>>,
    },
    /// Cells one after the other.
    Cells(Vec<Value>),
    /// An object of this class of MATLAB's own (a table, a timetable), whose form is not published.
    Object(String),
    /// Something else, or nothing.
    Other,
}

/// True for the first bytes of such a file.
pub(crate) fn is_mat5(bytes: &[u8]) -> bool {
    bytes.len() >= HEADER && matches!(&bytes[126..128], b"IM" | b"MI")
}

/// The variables of a file for which [`is_mat5`] holds.
///
/// # Errors
/// A sentence without the name of the file.
pub(crate) fn variables(bytes: &[u8]) -> Result<Vec<(String, Value)>, String> {
    let reader = Reader { big: &bytes[126..128] == b"MI" };
    let mut found = Vec::new();
    reader.elements(&bytes[HEADER..], &mut found, false)?;
    Ok(found)
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

    fn elements(self, mut bytes: &[u8], found: &mut Vec<(String, Value)>, is_inflated: bool) -> Result<(), String> {
        while !bytes.is_empty() {
            let ((kind, own), rest) = self.element(bytes)?;
            match kind {
                MATRIX => found.push(self.matrix(own, 0)?),
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

    /// Name and value of a variable, or of a part of one `depth` levels down.
    fn matrix(self, bytes: &[u8], depth: usize) -> Result<(String, Value), String> {
        if bytes.is_empty() {
            return Ok((String::new(), Value::Other));
        }
        let ((_, flags), rest) = self.element(bytes)?;
        let flags = self.word(flags, 0)?;
        let (class, is_complex) = (flags & 0xff, flags & 0x0800 != 0);
        // Objects of other kinds have no dimensions in their place: their name is followed by what made them and by their class.
        if class > 15 {
            let Ok(((_, name), rest)) = self.element(rest) else { return Ok((String::new(), Value::Other)) };
            let class = self.element(rest).and_then(|(_, rest)| self.element(rest));
            let value = class.map_or(Value::Other, |((_, class), _)| Value::Object(text(class)));
            return Ok((text(name), value));
        }
        let ((_, dimensions), rest) = self.element(rest)?;
        let ((_, name), rest) = self.element(rest)?;
        let name = text(name);
        if depth > DEEPEST {
            return Err(format!("`{name}`: there are more than {DEEPEST} levels of structures"));
        }
        let value = match class {
            1 => Value::Cells(self.parts(rest, depth)?),
            2 => self.structures(rest, depth)?,
            4 => self.characters(rest)?,
            // Numbers of all types; sparse ones and objects come before.
            6..=15 if !is_complex => self.grid(dimensions, rest).map_err(|why| format!("`{name}` {why}"))?,
            _ => Value::Other,
        };
        Ok((name, value))
    }

    /// Numbers by columns; of more than two dimensions only a vector lies along one.
    fn grid(self, dimensions: &[u8], rest: &[u8]) -> Result<Value, String> {
        let sizes = dimensions.chunks_exact(4).map(|size| self.word(size, 0).map(|size| size as usize));
        let sizes = sizes.collect::<Result<Vec<usize>, String>>()?;
        let (real, _) = self.element(rest)?;
        let values = self.numbers(real).map_err(|why| format!("cannot be read: {why}"))?;
        if sizes.iter().try_fold(1_usize, |product, &size| product.checked_mul(size)) != Some(values.len()) {
            let shape = sizes.iter().map(usize::to_string).collect::<Vec<String>>().join(" by ");
            return Err(format!("is {shape} and has {} numbers", values.len()));
        }
        let is_vector = sizes.iter().filter(|&&size| size != 1).count() <= 1;
        Ok(match sizes[..] {
            _ if values.is_empty() => Value::Other,
            [rows, _] => Value::Numbers(values.chunks(rows).map(<[f64]>::to_vec).collect()),
            _ if is_vector => Value::Numbers(vec![values]),
            _ => Value::Other,
        })
    }

    /// Matrices one after the other.
    fn parts(self, mut bytes: &[u8], depth: usize) -> Result<Vec<Value>, String> {
        let mut parts = Vec::new();
        while !bytes.is_empty() {
            let ((kind, own), rest) = self.element(bytes)?;
            if kind == MATRIX {
                parts.push(self.matrix(own, depth + 1)?.1);
            }
            bytes = rest;
        }
        Ok(parts)
    }

    fn structures(self, bytes: &[u8], depth: usize) -> Result<Value, String> {
        let ((_, length), rest) = self.element(bytes)?;
        let length = self.word(length, 0)? as usize;
        let ((_, names), rest) = self.element(rest)?;
        if length == 0 || names.len() / length > MOST_PARTS {
            return Err("a structure has no names of fields, or too many".to_string());
        }
        let fields: Vec<String> = names.chunks_exact(length).map(text).collect();
        let parts = self.parts(rest, depth)?;
        if fields.is_empty() || parts.len() > MOST_PARTS {
            return Ok(Value::Other);
        }
        let rows = parts.chunks_exact(fields.len()).map(<[Value]>::to_vec).collect();
        Ok(Value::Structures { fields, rows })
    }

    fn characters(self, bytes: &[u8]) -> Result<Value, String> {
        if bytes.is_empty() {
            return Ok(Value::Other);
        }
        let ((kind, own), _) = self.element(bytes)?;
        Ok(Value::Text(match kind {
            // Two bytes a character, or one.
            4 | 17 => {
                let units = self.numbers((4, own))?;
                String::from_utf16_lossy(&units.iter().map(|unit| *unit as u16).collect::<Vec<u16>>())
            }
            _ => text(own),
        }))
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
            other => Err(format!("it holds values of type {other}, which are not numbers")),
        }
    }
}

/// Bytes up to the first zero as a text.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

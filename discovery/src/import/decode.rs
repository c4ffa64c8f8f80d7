//! Bytes of a text file as text: UTF-8 or UTF-16, with or without a mark, else Latin-1; lines may end as on any system.
//!
//! Bytes that are not UTF-8 are taken for Latin-1, in which every byte is a character; a byte of value zero is found in no such text.  Most
//! characters of a table are digits, whose UTF-16 has such a byte, always at the same side; that tells it without a mark.

use crate::Fault;

/// Encodings by their names in `import.toml`.
pub(super) const ENCODINGS: [&str; 4] = ["utf-8", "latin-1", "utf-16le", "utf-16be"];

/// Share of the characters of a text in UTF-16 that have a byte of value zero, at least.
const WIDE: f64 = 0.5;

/// UTF-16 without a mark, by its bytes of value zero.
fn unmarked(bytes: &[u8]) -> Option<&'static str> {
    let count = |side: usize| bytes.chunks_exact(2).filter(|pair| pair[side] == 0).count();
    let (high, low) = (count(0), count(1));
    let least = WIDE * (bytes.len() / 2) as f64;
    match bytes.len() >= 4 && bytes.len().is_multiple_of(2) {
        true if high == 0 && low as f64 >= least => Some("utf-16le"),
        true if low == 0 && high as f64 >= least => Some("utf-16be"),
        _ => None,
    }
}

/// The text of a file and the name of its encoding; `stated` is the encoding where a person has said it.
///
/// # Errors
/// A sentence without the name of the file.
pub(super) fn decode(bytes: &[u8], stated: Option<&str>) -> Result<(String, &'static str), Fault> {
    let marked = [(&b"\xEF\xBB\xBF"[..], "utf-8"), (b"\xFF\xFE", "utf-16le"), (b"\xFE\xFF", "utf-16be")];
    let mark = marked.iter().find(|(mark, _)| bytes.starts_with(mark));
    let found = match stated {
        Some(stated) => ENCODINGS.iter().copied().find(|name| *name == stated).unwrap_or("utf-8"),
        None => mark
            .map(|own| own.1)
            .or_else(|| unmarked(bytes))
            .unwrap_or_else(|| if std::str::from_utf8(bytes).is_ok() { "utf-8" } else { "latin-1" }),
    };
    let rest = mark.filter(|own| own.1 == found).map_or(bytes, |own| &bytes[own.0.len()..]);
    let units = |of: fn([u8; 2]) -> u16| rest.chunks_exact(2).map(|pair| of([pair[0], pair[1]])).collect::<Vec<u16>>();
    let text = match found {
        "utf-16le" => String::from_utf16(&units(u16::from_le_bytes)).ok(),
        "utf-16be" => String::from_utf16(&units(u16::from_be_bytes)).ok(),
        "latin-1" => Some(rest.iter().map(|&byte| char::from(byte)).collect()),
        _ => std::str::from_utf8(rest).ok().map(String::from),
    };
    let text = text.ok_or_else(|| Fault::new(format!("it is not text in {found}")))?;
    if let Some(at) = text.find('\0') {
        let line = text[..at].matches('\n').count() + 1;
        return Err(Fault::new(format!("line {line}: it is not a text file, for it holds bytes of value zero")));
    }
    // Lines that end in CR alone.
    let text = if text.contains('\n') { text } else { text.replace('\r', "\n") };
    Ok((text, found))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::decode;

    #[test]
    fn encodings_are_told_apart() {
        let wide = |order: fn(u16) -> [u8; 2]| "\u{FEFF}µ;1".encode_utf16().flat_map(order).collect::<Vec<u8>>();
        let cases: [(Vec<u8>, &str); 5] = [
            ("µ;1".as_bytes().to_vec(), "utf-8"),
            ("\u{FEFF}µ;1".as_bytes().to_vec(), "utf-8"),
            (b"\xB5;1".to_vec(), "latin-1"),
            (wide(u16::to_le_bytes), "utf-16le"),
            (wide(u16::to_be_bytes), "utf-16be"),
        ];
        for (bytes, encoding) in cases {
            assert_eq!(decode(&bytes, None), Ok(("µ;1".to_string(), encoding)));
            assert_eq!(decode(&bytes, Some(encoding)), Ok(("µ;1".to_string(), encoding)));
        }
        for (order, encoding) in [(u16::to_le_bytes as fn(u16) -> [u8; 2], "utf-16le"), (u16::to_be_bytes, "utf-16be")]
        {
            let bytes: Vec<u8> = "t;µ\r\n0;1".encode_utf16().flat_map(order).collect();
            assert_eq!(decode(&bytes, None), Ok(("t;µ\r\n0;1".to_string(), encoding)));
        }
        assert_eq!(decode(b"t;p\r0;1\r", None), Ok(("t;p\n0;1\n".to_string(), "utf-8")));
        let said = decode(b"a\nb\0\0", None).unwrap_err().sentence;
        assert!(said.starts_with("line 2: it is not a text file"), "{said}");
        assert!(decode(b"\xB5", Some("utf-8")).is_err());
    }
}

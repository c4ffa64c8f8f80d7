//! Numbers of a run as bytes for the page, and bytes as base64.
//!
//! Four bytes say how long the header is, a JSON object padded with blanks to a multiple of eight; then come times and parameters as doubles, and the columns
//! that the header lists as floats, all of the lowest byte first.

use serde_json::Value;

/// What of a run goes to the page.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Numbers {
    pub(crate) header: Value,
    pub(crate) times: Vec<f64>,
    pub(crate) parameters: Vec<f64>,
    /// By number, as variables refer to them.
    pub(crate) columns: Vec<(usize, Vec<f64>)>,
}

/// The bytes.
pub(crate) fn bytes(numbers: &Numbers) -> Vec<u8> {
    let mut header = numbers.header.clone();
    if let Value::Object(fields) = &mut header {
        fields.insert("rows".into(), numbers.times.len().into());
        fields.insert("parameters".into(), numbers.parameters.len().into());
        fields.insert("columns".into(), numbers.columns.iter().map(|(k, _)| Value::from(*k)).collect());
    }
    let mut text = header.to_string().into_bytes();
    while !(text.len() + 4).is_multiple_of(8) {
        text.push(b' ');
    }
    let values: usize = numbers.columns.iter().map(|(_, values)| values.len()).sum();
    let mut out =
        Vec::with_capacity(4 + text.len() + 8 * (numbers.times.len() + numbers.parameters.len()) + 4 * values);
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text);
    for value in numbers.times.iter().chain(&numbers.parameters) {
        out.extend(value.to_le_bytes());
    }
    for (_, values) in &numbers.columns {
        for value in values {
            out.extend((*value as f32).to_le_bytes());
        }
    }
    out
}

/// Bytes as text (RFC 4648).
pub(crate) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let whole = group.iter().fold(0_u32, |whole, byte| whole << 8 | u32::from(*byte)) << (8 * (3 - group.len()));
        for k in 0..4 {
            let letter = LETTERS[(whole >> (18 - 6 * k) & 63) as usize] as char;
            text.push(if k > group.len() { '=' } else { letter });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of RFC 4648, section 10.
    #[test]
    fn base64_is_that_of_the_standard() {
        let wanted = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (k, text) in wanted.into_iter().enumerate() {
            assert_eq!(base64(&b"foobar"[..k]), text);
        }
    }

    #[test]
    fn doubles_stand_at_multiples_of_eight() {
        let numbers = Numbers {
            header: serde_json::json!({"status": "done"}),
            times: vec![0.0, 1.5],
            parameters: vec![3.0],
            columns: vec![(7, vec![1.0, f64::NAN])],
        };
        let bytes = bytes(&numbers);
        let length = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize;
        assert_eq!((4 + length) % 8, 0);
        let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap_or_default();
        assert_eq!(header, serde_json::json!({"status": "done", "rows": 2, "parameters": 1, "columns": [7]}));
        let second: [u8; 8] = bytes[4 + length + 8..4 + length + 16].try_into().unwrap_or_default();
        assert_eq!(f64::from_le_bytes(second), 1.5);
        assert_eq!(bytes.len(), 4 + length + 24 + 8);
    }
}

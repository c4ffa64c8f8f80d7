//! External functions of Strings and of files' names, computed at translation.
//!
//! Positions in a String count characters from 1.

use hyd_syntax::tree::Name;

use crate::external::Given;
use crate::values::value::Value;

/// Calls the function of this name; `None` where it is not known.
pub(crate) fn call(name: &str, arguments: &[Value]) -> Option<Result<Given, String>> {
    let text = |k: usize| match arguments.get(k) {
        Some(Value::Text(text)) => Some(text),
        _ => None,
    };
    let whole = |k: usize| arguments.get(k).and_then(Value::as_integer);
    let is_true = |k: usize| matches!(arguments.get(k), Some(Value::Boolean(true)));
    let value = match name {
        "ModelicaStrings_length" => Value::Integer(text(0)?.chars().count() as i64),
        "ModelicaStrings_substring" => Value::Text(substring(text(0)?, whole(1)?, whole(2)?)),
        "ModelicaStrings_compare" => {
            let (a, b) = (text(0)?.to_string(), text(1)?.to_string());
            let lower = |text: String| if is_true(2) { text } else { text.to_lowercase() };
            return Some(Ok(Given::from(comparison(lower(a).cmp(&lower(b))))));
        }
        "ModelicaStrings_hashString" => Value::Integer(i64::from(hash(text(0)?))),
        // Where a file is, is for the source of texts to know.
        "ModelicaInternal_fullPathName" => Value::Text(text(0)?.clone()),
        "ModelicaStrings_skipWhiteSpace" => Value::Integer(skip_blanks(text(0)?, whole(1)?)),
        "ModelicaStrings_scanReal" => return Some(Ok(scan_real(text(0)?, whole(1)?, is_true(2)))),
        "ModelicaStrings_scanInteger" => return Some(Ok(scan_integer(text(0)?, whole(1)?, is_true(2)))),
        "ModelicaStrings_scanString" => return Some(Ok(scan_string(text(0)?, whole(1)?))),
        "ModelicaStrings_scanIdentifier" => return Some(Ok(scan_identifier(text(0)?, whole(1)?))),
        _ => return None,
    };
    Some(Ok(value.into()))
}

/// A literal of an enumeration `Compare` whose three literals are less, equal, greater; the type is that of what takes the value.
fn comparison(order: std::cmp::Ordering) -> Value {
    Value::Integer(2 + order as i64)
}

/// Arash Partow's hash of the bytes of a text, as an integer of 32 bits with a sign.
fn hash(text: &str) -> i32 {
    let mixed = |hash: u32, (place, byte): (usize, u8)| {
        let byte = u32::from(byte);
        hash ^ match place % 2 {
            0 => (hash << 7) ^ byte.wrapping_mul(hash >> 3),
            _ => !(hash << 11).wrapping_add(byte ^ (hash >> 5)),
        }
    };
    text.bytes().enumerate().fold(0xAAAA_AAAA, mixed) as i32
}

fn substring(text: &str, first: i64, last: i64) -> Name {
    let first = usize::try_from(first - 1).unwrap_or(0);
    let count = usize::try_from(last).unwrap_or(0).saturating_sub(first);
    text.chars().skip(first).take(count).collect::<String>().into()
}

/// The rest of a text from a position on.
fn from(text: &str, start: i64) -> Vec<char> {
    let skipped = usize::try_from(start - 1).unwrap_or(0);
    text.chars().skip(skipped).collect()
}

fn skip_blanks(text: &str, start: i64) -> i64 {
    let rest = from(text, start);
    start + rest.iter().take_while(|c| c.is_whitespace()).count() as i64
}

/// What a scanner gives: the position behind what it found, or the first one, and the value.
fn scanned(next: i64, place: (usize, usize), value: Value) -> Given {
    Given { value: None, set: vec![(place.0, Value::Integer(next)), (place.1, value)] }
}

fn scan_real(text: &str, start: i64, unsigned: bool) -> Given {
    let begin = skip_blanks(text, start);
    let rest = from(text, begin);
    let digits = |at: usize| rest[at.min(rest.len())..].iter().take_while(|c| c.is_ascii_digit()).count();
    let sign = usize::from(!unsigned && matches!(rest.first(), Some('+' | '-')));
    let mut end = sign + digits(sign);
    let mut found = end > sign;
    if rest.get(end) == Some(&'.') {
        let fraction = digits(end + 1);
        found |= fraction > 0;
        end += 1 + fraction;
    }
    if found && matches!(rest.get(end), Some('e' | 'E')) {
        let signed = end + 1 + usize::from(matches!(rest.get(end + 1), Some('+' | '-')));
        let exponent = digits(signed);
        if exponent > 0 {
            end = signed + exponent;
        }
    }
    let number: String = rest[..end].iter().collect();
    match number.parse::<f64>() {
        Ok(value) if found => scanned(begin + end as i64, (3, 4), Value::Real(value)),
        _ => scanned(start, (3, 4), Value::Real(0.0)),
    }
}

fn scan_integer(text: &str, start: i64, unsigned: bool) -> Given {
    let begin = skip_blanks(text, start);
    let rest = from(text, begin);
    let sign = usize::from(!unsigned && matches!(rest.first(), Some('+' | '-')));
    let count = rest[sign..].iter().take_while(|c| c.is_ascii_digit()).count();
    let number: String = rest[..sign + count].iter().filter(|c| **c != '+').collect();
    let real = matches!(rest.get(sign + count), Some('.' | 'e' | 'E'));
    match number.parse::<i64>() {
        Ok(value) if !real => scanned(begin + (sign + count) as i64, (3, 4), Value::Integer(value)),
        _ => scanned(start, (3, 4), Value::Integer(0)),
    }
}

fn scan_string(text: &str, start: i64) -> Given {
    let begin = skip_blanks(text, start);
    let rest = from(text, begin);
    if rest.first() == Some(&'"') {
        let mut inside = String::new();
        let mut k = 1;
        while k < rest.len() {
            match rest[k] {
                '"' => return scanned(begin + k as i64 + 1, (2, 3), Value::Text(inside.into())),
                '\\' if rest.get(k + 1) == Some(&'"') => {
                    inside.push('"');
                    k += 1;
                }
                c => inside.push(c),
            }
            k += 1;
        }
    }
    scanned(start, (2, 3), Value::Text("".into()))
}

fn scan_identifier(text: &str, start: i64) -> Given {
    let begin = skip_blanks(text, start);
    let rest = from(text, begin);
    let is_part = |c: &&char| c.is_ascii_alphanumeric() || **c == '_';
    match rest.first() {
        Some(c) if c.is_ascii_alphabetic() => {
            let name: String = rest.iter().take_while(is_part).collect();
            scanned(begin + name.len() as i64, (2, 3), Value::Text(name.into()))
        }
        _ => scanned(start, (2, 3), Value::Text("".into())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(given: Given) -> Vec<Value> {
        given.set.into_iter().map(|(_, value)| value).collect()
    }

    #[test]
    fn numbers_are_scanned_with_the_place_behind_them() {
        assert_eq!(set(scan_real("a = -1.5e3;", 4, false)), [Value::Integer(11), Value::Real(-1500.0)]);
        assert_eq!(set(scan_real("2e", 1, false)), [Value::Integer(2), Value::Real(2.0)]);
        assert_eq!(set(scan_real("-2", 1, true)), [Value::Integer(1), Value::Real(0.0)]);
        assert_eq!(set(scan_integer(" +12]", 1, false)), [Value::Integer(5), Value::Integer(12)]);
        assert_eq!(set(scan_integer("1.5", 1, false)), [Value::Integer(1), Value::Integer(0)]);
        // What is not there leaves the place where it was, which is how the library's functions tell.
        assert_eq!(set(scan_integer("a = 1.5", 5, true)), [Value::Integer(5), Value::Integer(0)]);
        assert_eq!(set(scan_real("a = b", 4, false)), [Value::Integer(4), Value::Real(0.0)]);
        assert_eq!(set(scan_identifier("a = 1", 4)), [Value::Integer(4), Value::Text("".into())]);
        assert_eq!(set(scan_string("a = 1", 4)), [Value::Integer(4), Value::Text("".into())]);
        assert_eq!(set(scan_string(" \"a\\\"b\" ", 1)), [Value::Integer(8), Value::Text("a\"b".into())]);
        assert_eq!(set(scan_identifier("x_1 = 2", 1)), [Value::Integer(4), Value::Text("x_1".into())]);
        assert_eq!(substring("hydraulics", 2, 4), "ydr".into());
    }
}

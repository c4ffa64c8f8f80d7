//! Fields of a line and numbers in fields.

/// Fields that are gaps.
const GAPS: [&str; 8] = ["", "-", "--", "na", "n/a", "nan", "null", "#n/a"];

/// What stands between the fields of a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Delimiter {
    /// One character.
    Character(char),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Delimiter {
    /// All that are tried, the likeliest first.
    pub(super) const ALL: [Self; 5] =
        [Self::Character(';'), Self::Character('\t'), Self::Character(','), Self::Character('|'), Self::Blanks];

    /// By its name in `import.toml`.
    pub(super) fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|own| own.name() == name)
    }

    /// Its name in `import.toml`.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Character(';') => ";",
            Self::Character('\t') => "\t",
            Self::Character('|') => "|",
            Self::Character(_) => ",",
            Self::Blanks => " ",
        }
    }

    /// Words for people.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Character(';') => "semicolons",
            Self::Character('\t') => "tabs",
            Self::Character('|') => "bars",
            Self::Character(_) => "commas",
            Self::Blanks => "blanks",
        }
    }
}

/// The fields of a line without the blanks around them.  Quotes keep a delimiter within a field; between blanks, so do brackets and
/// a blank before a bracket.
pub(super) fn split(line: &str, delimiter: Delimiter) -> Vec<String> {
    let is_delimiter = |c: char| match delimiter {
        Delimiter::Character(own) => c == own,
        Delimiter::Blanks => c.is_whitespace(),
    };
    let (mut fields, mut field, mut quoted, mut depth) = (Vec::new(), String::new(), false, 0_i32);
    let mut characters = line.chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '"' if quoted && characters.peek() == Some(&'"') => {
                field.push('"');
                characters.next();
            }
            '"' if quoted || field.trim().is_empty() => quoted = !quoted,
            c if quoted => field.push(c),
            c if is_delimiter(c) && depth == 0 => {
                let before_bracket = delimiter == Delimiter::Blanks && matches!(characters.peek(), Some('[' | '('));
                if before_bracket && !field.is_empty() {
                    field.push(c);
                } else if delimiter != Delimiter::Blanks || !field.is_empty() {
                    fields.push(field.trim().to_string());
                    field.clear();
                }
            }
            c => {
                if delimiter == Delimiter::Blanks {
                    depth += i32::from(matches!(c, '[' | '(')) - i32::from(matches!(c, ']' | ')'));
                    depth = depth.max(0);
                }
                field.push(c);
            }
        }
    }
    if delimiter != Delimiter::Blanks || !field.is_empty() {
        fields.push(field.trim().to_string());
    }
    fields
}

/// The number in a field, NaN for a gap; none for anything else, an infinite number among it.
pub(super) fn number(field: &str, decimal: char) -> Option<f64> {
    let is_gap = |field: &str| GAPS.iter().any(|gap| field.eq_ignore_ascii_case(gap));
    // What is a number to the reader but not to a lab: `inf`, `infinity` and `nan` in words.
    let plain = |text: &str| text.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'+' | b'-' | b'e' | b'E'));
    let value = match decimal {
        ',' if field.contains('.') => None,
        ',' => Some(field.replacen(',', ".", 1)).filter(|text| plain(text)).and_then(|text| text.parse::<f64>().ok()),
        _ if plain(field) => field.parse::<f64>().ok(),
        _ => None,
    };
    value.filter(|value| value.is_finite()).or_else(|| is_gap(field).then_some(f64::NAN))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_split() {
        assert_eq!(split("a; b ;\"c;d\";", Delimiter::Character(';')), ["a", "b", "c;d", ""]);
        assert_eq!(split("  1.0  2.0\t3 ", Delimiter::Blanks), ["1.0", "2.0", "3"]);
        assert_eq!(split("t (ms)  p [bar abs] x", Delimiter::Blanks), ["t (ms)", "p [bar abs]", "x"]);
        assert_eq!(split("\"say \"\"a\"\"\",2", Delimiter::Character(',')), ["say \"a\"", "2"]);
        assert!(split("   ", Delimiter::Blanks).is_empty());
    }

    #[test]
    fn numbers_and_gaps() {
        let cases = [("1,5e-3", ',', 1.5e-3), ("-2", ',', -2.0), ("+1.5", '.', 1.5), ("1E6", '.', 1e6)];
        for (field, decimal, value) in cases {
            assert_eq!(number(field, decimal), Some(value), "{field}");
        }
        for field in ["", "-", "NaN", "n/a", "NULL"] {
            assert!(number(field, '.').unwrap().is_nan(), "{field}");
        }
        for (field, decimal) in [("1,5", '.'), ("1.5", ','), ("1,000,5", ','), ("inf", '.'), ("1e999", '.'), ("x", '.')]
        {
            assert_eq!(number(field, decimal), None, "{field}");
        }
    }
}

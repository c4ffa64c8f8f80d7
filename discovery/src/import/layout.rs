//! How a text file is laid out: delimiter, decimal mark, header, row of units, first row of numbers.
//!
//! Every pair of delimiter and decimal mark is tried on the first rows; the pair that makes whole rows of numbers of most lines, with a
//! header of as many fields, is the file's.  A comma is not both at once unless fields are quoted.

use super::fields::{Delimiter, number, split};
use super::stamp::stamp;
use super::unit::unit;
use crate::Fault;

/// Lines that are looked at.
const SAMPLE: usize = 400;
/// Longest line (bytes).
const LONGEST: usize = 1 << 20;
/// Rows that follow a first one.
const FOLLOWING: usize = 3;

/// The layout of a text file.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct TextLayout {
    /// Between fields.
    pub delimiter: Delimiter,
    /// `.` or `,`.
    pub decimal: char,
    /// Line of the header, from 1; 0 for none.
    pub header_line: usize,
    /// Line of the units, from 1; 0 for none.
    pub unit_line: usize,
    /// First line of numbers, from 1.
    pub first_line: usize,
}

/// One line of the sample.
struct Row {
    line: usize,
    fields: Vec<String>,
    numbers: usize,
    filled: usize,
}

impl Row {
    fn is_whole(&self) -> bool {
        self.numbers > 0 && self.numbers == self.filled
    }

    /// Half of what is filled is numbers: a row with a column of text.
    fn is_half(&self) -> bool {
        self.numbers > 0 && 2 * self.numbers >= self.filled
    }
}

/// Finds the layout of a text.
///
/// # Errors
/// A sentence without the name of the file.
pub(super) fn find(text: &str) -> Result<TextLayout, Fault> {
    if text.is_empty() {
        return Err(Fault::new("the file is empty"));
    }
    let mut lines = Vec::new();
    for (k, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        if line.len() > LONGEST {
            return Err(Fault::new(format!("line {} is longer than {} MB", k + 1, LONGEST >> 20)));
        }
        lines.push((k + 1, line));
        if lines.len() == SAMPLE {
            break;
        }
    }
    if lines.is_empty() {
        return Err(Fault::new("line 1: the file holds nothing but blanks and empty lines"));
    }
    let quotes = lines.iter().any(|(_, line)| line.contains('"'));
    let mut best: Option<((usize, bool, usize), TextLayout)> = None;
    for delimiter in Delimiter::ALL {
        for decimal in ['.', ','] {
            if delimiter == Delimiter::Character(',') && decimal == ',' && !quotes {
                continue;
            }
            let Some((score, layout)) = judge(&lines, delimiter, decimal) else { continue };
            if best.as_ref().is_none_or(|(other, _)| score > *other) {
                best = Some((score, layout));
            }
        }
    }
    let sentence = format!("line {}: no rows of numbers were found; it is not a table of measurements", lines[0].0);
    best.map(|(_, layout)| layout).ok_or_else(|| Fault::new(sentence))
}

/// How well a delimiter and a decimal mark suit the lines.
fn judge(lines: &[(usize, &str)], delimiter: Delimiter, decimal: char) -> Option<((usize, bool, usize), TextLayout)> {
    let rows: Vec<Row> = lines
        .iter()
        .map(|&(line, text)| {
            let fields = split(text, delimiter);
            let filled = fields.iter().filter(|field| !field.is_empty()).count();
            let is_number = |field: &&String| number(field, decimal).is_some() || stamp(field).is_some();
            let numbers = fields.iter().filter(|field| !field.is_empty()).filter(is_number).count();
            Row { line, fields, numbers, filled }
        })
        .collect();
    let whole = rows.iter().filter(|row| row.is_whole()).count();
    let is_row = |row: &Row| {
        if whole * 2 > rows.len().saturating_sub(FOLLOWING + 1) || whole > 10 { row.is_whole() } else { row.is_half() }
    };
    let width = commonest(rows.iter().filter(|row| is_row(row)).map(|row| row.fields.len()))?;
    let fits = |row: &Row| is_row(row) && row.fields.len() == width;
    let begins = |k: &usize| rows[*k..].iter().take(FOLLOWING + 1).all(fits);
    let first = (0..rows.len()).find(begins)?;
    let count = rows.iter().filter(|row| fits(row)).count();
    let numbers: usize = rows.iter().filter(|row| fits(row)).map(|row| row.numbers).sum();
    let trailing = rows.iter().filter(|row| fits(row)).all(|row| row.fields.last().is_some_and(String::is_empty));
    let (header, units) = header(&rows[..first], width, (delimiter, trailing));
    let layout = TextLayout {
        delimiter,
        decimal,
        header_line: header.map_or(0, |row| row.line),
        unit_line: units.map_or(0, |row| row.line),
        first_line: rows[first].line,
    };
    let all_whole = rows.iter().filter(|row| fits(row) && row.is_whole()).count();
    Some(((all_whole.max(count / 2), header.is_some(), numbers), layout))
}

/// Header and row of units among the rows before the first numbers; `trailing`: rows end in a delimiter.
fn header<'a>(
    before: &'a [Row],
    width: usize,
    (delimiter, trailing): (Delimiter, bool),
) -> (Option<&'a Row>, Option<&'a Row>) {
    let suits = |row: &&'a Row| {
        let count = row.fields.len() - usize::from(is_comment(row));
        // Some recorders end rows of numbers earlier, or with one more delimiter, than the header.
        count == width || trailing && count + 1 == width || (delimiter != Delimiter::Blanks && count > width)
    };
    let Some((last, earlier)) = before.split_last() else { return (None, None) };
    if !suits(&last) || last.is_whole() {
        return (None, None);
    }
    let filled = || last.fields.iter().filter(|field| !field.is_empty() && *field != "#");
    let known = filled().filter(|field| unit(bare(field)).is_some()).count();
    let are_units = last.filled > 0 && 2 * known > filled().count();
    match earlier.last().filter(suits).filter(|row| row.numbers == 0) {
        Some(names) if are_units => (Some(names), Some(last)),
        _ => (Some(last), None),
    }
}

/// A header may begin with the mark of a comment, which is no field.
fn is_comment(row: &Row) -> bool {
    row.fields.first().is_some_and(|field| field == "#" || field == "%")
}

/// A unit without its brackets.
pub(super) fn bare(field: &str) -> &str {
    let field = field.trim();
    let inner = |open: char, close: char| field.strip_prefix(open).and_then(|rest| rest.strip_suffix(close));
    inner('[', ']').or_else(|| inner('(', ')')).unwrap_or(field).trim()
}

fn commonest(numbers: impl Iterator<Item = usize>) -> Option<usize> {
    let mut counts = std::collections::BTreeMap::new();
    numbers.for_each(|number| *counts.entry(number).or_insert(0_usize) += 1);
    counts.into_iter().max_by_key(|(number, count)| (*count, *number)).map(|(number, _)| number)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn rows(pattern: &str) -> String {
        (0..30).map(|k| pattern.replace("T", &k.to_string())).collect()
    }

    /// Delimiter, decimal mark, header, units, first line.
    fn found(text: &str) -> (&'static str, char, usize, usize, usize) {
        let own = find(text).unwrap();
        (own.delimiter.name(), own.decimal, own.header_line, own.unit_line, own.first_line)
    }

    #[test]
    fn layouts_are_found() {
        assert_eq!(found(&format!("t,p\n{}", rows("T.5,1e5\n"))), (",", '.', 1, 0, 2));
        assert_eq!(found(&format!("t;p;y\ns;bar;mm\n{}", rows("T,5;1,25;3\n"))), (";", ',', 1, 2, 3));
        assert_eq!(found(&format!("Recorder 7\nRate: 10\n\nt [s]\tp\n{}", rows("T\t2\n"))), ("\t", '.', 4, 0, 5));
        assert_eq!(found(&format!("# t p\n{}", rows("  T.0   1.5\n"))), (" ", '.', 1, 0, 2));
        assert_eq!(found(&rows("T,5 3,5\n")), (" ", ',', 0, 0, 1));
        assert_eq!(found(&format!("t (ms);p [bar]\n{}", rows("0,T;0,5\n"))), (";", ',', 1, 0, 2));
        assert_eq!(found(&format!("\"t\",\"p\"\n{}", rows("\"T,5\",\"1,5\"\n"))), (",", ',', 1, 0, 2));
        assert_eq!(found(&format!("t;note;p\n{}", rows("T;ok;1,5\n"))), (";", ',', 1, 0, 2));
        assert_eq!(found(&format!("t;p;\n{}", rows("T;1;\n"))), (";", '.', 1, 0, 2));
        // Two columns of integers, and one with a decimal comma under a header.
        assert_eq!(found(&format!("t,p\n{}", rows("T,7\n"))), (",", '.', 1, 0, 2));
        assert_eq!(found(&format!("p [bar]\n{}", rows("T,7\n"))).1, ',');
        assert_eq!(found(&format!("day;t;p\n{}", rows("01.03.2024;22:59:59,90T;0.5\n"))), (";", '.', 1, 0, 2));
        assert_eq!(found(&format!("t,p\n{}", rows("2024-03-01 10:00:00.00T,0.5\n"))), (",", '.', 1, 0, 2));
        assert_eq!(found(&format!("Name;Test 3\nDruck;5\nt;p\n{}", rows("T;7\n"))), (";", '.', 3, 0, 4));
    }

    #[test]
    fn what_is_no_table_is_refused() {
        for (text, expected) in [
            ("", "the file is empty"),
            ("  \n \n", "line 1: the file holds nothing but blanks"),
            ("\nDear all,\nplease find enclosed\n", "line 2: no rows of numbers"),
        ] {
            let said = find(text).unwrap_err().sentence;
            assert!(said.starts_with(expected), "{said}");
        }
    }
}

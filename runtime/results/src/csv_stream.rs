//! Rows of a run to CSV text: `time,<variable>,...`, SI units, Booleans as 0 and 1.
//!
//! Numbers are written with the fewest digits that read back to the same value (Adams: Ryu, fast float-to-string conversion,
//! PLDI 2018).  What several names share is turned into text once in a row, and what does not change once for all rows.  Every
//! failure to write (a full disk among them) is returned.

use std::collections::HashMap;
use std::io::{self, Write};
use std::ops::Range;
use std::sync::Arc;

use hyd_system::{Place, Source, Tables, VariableInfo};

use crate::column::Keep;
use crate::{Column, RowFile, RowKind, Sink, columns};

/// Bytes that are collected before they are written, but for the row that passes them.
const BUFFER: usize = 1 << 18;

/// CSV rows into any writer, such as standard output.
pub struct CsvStream<W: Write> {
    writer: W,
    keep: Keep,
    cells: Vec<Cell>,
    /// Texts of all values that do not change.
    fixed: String,
    /// Where texts that are needed again stand in the row that is being written.
    places: Vec<Range<usize>>,
    text: String,
}

/// What stands in a column of each row.
enum Cell {
    /// A part of [`CsvStream::fixed`].
    Fixed(Range<usize>),
    /// An output, negated or not; its text is kept at a place if another column shows it, too.
    Output { k: u32, negated: bool, place: Option<u32> },
    /// The text at a place.
    Again(u32),
}

impl<W: Write> CsvStream<W> {
    /// Rows into `writer` for the variables that `keep` accepts (see [`crate::is_variable`]).
    pub fn new(writer: W, keep: impl FnMut(&VariableInfo, &str) -> bool + Send + 'static) -> Self {
        Self {
            writer,
            keep: Box::new(keep),
            cells: Vec::new(),
            fixed: String::new(),
            places: Vec::new(),
            text: String::new(),
        }
    }

    /// Writes out what is buffered.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.write_all(self.text.as_bytes())?;
        self.text.clear();
        self.writer.flush()
    }

    /// What stands in each column.
    fn lay_out(&mut self, columns: &[Column], parameters: &[f64]) {
        (self.fixed, self.places) = (String::new(), Vec::new());
        let mut cells: Vec<Cell> = Vec::with_capacity(columns.len());
        let mut first: HashMap<(u32, bool), usize> = HashMap::new();
        for column in columns {
            let Source { place: Place::Output(k), negated } = column.source else {
                let begin = self.fixed.len();
                format_number(column.value(&[], parameters), &mut self.fixed);
                cells.push(Cell::Fixed(begin..self.fixed.len()));
                continue;
            };
            let earlier = first.get(&(k, negated)).and_then(|&at| cells.get_mut(at));
            if let Some(Cell::Output { place, .. }) = earlier {
                let place = *place.get_or_insert_with(|| {
                    self.places.push(0..0);
                    self.places.len() as u32 - 1
                });
                cells.push(Cell::Again(place));
            } else {
                first.insert((k, negated), cells.len());
                cells.push(Cell::Output { k, negated, place: None });
            }
        }
        self.cells = cells;
    }
}

impl<W: Write> Sink for CsvStream<W> {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        let columns = columns(tables, &mut self.keep);
        self.lay_out(&columns, parameters);
        // Names may need quotes.
        let mut header = csv::Writer::from_writer(Vec::new());
        let names = std::iter::once("time").chain(columns.iter().map(|column| column.name.as_str()));
        header.write_record(names).map_err(into_io)?;
        let header = header.into_inner().map_err(|error| error.into_error())?;
        self.text = String::from_utf8(header).map_err(io::Error::other)?;
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        let text = &mut self.text;
        format_number(t, text);
        for cell in &self.cells {
            text.push(',');
            match cell {
                Cell::Fixed(range) => text.push_str(&self.fixed[range.clone()]),
                Cell::Again(place) => text.extend_from_within(self.places[*place as usize].clone()),
                Cell::Output { k, negated, place } => {
                    let value = values.get(*k as usize).copied().unwrap_or(f64::NAN);
                    let begin = text.len();
                    format_number(if *negated { -value } else { value }, text);
                    if let Some(place) = place {
                        self.places[*place as usize] = begin..text.len();
                    }
                }
            }
        }
        text.push('\n');
        if text.len() < BUFFER {
            return Ok(());
        }
        self.writer.write_all(text.as_bytes())?;
        text.clear();
        Ok(())
    }
}

impl<W: Write> RowFile for CsvStream<W> {
    fn finish(&mut self) -> io::Result<()> {
        self.flush()
    }
}

/// Values from [`LEAST`] up to this are written with an exponent here and without one by the library.
const LEAST_PLAIN: f64 = 1e-4;
const LEAST: f64 = 1e-5;

/// Appends the shortest decimal text that reads back to `value`, the closest one of these; integers without a point, no negative
/// zero.  The digits are those of `{:?}`.
pub fn format_number(value: f64, text: &mut String) {
    // A negative zero becomes a positive one.
    let value = value + 0.0;
    if may_be_halfway(value) {
        let plain = format!("{value:?}");
        text.push_str(plain.strip_suffix(".0").unwrap_or(&plain));
        return;
    }
    let mut buffer = ryu::Buffer::new();
    let shortest = buffer.format(value);
    if (LEAST..LEAST_PLAIN).contains(&value.abs()) {
        // 0.0000123 as 1.23e-5.
        let digits = shortest.trim_start_matches(['-', '0', '.']);
        if value < 0.0 {
            text.push('-');
        }
        let (first, rest) = digits.split_at(1);
        text.push_str(first);
        if !rest.is_empty() {
            text.push('.');
            text.push_str(rest);
        }
        text.push_str("e-5");
    } else {
        text.push_str(shortest.strip_suffix(".0").unwrap_or(shortest));
    }
}

/// True where two texts of the same length may be equally close, as for 2^-24: there the library rounds to the even digit and `{:?}`
/// up.  The value has one digit more than these texts then, 16 to 18, or it is an integer beyond all that are exact.
fn may_be_halfway(value: f64) -> bool {
    const FRACTION: u32 = f64::MANTISSA_DIGITS - 1;
    const DIGITS: std::ops::Range<u64> = 10u64.pow(14)..10u64.pow(18);
    let bits = value.abs().to_bits();
    let mantissa = (bits & ((1 << FRACTION) - 1)) | (1 << FRACTION);
    let zeros = mantissa.trailing_zeros();
    // The value is an odd number times 2^-halves.
    let halves = (1023 + FRACTION as i32) - (bits >> FRACTION) as i32 - zeros as i32;
    match u32::try_from(halves) {
        Ok(0) | Err(_) => value.abs() >= (1u64 << f64::MANTISSA_DIGITS) as f64,
        // Its digits are those of the odd number times 5^halves.
        Ok(halves) => {
            let power = 5u64.checked_pow(halves);
            power.and_then(|power| power.checked_mul(mantissa >> zeros)).is_some_and(|digits| DIGITS.contains(&digits))
        }
    }
}

fn into_io(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}

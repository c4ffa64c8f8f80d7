//! Rows of a run to CSV text: `time,<variable>,...`, SI units, Booleans as 0 and 1.
//!
//! Numbers are written with the fewest digits that read back to the same value.  Every failure to write (a full disk among
//! them) is returned.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::sync::Arc;

use hyd_system::{Tables, VariableInfo};

use crate::column::Keep;
use crate::{Column, RowFile, RowKind, Sink, columns};

/// CSV rows into any writer, such as standard output.
pub struct CsvStream<W: Write> {
    csv: csv::Writer<W>,
    keep: Keep,
    columns: Vec<Column>,
    parameters: Vec<f64>,
    text: String,
}

impl<W: Write> CsvStream<W> {
    /// Rows into `writer` for the variables that `keep` accepts (see [`crate::is_variable`]).
    pub fn new(writer: W, keep: impl FnMut(&VariableInfo, &str) -> bool + Send + 'static) -> Self {
        Self {
            csv: csv::WriterBuilder::new().buffer_capacity(1 << 16).from_writer(writer),
            keep: Box::new(keep),
            columns: Vec::new(),
            parameters: Vec::new(),
            text: String::new(),
        }
    }

    /// Writes out what is buffered.
    pub fn flush(&mut self) -> io::Result<()> {
        self.csv.flush()
    }

    fn number(&mut self, value: f64) -> io::Result<()> {
        self.text.clear();
        format_number(value, &mut self.text);
        self.csv.write_field(&self.text).map_err(into_io)
    }

    fn end_row(&mut self) -> io::Result<()> {
        self.csv.write_record(None::<&[u8]>).map_err(into_io)
    }
}

impl<W: Write> Sink for CsvStream<W> {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.columns = columns(tables, &mut self.keep);
        self.parameters = parameters.to_vec();
        self.csv.write_field("time").map_err(into_io)?;
        for column in &self.columns {
            self.csv.write_field(&column.name).map_err(into_io)?;
        }
        self.end_row()
    }

    fn row(&mut self, t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        self.number(t)?;
        for k in 0..self.columns.len() {
            let value = self.columns[k].value(values, &self.parameters);
            self.number(value)?;
        }
        self.end_row()
    }
}

impl<W: Write> RowFile for CsvStream<W> {
    fn finish(&mut self) -> io::Result<()> {
        self.flush()
    }
}

/// Appends the shortest decimal text that reads back to `value`; integers without a point, no negative zero.
pub fn format_number(value: f64, text: &mut String) {
    // Writing to a string cannot fail.
    let _ = write!(text, "{:?}", value + 0.0);
    if text.ends_with(".0") {
        text.truncate(text.len() - 2);
    }
}

fn into_io(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}

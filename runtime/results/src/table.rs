//! A result file read back: named columns over time.
//!
//! Reads what [`crate::ResultFile`] writes and what other tools write alike.  CSV: a header line, the first column the time,
//! numbers in every further cell.  Anything else is refused with line and column; nothing is guessed, and no line may be endless.

use std::fmt;
use std::io::Read;
use std::path::Path;

use crate::line_limit::LineLimit;
use crate::{Format, Side, interpolate};

/// Columns of numbers over ascending times.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Table {
    /// Times (s).
    pub times: Vec<f64>,
    /// Names of the columns beside the time.
    pub names: Vec<String>,
    /// Values, one vector per name.
    pub columns: Vec<Vec<f64>>,
    /// What does not change during the run, where the format tells it apart.
    pub constants: Vec<(String, f64)>,
}

/// Why a result file cannot be read.
#[derive(Debug)]
pub enum ReadError {
    /// The file cannot be opened, read or split into fields.
    Csv(csv::Error),
    /// There is no header or it has no first column.
    NoHeader,
    /// A cell is not a number: line from 1, name of the column, content.
    NotANumber {
        /// Line in the file, from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// The file cannot be opened or read.
    Io(std::io::Error),
    /// It is not a result in MAT format: why.
    Mat(String),
    /// Time runs backwards at this line.
    TimeDescends {
        /// Line in the file, from 1.
        line: u64,
    },
    /// A name stands twice in the header.
    Duplicate {
        /// The name.
        name: String,
    },
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ReadError::Csv(error) => write!(f, "{error}"),
            ReadError::Io(error) => write!(f, "{error}"),
            ReadError::Mat(reason) => write!(f, "{reason}"),
            ReadError::NoHeader => write!(f, "the file has no header line `time,<variable>,...`"),
            ReadError::NotANumber { line, column, text } => {
                write!(f, "line {line}, column `{column}`: `{text}` is not a number")
            }
            ReadError::TimeDescends { line } => write!(f, "line {line}: time runs backwards"),
            ReadError::Duplicate { name } => write!(f, "column `{name}` stands twice in the header"),
        }
    }
}

impl std::error::Error for ReadError {}

impl From<csv::Error> for ReadError {
    fn from(error: csv::Error) -> Self {
        ReadError::Csv(error)
    }
}

impl Table {
    /// Reads a file in the format of its name.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        if Format::of(path) == Format::Mat {
            return Self::from_mat(&std::fs::read(path).map_err(ReadError::Io)?);
        }
        let file = std::fs::File::open(path).map_err(csv::Error::from)?;
        Self::parse(file)
    }

    /// Reads the bytes of a MAT file.
    pub fn from_mat(bytes: &[u8]) -> Result<Self, ReadError> {
        crate::mat_reader::read(bytes).map_err(ReadError::Mat)
    }

    /// Reads CSV text.
    pub fn parse(reader: impl Read) -> Result<Self, ReadError> {
        let mut csv = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(LineLimit::new(reader));
        let header = csv.headers()?.clone();
        if header.get(0).is_none_or(str::is_empty) {
            return Err(ReadError::NoHeader);
        }
        let names: Vec<String> = header.iter().skip(1).map(String::from).collect();
        let mut sorted: Vec<&String> = names.iter().collect();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(ReadError::Duplicate { name: pair[0].clone() });
        }
        let mut table = Table { times: Vec::new(), columns: vec![Vec::new(); names.len()], names, ..Table::default() };
        let mut record = csv::StringRecord::new();
        while csv.read_record(&mut record)? {
            let line = record.position().map_or(0, csv::Position::line);
            for (k, text) in record.iter().enumerate() {
                let value: f64 = text.parse().map_err(|_| ReadError::NotANumber {
                    line,
                    column: header.get(k).unwrap_or_default().to_string(),
                    text: text.to_string(),
                })?;
                match k {
                    0 if table.times.last().is_some_and(|&last| value < last) || value.is_nan() => {
                        return Err(ReadError::TimeDescends { line });
                    }
                    0 => table.times.push(value),
                    _ => table.columns[k - 1].push(value),
                }
            }
        }
        Ok(table)
    }

    /// The column with this name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|n| n == name).map(|k| self.columns[k].as_slice())
    }

    /// Value of a column at time `t` (s), linear between rows; `None` if there is no such column.
    pub fn value(&self, name: &str, t: f64, side: Side) -> Option<f64> {
        self.column(name).map(|column| interpolate(&self.times, |k| column[k], t, side))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_table_is_refused_with_its_place() {
        let fails = |text: &str| Table::parse(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(fails("time,x\n0,1\n1,abc\n"), "line 3, column `x`: `abc` is not a number");
        assert_eq!(fails("time,x\n1,1\n0,1\n"), "line 3: time runs backwards");
        assert_eq!(fails("time,x,x\n"), "column `x` stands twice in the header");
        assert_eq!(fails(""), "the file has no header line `time,<variable>,...`");
        assert!(fails("time,x\n0\n").contains("found record with 1 fields"));
    }

    #[test]
    fn quoted_names_and_event_pairs_are_read() {
        let text = "time,\"a[1,2]\",b\n0,1,2\n1,3,4\n1,5,6\n";
        let table = Table::parse(text.as_bytes()).unwrap();
        assert_eq!(table.column("a[1,2]"), Some(&[1.0, 3.0, 5.0][..]));
        assert_eq!(table.value("b", 1.0, Side::After), Some(6.0));
        assert_eq!(table.value("b", 0.5, Side::After), Some(3.0));
    }
}

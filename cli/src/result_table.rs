//! A result file of any format that `hyd` writes, read back as a table: CSV, MAT v4, Parquet.
//!
//! CSV and MAT are read by `hyd-results`; of Parquet files those are taken that have the time in front and numbers in every
//! column.  What cannot be read is reported with the name of the file.

use std::path::Path;

use hyd_frames::{Cells, Frame, is_parquet};
use hyd_results::{Table, note_read};

use crate::Failure;

/// The results in `file`, or a sentence why not.
pub(crate) fn read(file: &Path) -> Result<Table, Failure> {
    if file.is_dir() {
        return Err(Failure::Fault(format!("`{}` is a folder, not a file", file.display())));
    }
    if !file.exists() {
        return Err(Failure::Fault(format!("there is no file `{}`", file.display())));
    }
    note_read(file);
    let table = if is_parquet(file) {
        Frame::read(file).map_err(|error| error.to_string()).and_then(from_frame)
    } else {
        Table::read(file).map_err(|error| error.to_string())
    };
    table.map_err(|reason| Failure::Fault(format!("`{}`: {reason}", file.display())))
}

fn from_frame(frame: Frame) -> Result<Table, String> {
    let mut columns = frame.columns.into_iter();
    let times = match columns.next() {
        Some((name, Cells::Numbers(times))) if name == "time" => times,
        _ => return Err("it holds no run: the first column is not `time`".to_string()),
    };
    if times.windows(2).any(|pair| pair[1] < pair[0]) || times.iter().any(|t| t.is_nan()) {
        return Err("time runs backwards".to_string());
    }
    let mut table = Table { times, ..Table::default() };
    for (name, cells) in columns {
        match cells {
            Cells::Numbers(values) => table.columns.push(values),
            Cells::Wholes(values) => table.columns.push(values.into_iter().map(|value| value as f64).collect()),
            Cells::Texts(_) => return Err(format!("column `{name}` holds texts, not numbers")),
        }
        table.names.push(name);
    }
    Ok(table)
}

//! A Parquet file of this crate read back.
//!
//! Takes flat tables of required doubles, 64-bit integers and texts; anything else is refused by name.  The library behind
//! asserts what it takes for granted, so that damaged files may end in a panic of its own; that is an error here.

use std::cell::Cell;
use std::fs::File;
use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Once;

use parquet::column::reader::ColumnReader;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};

use crate::{Cells, Kind, into_io};

/// A table in memory.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Frame {
    /// Names and values, equally long.
    pub columns: Vec<(String, Cells)>,
    /// Keys and values.
    pub metadata: Vec<(String, String)>,
}

impl Frame {
    /// Reads a whole file.
    ///
    /// # Errors
    /// The system's where the file cannot be read, else a sentence on what is wrong with its contents.
    pub fn read(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        guarded(|| read(&SerializedFileReader::new(file)?)).map_err(into_io)
    }

    /// The column with this name.
    pub fn column(&self, name: &str) -> Option<&Cells> {
        self.columns.iter().find(|(n, _)| n == name).map(|(_, cells)| cells)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, cells)| cells.len())
    }
}

thread_local! {
    /// Panics of this thread are errors.
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// What `work` gives; its panics are errors, and nothing is written about them.
fn guarded<T>(work: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !GUARDED.get() {
                before(info);
            }
        }));
    });
    GUARDED.set(true);
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(false);
    outcome.unwrap_or_else(|_| Err(ParquetError::General("the file is damaged".to_string())))
}

fn read(reader: &SerializedFileReader<File>) -> Result<Frame, ParquetError> {
    let metadata = reader.metadata().file_metadata();
    let pairs = metadata.key_value_metadata().into_iter().flatten();
    let pairs = pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect();
    let mut frame = Frame { columns: Vec::new(), metadata: pairs };
    for column in metadata.schema_descr().columns() {
        let kind = match column.physical_type() {
            parquet::basic::Type::DOUBLE => Kind::Number,
            parquet::basic::Type::INT64 => Kind::Whole,
            parquet::basic::Type::BYTE_ARRAY => Kind::Text,
            other => return Err(ParquetError::General(format!("column `{}` holds {other}", column.name()))),
        };
        frame.columns.push((column.name().to_string(), Cells::new(kind)));
    }
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        for (k, (_, cells)) in frame.columns.iter_mut().enumerate() {
            append(group.as_ref(), k, cells)?;
        }
    }
    Ok(frame)
}

fn append(group: &dyn RowGroupReader, column: usize, cells: &mut Cells) -> Result<(), ParquetError> {
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    match (group.get_column_reader(column)?, cells) {
        (ColumnReader::DoubleColumnReader(mut reader), Cells::Numbers(values)) => {
            reader.read_records(rows, None, None, values)?;
        }
        (ColumnReader::Int64ColumnReader(mut reader), Cells::Wholes(values)) => {
            reader.read_records(rows, None, None, values)?;
        }
        (ColumnReader::ByteArrayColumnReader(mut reader), Cells::Texts(values)) => {
            // How many rows there are is what the file says.
            let mut bytes = Vec::new();
            reader.read_records(rows, None, None, &mut bytes)?;
            for text in bytes {
                values.push(text.as_utf8()?.to_string());
            }
        }
        _ => return Err(ParquetError::General("a column changes its type".to_string())),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::Frame;
    use crate::{Cells, FrameWriter, Kind};

    /// Whatever byte is wrong, the file is read or refused.
    #[test]
    fn a_wrong_byte_is_no_panic() {
        let path = std::env::temp_dir().join(format!("hyd-frame-{}.parquet", std::process::id()));
        let columns = [("time", Kind::Number), ("shot", Kind::Whole), ("note", Kind::Text)];
        let file = std::fs::File::create(&path).expect("made");
        let mut writer = FrameWriter::new(file, columns.into_iter(), &[("key".into(), "value".into())]).expect("begun");
        let cells = [
            Cells::Numbers(vec![0.0, 0.5, 1.0]),
            Cells::Wholes(vec![1, 2, 3]),
            Cells::Texts(["a", "", "long"].map(String::from).to_vec()),
        ];
        writer.group(&cells).expect("written");
        writer.finish().expect("written");
        assert_eq!(Frame::read(&path).expect("whole").column("shot"), Some(&cells[1]));
        let whole = std::fs::read(&path).expect("readable");
        let mut refused = 0;
        for at in 0..whole.len() {
            for wrong in [0, 0x7f, 0xff, whole[at] ^ 1] {
                let mut bytes = whole.clone();
                bytes[at] = wrong;
                std::fs::write(&path, bytes).expect("written");
                refused += usize::from(Frame::read(&path).is_err());
            }
        }
        assert!(refused > whole.len() / 2, "{refused} of {}", 4 * whole.len());
        std::fs::remove_file(&path).expect("removed");
    }
}

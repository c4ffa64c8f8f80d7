//! A Parquet file of this crate read back.
//!
//! Takes flat tables of required doubles, 64-bit whole numbers and texts; anything else is refused by name.

use std::fs::File;
use std::io;
use std::path::Path;

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
    pub fn read(path: &Path) -> io::Result<Self> {
        let reader = SerializedFileReader::new(File::open(path)?).map_err(into_io)?;
        read(&reader).map_err(into_io)
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
            let mut bytes = Vec::with_capacity(rows);
            reader.read_records(rows, None, None, &mut bytes)?;
            for text in bytes {
                values.push(text.as_utf8()?.to_string());
            }
        }
        _ => return Err(ParquetError::General("a column changes its type".to_string())),
    }
    Ok(())
}

//! Columns to a Parquet file, a row group at a time.
//!
//! All columns are required (there are no missing values); the table of contents is written by `finish`, and a file
//! without it is readable by nobody.

use std::fs::File;
use std::io;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::{Cells, Kind, into_io};

/// A Parquet file in the making.
pub struct FrameWriter {
    writer: SerializedFileWriter<File>,
}

impl FrameWriter {
    /// Begins a file with these columns and metadata (key, value).
    pub fn new<'a>(
        file: File,
        columns: impl Iterator<Item = (&'a str, Kind)>,
        metadata: &[(String, String)],
    ) -> io::Result<Self> {
        Self::open(file, columns, metadata).map_err(into_io)
    }

    fn open<'a>(
        file: File,
        columns: impl Iterator<Item = (&'a str, Kind)>,
        metadata: &[(String, String)],
    ) -> Result<Self, ParquetError> {
        let fields = columns.map(|(name, kind)| field(name, kind)).collect::<Result<Vec<_>, ParquetError>>()?;
        let schema = Type::group_type_builder("table").with_fields(fields).build()?;
        let pairs = metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).collect();
        let properties = WriterProperties::builder().set_dictionary_enabled(false).set_key_value_metadata(Some(pairs));
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()))?;
        Ok(Self { writer })
    }

    /// Appends equally long columns, in the order and of the kinds that `new` was given.
    pub fn group(&mut self, columns: &[Cells]) -> io::Result<()> {
        self.write(columns).map_err(into_io)
    }

    fn write(&mut self, columns: &[Cells]) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for cells in columns {
            let Some(mut column) = group.next_column()? else { break };
            match cells {
                Cells::Numbers(values) => column.typed::<DoubleType>().write_batch(values, None, None)?,
                Cells::Wholes(values) => column.typed::<Int64Type>().write_batch(values, None, None)?,
                Cells::Texts(values) => {
                    let texts: Vec<ByteArray> = values.iter().map(|text| text.as_str().into()).collect();
                    column.typed::<ByteArrayType>().write_batch(&texts, None, None)?
                }
            };
            column.close()?;
        }
        group.close().map(|_| ())
    }

    /// Writes the table of contents.
    pub fn finish(self) -> io::Result<()> {
        self.writer.close().map(|_| ()).map_err(into_io)
    }
}

fn field(name: &str, kind: Kind) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match kind {
        Kind::Number => (Physical::DOUBLE, None),
        Kind::Whole => (Physical::INT64, None),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let field = Type::primitive_type_builder(name, physical).with_repetition(Repetition::REQUIRED);
    field.with_logical_type(logical).build().map(Arc::new)
}

//! Columns to a Parquet file, a row group at a time.
//!
//! All columns are required (there are no missing values).  A file is readable once its table of contents stands at its end, so one
//! is written after groups, too, as often as that costs little, and taken away again by the next group: what a killed process
//! leaves holds the groups up to then.  Pages are ours (`page.rs`), the table of contents is the library's; it says of each column
//! where its pages stand, and columns with the same values share them.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::{
    ColumnChunkMetaData, FileMetaData, KeyValue, ParquetMetaDataBuilder, ParquetMetaDataWriter, RowGroupMetaData,
};
use parquet::schema::types::{SchemaDescPtr, SchemaDescriptor, Type};

use crate::page::{PageEncoder, Size};
use crate::{Cells, Kind, into_io};

/// What a file begins and ends with.
const MAGIC: &[u8; 4] = b"PAR1";
/// Version of the format that tables of contents name: byte-stream split came with the second.
const VERSION: i32 = 2;
/// Pages are written when there are so many bytes of them.
const BUFFER: usize = 1 << 20;
/// Bytes that a column takes in the table of contents, about.
const CONTENTS_PER_COLUMN: u64 = 70;
/// A table of contents between groups may be this part of what was written since the last one.
const CONTENTS_SHARE: u64 = 16;

/// A Parquet file in the making.
pub struct FrameWriter {
    file: File,
    /// The file can be shortened, which a pipe cannot.
    seekable: bool,
    schema: SchemaDescPtr,
    metadata: Vec<KeyValue>,
    encoder: PageEncoder,
    /// Pages that are not written yet, and where they begin in the file.
    pages: Vec<u8>,
    written: u64,
    groups: Vec<Group>,
    /// Where pages ended when the table of contents was last written, and whether it still stands there.
    checked: u64,
    readable: bool,
}

/// Where the pages of a column of one group stand.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Chunk {
    at: u64,
    size: Size,
}

struct Group {
    rows: usize,
    chunks: Vec<Chunk>,
}

/// A row group in the making: its columns come in their order.
pub struct GroupWriter<'a> {
    file: &'a mut FrameWriter,
    group: Group,
}

impl FrameWriter {
    /// Begins a file with these columns and metadata (key, value).
    ///
    /// # Errors
    /// The system's.
    pub fn new<'a>(
        mut file: File,
        columns: impl Iterator<Item = (&'a str, Kind)>,
        metadata: &[(String, String)],
    ) -> io::Result<Self> {
        let fields = columns.map(|(name, kind)| field(name, kind)).collect::<Result<Vec<_>, ParquetError>>();
        let schema = fields.and_then(|fields| Type::group_type_builder("table").with_fields(fields).build());
        let schema = schema.map_err(into_io)?;
        let pairs = metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).collect();
        Ok(Self {
            seekable: file.stream_position().is_ok_and(|at| at == 0),
            file,
            schema: Arc::new(SchemaDescriptor::new(Arc::new(schema))),
            metadata: pairs,
            encoder: PageEncoder::new()?,
            pages: MAGIC.to_vec(),
            written: 0,
            groups: Vec::new(),
            checked: 0,
            readable: false,
        })
    }

    /// Appends equally long columns, in the order and of the kinds that `new` was given.
    ///
    /// # Errors
    /// The system's.
    pub fn group(&mut self, columns: &[Cells]) -> io::Result<()> {
        let mut group = self.begin(columns.first().map_or(0, Cells::len));
        for cells in columns {
            let chunk = group.cells(cells)?;
            group.column(chunk);
        }
        group.finish()
    }

    /// Begins a group of so many rows.
    pub fn begin(&mut self, rows: usize) -> GroupWriter<'_> {
        let chunks = Vec::with_capacity(self.schema.num_columns());
        GroupWriter { file: self, group: Group { rows, chunks } }
    }

    /// Writes the table of contents.
    ///
    /// # Errors
    /// The system's.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()?;
        if self.readable { Ok(()) } else { self.contents() }
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.pages.is_empty() {
            return Ok(());
        }
        if self.readable {
            // The table of contents at the end goes.
            self.file.set_len(self.written)?;
            self.file.seek(SeekFrom::Start(self.written))?;
            self.readable = false;
        }
        self.file.write_all(&self.pages)?;
        self.written += self.pages.len() as u64;
        self.pages.clear();
        Ok(())
    }

    /// The table of contents at the end of the file.
    fn contents(&mut self) -> io::Result<()> {
        let rows: usize = self.groups.iter().map(|group| group.rows).sum();
        let pairs = Some(self.metadata.clone());
        let created = Some(concat!("hyd version ", env!("CARGO_PKG_VERSION")).to_string());
        let about = FileMetaData::new(VERSION, rows as i64, created, pairs, self.schema.clone(), None);
        let groups = self.groups.iter().map(|group| self.described(group)).collect::<Result<Vec<_>, ParquetError>>();
        let contents = ParquetMetaDataBuilder::new(about).set_row_groups(groups.map_err(into_io)?).build();
        let mut bytes = Vec::new();
        ParquetMetaDataWriter::new(&mut bytes, &contents).finish().map_err(into_io)?;
        self.file.write_all(&bytes)
    }

    fn described(&self, group: &Group) -> Result<RowGroupMetaData, ParquetError> {
        let column = |(k, chunk): (usize, &Chunk)| {
            let column = self.schema.column(k);
            let encoding = match column.physical_type() {
                Physical::DOUBLE => Encoding::BYTE_STREAM_SPLIT,
                _ => Encoding::PLAIN,
            };
            let compression =
                if chunk.size.is_plain { Compression::UNCOMPRESSED } else { Compression::ZSTD(ZstdLevel::default()) };
            ColumnChunkMetaData::builder(column)
                .set_encodings(vec![encoding])
                .set_compression(compression)
                .set_num_values(group.rows as i64)
                .set_total_compressed_size(chunk.size.compressed as i64)
                .set_total_uncompressed_size(chunk.size.plain as i64)
                .set_data_page_offset(chunk.at as i64)
                .build()
        };
        let columns = group.chunks.iter().enumerate().map(column).collect::<Result<Vec<_>, ParquetError>>()?;
        RowGroupMetaData::builder(self.schema.clone())
            .set_num_rows(group.rows as i64)
            .set_total_byte_size(columns.iter().map(ColumnChunkMetaData::uncompressed_size).sum())
            .set_column_metadata(columns)
            .build()
    }
}

impl GroupWriter<'_> {
    /// Writes values of the group; they are a column where [`GroupWriter::column`] says so.
    ///
    /// # Errors
    /// The system's.
    pub fn cells(&mut self, cells: &Cells) -> io::Result<Chunk> {
        self.chunk(|encoder, pages| encoder.cells(cells, pages))
    }

    /// The same for numbers.
    ///
    /// # Errors
    /// The system's.
    pub fn numbers(&mut self, values: &[f64]) -> io::Result<Chunk> {
        self.chunk(|encoder, pages| encoder.numbers(values, pages))
    }

    /// The next column of the group has these values; several columns may have the same ones.
    pub fn column(&mut self, chunk: Chunk) {
        self.group.chunks.push(chunk);
    }

    fn chunk(&mut self, encode: impl FnOnce(&mut PageEncoder, &mut Vec<u8>) -> io::Result<Size>) -> io::Result<Chunk> {
        let file = &mut *self.file;
        if file.pages.len() >= BUFFER {
            file.flush()?;
        }
        let at = file.written + file.pages.len() as u64;
        Ok(Chunk { at, size: encode(&mut file.encoder, &mut file.pages)? })
    }

    /// The group is whole; one without rows leaves no trace.
    ///
    /// # Errors
    /// The system's; or there are not as many columns as the file has.
    pub fn finish(self) -> io::Result<()> {
        let Self { file, group } = self;
        if group.chunks.len() != file.schema.num_columns() {
            return Err(io::Error::other(
                "a row group has columns that the file does not have, or the other way round",
            ));
        }
        if group.rows == 0 {
            return Ok(());
        }
        file.groups.push(group);
        file.flush()?;
        let contents = CONTENTS_PER_COLUMN * (file.groups.len() * file.schema.num_columns()) as u64;
        if file.seekable && file.checked + CONTENTS_SHARE * contents <= file.written {
            file.contents()?;
            (file.checked, file.readable) = (file.written, true);
        }
        Ok(())
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

//! A Parquet file read back, of this crate or of another program.
//!
//! Takes flat tables of numbers, integers, Booleans, texts and timestamps, uncompressed or by zstd or snappy; anything else is refused
//! by name.  Columns with gaps are numbers, NaN where they have none, and timestamps are seconds since the first one of the file,
//! because a double has no room for nanoseconds since 1970.  The library behind asserts what it takes for granted, so that
//! damaged files may end in a panic of its own; that is an error here.

use std::cell::Cell;
use std::fs::File;
use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Once;

use parquet::basic::{Compression, LogicalType, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

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
        Self::read_columns(path, |_| true)
    }

    /// Reads the columns whose names `keep` accepts, and of the rest of the file only where they stand.
    ///
    /// # Errors
    /// Those of [`Frame::read`], for these columns.
    pub fn read_columns(path: &Path, mut keep: impl FnMut(&str) -> bool) -> io::Result<Self> {
        let file = File::open(path)?;
        guarded(|| read(&SerializedFileReader::new(file)?, &mut keep)).map_err(into_io)
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

/// How the values of a column are meant.
#[derive(Clone, Copy)]
struct Meaning {
    kind: Kind,
    /// Nanoseconds per unit of a timestamp.
    timestamp: Option<i128>,
    /// Integers are without a sign.
    is_unsigned: bool,
    /// Definition level of a value that is there.
    level: i16,
}

fn fault(words: String) -> ParquetError {
    ParquetError::General(words)
}

impl Meaning {
    fn of(column: &ColumnDescriptor) -> Result<Self, ParquetError> {
        let refused = |what: &str| Err(fault(format!("column `{}` holds {what}", column.path().string())));
        if column.max_rep_level() > 0 {
            return refused("lists");
        }
        let logical = column.logical_type_ref();
        let timestamp = match logical {
            Some(LogicalType::Timestamp(own)) => Some(match own.unit {
                TimeUnit::MILLIS => 1_000_000,
                TimeUnit::MICROS => 1_000,
                TimeUnit::NANOS => 1,
            }),
            Some(LogicalType::Decimal { .. }) => return refused("decimals"),
            Some(LogicalType::Date | LogicalType::Time { .. }) => return refused("dates or times of day"),
            _ => None,
        };
        let is_unsigned = matches!(logical, Some(LogicalType::Integer(own)) if !own.is_signed);
        let has_gaps = column.max_def_level() > 0;
        let kind = match column.physical_type() {
            Type::FLOAT | Type::DOUBLE => Kind::Number,
            Type::BOOLEAN | Type::INT32 | Type::INT64 if has_gaps || is_unsigned || timestamp.is_some() => Kind::Number,
            Type::BOOLEAN | Type::INT32 | Type::INT64 => Kind::Whole,
            Type::BYTE_ARRAY => Kind::Text,
            other => return refused(&other.to_string()),
        };
        Ok(Self { kind, timestamp, is_unsigned, level: column.max_def_level() })
    }
}

fn read(reader: &SerializedFileReader<File>, keep: &mut dyn FnMut(&str) -> bool) -> Result<Frame, ParquetError> {
    let metadata = reader.metadata().file_metadata();
    let pairs = metadata.key_value_metadata().into_iter().flatten();
    let pairs = pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect();
    let mut frame = Frame { columns: Vec::new(), metadata: pairs };
    let mut meanings = Vec::new();
    for (k, column) in metadata.schema_descr().columns().iter().enumerate() {
        if keep(column.name()) {
            let meaning = Meaning::of(column)?;
            frame.columns.push((column.name().to_string(), Cells::new(meaning.kind)));
            meanings.push((k, meaning));
        }
    }
    // The first timestamp (ns): one for all columns, so that clocks keep their distance.
    let mut origin = None;
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        for ((name, cells), &(k, meaning)) in frame.columns.iter_mut().zip(&meanings) {
            let compression = group.metadata().column(k).compression();
            if !matches!(compression, Compression::UNCOMPRESSED | Compression::SNAPPY | Compression::ZSTD(_)) {
                let name_of = compression.to_string().split('(').next().unwrap_or_default().to_lowercase();
                return Err(fault(format!(
                    "column `{name}` is compressed with {name_of}, which is not supported; write it with zstd or snappy, or uncompressed"
                )));
            }
            append(group.as_ref(), k, cells, meaning, &mut origin)?;
        }
    }
    Ok(frame)
}

/// All values of a group, none for a gap.
fn values<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    level: i16,
) -> Result<Vec<Option<T::T>>, ParquetError> {
    // How many rows there are is what the file says, so that nothing is reserved for them.
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    if level == 0 {
        reader.read_records(rows, None, None, &mut values)?;
        return Ok(values.into_iter().map(Some).collect());
    }
    reader.read_records(rows, Some(&mut levels), None, &mut values)?;
    let mut values = values.into_iter();
    Ok(levels.iter().map(|own| if *own == level { values.next() } else { None }).collect())
}

fn append(
    group: &dyn RowGroupReader,
    column: usize,
    cells: &mut Cells,
    meaning: Meaning,
    origin: &mut Option<i128>,
) -> Result<(), ParquetError> {
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    let level = meaning.level;
    let integers = match (group.get_column_reader(column)?, &mut *cells) {
        (ColumnReader::DoubleColumnReader(reader), Cells::Numbers(numbers)) => {
            numbers.extend(values(reader, rows, level)?.into_iter().map(|own| own.unwrap_or(f64::NAN)));
            return Ok(());
        }
        (ColumnReader::FloatColumnReader(reader), Cells::Numbers(numbers)) => {
            numbers.extend(values(reader, rows, level)?.into_iter().map(|own| own.map_or(f64::NAN, f64::from)));
            return Ok(());
        }
        (ColumnReader::ByteArrayColumnReader(reader), Cells::Texts(texts)) => {
            for text in values(reader, rows, level)? {
                texts.push(text.map_or_else(|| Ok(String::new()), |text| text.as_utf8().map(str::to_string))?);
            }
            return Ok(());
        }
        (ColumnReader::Int64ColumnReader(reader), _) => values(reader, rows, level)?,
        (ColumnReader::Int32ColumnReader(reader), _) => {
            let sign = |own: i32| if meaning.is_unsigned { i64::from(own.cast_unsigned()) } else { i64::from(own) };
            values(reader, rows, level)?.into_iter().map(|own| own.map(sign)).collect()
        }
        (ColumnReader::BoolColumnReader(reader), _) => {
            values(reader, rows, level)?.into_iter().map(|own| own.map(i64::from)).collect()
        }
        _ => return Err(fault("a column changes its type".to_string())),
    };
    match cells {
        Cells::Wholes(wholes) => wholes.extend(integers.into_iter().flatten()),
        Cells::Numbers(numbers) => {
            let mut number = |own: i64| match meaning.timestamp {
                Some(unit) => {
                    let since = i128::from(own) * unit;
                    (since - *origin.get_or_insert(since)) as f64 * 1e-9
                }
                None if meaning.is_unsigned => own.cast_unsigned() as f64,
                None => own as f64,
            };
            numbers.extend(integers.into_iter().map(|own| own.map_or(f64::NAN, &mut number)));
        }
        Cells::Texts(_) => return Err(fault("a column changes its type".to_string())),
    }
    Ok(())
}

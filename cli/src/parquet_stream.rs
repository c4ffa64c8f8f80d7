//! Rows of a run to a Parquet file: a column of doubles per variable, units, descriptions and parameters as metadata.
//!
//! Rows are collected and written a row group at a time; the table of contents stands at the end of a Parquet file, so it is
//! readable once it is finished.  Metadata keys: `model`, and `units`, `descriptions`, `parameters` as JSON objects by full name.

use std::fs::File;
use std::io;
use std::sync::Arc;

use hyd_results::{Column, Keep, RowFile, RowKind, Sink, described_columns};
use hyd_system::{Place, Tables, Variability, VariableInfo};
use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

/// Values that are collected before a row group is written.
const GROUP: usize = 1 << 21;

/// Parquet rows into a file.
pub(crate) struct ParquetStream {
    file: Option<File>,
    keep: Keep,
    writer: Option<SerializedFileWriter<File>>,
    columns: Vec<Column>,
    parameters: Vec<f64>,
    /// Time, then the columns.
    values: Vec<Vec<f64>>,
}

impl ParquetStream {
    /// Rows into `file` for the variables that `keep` accepts.
    pub(crate) fn new(file: File, keep: impl FnMut(&VariableInfo, &str) -> bool + Send + 'static) -> Self {
        Self {
            file: Some(file),
            keep: Box::new(keep),
            writer: None,
            columns: Vec::new(),
            parameters: Vec::new(),
            values: Vec::new(),
        }
    }

    fn write_group(&mut self) -> io::Result<()> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        write_columns(writer, &self.values).map_err(into_io)?;
        self.values.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}

impl Sink for ParquetStream {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        let described = described_columns(tables, &mut self.keep);
        let metadata = metadata(tables, &described, parameters);
        let names = described.iter().map(|(column, _)| column.name.as_str());
        let file = self.file.take().ok_or_else(|| io::Error::other("a Parquet file holds one run"))?;
        self.writer = Some(open(file, std::iter::once("time").chain(names), metadata).map_err(into_io)?);
        self.columns = described.into_iter().map(|(column, _)| column).collect();
        self.parameters = parameters.to_vec();
        self.values = vec![Vec::new(); self.columns.len() + 1];
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        self.values[0].push(t);
        for (column, collected) in self.columns.iter().zip(&mut self.values[1..]) {
            collected.push(column.value(values, &self.parameters));
        }
        if self.values[0].len() * self.values.len() >= GROUP { self.write_group() } else { Ok(()) }
    }
}

impl RowFile for ParquetStream {
    fn finish(&mut self) -> io::Result<()> {
        if self.values.first().is_some_and(|times| !times.is_empty()) {
            self.write_group()?;
        }
        match self.writer.take() {
            Some(writer) => writer.close().map(|_| ()).map_err(into_io),
            None => Ok(()),
        }
    }
}

/// A writer for required columns of doubles with these names.
pub(crate) fn open<'a>(
    file: File,
    names: impl Iterator<Item = &'a str>,
    metadata: Vec<KeyValue>,
) -> Result<SerializedFileWriter<File>, ParquetError> {
    let field = |name: &str| {
        let field = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
        field.build().map(Arc::new)
    };
    let fields = names.map(field).collect::<Result<Vec<_>, ParquetError>>()?;
    let schema = Type::group_type_builder("run").with_fields(fields).build()?;
    let properties = WriterProperties::builder().set_dictionary_enabled(false).set_key_value_metadata(Some(metadata));
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()))
}

/// A row group of equally long columns.
pub(crate) fn write_columns(writer: &mut SerializedFileWriter<File>, columns: &[Vec<f64>]) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for values in columns {
        if let Some(mut column) = group.next_column()? {
            column.typed::<DoubleType>().write_batch(values, None, None)?;
            column.close()?;
        }
    }
    group.close().map(|_| ())
}

fn metadata(tables: &Tables, described: &[(Column, &VariableInfo)], parameters: &[f64]) -> Vec<KeyValue> {
    let by_name = |text: fn(&VariableInfo) -> &str| {
        let stated = described.iter().filter(|(_, variable)| !text(variable).is_empty());
        stated.map(|(column, variable)| (column.name.clone(), text(variable).into())).collect()
    };
    let json = |map: serde_json::Map<String, serde_json::Value>| serde_json::Value::Object(map).to_string();
    let settings = tables.variables.iter().filter(|variable| variable.variability <= Variability::Parameter);
    let settings = settings.flat_map(|variable| {
        variable.sources.iter().enumerate().map(|(k, source)| {
            let value = match source.place {
                Place::Parameter(place) => parameters.get(place as usize).copied().unwrap_or(f64::NAN),
                Place::Constant(value) => value,
                Place::Output(_) => f64::NAN,
            };
            (variable.name.element(k), if source.negated { -value } else { value }.into())
        })
    });
    vec![
        KeyValue::new("model".to_string(), tables.model.to_string()),
        KeyValue::new("units".to_string(), json(by_name(|variable| &variable.unit))),
        KeyValue::new("descriptions".to_string(), json(by_name(|variable| &variable.description))),
        KeyValue::new("parameters".to_string(), json(settings.collect())),
    ]
}

/// The system's error where there is one behind it, so that a full disk is called one.
pub(crate) fn into_io(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(other) => io::Error::other(other.to_string()),
        },
        other => io::Error::other(other.to_string()),
    }
}

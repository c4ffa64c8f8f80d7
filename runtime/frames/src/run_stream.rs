//! Rows of a run to a Parquet file: a column of doubles per variable, units, descriptions and parameters as metadata.
//!
//! Rows are collected and written a row group at a time; the table of contents stands at the end of a Parquet file, so it is
//! readable once it is finished.  Metadata keys: `model`, and `units`, `descriptions`, `parameters` as JSON objects by full name.

use std::fs::File;
use std::io;
use std::sync::Arc;

use hyd_results::{Column, Keep, RowFile, RowKind, Sink, described_columns};
use hyd_system::{Place, Tables, Variability, VariableInfo};

use crate::{Cells, FrameWriter, Kind};

/// Values that are collected before a row group is written.
const GROUP: usize = 1 << 21;

/// Parquet rows into a file.
pub struct RunStream {
    file: Option<File>,
    keep: Keep,
    writer: Option<FrameWriter>,
    columns: Vec<Column>,
    parameters: Vec<f64>,
    /// Time, then the columns.
    values: Vec<Vec<f64>>,
}

impl RunStream {
    /// Rows into `file` for the variables that `keep` accepts.
    pub fn new(file: File, keep: impl FnMut(&VariableInfo, &str) -> bool + Send + 'static) -> Self {
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
        let cells: Vec<Cells> = self.values.iter_mut().map(|values| Cells::Numbers(std::mem::take(values))).collect();
        writer.group(&cells)
    }
}

impl Sink for RunStream {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        let described = described_columns(tables, &mut self.keep);
        let metadata = metadata(tables, &described, parameters);
        let names = std::iter::once("time").chain(described.iter().map(|(column, _)| column.name.as_str()));
        let file = self.file.take().ok_or_else(|| io::Error::other("a Parquet file holds one run"))?;
        self.writer = Some(FrameWriter::new(file, names.map(|name| (name, Kind::Number)), &metadata)?);
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

impl RowFile for RunStream {
    fn finish(&mut self) -> io::Result<()> {
        if self.values.first().is_some_and(|times| !times.is_empty()) {
            self.write_group()?;
        }
        self.writer.take().map_or(Ok(()), FrameWriter::finish)
    }
}

fn metadata(tables: &Tables, described: &[(Column, &VariableInfo)], parameters: &[f64]) -> Vec<(String, String)> {
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
        ("model".to_string(), tables.model.to_string()),
        ("units".to_string(), json(by_name(|variable| &variable.unit))),
        ("descriptions".to_string(), json(by_name(|variable| &variable.description))),
        ("parameters".to_string(), json(settings.collect())),
    ]
}

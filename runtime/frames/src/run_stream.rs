//! Rows of a run to a Parquet file: a column of doubles per variable, units, descriptions and parameters as metadata.
//!
//! Rows are collected until there are enough for a row group ([`crate::rows`]).  What several names share is written once: their
//! columns lead to the same pages, as do all columns that have one value throughout a group.  Metadata keys: `model`, and `units`,
//! `descriptions`, `parameters` as JSON objects by full name.

use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_results::{Column, Keep, Origin, RowFile, RowKind, Sink, Tracks, described_columns};
use hyd_system::{Place, Tables, Variability, VariableInfo};

use crate::rows::Rows;
use crate::writer::{Chunk, GroupWriter};
use crate::{FrameWriter, Kind};

/// Parquet rows into a file.
pub struct RunStream {
    file: Option<File>,
    beside: PathBuf,
    keep: Keep,
    making: Option<Making>,
}

/// The file of a run that has begun.
struct Making {
    writer: FrameWriter,
    tracks: Tracks,
    /// Time, then the tracks.
    rows: Rows,
    values: Vec<f64>,
}

impl RunStream {
    /// Rows into `file` for the variables that `keep` accepts; what does not fit into memory waits in a file in the folder of
    /// `beside`.
    pub fn new(file: File, beside: &Path, keep: impl FnMut(&VariableInfo, &str) -> bool + Send + 'static) -> Self {
        Self { file: Some(file), beside: beside.to_path_buf(), keep: Box::new(keep), making: None }
    }
}

impl Sink for RunStream {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        let described = described_columns(tables, &mut self.keep);
        let metadata = metadata(tables, &described, parameters);
        let names = std::iter::once("time").chain(described.iter().map(|(column, _)| column.name.as_str()));
        let file = self.file.take().ok_or_else(|| io::Error::other("a Parquet file holds one run"))?;
        let writer = FrameWriter::new(file, names.map(|name| (name, Kind::Number)), &metadata)?;
        let columns: Vec<Column> = described.into_iter().map(|(column, _)| column).collect();
        let tracks = Tracks::new(&columns, parameters);
        let rows = Rows::new(1 + tracks.len(), &self.beside);
        self.making = Some(Making { writer, tracks, rows, values: Vec::new() });
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        let Some(Making { tracks, rows, .. }) = &mut self.making else { return Ok(()) };
        let enough = rows.push(|row| {
            row.push(t);
            tracks.gather(values, row);
        })?;
        match &mut self.making {
            Some(making) if enough => making.group(),
            _ => Ok(()),
        }
    }
}

impl RowFile for RunStream {
    fn finish(&mut self) -> io::Result<()> {
        let Some(mut making) = self.making.take() else { return Ok(()) };
        making.group()?;
        making.writer.finish()
    }
}

impl Making {
    /// Writes the rows that there are as a row group.
    fn group(&mut self) -> io::Result<()> {
        let count = self.rows.len();
        if count == 0 {
            return Ok(());
        }
        let mut group = self.writer.begin(count);
        let mut constants = Constants { count, known: HashMap::new(), values: Vec::new() };
        // Which signs of each track columns want.
        let mut wanted = vec![[false; 2]; self.tracks.len()];
        for origin in &self.tracks.origins {
            if let Origin::Track { track, negated } = *origin {
                wanted[track as usize][usize::from(negated)] = true;
            }
        }
        let mut time = None;
        let mut chunks: Vec<[Option<Chunk>; 2]> = vec![[None; 2]; wanted.len()];
        let (width, step) = (1 + wanted.len(), self.rows.columns_at_once());
        for first in (0..width).step_by(step) {
            let range = first..(first + step).min(width);
            self.rows.columns(range.clone(), &mut self.values)?;
            for (column, values) in range.zip(self.values.chunks_exact_mut(count)) {
                let Some(track) = column.checked_sub(1) else {
                    time = Some(group.numbers(values)?);
                    continue;
                };
                for (sign, chunk) in chunks[track].iter_mut().enumerate().filter(|(sign, _)| wanted[track][*sign]) {
                    if sign == 1 {
                        values.iter_mut().for_each(|value| *value = -*value);
                    }
                    *chunk = Some(constants.chunk_of(values, &mut group)?);
                }
            }
        }
        let missing = || io::Error::other("a column has no values");
        group.column(time.ok_or_else(missing)?);
        for origin in &self.tracks.origins {
            let chunk = match *origin {
                Origin::Track { track, negated } => chunks[track as usize][usize::from(negated)].ok_or_else(missing)?,
                Origin::Fixed(value) => constants.chunk(value, &mut group)?,
            };
            group.column(chunk);
        }
        self.rows.clear();
        group.finish()
    }
}

/// Pages of columns that do not change in a group.
struct Constants {
    count: usize,
    /// By the bits of the value.
    known: HashMap<u64, Chunk>,
    values: Vec<f64>,
}

impl Constants {
    /// Pages of a column that always has this value.
    fn chunk(&mut self, value: f64, group: &mut GroupWriter<'_>) -> io::Result<Chunk> {
        if let Some(&chunk) = self.known.get(&value.to_bits()) {
            return Ok(chunk);
        }
        self.values.clear();
        self.values.resize(self.count, value);
        let chunk = group.numbers(&self.values)?;
        self.known.insert(value.to_bits(), chunk);
        Ok(chunk)
    }

    /// Pages of these values.
    fn chunk_of(&mut self, values: &[f64], group: &mut GroupWriter<'_>) -> io::Result<Chunk> {
        let first = values[0];
        match values.iter().all(|value| value.to_bits() == first.to_bits()) {
            true => self.chunk(first, group),
            false => group.numbers(values),
        }
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

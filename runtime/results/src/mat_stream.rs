//! Rows of a run to a MAT file of version 4 in the layout of Modelica tools, streamed.
//!
//! Matrices `Aclass`, `name`, `description`, `dataInfo`, `data_1` (what does not change, at start and stop) and `data_2` (what
//! changes, a column per row of the run), transposed as `binTrans` says.  Aliases and constants are stored once: `dataInfo`
//! points to a row, with a sign.  `data_2` stands last, so rows are appended, and the number of columns in its header is put
//! right at every write; what a killed process leaves is a readable file.
//! Source: MathWorks, "MAT-File Format", chapter "MAT-File Version 4"; the layout as Dymola's manual describes it.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::sync::Arc;

use hyd_system::{Place, Source, Tables, VariableInfo};

use crate::column::Keep;
use crate::{Column, RowFile, RowKind, Sink, described_columns};

/// Types of elements: the number 1000*machine + 100*order + 10*precision + kind of the header.
const DOUBLES: u32 = 0;
const INTEGERS: u32 = 20;
const TEXT: u32 = 51;

/// Bytes that are collected before they are written.
const BUFFER: usize = 1 << 18;

/// Offset of the number of columns within the header of a matrix.
const COLUMNS_AT: u64 = 8;

/// MAT rows into a file.
pub struct MatStream {
    file: File,
    keep: Keep,
    /// Row of the run or its negative behind each row of `data_2` after the time.
    outputs: Vec<u32>,
    buffer: Vec<u8>,
    rows: u64,
    /// Where the headers of `data_1` and `data_2` begin, and the numbers of `data_1`.
    fixed_at: u64,
    varying_at: u64,
    last_time: f64,
}

impl MatStream {
    /// Rows into `file`, which must be seekable, for the variables that `keep` accepts.
    pub fn new(mut file: File, keep: impl FnMut(&VariableInfo, &str) -> bool + Send + 'static) -> io::Result<Self> {
        file.stream_position()?;
        Ok(Self {
            file,
            keep: Box::new(keep),
            outputs: Vec::new(),
            buffer: Vec::with_capacity(2 * BUFFER),
            rows: 0,
            fixed_at: 0,
            varying_at: 0,
            last_time: 0.0,
        })
    }

    /// Writes what is buffered and puts the counts in the headers right.
    fn flush(&mut self) -> io::Result<()> {
        self.file.write_all(&self.buffer)?;
        self.buffer.clear();
        let columns = u32::try_from(self.rows).map_err(|_| io::Error::other("too many rows for a MAT file"))?;
        self.file.seek(SeekFrom::Start(self.varying_at + COLUMNS_AT))?;
        self.file.write_all(&columns.to_le_bytes())?;
        // The stop time: first number of the second column of `data_1`.
        self.file.seek(SeekFrom::Start(self.fixed_at))?;
        self.file.write_all(&self.last_time.to_le_bytes())?;
        self.file.seek(SeekFrom::End(0))?;
        self.file.flush()
    }

    /// Everything before the first row.
    fn head(&mut self, columns: &[(Column, &VariableInfo)], parameters: &[f64]) {
        let layout = Layout::new(columns, parameters);
        let out = &mut self.buffer;
        text_matrix(out, "Aclass", &["Atrajectory", "1.1", "", "binTrans"], false);
        let names = std::iter::once("time").chain(columns.iter().map(|(column, _)| column.name.as_str()));
        text_matrix(out, "name", &names.collect::<Vec<_>>(), true);
        let texts: Vec<String> = columns.iter().map(|(_, variable)| description(variable)).collect();
        let texts = std::iter::once("Time in [s]").chain(texts.iter().map(String::as_str));
        text_matrix(out, "description", &texts.collect::<Vec<_>>(), true);
        header(out, INTEGERS, 4, layout.places.len(), "dataInfo");
        for place in &layout.places {
            place.iter().for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
        }
        header(out, DOUBLES, 1 + layout.fixed.len(), 2, "data_1");
        for time in 0..2 {
            if time == 1 {
                self.fixed_at = out.len() as u64;
            }
            out.extend_from_slice(&0.0f64.to_le_bytes());
            layout.fixed.iter().for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
        }
        self.varying_at = out.len() as u64;
        header(out, DOUBLES, 1 + layout.outputs.len(), 0, "data_2");
        self.outputs = layout.outputs;
    }
}

impl Sink for MatStream {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.buffer.clear();
        self.rows = 0;
        self.file.set_len(0)?;
        self.file.seek(SeekFrom::Start(0))?;
        let columns = described_columns(tables, &mut self.keep);
        self.head(&columns, parameters);
        self.flush()
    }

    fn row(&mut self, t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        if self.rows == 0 {
            let start = self.fixed_at - (self.varying_at - self.fixed_at);
            self.file.seek(SeekFrom::Start(start))?;
            self.file.write_all(&t.to_le_bytes())?;
            self.file.seek(SeekFrom::End(0))?;
        }
        self.rows += 1;
        self.last_time = t;
        self.buffer.extend_from_slice(&t.to_le_bytes());
        for &k in &self.outputs {
            let value = values.get(k as usize).copied().unwrap_or(f64::NAN);
            self.buffer.extend_from_slice(&value.to_le_bytes());
        }
        if self.buffer.len() >= BUFFER { self.flush() } else { Ok(()) }
    }
}

impl RowFile for MatStream {
    fn finish(&mut self) -> io::Result<()> {
        self.flush()
    }
}

/// Which variable stands where.
struct Layout {
    /// `dataInfo` of the time and of every column: matrix, signed row from 1, interpolation, extrapolation.
    places: Vec<[i32; 4]>,
    /// Values of `data_1` after the time.
    fixed: Vec<f64>,
    /// Rows of the run in `data_2` after the time.
    outputs: Vec<u32>,
}

impl Layout {
    fn new(columns: &[(Column, &VariableInfo)], parameters: &[f64]) -> Self {
        let most = |place: fn(Place) -> Option<u32>| {
            columns.iter().filter_map(|(c, _)| place(c.source.place)).max().map_or(0, |k| k as usize + 1)
        };
        let mut known_outputs = vec![0i32; most(matches_output)];
        let mut known_parameters = vec![0i32; most(matches_parameter)];
        let mut layout = Self { places: vec![[0, 1, 0, -1]], fixed: Vec::new(), outputs: Vec::new() };
        for (column, _) in columns {
            let Source { place, negated } = column.source;
            let (matrix, row) = match place {
                Place::Output(k) => {
                    let row = &mut known_outputs[k as usize];
                    if *row == 0 {
                        layout.outputs.push(k);
                        *row = layout.outputs.len() as i32 + 1;
                    }
                    (2, *row)
                }
                Place::Parameter(k) => {
                    let row = &mut known_parameters[k as usize];
                    if *row == 0 {
                        layout.fixed.push(parameters.get(k as usize).copied().unwrap_or(f64::NAN));
                        *row = layout.fixed.len() as i32 + 1;
                    }
                    (1, *row)
                }
                Place::Constant(value) => {
                    layout.fixed.push(value);
                    (1, layout.fixed.len() as i32 + 1)
                }
            };
            layout.places.push([matrix, if negated { -row } else { row }, 0, -1]);
        }
        layout
    }
}

fn matches_output(place: Place) -> Option<u32> {
    if let Place::Output(k) = place { Some(k) } else { None }
}

fn matches_parameter(place: Place) -> Option<u32> {
    if let Place::Parameter(k) = place { Some(k) } else { None }
}

/// `text [unit|display unit]`
fn description(variable: &VariableInfo) -> String {
    let mut text = variable.description.to_string();
    let unit = variable.unit.as_ref();
    if !unit.is_empty() {
        if !text.is_empty() {
            text.push(' ');
        }
        match variable.display_unit.as_ref() {
            "" => text.push_str(&format!("[{unit}]")),
            display if display == unit => text.push_str(&format!("[{unit}]")),
            display => text.push_str(&format!("[{unit}|{display}]")),
        }
    }
    text
}

pub(crate) fn header(out: &mut Vec<u8>, kind: u32, rows: usize, columns: usize, name: &str) {
    let numbers = [kind, rows as u32, columns as u32, 0, name.len() as u32 + 1];
    numbers.iter().for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
    out.extend_from_slice(name.as_bytes());
    out.push(0);
}

/// Texts as a matrix of characters, one per row, or one per column if `transposed`.
pub(crate) fn text_matrix(out: &mut Vec<u8>, name: &str, texts: &[&str], transposed: bool) {
    let width = texts.iter().map(|text| text.len()).max().unwrap_or(0).max(1);
    let at = |text: &str, k: usize| text.as_bytes().get(k).copied();
    if transposed {
        header(out, TEXT, width, texts.len(), name);
        for text in texts {
            out.extend((0..width).map(|k| at(text, k).unwrap_or(b' ')));
        }
    } else {
        header(out, TEXT, texts.len(), width, name);
        for k in 0..width {
            out.extend(texts.iter().map(|text| at(text, k).unwrap_or(b' ')));
        }
    }
}

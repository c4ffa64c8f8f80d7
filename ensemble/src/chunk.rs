//! The results of a few members, collected and written as whole files.

use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use hyd_frames::{Cells, Frame, FrameWriter, Kind};
use hyd_results::{Column, RowKind, Sink, WholeFile, described_columns};
use hyd_system::{Place, Tables, VariableInfo};

use crate::Measure;
use crate::measure::Follower;

/// What stands above the values.
pub(crate) struct Head {
    /// Names of the varied parameters.
    varied: Vec<String>,
    /// What is measured.
    measures: Vec<String>,
    /// What is kept.
    pub(crate) columns: Vec<Column>,
    model: String,
    /// By name, of what has one.
    units: BTreeMap<String, String>,
}

impl Head {
    pub(crate) fn new(
        tables: &Tables,
        varied: Vec<String>,
        measures: &[Measure],
        keep: impl FnMut(&VariableInfo, &str) -> bool,
    ) -> Self {
        let described = described_columns(tables, keep);
        let unit =
            |name: &String| tables.find(name).map_or_else(String::new, |(variable, _)| variable.unit.to_string());
        let kept = described.iter().map(|(column, variable)| (column.name.clone(), variable.unit.to_string()));
        let varying = varied.iter().map(|name| (name.clone(), unit(name)));
        let measured = measures.iter().map(|measure| (measure.text.clone(), measure.unit(tables)));
        let units = kept.chain(varying).chain(measured).filter(|(_, unit)| !unit.is_empty());
        Self {
            model: tables.model.to_string(),
            units: units.collect(),
            measures: measures.iter().map(|measure| measure.text.clone()).collect(),
            columns: described.into_iter().map(|(column, _)| column).collect(),
            varied,
        }
    }

    /// Where the columns stand in a row.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = u32> {
        let place = |column: &Column| if let Place::Output(k) = column.source.place { Some(k) } else { None };
        self.columns.iter().filter_map(place)
    }

    /// Metadata of a file with these columns: the model, and units by name.
    fn metadata(&self, columns: &[(&str, Kind)]) -> Vec<(String, String)> {
        let unit = |(name, _): &(&str, Kind)| Some((name.to_string(), self.units.get(*name)?.as_str().into()));
        let units = serde_json::Value::Object(columns.iter().filter_map(unit).collect());
        vec![("model".to_string(), self.model.clone()), ("units".to_string(), units.to_string())]
    }

    /// True if files with these heads have the same columns.
    pub(crate) fn is_like(&self, other: &Head) -> bool {
        self.columns.len() == other.columns.len()
            && self.columns.iter().zip(&other.columns).all(|(own, other)| own.name == other.name)
    }
}

/// What is collected of one run.
pub(crate) struct Recorder<'a> {
    columns: &'a [Column],
    parameters: Vec<f64>,
    /// The last row, none before the first.
    last: Vec<f64>,
    /// All rows: member, time, then the columns; `None` if they are not wanted.
    rows: Option<&'a mut Rows>,
    follower: Follower,
    begun: bool,
    member: i64,
}

/// What was taken of a run.
pub(crate) struct Taken {
    /// Values of the last row.
    last: Vec<f64>,
    /// What was measured.
    measured: Vec<f64>,
}

/// Rows of several members, column by column.
#[derive(Default)]
pub(crate) struct Rows {
    members: Vec<i64>,
    /// Time, then the columns.
    values: Vec<Vec<f64>>,
}

impl Rows {
    /// Puts the rows of another run behind these.
    pub(crate) fn append(&mut self, mut other: Rows) {
        self.members.append(&mut other.members);
        self.values.resize_with(self.values.len().max(other.values.len()), Vec::new);
        for (column, own) in self.values.iter_mut().zip(&mut other.values) {
            column.append(own);
        }
    }
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(columns: &'a [Column], rows: Option<&'a mut Rows>, follower: Follower, member: usize) -> Self {
        let (last, parameters) = (Vec::new(), Vec::new());
        Self { columns, parameters, last, rows, follower, begun: false, member: member as i64 }
    }

    /// The run is over.
    pub(crate) fn taken(mut self) -> Taken {
        // A model whose variables are all parameters has an empty row.
        let value = |column: &Column| match self.begun {
            true => column.value(&self.last, &self.parameters),
            false => f64::NAN,
        };
        Taken { last: self.columns.iter().map(value).collect(), measured: self.follower.values() }
    }
}

impl Sink for Recorder<'_> {
    fn begin(&mut self, _tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.parameters = parameters.to_vec();
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], kind: RowKind) -> io::Result<()> {
        // The start is a sample, too; other output points lie between those of the steps.
        if kind != RowKind::Normal || !self.begun {
            self.follower.sample(t, values, &self.parameters);
            self.begun = true;
        }
        if kind == RowKind::Within {
            return Ok(());
        }
        // Columns are picked out of it once it is known to be the last.
        self.last.clear();
        self.last.extend_from_slice(values);
        if let Some(rows) = &mut self.rows {
            rows.values.resize_with(self.columns.len() + 1, Vec::new);
            rows.members.push(self.member);
            rows.values[0].push(t);
            for (own, column) in self.columns.iter().zip(&mut rows.values[1..]) {
                column.push(own.value(values, &self.parameters));
            }
        }
        Ok(())
    }
}

/// One row per member.
pub(crate) struct Table {
    varied: usize,
    measures: usize,
    members: Vec<i64>,
    status: Vec<String>,
    messages: Vec<String>,
    /// Varied parameters, time reached, measures, last values.
    values: Vec<Vec<f64>>,
}

/// Key of the metadata of a chunk: members whose results come from the system with whole loops.  It is not carried over to joined files, which
/// do not depend on chunks.
pub(crate) const DONE_AGAIN: &str = "done_again";

/// The status of a member that failed.
pub(crate) const FAILED: &str = "failed";

/// How a member ended.
pub(crate) struct Ending {
    pub(crate) status: &'static str,
    pub(crate) message: String,
    pub(crate) time: f64,
    /// Rounding errors may have grown along a torn loop.
    pub(crate) rounding: bool,
}

impl Table {
    pub(crate) fn new(head: &Head) -> Self {
        let (varied, measures) = (head.varied.len(), head.measures.len());
        let values = vec![Vec::new(); varied + 1 + measures + head.columns.len()];
        Self { varied, measures, members: Vec::new(), status: Vec::new(), messages: Vec::new(), values }
    }

    pub(crate) fn push(&mut self, member: usize, varied: &[f64], ending: Ending, taken: Taken) {
        self.members.push(member as i64);
        self.status.push(ending.status.to_string());
        self.messages.push(ending.message);
        let taken = taken.measured.iter().chain(&taken.last);
        let values = varied.iter().chain(std::iter::once(&ending.time)).chain(taken);
        for (value, column) in values.zip(&mut self.values) {
            column.push(*value);
        }
    }

    /// Writes `member`, the varied parameters, `status`, `message`, `time`, what was measured and the last values.  `again`: how many of the
    /// members come from the system with whole loops.
    pub(crate) fn write(self, path: &Path, head: &Head, again: usize) -> io::Result<()> {
        let mut columns: Vec<(&str, Kind)> = vec![("member", Kind::Whole)];
        columns.extend(head.varied.iter().map(|name| (name.as_str(), Kind::Number)));
        columns.extend([("status", Kind::Text), ("message", Kind::Text), ("time", Kind::Number)]);
        let mut numbers = self.values.into_iter();
        let mut cells = vec![Cells::Wholes(self.members)];
        cells.extend(numbers.by_ref().take(self.varied).map(Cells::Numbers));
        cells.extend([Cells::Texts(self.status), Cells::Texts(self.messages)]);
        cells.extend(numbers.by_ref().take(1).map(Cells::Numbers));
        // A name is a column once: a varied parameter that is also kept as a variable, a measure that is the last value of a variable.
        let mut known: HashSet<&str> = columns.iter().map(|(name, _)| *name).collect();
        let measured = head.measures.iter().take(self.measures).map(String::as_str);
        for (name, values) in measured.chain(head.columns.iter().map(|column| column.name.as_str())).zip(numbers) {
            if known.insert(name) {
                columns.push((name, Kind::Number));
                cells.push(Cells::Numbers(values));
            }
        }
        let mut metadata = head.metadata(&columns);
        if again > 0 {
            metadata.push((DONE_AGAIN.to_string(), again.to_string()));
        }
        whole(path, &columns, &cells, &metadata)
    }
}

impl Rows {
    /// Writes `member`, `time` and the columns.
    pub(crate) fn write(self, path: &Path, head: &Head) -> io::Result<()> {
        let mut columns = vec![("member", Kind::Whole), ("time", Kind::Number)];
        columns.extend(head.columns.iter().map(|column| (column.name.as_str(), Kind::Number)));
        let mut cells = vec![Cells::Wholes(self.members)];
        cells.extend(self.values.into_iter().map(Cells::Numbers));
        cells.resize(columns.len(), Cells::Numbers(Vec::new()));
        whole(path, &columns, &cells, &head.metadata(&columns))
    }
}

/// What a written chunk says of its members.
#[derive(Default)]
pub(crate) struct Written {
    /// Members that failed, with their messages.
    pub(crate) failed: Vec<(usize, String)>,
    /// Members whose results come from the system with whole loops.
    pub(crate) again: usize,
}

/// Reads what a chunk says of its members.  Of a file that cannot be read that is nothing: joining the chunks says what is wrong with it.
pub(crate) fn written(path: &Path) -> Written {
    let wanted = ["member", "status", "message"];
    let Ok(frame) = Frame::read_columns(path, |name| wanted.contains(&name)) else { return Written::default() };
    let again = frame.metadata.iter().find(|(key, _)| key == DONE_AGAIN).and_then(|(_, count)| count.parse().ok());
    // A varied parameter may have the name of a column, too; its cells are numbers.
    let texts = |wanted: &str| {
        frame.columns.iter().find_map(|(name, cells)| match cells {
            Cells::Texts(texts) if name == wanted => Some(texts.as_slice()),
            _ => None,
        })
    };
    let (status, messages) = (texts("status").unwrap_or_default(), texts("message").unwrap_or_default());
    let members = match frame.column("member") {
        Some(Cells::Wholes(members)) => members.as_slice(),
        _ => &[],
    };
    let rows = members.iter().zip(status).zip(messages);
    let failed = rows.filter(|((_, status), _)| *status == FAILED);
    let failed = failed.map(|((&member, _), message)| (member as usize, message.clone())).collect();
    Written { failed, again: again.unwrap_or(0) }
}

fn whole(path: &Path, head: &[(&str, Kind)], cells: &[Cells], metadata: &[(String, String)]) -> io::Result<()> {
    let whole = WholeFile::create(path)?;
    let file: File = whole.writer()?;
    let mut writer = FrameWriter::new(file, head.iter().copied(), metadata)?;
    writer.group(cells)?;
    writer.finish()?;
    whole.finish().map(|_| ())
}

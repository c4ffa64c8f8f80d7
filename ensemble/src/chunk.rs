//! The results of a few members, collected and written as whole files.

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use hyd_frames::{Cells, Frame, FrameWriter, Kind};
use hyd_results::{Column, RowKind, Sink, WholeFile};
use hyd_system::Tables;

/// What is collected of one run.
pub(crate) struct Recorder<'a> {
    columns: &'a [Column],
    parameters: Vec<f64>,
    /// Values of the last row.
    pub(crate) last: Vec<f64>,
    /// All rows: member, time, then the columns; `None` if they are not wanted.
    rows: Option<&'a mut Rows>,
    member: i64,
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
    pub(crate) fn new(columns: &'a [Column], rows: Option<&'a mut Rows>, member: usize) -> Self {
        let last = vec![f64::NAN; columns.len()];
        Self { columns, parameters: Vec::new(), last, rows, member: member as i64 }
    }
}

impl Sink for Recorder<'_> {
    fn begin(&mut self, _tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.parameters = parameters.to_vec();
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        for (column, last) in self.columns.iter().zip(&mut self.last) {
            *last = column.value(values, &self.parameters);
        }
        if let Some(rows) = &mut self.rows {
            rows.values.resize_with(self.columns.len() + 1, Vec::new);
            rows.members.push(self.member);
            rows.values[0].push(t);
            for (value, column) in self.last.iter().zip(&mut rows.values[1..]) {
                column.push(*value);
            }
        }
        Ok(())
    }
}

/// One row per member.
pub(crate) struct Table {
    varied: usize,
    members: Vec<i64>,
    status: Vec<String>,
    messages: Vec<String>,
    /// Varied parameters, time reached, last values.
    values: Vec<Vec<f64>>,
}

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
    pub(crate) fn new(varied: usize, columns: usize) -> Self {
        let values = vec![Vec::new(); varied + 1 + columns];
        Self { varied, members: Vec::new(), status: Vec::new(), messages: Vec::new(), values }
    }

    pub(crate) fn push(&mut self, member: usize, varied: &[f64], ending: Ending, last: &[f64]) {
        self.members.push(member as i64);
        self.status.push(ending.status.to_string());
        self.messages.push(ending.message);
        let values = varied.iter().chain(std::iter::once(&ending.time)).chain(last);
        for (value, column) in values.zip(&mut self.values) {
            column.push(*value);
        }
    }

    /// Writes `member`, the varied parameters, `status`, `message`, `time` and the last values.
    pub(crate) fn write(self, path: &Path, varied: &[String], columns: &[Column]) -> io::Result<()> {
        let mut head: Vec<(&str, Kind)> = vec![("member", Kind::Whole)];
        head.extend(varied.iter().map(|name| (name.as_str(), Kind::Number)));
        head.extend([("status", Kind::Text), ("message", Kind::Text), ("time", Kind::Number)]);
        // A varied parameter that is also kept as a variable is one column.
        let kept: Vec<bool> = columns.iter().map(|column| !varied.contains(&column.name)).collect();
        let own = columns.iter().zip(&kept).filter(|(_, kept)| **kept);
        head.extend(own.map(|(column, _)| (column.name.as_str(), Kind::Number)));

        let mut numbers = self.values.into_iter();
        let mut cells = vec![Cells::Wholes(self.members)];
        cells.extend(numbers.by_ref().take(self.varied).map(Cells::Numbers));
        cells.extend([Cells::Texts(self.status), Cells::Texts(self.messages)]);
        cells.extend(numbers.by_ref().take(1).map(Cells::Numbers));
        cells.extend(numbers.zip(kept).filter(|(_, kept)| *kept).map(|(values, _)| Cells::Numbers(values)));
        whole(path, &head, &cells)
    }
}

impl Rows {
    /// Writes `member`, `time` and the columns.
    pub(crate) fn write(self, path: &Path, columns: &[Column]) -> io::Result<()> {
        let mut head = vec![("member", Kind::Whole), ("time", Kind::Number)];
        head.extend(columns.iter().map(|column| (column.name.as_str(), Kind::Number)));
        let mut cells = vec![Cells::Wholes(self.members)];
        cells.extend(self.values.into_iter().map(Cells::Numbers));
        cells.resize(head.len(), Cells::Numbers(Vec::new()));
        whole(path, &head, &cells)
    }
}

/// Members of a written chunk that failed, with their messages.  Of a file that cannot be read there are none: joining the chunks
/// says what is wrong with it.
pub(crate) fn failed_members(path: &Path) -> Vec<(usize, String)> {
    let Ok(frame) = Frame::read(path) else { return Vec::new() };
    // A varied parameter may have the name of a column, too; its cells are numbers.
    let texts = |wanted: &str| {
        frame.columns.iter().find_map(|(name, cells)| match cells {
            Cells::Texts(texts) if name == wanted => Some(texts.as_slice()),
            _ => None,
        })
    };
    let (status, messages) = (texts("status").unwrap_or_default(), texts("message").unwrap_or_default());
    let Some(Cells::Wholes(members)) = frame.column("member") else { return Vec::new() };
    let rows = members.iter().zip(status).zip(messages);
    let failed = rows.filter(|((_, status), _)| *status == FAILED);
    failed.map(|((&member, _), message)| (member as usize, message.clone())).collect()
}

fn whole(path: &Path, head: &[(&str, Kind)], cells: &[Cells]) -> io::Result<()> {
    let whole = WholeFile::create(path)?;
    let file: File = whole.writer()?;
    let mut writer = FrameWriter::new(file, head.iter().copied(), &[])?;
    writer.group(cells)?;
    writer.finish()?;
    whole.finish().map(|_| ())
}

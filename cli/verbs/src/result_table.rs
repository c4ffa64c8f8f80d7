//! Result files of any format that `hyd` writes, read back as tables: CSV, MAT v4, Parquet.
//!
//! CSV and MAT are read by `hyd-results`; of Parquet files those are taken that have the time in front and numbers in every
//! column, or the rows of a sweep: `member`, `time`, and the same.  What cannot be read is reported with the name of the file.

use std::collections::BTreeMap;
use std::path::Path;

use hyd_frames::{Cells, Frame, is_parquet};
use hyd_results::{Table, format_number, note_read};

use crate::Failure;
use crate::unit::is_unit;

/// What a file holds.
#[derive(Default)]
pub struct Runs {
    /// Runs of a sweep with their labels, or one run without.
    pub runs: Vec<(Option<String>, Table)>,
    /// Units by full name, as far as the file says.
    pub units: BTreeMap<String, String>,
}

/// The one run in `file`, or a sentence why not.
///
/// # Errors
/// The file cannot be read as a result, or holds the rows of a sweep.
pub fn read(file: &Path) -> Result<Table, Failure> {
    let mut found = read_runs(file, &|_| true)?.runs;
    match (found.len(), found.pop()) {
        (1, Some((None, table))) => Ok(table),
        _ => Err(Failure::Fault(format!("`{}`: it holds the rows of a sweep, not one run", file.display()))),
    }
}

/// The runs in `file`, of a Parquet file only the variables that `keep` accepts.
///
/// # Errors
/// The file cannot be read as a result.
pub fn read_runs(file: &Path, keep: &dyn Fn(&str) -> bool) -> Result<Runs, Failure> {
    if file.is_dir() {
        return Err(Failure::Fault(format!("`{}` is a folder, not a file", file.display())));
    }
    if !file.exists() {
        return Err(Failure::Fault(format!("there is no file `{}`", file.display())));
    }
    if is_unit(file) {
        return Err(Failure::Fault(format!(
            "`{0}` is a unit and holds no results; `hyd simulate {0} --result run.csv` makes some",
            file.display()
        )));
    }
    note_read(file);
    let runs = if is_parquet(file) {
        let frame = Frame::read_columns(file, |name| matches!(name, MEMBER | "time") || keep(name));
        frame.map_err(|error| error.to_string()).and_then(|frame| from_frame(frame, file))
    } else {
        let table = Table::read(file).map_err(|error| error.to_string());
        table.map(|table| Runs { runs: vec![(None, table)], ..Runs::default() })
    };
    runs.map_err(|reason| Failure::Fault(format!("`{}`: {reason}", file.display())))
}

/// The column that tells the runs of a sweep apart.
const MEMBER: &str = "member";

fn from_frame(frame: Frame, file: &Path) -> Result<Runs, String> {
    let units = units(&frame);
    let mut columns = frame.columns;
    let members = match columns.first() {
        Some((name, Cells::Wholes(members))) if name == MEMBER => Some(members.clone()),
        _ => None,
    };
    if members.is_some() {
        columns.remove(0);
    }
    let whole = table(columns)?;
    let Some(members) = members else {
        check(&whole)?;
        return Ok(Runs { runs: vec![(None, whole)], units });
    };
    let labels = labels(file);
    let mut runs = Vec::new();
    let mut first = 0;
    for rows in members.chunk_by(|a, b| a == b) {
        let range = first..first + rows.len();
        first = range.end;
        let table = Table {
            times: whole.times[range.clone()].to_vec(),
            names: whole.names.clone(),
            columns: whole.columns.iter().map(|values| values[range.clone()].to_vec()).collect(),
            constants: Vec::new(),
        };
        check(&table)?;
        let label = labels.get(&rows[0]).cloned().unwrap_or_else(|| format!("member {}", rows[0]));
        runs.push((Some(label), table));
    }
    Ok(Runs { runs, units })
}

/// The time and the columns behind it.
fn table(columns: Vec<(String, Cells)>) -> Result<Table, String> {
    let mut columns = columns.into_iter();
    let times = match columns.next() {
        Some((name, Cells::Numbers(times))) if name == "time" => times,
        _ => return Err("it holds no run: the first column is not `time`".to_string()),
    };
    let mut table = Table { times, ..Table::default() };
    for (name, cells) in columns {
        match cells {
            Cells::Numbers(values) => table.columns.push(values),
            Cells::Wholes(values) => table.columns.push(values.into_iter().map(|value| value as f64).collect()),
            Cells::Texts(_) => return Err(format!("column `{name}` holds texts, not numbers")),
        }
        table.names.push(name);
    }
    Ok(table)
}

fn check(table: &Table) -> Result<(), String> {
    let times = &table.times;
    match times.windows(2).any(|pair| pair[1] < pair[0]) || times.iter().any(|t| t.is_nan()) {
        true => Err("time runs backwards".to_string()),
        false => Ok(()),
    }
}

/// Units as `hyd` writes them.
fn units(frame: &Frame) -> BTreeMap<String, String> {
    let text = frame.metadata.iter().find(|(key, _)| key == "units").map(|(_, text)| text.as_str());
    text.and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default()
}

/// The members of a sweep by the values that were varied, from the file with a row per member beside that of all rows; without it,
/// and where more than two parameters were varied, members have their numbers only.
fn labels(file: &Path) -> BTreeMap<i64, String> {
    const MOST_VARIED: usize = 2;
    let mut varied = true;
    // Varied parameters stand between `member` and `status`.
    let frame = Frame::read_columns(&file.with_file_name("members.parquet"), |name| {
        varied &= name != "status";
        varied
    });
    let Ok(Frame { columns, .. }) = frame else { return BTreeMap::new() };
    let [(first, Cells::Wholes(members)), values @ ..] = columns.as_slice() else { return BTreeMap::new() };
    if first != MEMBER || values.is_empty() || values.len() > MOST_VARIED {
        return BTreeMap::new();
    }
    let label = |row: usize| {
        let value = |(name, cells): &(String, Cells)| match cells {
            Cells::Numbers(values) => values.get(row).map(|&value| format!("{name} = {}", short(value))),
            Cells::Wholes(_) | Cells::Texts(_) => None,
        };
        values.iter().filter_map(value).collect::<Vec<_>>().join(", ")
    };
    members.iter().enumerate().map(|(row, member)| (*member, label(row))).collect()
}

/// Four digits, which tell members apart.
fn short(value: f64) -> String {
    let mut text = String::new();
    format_number(format!("{value:.3e}").parse().unwrap_or(value), &mut text);
    text
}

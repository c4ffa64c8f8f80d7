//! The table of one shot: CSV with a header, a column of times and one for each channel.
//!
//! Empty fields, `-`, `NA`, `null` and NaN are gaps.  Columns that the study does not know are left alone; channels that the table
//! does not have are missing.  Whatever else is not a number is refused with its line.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use hyd_system::Series;

use crate::magnitude::{is_plausible, shown};
use crate::recorded::{self, Rows};
use crate::{Fault, Study};

/// Fewest rows of a table.
pub(crate) const FEWEST: usize = 20;
/// Longest line (bytes): its fields take many times as much memory.
const LONGEST: usize = 1 << 20;

/// A table that was read.
pub(crate) struct ShotTable {
    /// Times (s), ascending.
    pub times: Vec<f64>,
    /// Values by channel; NaN where there is none.  A channel of gaps alone is missing.
    pub values: BTreeMap<String, Vec<f64>>,
    /// Recorded inputs of the model, by their names.
    pub inputs: BTreeMap<String, Arc<Series>>,
    /// What the user should know of it.
    pub warnings: Vec<String>,
    /// Names of all columns.
    pub header: Vec<String>,
}

/// Reads the text of a table.
pub(crate) fn read_table(file: &str, text: &str, study: &Study) -> Result<ShotTable, Fault> {
    let wrong = |sentence: String| Fault::new(format!("`{file}`: {sentence}"));
    if let Some(k) = text.lines().position(|line| line.len() > LONGEST) {
        return Err(wrong(format!("line {} is longer than {} MB", k + 1, LONGEST >> 20)));
    }
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_bytes());
    let header: Vec<String> =
        reader.headers().map_err(|error| wrong(error.to_string()))?.iter().map(String::from).collect();
    let time = columns(&header, study).map_err(wrong)?;
    let known: Vec<(usize, &String)> = header.iter().enumerate().filter(|(_, name)| is_read(study, name)).collect();
    if known.iter().all(|(_, name)| !study.channels.contains_key(*name)) {
        return Err(wrong("none of its columns is a channel of the study".to_string()));
    }
    let (mut times, mut lines): (Vec<f64>, Vec<u64>) = (Vec::new(), Vec::new());
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); known.len()];
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(|error| wrong(error.to_string()))? {
        let line = record.position().map_or(0, |place| line_of(text, place));
        if record.len() != header.len() {
            let fields = if record.len() == 1 { "1 field".to_string() } else { format!("{} fields", record.len()) };
            let advice = if record.len() > header.len() { "; numbers have a decimal point, not a comma" } else { "" };
            return Err(wrong(format!("line {line} has {fields}, and the header {}{advice}", header.len())));
        }
        let number = |column: usize| {
            number(&record[column]).map_err(|why| wrong(format!("line {line}, column `{}`: {why}", header[column])))
        };
        let t = number(time)? * study.shots.time_scale;
        if !t.is_finite() {
            return Err(wrong(format!("line {line}: a time is missing")));
        }
        if !is_plausible(t) {
            return Err(wrong(format!("line {line}: {} s is no time", shown(t))));
        }
        if let Some(&last) = times.last()
            && t <= last
        {
            let sentence = format!("line {line}: the time {t} s does not come after {last} s; times must ascend");
            return Err(wrong(sentence));
        }
        times.push(t);
        lines.push(line);
        for ((column, _), values) in known.iter().zip(&mut values) {
            values.push(number(*column)?);
        }
    }
    if times.len() < FEWEST {
        return Err(wrong(format!("{} rows are too few: a shot has at least {FEWEST}", times.len())));
    }
    let (mut inputs, mut warnings) = (BTreeMap::new(), Vec::new());
    for (name, input) in &study.inputs {
        let found = known.iter().position(|(_, column)| **column == input.column);
        let found = found.ok_or_else(|| {
            let place = study.place(&["inputs", name, "column"]);
            wrong(format!(
                "there is no column `{}` for the input `{name}` ({})",
                input.column,
                place.trim_end_matches(": ")
            ))
        })?;
        let rows = Rows { times: &times, values: &values[found], lines: &lines };
        let (series, warning) = recorded::series(name, input, &rows).map_err(wrong)?;
        inputs.insert(name.clone(), series);
        warnings.extend(warning.map(|warning| format!("`{file}`: {warning}")));
    }
    let values = known.iter().map(|(_, name)| (*name).clone()).zip(values);
    let is_channel = |(name, values): &(String, Vec<f64>)| {
        study.channels.contains_key(name) && values.iter().any(|value| !value.is_nan())
    };
    let values = values.filter(is_channel).collect();
    Ok(ShotTable { times, values, inputs, warnings, header })
}

/// The line of a record; its place is that of the empty lines before it.
fn line_of(text: &str, place: &csv::Position) -> u64 {
    let rest = usize::try_from(place.byte()).ok().and_then(|byte| text.as_bytes().get(byte..)).unwrap_or_default();
    let empty = rest.iter().take_while(|byte| matches!(byte, b'\n' | b'\r')).filter(|byte| **byte == b'\n');
    place.line() + empty.count() as u64
}

/// True for columns that the study reads, but that of the times.
fn is_read(study: &Study, column: &str) -> bool {
    study.channels.contains_key(column) || study.inputs.values().any(|input| input.column == column)
}

/// The position of the column of times.
fn columns(header: &[String], study: &Study) -> Result<usize, String> {
    let mut seen = BTreeSet::new();
    let is_used = |name: &&String| **name == study.shots.time || is_read(study, name);
    if let Some(name) = header.iter().filter(is_used).find(|name| !seen.insert(*name)) {
        return Err(format!("the column `{name}` stands twice in the header"));
    }
    let found = header.iter().position(|name| *name == study.shots.time);
    found.ok_or_else(|| {
        for (separator, words) in [(';', "semicolons"), ('\t', "tabs")] {
            let is_time = |name: &str| name.trim().trim_matches('"') == study.shots.time;
            if header.iter().any(|name| name.split(separator).any(is_time) && name.contains(separator)) {
                return format!(
                    "its fields are separated by {words}; tables of shots have commas between fields and points in numbers"
                );
            }
        }
        let names = header.join(", ");
        format!("there is no column `{}` of times; there are: {}", study.shots.time, shortened(&names))
    })
}

/// The beginning of what may be a whole file without a line's end.
fn shortened(text: &str) -> String {
    const MOST: usize = 200;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_string(),
    }
}

fn number(field: &str) -> Result<f64, String> {
    if matches!(field, "" | "-" | "NA" | "null") {
        return Ok(f64::NAN);
    }
    let field_shown = shortened(field);
    match field.parse::<f64>() {
        Ok(value) if value.is_infinite() => Err(format!("`{field_shown}` is not a measured value")),
        Ok(value) if !value.is_nan() && !is_plausible(value) => Err(format!("{field_shown} is not a measured value")),
        Ok(value) => Ok(value),
        Err(_) if field.replacen(',', ".", 1).parse::<f64>().is_ok() => {
            Err(format!("`{field_shown}` is not a number; numbers have a decimal point, not a comma"))
        }
        Err(_) => Err(format!("`{field_shown}` is not a number")),
    }
}

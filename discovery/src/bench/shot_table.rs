//! The table of one shot: CSV with a header, a column of times and one for each channel.
//!
//! Empty fields, `-`, `NA`, `null` and NaN are gaps.  Columns that the study does not know are left alone; channels that the table
//! does not have are missing.  Whatever else is not a number is refused with its line.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use hyd_compiler::did_you_mean;
use hyd_system::Series;

use crate::bench::clock::{Clock, all_times};
use crate::bench::recorded::{self, Rows};
use crate::magnitude::is_plausible;
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
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text.as_bytes());
    let header: Vec<String> = reader
        .headers()
        .map_err(|error| wrong(error.to_string()))?
        .iter()
        .map(|name| name.trim().to_string())
        .collect();
    twice(&header, study).map_err(wrong)?;
    let mut clocks =
        Clock::all(&header, study, &|name| is_read(study, name), &|time| no_times(&header, time)).map_err(wrong)?;
    if !header.iter().any(|name| study.channels.contains_key(name)) {
        let no_clock = study.shots.rate.is_none() && !header.contains(&study.shots.time);
        let why = if no_clock {
            no_times(&header, &study.shots.time)
        } else {
            "none of its columns is a channel of the study".into()
        };
        return Err(wrong(why));
    }
    let alone = clocks.len() == 1;
    let mut record = csv::StringRecord::new();
    let mut row = 0;
    while reader.read_record(&mut record).map_err(|error| wrong(error.to_string()))? {
        let line = record.position().map_or(0, |place| line_of(text, place));
        if record.len() != header.len() {
            let fields = if record.len() == 1 { "1 field".to_string() } else { format!("{} fields", record.len()) };
            let advice = if record.len() > header.len() { "; numbers have a decimal point, not a comma" } else { "" };
            return Err(wrong(format!("line {line} has {fields}, and the header {}{advice}", header.len())));
        }
        let number = |column: usize| {
            number(record[column].trim()).map_err(|why| format!("line {line}, column `{}`: {why}", header[column]))
        };
        clocks.iter_mut().try_for_each(|clock| clock.take((line, row), study, alone, &number)).map_err(wrong)?;
        row += 1;
    }
    let measure = |clock: &&Clock| clock.columns.iter().any(|&column| study.channels.contains_key(&header[column]));
    let times = all_times(clocks.iter().filter(measure));
    if times.len() < FEWEST {
        return Err(wrong(format!("{} rows are too few: a shot has at least {FEWEST}", times.len())));
    }
    let found = |name: &str| {
        let place = header.iter().position(|own| own == name)?;
        clocks.iter().find_map(|clock| Some((clock, clock.column(place)?)))
    };
    let (mut inputs, mut warnings) = (BTreeMap::new(), Vec::new());
    for (name, input) in &study.inputs {
        let (clock, column) = found(&input.column).ok_or_else(|| {
            let place = study.place(&["inputs", name, "column"]);
            let hint = did_you_mean(&input.column, header.iter().map(String::as_str));
            let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
            wrong(format!(
                "there is no column `{}` for the input `{name}` ({}){hint}",
                input.column,
                place.trim_end_matches(": ")
            ))
        })?;
        if clock.times.len() < 2 {
            return Err(wrong(format!("the column `{}` of the input `{name}` is empty", input.column)));
        }
        let rows = Rows { times: &clock.times, values: &clock.values[column], lines: &clock.lines };
        let (series, warning) = recorded::series(name, input, &rows).map_err(wrong)?;
        inputs.insert(name.clone(), series);
        warnings.extend(warning.map(|warning| format!("`{file}`: {warning}")));
    }
    let channels = study.channels.keys().filter_map(|name| {
        let (clock, column) = found(name)?;
        let values = clock.at(column, &times);
        values.iter().any(|value| !value.is_nan()).then(|| (name.clone(), values))
    });
    let values = channels.collect();
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

/// Refuses columns that count and stand twice.
fn twice(header: &[String], study: &Study) -> Result<(), String> {
    let mut seen = BTreeSet::new();
    let clocks = study.channels.values().filter_map(|own| own.time.as_ref());
    let clocks: Vec<&String> = clocks.chain(study.inputs.values().filter_map(|own| own.time.as_ref())).collect();
    let is_used = |name: &&String| **name == study.shots.time || clocks.contains(name) || is_read(study, name);
    match header.iter().filter(is_used).find(|name| !seen.insert(*name)) {
        Some(name) => Err(format!("the column `{name}` stands twice in the header")),
        None => Ok(()),
    }
}

/// What is said of a column of times that is not there.
fn no_times(header: &[String], wanted: &str) -> String {
    for (separator, words) in [(';', "semicolons"), ('\t', "tabs")] {
        let is_time = |name: &str| name.trim().trim_matches('"') == wanted;
        if header.iter().any(|name| name.split(separator).any(is_time) && name.contains(separator)) {
            return format!(
                "its fields are separated by {words}; tables of shots have commas between fields and points in numbers"
            );
        }
    }
    let hint = did_you_mean(wanted, header.iter().map(String::as_str));
    let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
    let names = header.join(", ");
    format!("there is no column `{wanted}` of times; there are: {}{hint}", shortened(&names))
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

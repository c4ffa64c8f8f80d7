//! `--input DATA.csv`: recorded inputs of a model from the columns of a table.
//!
//! The table has a header with a column `time` (s) and columns named as inputs of the model.  Which inputs are recorded is decided at
//! translation, so the names are asked for first; the samples are handed to every system that is to run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use hyd_payload::Experiment;
use hyd_source::did_you_mean;
use hyd_system::{DaeSystem, Gap, Hold, InputError, InputSite, Series, SeriesError, fill_gaps};

use crate::{Failure, read_text};

/// Name of the column of the times.
const TIME: &str = "time";
/// A run may pass the ends of a table by this part of the length of the table, which is rounding.
const ROUNDING: f64 = 1e-9;
/// Part of a table that may be left over without a word.
const LEFT_OVER: f64 = 0.02;
/// Names that a message lists.
const MOST_NAMES: usize = 8;

/// Recorded inputs on the command line.
#[derive(Args, Clone, Debug, Default)]
pub struct InputArguments {
    /// Table of recorded inputs: a column `time` in s, and columns named as inputs of the model
    #[arg(long, value_name = "DATA.csv")]
    pub input: Option<PathBuf>,
    /// What inputs do between samples: linear, zero (the last value is kept) or smooth (a cubic spline), for all or one of them
    /// (repeatable) [default: linear]
    #[arg(long, value_name = "[NAME=]HOLD", requires = "input")]
    pub hold: Vec<String>,
}

/// A table of recorded inputs.
#[derive(Clone, Debug)]
pub struct InputTable {
    path: PathBuf,
    times: Vec<f64>,
    lines: Vec<u64>,
    columns: Vec<(String, Vec<f64>)>,
    holds: Vec<(Option<String>, Hold)>,
}

/// Lets an input, by its position, follow samples.
pub type SetInput<'a> = dyn FnMut(usize, &Arc<Series>) -> Result<(), InputError> + 'a;

/// Recorded inputs ready to be handed to systems.
#[derive(Clone, Debug, Default)]
pub struct Recorded {
    series: Vec<Arc<Series>>,
    /// What the user should know of the table.
    pub warnings: Vec<String>,
}

impl InputArguments {
    /// Reads the table, if there is one.
    ///
    /// # Errors
    /// A sentence with file and line.
    pub fn read(&self) -> Result<Option<InputTable>, Failure> {
        let Some(path) = &self.input else { return Ok(None) };
        let holds = holds(&self.hold)?;
        let text = read_text(path).map_err(|error| Failure::Fault(error.to_string()))?;
        InputTable::parse(path, &text, holds).map(Some).map_err(Failure::Fault)
    }
}

/// What inputs do between samples, as the command line has it.
fn holds(texts: &[String]) -> Result<Vec<(Option<String>, Hold)>, Failure> {
    let one = |text: &String| {
        let (name, hold) = text.rsplit_once('=').map_or((None, text.as_str()), |(name, hold)| (Some(name), hold));
        let unknown = || Failure::Usage(format!("--hold: `{hold}` is not linear, zero or smooth"));
        Ok((name.map(str::to_string), Hold::of(hold).ok_or_else(unknown)?))
    };
    texts.iter().map(one).collect()
}

impl InputTable {
    /// A table that stands in no file, which messages call `name`; lines are counted from 1.  Times in s; a sample that is missing is NaN.
    ///
    /// # Errors
    /// A sentence: columns of unequal length, times that do not ascend, a hold that is not known.
    pub fn of_columns(
        name: &str,
        times: Vec<f64>,
        columns: Vec<(String, Vec<f64>)>,
        hold: &[String],
    ) -> Result<Self, Failure> {
        let wrong = |sentence: String| Failure::Fault(format!("`{name}`: {sentence}"));
        if times.len() < 2 {
            return Err(wrong("an input needs two samples at least".to_string()));
        }
        if let Some((column, values)) = columns.iter().find(|(_, values)| values.len() != times.len()) {
            let (own, all) = (values.len(), times.len());
            return Err(wrong(format!("the column `{column}` has {own} samples, and `{TIME}` has {all}")));
        }
        let ascends = |pair: &[f64]| pair[0].is_finite() && pair[1].is_finite() && pair[0] < pair[1];
        if let Some(k) = times.windows(2).position(|pair| !ascends(pair)) {
            let (first, second) = (times[k], times[k + 1]);
            return Err(wrong(format!(
                "line {}: the time {second} s does not come after {first} s; times must ascend",
                k + 2
            )));
        }
        let lines = (1..=times.len() as u64).collect();
        Ok(Self { path: PathBuf::from(name), times, lines, columns, holds: holds(hold)? })
    }

    fn parse(path: &Path, text: &str, holds: Vec<(Option<String>, Hold)>) -> Result<Self, String> {
        let wrong = |sentence: String| format!("`{}`: {sentence}", path.display());
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| wrong(error.to_string()))?.clone();
        let mut seen = BTreeSet::new();
        if let Some(name) = header.iter().find(|name| !seen.insert(name.to_string())) {
            return Err(wrong(format!("the column `{name}` stands twice in the header")));
        }
        let time = header.iter().position(|name| name == TIME).ok_or_else(|| {
            let separated = header.len() == 1 && (text.lines().next().unwrap_or("").contains([';', '\t']));
            let advice = if separated { "; fields are separated by commas" } else { "" };
            wrong(format!("there is no column `{TIME}`{advice}"))
        })?;
        let (mut times, mut lines) = (Vec::new(), Vec::new());
        let mut columns: Vec<(String, Vec<f64>)> = header.iter().map(|name| (name.to_string(), Vec::new())).collect();
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).map_err(|error| wrong(error.to_string()))? {
            let line = record.position().map_or(0, csv::Position::line);
            if record.len() != header.len() {
                return Err(wrong(format!("line {line} has {} fields, and the header {}", record.len(), header.len())));
            }
            for ((field, (name, values)), k) in record.iter().zip(&mut columns).zip(0..) {
                let value = if k == time { field.parse().ok() } else { number(field) };
                // What stands in columns that no input reads is nobody's business yet.
                let value = if k == time { value.filter(|t| t.is_finite()) } else { value.or(Some(f64::INFINITY)) };
                values.push(
                    value.ok_or_else(|| wrong(format!("line {line}, column `{name}`: `{field}` is not a time")))?,
                );
            }
            let t = columns[time].1[columns[time].1.len() - 1];
            if let Some(&last) = times.last()
                && t <= last
            {
                return Err(wrong(format!(
                    "line {line}: the time {t} s does not come after {last} s; times must ascend"
                )));
            }
            times.push(t);
            lines.push(line);
        }
        if times.len() < 2 {
            return Err(wrong("an input needs two samples at least".to_string()));
        }
        columns.remove(time);
        Ok(Self { path: path.to_path_buf(), times, lines, columns, holds })
    }

    /// The table as a file that [`InputTable::unpack`] reads, and what its inputs do between samples.
    ///
    /// # Errors
    /// A sentence: a name of a column that no file can hold.
    pub fn pack(&self) -> Result<(Vec<u8>, Vec<String>), Failure> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let wrong = |error: &dyn std::fmt::Display| Failure::Fault(format!("`{}`: {error}", self.path.display()));
        let names = std::iter::once(TIME).chain(self.columns.iter().map(|(name, _)| name.as_str()));
        writer.write_record(names).map_err(|error| wrong(&error))?;
        for (k, time) in self.times.iter().enumerate() {
            // The shortest digits that are read as the same number; what is missing is empty, what is not a number stays none.
            let cell = |value: f64| match value {
                _ if value.is_nan() => String::new(),
                _ if value.is_infinite() => "x".to_string(),
                _ => value.to_string(),
            };
            let values = self.columns.iter().map(|(_, values)| cell(values[k]));
            writer.write_record(std::iter::once(time.to_string()).chain(values)).map_err(|error| wrong(&error))?;
        }
        let bytes = writer.into_inner().map_err(|error| wrong(&error))?;
        let hold = |(name, hold): &(Option<String>, Hold)| match name {
            Some(name) => format!("{name}={}", hold.name()),
            None => hold.name().to_string(),
        };
        Ok((bytes, self.holds.iter().map(hold).collect()))
    }

    /// Reads a table that [`InputTable::pack`] has made; `path`: what messages call it.
    ///
    /// # Errors
    /// A sentence: it is not one.
    pub fn unpack(path: &Path, bytes: &[u8], hold: &[String]) -> Result<Self, Failure> {
        let text = String::from_utf8_lossy(bytes);
        Self::parse(path, &text, holds(hold)?).map_err(Failure::Fault)
    }

    /// Names of the columns but that of the times.
    pub fn names(&self) -> Vec<String> {
        self.columns.iter().map(|(name, _)| name.clone()).collect()
    }

    /// First and last time (s).
    pub fn span(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// When a model runs with this table: from its begin, if that is after 0, to its end, if the model does not say otherwise.  `start`: when
    /// it begins if not as the model says (s).
    pub fn experiment(table: Option<&Self>, experiment: &Experiment, start: Option<f64>) -> Experiment {
        let begin = table.map(|table| table.span().0).filter(|begin| *begin > 0.0);
        let start = start.or(experiment.start).or(begin).unwrap_or(0.0);
        let end = table.map(|table| table.span().1).filter(|end| *end > start);
        Experiment { start: experiment.start.or(begin), stop: experiment.stop.or(end), ..*experiment }
    }

    /// What is said where the model ends a run, and nobody else, before the table does.
    pub fn left_over(&self, stated: Option<f64>, stop: f64) -> Option<String> {
        let (first, last) = self.span();
        let is_cut = stated.is_none() && last - stop > LEFT_OVER * (last - first);
        is_cut.then(|| {
            let file = self.path.display();
            format!("`{file}`: it goes on to {last} s, and the model ends the run at {stop} s; `--stop {last}` runs all of it")
        })
    }

    /// A number that is another one, all but surely, when a sample is (Fowler, Noll, Vo: FNV-1a).
    pub fn fingerprint(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325u64;
        let mut add = |byte: u8| hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        for (name, values) in
            self.columns.iter().map(|(name, values)| (name.as_str(), values)).chain([(TIME, &self.times)])
        {
            name.bytes().for_each(&mut add);
            values.iter().flat_map(|value| value.to_bits().to_le_bytes()).for_each(&mut add);
        }
        for (name, hold) in &self.holds {
            name.iter().flat_map(|name| name.bytes()).chain(hold.name().bytes()).for_each(&mut add);
        }
        hash
    }

    /// The samples of a system's recorded inputs.  `known`: names of all inputs of the model that can be recorded.
    ///
    /// # Errors
    /// A sentence: no column is an input, an input has no column, samples that are missing, a table that does not cover the run.
    pub fn recorded(
        &self,
        system: &mut dyn DaeSystem,
        span: (f64, f64),
        known: &[String],
    ) -> Result<Recorded, Failure> {
        let sites = system.structure().inputs.clone();
        self.recorded_by(&sites, &mut |input, series| system.set_input(input, series), span, known)
    }

    /// The same for inputs of what is not such a system.
    ///
    /// # Errors
    /// As [`InputTable::recorded`].
    pub fn recorded_by(
        &self,
        sites: &[InputSite],
        set_input: &mut SetInput<'_>,
        (start, stop): (f64, f64),
        known: &[String],
    ) -> Result<Recorded, Failure> {
        let fault = |sentence: String| Failure::Fault(format!("`{}`: {sentence}", self.path.display()));
        let listed = |names: &[String]| match names {
            [] => "it has no inputs of type Real at its top".to_string(),
            names => format!("its inputs: {}", shortened(names)),
        };
        if sites.is_empty() {
            return Err(fault(format!("none of its columns is an input of the model; {}", listed(known))));
        }
        let mut recorded = Recorded::default();
        let unused: Vec<String> =
            self.names().into_iter().filter(|name| sites.iter().all(|site| *site.name != **name)).collect();
        if !unused.is_empty() {
            let (columns, are) = match unused.len() {
                1 => ("column", "is not an input of the model and is not used"),
                _ => ("columns", "are not inputs of the model and are not used"),
            };
            let near = unused.iter().find_map(|name| did_you_mean(name, known.iter().map(String::as_str)));
            let near = near.map_or_else(String::new, |near| format!("; {near}"));
            recorded.warnings.push(format!(
                "`{}`: the {columns} {} {are}{near}",
                self.path.display(),
                shortened(&unused)
            ));
        }
        for (name, _) in &self.holds {
            if let Some(name) = name.as_ref().filter(|name| sites.iter().all(|site| *site.name != ***name)) {
                return Err(Failure::Usage(format!("--hold: `{name}` is not a recorded input of the model")));
            }
        }
        let (first, last) = self.span();
        let rounding = ROUNDING * (last - first);
        if start < first - rounding {
            return Err(fault(format!("it begins at {first} s, and the run at {start} s")));
        }
        if stop > last + rounding {
            let line = self.lines[self.lines.len() - 1];
            return Err(fault(format!(
                "it ends at {last} s (line {line}), and the run at {stop} s; `--stop {last}` ends the run there"
            )));
        }
        for (k, site) in sites.iter().enumerate() {
            let column = self.columns.iter().find(|(name, _)| **name == *site.name);
            let (name, values) =
                column.ok_or_else(|| fault(format!("there is no column for the input `{}`", site.name)))?;
            let (series, gaps) = self.series(name, values).map_err(fault)?;
            if let Some(&gap) = gaps.first() {
                let (count, line) = (gaps.len(), self.lines[gap]);
                let what = if count == 1 { "a sample is".to_string() } else { format!("{count} samples are") };
                recorded.warnings.push(format!(
                    "`{}`: line {line}, column `{name}`: {what} missing and filled from the neighbours",
                    self.path.display()
                ));
            }
            set_input(k, &series).map_err(|error| fault(refused(name, error)))?;
            recorded.series.push(series);
        }
        Ok(recorded)
    }

    fn series(&self, name: &str, values: &[f64]) -> Result<(Arc<Series>, Vec<usize>), String> {
        let own = self.holds.iter().rev().find(|(of, _)| of.as_deref() == Some(name));
        let all = self.holds.iter().rev().find(|(of, _)| of.is_none());
        let hold = own.or(all).map_or(Hold::Linear, |(_, hold)| *hold);
        if let Some(k) = values.iter().position(|value| value.is_infinite()) {
            return Err(format!("line {}, column `{name}` holds no number", self.lines[k]));
        }
        let mut values = values.to_vec();
        let gaps = fill_gaps(&self.times, &mut values, hold).map_err(|gap| match gap {
            Gap::First => format!("line {}, column `{name}`: the first sample is missing", self.lines[0]),
            Gap::Last => format!("line {}, column `{name}`: the last sample is missing", self.lines[self.lines.len() - 1]),
            Gap::Wide(k, count) => format!(
                "line {}, column `{name}`: {count} samples in a row are missing; single ones are filled from the neighbours",
                self.lines[k]
            ),
        })?;
        let series = Series::new(self.times.clone(), values, hold).map_err(|error| match error {
            SeriesError::NotFinite(k) | SeriesError::Order(k) => format!("line {}, column `{name}`", self.lines[k]),
            _ => format!("column `{name}` is not a series of samples"),
        })?;
        Ok((Arc::new(series), gaps))
    }
}

impl Recorded {
    /// Hands the samples to a further system of the same model.
    ///
    /// # Errors
    /// A sentence, for a system with other inputs.
    pub fn hand_over(&self, system: &mut dyn DaeSystem) -> Result<(), String> {
        for (k, series) in self.series.iter().enumerate() {
            system.set_input(k, series).map_err(|error| refused(&k.to_string(), error))?;
        }
        Ok(())
    }
}

fn refused(name: &str, error: InputError) -> String {
    match error {
        InputError::Unknown => format!("the model has no recorded input `{name}`"),
        InputError::NoDerivative => format!(
            "the equations need the derivative of the input `{name}`, and a value that is held (zero) has none; hold it linear or smooth"
        ),
    }
}

/// A field as a number, NaN where it is missing; none for other texts.  Results write Booleans in words.
fn number(field: &str) -> Option<f64> {
    match field {
        "" | "-" | "NA" | "null" => Some(f64::NAN),
        "true" | "True" => Some(1.0),
        "false" | "False" => Some(0.0),
        _ => field.parse().ok(),
    }
}

fn shortened(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > MOST_NAMES { ", ..." } else { "" };
    format!("{}{more}", shown.join(", "))
}

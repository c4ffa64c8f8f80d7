//! The set: what a lab knows of its bench and its shots, and the shots' tables.
//!
//! The JSON file states noise, quantisation, tolerances and per shot a table and the recorded conditions; whatever else is a number
//! is a condition.  Tables are CSV with a header; empty fields and NaN are gaps.  Columns that the study does not know are
//! left alone; channels that the table does not have are missing.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use crate::{Fault, Study};

/// A set of shots.
#[derive(Clone, Default, Debug)]
pub struct Bench {
    /// Its name.
    pub name: String,
    /// Which model the residual is to be explained against.
    pub base_model: Option<String>,
    /// Standard deviation of the noise by channel.
    pub noise: BTreeMap<String, f64>,
    /// Step of the numbers by channel.
    pub quantisation: BTreeMap<String, f64>,
    /// Standard deviation of the offset by channel.
    pub offset: BTreeMap<String, f64>,
    /// Standard deviation of the gains.
    pub gain: Option<f64>,
    /// Relative standard deviation of parameters, by the lab's names.
    pub tolerance: BTreeMap<String, f64>,
    /// Length of the record before the trigger (s).
    pub pre_trigger: Option<f64>,
    /// The shots in their order.
    pub shots: Vec<Shot>,
}

/// One shot.
#[derive(Clone, Default, Debug)]
pub struct Shot {
    /// Number given by the lab, or its position from 1.
    pub number: usize,
    /// File of the table.
    pub file: String,
    /// Recorded conditions.
    pub conditions: BTreeMap<String, f64>,
    /// Times from the trigger (s), ascending.
    pub times: Vec<f64>,
    /// Values by channel, in the units of the table; NaN where there is none.
    pub values: BTreeMap<String, Vec<f64>>,
}

#[derive(Deserialize)]
struct Stated {
    set: Option<String>,
    base_model: Option<String>,
    pre_trigger_s: Option<f64>,
    #[serde(default)]
    noise_std: BTreeMap<String, f64>,
    #[serde(default)]
    quantisation: BTreeMap<String, f64>,
    #[serde(default)]
    sensor_offset_1sigma: BTreeMap<String, f64>,
    sensor_gain_1sigma: Option<f64>,
    #[serde(default)]
    parameter_tolerance_1sigma: BTreeMap<String, f64>,
    experiments: Vec<BTreeMap<String, Value>>,
}

impl Bench {
    /// Reads a set; `read` gives the text of a file that stands beside it.
    ///
    /// # Errors
    /// A sentence that names the file, and the line or column at fault.
    pub fn parse(
        name: &Path,
        text: &str,
        study: &Study,
        read: &mut dyn FnMut(&str) -> Result<String, Fault>,
    ) -> Result<Self, Fault> {
        let shown = name.display();
        let stated: Stated = serde_json::from_str(text).map_err(|error| Fault::new(format!("`{shown}`: {error}")))?;
        let stem = name.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let mut bench = Self {
            name: stated.set.unwrap_or(stem),
            base_model: stated.base_model,
            noise: stated.noise_std,
            quantisation: stated.quantisation,
            offset: stated.sensor_offset_1sigma,
            gain: stated.sensor_gain_1sigma,
            tolerance: stated.parameter_tolerance_1sigma,
            pre_trigger: stated.pre_trigger_s,
            shots: Vec::new(),
        };
        for map in [&bench.noise, &bench.quantisation, &bench.offset, &bench.tolerance] {
            if let Some((key, value)) = map.iter().find(|(_, value)| !(value.is_finite() && **value >= 0.0)) {
                return Err(Fault::new(format!(
                    "`{shown}`: the standard deviation {value} of `{key}` is no positive number"
                )));
            }
        }
        for (k, experiment) in stated.experiments.iter().enumerate() {
            let Some(file) = experiment.get("file").and_then(Value::as_str) else {
                return Err(Fault::new(format!("`{shown}`: experiment {} names no file", k + 1)));
            };
            let conditions: BTreeMap<String, f64> =
                experiment.iter().filter_map(|(key, value)| Some((key.clone(), value.as_f64()?))).collect();
            let number = conditions.get("shot").map_or(k + 1, |&number| number as usize);
            let (times, values) = table(file, &read(file)?, study)?;
            bench.shots.push(Shot { number, file: file.to_string(), conditions, times, values });
        }
        if bench.shots.is_empty() {
            return Err(Fault::new(format!("`{shown}` holds no experiments")));
        }
        Ok(bench)
    }
}

/// Times and channels of one table.
type Columns = (Vec<f64>, BTreeMap<String, Vec<f64>>);

fn table(file: &str, text: &str, study: &Study) -> Result<Columns, Fault> {
    let wrong = |sentence: String| Fault::new(format!("`{file}`: {sentence}"));
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(false).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| wrong(error.to_string()))?.clone();
    let column = header.iter().position(|name| name == study.shots.time);
    let Some(time) = column else {
        let found: Vec<&str> = header.iter().collect();
        return Err(wrong(format!(
            "there is no column `{}` of times; there are: {}",
            study.shots.time,
            found.join(", ")
        )));
    };
    let known: Vec<(usize, String)> = header
        .iter()
        .enumerate()
        .filter(|(_, name)| study.channels.contains_key(*name))
        .map(|(k, name)| (k, name.to_string()))
        .collect();
    if known.is_empty() {
        return Err(wrong("none of its columns is a channel of the study".to_string()));
    }
    let mut times: Vec<f64> = Vec::new();
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); known.len()];
    for (row, record) in reader.records().enumerate() {
        let record = record.map_err(|error| wrong(error.to_string()))?;
        let number = |field: &str| -> Result<f64, Fault> {
            match field {
                "" | "-" | "NA" | "null" => Ok(f64::NAN),
                text => text.parse().map_err(|_| wrong(format!("line {}: `{text}` is no number", row + 2))),
            }
        };
        let t = number(&record[time])? * study.shots.time_scale;
        if !t.is_finite() {
            return Err(wrong(format!("line {}: a time is missing", row + 2)));
        }
        if let Some(&last) = times.last()
            && t <= last
        {
            return Err(wrong(format!(
                "line {}: the time {t} s does not come after {last} s; times must ascend",
                row + 2
            )));
        }
        times.push(t);
        for ((k, _), values) in known.iter().zip(&mut values) {
            let value = number(&record[*k])?;
            values.push(if value.is_finite() { value } else { f64::NAN });
        }
    }
    if times.len() < 20 {
        return Err(wrong(format!("{} rows are too few", times.len())));
    }
    let values = known.into_iter().map(|(_, name)| name).zip(values);
    // A channel of gaps alone is missing.
    Ok((times, values.filter(|(_, values)| values.iter().any(|value| !value.is_nan())).collect()))
}

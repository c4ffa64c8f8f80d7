//! The set: what a lab knows of its bench and its shots, and the shots' tables.
//!
//! The JSON file states noise, quantisation, tolerances and per shot a table and the recorded conditions; whatever else is a number
//! is a condition.  Tables (`shot_table`) are CSV with a header.  What a set states and nothing uses is said (`warnings`), and so are
//! channels that no table has.

pub(crate) mod averaged;
pub(crate) mod clock;
pub(crate) mod input_table;
pub(crate) mod noise;
pub(crate) mod operating_points;
pub(crate) mod recorded;
pub(crate) mod set_check;
pub(crate) mod sheet;
pub(crate) mod shot_table;
pub(crate) mod windows;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use hyd_compiler::did_you_mean;
use hyd_system::Series;
use serde::Deserialize;
use serde_json::Value;

use crate::bench::averaged::average;
use crate::bench::set_check::{Once, check_keys, check_numbers, line_of, same_number, unused};
use crate::bench::shot_table::{FEWEST, ShotTable, read_table};
use crate::{Fault, Study};

/// Longest text of a set (bytes): reading it takes many times as much memory.
const LONGEST: usize = 4 << 20;
/// Largest number of a shot: beyond it not all integers are told apart.
const MOST_NUMBER: f64 = 9_007_199_254_740_992.0;

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
    /// Rows of the tables that were averaged to one, if that was done.
    pub averaged: usize,
    /// What the user should know of it.
    pub warnings: Vec<String>,
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
    /// Recorded inputs of the model, by their names and in its units.
    pub inputs: BTreeMap<String, Arc<Series>>,
    /// True for a part of a table.
    pub is_window: bool,
}

#[derive(Deserialize)]
struct Stated {
    set: Option<String>,
    base_model: Option<String>,
    pre_trigger_s: Option<f64>,
    #[serde(default)]
    noise_std: Once<f64>,
    #[serde(default)]
    quantisation: Once<f64>,
    #[serde(default)]
    sensor_offset_1sigma: Once<f64>,
    sensor_gain_1sigma: Option<f64>,
    #[serde(default)]
    parameter_tolerance_1sigma: Once<f64>,
    experiments: Vec<Once<Value>>,
}

impl Bench {
    /// Keys of a set.
    pub const KEYS: [&str; 9] = [
        "set",
        "base_model",
        "pre_trigger_s",
        "noise_std",
        "quantisation",
        "sensor_offset_1sigma",
        "sensor_gain_1sigma",
        "parameter_tolerance_1sigma",
        "experiments",
    ];
    /// What holds for all shots, without any.
    pub(crate) fn without_shots(&self) -> Self {
        Self {
            name: self.name.clone(),
            base_model: self.base_model.clone(),
            noise: self.noise.clone(),
            quantisation: self.quantisation.clone(),
            offset: self.offset.clone(),
            gain: self.gain,
            tolerance: self.tolerance.clone(),
            pre_trigger: self.pre_trigger,
            shots: Vec::new(),
            averaged: self.averaged,
            warnings: Vec::new(),
        }
    }

    /// Keys that tell people of the bench and decide nothing.
    pub const REMARKS: [&str; 4] = ["channels", "sampling_Hz", "remarks", "imported"];

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
        if text.len() > LONGEST {
            return Err(Fault::new(format!("`{shown}`: it is longer than {} MB, as no set is", LONGEST >> 20)));
        }
        let stated: Stated = serde_json::from_str(text).map_err(|error| {
            // A key that is missing may be there under another name, which says more.
            let fault = check_keys(text).err().unwrap_or_else(|| Fault::new(error.to_string()));
            Fault::new(format!("`{shown}`: {fault}"))
        })?;
        let stem = name.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let mut warnings = check_keys(text).map_err(|fault| Fault::new(format!("`{shown}`: {fault}")))?;
        let mut bench = Self {
            name: stated.set.unwrap_or(stem),
            base_model: stated.base_model,
            noise: stated.noise_std.0,
            quantisation: stated.quantisation.0,
            offset: stated.sensor_offset_1sigma.0,
            gain: stated.sensor_gain_1sigma,
            tolerance: stated.parameter_tolerance_1sigma.0,
            pre_trigger: stated.pre_trigger_s,
            ..Self::default()
        };
        check_numbers(&bench, text).map_err(|fault| Fault::new(format!("`{shown}`: {fault}")))?;
        let mut columns = BTreeSet::new();
        for (k, Once(experiment)) in stated.experiments.iter().enumerate() {
            let wrong = |sentence: String| Fault::new(format!("`{shown}`: shot {} in its list{sentence}", k + 1));
            let Some(file) = experiment.get("file").and_then(Value::as_str) else {
                let hint = experiment
                    .keys()
                    .find_map(|key| did_you_mean(key, ["file"]).map(|hint| format!("; `{key}`: {hint}")));
                return Err(wrong(format!(" names no file{}", hint.unwrap_or_default())));
            };
            let is_number = |value: &Value| value.as_str().is_some_and(|text| text.trim().parse::<f64>().is_ok());
            if let Some((key, value)) = experiment.iter().find(|(_, value)| is_number(value)) {
                return Err(wrong(format!(": `{key}` is the text {value}; a condition is a number without quotes")));
            }
            let conditions: BTreeMap<String, f64> =
                experiment.iter().filter_map(|(key, value)| Some((key.clone(), value.as_f64()?))).collect();
            let number = match conditions.get("shot") {
                Some(&number) if number >= 0.0 && number.fract() == 0.0 && number <= MOST_NUMBER => number as usize,
                Some(number) => return Err(wrong(format!(": `shot` is {number}, and must be an integer"))),
                None => k + 1,
            };
            let named = |fault: Fault| {
                let quoted = Value::from(file).to_string();
                let line = text.find(&quoted).map(|at| text[..at].matches('\n').count() + 1);
                let line = line.map_or_else(String::new, |line| format!(", line {line}"));
                Fault { sentence: format!("{} (shot {} of `{shown}`{line})", fault.sentence, k + 1), ..fault }
            };
            let table = read_table(file, &read(file).map_err(named)?, study)?;
            let ShotTable { times, values, inputs, header, warnings: own } = table;
            warnings.extend(own);
            columns.extend(header);
            bench.shots.push(Shot {
                number,
                file: file.to_string(),
                conditions,
                times,
                values,
                inputs,
                is_window: false,
            });
        }
        average(&mut bench, study)?;
        let tables = std::mem::take(&mut bench.shots);
        for shot in tables {
            let count = windows::count(study, stated.experiments.len(), shot.times.len());
            if shot.times.len() / count < FEWEST {
                let (rows, file) = (shot.times.len(), &shot.file);
                return Err(Fault::new(format!(
                    "{}`{file}` has {rows} rows, too few for {count} windows of at least {FEWEST}",
                    study.place(&["shots", "windows"])
                )));
            }
            let next = bench.shots.len() + 1;
            bench.shots.extend(windows::cut(shot, count, next));
        }
        if bench.shots.is_empty() {
            let line = line_of(text, &["experiments"]).map_or_else(String::new, |line| format!("line {line}: "));
            return Err(Fault::new(format!("`{shown}`: {line}it holds no shots")));
        }
        warnings.extend(unused(&bench, study, text, &columns));
        warnings.extend(same_number(&bench));
        for shot in &mut bench.shots {
            for (name, value) in windows::beginnings(shot, study) {
                // What the set says goes first.
                shot.conditions.entry(name).or_insert(value);
            }
        }
        bench.warnings = warnings.into_iter().map(|sentence| format!("`{shown}`: {sentence}")).collect();
        Ok(bench)
    }
}

//! The study: which model, which channel is which variable, which condition is which parameter, what may be off.
//!
//! A TOML file with unknown keys refused.  It says nothing of one set of measurements: what a lab knows of its bench comes with
//! the set (`bench`), so that one study serves all benches of a machine.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::Fault;

/// A study.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Title for reports.
    #[serde(default)]
    pub title: String,
    /// The model's file, relative to the study.
    pub file: String,
    /// Class by the set's `base_model`; `default` where a set names none.
    pub models: BTreeMap<String, String>,
    /// Channels by their column in the shots' tables.
    pub channels: BTreeMap<String, Channel>,
    /// Parameters of the model that the conditions of a shot decide: formula by full name.
    #[serde(default)]
    pub conditions: BTreeMap<String, String>,
    /// What may be off, by the name under which the set states its tolerance.
    #[serde(default)]
    pub nuisances: BTreeMap<String, Nuisance>,
    /// The rest.
    #[serde(default)]
    pub shots: Shots,
    /// Numerics of the runs.
    #[serde(default)]
    pub run: Run,
    /// Full names of effects that are not considered, or of packages of them.
    #[serde(default)]
    pub without: Vec<String>,
}

/// A measured channel.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// The expression of the model that it shows.
    pub variable: String,
    /// Units of the table per unit of the model: 1e3 for a column in mm.
    #[serde(default = "one")]
    pub scale: f64,
    /// Unit of the column, for reports.
    #[serde(default)]
    pub unit: String,
    /// Words for reports.
    #[serde(default)]
    pub words: String,
    /// Standard deviation of the noise, where the set states none (units of the table).
    pub noise: Option<f64>,
    /// Step of the numbers in the table, where the set states none.
    pub quantisation: Option<f64>,
    /// Standard deviation of the offset, where the set states none.
    pub offset: Option<f64>,
    /// Standard deviation of the gain, where the set states none.
    pub gain: Option<f64>,
}

/// A parameter that may be off.
#[derive(Deserialize, Clone, Debug)]
#[serde(untagged)]
pub enum Nuisance {
    /// Its full name; the set states the relative tolerance.
    Parameter(String),
    /// All of it.
    Stated(StatedNuisance),
}

/// A parameter that may be off, with its prior.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields)]
pub struct StatedNuisance {
    /// Its full name.
    pub parameter: String,
    /// Relative standard deviation, where the set states none.
    pub relative: Option<f64>,
    /// Standard deviation in the parameter's unit, where the set states none.
    pub absolute: Option<f64>,
    /// Another value in every shot.
    #[serde(default)]
    pub per_shot: bool,
}

/// What holds for all shots.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct Shots {
    /// Column of the times.
    pub time: String,
    /// Seconds per unit of that column.
    pub time_scale: f64,
    /// Standard deviation of the trigger, shot by shot (s).
    pub trigger_jitter: f64,
    /// Conditions (parameters of the model) that are times of the trigger and move with it; where none is named the
    /// whole record is shifted, with curves that are interpolated between the output points.
    pub trigger_moves: Vec<String>,
    /// Tolerance of time with which fast changes are compared, in sample periods.
    pub time_tolerance: f64,
    /// The channel whose course divides a shot into phases for reports.
    pub phases_of: Option<String>,
    /// Numbers of the shots held out; by default they are chosen by operating point.
    pub hold_out: Option<Vec<usize>>,
    /// Parts of the shots that are left out.
    pub masks: Vec<Mask>,
}

impl Default for Shots {
    fn default() -> Self {
        Self {
            time: "time_s".into(),
            time_scale: 1.0,
            trigger_jitter: 0.0,
            trigger_moves: Vec::new(),
            time_tolerance: 0.1,
            phases_of: None,
            hold_out: None,
            masks: Vec::new(),
        }
    }
}

/// A part of the shots that is left out: between two times, or from the return of a channel on.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields)]
pub struct Mask {
    /// Channels that are masked; all where none is named.
    #[serde(default)]
    pub channels: Vec<String>,
    /// From this time on (s).
    pub from: Option<f64>,
    /// Until this time (s).
    pub to: Option<f64>,
    /// Around these times, formulas of the conditions such as `trigger_time_s + pulse_s`: where a channel jumps nobody
    /// knows on which side of the jump a sample was taken.
    #[serde(default)]
    pub around: Vec<String>,
    /// As far as this to both sides (s).
    #[serde(default)]
    pub within: f64,
    /// From the time on at which this channel has been up and returns below `below` of its largest value.
    pub after_return_of: Option<String>,
    /// That share.
    #[serde(default = "twentieth")]
    pub below: f64,
}

/// Numerics.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct Run {
    /// Relative tolerance of the runs.
    pub tolerance: f64,
    /// When runs begin (s), which is when the model has its start values; where it is not given at 0, or at the first sample if
    /// that is earlier or later by more than the length of the record.
    pub start: Option<f64>,
}

impl Default for Run {
    fn default() -> Self {
        Self { tolerance: 1e-6, start: None }
    }
}

fn one() -> f64 {
    1.0
}

fn twentieth() -> f64 {
    0.05
}

impl Study {
    /// Reads a study.
    ///
    /// # Errors
    /// A sentence with the line at fault.
    pub fn parse(text: &str) -> Result<Self, Fault> {
        let study: Study = toml::from_str(text).map_err(|error| Fault::new(error.to_string().trim().to_string()))?;
        for (name, channel) in &study.channels {
            if !(channel.scale.is_finite() && channel.scale != 0.0) {
                return Err(Fault::new(format!(
                    "channel `{name}`: the scale {} must be a number but zero",
                    channel.scale
                )));
            }
        }
        let is_empty = |mask: &Mask| mask.around.is_empty() == (mask.within > 0.0) || !mask.within.is_finite();
        if study.shots.masks.iter().any(is_empty) {
            return Err(Fault::new(
                "a mask with `around` needs `within`, a positive time to both sides (s), and one without has no use for it",
            ));
        }
        if study.channels.is_empty() {
            return Err(Fault::new("the study names no channel"));
        }
        if study.run.start.is_some_and(|start| !start.is_finite()) {
            return Err(Fault::new("the start of runs must be a time (s)"));
        }
        if !(1e-12..=1e-3).contains(&study.run.tolerance) {
            return Err(Fault::new(format!("the tolerance {} must lie between 1e-12 and 1e-3", study.run.tolerance)));
        }
        Ok(study)
    }

    /// The class for a set that names this base model, or none.
    ///
    /// # Errors
    /// When the study has none for it.
    pub fn class(&self, base_model: Option<&str>) -> Result<&str, Fault> {
        let key = base_model.unwrap_or("default");
        let only = (self.models.len() == 1).then(|| self.models.values().next()).flatten();
        let class = self.models.get(key).or(if base_model.is_none() { only } else { None });
        class.map(String::as_str).ok_or_else(|| {
            let known: Vec<&str> = self.models.keys().map(String::as_str).collect();
            Fault::new(format!("the study has no model `{key}`; it has: {}", known.join(", ")))
        })
    }
}

impl Nuisance {
    /// Full name of the parameter.
    pub fn parameter(&self) -> &str {
        match self {
            Nuisance::Parameter(name) => name,
            Nuisance::Stated(stated) => &stated.parameter,
        }
    }
}

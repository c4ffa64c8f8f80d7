//! The study: which model, which channel is which variable, which condition is which parameter, what may be off.
//!
//! A TOML file with unknown keys refused.  It says nothing of one set of measurements: what a lab knows of its bench comes with
//! the set (`bench`), so that one study serves all benches of a machine.

pub(crate) mod bench_limits;
pub(crate) mod formula;
pub(crate) mod initial;
pub(crate) mod study_check;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use hyd_system::Hold;
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use crate::Fault;
use crate::study::bench_limits::BenchLimits;
use crate::study::formula::all_written;
use crate::study::initial::Initial;
use crate::study::study_check::{check, line, unreadable};

/// Longest text of a study (bytes): reading it takes fifty times as much memory.
const LONGEST: usize = 4 << 20;

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
    /// Inputs of the model that follow columns of the shots' tables, by their full names.
    #[serde(default)]
    pub inputs: BTreeMap<String, Input>,
    /// States at the beginning of shots, by their full names.
    #[serde(default)]
    pub initial: BTreeMap<String, Initial>,
    /// Parameters of the model that the conditions of a shot decide: formula by full name.
    #[serde(default, deserialize_with = "all_written")]
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
    /// What the bench can do, for shots that are proposed.
    #[serde(default)]
    pub limits: BenchLimits,
    /// Where all that stands.
    #[serde(skip)]
    pub(crate) text: StudyText,
}

/// The text of a study, for the lines of its values.
#[derive(Clone, Default)]
pub(crate) struct StudyText(Arc<str>);

/// Studies that say the same are the same, whatever is written around it.
impl fmt::Debug for StudyText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("..")
    }
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
    /// Column of its times, where it has one of its own.
    pub time: Option<String>,
    /// Standard deviation of the noise, where the set states none (units of the table).
    pub noise: Option<f64>,
    /// Step of the numbers in the table, where the set states none.
    pub quantisation: Option<f64>,
    /// Standard deviation of the offset, where the set states none.
    pub offset: Option<f64>,
    /// Standard deviation of the gain, where the set states none.
    pub gain: Option<f64>,
    /// Smallest and largest number that its sensor or recorder shows (units of the table).
    pub range: Option<(f64, f64)>,
}

/// An input that follows a column.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The column.
    pub column: String,
    /// Column of its times, where it has one of its own.
    pub time: Option<String>,
    /// What it does between samples.
    #[serde(default, deserialize_with = "hold")]
    pub hold: Hold,
    /// Unit of the column, for reports.
    #[serde(default)]
    pub unit: String,
    /// Units of the table per unit of the model: 1e3 for a column in mV.
    #[serde(default = "one")]
    pub scale: f64,
    /// What the column shows where the input is zero (units of the table).
    #[serde(default)]
    pub offset: f64,
    /// By how much later the input acts than the column shows it (s).
    #[serde(default)]
    pub lag: f64,
}

fn hold<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Hold, D::Error> {
    let name = String::deserialize(deserializer)?;
    Hold::of(&name).ok_or_else(|| D::Error::custom(format!("`hold` is `{name}`, and must be linear, zero or smooth")))
}

/// A parameter that may be off.
#[derive(Clone, Debug)]
pub enum Nuisance {
    /// Its full name; the set states the relative tolerance.
    Parameter(String),
    /// All of it.
    Stated(StatedNuisance),
}

// By hand, so that a key that does not belong there is reported by its name.
impl<'de> Deserialize<'de> for Nuisance {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Nuisance;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a parameter, or a table with `parameter`")
            }

            fn visit_str<E>(self, name: &str) -> Result<Nuisance, E> {
                Ok(Nuisance::Parameter(name.to_string()))
            }

            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Nuisance, M::Error> {
                StatedNuisance::deserialize(MapAccessDeserializer::new(map)).map(Nuisance::Stated)
            }
        }
        deserializer.deserialize_any(Either)
    }
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
    /// Samples per second of tables without a column of times, the first at 0.
    pub rate: Option<f64>,
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
    /// Windows that every table is cut into; a single record is cut by itself where `[initial]` says how states begin.
    pub windows: Option<usize>,
    /// Rows of the tables that are averaged to one; by default as many as lose nothing that noise does not hide, in tables of thousands.
    pub average: Option<usize>,
    /// Numbers of the shots held out; by default they are chosen by operating point.
    pub hold_out: Option<Vec<usize>>,
    /// Parts of the shots that are left out.
    pub masks: Vec<Mask>,
}

impl Default for Shots {
    fn default() -> Self {
        Self {
            time: "time_s".into(),
            rate: None,
            time_scale: 1.0,
            trigger_jitter: 0.0,
            trigger_moves: Vec::new(),
            time_tolerance: 0.1,
            phases_of: None,
            windows: None,
            average: None,
            hold_out: None,
            masks: Vec::new(),
        }
    }
}

/// A part of the shots that is left out: between two times, or from the return of a channel on.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields)]
pub struct Mask {
    /// Numbers of the shots that are masked; all where none is named.
    #[serde(default)]
    pub shots: Vec<usize>,
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
    pub within: Option<f64>,
    /// From the time on at which this channel has been up and returns below `below` of its largest value.
    pub after_return_of: Option<String>,
    /// That share; a twentieth where it is not given.
    pub below: Option<f64>,
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

impl Study {
    /// Reads a study.
    ///
    /// # Errors
    /// A sentence with the line at fault.
    pub fn parse(text: &str) -> Result<Self, Fault> {
        if text.len() > LONGEST {
            return Err(Fault::new(format!("it has more than {} MB, which is too long for a study", LONGEST >> 20)));
        }
        let mut study: Study = toml::from_str(text).map_err(|error| unreadable(text, &error))?;
        check(&study, text)?;
        study.text = StudyText(text.into());
        Ok(study)
    }

    /// What of it decides what a search finds: not what the bench can do, which decides the next shot.
    pub fn of_search(&self) -> Self {
        Self { limits: BenchLimits::default(), ..self.clone() }
    }

    /// The place of a value, which is found by its keys, as the beginning of a sentence.
    pub fn place(&self, keys: &[&str]) -> String {
        line(&self.text.0, keys).map_or_else(String::new, |line| format!("line {line} of the study: "))
    }

    /// The line of a value, from 1, which is found by its keys; the first where it is not found.
    pub(crate) fn line(&self, keys: &[&str]) -> u32 {
        line(&self.text.0, keys).map_or(1, |line| u32::try_from(line).unwrap_or(u32::MAX))
    }

    /// The same for every row of the tables, none averaged with its neighbours.
    #[must_use]
    pub fn of_every_row(mut self) -> Self {
        self.shots.average = Some(1);
        self
    }

    /// True if the tolerance of time is that of nobody.
    pub(crate) fn states_no_time_tolerance(&self) -> bool {
        line(&self.text.0, &["shots", "time_tolerance"]).is_none()
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

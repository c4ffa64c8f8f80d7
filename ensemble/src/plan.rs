//! A plan: everything that an ensemble is, as a file.
//!
//! TOML with unknown keys refused, so that a slip of the pen does not run a thousand wrong simulations.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use hyd_system::ValueKind;

use crate::members::count;
use crate::{Measure, MeasureError, Members, Variation, VariationError};

/// How drawn values fill their space.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Eq, Debug, Default)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// One value in each of as many equally likely intervals as there are samples (McKay, Beckman, Conover 1979).
    #[default]
    Lhs,
    /// Independent draws.
    Random,
}

/// One varied parameter.
#[derive(Serialize, Deserialize, Clone, PartialEq, Eq, Debug)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// Its full name.
    pub parameter: String,
    /// Its values, as [`Variation::parse`] reads them.
    pub values: String,
}

/// A plan of runs.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Plan {
    /// The model's file, relative to the plan; not needed by an executable, which is its own model.
    pub model: Option<String>,
    /// The class in that file.
    pub class: Option<String>,
    /// Parameters that are the same in all runs: value as text by full name.
    pub set: BTreeMap<String, String>,
    /// Number of draws for each combination of listed values.
    pub samples: Option<usize>,
    /// How draws are made.
    pub method: Method,
    /// Seed of the draws.
    pub seed: u64,
    /// Stop time (s).
    pub stop: Option<f64>,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
    /// Output intervals per run.
    pub intervals: Option<usize>,
    /// Regular expression of the variables that are kept.
    pub variables: Option<String>,
    /// Keeps all rows of every run, not only the last.
    pub rows: bool,
    /// What is measured of every run, as [`Measure::parse`] reads it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measure: Vec<String>,
    /// Varied parameters; the first changes slowest.
    pub vary: Vec<Vary>,
}

/// A plan that makes no sense: what is wrong with it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum PlanError {
    /// It is not TOML of this form.
    Text(String),
    /// The values of a parameter: which, and why.
    Values(String, VariationError),
    /// The values do not fit the type of a parameter: which, and why.
    Kind(String, String),
    /// A parameter is varied twice.
    Twice(String),
    /// Nothing is varied.
    Nothing,
    /// Something that is measured.
    Measure(MeasureError),
    /// Values are drawn, but nobody says how many: the parameter and the text of its values.
    NoSamples(String, String),
    /// Nobody wants a sample.
    NoRuns,
    /// There would be more members than can be counted in a lifetime.
    TooMany,
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PlanError::Text(reason) => write!(f, "{reason}"),
            PlanError::Values(name, reason) => write!(f, "values of `{name}`: {reason}"),
            PlanError::Kind(name, reason) => write!(f, "values of `{name}`: {reason}"),
            PlanError::Measure(error) => write!(f, "{error}"),
            PlanError::Twice(name) => write!(f, "`{name}` is varied twice"),
            PlanError::Nothing => write!(f, "nothing is varied"),
            PlanError::NoSamples(name, values) => {
                write!(f, "`{name}` is drawn from a distribution; say how many samples")?;
                // Two ends are a distribution, but who writes them may have a grid in mind.
                if values.contains(':') { write!(f, ", or write `{values}:COUNT` for a grid") } else { Ok(()) }
            }
            PlanError::NoRuns => write!(f, "0 samples make no run"),
            PlanError::TooMany => write!(f, "these values make more than a thousand million runs"),
        }
    }
}

impl std::error::Error for PlanError {}

impl Plan {
    /// Reads the text of a plan.
    pub fn parse(text: &str) -> Result<Self, PlanError> {
        toml::from_str(text).map_err(|error| PlanError::Text(error.to_string().trim_end().to_string()))
    }

    /// Checks what can be checked without a model.
    ///
    /// # Errors
    /// What makes no sense whatever the model is.
    pub fn check(&self) -> Result<(), PlanError> {
        self.measures()?;
        self.variations().map(|_| ())
    }

    /// What is measured of every run; what is asked for twice is there once.
    ///
    /// # Errors
    /// A text that cannot be read.
    pub fn measures(&self) -> Result<Vec<Measure>, PlanError> {
        let mut measures: Vec<Measure> = Vec::new();
        for text in &self.measure {
            let measure = Measure::parse(text).map_err(PlanError::Measure)?;
            if measures.iter().all(|other| other.text != measure.text) {
                measures.push(measure);
            }
        }
        Ok(measures)
    }

    /// The members that it asks for; `kinds` are the types of the varied parameters.
    ///
    /// # Errors
    /// As [`Plan::check`], and values of another type.
    pub fn members(&self, kinds: &[ValueKind]) -> Result<Members, PlanError> {
        let mut variations = self.variations()?;
        for ((variation, vary), kind) in variations.iter_mut().zip(&self.vary).zip(kinds) {
            let read = variation.for_kind(kind);
            *variation = read.map_err(|reason| PlanError::Kind(vary.parameter.clone(), reason))?;
        }
        Members::new(variations, self.samples.unwrap_or(1), self.method, self.seed).ok_or(PlanError::TooMany)
    }

    fn variations(&self) -> Result<Vec<Variation>, PlanError> {
        let mut variations = Vec::new();
        for (k, vary) in self.vary.iter().enumerate() {
            if self.vary[..k].iter().any(|other| other.parameter == vary.parameter) {
                return Err(PlanError::Twice(vary.parameter.clone()));
            }
            let variation = Variation::parse(&vary.values);
            let variation = variation.map_err(|error| PlanError::Values(vary.parameter.clone(), error))?;
            if variation.is_drawn() && self.samples.is_none() {
                return Err(PlanError::NoSamples(vary.parameter.clone(), vary.values.trim().to_string()));
            }
            variations.push(variation);
        }
        if self.samples == Some(0) {
            return Err(PlanError::NoRuns);
        }
        if variations.is_empty() {
            return Err(PlanError::Nothing);
        }
        count(&variations, self.samples.unwrap_or(1)).ok_or(PlanError::TooMany)?;
        Ok(variations)
    }

    /// The text that [`Plan::parse`] reads as this plan.
    ///
    /// # Errors
    /// A number that TOML cannot hold, such as a seed above 2^63.
    pub fn to_text(&self) -> Result<String, PlanError> {
        toml::to_string(self).map_err(|error| PlanError::Text(error.to_string()))
    }

    /// A text that is the same exactly for plans with the same runs.
    pub fn canonical(&self) -> String {
        serde_json::to_string(self).expect("invariant: plain data with text keys has a JSON form")
    }
}

/// A share of an ensemble: number `index` of `count`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shard {
    /// From 0.
    pub index: usize,
    /// How many there are.
    pub count: usize,
}

impl Shard {
    /// Everything.
    pub const WHOLE: Shard = Shard { index: 0, count: 1 };

    /// Reads `i/n` with 0 <= i < n.
    pub fn parse(text: &str) -> Option<Self> {
        let (index, count) = text.split_once('/')?;
        let shard = Self { index: index.trim().parse().ok()?, count: count.trim().parse().ok()? };
        (shard.index < shard.count).then_some(shard)
    }

    /// Is this chunk part of the share?
    pub fn holds(self, chunk: usize) -> bool {
        chunk % self.count == self.index
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_read_and_slips_are_refused() {
        let plan = Plan::parse("samples = 3\nseed = 7\n[[vary]]\nparameter = \"a.b\"\nvalues = \"1:3\"\n").unwrap();
        assert_eq!((plan.members(&[ValueKind::Real]).unwrap().count(), plan.method), (3, Method::Lhs));
        assert!(matches!(Plan::parse("sample = 3\n"), Err(PlanError::Text(text)) if text.contains("sample")));
        assert_eq!(Plan::parse("").unwrap().check().unwrap_err(), PlanError::Nothing);
        let drawn = Plan { samples: None, ..plan.clone() };
        assert_eq!(drawn.check().unwrap_err(), PlanError::NoSamples("a.b".into(), "1:3".into()));
        let none = Plan { samples: Some(0), ..plan.clone() };
        assert_eq!(none.check().unwrap_err(), PlanError::NoRuns);
        let twice = Plan { vary: [plan.vary.clone(), plan.vary.clone()].concat(), ..plan };
        assert_eq!(twice.check().unwrap_err(), PlanError::Twice("a.b".into()));
    }

    #[test]
    fn shards_part_the_chunks() {
        let shards: Vec<Shard> = (0..3).map(|k| Shard::parse(&format!("{k}/3")).unwrap()).collect();
        assert!((0..20).all(|chunk| shards.iter().filter(|shard| shard.holds(chunk)).count() == 1));
        for wrong in ["3/3", "1", "a/2", "-1/2", "0/0"] {
            assert_eq!(Shard::parse(wrong), None, "{wrong}");
        }
    }
}

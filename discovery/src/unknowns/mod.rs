//! What a fit may change: the numbers `xi`, each with the prior N(0, 1).
//!
//! Parameters of the model (of all shots or of one), parameters of effects, offsets, gains and lags of the measuring chains, their
//! clock, and the delay of the trigger in each shot.

pub(crate) mod limits;
pub(crate) mod prior;

use crate::disturbance::Course;
use crate::unknowns::prior::Prior;

/// Farthest that an unknown may go, in standard deviations.
pub(crate) const LIMIT: f64 = 12.0;
/// Part of it that is rounding.
const ROUNDING: f64 = 1e-9;

/// What an unknown stands for.
#[derive(Clone, Debug)]
pub enum Meaning {
    /// Parameters of the model at these places become `base * (1 + sigma xi)`, where `base` is the value under the
    /// shot's conditions.
    Relative {
        /// Positions in the list of places.
        places: Vec<usize>,
        /// Relative standard deviation.
        sigma: f64,
    },
    /// Parameters of the model at these places get the value of the prior.
    Value {
        /// Positions in the list of places.
        places: Vec<usize>,
        /// Prior of the value.
        prior: Prior,
    },
    /// Offset of a channel.
    Offset {
        /// The channel.
        channel: usize,
        /// Standard deviation in units of the model.
        sigma: f64,
    },
    /// Gain of a channel, `1 + sigma xi`.
    Gain {
        /// The channel.
        channel: usize,
        /// Standard deviation.
        sigma: f64,
    },
    /// A course that the measuring chain adds to a channel, `sigma xi` times.
    Course {
        /// The channel.
        channel: usize,
        /// Which one.
        course: Course,
        /// Standard deviation of its amplitude in units of the model.
        sigma: f64,
    },
    /// A channel is late by `sigma xi` (s).
    Lag {
        /// The channel.
        channel: usize,
        /// Standard deviation (s).
        sigma: f64,
    },
    /// The clock of the records runs fast by the part `sigma xi`.
    Clock {
        /// Standard deviation.
        sigma: f64,
    },
    /// The trigger is late by `sigma xi` (s).
    Late {
        /// Positions in the list of places of the times that move with it; without any the whole record is shifted.
        places: Vec<usize>,
        /// Standard deviation (s).
        sigma: f64,
    },
}

/// An unknown of a fit.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// Name for reports.
    pub name: String,
    /// What it stands for.
    pub meaning: Meaning,
    /// The shot that it is for; none for all.
    pub shot: Option<usize>,
    /// Which parameter of which inserted effect it is.
    pub effect: Option<EffectPart>,
    /// How far it may go, in standard deviations: no farther than the limits of its parameters (`limits`).
    pub bounds: (f64, f64),
}

/// A parameter of an inserted effect.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct EffectPart {
    /// Number of the effect among those inserted.
    pub effect: usize,
    /// Position among its parameters; the first one carries its size.
    pub parameter: usize,
}

impl Unknown {
    /// Farthest that one may go, in standard deviations.
    pub const LIMIT: f64 = LIMIT;

    /// An unknown that is limited by its prior alone.
    pub fn new(name: String, meaning: Meaning, shot: Option<usize>, effect: Option<EffectPart>) -> Self {
        Self { name, meaning, shot, effect, bounds: (-LIMIT, LIMIT) }
    }

    /// The nearest number that it may have.
    pub fn within(&self, xi: f64) -> f64 {
        xi.clamp(self.bounds.0, self.bounds.1)
    }

    /// True where it has gone as far as any unknown may go, so that the measurement would have it farther.
    pub fn is_at_limit(&self, xi: f64) -> bool {
        xi.abs() >= LIMIT * (1.0 - ROUNDING)
    }

    /// Has it an influence on this shot?
    pub fn touches(&self, shot: usize) -> bool {
        self.shot.is_none_or(|own| own == shot)
    }

    /// Does a change need another run of the model?
    pub fn is_simulated(&self) -> bool {
        !self.places().is_empty()
    }

    /// Positions in the list of places of the parameters that it changes.
    pub fn places(&self) -> &[usize] {
        match &self.meaning {
            Meaning::Relative { places, .. } | Meaning::Value { places, .. } | Meaning::Late { places, .. } => places,
            Meaning::Offset { .. }
            | Meaning::Gain { .. }
            | Meaning::Course { .. }
            | Meaning::Lag { .. }
            | Meaning::Clock { .. } => &[],
        }
    }

    /// The value at `xi`: a factor for relative ones and gains, else in units of the model.
    pub fn value(&self, xi: f64) -> f64 {
        match &self.meaning {
            Meaning::Relative { sigma, .. } | Meaning::Gain { sigma, .. } => 1.0 + sigma * xi,
            Meaning::Value { prior, .. } => prior.value(xi),
            Meaning::Offset { sigma, .. }
            | Meaning::Course { sigma, .. }
            | Meaning::Lag { sigma, .. }
            | Meaning::Clock { sigma }
            | Meaning::Late { sigma, .. } => sigma * xi,
        }
    }

    /// `d value/d xi`.
    pub fn slope(&self, xi: f64) -> f64 {
        match &self.meaning {
            Meaning::Value { prior, .. } => prior.slope(xi),
            Meaning::Relative { sigma, .. }
            | Meaning::Gain { sigma, .. }
            | Meaning::Offset { sigma, .. }
            | Meaning::Course { sigma, .. }
            | Meaning::Lag { sigma, .. }
            | Meaning::Clock { sigma }
            | Meaning::Late { sigma, .. } => *sigma,
        }
    }
}

//! What disturbs a bench beside the noise that a lab states: model error, hum, drift, lag, a wrong clock, spikes, parameters that scatter.
//!
//! No machine is fitted down to the noise of its sensors.  What the best model leaves in a channel is counted by its size and by
//! how long it lasts: residuals of variance `v` that keep their sign over `L` samples carry as much evidence as one sample in `L`, so
//! residuals are weighed with `sqrt(v L)` in place of the noise (an independence likelihood brought to the effective number of
//! samples: Pauli, Racugno, Ventura 2011; for signatures slower than `L` it is that of a Gaussian process with this spectrum).
//! Residuals that come in bursts have fewer samples still, by their kurtosis over that of a normal distribution.

use std::f64::consts::TAU;

use hyd_system::math::{cos, sin};

/// Amplitudes are expected to be this many times those that were found.
pub(crate) const ROOM: f64 = 1.5;

/// How the residuals of a channel are weighed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Level {
    /// Standard deviation that counts, in those of the noise as stated.
    pub factor: f64,
    /// Root of the mean square of what the best model leaves, in standard deviations of the noise as stated.
    pub size: f64,
    /// Samples over which residuals stay alike; 1 for white noise.
    pub length: f64,
    /// How many times fewer samples carry the residuals because these come in bursts.
    pub bursts: f64,
}

/// Residuals that stay alike over fewer samples are noise: recorders filter, and what a machine does lasts longer.
const WHITE: f64 = 3.0;

impl Level {
    /// Nothing but noise as stated.
    pub const NOISE: Level = Level { factor: 1.0, size: 1.0, length: 1.0, bursts: 1.0 };

    /// Model error of this size.
    pub fn new(size: f64, length: f64, bursts: f64) -> Self {
        Self { factor: size * (length * bursts).sqrt(), size, length, bursts }
    }

    /// Samples that count as one.
    pub fn samples(&self) -> f64 {
        self.length * self.bursts
    }

    /// True if the noise is as stated.
    pub fn is_noise(&self) -> bool {
        self.factor == 1.0
    }

    /// True if what is left is no model error: noise, though it may be more than stated.
    pub fn is_white(&self) -> bool {
        self.length < WHITE
    }
}

/// A course that a measuring chain adds to a channel, with another amplitude in every shot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Course {
    /// A number.
    Offset,
    /// A straight line through the middle of the record, from -1 to 1.
    Drift {
        /// Begin and end of the record (s).
        from: f64,
        /// See `from`.
        to: f64,
    },
    /// A sine of this frequency (Hz).
    Sine(f64),
    /// A cosine of this frequency (Hz).
    Cosine(f64),
}

impl Course {
    /// Value per unit of the amplitude.
    pub fn value(&self, time: f64) -> f64 {
        match *self {
            Course::Offset => 1.0,
            Course::Drift { from, to } => (2.0 * time - from - to) / (to - from),
            Course::Sine(frequency) => sin(TAU * frequency * time),
            Course::Cosine(frequency) => cos(TAU * frequency * time),
        }
    }
}

/// What a measuring chain adds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Added {
    /// Drift: an offset and a slope of every shot.
    Drift,
    /// Mains hum or a harmonic of it (Hz).
    Hum(f64),
}

impl Added {
    /// Its courses in a record.
    pub fn courses(&self, (from, to): (f64, f64)) -> Vec<Course> {
        match *self {
            Added::Drift => vec![Course::Offset, Course::Drift { from, to }],
            Added::Hum(frequency) => vec![Course::Sine(frequency), Course::Cosine(frequency)],
        }
    }
}

/// A course of a channel, of an amplitude that differs from shot to shot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct AddedTo {
    /// The channel.
    pub channel: usize,
    /// What is added.
    pub added: Added,
    /// Standard deviation of the amplitudes (units of the model).
    pub sigma: f64,
}

/// A parameter that differs from shot to shot.
#[derive(Clone, PartialEq, Debug)]
pub struct Scatter {
    /// The nuisance of the study.
    pub label: String,
    /// Relative standard deviation from shot to shot.
    pub sigma: f64,
}

/// A channel that lags.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Lag {
    /// The channel.
    pub channel: usize,
    /// By how much (s), as it was found in the residuals; fits have a prior of about this width.
    pub time: f64,
}

/// A sample that belongs to nothing: alone beside its neighbours.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Spike {
    /// Position of the shot.
    pub shot: usize,
    /// The channel.
    pub channel: usize,
    /// Position of the sample.
    pub sample: usize,
}

/// All of it.
#[derive(Clone, Default, PartialEq, Debug)]
pub struct Disturbances {
    /// By channel; empty where noise is as stated.
    pub levels: Vec<Level>,
    /// What measuring chains add.
    pub added: Vec<AddedTo>,
    /// Channels that lag behind the others.
    pub lags: Vec<Lag>,
    /// By which part the clock of the records runs fast, as it was found in the residuals.
    pub clock: Option<f64>,
    /// What scatters from shot to shot.
    pub scatter: Vec<Scatter>,
    /// Samples left out.
    pub spikes: Vec<Spike>,
}

impl Disturbances {
    /// The level of a channel.
    pub fn level(&self, channel: usize) -> Level {
        self.levels.get(channel).copied().unwrap_or(Level::NOISE)
    }

    /// How many were taken up that have numbers of their own.
    pub fn fitted(&self) -> usize {
        self.added.len() + self.lags.len() + usize::from(self.clock.is_some()) + self.scatter.len()
    }

    /// True if residuals of no channel hold model error.
    pub fn is_noise(&self) -> bool {
        self.levels.iter().all(Level::is_white)
    }
}

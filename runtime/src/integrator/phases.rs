//! Which method was used from when on, and why: for the summary of a run.

use std::fmt;

/// A method of integration as the summary names it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize, serde::Deserialize)]
pub enum Method {
    /// Backward differentiation formulas of all orders.
    Bdf,
    /// The same up to order 2.
    BdfLowOrder,
    /// The L-stable one-step method of order 4.
    Esdirk,
}

impl Method {
    /// Name on the command line and in summaries.
    pub fn name(self) -> &'static str {
        match self {
            Method::Bdf => "bdf",
            Method::BdfLowOrder => "bdf of order 2",
            Method::Esdirk => "esdirk",
        }
    }
}

/// Why a method was taken up.
#[derive(Clone, Copy, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub enum Reason {
    /// The run began with it.
    Start,
    /// Stability at high order limited the steps of BDF; see `advantage`.
    Stability {
        /// Time gained per work in the trial, relative to the method before.
        advantage: f64,
    },
    /// BDF of all orders leads further again; see `advantage`.
    Recovered {
        /// Time gained per work in the trial, relative to the method before.
        advantage: f64,
    },
    /// Samples of recorded inputs interrupt BDF too often; see `advantage`.
    Samples {
        /// Time gained per work in the trial, relative to the method before.
        advantage: f64,
    },
    /// Steps longer than the shortest delay pay.
    ShortDelay,
    /// They turned out to be shorter than the delay.
    LongDelay,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Start => write!(f, "at the start"),
            Reason::Stability { .. } => write!(f, "lightly damped oscillations limit the order of BDF"),
            Reason::Samples { .. } => write!(f, "samples of the recorded inputs interrupt BDF too often"),
            Reason::Recovered { .. } => write!(f, "BDF is the more efficient method again"),
            Reason::ShortDelay => write!(f, "a delay is shorter than the steps"),
            Reason::LongDelay => write!(f, "steps longer than a delay do not pay off"),
        }
    }
}

/// A stretch of a run with one method; it ends where the next begins.
#[derive(Clone, Copy, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub struct MethodPhase {
    /// Begin (s).
    pub from: f64,
    /// The method.
    pub method: Method,
    /// Why.
    pub reason: Reason,
}

/// Phases kept for a summary; a run that changes more often shows the first ones.
pub(crate) const MOST_PHASES: usize = 64;

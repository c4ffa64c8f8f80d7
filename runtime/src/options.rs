//! What the caller of a run decides: times, tolerance, output points and limits.
//!
//! Plain data with the defaults of [`Options::new`]; checked once before a run.

use std::fmt;

/// Most output intervals; their rows alone are tens of gigabytes.
const MOST_INTERVALS: usize = 1_000_000_000;

/// Method of integration.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize, serde::Deserialize)]
pub enum Solver {
    /// Chosen during the run from what steps cost and how far they lead.
    #[default]
    Auto,
    /// Backward differentiation formulas of order 1 to 5.
    Bdf,
    /// The L-stable one-step method of order 4.
    Esdirk,
}

/// Choices for one run.
#[derive(Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub struct Options {
    /// Start time (s).
    pub start: f64,
    /// Stop time (s), not before `start`.
    pub stop: f64,
    /// Relative tolerance of the local error; the error of `y_i` is weighed against `tolerance * (|y_i| + size_i)`.
    pub tolerance: f64,
    /// Method of integration.
    pub solver: Solver,
    /// Number of equal intervals between output points.
    pub intervals: usize,
    /// Output points in ascending order (s) instead of those at equal intervals, if not empty.  There is a row at the start
    /// all the same, but one at the stop time only if it is listed, or an event ends the run; points after it have none.
    pub times: Vec<f64>,
    /// Rows at every accepted step instead of at equal intervals.
    pub every_step: bool,
    /// Rows at the ends of all steps and at points within them, too, as [`hyd_results::RowKind::Within`]: enough to measure the
    /// course of variables between output points.  Not in runs with sensitivities.
    pub within_steps: bool,
    /// Outputs (positions in a row) that rows at output points need, all if none are named: the others are evaluated, and found to be finite,
    /// at the start, at events, at the end and now and then, and mean nothing in other rows.  Not in runs with sensitivities.
    pub needed_outputs: Option<Vec<u32>>,
    /// The same for rows within steps: the others cost nothing and mean nothing there.
    pub needed_within: Option<Vec<u32>>,
    /// Rows twice at each event, before and after.
    pub event_rows: bool,
    /// Largest step (s); `None`: a fraction of the run that leaves few state events unseen.
    pub max_step: Option<f64>,
    /// First step (s), also after events; `None`: estimated.
    pub initial_step: Option<f64>,
    /// Number of steps after which the run is given up.
    pub max_steps: u64,
    /// Highest order of the formulas, 1 to 5.
    pub max_order: usize,
    /// Leaves algebraic unknowns out of the local error test.
    pub suppress_algebraic: bool,
    /// Where the start values lead to no initial values, they are looked for elsewhere.  What is found is reported by
    /// [`Summary::rescue`](crate::Summary::rescue) alone, so only who passes it on to the user asks for it.
    pub rescue: bool,
    /// Parameters, by full name, with respect to which derivatives of all recorded variables are computed as further
    /// variables `d(x)/d(p)`; the name of a variable stands for its start value.
    pub sensitivity: Vec<String>,
    /// Outputs (positions in a row) whose derivatives are looked at, all if none are named: the others cost nothing and
    /// mean nothing.
    pub derived_outputs: Option<Vec<u32>>,
}

impl Options {
    /// A run from `start` to `stop` (s) with relative tolerance 1e-6 and 500 intervals.
    pub fn new(start: f64, stop: f64) -> Self {
        Self {
            start,
            stop,
            tolerance: 1e-6,
            solver: Solver::Auto,
            intervals: 500,
            times: Vec::new(),
            every_step: false,
            within_steps: false,
            needed_outputs: None,
            needed_within: None,
            event_rows: true,
            max_step: None,
            initial_step: None,
            max_steps: 50_000_000,
            max_order: 5,
            suppress_algebraic: false,
            rescue: false,
            sensitivity: Vec::new(),
            derived_outputs: None,
        }
    }

    /// The same with another tolerance.
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// Checks the ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        let positive = |value: Option<f64>| value.is_none_or(|v| v > 0.0 && v.is_finite());
        if !self.start.is_finite() || !self.stop.is_finite() || self.stop < self.start {
            Err(OptionError::Times { start: self.start, stop: self.stop })
        } else if !(1e-13..=0.1).contains(&self.tolerance) {
            Err(OptionError::Tolerance(self.tolerance))
        } else if !(1..=MOST_INTERVALS).contains(&self.intervals) {
            Err(OptionError::Intervals(self.intervals))
        } else if self.times.windows(2).any(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less)) {
            Err(OptionError::OutputTimes)
        } else if !positive(self.max_step) || !positive(self.initial_step) {
            Err(OptionError::Step)
        } else if !(1..=5).contains(&self.max_order) {
            Err(OptionError::Order(self.max_order))
        } else {
            Ok(())
        }
    }

    /// How far output points are apart (s), on average.
    pub(crate) fn output_interval(&self) -> f64 {
        let count = if self.times.is_empty() { self.intervals } else { self.times.len() };
        (self.stop - self.start) / count.max(1) as f64
    }

    /// Time of output point `k` (s), if there are so many.  Points at equal intervals count from 0 at the start, the last one
    /// is exactly the stop time; given ones count from 1.
    pub(crate) fn output_time(&self, k: usize) -> Option<f64> {
        if k == 0 {
            Some(self.start)
        } else if !self.times.is_empty() {
            self.times.get(k - 1).copied()
        } else if k < self.intervals {
            Some(self.start + (self.stop - self.start) * (k as f64 / self.intervals as f64))
        } else {
            (k == self.intervals).then_some(self.stop)
        }
    }
}

/// An option outside its range.
#[derive(Clone, PartialEq, Debug)]
pub enum OptionError {
    /// Times are not finite or run backwards.
    Times {
        /// Start time (s).
        start: f64,
        /// Stop time (s).
        stop: f64,
    },
    /// The tolerance is not between 1e-13 and 0.1.
    Tolerance(f64),
    /// There are no intervals or too many.
    Intervals(usize),
    /// Output points do not ascend.
    OutputTimes,
    /// A step size is not a positive number.
    Step,
    /// The highest order is not between 1 and 5.
    Order(usize),
    /// There can be no sensitivity with respect to this name.
    Sensitivity {
        /// The name.
        name: String,
        /// Why.
        reason: String,
    },
}

impl fmt::Display for OptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OptionError::Times { start, stop } => {
                write!(f, "the stop time {stop} s must be a number no earlier than the start time {start} s")
            }
            OptionError::Tolerance(value) => write!(f, "the tolerance {value} must lie between 1e-13 and 0.1"),
            OptionError::Intervals(0) => write!(f, "there must be at least one output interval"),
            OptionError::Intervals(count) => {
                write!(f, "{count} output intervals are too many: at most {MOST_INTERVALS} are possible")
            }
            OptionError::OutputTimes => write!(f, "output times must be in ascending order"),
            OptionError::Step => write!(f, "step sizes must be positive numbers"),
            OptionError::Sensitivity { name, reason } => write!(f, "no sensitivity to `{name}`: {reason}"),
            OptionError::Order(value) => write!(f, "the highest order {value} must lie between 1 and 5"),
        }
    }
}

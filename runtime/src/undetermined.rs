//! Unknowns that the equations leave undetermined: two frictions that hold one shaft, the potential of a star point without a load.
//!
//! A matrix without full rank is no fault of its own where the equations agree with each other: each value of the unknown fulfils them, and
//! it keeps the one that it has (see `linear::free`; other tools of the language take the solution of least norm).

use std::fmt;

use hyd_system::significant;

/// An unknown that the equations leave undetermined.
#[derive(Clone, PartialEq, Debug)]
pub struct Undetermined {
    /// Since when (s).
    pub time: f64,
    /// Its name.
    pub variable: String,
}

impl fmt::Display for Undetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (time, name) = (significant(self.time), &self.variable);
        write!(
            f,
            "from t = {time} s on the equations do not determine {name}: every value fulfils them, and it keeps the one it had"
        )
    }
}

/// Those of a run.
#[derive(Clone, Default)]
pub(crate) struct LeftFree {
    /// Unknowns may be left undetermined.
    pub(crate) allowed: bool,
    pub(crate) found: Vec<Undetermined>,
}

impl LeftFree {
    /// Notes one, if it is new.
    pub(crate) fn note(&mut self, time: f64, variable: String) {
        if !self.found.iter().any(|known| known.variable == variable) {
            self.found.push(Undetermined { time, variable });
        }
    }
}

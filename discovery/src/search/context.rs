//! What a search is given, and how its fits are weighed and followed.

use super::ends::Ends;
use super::memory::Memory;
use crate::catalogue::Candidate;
use crate::fit::{Effort, schedule};
use crate::problem::{Problem, Weighing};
use crate::setup::Setup;
use crate::thresholds::NEEDED;
use crate::variant::Workshop;

/// A search.
pub struct Search<'a> {
    /// Study and set.
    pub setup: &'a Setup,
    /// Writer of models.
    pub workshop: &'a Workshop<'a>,
    /// All that may be missing.
    pub candidates: Vec<Candidate>,
    /// Seed of random starts.
    pub seed: u64,
    /// Drop of the cost that a name needs: [`Search::NEEDED`], or more where [`crate::calibration`] says so.
    pub needed: f64,
    /// Told what is being done.
    pub progress: &'a dyn Fn(&str),
    /// Fits made before.
    pub memory: &'a dyn Memory,
    /// Where the round before ended; empty at first.
    pub ends: Ends,
}

impl Search<'_> {
    /// Drop of the cost that a name needs unless a calibration says more.
    pub const NEEDED: f64 = NEEDED;

    /// True weights over the fitted shots.
    pub(super) fn whole(&self) -> Weighing {
        Weighing::whole(&self.setup.train, self.setup.study.shots.time_tolerance)
    }

    /// Wide weights over them, under which fits begin.
    pub(super) fn wide(&self) -> Weighing {
        let whole = self.whole();
        Weighing { inflation: 3.5, tau: schedule::widened(whole.tau), ..whole }
    }
}

/// How hard a fit is followed on: derivatives through delays are dear.
pub(super) fn patience(problem: &Problem<'_>) -> Effort {
    if problem.machine.is_fast() { Effort::LONG } else { Effort { reuse: 8, ..Effort::FULL } }
}

//! What all work on one study shares: how many runs it has made, how many of them again, and whether the work is to end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Shared by a [`crate::Setup`] and all that is made from it.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    /// Number of runs of one shot.
    pub runs: Arc<AtomicUsize>,
    /// Number of runs that were done again with whole loops.
    pub whole_loops: Arc<AtomicUsize>,
    /// Set by whoever wants the work to end: runs end at their next step, and no further model is made ready.
    pub stop: Arc<AtomicBool>,
}

impl Watch {
    /// Number of runs of one shot so far.
    pub fn runs(&self) -> usize {
        self.runs.load(Ordering::Relaxed)
    }

    /// True when the work is to end.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

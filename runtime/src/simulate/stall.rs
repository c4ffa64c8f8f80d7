//! Runs that stand still: whether going on can lead to the end.
//!
//! Where a `noEvent` switches back and forth, every other step fails and all are tiny; the limit of steps alone would end
//! such a run after minutes.  A run is given up when for several stretches a large part of its attempts have failed
//! and, at the pace of each stretch, the steps that are left would not do.  A start with tiny steps has few failures,
//! and a hard contact is passed sooner.

use crate::Statistics;

/// Steps of a stretch, and stretches that must agree.
const STRETCH: u64 = 25_000;
const STRETCHES: u32 = 4;
/// Failed attempts per step from which on they count as many.
const MANY: f64 = 0.2;

/// The stretch in work.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Stall {
    time: f64,
    steps: u64,
    failures: u64,
    hopeless: u32,
}

impl Stall {
    /// At the start of a run at `time` (s).
    pub(super) fn new(time: f64) -> Self {
        Self { time, steps: 0, failures: 0, hopeless: 0 }
    }

    /// After a step to `time` (s): true if the run will not come to `stop` (s) with `most` steps.
    pub(super) fn stands(&mut self, statistics: &Statistics, (time, stop): (f64, f64), most: u64) -> bool {
        let steps = statistics.steps - self.steps;
        if steps < STRETCH {
            return false;
        }
        let failures = statistics.error_rejections + statistics.convergence_failures;
        let many = (failures - self.failures) as f64 > MANY * steps as f64;
        let needed = steps as f64 * (stop - time) / (time - self.time);
        let hopeless = if many && needed > most as f64 { self.hopeless + 1 } else { 0 };
        *self = Self { time, steps: statistics.steps, failures, hopeless };
        hopeless >= STRETCHES
    }
}

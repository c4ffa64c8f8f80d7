//! Where the time of a run goes, and who keeps its steps short.
//!
//! Kept only in runs that ask for it ([`Simulator::profile_with`](crate::Simulator::profile_with)): of every accepted step the unknown
//! whose error was the largest, of every rejected or unconverged attempt the same, of every event its relation, and the time spent in
//! evaluations, on the caller's clock.  Counting changes nothing of what is computed.

/// Time spent in parts of a run (s).
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Seconds {
    /// Evaluations of residuals within steps and at events.
    pub residuals: f64,
    /// Evaluations of Jacobians.
    pub jacobians: f64,
    /// Finding initial values, evaluations included.
    pub start: f64,
    /// Steps, evaluations included: the rest of it is linear algebra and control.
    pub steps: f64,
    /// Settling events and starting again after them, evaluations included.
    pub events: f64,
    /// The whole run.
    pub total: f64,
}

/// What a run has spent on whom.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Time by part.
    pub seconds: Seconds,
    /// By unknown: accepted steps whose largest error was its own.
    pub limited: Vec<u64>,
    /// By unknown: attempts rejected for its error.
    pub rejected: Vec<u64>,
    /// By unknown: attempts in which Newton's method did not converge, its correction the largest.
    pub unconverged: Vec<u64>,
    /// By residual row: the same, its residual the largest.
    pub unconverged_rows: Vec<u64>,
    /// By relation: events at which it changed.
    pub events: Vec<u64>,
    /// By unknown: the size at the end of the run that its absolute tolerance is made of, its nominal value or what was learned.
    pub sizes: Vec<f64>,
    clock: fn() -> f64,
}

impl Profile {
    /// Nothing counted yet of a system with so many unknowns and relations.
    pub(crate) fn new(clock: fn() -> f64, unknowns: usize, relations: usize) -> Self {
        Self {
            seconds: Seconds::default(),
            limited: vec![0; unknowns],
            rejected: vec![0; unknowns],
            unconverged: vec![0; unknowns],
            unconverged_rows: vec![0; unknowns],
            events: vec![0; relations],
            sizes: Vec::new(),
            clock,
        }
    }

    /// The time now (s).
    pub(crate) fn now(&self) -> f64 {
        (self.clock)()
    }

    pub(crate) fn limit(&mut self, unknown: Option<usize>) {
        count(&mut self.limited, unknown);
    }

    pub(crate) fn reject(&mut self, unknown: Option<usize>) {
        count(&mut self.rejected, unknown);
    }

    pub(crate) fn diverge(&mut self, row: Option<usize>, unknown: Option<usize>) {
        count(&mut self.unconverged, unknown);
        count(&mut self.unconverged_rows, row);
    }

    pub(crate) fn fire(&mut self, fired: &[bool]) {
        self.events.iter_mut().zip(fired).filter(|(_, fired)| **fired).for_each(|(count, _)| *count += 1);
    }
}

fn count(counts: &mut [u64], at: Option<usize>) {
    if let Some(count) = at.and_then(|at| counts.get_mut(at)) {
        *count += 1;
    }
}

//! On which side of an instant the clock stands, and what relations linear in time are there (see `timed`).

use hyd_system::Instants;

use crate::routines::TimedRelation;

/// Where the clock stands.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Clock {
    /// The instants of the run.
    pub instants: Instants,
    /// The time to whose right side an event has moved the clock (s).
    pub right_of: Option<f64>,
    /// The next event moves it to the right side of this time (s).
    pub announced: Option<f64>,
}

impl Clock {
    /// The clock of a run that starts at this time (s).
    pub(crate) fn of_run(start: f64) -> Self {
        Self { instants: Instants::of_run(start), right_of: None, announced: None }
    }

    /// True if an event has moved the clock to the right side of `t`.
    pub(crate) fn stands_right_of(&self, t: f64) -> bool {
        self.right_of.is_some_and(|right_of| self.instants.same(right_of, t))
    }

    /// What a relation is at `t`; none where its instant is not known.
    pub(crate) fn truth(&self, relation: &TimedRelation, instant: f64, t: f64) -> Option<bool> {
        if instant.is_nan() {
            return None;
        }
        let now = self.instants.same(instant, t);
        let changed = if now { !relation.right_after || self.stands_right_of(t) } else { instant < t };
        Some(changed == relation.rises)
    }
}

//! What the search for changes of relations of time alone keeps (see `ahead`).

use crate::enclose::Enclosures;
use crate::interval::Interval;

/// Work space of the search.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    /// What the routine computes over an interval.
    pub enclosures: Enclosures,
    /// The relations at the beginning of the search.
    pub known: Vec<Known>,
}

/// What a relation is at the beginning.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub held: bool,
    /// It is true with a root function of zero, as `>=` is: zero is not a change.
    pub resting: bool,
    /// How often no interval was short enough to decide.
    pub halved: u32,
}

impl Known {
    /// True if the relation is another one where its root function has this value.
    pub(crate) fn changes(self, value: f64) -> bool {
        (value > 0.0) != self.held && !(self.resting && value == 0.0)
    }

    /// True if no root function with these values changes the relation.
    pub(crate) fn stays(self, values: Interval) -> bool {
        match self.held {
            true => values.low > 0.0 || self.resting && values.low == 0.0,
            false => values.high <= 0.0,
        }
    }
}

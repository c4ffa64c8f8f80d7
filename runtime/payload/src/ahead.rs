//! Relations of time alone that are not linear in it (`sin(1000*time) > 0.5`): how far ahead they keep their truth.
//!
//! No step size follows from them, so a step of the solver may pass over two changes, or over hundreds.  But nothing has to
//! be integrated to look at them: they are computed for whole intervals of time, with their slopes ([`Enclosure`]).  Where the
//! enclosure has a sign the relation does not change; where the slope has one, the end of the interval tells; other intervals are
//! halved, down to the width of an instant (Moore, Kearfott, Cloud, "Introduction to Interval Analysis", SIAM 2009,
//! section 8.1).  A step that ends where this ends passes over no change.

use crate::instance::{Instance, Point};
use crate::interval::Enclosure;
use crate::search::Known;

/// Intervals that are looked at before the search pauses; it goes on from where it has come.
const MOST_INTERVALS: u32 = 10_000;
/// A relation that no interval is short enough for so often has no enclosure (`sqrt(x)` of a negative x).
const MOST_HALVED: u32 = 32;
/// Such a relation is examined at no fewer than this many points of the time ahead.
const BLIND_PARTS: f64 = 256.0;

impl Instance {
    /// See [`hyd_system::DaeSystem::unchanged_until`].
    pub(crate) fn first_change_of_time(&mut self, t: f64, until: f64) -> f64 {
        let loaded = self.loaded.clone();
        let events = &loaded.model.routines.events;
        if events.by_time.is_empty() {
            return until;
        }
        let Some(vm) = loaded.engine.interpreter() else { return until };
        let mut search = std::mem::take(&mut self.memory.search);
        let first = loaded.model.area.held.start;
        self.roots_of_time(t);
        let known = |(&relation, &value): (&u32, &f64)| {
            let held = self.memory.data[(first + relation) as usize] != 0.0;
            Known { held, resting: held && value == 0.0, halved: 0 }
        };
        search.known.clear();
        search.known.extend(events.by_time.iter().zip(&self.memory.out).map(known));
        search.enclosures.work.resize(self.memory.work.len(), Enclosure::ALL);
        search.enclosures.out.resize(events.by_time.len(), Enclosure::ALL);
        let (mut left, mut width) = (t, until - t);
        for _ in 0..MOST_INTERVALS {
            if left >= until {
                break;
            }
            let right = if left + width < until { left + width } else { until };
            vm.enclose(events.time_roots, (left, right), &self.memory.data, &mut search.enclosures);
            let changed = self.changed_by(right, &search.known);
            let open = |k: usize| !search.known[k].stays(search.enclosures.out[k].value);
            let turns =
                |k: usize| search.enclosures.out[k].slope.low < 0.0 && search.enclosures.out[k].slope.high > 0.0;
            let short = right - left <= (until - t) / BLIND_PARTS;
            let seen = |k: usize| !(short && search.known[k].halved >= MOST_HALVED);
            let undecided = (0..search.known.len()).any(|k| open(k) && turns(k) && seen(k));
            let narrow = right - left <= self.memory.clock.instants.width(left);
            if !changed && (narrow || !undecided) {
                if undecided {
                    let blind = |k: &usize| open(*k) && turns(*k);
                    let found: Vec<usize> = (0..search.known.len()).filter(blind).collect();
                    found.into_iter().for_each(|k| search.known[k].halved += 1);
                }
                left = right;
                width *= 2.0;
            } else if narrow || !undecided {
                left = self.bisect((left, right), &search.known);
                break;
            } else {
                width = 0.5 * (right - left);
            }
        }
        self.memory.search = search;
        left.min(until)
    }

    /// The root functions at `t`, in the results.
    fn roots_of_time(&mut self, t: f64) {
        let routine = self.loaded.model.routines.events.time_roots;
        self.set_time(t, false);
        self.run_own(routine, Point::NOWHERE);
    }

    /// True if one of the relations is another one at `t`.
    fn changed_by(&mut self, t: f64, known: &[Known]) -> bool {
        self.roots_of_time(t);
        known.iter().zip(&self.memory.out).any(|(known, &value)| known.changes(value))
    }

    /// The right end of the narrowest bracket of the first change within one in which no relation turns back.
    fn bisect(&mut self, (mut left, mut right): (f64, f64), known: &[Known]) -> f64 {
        loop {
            let middle = left + 0.5 * (right - left);
            if middle <= left || middle >= right {
                return right;
            }
            if self.changed_by(middle, known) { right = middle } else { left = middle }
        }
    }
}

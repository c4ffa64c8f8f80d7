//! Breaks: instants at which sources or their slopes jump, and how far each site has come past them.
//!
//! Every event begins a segment of the past, so its begin is a possible break of every source.  Jumps of the value are seen
//! at once.  Whether the slope has jumped is decided a part of the delay time later, before the break can come
//! back; until then it counts as one.  A break that neither jumps in value nor in slope is smooth for the site and forgotten, so
//! that breaks die out as they are integrated, and go on for ever where nothing smooths them (Bellen, Zennaro, "Numerical
//! Methods for Delay Differential Equations", Oxford 2003, section 4.1).  A site reads the past between the breaks `low`
//! and `high` until it crosses one at an event.

use super::past::{Past, Segment};
use super::polynomial::{NODES, end_slope};

/// A value or slope has jumped if the change is this many times what the tolerance lets pass.
const VISIBLE_JUMP: f64 = 10.0;
const VISIBLE_SLOPE: f64 = 8.0;
/// Part of the delay time after which the slopes on both sides of a break are compared.
pub(super) const DECIDED_AFTER: f64 = 0.25;

/// What a break is for a site.
#[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize, serde::Deserialize)]
enum State {
    /// The slope is not known yet.
    Open,
    /// Value or slope jump.
    Jump,
    /// Neither.
    Smooth,
}

/// Where a site reads.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Cursor {
    /// The break crossed last (a segment).
    pub(super) low: Segment,
    /// The next break that is not smooth.
    pub(super) high: Option<Segment>,
    /// Where the last search ended.
    pub(super) hint: usize,
}

/// Breaks of all sites.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Breaks {
    sites: usize,
    /// States of all sites per break, oldest break first.
    states: Vec<State>,
    first: Segment,
    /// Breaks with open sites, and when the first of them can be decided (s).
    open: Vec<(Segment, f64)>,
    pub(super) cursors: Vec<Cursor>,
}

impl Breaks {
    /// Forgets everything; segment 0 has no break.
    pub(super) fn restart(&mut self, sites: usize) {
        self.sites = sites;
        self.states.clear();
        self.states.resize(sites, State::Smooth);
        self.first = 0;
        self.open.clear();
        self.cursors.clear();
        self.cursors.resize(sites, Cursor::default());
    }

    fn state(&self, segment: Segment, site: usize) -> State {
        self.states[(segment - self.first) * self.sites + site]
    }

    fn set(&mut self, segment: Segment, site: usize, state: State) {
        self.states[(segment - self.first) * self.sites + site] = state;
    }

    /// Adds the break at the beginning of the newest segment at `t` (s), or looks at it again if it is known; `left` and
    /// `right` are the values on both sides, `limits` what of a value the tolerance lets pass.
    pub(super) fn add(&mut self, past: &Past, left: &[f64], right: &[f64], limits: &[f64]) {
        let segment = past.newest();
        let known = self.states.len() > (segment - self.first) * self.sites;
        if !known {
            self.states.resize(self.states.len() + self.sites, State::Open);
            self.open.push((segment, past.begin_of(segment)));
        }
        for site in 0..self.sites {
            if (right[site] - left[site]).abs() > VISIBLE_JUMP * limits[site] {
                self.set(segment, site, State::Jump);
            }
            if self.cursors[site].high.is_none() && self.cursors[site].low < segment {
                self.cursors[site].high = Some(segment);
            }
        }
    }

    /// The break at the beginning of the newest segment is one for a site, whatever its values do.
    pub(super) fn keep_newest(&mut self, past: &Past, site: usize) {
        self.set(past.newest(), site, State::Jump);
    }

    /// Decides open breaks whose surroundings are known by now; true if one has turned out to be smooth.
    pub(super) fn decide(&mut self, past: &Past, times: &[f64], limits: &[f64]) -> bool {
        let mut smooth = false;
        let mut open = std::mem::take(&mut self.open);
        open.retain_mut(|(segment, due)| {
            if past.end() < *due {
                return true;
            }
            let mut next = f64::INFINITY;
            for site in 0..self.sites {
                if self.state(*segment, site) != State::Open {
                    continue;
                }
                let when = past.begin_of(*segment) + DECIDED_AFTER * times[site];
                if past.end() < when || times[site] == 0.0 {
                    next = next.min(when);
                    continue;
                }
                let jumps = slope_jumps(past, *segment, site, (times[site], limits[site]));
                self.set(*segment, site, if jumps { State::Jump } else { State::Smooth });
                if !jumps && self.cursors[site].high == Some(*segment) {
                    self.cursors[site].high = self.barrier_after(site, *segment, past.newest());
                    smooth = true;
                }
            }
            *due = next;
            next.is_finite()
        });
        self.open = open;
        smooth
    }

    fn barrier_after(&self, site: usize, segment: Segment, newest: Segment) -> Option<Segment> {
        (segment + 1..=newest).find(|&s| self.state(s, site) != State::Smooth)
    }

    fn barrier_before(&self, site: usize, segment: Segment) -> Segment {
        (self.first + 1..segment).rev().find(|&s| self.state(s, site) != State::Smooth).unwrap_or(self.first)
    }

    /// Lets a site cross the breaks whose return `has_come`, asked with the begins of their segments (s).  True if it has crossed one.
    pub(super) fn cross(&mut self, past: &Past, site: usize, has_come: impl Fn(f64) -> bool) -> bool {
        let before = self.cursors[site].low;
        while let Some(high) = self.cursors[site].high
            && has_come(past.begin_of(high))
        {
            self.cursors[site].low = high;
            self.cursors[site].high = self.barrier_after(site, high, past.newest());
        }
        self.cursors[site].low != before
    }

    /// The same for a site that reads at `at` (s) and may have gone back before breaks crossed earlier; `slack` (s) is the width of an
    /// instant.
    pub(super) fn cross_near(&mut self, past: &Past, site: usize, at: f64, slack: f64) -> bool {
        let before = self.cursors[site].low;
        self.cross(past, site, |begin| at >= begin - slack);
        while self.cursors[site].low > self.first && at < past.begin_of(self.cursors[site].low) - 2.0 * slack {
            let low = self.cursors[site].low;
            self.cursors[site].high = Some(low);
            self.cursors[site].low = self.barrier_before(site, low);
        }
        self.cursors[site].low != before
    }

    /// Forgets breaks before the oldest segment of the past.
    pub(super) fn drop_before(&mut self, oldest: Segment) {
        if oldest > self.first {
            self.states.drain(..(oldest - self.first) * self.sites);
            self.first = oldest;
            self.open.retain(|(segment, _)| *segment > oldest);
        }
    }

    /// The oldest segment that a site reads.
    pub(super) fn oldest_read(&self) -> Segment {
        self.cursors.iter().map(|cursor| cursor.low).min().unwrap_or(0)
    }
}

/// Compares the slopes of a source on both sides of a break.
fn slope_jumps(past: &Past, segment: Segment, site: usize, (delay, limit): (f64, f64)) -> bool {
    let t = past.begin_of(segment);
    let right_end = if segment == past.newest() { past.end() } else { past.begin_of(segment + 1) };
    let reach = DECIDED_AFTER * delay;
    let right_reach = reach.min(right_end - t);
    let left_reach = reach.min(t - past.begin_of(segment - 1));
    if right_reach <= 0.0 || left_reach <= 0.0 {
        return true;
    }
    let slope = |range: (Segment, Option<Segment>), step: f64| {
        let mut hint = 0;
        let nodes: [f64; NODES] = std::array::from_fn(|k| past.at(site, t + k as f64 * step, range, &mut hint).0);
        end_slope(&nodes, step)
    };
    let parts = (NODES - 1) as f64;
    let right = slope((segment, (segment < past.newest()).then_some(segment + 1)), right_reach / parts);
    // Before the start the sources are constant.
    let (left, left_noise) = match segment {
        1 => (0.0, 0.0),
        _ => (slope((segment - 1, Some(segment)), -left_reach / parts), left_reach.recip()),
    };
    (right - left).abs() > VISIBLE_SLOPE * limit * (right_reach.recip() + left_noise)
}

//! The recorded past: pieces of polynomials of degree 4 over time, for all sources alike.
//!
//! A piece holds the values of all sources at its ends and at three points between, equally spaced; between breaks (events)
//! pieces follow each other without gap.  A segment is what lies between two breaks; across a break the values and their
//! slopes may jump, so a value is always asked for within given segments.  Before the first break the sources are constant.
//! Pieces that no delay reaches any longer are dropped; in steady state nothing is allocated.

use super::polynomial::{NODES, curvature, value, weights};

/// Dropped pieces are given back when they are at least this many and half of all.
const SHORTEST_DROP: usize = 64;

/// An interval of time.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
struct Piece {
    from: f64,
    to: f64,
}

/// An instant of the past: where it lies, and how values at the nodes count there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// First value of the piece.
    first: usize,
    /// Before the start all is constant.
    constant: bool,
    /// Part of the piece, and the inverse of its length (1/s).
    part: f64,
    per: f64,
    value: [f64; NODES - 1],
    rate: [f64; NODES - 1],
}

/// An instant that is looked for, and the segments in which it may lie.
pub(super) type Wanted = (f64, Segment, Option<Segment>);
/// Number of a segment; they are counted over the whole run.
pub(super) type Segment = usize;

/// Values of the sources from the start to now.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Past {
    sites: usize,
    pieces: Vec<Piece>,
    /// `NODES * sites` values per piece, node by node.
    values: Vec<f64>,
    /// Pieces before `pieces[0]` that have been dropped.
    dropped: usize,
    /// First piece of each segment, counted with the dropped ones; the first entry belongs to segment `first_segment`.
    starts: Vec<usize>,
    /// Time at which each of these segments begins (s).
    times: Vec<f64>,
    first_segment: Segment,
}

impl Past {
    /// Forgets everything; before `t` (s) the sources have the given values.
    pub(super) fn restart(&mut self, t: f64, values: &[f64]) {
        self.sites = values.len();
        self.pieces.clear();
        self.values.clear();
        self.starts.clear();
        self.times.clear();
        (self.dropped, self.first_segment) = (0, 0);
        self.starts.push(0);
        self.times.push(f64::NEG_INFINITY);
        self.pieces.push(Piece { from: t - 1.0, to: t });
        for _ in 0..NODES {
            self.values.extend_from_slice(values);
        }
    }

    /// Begins a segment at `t` (s).
    pub(super) fn begin_segment(&mut self, t: f64) {
        self.starts.push(self.dropped + self.pieces.len());
        self.times.push(t);
    }

    /// Adds a piece to the newest segment; `values` node by node.
    pub(super) fn push(&mut self, from: f64, to: f64, values: &[f64]) {
        self.pieces.push(Piece { from, to });
        self.values.extend_from_slice(values);
    }

    /// The newest segment.
    pub(super) fn newest(&self) -> Segment {
        self.first_segment + self.starts.len() - 1
    }

    /// When a segment begins (s).
    pub(super) fn begin_of(&self, segment: Segment) -> f64 {
        self.times[segment - self.first_segment]
    }

    /// The oldest segment that is still known.
    pub(super) fn oldest(&self) -> Segment {
        self.first_segment
    }

    /// Time up to which the past is recorded (s).
    pub(super) fn end(&self) -> f64 {
        let begin = self.times[self.times.len() - 1];
        self.pieces.last().map_or(begin, |piece| piece.to.max(begin))
    }

    /// Forgets what lies after `t` (s) in the newest segment.
    pub(super) fn cut(&mut self, t: f64) {
        let first = self.starts[self.starts.len() - 1].saturating_sub(self.dropped);
        while self.pieces.len() > first && self.pieces[self.pieces.len() - 1].from >= t {
            self.pieces.pop();
            self.values.truncate(self.pieces.len() * NODES * self.sites);
        }
        if self.pieces.len() == first || self.pieces[self.pieces.len() - 1].to <= t {
            return;
        }
        let last = self.pieces.len() - 1;
        let Piece { from, to } = self.pieces[last];
        let part = (t - from) / (to - from);
        for site in 0..self.sites {
            let nodes = self.nodes(last, site);
            for (k, at) in self.values[last * NODES * self.sites..].chunks_mut(self.sites).enumerate() {
                at[site] = value(&nodes, part * k as f64 / (NODES - 1) as f64);
            }
        }
        self.pieces[last].to = t;
    }

    /// Drops pieces that end before `t` (s) and segments that have none left; segment `keep` and its successors stay.
    pub(super) fn drop_before(&mut self, t: f64, keep: Segment) {
        let gone = self.pieces.partition_point(|piece| piece.to < t);
        if gone < SHORTEST_DROP || 2 * gone < self.pieces.len() {
            return;
        }
        self.pieces.drain(..gone);
        self.values.drain(..gone * NODES * self.sites);
        self.dropped += gone;
        // A segment without pieces is needed no more if the next one begins before what is left.
        let unused = self.starts.windows(2).take_while(|pair| pair[1] <= self.dropped).count();
        let unused = unused.min(keep.saturating_sub(self.first_segment));
        self.starts.drain(..unused);
        self.times.drain(..unused);
        self.first_segment += unused;
    }

    /// Value and rate of a source at `t` (s) from segments `low` to below `high` (to the newest if none); outside of them
    /// the nearest piece is extended.  `hint` is where the last search ended.
    pub(super) fn at(&self, site: usize, t: f64, range: (Segment, Option<Segment>), hint: &mut usize) -> (f64, f64) {
        self.read(&self.locate(t, range, hint), site)
    }

    /// The instant `t` (s) for all sources, as [`Past::at`] understands it.
    pub(super) fn locate(&self, t: f64, range: (Segment, Option<Segment>), hint: &mut usize) -> Spot {
        let k = self.find(t, range, hint);
        let Piece { from, to } = self.pieces[k];
        let constant = self.dropped + k == 0 && self.first_segment == 0;
        let (part, per) = ((t - from) / (to - from), (to - from).recip());
        let (value, mut rate) = weights(part);
        rate.iter_mut().for_each(|rate| *rate *= per);
        Spot { first: k * NODES * self.sites, constant, part, per, value, rate }
    }

    /// Value and rate of a source at a located instant.
    pub(super) fn read(&self, spot: &Spot, site: usize) -> (f64, f64) {
        let values = &self.values[spot.first..spot.first + NODES * self.sites];
        let first = values[site];
        if spot.constant {
            return (self.values[site], 0.0);
        }
        let (mut value, mut rate) = (first, 0.0);
        for k in 0..NODES - 1 {
            let difference = values[(k + 1) * self.sites + site] - first;
            value += spot.value[k] * difference;
            rate += spot.rate[k] * difference;
        }
        (value, rate)
    }

    /// Values and rates of several sources from `site` on at a located instant.
    pub(super) fn read_block(&self, spot: &Spot, site: usize, (values, rates): (&mut [f64], &mut [f64])) {
        let n = values.len();
        let node = |k: usize| &self.values[spot.first + k * self.sites + site..][..n];
        values.copy_from_slice(node(0));
        rates.fill(0.0);
        if spot.constant {
            return;
        }
        let first = node(0);
        for k in 1..NODES {
            let (of_value, of_rate) = (spot.value[k - 1], spot.rate[k - 1]);
            for ((value, rate), (node, first)) in values.iter_mut().zip(rates.iter_mut()).zip(node(k).iter().zip(first))
            {
                let difference = node - first;
                *value += of_value * difference;
                *rate += of_rate * difference;
            }
        }
    }

    /// Second derivative of a source at a located instant.
    pub(super) fn bend(&self, spot: &Spot, site: usize) -> f64 {
        if spot.constant {
            return 0.0;
        }
        let nodes = std::array::from_fn(|k| self.values[spot.first + k * self.sites + site]);
        curvature(&nodes, spot.part) * spot.per * spot.per
    }

    /// The piece in which `t` (s) lies, or the nearest one of these segments.
    fn find(&self, t: f64, (low, high): (Segment, Option<Segment>), hint: &mut usize) -> usize {
        let first = self.first_piece(low);
        let end = high.map_or(self.pieces.len(), |high| self.first_piece(high));
        let (first, end) = if first < end { (first, end) } else { (end.saturating_sub(1), end.max(1)) };
        let near = hint.wrapping_sub(self.dropped);
        let fits = |k: usize| k >= first && k < end && self.pieces[k].from <= t && t <= self.pieces[k].to;
        let k = if fits(near) {
            near
        } else if fits(near.wrapping_add(1)) {
            near.wrapping_add(1)
        } else {
            let found = first + self.pieces[first..end].partition_point(|piece| piece.to < t);
            found.min(end - 1)
        };
        *hint = k + self.dropped;
        k
    }

    /// Ends of pieces of the newest segment, the latest first, at least `distance` (s) apart; as many as there are and fit.
    pub(super) fn newest_times(&self, out: &mut [f64], distance: f64) -> usize {
        let first = self.starts[self.starts.len() - 1].saturating_sub(self.dropped);
        let newest = &self.pieces[first.min(self.pieces.len())..];
        let begin = newest.first().map(|piece| piece.from);
        let mut count = 0;
        for t in newest.iter().rev().map(|piece| piece.to).chain(begin) {
            if count == out.len() {
                break;
            }
            if count == 0 || out[count - 1] - t >= distance {
                out[count] = t;
                count += 1;
            }
        }
        count
    }

    /// Ends of pieces from `t` (s) on in these segments, ascending; `hint` as for [`Past::at`].
    pub(super) fn ends(&self, t: f64, range: (Segment, Option<Segment>), mut hint: usize) -> impl Iterator<Item = f64> {
        let first = self.find(t, range, &mut hint);
        let end = range.1.map_or(self.pieces.len(), |high| self.first_piece(high));
        self.pieces.get(first..end).unwrap_or_default().iter().map(|piece| piece.to)
    }

    fn first_piece(&self, segment: Segment) -> usize {
        let start = self.starts[segment.saturating_sub(self.first_segment)];
        start.saturating_sub(self.dropped)
    }

    fn nodes(&self, piece: usize, site: usize) -> [f64; NODES] {
        let first = piece * NODES * self.sites + site;
        std::array::from_fn(|k| self.values[first + k * self.sites])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quartic and its slope; a piece holds it exactly.
    fn f(t: f64) -> f64 {
        1.0 + t * (2.0 + t * (-3.0 + t * (0.5 + t)))
    }

    fn slope(t: f64) -> f64 {
        2.0 + t * (-6.0 + t * (1.5 + 4.0 * t))
    }

    fn nodes(from: f64, to: f64, shift: f64) -> Vec<f64> {
        (0..NODES).map(|k| f(from + (to - from) * k as f64 / 4.0) + shift).collect()
    }

    #[test]
    fn a_jump_is_seen_from_either_side_and_a_cut_changes_no_value() {
        let mut past = Past::default();
        past.restart(0.0, &[7.0]);
        past.begin_segment(0.0);
        past.push(0.0, 0.5, &nodes(0.0, 0.5, 0.0));
        past.push(0.5, 1.5, &nodes(0.5, 1.5, 0.0));
        past.cut(1.0);
        past.begin_segment(1.0);
        past.push(1.0, 2.0, &nodes(1.0, 2.0, 10.0));
        let mut hint = 0;
        assert_eq!(past.at(0, -3.0, (0, Some(1)), &mut hint), (7.0, 0.0));
        assert_eq!(past.at(0, 0.1, (0, Some(1)), &mut hint), (7.0, 0.0));
        for t in [0.0, 0.3, 0.5, 0.9, 1.0] {
            let (value, rate) = past.at(0, t, (1, Some(2)), &mut hint);
            assert!((value - f(t)).abs() < 1e-14 && (rate - slope(t)).abs() < 1e-12, "{t}: {value} {rate}");
        }
        assert!((past.at(0, 1.0, (2, None), &mut hint).0 - f(1.0) - 10.0).abs() < 1e-14);
        assert_eq!((past.end(), past.newest()), (2.0, 2));
    }

    #[test]
    fn dropping_keeps_what_is_asked_for() {
        let mut past = Past::default();
        past.restart(0.0, &[0.0]);
        past.begin_segment(0.0);
        for k in 0..1000 {
            let (from, to) = (k as f64 * 0.01, (k + 1) as f64 * 0.01);
            past.push(from, to, &nodes(from, to, 0.0));
            past.drop_before(to - 0.5, 1);
        }
        assert!(past.pieces.len() < 250);
        let mut hint = 0;
        for t in [9.5, 9.75, 10.0] {
            assert!((past.at(0, t, (1, None), &mut hint).0 - f(t)).abs() < 1e-10);
        }
        assert_eq!(past.begin_of(1), 0.0);
        past.cut(9.995);
        assert!(
            (past.end() - 9.995).abs() < 1e-12 && (past.at(0, 9.99, (1, None), &mut hint).0 - f(9.99)).abs() < 1e-10
        );
    }
}

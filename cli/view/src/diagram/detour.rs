//! Lines at right angles that run around parts, for connections that no annotation draws between parts that annotations place.
//!
//! A line runs on a grid: the heights and widths of its two ends, and tracks beside the parts around it.  Of all ways over the grid the cheapest is
//! taken: its length, so much for each bend, and much for what lies on a part or on the line of another connection.  So there always is a way, and
//! one through a part only where its end lies in it.  The search is Dijkstra's (1959); that such grids hold a shortest way around boxes is shown by
//! M. Wybrow, K. Marriott and P. J. Stuckey, "Orthogonal connector routing" (2010).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::geometry::{Extent, Point};

/// Distance of a line from a part, and of the next line from that.
const GAP: f64 = 3.0;
/// How near to a part a line counts as on it.
const NEAR: f64 = 2.0;
/// How near lines of two connections count as one.
const BESIDE: f64 = 1.0;
/// Length that a bend is worth.
const BEND: f64 = 12.0;
/// What a length on a part costs, and on another connection's line.
const ON_PART: f64 = 40.0;
const ON_LINE: f64 = 4.0;
/// Parts so far from both ends may stand in the way.
const WINDOW: f64 = 40.0;
/// Parts in the window of a line; with more of them the line is drawn without a look at what lies under it.
const MOST_PARTS: usize = 40;
/// Grains of a cost, which is an integer for the queue.
const GRAINS: f64 = 1000.0;

/// A piece of a line that is drawn, with the number of the set of connected connectors that it belongs to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    pub(crate) net: usize,
    pub(crate) from: Point,
    pub(crate) to: Point,
}

/// A line from one point to another around `parts`; none where too many of them stand there.
pub(crate) fn detour(parts: &[Extent], drawn: &[Drawn], net: usize, (from, to): (Point, Point)) -> Option<Vec<Point>> {
    let window = grown(&Extent { from, to }, WINDOW);
    let near: Vec<&Extent> = parts.iter().filter(|part| meet(part, &window)).collect();
    if near.len() > MOST_PARTS {
        return None;
    }
    let tracks = |low: f64, high: f64| [low - 2.0 * GAP, low - GAP, high + GAP, high + 2.0 * GAP];
    let xs = near.iter().flat_map(|part| tracks(part.left(), part.right())).chain([from.x, to.x]);
    let ys = near.iter().flat_map(|part| tracks(part.bottom(), part.top())).chain([from.y, to.y]);
    let mut grid = Grid::new(sorted(xs.collect()), sorted(ys.collect()));
    for part in parts {
        grid.lay(&grown(part, NEAR), ON_PART);
    }
    for own in drawn.iter().filter(|own| own.net != net) {
        grid.lay(&grown(&Extent { from: own.from, to: own.to }, BESIDE), ON_LINE);
    }
    grid.way(from, to)
}

fn grown(extent: &Extent, by: f64) -> Extent {
    Extent::new(extent.left() - by, extent.bottom() - by, extent.right() + by, extent.top() + by)
}

fn meet(a: &Extent, b: &Extent) -> bool {
    a.left() < b.right() && b.left() < a.right() && a.bottom() < b.top() && b.bottom() < a.top()
}

fn sorted(mut own: Vec<f64>) -> Vec<f64> {
    own.sort_by(f64::total_cmp);
    own.dedup();
    own
}

/// Points where a line may bend, and what its pieces between neighbouring points cost.
struct Grid {
    xs: Vec<f64>,
    ys: Vec<f64>,
    /// Cost of the piece to the right of a point, and of the piece above it.
    right: Vec<f64>,
    up: Vec<f64>,
}

impl Grid {
    fn new(xs: Vec<f64>, ys: Vec<f64>) -> Self {
        let (mut right, mut up) = (Vec::new(), Vec::new());
        for row in 0..ys.len() {
            for column in 0..xs.len() {
                let length = |along: &[f64], k: usize| along.get(k + 1).map_or(0.0, |next| next - along[k]);
                right.push(length(&xs, column));
                up.push(length(&ys, row));
            }
        }
        Self { xs, ys, right, up }
    }

    /// Makes what lies in a box dearer.
    fn lay(&mut self, on: &Extent, factor: f64) {
        let (left, right, bottom, top) = (on.left(), on.right(), on.bottom(), on.top());
        let shared = |along: &[f64], k: usize, low: f64, high: f64| match along.get(k + 1) {
            Some(next) => (next.min(high) - along[k].max(low)).max(0.0),
            None => 0.0,
        };
        let columns = self.xs.len();
        for (row, &y) in self.ys.iter().enumerate() {
            let is_in_row = bottom < y && y < top;
            let beside = shared(&self.ys, row, bottom, top);
            if !is_in_row && beside == 0.0 {
                continue;
            }
            for (column, &x) in self.xs.iter().enumerate() {
                if is_in_row {
                    self.right[row * columns + column] += factor * shared(&self.xs, column, left, right);
                }
                if left < x && x < right {
                    self.up[row * columns + column] += factor * beside;
                }
            }
        }
    }

    /// The cheapest way, its corners only.
    fn way(&self, from: Point, to: Point) -> Option<Vec<Point>> {
        let columns = self.xs.len();
        let place = |point: Point| {
            let column = self.xs.binary_search_by(|own| own.total_cmp(&point.x)).ok()?;
            let row = self.ys.binary_search_by(|own| own.total_cmp(&point.y)).ok()?;
            Some(row * columns + column)
        };
        let (start, end) = (place(from)?, place(to)?);
        // A state is a point with the direction in which it was reached: 0 lying, 1 standing.
        let mut cost = vec![u64::MAX; 2 * self.right.len()];
        let mut before = vec![usize::MAX; cost.len()];
        let mut queue = BinaryHeap::new();
        for state in [2 * start, 2 * start + 1] {
            cost[state] = 0;
            queue.push(Reverse((0, state)));
        }
        let mut reached = None;
        while let Some(Reverse((own, state))) = queue.pop() {
            if own > cost[state] {
                continue;
            }
            let (point, direction) = (state / 2, state % 2);
            if point == end {
                reached = Some(state);
                break;
            }
            let (row, column) = (point / columns, point % columns);
            let steps = [
                (column + 1 < columns).then(|| (point + 1, 0, self.right[point])),
                (column > 0).then(|| (point - 1, 0, self.right[point - 1])),
                (row + 1 < self.ys.len()).then(|| (point + columns, 1, self.up[point])),
                (row > 0).then(|| (point - columns, 1, self.up[point - columns])),
            ];
            for (next, turned, piece) in steps.into_iter().flatten() {
                let bend = if turned == direction { 0.0 } else { BEND };
                let total = own.saturating_add(((piece + bend) * GRAINS) as u64);
                let next = 2 * next + turned;
                if total < cost[next] {
                    cost[next] = total;
                    before[next] = state;
                    queue.push(Reverse((total, next)));
                }
            }
        }
        let mut corners = Vec::new();
        let mut state = reached?;
        while state != usize::MAX {
            let point = state / 2;
            corners.push(Point::new(self.xs[point % columns], self.ys[point / columns]));
            state = before[state];
        }
        corners.reverse();
        super::layered::straighten(&mut corners);
        Some(corners)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64) -> Extent {
        Extent::new(x - 10.0, y - 10.0, x + 10.0, y + 10.0)
    }

    fn line(parts: &[Extent], drawn: &[Drawn], from: (f64, f64), to: (f64, f64)) -> Vec<Point> {
        let ends = (Point::new(from.0, from.1), Point::new(to.0, to.1));
        let made = detour(parts, drawn, 0, ends).unwrap_or_default();
        assert_eq!((made.first(), made.last()), (Some(&ends.0), Some(&ends.1)), "{made:?}");
        for pair in made.windows(2) {
            assert!(pair[0].x == pair[1].x || pair[0].y == pair[1].y, "{made:?}");
            for part in parts {
                let own = Extent { from: pair[0], to: pair[1] };
                assert!(!meet(&grown(&own, 0.01), &grown(part, -0.1)), "{made:?} runs through {part:?}");
            }
        }
        made
    }

    #[test]
    fn a_free_way_is_straight() {
        assert_eq!(line(&[square(0.0, 0.0), square(50.0, 0.0)], &[], (10.0, 0.0), (40.0, 0.0)).len(), 2);
        assert_eq!(line(&[square(0.0, 0.0), square(50.0, 30.0)], &[], (10.0, 0.0), (40.0, 30.0)).len(), 4);
    }

    #[test]
    fn what_stands_between_is_passed_by() {
        let parts = [square(0.0, 0.0), square(40.0, 0.0), square(80.0, 0.0)];
        let made = line(&parts, &[], (10.0, 0.0), (70.0, 0.0));
        assert!(made.iter().any(|point| point.y.abs() >= 10.0 + NEAR), "{made:?}");
        // From the far side of one part to the far side of another.
        line(&parts, &[], (-10.0, 0.0), (90.0, 0.0));
        line(&parts, &[], (10.0, 0.0), (90.0, 0.0));
        line(&parts, &[], (0.0, 10.0), (80.0, -10.0));
    }

    #[test]
    fn two_connections_do_not_share_a_line() {
        let parts = [square(0.0, 0.0), square(40.0, 0.0), square(80.0, 0.0)];
        let first = line(&parts, &[], (10.0, 0.0), (70.0, 0.0));
        let drawn: Vec<Drawn> = first.windows(2).map(|pair| Drawn { net: 1, from: pair[0], to: pair[1] }).collect();
        let second = line(&parts, &drawn, (10.0, 4.0), (70.0, 4.0));
        let top = |line: &[Point]| line.iter().map(|own| own.y.abs()).fold(0.0, f64::max);
        assert!((top(&first) - top(&second)).abs() >= GAP || first[2].y * second[2].y < 0.0, "{first:?} {second:?}");
    }

    #[test]
    fn a_crowd_and_ends_within_parts_have_answers() {
        let crowd: Vec<Extent> = (0..100).map(|k| square(f64::from(k % 10) * 8.0, f64::from(k / 10) * 8.0)).collect();
        assert!(detour(&crowd, &[], 0, (Point::new(0.0, 0.0), Point::new(70.0, 70.0))).is_none());
        let inside = detour(&[square(0.0, 0.0)], &[], 0, (Point::new(0.0, 0.0), Point::new(50.0, 20.0)));
        assert_eq!(inside.map(|own| own.len()), Some(3));
        let same = Point::new(1.0, 1.0);
        assert_eq!(detour(&[], &[], 0, (same, same)), Some(vec![same]));
    }
}

//! The accepted points of the solution that the sensitivities have still to pass, and the solution between them.
//!
//! Steps of the sensitivities span several steps of the solution, so some points wait.  Between two points the solution
//! is the cubic that values and rates at both define (Hermite); its error is far below the influence that it has on
//! derivatives.

use crate::delay::end_on;

/// Accepted points of the solution that may wait for the sensitivities.
const MOST_WAITING: usize = 48;

/// A point of the solution.
#[derive(Debug)]
struct Point {
    t: f64,
    y: Vec<f64>,
    yp: Vec<f64>,
}

/// Points of the solution from the newest point of the sensitivities on.
#[derive(Debug)]
pub(super) struct Trail {
    points: Vec<Point>,
    count: usize,
    n: usize,
    /// The first point is that of a restart, where algebraic unknowns have no rates yet.
    fresh: bool,
}

impl Trail {
    /// Room for points of n unknowns.
    pub(super) fn new(n: usize) -> Self {
        Self { points: Vec::new(), count: 0, n, fresh: false }
    }

    /// Forgets all points.
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Begins anew at a point.
    pub(super) fn restart(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        self.count = 0;
        self.take(t, y, yp);
        self.fresh = true;
    }

    /// Takes a further point; `differential` tells which unknowns have rates at a restart.
    pub(super) fn push(&mut self, t: f64, y: &[f64], yp: &[f64], differential: &[bool]) {
        self.take(t, y, yp);
        if std::mem::take(&mut self.fresh) && self.count == 2 {
            let h = t - self.points[0].t;
            for (k, _) in differential.iter().enumerate().filter(|(_, differential)| !**differential) {
                let slope = (y[k] - self.points[0].y[k]) / h;
                self.points[0].yp[k] = 2.0 * slope - yp[k];
            }
        }
    }

    fn take(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        if self.count == self.points.len() {
            let n = self.n;
            self.points.push(Point { t, y: vec![0.0; n], yp: vec![0.0; n] });
        }
        let point = &mut self.points[self.count];
        point.t = t;
        point.y.copy_from_slice(y);
        point.yp.copy_from_slice(yp);
        self.count += 1;
    }

    /// True if no further point should wait.
    pub(super) fn is_full(&self) -> bool {
        self.count > MOST_WAITING
    }

    /// Time of the last point (s).
    pub(super) fn end(&self) -> f64 {
        self.points[..self.count].last().map_or(f64::NEG_INFINITY, |point| point.t)
    }

    /// The step of the solution that leads over a time between the first and the last point (s).
    pub(super) fn step_over(&self, t: f64) -> f64 {
        let points = &self.points[..self.count];
        let right = points.iter().position(|point| point.t > t).unwrap_or(points.len().saturating_sub(1));
        if right == 0 { 0.0 } else { points[right].t - points[right - 1].t }
    }

    /// Where a step of about `h` (s) from `from` (s) should end: on a point of the solution, or evenly between two; see [`end_on`].
    pub(super) fn end_of_step(&self, from: f64, steps: (f64, f64)) -> Option<f64> {
        end_on(self.points[..self.count].iter().map(|point| point.t), from, steps)
    }

    /// How many points lie behind `from` and up to `to` (s).
    pub(super) fn points_within(&self, from: f64, to: f64) -> usize {
        self.points[..self.count].iter().filter(|point| point.t > from && point.t <= to).count()
    }

    /// The solution at a time between the first and the last point.
    pub(super) fn values(&self, t: f64, y: &mut [f64], yp: &mut [f64]) {
        let points = &self.points[..self.count];
        let right = points.iter().position(|point| point.t >= t).unwrap_or(points.len() - 1);
        let b = &points[right];
        if b.t == t || right == 0 {
            y.copy_from_slice(&b.y);
            yp.copy_from_slice(&b.yp);
            return;
        }
        let a = &points[right - 1];
        let h = b.t - a.t;
        let (x, per_h) = ((t - a.t) / h, h.recip());
        let ends = a.y.iter().zip(&a.yp).zip(b.y.iter().zip(&b.yp));
        for (((&ya, &ra), (&yb, &rb)), (y, yp)) in ends.zip(y.iter_mut().zip(yp.iter_mut())) {
            let slope = (yb - ya) * per_h;
            let (curve, bend) = (3.0 * slope - 2.0 * ra - rb, ra + rb - 2.0 * slope);
            *y = ya + h * x * (ra + x * (curve + x * bend));
            *yp = ra + x * (2.0 * curve + 3.0 * x * bend);
        }
    }

    /// Drops points before `t`, but for the last one of them.
    pub(super) fn drop_before(&mut self, t: f64) {
        let first = self.points[..self.count].iter().rposition(|point| point.t <= t).unwrap_or(0);
        self.points[..self.count].rotate_left(first);
        self.count -= first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_trail_is_exact_for_cubics() {
        let f = |t: f64| 1.0 + t * t * t;
        let mut trail = Trail::new(1);
        trail.restart(0.0, &[f(0.0)], &[0.0]);
        for t in [0.5, 1.0] {
            trail.push(t, &[f(t)], &[3.0 * t * t], &[true]);
        }
        let (mut y, mut yp) = ([0.0], [0.0]);
        trail.values(0.7, &mut y, &mut yp);
        assert!((y[0] - f(0.7)).abs() < 1e-15 && (yp[0] - 3.0 * 0.49).abs() < 1e-14);
        trail.drop_before(0.7);
        trail.push(2.0, &[9.0], &[12.0], &[true]);
        trail.values(1.5, &mut y, &mut yp);
        assert!((y[0] - f(1.5)).abs() < 1e-14);
        assert_eq!(trail.end(), 2.0);
    }

    #[test]
    fn an_algebraic_unknown_needs_no_rate_at_a_restart() {
        let mut trail = Trail::new(1);
        trail.restart(1.0, &[1.0], &[f64::NAN]);
        trail.push(2.0, &[4.0], &[4.0], &[false]);
        let (mut y, mut yp) = ([0.0], [0.0]);
        trail.values(1.5, &mut y, &mut yp);
        assert!((y[0] - 2.25).abs() < 1e-15 && (yp[0] - 3.0).abs() < 1e-15);
    }
}

//! The steps of the sensitivities: chosen by their own error, on the accepted points of the solution where possible.
//!
//! The linear equations of the sensitivities have coefficients along the solution, so they are as rough as the model is: where
//! a contact closes without an event, `s'` jumps although `y'` does not.  Therefore order and step are their own.  A step
//! ends on a point of the solution when one is near, skips points while the error allows, and goes between two points (on the
//! cubic Hermite interpolant) when it must.  The error estimate is that of variable-coefficient backward differences,
//! `h / (t_n - t_{n-k-1}) |s_n - predicted|` (Brenan, Campbell, Petzold 1996, section 5.2.4), over differential unknowns,
//! relative to the largest derivative so far, the worst direction counting.

/// Accepted points of the solution that may wait for the sensitivities.
const MOST_WAITING: usize = 8;
/// Attempts after which a step is taken as it is: closer to a jump of the coefficients nothing is gained.
pub(super) const MOST_ATTEMPTS: u32 = 12;
/// Growth and shrinking of steps.
const MOST_GROWTH: f64 = 4.0;
const LEAST: f64 = 0.1;

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
}

impl Trail {
    /// Room for points of n unknowns.
    pub(super) fn new(n: usize) -> Self {
        let point = || Point { t: 0.0, y: vec![0.0; n], yp: vec![0.0; n] };
        Self { points: (0..MOST_WAITING + 2).map(|_| point()).collect(), count: 0 }
    }

    /// Begins anew at a point.
    pub(super) fn restart(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        self.count = 0;
        self.push(t, y, yp);
    }

    /// Takes a further point.
    pub(super) fn push(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        let point = &mut self.points[self.count];
        point.t = t;
        point.y.copy_from_slice(y);
        point.yp.copy_from_slice(yp);
        self.count += 1;
    }

    /// True if no further point fits.
    pub(super) fn is_full(&self) -> bool {
        self.count > MOST_WAITING
    }

    /// Time of the last point (s).
    pub(super) fn end(&self) -> f64 {
        self.points[..self.count].last().map_or(f64::NEG_INFINITY, |point| point.t)
    }

    /// Where a step of size `h` from `t` should end: on a point if one is near, not beyond the last.
    pub(super) fn target(&self, t: f64, h: f64) -> f64 {
        let near = t + 0.5 * h..=t + 1.2 * h;
        let snapped = self.points[..self.count].iter().rev().map(|point| point.t).find(|time| near.contains(time));
        snapped.unwrap_or_else(|| {
            let rest = self.end() - t;
            if 1.2 * h >= rest {
                self.end()
            } else if 2.0 * h > rest {
                t + 0.5 * rest
            } else {
                t + h
            }
        })
    }

    /// The solution at a time between the first and the last point; the rates of algebraic unknowns count as theirs, so
    /// points must have them.
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
        let x = (t - a.t) / h;
        for k in 0..y.len() {
            let slope = (b.y[k] - a.y[k]) / h;
            let (left, bend) = (a.yp[k], a.yp[k] + b.yp[k] - 2.0 * slope);
            let curve = 3.0 * slope - 2.0 * left - b.yp[k];
            y[k] = a.y[k] + h * x * (left + x * (curve + x * bend));
            yp[k] = left + x * (2.0 * curve + 3.0 * x * bend);
        }
    }

    /// Drops points before `t`, but for the last one of them.
    pub(super) fn drop_before(&mut self, t: f64) {
        let first = self.points[..self.count].iter().rposition(|point| point.t <= t).unwrap_or(0);
        self.points[..self.count].rotate_left(first);
        self.count -= first;
    }
}

/// Order and step wanted next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control {
    pub(super) h: f64,
    pub(super) order: usize,
    /// Still growing after a restart.
    ramp: bool,
    attempts: u32,
}

impl Control {
    /// After a restart: order 1, and the first step of the solution.
    pub(super) fn new() -> Self {
        Self { h: f64::INFINITY, order: 1, ramp: true, attempts: 0 }
    }

    /// The attempt in hand cannot be made smaller.
    pub(super) fn insist(&mut self) {
        self.attempts = MOST_ATTEMPTS;
    }

    /// After an attempt of size `h`: true if it stands.  `errors` at the order below (if any), at the order, above (if known).
    pub(super) fn judge(&mut self, h: f64, errors: [Option<f64>; 3], most_order: usize) -> bool {
        let k = self.order;
        let factor = |error: f64, order: usize| (2.0 * error + 1e-6).powf(-1.0 / (order + 1) as f64);
        let error = errors[1].unwrap_or(0.0);
        self.attempts += 1;
        if (error > 1.0 || !error.is_finite()) && self.attempts < MOST_ATTEMPTS {
            let shrunk = if error.is_finite() { 0.9 * factor(error, k) } else { LEAST };
            self.h = h * shrunk.clamp(LEAST, 0.7);
            self.ramp = false;
            if self.attempts >= 2 {
                self.order = 1;
            }
            return false;
        }
        self.attempts = 0;
        let mut best = (factor(error, k), k);
        if let Some(below) = errors[0].filter(|_| k > 1) {
            let found = factor(below, k - 1);
            if found > best.0 {
                best = (found, k - 1);
            }
        }
        if let Some(above) = errors[2].filter(|_| k < most_order) {
            let found = factor(above, k + 1);
            if found > best.0 {
                best = (found, k + 1);
            }
        }
        self.order = best.1.min(most_order).max(1);
        self.h = h * best.0.clamp(0.2, MOST_GROWTH);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_trail_is_exact_for_cubics_and_snaps() {
        let f = |t: f64| 1.0 + t * t * t;
        let mut trail = Trail::new(1);
        trail.restart(0.0, &[f(0.0)], &[0.0]);
        for t in [0.5, 1.0] {
            trail.push(t, &[f(t)], &[3.0 * t * t]);
        }
        let (mut y, mut yp) = ([0.0], [0.0]);
        trail.values(0.7, &mut y, &mut yp);
        assert!((y[0] - f(0.7)).abs() < 1e-15 && (yp[0] - 3.0 * 0.49).abs() < 1e-14);
        assert_eq!([trail.target(0.0, 0.6), trail.target(0.0, 0.1), trail.target(0.0, 9.0)], [0.5, 0.1, 1.0]);
        trail.drop_before(0.7);
        trail.push(2.0, &[9.0], &[12.0]);
        trail.values(1.5, &mut y, &mut yp);
        assert!((y[0] - f(1.5)).abs() < 1e-14);
    }
}

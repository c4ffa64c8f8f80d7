//! Times of a run, and values between them: a cubic through four neighbours.

/// Times of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct Span {
    /// First time (s).
    pub start: f64,
    /// Last time (s).
    pub stop: f64,
    /// Number of equal intervals.
    pub intervals: usize,
}

impl Span {
    /// Distance of the output points (s).
    pub fn step(&self) -> f64 {
        (self.stop - self.start) / self.intervals as f64
    }

    /// The value of a series on the output points at a time (s), and its rate of change (1/s): the cubic through four neighbours;
    /// outside of the span the value at its end.
    pub fn at(&self, series: &[f64], time: f64) -> (f64, f64) {
        let n = series.len();
        if n < 4 {
            return (series.first().copied().unwrap_or(f64::NAN), 0.0);
        }
        let place = (time - self.start) / self.step();
        if place <= 0.0 {
            return (series[0], 0.0);
        }
        if place >= (n - 1) as f64 {
            return (series[n - 1], 0.0);
        }
        let left = (place.floor() as usize).clamp(1, n - 3);
        let s = place - left as f64;
        let y = &series[left - 1..left + 3];
        // Newton's form of the cubic through s = -1, 0, 1, 2.
        let (d0, d1, d2) = (y[1] - y[0], y[2] - y[1], y[3] - y[2]);
        let (e0, e1) = ((d1 - d0) / 2.0, (d2 - d1) / 2.0);
        let f = (e1 - e0) / 3.0;
        let value = y[0] + (s + 1.0) * (d0 + s * (e0 + (s - 1.0) * f));
        let slope = d0 + (2.0 * s + 1.0) * e0 + (3.0 * s * s - 1.0) * f;
        (value, slope / self.step())
    }
}

#[cfg(test)]
mod tests {
    use super::Span;

    #[test]
    fn cubics_are_met_exactly() {
        let span = Span { start: -1.0, stop: 2.0, intervals: 12 };
        let cubic = |t: f64| 1.0 - t + 0.5 * t * t - 2.0 * t * t * t;
        let rate = |t: f64| -1.0 + t - 6.0 * t * t;
        let series: Vec<f64> = (0..=12).map(|k| cubic(-1.0 + 0.25 * f64::from(k))).collect();
        for t in [-0.99, -0.5, 0.1, 1.3, 1.99] {
            let (value, slope) = span.at(&series, t);
            assert!((value - cubic(t)).abs() < 1e-12 && (slope - rate(t)).abs() < 1e-11, "{t}");
        }
        assert_eq!(span.at(&series, 3.0), (series[12], 0.0));
    }
}

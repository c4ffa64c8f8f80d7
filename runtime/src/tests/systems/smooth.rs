//! Smooth systems with closed-form solutions.
#![allow(clippy::disallowed_methods)]

use super::{Model, numbered};
use hyd_system::Pattern;

/// x' = -x, x(0) = 1: x = exp(-t).
pub(crate) struct Decay;

impl Model for Decay {
    fn names(&self) -> Vec<String> {
        vec!["x".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![1.0]
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] + y[0];
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state[0] = 1.0;
        rate[0] = 1.0;
    }
}

/// x' = v, v' = -x from (1, 0): x = cos t.
pub(crate) struct Oscillator;

impl Model for Oscillator {
    fn names(&self) -> Vec<String> {
        vec!["x".into(), "v".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![1.0, 0.0]
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - y[1];
        out[1] = yp[1] + y[0];
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state.copy_from_slice(&[0.0, 1.0, -1.0, 0.0]);
        rate.copy_from_slice(&[1.0, 0.0, 0.0, 1.0]);
    }
}

/// Linear index-1 DAE: x' = -2x + z, 0 = x + z - sin t, so x' = -3x + sin t with x(0) = 1.
/// x = (3 sin t - cos t)/10 + 1.1 exp(-3t), z = sin t - x.
pub(crate) struct LinearDae;

impl LinearDae {
    pub(crate) fn exact(t: f64) -> [f64; 2] {
        let x = (3.0 * t.sin() - t.cos()) / 10.0 + 1.1 * (-3.0 * t).exp();
        [x, t.sin() - x]
    }
}

impl Model for LinearDae {
    fn names(&self) -> Vec<String> {
        vec!["x".into(), "z".into()]
    }
    fn start(&self) -> Vec<f64> {
        vec![1.0, 55.0]
    }
    fn differential(&self) -> Vec<bool> {
        vec![true, false]
    }
    fn residual(&self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] + 2.0 * y[0] - y[1];
        out[1] = y[0] + y[1] - t.sin();
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state.copy_from_slice(&[2.0, 1.0, -1.0, 1.0]);
        rate.copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
    }
}

/// Heat conduction on n inner points of (0, 1), ends at 0, start sin(pi x).  The semi-discrete solution is
/// exp(-lambda t) sin(pi x_k) with lambda = 4 (n+1)^2 sin^2(pi / (2(n+1))).
pub(crate) struct Heat(pub usize);

impl Heat {
    pub(crate) fn rate(&self) -> f64 {
        let m = (self.0 + 1) as f64;
        4.0 * m * m * (std::f64::consts::FRAC_PI_2 / m).sin().powi(2)
    }
}

impl Model for Heat {
    fn names(&self) -> Vec<String> {
        numbered("T", self.0)
    }
    fn start(&self) -> Vec<f64> {
        let m = (self.0 + 1) as f64;
        (1..=self.0).map(|k| (std::f64::consts::PI * k as f64 / m).sin()).collect()
    }
    fn patterns(&self) -> (Pattern, Pattern) {
        let n = self.0 as u32;
        let band = (0..n).flat_map(|k| (k.saturating_sub(1)..(k + 2).min(n)).map(move |c| (k, c)));
        let diagonal: Vec<(u32, u32)> = (0..n).map(|k| (k, k)).collect();
        (Pattern::from_pairs(self.0, self.0, &band.collect::<Vec<_>>()), Pattern::from_pairs(self.0, self.0, &diagonal))
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let s = ((self.0 + 1) as f64).powi(2);
        let at = |k: usize| y.get(k).copied().unwrap_or(0.0);
        for k in 0..self.0 {
            let left = if k > 0 { y[k - 1] } else { 0.0 };
            out[k] = yp[k] - s * (left - 2.0 * y[k] + at(k + 1));
        }
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        let s = ((self.0 + 1) as f64).powi(2);
        let mut entry = 0;
        for c in 0..self.0 {
            for row in c.saturating_sub(1)..(c + 2).min(self.0) {
                state[entry] = if row == c { 2.0 * s } else { -s };
                entry += 1;
            }
        }
        rate.fill(1.0);
    }
}

/// A pressure line in n cells: p_i' = n (q_i - q_{i+1}), q_i' = n (p_{i-1} - p_i) - r q_i, closed at the right end (q_{n+1} = 0),
/// inlet pressure p_0 = 1 - exp(-t / tau).  Unknowns p_1, q_1, p_2, q_2, ...  For t much larger than tau and 1/r the line is at
/// rest with p = 1, q = 0; the undamped cell frequency is 2 n.
pub(crate) struct Line {
    pub cells: usize,
    pub friction: f64,
    pub tau: f64,
}

impl Line {
    /// Row and value of dF/dy in a column, rows ascending.
    fn entries(&self, column: usize) -> [Option<(usize, f64)>; 3] {
        let s = self.cells as f64;
        if column.is_multiple_of(2) {
            // p_k: in the rows of q_k and q_{k+1}.
            let next = (column + 3 < 2 * self.cells).then_some((column + 3, -s));
            [Some((column + 1, s)), next, None]
        } else {
            // q_k: in the rows of p_{k-1}, p_k and its own.
            let left = (column >= 3).then(|| (column - 3, s));
            [left, Some((column - 1, -s)), Some((column, self.friction))]
        }
    }
}

impl Model for Line {
    fn names(&self) -> Vec<String> {
        (1..=self.cells).flat_map(|k| [format!("p{k}"), format!("q{k}")]).collect()
    }
    fn start(&self) -> Vec<f64> {
        vec![0.0; 2 * self.cells]
    }
    fn patterns(&self) -> (Pattern, Pattern) {
        let n = 2 * self.cells;
        let mut pairs = Vec::new();
        for column in 0..n {
            pairs.extend(self.entries(column).into_iter().flatten().map(|(row, _)| (row as u32, column as u32)));
        }
        let diagonal: Vec<(u32, u32)> = (0..n as u32).map(|k| (k, k)).collect();
        (Pattern::from_pairs(n, n, &pairs), Pattern::from_pairs(n, n, &diagonal))
    }
    fn residual(&self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let s = self.cells as f64;
        let inlet = 1.0 - (-t / self.tau).exp();
        for k in 0..self.cells {
            let (p, q) = (y[2 * k], y[2 * k + 1]);
            let left = if k > 0 { y[2 * k - 2] } else { inlet };
            let next = y.get(2 * k + 3).copied().unwrap_or(0.0);
            out[2 * k] = yp[2 * k] - s * (q - next);
            out[2 * k + 1] = yp[2 * k + 1] - s * (left - p) + self.friction * q;
        }
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        let mut values = state.iter_mut();
        for column in 0..2 * self.cells {
            for (_, value) in self.entries(column).into_iter().flatten() {
                *values.next().expect("invariant: the pattern was made of the same entries") = value;
            }
        }
        rate.fill(1.0);
    }
}

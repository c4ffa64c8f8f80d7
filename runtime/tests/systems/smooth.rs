//! Smooth systems with closed-form solutions.

use super::{Model, numbered};
use hyd_system::Pattern;

/// x' = -x, x(0) = 1: x = exp(-t).
pub struct Decay;

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
pub struct Oscillator;

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
pub struct LinearDae;

impl LinearDae {
    pub fn exact(t: f64) -> [f64; 2] {
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
pub struct Heat(pub usize);

impl Heat {
    pub fn rate(&self) -> f64 {
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

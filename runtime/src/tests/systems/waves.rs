//! Wave systems without damping, with closed-form solutions.
#![allow(clippy::disallowed_methods)]

use std::f64::consts::PI;

use super::{Model, numbered};
use hyd_system::Pattern;

/// A string of n points between fixed ends: y_k' = v_k, v_k' = m^2 (y_{k-1} - 2 y_k + y_{k+1}) with m = n + 1, started in its first
/// mode: y_k = sin(pi k / m) cos(omega t) with omega = 2 m sin(pi / (2 m)).  The highest frequency is nearly 2 m.
/// Unknowns y_1, v_1, y_2, v_2, ...
pub(crate) struct Cord(pub usize);

impl Cord {
    pub(crate) fn frequency(&self) -> f64 {
        let m = (self.0 + 1) as f64;
        2.0 * m * (PI / (2.0 * m)).sin()
    }
}

impl Model for Cord {
    fn names(&self) -> Vec<String> {
        let (y, v) = (numbered("y", self.0), numbered("v", self.0));
        y.into_iter().zip(v).flat_map(|(y, v)| [y, v]).collect()
    }
    fn start(&self) -> Vec<f64> {
        let m = (self.0 + 1) as f64;
        (1..=self.0).flat_map(|k| [(PI * k as f64 / m).sin(), 0.0]).collect()
    }
    fn patterns(&self) -> (Pattern, Pattern) {
        let n = self.0 as u32;
        let mut pairs = Vec::new();
        for k in 0..n {
            pairs.push((2 * k, 2 * k + 1));
            pairs.extend((k.saturating_sub(1)..(k + 2).min(n)).map(|c| (2 * k + 1, 2 * c)));
        }
        let diagonal: Vec<(u32, u32)> = (0..2 * n).map(|k| (k, k)).collect();
        let size = 2 * self.0;
        (Pattern::from_pairs(size, size, &pairs), Pattern::from_pairs(size, size, &diagonal))
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let s = ((self.0 + 1) as f64).powi(2);
        for k in 0..self.0 {
            let left = if k > 0 { y[2 * k - 2] } else { 0.0 };
            let right = y.get(2 * k + 2).copied().unwrap_or(0.0);
            out[2 * k] = yp[2 * k] - y[2 * k + 1];
            out[2 * k + 1] = yp[2 * k + 1] - s * (left - 2.0 * y[2 * k] + right);
        }
    }
    fn jacobian(&self, _t: f64, _y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        let s = ((self.0 + 1) as f64).powi(2);
        let mut entry = 0;
        for k in 0..self.0 {
            // Column of y_k: the rows of v_{k-1}, v_k, v_{k+1}; column of v_k: the row of y_k.
            for row in k.saturating_sub(1)..(k + 2).min(self.0) {
                state[entry] = if row == k { 2.0 * s } else { -s };
                entry += 1;
            }
            state[entry] = -1.0;
            entry += 1;
        }
        rate.fill(1.0);
    }
}

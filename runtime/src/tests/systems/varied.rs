//! A system with a parameter that decides how it runs, and whether a rate has a value to the end.

use super::{Model, numbered};

/// Van der Pol's oscillator with `mu` of ten times the parameter, and three unknowns that follow it one after the other.  With parameters above
/// 3 a rate has no value after 0.7 s.
pub(crate) struct Varied {
    parameter: f64,
}

/// Five, so that the last tile of four is filled up.
const UNKNOWNS: usize = 5;

impl Varied {
    pub(crate) fn new() -> Self {
        Self { parameter: 1.0 }
    }
}

impl Model for Varied {
    fn names(&self) -> Vec<String> {
        numbered("x", UNKNOWNS)
    }
    fn start(&self) -> Vec<f64> {
        vec![2.0, 0.1, 0.1, 0.1, 0.1]
    }
    fn differential(&self) -> Vec<bool> {
        vec![true; UNKNOWNS]
    }
    fn set(&mut self, value: f64) -> bool {
        self.parameter = value;
        true
    }
    fn residual(&self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let mu = 10.0 * self.parameter;
        let end = if self.parameter > 3.0 { (0.7 - t).sqrt() } else { 0.0 };
        out[0] = yp[0] - mu * y[1] - end;
        out[1] = yp[1] - mu * (mu * (1.0 - y[0] * y[0]) * y[1] - y[0]);
        for k in 2..UNKNOWNS {
            out[k] = yp[k] - self.parameter * k as f64 * (y[k - 1] - y[k]) + y[k] * y[k] * y[k];
        }
    }
    fn jacobian(&self, _t: f64, y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        let mu = 10.0 * self.parameter;
        (0..UNKNOWNS).for_each(|k| rate[k * UNKNOWNS + k] = 1.0);
        let mut set = |row: usize, column: usize, value: f64| state[column * UNKNOWNS + row] = value;
        set(0, 1, -mu);
        set(1, 0, mu * (2.0 * mu * y[0] * y[1] + 1.0));
        set(1, 1, -mu * mu * (1.0 - y[0] * y[0]));
        for (k, y) in y.iter().enumerate().skip(2) {
            let pace = self.parameter * k as f64;
            set(k, k - 1, -pace);
            set(k, k, pace + 3.0 * y * y);
        }
    }
}

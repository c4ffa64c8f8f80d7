//! A system with a parameter that decides how it runs: stiff swings, algebraic unknowns, an event, and for some values no end.

use super::{Model, numbered};
use hyd_system::math::sin;
use hyd_system::{EventChange, EventPhase};

/// Van der Pol's oscillator with `mu` of ten times the parameter, which drives a chain of so many unknowns that follow; the last of four or
/// more is algebraic.  From `jump` (s) on it is driven.  With parameters above 3 a rate has no value after 0.7 s.
pub(crate) struct Varied {
    pub n: usize,
    pub jump: f64,
    parameter: f64,
    driven: bool,
}

impl Varied {
    pub(crate) fn new(n: usize, jump: f64) -> Self {
        Self { n, jump, parameter: 1.0, driven: false }
    }

    fn has_algebraic(&self) -> bool {
        self.n >= 4
    }

    fn mu(&self) -> f64 {
        10.0 * self.parameter
    }
}

impl Model for Varied {
    fn names(&self) -> Vec<String> {
        numbered("x", self.n)
    }
    fn start(&self) -> Vec<f64> {
        let mut start = vec![0.1; self.n];
        start[0] = 2.0;
        start
    }
    fn differential(&self) -> Vec<bool> {
        (0..self.n).map(|k| !self.has_algebraic() || k + 1 < self.n).collect()
    }
    fn set(&mut self, value: f64) -> bool {
        self.parameter = value;
        true
    }
    fn bind(&mut self) {
        self.driven = false;
    }
    fn residual(&self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let (n, mu) = (self.n, self.mu());
        let force = if self.driven { sin(5.0 * self.parameter * t) } else { 0.0 };
        let end = if self.parameter > 3.0 { (0.7 - t).sqrt() } else { 0.0 };
        if n == 1 {
            out[0] = yp[0] + mu * (y[0] - force) + end;
            return;
        }
        out[0] = yp[0] - mu * y[1] - end;
        out[1] = yp[1] - mu * (mu * (1.0 - y[0] * y[0]) * y[1] - y[0] + force);
        for k in 2..n {
            out[k] = yp[k] - self.parameter * k as f64 * (y[k - 1] - y[k]) + y[k] * y[k] * y[k];
        }
        if self.has_algebraic() {
            out[n - 1] = y[n - 1] + 0.1 * y[n - 1] * y[n - 1] * y[n - 1] - y[0] * y[2];
        }
    }
    fn jacobian(&self, _t: f64, y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        let (n, mu) = (self.n, self.mu());
        (0..n).filter(|&k| self.differential()[k]).for_each(|k| rate[k * n + k] = 1.0);
        if n == 1 {
            state[0] = mu;
            return;
        }
        let mut set = |row: usize, column: usize, value: f64| state[column * n + row] = value;
        set(0, 1, -mu);
        set(1, 0, mu * (2.0 * mu * y[0] * y[1] + 1.0));
        set(1, 1, -mu * mu * (1.0 - y[0] * y[0]));
        for (k, y) in y.iter().enumerate().skip(2) {
            let pace = self.parameter * k as f64;
            set(k, k - 1, -pace);
            set(k, k, pace + 3.0 * y * y);
        }
        if self.has_algebraic() {
            set(n - 1, n - 2, 0.0);
            set(n - 1, n - 1, 1.0 + 0.3 * y[n - 1] * y[n - 1]);
            set(n - 1, 0, -y[2]);
            set(n - 1, 2, -y[0]);
        }
    }
    fn next_time_event(&self, t: f64) -> f64 {
        if t < self.jump { self.jump } else { f64::INFINITY }
    }
    fn event(&mut self, _phase: EventPhase, t: f64, _y: &mut [f64], _yp: &[f64]) -> EventChange {
        let driven = t >= self.jump;
        let changed = std::mem::replace(&mut self.driven, driven) != driven;
        EventChange { changed, ..EventChange::default() }
    }
    fn assertion(&self, _t: f64, y: &[f64]) -> Option<(&'static str, bool)> {
        (y[0] < -2.0).then_some(("x1 is far out", false))
    }
}

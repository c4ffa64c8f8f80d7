//! The last accepted step: values at its two ends, and what the method knows in between.

use super::tableau::{END_CURVATURE, END_SLOPE, STAGES, dense};

/// A step from one accepted point to the next.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct LastStep {
    /// Its ends, and its length, which is 0 before the first (s).
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) h: f64,
    /// Values at its beginning, and at its end with their rates.
    pub(super) start: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) yp: Vec<f64>,
    /// `K_1 .. K_6`, one after the other; an attempt at the next step writes its own over them.
    pub(super) rates: Vec<f64>,
    /// `h^2 y''` and `h^3 y'''` at its end.
    bend: Vec<f64>,
    twist: Vec<f64>,
}

impl LastStep {
    /// Room for n unknowns.
    pub(super) fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            from: 0.0,
            to: 0.0,
            h: 0.0,
            start: zeros(),
            y: zeros(),
            yp: zeros(),
            rates: vec![0.0; STAGES * n],
            bend: zeros(),
            twist: zeros(),
        }
    }

    /// There is no last step: values and rates stand in `y` and `yp`.
    pub(super) fn restart(&mut self, t: f64) {
        (self.from, self.to, self.h) = (t, t, 0.0);
        self.bend.fill(0.0);
        self.twist.fill(0.0);
    }

    /// Values and rates at a time within the step.
    pub(super) fn at(&self, t: f64, y: &mut [f64], yp: &mut [f64]) {
        if self.h == 0.0 {
            y.copy_from_slice(&self.y);
            yp.copy_from_slice(&self.yp);
            return;
        }
        let theta = (t - self.from) / self.h;
        y.copy_from_slice(&self.start);
        yp.fill(0.0);
        for (i, rates) in self.rates.chunks_exact(self.y.len().max(1)).enumerate() {
            let (b, slope) = dense(i, theta);
            let b = b * self.h;
            for ((y, yp), rate) in y.iter_mut().zip(yp.iter_mut()).zip(rates) {
                *y += b * rate;
                *yp += slope * rate;
            }
        }
    }

    /// Its end becomes the start of the next one; what bends there is kept.
    pub(super) fn leave(&mut self) {
        let n = self.y.len();
        if self.h > 0.0 {
            for k in 0..n {
                let (mut bend, mut twist) = (0.0, 0.0);
                for i in 0..STAGES {
                    let rate = self.rates[i * n + k];
                    bend += END_SLOPE[i] * rate;
                    twist += END_CURVATURE[i] * rate;
                }
                (self.bend[k], self.twist[k]) = (bend, 0.5 * twist);
            }
        }
        self.start.copy_from_slice(&self.y);
        self.rates[..n].copy_from_slice(&self.yp);
    }

    /// Adds to each rate what it changes by until `ahead`, a time behind the end in units of the step.
    pub(super) fn bend(&self, ahead: f64, rates: &mut [f64]) {
        for ((rate, bend), twist) in rates.iter_mut().zip(&self.bend).zip(&self.twist) {
            *rate += ahead * (bend + ahead * twist);
        }
    }
}

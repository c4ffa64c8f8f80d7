//! The past of a solution as modified divided differences: coefficients, prediction and dense output.
//!
//! Fixed-leading-coefficient BDF of order `k`: `y_n` interpolates the last `k + 1` values, and its derivative is
//! `y'_n = y'_pred + c (y_n - y_pred)` with `c = sum_{j=1..k} 1/j / h` whatever the spacing of the past, so that the
//! iteration matrix changes only with `h` and `k`.
//! Sources: Brenan, Campbell, Petzold 1996, section 5.2; Jackson, Sacks-Davis, ACM TOMS 6 (1980) 295; Krogh, Math. Comp. 28
//! (1974) 1057 for the update of modified differences.
//!
//! Glossary: `phi_j` modified divided difference of order j; `psi_j = t_n - t_{n-j-1}` sums of past steps;
//! `alpha_j = h/psi_j`; `beta_j` ratio that brings `phi_j` to the new step; `sigma_j` factor from `phi_{j+1}` to the error
//! of order j; `gamma_j` derivative of the predictor's j-th basis polynomial; `steady` number of steps of equal size and
//! order.  At order `k` only `phi_0..phi_{k+1}` are meaningful.

use crate::tiled::{LANES, Tile, Tiled, over_tiles};

/// Highest order; BDF of order 6 has too small a region of stability.
pub(super) const MAX_ORDER: usize = 5;

/// Number of stored differences: orders 0 to 6.
const STORED: usize = MAX_ORDER + 2;

/// `sum_{j=1..k} 1/j` by order.
const HARMONIC: [f64; MAX_ORDER + 1] = {
    let mut sums = [0.0; MAX_ORDER + 1];
    let mut k = 1;
    while k <= MAX_ORDER {
        sums[k] = sums[k - 1] + 1.0 / k as f64;
        k += 1;
    }
    sums
};

/// Differences and coefficients.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct History {
    n: usize,
    /// Tiles of a difference.
    width: usize,
    phi: Vec<Tile>,
    psi: [f64; STORED],
    alpha: [f64; STORED],
    beta: [f64; STORED],
    gamma: [f64; STORED],
    pub(super) sigma: [f64; STORED],
    /// Time of the newest point (s); during a step the time stepped to.
    pub(super) t: f64,
    /// Step in work, or to try next (s).
    pub(super) h: f64,
    /// Order in work, or to try next.
    pub(super) order: usize,
    /// Last accepted step (s) and its order (0 before the first).
    pub(super) h_used: f64,
    pub(super) order_used: usize,
    pub(super) steady: usize,
    /// Leading coefficient `c` of the step in work [1/s].
    pub(super) leading: f64,
    /// Factor from `|y - y_pred|` to the local error at the order in work.
    pub(super) error_constant: f64,
}

impl History {
    pub(super) fn new(n: usize) -> Self {
        let zero = [0.0; STORED];
        let width = n.div_ceil(LANES);
        Self {
            n,
            width,
            phi: vec![[0.0; LANES]; STORED * width],
            psi: zero,
            alpha: zero,
            beta: zero,
            gamma: zero,
            sigma: zero,
            t: 0.0,
            h: 0.0,
            order: 1,
            h_used: 0.0,
            order_used: 0,
            steady: 0,
            leading: 0.0,
            error_constant: 1.0,
        }
    }

    /// Difference of order `j` in tiles.
    #[inline(always)]
    pub(super) fn tiles(&self, j: usize) -> &[Tile] {
        &self.phi[j * self.width..(j + 1) * self.width]
    }

    /// Difference of order `j`.
    pub(super) fn phi(&self, j: usize) -> &[f64] {
        &self.tiles(j).as_flattened()[..self.n]
    }

    fn phi_mut(&mut self, j: usize) -> &mut [f64] {
        let range = j * self.width..(j + 1) * self.width;
        &mut self.phi[range].as_flattened_mut()[..self.n]
    }

    /// `phi_j := factor phi_j`.
    #[inline(always)]
    fn scale(&mut self, j: usize, factor: f64) {
        let range = j * self.width..(j + 1) * self.width;
        self.phi[range].as_flattened_mut().iter_mut().for_each(|value| *value *= factor);
    }

    /// Forgets the past: order 1 from `(t, y, y')` with first step `h`.
    pub(super) fn restart(&mut self, t: f64, y: &[f64], yp: &[f64], h: f64) {
        self.phi.fill([0.0; LANES]);
        self.phi_mut(0).copy_from_slice(y);
        for (target, rate) in self.phi_mut(1).iter_mut().zip(yp) {
            *target = h * rate;
        }
        (self.t, self.h, self.order) = (t, h, 1);
        (self.h_used, self.order_used, self.steady) = (0.0, 0, 0);
        self.psi = [0.0; STORED];
        self.psi[0] = h;
    }

    /// Takes over a known past: `phi_j` from the values at `t, t - h, .., t - order h`, which `value` writes; next step `h`.
    pub(super) fn resume(&mut self, t: f64, h: f64, order: usize, mut value: impl FnMut(f64, &mut [f64])) {
        self.phi.fill([0.0; LANES]);
        for j in 0..=order {
            value(t - j as f64 * h, self.phi_mut(j));
        }
        // Backward differences in place; with equal spacing they are the modified divided differences.
        let width = self.width;
        for j in 1..=order {
            for i in (j..=order).rev() {
                let (low, high) = self.phi.split_at_mut(i * width);
                let newer = low[(i - 1) * width..].as_flattened();
                for (value, newer) in high[..width].as_flattened_mut().iter_mut().zip(newer) {
                    *value = newer - *value;
                }
            }
        }
        for (j, psi) in self.psi.iter_mut().enumerate() {
            *psi = (j + 1) as f64 * h;
        }
        (self.t, self.h, self.order) = (t, h, order);
        (self.h_used, self.order_used, self.steady) = (h, order, 0);
    }

    /// Coefficients for a step of size `h` at the order in work; brings the differences to the new step and moves `t`.
    #[inline(always)]
    pub(super) fn advance(&mut self, target: f64) -> f64 {
        let (h, k) = (self.h, self.order);
        if h != self.h_used || k != self.order_used {
            self.steady = 0;
        }
        self.steady = (self.steady + 1).min(self.order_used + 2);
        if k + 1 >= self.steady {
            (self.beta[0], self.alpha[0], self.gamma[0], self.sigma[0]) = (1.0, 1.0, 0.0, 1.0);
            let (mut sum, per_step) = (h, h.recip());
            for i in 1..=k {
                let old = self.psi[i - 1];
                self.psi[i - 1] = sum;
                // The divisions do not wait for each other.
                self.beta[i] = self.beta[i - 1] * (sum / old);
                sum = old + h;
                self.alpha[i] = h / sum;
                self.sigma[i] = i as f64 * self.sigma[i - 1] * self.alpha[i];
                self.gamma[i] = self.gamma[i - 1] + self.alpha[i - 1] * per_step;
            }
            self.psi[k] = sum;
        }
        let fixed = HARMONIC[k];
        let variable: f64 = self.alpha[..k].iter().sum();
        self.leading = fixed / h;
        self.error_constant = (self.alpha[k] - fixed + variable).abs().max(self.alpha[k]);
        for j in self.steady..=k {
            self.scale(j, self.beta[j]);
        }
        std::mem::replace(&mut self.t, target)
    }

    /// Undoes `advance` after a rejected step; `t` is the time before it.
    pub(super) fn retreat(&mut self, t: f64) {
        self.t = t;
        let k = self.order;
        for j in 1..=k {
            self.psi[j - 1] = self.psi[j] - self.h;
        }
        for j in self.steady..=k {
            self.scale(j, self.beta[j].recip());
        }
    }

    /// After a rejected step: another size for the next attempt, with the start of a first step kept in shape.
    pub(super) fn resize(&mut self, factor: f64) {
        self.h *= factor;
        if self.order_used == 0 {
            self.psi[0] = self.h;
            self.scale(1, factor);
        }
    }

    /// Replaces the size of the next step.
    pub(super) fn set_step(&mut self, h: f64) {
        if h != self.h {
            self.resize(h / self.h);
            self.h = h;
            if self.order_used == 0 {
                self.psi[0] = h;
            }
        }
    }

    /// Prediction at the new time: `y = sum phi_j`, `y' = sum gamma_j phi_j`.
    #[inline(always)]
    pub(super) fn predict(&self, y: &mut Tiled, yp: &mut Tiled) {
        let (width, phi, gammas) = (self.width, self.phi.as_slice(), &self.gamma[1..=self.order]);
        let (y, yp) = (&mut y.tiles_mut()[..width], &mut yp.tiles_mut()[..width]);
        over_tiles(
            width,
            #[inline(always)]
            || {
                for k in 0..width {
                    let (mut value, mut rate) = (phi[k], [0.0; LANES]);
                    for (j, gamma) in gammas.iter().enumerate() {
                        let phi = &phi[(j + 1) * width + k];
                        for lane in 0..LANES {
                            value[lane] += phi[lane];
                            rate[lane] += gamma * phi[lane];
                        }
                    }
                    (y[k], yp[k]) = (value, rate);
                }
            },
        );
    }

    /// Takes the accepted correction `e = y - y_pred` into the differences.  `order` is still that of the step.
    #[inline(always)]
    pub(super) fn accept(&mut self, correction: &Tiled, max_order: usize) {
        let k = self.order;
        self.order_used = k;
        self.h_used = self.h;
        let (width, phi) = (self.width, self.phi.as_mut_slice());
        let correction = &correction.tiles()[..width];
        over_tiles(
            width,
            #[inline(always)]
            || {
                for (at, correction) in correction.iter().enumerate() {
                    let mut sum = *correction;
                    if k < max_order {
                        phi[(k + 1) * width + at] = sum;
                    }
                    for j in (0..=k).rev() {
                        let own = &mut phi[j * width + at];
                        for lane in 0..LANES {
                            sum[lane] += own[lane];
                        }
                        *own = sum;
                    }
                }
            },
        );
    }

    /// The interpolant of the last accepted step at time `at`, value and derivative.
    /// Newton's form on the past points: `c_j = prod_{i<j} (at - t_{n-i}) / psi_i`, `d_j` its derivative.
    pub(super) fn at(&self, at: f64, y: &mut [f64], yp: &mut [f64]) {
        let order = self.order_used.max(1);
        let delta = at - self.t;
        let (mut c, mut d) = (1.0, 0.0);
        let mut ratio = delta / self.psi[0];
        y.copy_from_slice(self.phi(0));
        yp.fill(0.0);
        for j in 1..=order {
            d = d * ratio + c / self.psi[j - 1];
            c *= ratio;
            ratio = (delta + self.psi[j - 1]) / self.psi[j];
            for ((y, yp), phi) in y.iter_mut().zip(yp.iter_mut()).zip(self.phi(j)) {
                *y += c * phi;
                *yp += d * phi;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of uneven size over a cubic: from order 3 on, prediction, its slope and dense output are exact.
    #[test]
    fn a_cubic_is_reproduced_at_order_three() {
        let f = |t: f64| 1.0 + t - 2.0 * t * t + 0.5 * t * t * t;
        let slope = |t: f64| 1.0 - 4.0 * t + 1.5 * t * t;
        // So many that the last tile is not full.
        let n = 7;
        // Component `i` is `i + 1` cubics, so that none can stand for another.
        let times = |x: f64| (1..=n).map(|i| i as f64 * x).collect::<Vec<f64>>();
        let is_near = |ours: &Tiled, x: f64, most: f64| ours.iter().zip(times(x)).all(|(a, b)| (a - b).abs() < most);
        let mut history = History::new(n);
        history.restart(0.0, &times(f(0.0)), &times(slope(0.0)), 0.1);
        let (mut y, mut yp, mut correction) = (Tiled::zeros(n), Tiled::zeros(n), Tiled::zeros(n));
        for (step, h) in [0.1, 0.13, 0.13, 0.2, 0.17, 0.3].into_iter().enumerate() {
            history.set_step(h);
            history.order = (step + 1).min(3);
            let target = history.t + h;
            history.advance(target);
            history.predict(&mut y, &mut yp);
            if step > 3 {
                assert!(is_near(&y, f(target), 1e-12), "prediction at {target}");
                assert!(is_near(&yp, slope(target), 1e-11));
            }
            // A rejected attempt must leave no trace.
            history.retreat(target - h);
            history.advance(target);
            history.predict(&mut y, &mut yp);
            for (missed, (y, exact)) in correction.iter_mut().zip(y.iter().zip(times(f(target)))) {
                *missed = exact - y;
            }
            history.accept(&correction, 5);
        }
        let at = history.t - 0.11;
        history.at(at, &mut y, &mut yp);
        assert!(is_near(&y, f(at), 1e-12) && is_near(&yp, slope(at), 1e-11));
        assert!(history.phi.as_flattened()[n..8].iter().all(|&filling| filling == 0.0));
    }
}

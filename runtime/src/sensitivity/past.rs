//! The past of the sensitivities: derivative formula and interpolation.
//!
//! The backward differentiation formula of variable coefficients on the points as they lie: the derivative at `t_n` of the
//! polynomial through the newest `k + 1` values, `s'_n = a_0 s_n + sum_j a_j s_{n-j}` (Brenan, Campbell, Petzold 1996,
//! section 5.1).  Its changing leading coefficient costs nothing, because the matrix of the sensitivities is renewed at each
//! step anyway.

/// Highest order of the formula.
pub(super) const MAX_ORDER: usize = 5;
/// Points kept: those that the prediction at one order above the highest needs.
const KEPT: usize = MAX_ORDER + 2;

/// Weights of the newest points.
pub(super) type Weights = [f64; KEPT + 1];

/// Values at the newest points, newest first.
#[derive(Debug)]
pub(super) struct Past {
    times: [f64; KEPT],
    values: Vec<Vec<f64>>,
    count: usize,
    /// Order of the newest step.
    order: usize,
}

impl Past {
    /// Room for points of `length` values.
    pub(super) fn new(length: usize) -> Self {
        Self { times: [0.0; KEPT], values: (0..KEPT).map(|_| vec![0.0; length]).collect(), count: 0, order: 0 }
    }

    /// Forgets everything but this point.
    pub(super) fn restart(&mut self, t: f64, values: &[f64]) {
        (self.count, self.order) = (0, 0);
        self.push(t, 0, values);
    }

    /// Takes a new point, reached with a step of this order.
    pub(super) fn push(&mut self, t: f64, order: usize, values: &[f64]) {
        self.times.rotate_right(1);
        self.values.rotate_right(1);
        self.times[0] = t;
        self.values[0].copy_from_slice(values);
        self.count = (self.count + 1).min(KEPT);
        self.order = order;
    }

    /// Time of the newest point (s).
    pub(super) fn newest(&self) -> f64 {
        self.times[0]
    }

    /// Number of points.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Forgets all points but the newest.
    pub(super) fn forget(&mut self) {
        self.count = self.count.min(1);
    }

    /// The polynomial of order `k` through the newest `k + 1` points, at `t`, and the factor from its distance to the error
    /// of the formula.  None if there are not enough points.
    pub(super) fn predict(&self, t: f64, order: usize, values: &mut [f64]) -> Option<f64> {
        let nodes = self.times[..self.count].get(..=order)?;
        values.fill(0.0);
        for (j, &node) in nodes.iter().enumerate() {
            let others = nodes.iter().enumerate().filter(|&(i, _)| i != j);
            let weight: f64 = others.map(|(_, &other)| (t - other) / (node - other)).product();
            add(values, weight, &self.values[j]);
        }
        Some((t - nodes[0]) / (t - nodes[order]))
    }

    /// Weights of the derivative at the new time `t`: entry 0 for the value there, entry `j` for the `j`-th newest point [1/s].
    pub(super) fn derivative_weights(&self, t: f64, order: usize) -> Weights {
        let mut weights = [0.0; KEPT + 1];
        let nodes = &self.times[..order];
        for (j, &node) in nodes.iter().enumerate() {
            weights[0] += 1.0 / (t - node);
            let others = nodes.iter().enumerate().filter(|&(i, _)| i != j);
            let product: f64 = others.map(|(_, &other)| (t - other) / (node - other)).product();
            weights[j + 1] = product / (node - t);
        }
        weights
    }

    /// `base := sum_{j>=1} a_j s_{n-j}`
    pub(super) fn combine(&self, weights: &Weights, order: usize, base: &mut [f64]) {
        base.fill(0.0);
        for (values, &weight) in self.values[..order].iter().zip(&weights[1..]) {
            add(base, weight, values);
        }
    }

    /// The newest values.
    pub(super) fn last(&self) -> &[f64] {
        &self.values[0]
    }

    /// Value and derivative at a time within the newest step.
    pub(super) fn interpolate(&self, t: f64, values: &mut [f64], rates: &mut [f64]) {
        values.fill(0.0);
        rates.fill(0.0);
        let nodes = &self.times[..(self.order + 1).min(self.count)];
        for (j, &node) in nodes.iter().enumerate() {
            // Basis polynomial and its derivative by the product rule.
            let (mut value, mut rate) = (1.0, 0.0);
            for (_, &other) in nodes.iter().enumerate().filter(|&(i, _)| i != j) {
                rate = (rate * (t - other) + value) / (node - other);
                value *= (t - other) / (node - other);
            }
            add(values, value, &self.values[j]);
            add(rates, rate, &self.values[j]);
        }
    }
}

fn add(sum: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On uneven points the formulas are exact for polynomials of their order.
    #[test]
    fn a_cubic_is_exact_at_order_three() {
        let f = |t: f64| 1.0 - t + 0.5 * t * t - 2.0 * t * t * t;
        let slope = |t: f64| -1.0 + t - 6.0 * t * t;
        let mut past = Past::new(1);
        past.restart(0.0, &[f(0.0)]);
        for (k, t) in [0.1, 0.25, 0.3].into_iter().enumerate() {
            past.push(t, k + 1, &[f(t)]);
        }
        let t = 0.5;
        let weights = past.derivative_weights(t, 3);
        let mut base = [0.0];
        past.combine(&weights, 3, &mut base);
        assert!((weights[0] * f(t) + base[0] - slope(t)).abs() < 1e-13);
        let (mut value, mut rate) = ([0.0], [0.0]);
        past.interpolate(0.27, &mut value, &mut rate);
        assert!((value[0] - f(0.27)).abs() < 1e-14 && (rate[0] - slope(0.27)).abs() < 1e-12);
    }
}

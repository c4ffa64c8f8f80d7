//! What is known of a parameter before the measurement, and how it is counted in standard deviations.
//!
//! Every unknown of a fit is a number `xi` with the prior N(0, 1); a [`Prior`] says what parameter value it stands for.  A
//! lognormal prior is `median * exp(s * xi)`, a uniform one is mapped by the logistic function (its ends are never reached).

use hyd_system::math::{exp, ln};

use crate::Fault;

/// A distribution.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Prior {
    /// Mean and standard deviation.
    Normal(f64, f64),
    /// Median and standard deviation of the logarithm.
    Lognormal(f64, f64),
    /// Ends.
    Uniform(f64, f64),
}

/// Slope of the logistic function that comes closest to the normal distribution.
const LOGISTIC: f64 = 1.702;

impl Prior {
    /// Reads `normal(m, s)`, `lognormal(m, s)` or `uniform(a, b)`.
    ///
    /// # Errors
    /// When the text is none of these or the numbers make no distribution.
    pub fn parse(text: &str) -> Result<Self, Fault> {
        let wrong = || {
            Fault::new(format!(
                "`{text}` is not a prior; write `normal(m, s)`, `lognormal(median, s)` or `uniform(a, b)`"
            ))
        };
        let (kind, rest) = text.trim().split_once('(').ok_or_else(wrong)?;
        let numbers =
            rest.trim().strip_suffix(')').ok_or_else(wrong)?.split(',').map(|part| part.trim().parse::<f64>());
        let numbers = numbers.collect::<Result<Vec<_>, _>>().map_err(|_| wrong())?;
        let [a, b] = numbers[..] else { return Err(wrong()) };
        let prior = match kind.trim() {
            "normal" if b > 0.0 => Prior::Normal(a, b),
            "lognormal" if a > 0.0 && b > 0.0 => Prior::Lognormal(a, b),
            "uniform" if b > a => Prior::Uniform(a, b),
            _ => return Err(wrong()),
        };
        if a.is_finite() && b.is_finite() { Ok(prior) } else { Err(wrong()) }
    }

    /// The parameter value of `xi`.
    pub fn value(&self, xi: f64) -> f64 {
        match *self {
            Prior::Normal(m, s) => m + s * xi,
            Prior::Lognormal(m, s) => m * exp(s * xi),
            Prior::Uniform(a, b) => a + (b - a) / (1.0 + exp(-LOGISTIC * xi)),
        }
    }

    /// `d value/d xi`.
    pub fn slope(&self, xi: f64) -> f64 {
        match *self {
            Prior::Normal(_, s) => s,
            Prior::Lognormal(m, s) => s * m * exp(s * xi),
            Prior::Uniform(a, b) => {
                let share = 1.0 / (1.0 + exp(-LOGISTIC * xi));
                LOGISTIC * (b - a) * share * (1.0 - share)
            }
        }
    }

    /// The `xi` of a parameter value, held within +-`limit`; it never falls as the value grows, whatever the value.
    pub fn xi(&self, value: f64, limit: f64) -> f64 {
        let xi = match *self {
            Prior::Normal(m, s) => (value - m) / s,
            Prior::Lognormal(m, s) => ln((value / m).max(0.0)) / s,
            Prior::Uniform(a, b) => {
                let value = value.clamp(a, b);
                ln((value - a) / (b - value)) / LOGISTIC
            }
        };
        if xi.is_nan() { 0.0 } else { xi.clamp(-limit, limit) }
    }

    /// A value in the middle.
    pub fn centre(&self) -> f64 {
        self.value(0.0)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::Prior;

    #[test]
    fn values_and_their_inverses() {
        for text in ["normal(3, 0.5)", "lognormal(2e-3, 0.7)", "uniform(1, 1.4)"] {
            let prior = Prior::parse(text).unwrap();
            for xi in [-2.0, -0.3, 0.0, 1.7] {
                assert!((prior.xi(prior.value(xi), 9.0) - xi).abs() < 1e-9, "{text} at {xi}");
                let difference = (prior.value(xi + 1e-6) - prior.value(xi - 1e-6)) / 2e-6;
                assert!((prior.slope(xi) / difference - 1.0).abs() < 1e-6, "{text} at {xi}");
            }
        }
    }

    #[test]
    fn values_that_cannot_be_are_at_the_ends() {
        for text in ["normal(3, 0.5)", "lognormal(2e-3, 0.7)", "uniform(1, 1.4)"] {
            let prior = Prior::parse(text).unwrap();
            let values = [-1e9, -1.0, 0.0, 1e-9, 0.5, 1.0, 1.2, 1.4, 1.5, 1e9];
            let xi: Vec<f64> = values.iter().map(|&value| prior.xi(value, 12.0)).collect();
            assert!(xi.is_sorted() && xi[0] == -12.0 && xi[9] == 12.0, "{text}: {xi:?}");
        }
    }

    #[test]
    fn what_is_no_prior_is_refused() {
        for text in
            ["", "normal(1)", "normal(1, -1)", "lognormal(0, 1)", "uniform(2, 1)", "cauchy(0, 1)", "normal(1, inf)"]
        {
            assert!(Prior::parse(text).is_err(), "{text}");
        }
    }
}

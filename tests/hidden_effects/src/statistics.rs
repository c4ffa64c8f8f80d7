//! Shares with their exact intervals, medians, and the normal distribution.
//!
//! Intervals of shares are those of Clopper and Pearson (Biometrika 26, 1934), by bisection of the binomial distribution.

/// So many of so many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Those that are counted.
    pub hits: usize,
    /// All.
    pub all: usize,
}

impl Share {
    /// Counts the elements that fulfil a condition.
    pub fn of<T>(list: &[T], condition: impl Fn(&T) -> bool) -> Share {
        Share { hits: list.iter().filter(|own| condition(own)).count(), all: list.len() }
    }

    /// The share; not a number where there is nothing.
    pub fn value(self) -> f64 {
        self.hits as f64 / self.all as f64
    }

    /// The 95 % interval.
    pub fn interval(self) -> (f64, f64) {
        if self.all == 0 {
            return (0.0, 1.0);
        }
        let low = if self.hits == 0 { 0.0 } else { root(|p| 1.0 - below(self.hits - 1, self.all, p) - 0.025) };
        let high = if self.hits == self.all { 1.0 } else { root(|p| 0.025 - below(self.hits, self.all, p)) };
        (low, high)
    }

    /// As in tables: `38/41 = 93 % (80-98)`.
    pub fn shown(self) -> String {
        if self.all == 0 {
            return "no trial".into();
        }
        let (low, high) = self.interval();
        let percent = |p: f64| {
            let number = format!("{:.1}", 100.0 * p);
            number.strip_suffix(".0").map_or(number.clone(), String::from)
        };
        format!("{}/{} = {} % ({} to {})", self.hits, self.all, percent(self.value()), percent(low), percent(high))
    }
}

/// Probability of at most `hits` of `all`.
fn below(hits: usize, all: usize, p: f64) -> f64 {
    if p <= 0.0 {
        return 1.0;
    }
    if p >= 1.0 {
        return if hits >= all { 1.0 } else { 0.0 };
    }
    let mut logarithm = all as f64 * (1.0 - p).ln();
    let mut sum = logarithm.exp();
    for k in 1..=hits {
        logarithm += ((all + 1 - k) as f64 / k as f64).ln() + (p / (1.0 - p)).ln();
        sum += logarithm.exp();
    }
    sum.min(1.0)
}

/// Where a function that grows from negative to positive on (0, 1) is zero.
fn root(function: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if function(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The value at this part of the sorted list; none for an empty one.
pub fn quantile(values: &[f64], part: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let place = (part * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(place).copied()
}

/// Share of a normal distribution below `x` (Abramowitz, Stegun 26.2.17; error below 1e-7).
pub fn normal_share(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let poly =
        t * (0.319_381_530 + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    let tail = (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt() * poly;
    if x >= 0.0 { 1.0 - tail } else { tail }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact intervals as tabulated (Clopper, Pearson 1934; Newcombe 1998, table I).
    #[test]
    fn intervals_of_shares() {
        for (hits, all, low, high) in [(81, 263, 0.2527, 0.3676), (15, 148, 0.0578, 0.1617), (0, 20, 0.0, 0.1684)] {
            let found = Share { hits, all }.interval();
            assert!((found.0 - low).abs() < 1e-4 && (found.1 - high).abs() < 1e-4, "{found:?}");
        }
        assert_eq!(Share { hits: 3, all: 4 }.shown(), "3/4 = 75 % (19.4 to 99.4)");
    }

    #[test]
    fn quantiles_leave_out_what_is_no_number() {
        assert_eq!(quantile(&[3.0, f64::NAN, 1.0, 2.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[], 0.5), None);
    }
}

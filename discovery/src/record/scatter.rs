//! Noise of a record: from differences of neighbours, from the part before the trigger, and the step of the numbers.
//!
//! Differences of a high order leave out what is smooth; for white noise their variance is `binomial(2p, p)` times that of the noise
//! at order `p` (a generalisation of von Neumann, "Distribution of the ratio of the mean square successive difference to the variance",
//! 1941).  Their quartiles leave out what is fast and rare.  The third differences are enough where a record has many samples for
//! every change of the signal; where it has few, the order is raised until the estimate no longer falls (the variate difference
//! method: Anderson, "The Statistical Analysis of Time Series", section 3.4).  Noise that is correlated from sample to sample looks
//! smaller in differences than before the trigger.

use hyd_system::math::square;

use super::{drift, median};

/// Fewest differences from which noise is taken.
const FEWEST: usize = 20;
/// Distance of the quartiles of a normal distribution in standard deviations.
const QUARTILES: f64 = 1.348_98;
/// Orders of the differences: the first that is tried and the highest.
const ORDERS: (usize, usize) = (3, 10);
/// An estimate is settled where neither of the next two orders falls below it by more than this share, or by more than the second
/// number over the root of the number of differences, which is chance.
const SETTLED: (f64, f64) = (0.15, 4.0);
/// Steps of time within a difference differ by no more than this factor.
const EVEN: f64 = 1.5;
/// Equal samples in a row that are no chance under a noise without steps.
const ROW: usize = 3;
/// Share of samples in such rows from which on they are looked at: the quartiles of the differences hardly see fewer.
const FLAT: f64 = 0.1;
/// Smallest noise, as a part of the range, that is more than the digits of a simulated record.
pub(super) const SEEN: f64 = 1e-6;
/// Samples that share a level where there are few levels.
const LEVELS: usize = 5;
/// Most samples that are searched for the step of the numbers.
const MOST: usize = 20_000;
/// How far a distance of neighbouring values may be from a multiple of the step, in steps.
const NEAR: f64 = 0.1;
/// Share of the distances that are multiples of the step.
const SHARE: f64 = 0.98;

/// Noise by the differences of neighbouring samples.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Scatter {
    /// Standard deviation of the noise and rounding together (unit of the values).
    pub sigma: f64,
    /// Step of the numbers, if they have one.
    pub step: Option<f64>,
    /// Number of differences.
    pub samples: usize,
    /// False if the estimate still falls with the order of the differences: the signal changes too much from sample to sample, and
    /// the noise is smaller than this.
    pub is_settled: bool,
}

impl Scatter {
    /// Standard deviation without the rounding to steps, whose variance is a twelfth of the square of the step.
    pub(crate) fn without_rounding(&self) -> f64 {
        let rounding = square(self.step.unwrap_or(0.0)) / 12.0;
        (self.sigma * self.sigma - rounding).max(0.0).sqrt()
    }
}

/// The part of a record before the trigger.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Quiet {
    /// Mean.
    pub level: f64,
    /// Standard deviation about a straight line.
    pub sigma: f64,
    /// Number of samples.
    pub samples: usize,
}

/// Noise by differences of neighbours; none where there are fewer than twenty.
///
/// Where a channel has a value in every tenth row only, those rows are its neighbours.
pub(crate) fn scatter(times: &[f64], values: &[f64]) -> Option<Scatter> {
    let record = Neighbours::of(times, values)?;
    let own = |order: usize| record.sigma(order);
    let first = own(ORDERS.0)?;
    // Of numbers that hardly leave their steps each order says something else.
    let is_rounded = record.step.is_some_and(|step| step > first.0);
    let (sigma, is_settled) = if is_rounded { (first.0, true) } else { settle(first, own) };
    Some(Scatter { sigma, step: record.step, samples: first.1, is_settled })
}

/// The estimate that no longer falls with the order of the differences, and whether there is one; `first` is that of the lowest order.
fn settle(first: (f64, usize), own: impl Fn(usize) -> Option<(f64, usize)>) -> (f64, bool) {
    let (mut order, (mut sigma, samples)) = (ORDERS.0, first);
    let chance = SETTLED.0.max(SETTLED.1 / (samples as f64).sqrt());
    loop {
        let next = [own(order + 1), own(order + 2)];
        if !next.iter().flatten().any(|(next, _)| *next < (1.0 - chance) * sigma) {
            return (sigma, true);
        }
        let Some((higher, _)) = next[0].filter(|_| order < ORDERS.1) else { return (sigma, false) };
        (order, sigma) = (order + 1, sigma.min(higher));
    }
}

/// What third differences show: the noise, and what the signal changes from sample to sample beside a parabola.
pub(super) fn unevenness(times: &[f64], values: &[f64]) -> Option<Scatter> {
    let record = Neighbours::of(times, values)?;
    let (sigma, samples) = record.sigma(ORDERS.0)?;
    Some(Scatter { sigma, step: record.step, samples, is_settled: true })
}

/// The samples of a record that have a value.
struct Neighbours {
    times: Vec<f64>,
    values: Vec<f64>,
    /// The longest step of time within a difference (s).
    longest: f64,
    step: Option<f64>,
    /// Samples that stand in a row of equal ones.
    flat: Vec<bool>,
    /// Differences with such samples are left out.
    without_flat: bool,
}

impl Neighbours {
    fn of(times: &[f64], values: &[f64]) -> Option<Self> {
        let finite = times.iter().zip(values).filter(|(t, v)| t.is_finite() && v.is_finite());
        let (times, values): (Vec<f64>, Vec<f64>) = finite.map(|(t, v)| (*t, *v)).unzip();
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let longest = EVEN * median(&mut steps)?;
        let step = step(&values);
        let flat = flat(&values);
        let mut own = Self { times, values, longest, step, flat, without_flat: false };
        own.without_flat = own.hides_noise();
        Some(own)
    }

    /// Do parts in which nothing changes, as where the range of a sensor ends, hide a noise that is seen elsewhere?
    fn hides_noise(&self) -> bool {
        let flat = self.flat.iter().filter(|flat| **flat).count();
        // A recorder of coarse steps stands still anywhere.
        if self.step.is_some() || (flat as f64) < FLAT * self.values.len() as f64 {
            return false;
        }
        let (low, high) =
            self.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
        let without = |order: usize| self.sigma_of(order, true);
        let Some(first) = without(ORDERS.0) else { return false };
        let (sigma, is_settled) = settle(first, without);
        is_settled && sigma > SEEN * (high - low)
    }

    /// Noise by the differences of one order and their number; none where they are too few.
    fn sigma(&self, order: usize) -> Option<(f64, usize)> {
        self.sigma_of(order, self.without_flat)
    }

    fn sigma_of(&self, order: usize, without_flat: bool) -> Option<(f64, usize)> {
        // 1, -3, 3, -1 for the third ones; all integers up to the highest order are exact.
        let binomial = |n: usize, k: usize| (0..k).fold(1.0, |product, j| product * (n - j) as f64 / (j + 1) as f64);
        let sign = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let factors: Vec<f64> = (0..=order).map(|k| sign(k) * binomial(order, k).round()).collect();
        let is_even = |t: &[f64]| t.windows(2).all(|pair| pair[1] - pair[0] <= self.longest);
        let windows = self.times.windows(order + 1).zip(self.values.windows(order + 1));
        let windows = windows.zip(self.flat.windows(order + 1)).filter(|((t, _), _)| is_even(t));
        let windows = windows.filter(|(_, flat)| !(without_flat && flat.contains(&true))).map(|(window, _)| window);
        let mut differences: Vec<f64> =
            windows.map(|(_, v)| v.iter().rev().zip(&factors).map(|(value, factor)| factor * value).sum()).collect();
        if differences.len() < FEWEST {
            return None;
        }
        differences.sort_unstable_by(f64::total_cmp);
        let spread = quartile(&differences, 3, self.step) - quartile(&differences, 1, self.step);
        Some((spread / QUARTILES / binomial(2 * order, order).sqrt(), differences.len()))
    }
}

/// Samples that stand in a row of equal ones.
fn flat(values: &[f64]) -> Vec<bool> {
    let mut flat = Vec::with_capacity(values.len());
    for run in values.chunk_by(|a, b| a == b) {
        flat.extend(std::iter::repeat_n(run.len() >= ROW, run.len()));
    }
    flat
}

/// A quartile of sorted numbers; equal ones count as spread over their step, as in a table of groups.
fn quartile(sorted: &[f64], number: usize, step: Option<f64>) -> f64 {
    let place = (number * sorted.len() / 4).min(sorted.len() - 1);
    let value = sorted[place];
    let Some(step) = step else { return value };
    let (from, to) = (
        sorted.partition_point(|&own| own < value - 0.5 * step),
        sorted.partition_point(|&own| own < value + 0.5 * step),
    );
    value + step * ((number as f64 * sorted.len() as f64 / 4.0 - from as f64) / (to - from).max(1) as f64 - 0.5)
}

/// Level and noise before `trigger` (s) about a straight line; none for fewer than twenty samples.
pub(crate) fn quiet(times: &[f64], values: &[f64], trigger: f64) -> Option<Quiet> {
    let end = times.partition_point(|&t| t < trigger).min(values.len());
    let line = drift(times.get(..end)?, values.get(..end)?)?;
    (line.samples >= FEWEST).then_some(Quiet { level: line.mean, sigma: line.sigma, samples: line.samples })
}

/// The step of which the distances of the values are multiples; none where there is none, or too few values to tell.
pub(crate) fn step(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).take(MOST).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let largest = sorted.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let rounding = 1e-12 * largest;
    let mut distances: Vec<f64> =
        sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|distance| *distance > rounding).collect();
    // A few levels are steps where many samples share them.
    let shared = distances.len() >= 2 && LEVELS * distances.len() < sorted.len();
    if distances.len() < FEWEST / 2 && !shared {
        return None;
    }
    distances.sort_unstable_by(f64::total_cmp);
    // The commonest distance is one step where values are dense; the smallest one is where they are sparse.
    [distances[distances.len() / 2], distances[0]].into_iter().find_map(|first| {
        let refined = refine(&distances, first);
        let is_multiple = |distance: &&f64| {
            let multiple = **distance / refined;
            // Text rounds values, too; many steps in one distance would add up what is off.
            multiple > 10.0 || multiple > 0.5 && (multiple - multiple.round()).abs() < NEAR
        };
        let multiples = distances.iter().filter(is_multiple).count();
        let single = distances.iter().filter(|distance| **distance < 10.5 * refined).count();
        let is_step = multiples as f64 >= SHARE * distances.len() as f64 && 2 * single > distances.len();
        is_step.then_some(refined)
    })
}

/// The mean of the distances that are one step.
fn refine(distances: &[f64], first: f64) -> f64 {
    let single = || distances.iter().filter(|distance| (**distance / first - 1.0).abs() < 0.3);
    single().sum::<f64>() / single().count().max(1) as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    fn times(count: u32) -> Vec<f64> {
        (0..count).map(|k| f64::from(k) * 1e-4).collect()
    }

    #[test]
    fn noise_is_found_under_a_signal_with_jumps() {
        let mut draws = SplitMix(11);
        let times = times(20_000);
        let signal = |t: f64| 30.0 * (200.0 * t).sin() + if t > 0.7 { 100.0 } else { 0.0 };
        let values: Vec<f64> = times.iter().map(|&t| signal(t) + 0.5 * draws.normal()).collect();
        let found = scatter(&times, &values).unwrap();
        assert!((found.sigma / 0.5 - 1.0).abs() < 0.03, "{found:?}");
        assert_eq!(found.step, None);
        // The same without a noise has none to speak of.
        let smooth: Vec<f64> = times.iter().map(|&t| signal(t)).collect();
        assert!(scatter(&times, &smooth).unwrap().sigma < 1e-4);
    }

    /// Where most of a record stands at the ends of its range, the rest shows the noise; a plunger that rests has none.
    #[test]
    fn flat_parts_hide_no_noise() {
        let mut draws = SplitMix(31);
        let times = times(4000);
        let signal = |k: usize| 0.1 * (k as f64 / 150.0).sin();
        let clipped: Vec<f64> = (0..4000).map(|k| (signal(k) + 2e-4 * draws.normal()).clamp(-0.02, 0.02)).collect();
        let found = scatter(&times, &clipped).unwrap();
        assert!(found.is_settled && (found.sigma / 2e-4 - 1.0).abs() < 0.15, "{found:?}");
        let rests: Vec<f64> = (0..4000).map(|k| signal(k).clamp(-0.02, 0.02)).collect();
        assert!(scatter(&times, &rests).unwrap().sigma < 1e-9, "{:?}", scatter(&times, &rests));
        let switched: Vec<f64> = (0..4000).map(|k| if k / 40 % 2 == 0 { 0.0 } else { 5.0 }).collect();
        assert!(scatter(&times, &switched).unwrap().sigma < 1e-9);
    }

    #[test]
    fn few_samples_a_period_do_not_pass_for_noise() {
        let mut draws = SplitMix(23);
        let times: Vec<f64> = (0..1200).map(|k| f64::from(k) / 610.0).collect();
        // A resonance at 70 Hz has nine samples a period.
        let signal = |t: f64| 0.1 * (std::f64::consts::TAU * 70.0 * t).sin();
        let noisy = |size: f64, draws: &mut SplitMix| -> Vec<f64> {
            times.iter().map(|&t| signal(t) + size * draws.normal()).collect()
        };
        let values = noisy(1e-3, &mut draws);
        let found = scatter(&times, &values).unwrap();
        assert!(found.is_settled && (found.sigma / 1e-3 - 1.0).abs() < 0.15, "{found:?}");
        assert!(unevenness(&times, &values).unwrap().sigma > 5e-3);
        // Too small to be told from the signal: said, and no more than a bound.
        let values = noisy(1e-7, &mut draws);
        let found = scatter(&times, &values).unwrap();
        assert!(!found.is_settled && found.sigma < 1e-3, "{found:?}");
    }

    #[test]
    fn what_settles_at_once_keeps_the_third_differences() {
        let mut draws = SplitMix(29);
        // Correlated noise falls a little with the order; a short record by chance.
        for (count, rho) in [(5000, 0.5), (5000, 0.8), (60, 0.0)] {
            let mut noise = 0.0;
            let values: Vec<f64> = (0..count)
                .map(|_| {
                    noise = rho * noise + draws.normal();
                    noise
                })
                .collect();
            let (own, thirds) = (scatter(&times(count), &values).unwrap(), unevenness(&times(count), &values).unwrap());
            assert_eq!(own, thirds, "{count} {rho}");
        }
    }

    #[test]
    fn steps_of_numbers_are_found_and_taken_out() {
        let mut draws = SplitMix(5);
        let times = times(5000);
        for (step_of, decimals) in [(0.01, 2), (20.0 / 4096.0, 4), (0.25, 6)] {
            let exact: Vec<f64> = times.iter().map(|&t| 3.0 * (90.0 * t).sin() + 0.2 * draws.normal()).collect();
            let written = |value: f64| format!("{value:.decimals$}").parse::<f64>().unwrap();
            let values: Vec<f64> = exact.iter().map(|value| written((value / step_of).round() * step_of)).collect();
            let found = scatter(&times, &values).unwrap();
            let step = found.step.unwrap();
            assert!((step / step_of - 1.0).abs() < 0.02, "{step} instead of {step_of}");
            assert!((found.without_rounding() / 0.2 - 1.0).abs() < 0.1, "{found:?}");
        }
        let constant = vec![1.5; 5000];
        assert_eq!(scatter(&times, &constant).unwrap().sigma, 0.0);
    }

    #[test]
    fn the_part_before_the_trigger_has_its_own_noise() {
        let mut draws = SplitMix(7);
        let times: Vec<f64> = (0..6000).map(|k| f64::from(k) * 1e-4 - 0.2).collect();
        let values: Vec<f64> =
            times.iter().map(|&t| 4.0 + if t >= 0.0 { 1e3 * t } else { 0.0 } + 0.1 * draws.normal()).collect();
        let found = quiet(&times, &values, 0.0).unwrap();
        assert!((found.sigma / 0.1 - 1.0).abs() < 0.05 && (found.level - 4.0).abs() < 0.01, "{found:?}");
        assert_eq!((found.samples, quiet(&times, &values, -0.1995)), (2000, None));
    }
}

//! Recorded inputs: a column of samples over time, evaluated at any time in constant work.
//!
//! A [`Series`] is made once and shared by all runs.  Between samples it holds the last value, follows a straight line, or follows the
//! cubic spline through all samples with natural ends (de Boor, "A Practical Guide to Splines", Springer 2001, chapter IV).
//! A table made beside the samples says how far a step that begins in an interval may lead ([`Series::reach`]): to the
//! next sample that does not continue its neighbours smoothly, and not further than two pieces of a polygon that all samples are
//! close to (Williams, Computer Graphics and Image Processing 8 (1978) 286: the cone of directions), so that no pulse is stepped over.

/// What an input does between its samples.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Hold {
    /// It keeps the value of the sample before.
    Zero,
    /// A straight line from sample to sample.
    #[default]
    Linear,
    /// The natural cubic spline through the samples.
    Smooth,
}

impl Hold {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Hold::Zero => "zero",
            Hold::Linear => "linear",
            Hold::Smooth => "smooth",
        }
    }

    /// What a name means.
    pub fn of(name: &str) -> Option<Self> {
        [Hold::Zero, Hold::Linear, Hold::Smooth].into_iter().find(|hold| hold.name() == name)
    }
}

/// Why samples are no series.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum SeriesError {
    /// There are fewer than two.
    TooFew,
    /// There are more than can be numbered.
    TooMany,
    /// The number of times is not that of values.
    Lengths,
    /// This sample, from 0, has a time or value that is not finite.
    NotFinite(usize),
    /// The time of this sample does not come after that of the one before.
    Order(usize),
}

/// A sample is a corner where it is further than this part of the range of all samples from where its neighbours let expect it.
const CORNER: f64 = 1e-4;
/// The polygon that bounds steps passes all samples within this part of their range.
const POLYGON: f64 = 2e-3;
/// Times are on a grid if they are off by no more than this part of its step.
const ON_GRID: f64 = 1e-3;
/// Slopes that differ by less than this part of the largest one are the same.
const SAME_SLOPE: f64 = 1e-9;

/// Samples over time.
#[derive(Clone, PartialEq, Debug)]
pub struct Series {
    hold: Hold,
    times: Vec<f64>,
    values: Vec<f64>,
    /// Per interval the coefficients of the powers 1 to 3 of the time since its begin.
    linear: Vec<f64>,
    higher: Vec<[f64; 2]>,
    /// Step of the grid that the times stand on, as its inverse (1/s); 0 if there is none.
    per_step: f64,
    /// Per interval: the sample that a step from there may lead to.
    reach: Vec<u32>,
    /// Per interval: the next sample at which the value jumps (hold zero) or the slope does (linear).
    breaks: Vec<u32>,
}

/// Value, slope (1/s) and second derivative of a series at a time.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Sample {
    /// The value.
    pub value: f64,
    /// The first derivative by time.
    pub slope: f64,
    /// The second derivative by time.
    pub curvature: f64,
}

impl Series {
    /// A series of samples at ascending times (s).
    ///
    /// # Errors
    /// What is wrong with the samples.
    pub fn new(times: Vec<f64>, values: Vec<f64>, hold: Hold) -> Result<Self, SeriesError> {
        if times.len() != values.len() {
            return Err(SeriesError::Lengths);
        }
        if times.len() < 2 {
            return Err(SeriesError::TooFew);
        }
        if u32::try_from(times.len()).is_err() {
            return Err(SeriesError::TooMany);
        }
        if let Some(k) = (0..times.len()).find(|&k| !times[k].is_finite() || !values[k].is_finite()) {
            return Err(SeriesError::NotFinite(k));
        }
        if let Some(k) = (1..times.len()).find(|&k| times[k] <= times[k - 1]) {
            return Err(SeriesError::Order(k));
        }
        let slopes: Vec<f64> =
            (1..times.len()).map(|k| (values[k] - values[k - 1]) / (times[k] - times[k - 1])).collect();
        let breaks = match hold {
            Hold::Zero => next(values.len(), |k| values[k] != values[k - 1]),
            Hold::Linear => {
                let largest = slopes.iter().fold(0.0f64, |most, slope| most.max(slope.abs()));
                next(values.len(), |k| k < slopes.len() && (slopes[k] - slopes[k - 1]).abs() > SAME_SLOPE * largest)
            }
            Hold::Smooth => next(values.len(), |_| false),
        };
        let reach = reach(&times, &values, &slopes);
        let (linear, higher) = match hold {
            Hold::Zero => (vec![0.0; slopes.len()], Vec::new()),
            Hold::Linear => (slopes, Vec::new()),
            Hold::Smooth => spline(&times, &slopes),
        };
        Ok(Self { hold, per_step: grid(&times), times, values, linear, higher, reach, breaks })
    }

    /// What it does between samples.
    pub fn hold(&self) -> Hold {
        self.hold
    }

    /// First and last time (s).
    pub fn span(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// Times of the samples (s).
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The samples.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The interval of a time (s), counted from 0: that which begins at the time or before it.  `near`: where the search begins.
    pub fn interval(&self, t: f64, near: usize) -> usize {
        let last = self.linear.len() - 1;
        let holds = |k: usize| self.times[k] <= t && t < self.times[k + 1];
        let near = near.min(last);
        if holds(near) {
            return near;
        }
        if t >= self.times[last] {
            return last;
        }
        if t < self.times[1] || t.is_nan() {
            return 0;
        }
        if near < last && holds(near + 1) {
            return near + 1;
        }
        if self.per_step > 0.0 {
            let guess = (((t - self.times[0]) * self.per_step) as usize).min(last);
            let found = [guess, guess.saturating_sub(1), (guess + 1).min(last)].into_iter().find(|&k| holds(k));
            if let Some(k) = found {
                return k;
            }
        }
        self.times.partition_point(|time| *time <= t) - 1
    }

    /// The series at a time (s) by the law of an interval, which for a held value may be the last sample, too.  Before the first sample it has its value, behind the last one that.
    pub fn at(&self, t: f64, interval: usize) -> Sample {
        let (first, last) = self.span();
        if self.hold == Hold::Zero || t < first {
            let sample = interval.min(self.values.len() - 1);
            return Sample { value: self.values[sample], ..Sample::default() };
        }
        let interval = interval.min(self.linear.len() - 1);
        if t > last {
            return Sample { value: self.values[self.values.len() - 1], ..Sample::default() };
        }
        let (s, value, slope) = (t - self.times[interval], self.values[interval], self.linear[interval]);
        let Some(&[second, third]) = self.higher.get(interval) else {
            return Sample { value: value + s * slope, slope, curvature: 0.0 };
        };
        Sample {
            value: value + s * (slope + s * (second + s * third)),
            slope: slope + s * (2.0 * second + 3.0 * s * third),
            curvature: 2.0 * second + 6.0 * s * third,
        }
    }

    /// How far a step from a time (s) in an interval may lead (s); infinite from the last sample on.
    pub fn reach(&self, interval: usize, t: f64) -> f64 {
        match self.reach.get(interval) {
            Some(&k) if self.times[k as usize] > t => self.times[k as usize],
            _ => f64::INFINITY,
        }
    }

    /// The next sample, after one, at which the value jumps (hold zero) or the slope (linear); none if there is none.
    pub fn next_break(&self, sample: usize) -> Option<usize> {
        let next = *self.breaks.get(sample)? as usize;
        (next < self.times.len()).then_some(next)
    }
}

/// What is missing among samples.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Gap {
    /// The first sample.
    First,
    /// The last sample.
    Last,
    /// More than one sample in a row: the first of them, from 0, and their number.
    Wide(usize, usize),
}

/// Fills single samples that are missing (not a number): with the one before where values are held, else on the straight line between
/// its neighbours.  Returns which were missing.
///
/// # Errors
/// What is missing beside single samples.
pub fn fill_gaps(times: &[f64], values: &mut [f64], hold: Hold) -> Result<Vec<usize>, Gap> {
    let mut filled = Vec::new();
    for k in 0..values.len() {
        if !values[k].is_nan() {
            continue;
        }
        let count = values[k..].iter().take_while(|value| value.is_nan()).count();
        match k {
            0 => return Err(Gap::First),
            _ if k + count == values.len() => return Err(Gap::Last),
            _ if count > 1 => return Err(Gap::Wide(k, count)),
            _ => {}
        }
        let (before, after) = (values[k - 1], values[k + 1]);
        let share = (times[k] - times[k - 1]) / (times[k + 1] - times[k - 1]);
        values[k] = if hold == Hold::Zero { before } else { before + share * (after - before) };
        filled.push(k);
    }
    Ok(filled)
}

/// Per sample but the last: the next one that is marked, the number of samples if there is none.
fn next(count: usize, marked: impl Fn(usize) -> bool) -> Vec<u32> {
    let mut list = vec![count as u32; count - 1];
    let mut known = count as u32;
    for k in (0..count - 1).rev() {
        if marked(k + 1) {
            known = k as u32 + 1;
        }
        list[k] = known;
    }
    list
}

/// One over the step of the times, if they stand on a grid; else 0.
fn grid(times: &[f64]) -> f64 {
    let count = times.len() - 1;
    let step = (times[count] - times[0]) / count as f64;
    let is_on = |(k, time): (usize, &f64)| (time - times[0] - k as f64 * step).abs() <= ON_GRID * step;
    if step.is_finite() && times.iter().enumerate().all(is_on) { 1.0 / step } else { 0.0 }
}

/// How far a step may lead, see the head of the file.
fn reach(times: &[f64], values: &[f64], slopes: &[f64]) -> Vec<u32> {
    let count = times.len();
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
    let range = high - low;
    // Twice the distance of each sample from the middle between its neighbours, were they equally far.
    let bend = |k: usize| {
        let inner = (1..count - 1).contains(&k);
        if inner { (slopes[k] - slopes[k - 1]) * 0.5 * (times[k + 1] - times[k - 1]) } else { 0.0 }
    };
    let is_corner = |k: usize| {
        let inner = (2..count.saturating_sub(2)).contains(&k);
        let expected = if inner { 0.5 * (bend(k - 1) + bend(k + 1)) } else { 0.0 };
        (bend(k) - expected).abs() > CORNER * range
    };
    let corners = next(count, |k| is_corner(k));
    let mut knots = vec![false; count];
    let tube = POLYGON * range;
    let (mut from, mut cone) = (0, (f64::NEG_INFINITY, f64::INFINITY));
    let mut k = 1;
    while k < count {
        let distance = times[k] - times[from];
        let own = ((values[k] - values[from] - tube) / distance, (values[k] - values[from] + tube) / distance);
        let both = (cone.0.max(own.0), cone.1.min(own.1));
        if both.0 > both.1 && k > from + 1 {
            knots[k - 1] = true;
            (from, cone) = (k - 1, (f64::NEG_INFINITY, f64::INFINITY));
        } else {
            cone = both;
            k += 1;
        }
    }
    let knots = next(count, |k| knots[k] || k == count - 1);
    let end = count - 1;
    (0..end)
        .map(|k| {
            let second = knots.get(knots[k] as usize).map_or(end as u32, |&second| second);
            corners[k].min(second).min(end as u32)
        })
        .collect()
}

/// Coefficients of the natural cubic spline, by elimination in its tridiagonal system for the second derivatives.
fn spline(times: &[f64], slopes: &[f64]) -> (Vec<f64>, Vec<[f64; 2]>) {
    let count = slopes.len();
    let step = |k: usize| times[k + 1] - times[k];
    // Half of the second derivatives at the samples; those at the ends are 0.
    let mut half = vec![0.0; count + 1];
    let mut upper = vec![0.0; count + 1];
    for k in 1..count {
        let pivot = 2.0 * (step(k - 1) + step(k)) - step(k - 1) * upper[k - 1];
        upper[k] = step(k) / pivot;
        half[k] = (3.0 * (slopes[k] - slopes[k - 1]) - step(k - 1) * half[k - 1]) / pivot;
    }
    for k in (1..count).rev() {
        half[k] -= upper[k] * half[k + 1];
    }
    let linear = (0..count).map(|k| slopes[k] - step(k) * (2.0 * half[k] + half[k + 1]) / 3.0).collect();
    let higher = (0..count).map(|k| [half[k], (half[k + 1] - half[k]) / (3.0 * step(k))]).collect();
    (linear, higher)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Gap, Hold, Series, SeriesError, fill_gaps};

    fn sampled(count: usize, of: impl Fn(f64) -> f64, hold: Hold) -> Series {
        let times: Vec<f64> = (0..count).map(|k| 0.1 * k as f64).collect();
        let values = times.iter().map(|&t| of(t)).collect();
        Series::new(times, values, hold).unwrap()
    }

    #[test]
    fn intervals_are_found_from_anywhere() {
        let uneven = Series::new(vec![0.0, 0.5, 0.7, 3.0, 3.1], vec![0.0; 5], Hold::Linear).unwrap();
        let even = sampled(5, |t| t, Hold::Linear);
        for series in [&uneven, &even] {
            for near in 0..6 {
                for k in 0..4 {
                    let (a, b) = (series.times()[k], series.times()[k + 1]);
                    assert_eq!(series.interval(a, near), k);
                    assert_eq!(series.interval(0.5 * (a + b), near), k);
                }
                assert_eq!((series.interval(-1.0, near), series.interval(9.0, near)), (0, 3));
                assert_eq!(series.interval(f64::NAN, near), 0);
            }
        }
    }

    #[test]
    fn a_spline_meets_a_smooth_function_and_its_derivatives() {
        let series = sampled(101, |t| (1.7 * t).sin(), Hold::Smooth);
        for k in 0..80 {
            let t = 1.03 + 0.1 * f64::from(k);
            let sample = series.at(t, series.interval(t, 0));
            assert!((sample.value - (1.7 * t).sin()).abs() < 1e-5, "{t}: {sample:?}");
            assert!((sample.slope - 1.7 * (1.7 * t).cos()).abs() < 1e-4, "{t}: {sample:?}");
            assert!((sample.curvature + 1.7 * 1.7 * (1.7 * t).sin()).abs() < 2e-2, "{t}: {sample:?}");
        }
        // Samples are met, and before and behind them the ends are kept.
        assert_eq!(series.at(3.0, series.interval(3.0, 0)).value, (1.7f64 * 3.0).sin());
        assert_eq!(series.at(-1.0, 0).value, 0.0);
        assert_eq!(series.at(11.0, 99).value, series.values()[100]);
    }

    #[test]
    fn a_pulse_bounds_steps_and_a_smooth_record_hardly_does() {
        let pulse =
            sampled(10_000, |t| if (t - 700.0).abs() < 0.01 { 1e-3 } else { f64::from(t < 0.05) }, Hold::Linear);
        // The record begins with 1 at the first sample, so the pulse is a thousandth of its range.
        assert!((pulse.reach(100, 10.0) - 699.8).abs() < 1e-9, "{}", pulse.reach(100, 10.0));
        assert!((pulse.reach(6999, 699.9) - 700.0).abs() < 1e-9);
        assert!((pulse.reach(7000, 700.0) - 700.1).abs() < 1e-9);
        assert!((pulse.reach(7001, 700.1) - 999.9).abs() < 1e-9);
        // 400 samples a period: a step may have a tenth of a period or more.
        let sine = sampled(4000, |t| (t * std::f64::consts::TAU / 40.0).sin(), Hold::Linear);
        for k in 10..3900 {
            assert!(sine.reach(k, 0.0) - sine.times()[k] > 1.5, "{k}: {}", sine.reach(k, 0.0) - sine.times()[k]);
        }
        // A slow bump in a quiet record has no corner and is not stepped over, either.
        let bump =
            |t: f64| if (400.0..600.0).contains(&t) { 1.0 - (t * std::f64::consts::TAU / 200.0).cos() } else { 0.0 };
        let bump = sampled(10_000, bump, Hold::Linear);
        assert!(bump.reach(10, 1.0) < 430.0, "{}", bump.reach(10, 1.0));
    }

    #[test]
    fn breaks_are_jumps_or_kinks() {
        let times: Vec<f64> = (0..6).map(f64::from).collect();
        let values = vec![0.0, 0.0, 1.0, 1.0, 1.0, 2.0];
        let held = Series::new(times.clone(), values.clone(), Hold::Zero).unwrap();
        let breaks: Vec<Option<usize>> = (0..6).map(|k| held.next_break(k)).collect();
        assert_eq!(breaks, [Some(2), Some(2), Some(5), Some(5), Some(5), None]);
        let line = Series::new(times, values, Hold::Linear).unwrap();
        let breaks: Vec<Option<usize>> = (0..6).map(|k| line.next_break(k)).collect();
        assert_eq!(breaks, [Some(1), Some(2), Some(4), Some(4), None, None]);
    }

    #[test]
    fn single_gaps_are_filled_and_others_refused() {
        let times = [0.0, 1.0, 4.0, 5.0, 6.0];
        let filled = |values: [f64; 5], hold: Hold| {
            let mut values = values;
            fill_gaps(&times, &mut values, hold).map(|gaps| (gaps, values))
        };
        let nan = f64::NAN;
        let expected = (vec![1], [1.0, 2.0, 5.0, 6.0, 6.0]);
        assert_eq!(filled([1.0, nan, 5.0, 6.0, 6.0], Hold::Linear), Ok(expected));
        assert_eq!(filled([1.0, nan, 5.0, 6.0, 6.0], Hold::Zero), Ok((vec![1], [1.0, 1.0, 5.0, 6.0, 6.0])));
        assert_eq!(filled([nan, 2.0, 5.0, 6.0, 6.0], Hold::Linear), Err(Gap::First));
        assert_eq!(filled([1.0, 2.0, 5.0, nan, nan], Hold::Linear), Err(Gap::Last));
        assert_eq!(filled([1.0, nan, nan, 6.0, 6.0], Hold::Linear), Err(Gap::Wide(1, 2)));
    }

    #[test]
    fn samples_that_are_no_series_are_refused() {
        let made =
            |times: &[f64], values: &[f64]| Series::new(times.to_vec(), values.to_vec(), Hold::Linear).map(|_| ());
        assert_eq!(made(&[0.0], &[1.0]), Err(SeriesError::TooFew));
        assert_eq!(made(&[0.0, 1.0], &[1.0]), Err(SeriesError::Lengths));
        assert_eq!(made(&[0.0, 0.0], &[1.0, 1.0]), Err(SeriesError::Order(1)));
        assert_eq!(made(&[0.0, 1.0], &[1.0, f64::NAN]), Err(SeriesError::NotFinite(1)));
    }
}

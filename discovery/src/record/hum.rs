//! Hum: lines of the mains at 50 or 60 Hz and their harmonics.
//!
//! Amplitudes are those of a periodogram with Hann's window, averaged over parts of the record (Welch 1967).  A line stands out
//! when its power is far above that at the frequencies beside it, so that a slow signal or a transient is not taken for one.  Parts
//! are at most a second long: the mains wander by a tenth of a hertz, which is little against the width of the window.

use std::f64::consts::TAU;

use hyd_system::math::{cos, sin_cos};

/// Frequencies of the mains (Hz).
pub(crate) const MAINS: [f64; 2] = [50.0, 60.0];
/// Harmonics that are looked at, the fundamental among them.
pub(crate) const HARMONICS: u32 = 5;
/// Longest part (s).
const LONGEST: f64 = 1.0;
/// Fewest periods of a line in a part: below, the window does not part it from a slow signal.
const FEWEST_PERIODS: f64 = 8.0;
/// Samples per period of a line that are needed.
const SAMPLES_PER_PERIOD: f64 = 2.5;
/// Most samples that are looked at.
const MOST_SAMPLES: usize = 200_000;
/// Distances of the frequencies beside a line, in widths of a part's resolution.
const BESIDE: [f64; 6] = [3.0, 3.7, 4.4, 5.1, 5.8, 6.5];
/// A line stands out when its power is so many times that beside it.
const OUTSTANDING: f64 = 25.0;
/// Median of exponentially distributed numbers of mean 1.
const MEDIAN: f64 = std::f64::consts::LN_2;

/// One line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Line {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Amplitude of the sine (unit of the values).
    pub amplitude: f64,
    /// Amplitude of what is beside the line, root of the mean power.
    pub beside: f64,
    /// Does it stand out of what is beside it?
    pub stands_out: bool,
}

/// The lines of the mains for which the record is long and fast enough.
pub(crate) fn hum(times: &[f64], values: &[f64]) -> Vec<Line> {
    let points: Vec<(f64, f64)> =
        times.iter().copied().zip(values.iter().copied()).filter(|(t, v)| t.is_finite() && v.is_finite()).collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Vec::new() };
    let length = last.0 - first.0;
    if length <= 0.0 {
        return Vec::new();
    }
    let rate = (points.len() - 1) as f64 / length;
    let parts = parts(&points, length);
    let part_length = length.min(LONGEST);
    let mut lines = Vec::new();
    for mains in MAINS {
        for harmonic in 1..=HARMONICS {
            let frequency = mains * f64::from(harmonic);
            // 300 Hz belongs to both; it is listed once.
            let is_known = lines.iter().any(|line: &Line| line.frequency == frequency);
            if frequency * part_length < FEWEST_PERIODS || rate < SAMPLES_PER_PERIOD * frequency || is_known {
                continue;
            }
            lines.push(line(&parts, frequency, part_length));
        }
    }
    lines
}

/// Parts of a second, evenly spread where there are more samples than are looked at.
fn parts(points: &[(f64, f64)], length: f64) -> Vec<&[(f64, f64)]> {
    let count = (length / LONGEST).floor().max(1.0);
    let per_part = (points.len() as f64 / count).max(1.0);
    let wanted = (MOST_SAMPLES as f64 / per_part).clamp(1.0, count);
    let first = points[0].0;
    let share = length / count;
    (0..wanted as usize)
        .map(|k| {
            let begin = first + (k as f64 * count / wanted).floor() * share;
            let from = points.partition_point(|point| point.0 < begin);
            let to = points.partition_point(|point| point.0 <= begin + share);
            &points[from..to.min(from + MOST_SAMPLES)]
        })
        .filter(|part| part.len() > 4)
        .collect()
}

fn line(parts: &[&[(f64, f64)]], frequency: f64, part_length: f64) -> Line {
    let power =
        |frequency: f64| parts.iter().map(|part| power(part, frequency)).sum::<f64>() / parts.len().max(1) as f64;
    let own = power(frequency);
    let width = 1.0 / part_length;
    let other_line = |at: f64| {
        MAINS.iter().any(|mains| {
            let harmonic = (at / mains).round().max(1.0);
            (at - harmonic * mains).abs() < 2.0 * width
        })
    };
    let around = BESIDE.iter().flat_map(|distance| [frequency - distance * width, frequency + distance * width]);
    let mut powers: Vec<f64> = around.filter(|at| *at > 2.0 * width && !other_line(*at)).map(power).collect();
    // On the flank of a slow signal one side is larger; the larger side is what counts.
    powers.sort_unstable_by(f64::total_cmp);
    let middle = powers.get(powers.len() / 2).copied().unwrap_or(own);
    let upper = powers.get(powers.len() * 3 / 4).copied().unwrap_or(own);
    let background = (middle / MEDIAN).max(upper);
    // Of a power that is noise and line the line is what is left.
    Line {
        frequency,
        amplitude: (own - background).max(0.0).sqrt(),
        beside: background.sqrt(),
        stands_out: parts.len() * powers.len() > 0 && own > OUTSTANDING * background && own > 0.0,
    }
}

/// Square of the amplitude of the sine of this frequency under Hann's window; a straight line is taken out.
fn power(part: &[(f64, f64)], frequency: f64) -> f64 {
    let (first, last) = (part[0].0, part[part.len() - 1].0);
    let length = (last - first).max(f64::MIN_POSITIVE);
    let weight = |t: f64| 0.5 - 0.5 * cos(TAU * (t - first) / length);
    let (mut sum, mut sum_t, mut sum_tt, mut sum_v, mut sum_tv) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for &(t, v) in part {
        let (w, t) = (weight(t), (t - first) / length - 0.5);
        (sum, sum_t, sum_tt, sum_v, sum_tv) =
            (sum + w, sum_t + w * t, sum_tt + w * t * t, sum_v + w * v, sum_tv + w * t * v);
    }
    let determinant = sum * sum_tt - sum_t * sum_t;
    if determinant.is_nan() || determinant <= 0.0 {
        return 0.0;
    }
    let slope = (sum * sum_tv - sum_t * sum_v) / determinant;
    let level = (sum_v - slope * sum_t) / sum;
    let (mut re, mut im) = (0.0, 0.0);
    for &(t, v) in part {
        let rest = weight(t) * (v - level - slope * ((t - first) / length - 0.5));
        let (sine, cosine) = sin_cos(TAU * frequency * (t - first));
        (re, im) = (re + rest * cosine, im + rest * sine);
    }
    4.0 * (re * re + im * im) / (sum * sum)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use hyd_system::random::SplitMix;

    fn record(count: u32, rate: f64, signal: impl Fn(f64) -> f64, sigma: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut draws = SplitMix(seed);
        let times: Vec<f64> = (0..count).map(|k| f64::from(k) / rate).collect();
        let values = times.iter().map(|&t| signal(t) + sigma * draws.normal()).collect();
        (times, values)
    }

    fn outstanding(lines: &[Line]) -> Vec<f64> {
        lines.iter().filter(|line| line.stands_out).map(|line| line.frequency).collect()
    }

    #[test]
    fn lines_are_found_with_their_amplitude() {
        let signal = |t: f64| 0.3 * (TAU * 49.95 * t + 1.0).sin() + 0.1 * (TAU * 149.85 * t).sin() + (-t / 0.05).exp();
        let (times, values) = record(30_000, 10_000.0, signal, 0.5, 1);
        let lines = hum(&times, &values);
        assert_eq!(outstanding(&lines), [50.0, 150.0]);
        let of = |frequency: f64| lines.iter().find(|line| line.frequency == frequency).unwrap().amplitude;
        assert!((of(50.0) / 0.3 - 1.0).abs() < 0.08 && (of(150.0) / 0.1 - 1.0).abs() < 0.2, "{lines:?}");
        let (times, values) = record(4_000, 5_000.0, |t| 2.0 * (TAU * 60.0 * t).sin(), 1.0, 2);
        assert_eq!(outstanding(&hum(&times, &values)), [60.0]);
    }

    #[test]
    fn noise_steps_and_ringing_are_not_hum() {
        for seed in 0..100 {
            let (times, values) = record(3_000, 3_000.0, |_| 0.0, 1.0, seed);
            assert!(outstanding(&hum(&times, &values)).is_empty(), "seed {seed}");
        }
        let signals: [fn(f64) -> f64; 3] = [
            |t| if t > 0.3 { 5.0 } else { 0.0 },
            |t| (-8.0 * t).exp() * (TAU * 57.0 * t).sin(),
            |t| 10.0 * (TAU * 7.0 * t).sin(),
        ];
        for signal in signals {
            let (times, values) = record(8_000, 8_000.0, signal, 0.01, 3);
            assert!(outstanding(&hum(&times, &values)).is_empty());
        }
    }

    #[test]
    fn short_and_slow_records_tell_nothing() {
        let (times, values) = record(400, 10_000.0, |t| (TAU * 50.0 * t).sin(), 0.0, 1);
        assert!(hum(&times, &values).iter().all(|line| line.frequency >= 200.0));
        let (times, values) = record(400, 100.0, |t| (TAU * 50.0 * t).sin(), 0.0, 1);
        assert!(hum(&times, &values).is_empty());
    }
}

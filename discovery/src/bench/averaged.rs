//! Long records brought to fewer rows: means of neighbours, where nothing is lost but what noise hides.
//!
//! A recorder of 10 kHz shows a pendulum in hundreds of thousands of rows, and every run of a fit pays for each of them.  The mean of `m`
//! samples over the time `T = m h` differs from the signal at its middle by `x'' T^2/24` (Taylor's theorem), and the second difference of such means is
//! `x'' T^2`: it says what the mean loses.  As many neighbours are taken together as leave that below the noise of a mean everywhere in all records; where one of them
//! has a flank, no two are.  More and more neighbours are tried until some lose something: means over whole periods of a vibration would show nothing of it.
//! The means have to scatter as those of the stated noise do, by their own differences ([`scatter`]): a vibration in the noise makes them scatter more, as does
//! noise that is correlated and was not said to be.  Correlated noise is averaged less: the variance of the mean of `m` samples of an AR(1) process is that of Box and
//! Jenkins, "Time Series Analysis", section 2.1.  A signal that is read in steps wider than its noise keeps the error of its steps.

use std::collections::BTreeMap;

use hyd_system::math::{ln, square};

use crate::bench::noise::Noise;
use crate::bench::shot_table;
use crate::bench::{Bench, Shot};
use crate::fault::Fault;
use crate::record::{sampling, scatter};
use crate::study::Study;

/// Rows of a table from which on it is long, and the fewest that are left of it.
const LONG: usize = 8000;
const LEFT: usize = 4000;
/// The same by window, as a multiple of the fewest rows of one.
const OF_A_WINDOW: usize = 10;
/// Largest second difference of means, in standard deviations of their noise: half of one is lost then.  Of so many rows noise alone may reach more.
const LOST: f64 = 12.0;
/// How far beyond the largest of so many normal numbers, which is about `sqrt(2 ln n)`, none of them lies.
const BEYOND: f64 = 1.0;
/// Numbers of neighbours that are tried, each as a multiple of the one before.
const NEXT: f64 = 1.25;
/// Factor by which the scatter of means may differ from what the noise of single samples lets expect, beside what is chance with so few.
const SCATTER: f64 = 1.15;
/// Deviations of a scatter by chance, of which that of `n` numbers has a standard deviation of about `1.5/sqrt(n)` by quartiles of differences.
const CHANCE: f64 = 6.0;
/// Share of the values of a column that means may leave out.
const MOST_LEFT_OUT: f64 = 0.5;
/// Share of steps of time that may be uneven.
const UNEVEN: f64 = 0.01;
/// Steps of this many standard deviations of the noise are smoothed by it (Widrow, Kollar, "Quantization Noise", 2008, section 5.5).
const SMOOTHED: f64 = 2.0;

/// The noise of a channel (units of the table).
struct Scatters {
    /// Of what is averaged: standard deviation and correlation of neighbours.
    free: (f64, f64),
    /// Standard deviation of what is not averaged: the rounding to wide steps.
    kept: f64,
}

impl Scatters {
    /// Standard deviation of the mean of so many neighbours.
    fn of_mean(&self, count: usize) -> f64 {
        (square(self.free.0) * share(count, self.free.1) + square(self.kept)).sqrt()
    }
}

/// Variance of the mean of `count` neighbours of an AR(1) process of variance 1.
fn share(count: usize, rho: f64) -> f64 {
    let m = count as f64;
    let power: f64 = std::iter::repeat_n(rho, count).product();
    ((1.0 + rho) / (1.0 - rho) - 2.0 * rho * (1.0 - power) / (m * square(1.0 - rho))) / m
}

/// Takes the means of neighbours in all shots of a set, as many as the study says or the records allow, and lowers its noise by them.  A shot is
/// a whole table.
///
/// # Errors
/// Where the study asks for means and a column has values in too few rows for them.
pub(crate) fn average(bench: &mut Bench, study: &Study) -> Result<(), Fault> {
    let names: Vec<&str> = study.channels.keys().map(String::as_str).collect();
    let names: Vec<&str> =
        names.into_iter().filter(|name| bench.shots.iter().any(|shot| shot.values.contains_key(*name))).collect();
    // Without noise a fit is refused, which is not said here.
    let Ok(noises) = Noise::of_all(bench, study, &names) else { return Ok(()) };
    let scatters: BTreeMap<&str, Scatters> = names
        .iter()
        .zip(noises)
        .map(|(&name, noise)| {
            let stated = study.channels.get(name).and_then(|own| own.quantisation);
            let step = bench.quantisation.get(name).copied().or(stated).unwrap_or(0.0);
            let rounding = square(step) / 12.0;
            let free = (square(noise.sigma) - rounding).max(0.0).sqrt();
            let is_smoothed = step <= SMOOTHED * free;
            let (free, kept) = if is_smoothed { (noise.sigma, 0.0) } else { (free, rounding.sqrt()) };
            (name, Scatters { free: (free, noise.rho), kept })
        })
        .collect();
    let count = study.shots.average.unwrap_or_else(|| neighbours(bench, study, &scatters));
    if count < 2 {
        return Ok(());
    }
    for shot in &mut bench.shots {
        let rows = shot.times.len();
        if rows < count {
            return Err(Fault::new(format!("`average = {count}` in `[shots]`: `{}` has only {rows} rows", shot.file)));
        }
        shot.times = means(&shot.times, count);
        for (name, values) in &mut shot.values {
            let before = values.iter().filter(|value| value.is_finite()).count();
            *values = means(values, count);
            let kept = values.iter().filter(|value| value.is_finite()).count() * count;
            if (kept as f64) < (1.0 - MOST_LEFT_OUT) * before as f64 {
                return Err(Fault::new(format!(
                    "`average = {count}` in `[shots]` needs a value in each row that it takes together: of {before} values of `{name}` in `{}` only {kept} stand in such rows",
                    shot.file
                )));
            }
        }
    }
    for (name, own) in scatters {
        let stated = own.free.0 * share(count, own.free.1).sqrt();
        // Noise that was not said to be correlated is averaged less than that.
        let shown = bench.shots.iter().filter_map(|shot| scatter(&shot.times, shot.values.get(name)?));
        let shown = shown.filter(|shown| shown.is_settled && own.kept == 0.0).map(|shown| shown.sigma);
        let shown = shown.filter(|sigma| *sigma > SCATTER * stated);
        bench.noise.insert(name.to_string(), shown.fold(stated, f64::max));
        bench.quantisation.insert(name.to_string(), own.kept * 12.0_f64.sqrt());
    }
    bench.averaged = count;
    Ok(())
}

/// Means of so many neighbours; what is left over at the end is left out, and a mean over a gap is one.
fn means(values: &[f64], count: usize) -> Vec<f64> {
    values.chunks_exact(count).map(|own| own.iter().sum::<f64>() / count as f64).collect()
}

/// How many neighbours can be taken together in all shots.
fn neighbours(bench: &Bench, study: &Study, scatters: &BTreeMap<&str, Scatters>) -> usize {
    let left = LEFT.max(study.shots.windows.unwrap_or(1) * OF_A_WINDOW * shot_table::FEWEST);
    let is_fit = |shot: &Shot| {
        let is_even = sampling(&shot.times).is_some_and(|own| own.uneven < UNEVEN && own.gaps.is_empty());
        shot.times.len() >= LONG.max(2 * left)
            && is_even
            && shot.values.values().flatten().all(|value| value.is_finite())
    };
    if bench.shots.is_empty() || !bench.shots.iter().all(is_fit) {
        return 1;
    }
    let records: Vec<Record<'_>> = bench
        .shots
        .iter()
        .flat_map(|shot| {
            shot.values.iter().filter_map(|(name, values)| {
                let own = scatters.get(name.as_str())?;
                let shown = scatter(&shot.times, values).map_or(1.0, |found| found.sigma / own.of_mean(1));
                Some(Record { times: &shot.times, values, own, shown })
            })
        })
        .collect();
    let rows = bench.shots.iter().map(|shot| shot.times.len()).min().unwrap_or(0);
    let most = rows / left;
    let (mut kept, mut next) = (1, 2);
    while next <= most && records.iter().all(|own| own.is_lossless(next)) {
        kept = next;
        if next == most {
            break;
        }
        next = ((NEXT * next as f64).ceil() as usize).min(most);
    }
    kept
}

/// One channel of one shot.
struct Record<'a> {
    times: &'a [f64],
    values: &'a [f64],
    own: &'a Scatters,
    /// How many times the stated noise neighbouring samples show.
    shown: f64,
}

impl Record<'_> {
    /// True if means of so many neighbours show all that these do.
    fn is_lossless(&self, count: usize) -> bool {
        // What the record shows may be more than what is stated.
        let noise = self.shown.max(1.0) * self.own.of_mean(count);
        let means_of = means(self.values, count);
        // A second difference of white noise has six times its variance.
        let by_chance = 6.0_f64.sqrt() * ((2.0 * ln(means_of.len() as f64)).sqrt() + BEYOND);
        let lost = LOST.max(by_chance) * noise;
        if means_of.windows(3).any(|own| (own[0] - 2.0 * own[1] + own[2]).abs() > lost) {
            return false;
        }
        let Some(shown) = scatter(&means(self.times, count), &means_of) else { return true };
        let most = SCATTER + CHANCE / (shown.samples as f64).sqrt();
        // Neighbours of correlated noise show less than all of it, and their means do not show less in the same way.  Steps are not averaged.
        let expected = if self.own.kept > 0.0 { noise } else { self.shown * self.own.of_mean(count) };
        // Where the signal changes too much between means to tell, what it changes is in their second differences.
        // What alternates from row to row looks like noise, and its means show too little of it.
        let is_as_expected = (1.0 / most..=most).contains(&(shown.sigma / expected));
        !shown.is_settled || is_as_expected || self.own.kept > 0.0 && shown.sigma <= expected
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use hyd_system::math::{cos, exp};
    use hyd_system::random::SplitMix;

    use super::{average, share};
    use crate::bench::Shot;
    use crate::{Bench, Study};

    const STUDY: &str = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"x\" }\n";

    /// A swing of 1 Hz at 10 kHz, the noise of it and, behind 2 s, a flank of this height.
    fn bench(noise: f64, step: f64, flank: f64) -> Bench {
        let mut draws = SplitMix(4);
        let times: Vec<f64> = (0..100_000).map(|k| 1e-4 * f64::from(k)).collect();
        let value = |&t: &f64| {
            let exact = exp(-0.1 * t) * cos(TAU * t) + if t > 2.0 { flank } else { 0.0 } + noise * draws.normal();
            if step > 0.0 { (exact / step).round() * step } else { exact }
        };
        let values = [("y".to_string(), times.iter().map(value).collect())].into_iter().collect();
        let stated = |value: f64| [("y".to_string(), value)].into_iter().collect();
        Bench {
            noise: stated(noise),
            quantisation: stated(step),
            shots: vec![Shot { number: 1, times, values, ..Shot::default() }],
            ..Bench::default()
        }
    }

    fn averaged(mut bench: Bench, more: &str) -> Bench {
        let study = Study::parse(&format!("{STUDY}{more}")).unwrap_or_else(|fault| panic!("{fault}"));
        average(&mut bench, &study).unwrap_or_else(|fault| panic!("{fault}"));
        bench
    }

    #[test]
    fn means_lose_nothing_but_noise() {
        let own = averaged(bench(3e-3, 0.0, 0.0), "");
        assert_eq!((own.averaged, own.shots[0].times.len()), (25, 4000));
        let (times, values) = (&own.shots[0].times, &own.shots[0].values["y"]);
        let off = times.iter().zip(values).map(|(&t, y)| y - exp(-0.1 * t) * cos(TAU * t));
        let left = (off.map(|own| own * own).sum::<f64>() / 4000.0).sqrt();
        assert!((left / own.noise["y"] - 1.0).abs() < 0.05 && (own.noise["y"] / 6e-4 - 1.0).abs() < 1e-9, "{left}");
        // With little noise fewer neighbours are alike: 40 /s2 over (m 1e-4 s)2 is to stay below 12 deviations of a mean.
        let own = averaged(bench(1e-5, 0.0, 0.0), "");
        assert!((2..=9).contains(&own.averaged), "{}", own.averaged);
    }

    #[test]
    fn a_flank_and_short_records_are_left_alone() {
        assert_eq!(averaged(bench(3e-3, 0.0, 0.5), "").averaged, 0);
        assert_eq!(averaged(bench(3e-3, 0.0, 0.0), "[shots]\naverage = 1\n").averaged, 0);
        assert_eq!(averaged(bench(3e-3, 0.0, 0.5), "[shots]\naverage = 10\n").averaged, 10);
        let mut short = bench(3e-3, 0.0, 0.0);
        short.shots[0].times.truncate(7000);
        short.shots[0].values.values_mut().for_each(|values| values.truncate(7000));
        assert_eq!(averaged(short, "").averaged, 0);
        let mut gap = bench(3e-3, 0.0, 0.0);
        gap.shots[0].values.values_mut().for_each(|values| values[500] = f64::NAN);
        assert_eq!(averaged(gap, "").averaged, 0);
    }

    /// 80 s at 10 kHz of this signal of the time and noise, of which neighbours are alike.
    fn vibration(signal: impl Fn(f64) -> f64, noise: f64, rho: f64) -> Bench {
        let mut draws = SplitMix(9);
        let mut own = 0.0;
        let times: Vec<f64> = (0..800_000).map(|k| 1e-4 * f64::from(k)).collect();
        let mut value = |&t: &f64| {
            own = rho * own + (1.0 - rho * rho).sqrt() * draws.normal();
            signal(t) + noise * own
        };
        let values = [("y".to_string(), times.iter().map(&mut value).collect())].into_iter().collect();
        Bench {
            noise: [("y".to_string(), noise)].into_iter().collect(),
            shots: vec![Shot { number: 1, times, values, ..Shot::default() }],
            ..Bench::default()
        }
    }

    /// 200 rows, which would be left of it by the number of rows alone, are one period of 50 Hz.
    #[test]
    fn a_vibration_does_not_vanish_in_means_over_its_periods() {
        for amplitude in [2.0, 5e-3] {
            let own = averaged(vibration(|t| amplitude * cos(TAU * 50.0 * t), 0.01, 0.0), "");
            assert!(own.averaged < 50, "{amplitude}: {}", own.averaged);
            let peak = own.shots[0].values["y"].iter().fold(0.0_f64, |most, own| most.max(*own));
            assert!(peak > 0.9 * amplitude, "{amplitude}: {peak}");
        }
        // Nor does one of two rows, of which no two rows show anything.
        let own = averaged(vibration(|t| 0.5 * cos(TAU * 5000.0 * t), 0.01, 0.0), "");
        assert_eq!(own.averaged, 0);
        assert_eq!(averaged(vibration(|_| 1.0, 0.01, 0.0), "").averaged, 200);
    }

    /// The noise of the means is what they scatter by, whether the study asked for means or not.
    #[test]
    fn noise_that_is_correlated_without_having_been_said_to_be_is_seen_in_the_means() {
        for more in ["", "[shots]\naverage = 50\n"] {
            let own = averaged(vibration(|t| cos(TAU * 0.1 * t), 0.01, 0.9), more);
            let off = own.shots[0].times.iter().zip(&own.shots[0].values["y"]).map(|(&t, y)| y - cos(TAU * 0.1 * t));
            let count = own.shots[0].times.len() as f64;
            let left = (off.map(|own| own * own).sum::<f64>() / count).sqrt();
            assert!((left / own.noise["y"] - 1.0).abs() < 0.15, "{more}: {left} {:?}", own.noise);
        }
    }

    #[test]
    fn means_of_a_column_with_few_values_are_refused() {
        let mut own = bench(3e-3, 0.0, 0.0);
        let sparse = |k: usize| if k.is_multiple_of(10) { 1.0 } else { f64::NAN };
        own.shots[0].values.insert("y".to_string(), (0..100_000).map(sparse).collect());
        let study = Study::parse(&format!("{STUDY}[shots]\naverage = 10\n")).unwrap_or_else(|fault| panic!("{fault}"));
        let fault = average(&mut own, &study).expect_err("refused").to_string();
        assert!(fault.contains("of 10000 values of `y`") && fault.contains("only 0"), "{fault}");
        let study =
            Study::parse(&format!("{STUDY}[shots]\naverage = 10000\n")).unwrap_or_else(|fault| panic!("{fault}"));
        let mut short = bench(3e-3, 0.0, 0.0);
        short.shots[0].times.truncate(7000);
        let fault = average(&mut short, &study).expect_err("refused").to_string();
        assert!(fault.contains("has only 7000 rows"), "{fault}");
    }

    #[test]
    fn wide_steps_keep_their_error() {
        // An encoder whose steps are far wider than its noise.
        let own = averaged(bench(1e-5, 6e-3, 0.0), "");
        assert!(own.averaged > 1 && (own.quantisation["y"] / 6e-3 - 1.0).abs() < 1e-9, "{own:?}");
    }

    /// By summing `rho^|i - j|` over all pairs.
    #[test]
    fn correlated_noise_is_averaged_less() {
        for (count, rho) in [(1_i32, 0.5_f64), (7, 0.0), (7, 0.6), (30, 0.9)] {
            let pairs = (0..count).flat_map(|i| (0..count).map(move |j| i.abs_diff(j)));
            let sum: f64 = pairs.map(|apart| std::iter::repeat_n(rho, apart as usize).product::<f64>()).sum();
            let expected = sum / f64::from(count * count);
            assert!((share(count as usize, rho) - expected).abs() < 1e-12, "{count} {rho}");
        }
    }
}

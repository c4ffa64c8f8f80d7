//! What the best model leaves: single bad samples, hum, drift and lag of measuring chains, a wrong clock, parameters that scatter,
//! model error.
//!
//! Each of these explains residuals by a few linear columns: a sine and a cosine for each shot, a ramp, the slopes of the curves
//! ([`timing`]), the derivatives by a parameter shot by shot.  They are taken up greedily, the one first that lowers the misfit most *in units of what it leaves
//! itself* (size and correlation, [`series`]), so that a smooth misfit of the model is not taken for hum.  What is left after that
//! is the level of each channel ([`Level`]).

mod conditions;
mod explain;
mod series;
mod spikes;
mod timing;

use nalgebra::{DMatrix, DVector};

use crate::disturbance::{Added, AddedTo, Disturbances, Lag, Level, ROOM, Scatter, Spike};
use crate::evidence::thresholds::adequate;
use crate::fit::{Fit, Jacobian};
use crate::problem::{Problem, Weighing};
use crate::record;
use crate::unknowns::{LIMIT, Meaning};
use crate::{Fault, Setup};
use explain::{Columns, Explained, Ground};
use hyd_system::math::{self, square};
use series::{Series, level};

/// Drop of the misfit that a disturbance needs, and more for each of its numbers.
const NEEDED: (f64, f64) = (25.0, 3.0);
/// Most disturbances that are taken up.
const MOST: usize = 12;
/// Mains frequencies and their harmonics (Hz).
const MAINS: [f64; 6] = [50.0, 100.0, 150.0, 60.0, 120.0, 180.0];
/// Periods that a record must hold, and samples that a period must have, for hum to be told.
const PERIODS: f64 = 1.0;
const PER_PERIOD: f64 = 2.5;
/// `n` times the square of the mean of `n` phases as unit vectors, above which they are not random: by chance in one of a hundred (Rayleigh's
/// test; Mardia, Jupp, Directional Statistics, 2000, section 6.3.1).
const IN_STEP: f64 = 4.6;
/// Fewest shots of which a scatter from shot to shot is told.
const FEWEST: usize = 2;
/// Largest relative scatter from shot to shot: what changes more is another state of the machine, and an effect.
const LARGEST: f64 = 0.06;
/// Fewest shots in which an order of sizes can be told apart from scatter ([`crate::search`]); only from here on a variance may exceed the tolerance by chance.
const ORDERED: usize = 4;
/// Standard deviations by which the cube root of a variance of few numbers may be too large (one-sided, 0.1 %).
const BY_CHANCE: f64 = 3.09;
/// Fewest shots of which scatter that follows a condition is taken for an error of the model where an effect with sizes of its own is the other choice: of
/// fewer, one of a handful of conditions is followed by chance in several benches of a hundred.
const SHOWING: usize = 6;
/// Relative scatter that is expected of one, or its tolerance where that is less: shots between which a parameter is badly known would
/// have any otherwise.
const EXPECTED: f64 = 0.03;

/// Largest drift that is taken up: part of the range of its channel, or so many standard deviations of its noise where the channel shows little else.
const LARGEST_DRIFT: (f64, f64) = (0.1, 20.0);

/// What was found in the residuals of a fit.
pub(crate) struct Leftover {
    /// All disturbances, with those that were known before.
    pub disturbances: Disturbances,
    /// Misfit per expected misfit that is to be expected with them, in noise as stated.
    pub misfit: f64,
}

/// A block of rows: one channel of one shot.
struct Block {
    shot: usize,
    channel: usize,
    first: usize,
    rows: usize,
}

/// Which disturbances are looked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kinds {
    /// All.
    All,
    /// All, in place of an effect with a size of its own in every shot: what is asked of scatter that such sizes are not asked for is left out.
    InPlaceOfSizes,
    /// Those that measuring chains add to a channel: hum and drift.
    Added,
    /// The same of the kind that explains most: hum alone, or drift alone.
    AddedOfOneKind,
}

/// Something that may be taken up.
#[derive(Clone)]
enum Disturbance {
    Added(usize, Added),
    Lag(usize),
    Clock,
    Scatter(String, usize),
}

impl Disturbance {
    /// True for what a measuring chain adds to its channel.
    fn is_added(&self) -> bool {
        matches!(self, Disturbance::Added(..))
    }
}

/// Looks at what a fit leaves, which must have derivatives by all unknowns.
///
/// # Errors
/// When the fit has no derivatives.
pub(crate) fn leftover(
    setup: &Setup,
    problem: &Problem<'_>,
    fit: &Fit,
    (whole, kinds): (&Weighing, Kinds),
) -> Result<Leftover, Fault> {
    let all = |own: &&Jacobian| own.matrix.ncols() == problem.unknowns.len();
    let Some(Jacobian { matrix: jacobian, .. }) = fit.jacobian.as_ref().filter(all) else {
        return Err(Fault::run("a fit has no derivatives by all unknowns"));
    };
    let blocks = blocks(problem, whole);
    // In standard deviations of the noise as stated.
    let factor = |block: &Block| problem.data.channels[block.channel].level.factor;
    let mut residuals = fit.residuals.clone();
    let mut jacobian = jacobian.clone();
    let mut weights = problem.all_weights(whole);
    for block in &blocks {
        let rows = block.first..block.first + block.rows;
        residuals.rows_mut(block.first, block.rows).scale_mut(factor(block));
        jacobian.rows_mut(block.first, block.rows).scale_mut(factor(block));
        weights[rows].iter_mut().for_each(|weight| *weight *= factor(block));
    }
    let mut disturbances = setup.disturbances.clone();
    for block in &blocks {
        let rows = block.first..block.first + block.rows;
        for sample in spikes::find(&residuals.as_slice()[rows.clone()], &weights[rows]) {
            let spike = Spike { shot: block.shot, channel: block.channel, sample };
            disturbances.spikes.push(spike);
            let row = block.first + sample;
            (residuals[row], weights[row]) = (0.0, 0.0);
            jacobian.row_mut(row).fill(0.0);
        }
    }
    disturbances.spikes.extend(spikes_held_out(setup, problem, &disturbances.spikes));
    disturbances.spikes.sort_unstable();
    disturbances.spikes.dedup();
    let mut state = State { setup, problem, blocks: &blocks, residuals, jacobian, weights, fit, kinds };
    let mut open = state.candidates(setup);
    let is_open = |own: &Disturbance| matches!(kinds, Kinds::All | Kinds::InPlaceOfSizes) || own.is_added();
    open.retain(is_open);
    let is_drift = |own: &Disturbance| matches!(own, Disturbance::Added(_, Added::Drift));
    for _ in 0..MOST {
        let levels = state.levels(&state.residuals);
        let Some(ground) = Ground::new(&state.residuals, &state.jacobian, state.scales(&levels), &fit.xi) else {
            break;
        };
        let tried = open.iter().enumerate().filter_map(|(k, own)| Some((k, state.explain(own, &ground)?)));
        let best = tried.max_by(|(_, a), (_, b)| a.gain.total_cmp(&b.gain));
        let Some((k, found)) = best.filter(|(_, own)| own.gain > NEEDED.0 + NEEDED.1 * own.amplitudes.len() as f64)
        else {
            break;
        };
        let own = open.remove(k);
        if kinds == Kinds::AddedOfOneKind {
            open.retain(|other| is_drift(other) == is_drift(&own));
        }
        state.residuals = found.left;
        let size = (found.amplitudes.iter().map(|a| a * a).sum::<f64>() / found.amplitudes.len() as f64).sqrt();
        match own {
            Disturbance::Added(channel, added) => {
                disturbances.added.push(AddedTo { channel, added, sigma: ROOM * size });
            }
            Disturbance::Lag(channel) => disturbances.lags.push(Lag { channel, time: found.amplitudes[0] }),
            Disturbance::Clock => disturbances.clock = Some(found.amplitudes[0]),
            Disturbance::Scatter(label, unknown) => {
                let sigma = problem.unknowns[unknown].slope(0.0) * size;
                disturbances.scatter.push(Scatter { label, sigma });
            }
        }
    }
    let levels = state.levels(&state.residuals);
    let misfit = state.residuals.norm_squared() / state.expected(None);
    disturbances.levels = if levels.iter().all(Level::is_noise) { Vec::new() } else { levels };
    Ok(Leftover { disturbances, misfit })
}

/// Spikes of the shots held out in channels that have spikes in the fitted ones.  No fit says what they are far from, so they are those that a record shows by
/// itself.
fn spikes_held_out(setup: &Setup, problem: &Problem<'_>, fitted: &[Spike]) -> Vec<Spike> {
    let mut found = Vec::new();
    for &shot in &setup.held_out {
        let data = &problem.data.shots[shot];
        for (channel, trace) in data.traces.iter().enumerate() {
            let Some(trace) = trace.as_ref().filter(|_| fitted.iter().any(|own| own.channel == channel)) else {
                continue;
            };
            for spike in record::spikes(&data.times, &trace.values) {
                // Where there is no value, a zero stands.
                let samples = (spike.index..spike.index + spike.samples).filter(|&sample| trace.used[sample]);
                found.extend(samples.map(|sample| Spike { shot, channel, sample }));
            }
        }
    }
    found
}

/// The largest variance over so many shots, in that of the tolerance, of what scatters by no more than its tolerance: it is known from a few numbers
/// (chi-square distribution, approximated by Wilson and Hilferty, Proceedings of the National Academy of Sciences 17 (1931) 684).
fn largest_variance(shots: usize) -> f64 {
    if shots < ORDERED {
        return 1.0;
    }
    let part = 2.0 / (9.0 * (shots - 1) as f64);
    let root = 1.0 - part + BY_CHANCE * part.sqrt();
    root * root * root
}

/// True if waves, by the amplitudes of their sine and cosine shot by shot, have phases that are not random.
fn are_in_step(amplitudes: &[f64]) -> bool {
    let (mut along, mut across, mut count) = (0.0, 0.0, 0.0);
    for wave in amplitudes.chunks_exact(2) {
        let size = math::hypot(wave[0], wave[1]);
        if size > 0.0 {
            along += wave[0] / size;
            across += wave[1] / size;
            count += 1.0;
        }
    }
    square(along) + square(across) > IN_STEP * count
}

/// True if a drift of these amplitudes (offset and half of the change of every record) is one of no measuring chain, for a channel of this range and noise.
fn is_beyond_drift(amplitudes: &[f64], range: f64, noise: f64) -> bool {
    let size = (amplitudes.iter().map(|own| square(*own)).sum::<f64>() / amplitudes.len().max(1) as f64).sqrt();
    size > LARGEST_DRIFT.0 * range && size > LARGEST_DRIFT.1 * noise
}

/// The blocks of the residuals.
fn blocks(problem: &Problem<'_>, whole: &Weighing) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut first = 0;
    for &shot in &whole.shots {
        let data = &problem.data.shots[shot];
        for channel in (0..data.traces.len()).filter(|&channel| data.traces[channel].is_some()) {
            blocks.push(Block { shot, channel, first, rows: data.times.len() });
            first += data.times.len();
        }
    }
    blocks
}

/// Residuals on the way, in standard deviations of the noise as stated.
struct State<'a> {
    setup: &'a Setup,
    problem: &'a Problem<'a>,
    blocks: &'a [Block],
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
    weights: Vec<f64>,
    fit: &'a Fit,
    kinds: Kinds,
}

impl State<'_> {
    /// Number of samples that count, each by the share of its variance that is noise.
    fn expected(&self, channel: Option<usize>) -> f64 {
        let own = self.blocks.iter().filter(|block| channel.is_none_or(|channel| block.channel == channel));
        let of = |block: &Block| {
            let sigma = self.problem.data.channels[block.channel].noise.sigma;
            let weights = &self.weights[block.first..block.first + block.rows];
            weights.iter().map(|weight| square(weight * sigma)).sum::<f64>()
        };
        own.map(of).sum()
    }

    /// The level of each channel with these residuals.
    fn levels(&self, residuals: &DVector<f64>) -> Vec<Level> {
        let of = |channel: usize| {
            let own = self.blocks.iter().filter(|block| block.channel == channel);
            let series: Vec<Series<'_>> = own
                .map(|block| {
                    let rows = block.first..block.first + block.rows;
                    Series { values: &residuals.as_slice()[rows.clone()], weights: &self.weights[rows] }
                })
                .collect();
            let expected = self.expected(Some(channel));
            let square: f64 = series.iter().flat_map(|own| own.values).map(|value| value * value).sum();
            if square <= adequate(expected) { Level::NOISE } else { level(&series, (square / expected).sqrt()) }
        };
        (0..self.problem.data.channels.len()).map(of).collect()
    }

    /// What rows are weighed by where the channels have these levels.
    fn scales(&self, levels: &[Level]) -> Vec<f64> {
        let mut scales = vec![1.0; self.residuals.len()];
        for block in self.blocks {
            scales[block.first..block.first + block.rows].fill(1.0 / levels[block.channel].factor);
        }
        scales
    }

    /// What may be taken up beside what is taken up already.
    fn candidates(&self, setup: &Setup) -> Vec<Disturbance> {
        let known = &setup.disturbances;
        let mut all = Vec::new();
        for channel in 0..self.problem.data.channels.len() {
            let is_new = |added: Added| !known.added.iter().any(|own| own.channel == channel && own.added == added);
            all.extend(Some(Disturbance::Added(channel, Added::Drift)).filter(|_| is_new(Added::Drift)));
            for frequency in MAINS.into_iter().filter(|&frequency| self.shows(channel, frequency)) {
                let hum = Added::Hum(frequency);
                all.extend(Some(Disturbance::Added(channel, hum)).filter(|_| is_new(hum)));
            }
            let lags = known.lags.iter().any(|own| own.channel == channel);
            all.extend(Some(Disturbance::Lag(channel)).filter(|_| !lags));
        }
        all.extend(Some(Disturbance::Clock).filter(|_| known.clock.is_none()));
        let shots: std::collections::BTreeSet<usize> = self.blocks.iter().map(|block| block.shot).collect();
        // Within one record nothing is taken apart and put together again.
        if shots.len() < FEWEST || setup.bench.shots.iter().all(|shot| shot.is_window) {
            return all;
        }
        for (k, unknown) in self.problem.unknowns.iter().enumerate() {
            let may = matches!(unknown.meaning, Meaning::Relative { .. })
                && unknown.shot.is_none()
                && unknown.effect.is_none()
                && setup.study.nuisances.contains_key(&unknown.name)
                && !known.scatter.iter().any(|own| own.label == unknown.name);
            all.extend(Some(Disturbance::Scatter(unknown.name.clone(), k)).filter(|_| may));
        }
        all
    }

    /// True if hum of this frequency can be told in the records of a channel.
    fn shows(&self, channel: usize, frequency: f64) -> bool {
        let mut own = self.blocks.iter().filter(|block| block.channel == channel).peekable();
        own.peek().is_some()
            && own.all(|block| {
                let times = &self.problem.data.shots[block.shot].times;
                let length = times[times.len() - 1] - times[0];
                length * frequency >= PERIODS && times.len() as f64 >= PER_PERIOD * length * frequency
            })
    }

    /// Columns of a disturbance, by unit of its amplitudes.
    fn columns(&self, disturbance: &Disturbance) -> Vec<Columns> {
        let mut columns = Vec::new();
        match disturbance {
            Disturbance::Added(channel, added) => {
                for block in self.blocks.iter().filter(|block| block.channel == *channel) {
                    let times = &self.problem.data.shots[block.shot].times;
                    let weights = &self.weights[block.first..block.first + block.rows];
                    for course in added.courses((times[0], times[times.len() - 1])) {
                        let samples = times.iter().zip(weights);
                        let mut values: Vec<f64> = samples.map(|(&t, weight)| weight * course.value(t)).collect();
                        self.problem.whiten(*channel, weights, &mut values);
                        columns.push(Columns { first: block.first, values });
                    }
                }
            }
            Disturbance::Lag(channel) => columns.push(self.late(Some(*channel))),
            Disturbance::Clock => columns.push(self.late(None)),
            Disturbance::Scatter(_, unknown) => {
                let mut blocks = self.blocks.iter().peekable();
                while let Some(block) = blocks.next() {
                    let mut end = block.first + block.rows;
                    while let Some(next) = blocks.next_if(|next| next.shot == block.shot) {
                        end = next.first + next.rows;
                    }
                    let column = self.jacobian.column(*unknown);
                    let values = column.rows(block.first, end - block.first).iter().map(|value| -value).collect();
                    columns.push(Columns { first: block.first, values });
                }
            }
        }
        columns
    }

    /// What a disturbance explains of the residuals; none where it explains nothing or goes farther than may be.
    fn explain(&self, disturbance: &Disturbance, ground: &Ground<'_>) -> Option<Explained> {
        let spread = match disturbance {
            Disturbance::Scatter(_, unknown) => {
                Some((EXPECTED / self.problem.unknowns[*unknown].slope(0.0).abs()).min(1.0))
            }
            _ => None,
        };
        let columns = self.columns(disturbance);
        let mut found = ground.explained(&columns, spread)?;
        if let Disturbance::Scatter(_, unknown) = disturbance {
            // No part scatters more than its tolerance.
            let count = found.amplitudes.len();
            let mean = found.amplitudes.iter().sum::<f64>() / count as f64;
            found.amplitudes.iter_mut().for_each(|amplitude| *amplitude -= mean);
            let square = found.amplitudes.iter().map(|a| a * a).sum::<f64>() / (count - 1) as f64;
            let relative = self.problem.unknowns[*unknown].slope(0.0).abs() * square.sqrt();
            if square > largest_variance(count)
                || relative > LARGEST
                || found.amplitudes.iter().any(|a| a.abs() > LIMIT)
            {
                return None;
            }
        }
        if self.is_systematic(disturbance, &found.amplitudes) || self.is_too_large(disturbance, &found.amplitudes) {
            return None;
        }
        let is_timing = match disturbance {
            Disturbance::Lag(channel) => self.is_timing(Some(*channel), &found),
            Disturbance::Clock => self.is_timing(None, &found),
            _ => true,
        };
        if !is_timing {
            return None;
        }
        let after = self.levels(&found.left);
        let spared = found.gain;
        found.gain = self.blocks.iter().map(|block| self.fall(block, &found.left, &after)).sum();
        if matches!(disturbance, Disturbance::Lag(_) | Disturbance::Clock) {
            found.gain = found.gain.max(spared);
        }
        Some(found)
    }

    /// True for what is no disturbance but an error of the model: scatter and hum that follow a condition, and waves that begin with every shot
    /// alike, for the mains know nothing of the trigger.
    fn is_systematic(&self, disturbance: &Disturbance, amplitudes: &[f64]) -> bool {
        let shots = |channel: Option<usize>| {
            let own = self.blocks.iter().filter(|block| channel.is_none_or(|channel| block.channel == channel));
            let mut shots: Vec<usize> = own.map(|block| block.shot).collect();
            shots.dedup();
            shots
        };
        match disturbance {
            // Sizes of an effect are not asked whether they follow one, which a few do by chance.
            Disturbance::Scatter(..) if self.kinds == Kinds::InPlaceOfSizes && amplitudes.len() < SHOWING => false,
            Disturbance::Scatter(..) => conditions::follow(self.setup, &shots(None), amplitudes),
            Disturbance::Added(channel, Added::Hum(_)) => {
                let sizes: Vec<f64> = amplitudes.chunks_exact(2).map(|wave| math::hypot(wave[0], wave[1])).collect();
                are_in_step(amplitudes) || conditions::follow(self.setup, &shots(Some(*channel)), &sizes)
            }
            _ => false,
        }
    }

    /// True for a drift that no measuring chain has: far beyond the noise and a part of the range that a sensor does not lose.
    fn is_too_large(&self, disturbance: &Disturbance, amplitudes: &[f64]) -> bool {
        let Disturbance::Added(channel, Added::Drift) = disturbance else { return false };
        let info = &self.problem.data.channels[*channel];
        is_beyond_drift(amplitudes, info.range, info.noise.sigma)
    }

    /// Drop of the misfit of a block, in what counts as noise afterwards.
    fn fall(&self, block: &Block, left: &DVector<f64>, after: &[Level]) -> f64 {
        let rows = |values: &DVector<f64>| values.rows(block.first, block.rows).norm_squared();
        (rows(&self.residuals) - rows(left)) / square(after[block.channel].factor)
    }
}

#[cfg(test)]
mod tests {
    use super::{are_in_step, is_beyond_drift, largest_variance};

    /// Quantiles of the chi-square distribution at 99.9 %: 16.27, 20.52 and 43.82 for 3, 5 and 19 degrees of freedom (Abramowitz, Stegun, table 26.8).
    #[test]
    fn variances_of_few_shots_may_be_larger_by_chance() {
        for (shots, quantile) in [(4, 16.27), (6, 20.52), (20, 43.82)] {
            let expected = quantile / (shots - 1) as f64;
            assert!((largest_variance(shots) / expected - 1.0).abs() < 0.03, "{shots}: {}", largest_variance(shots));
        }
        assert_eq!((largest_variance(2), largest_variance(3)), (1.0, 1.0));
    }

    #[test]
    fn a_sensor_does_not_drift_by_a_fifth_of_its_range() {
        // A speed of 200 rad/s with noise of 0.3 rad/s.
        assert!(is_beyond_drift(&[40.0, -20.0, 50.0, 30.0], 200.0, 0.3));
        assert!(!is_beyond_drift(&[4.0, -2.0, 3.0, 1.0], 200.0, 0.3));
        // A channel that shows little but its noise.
        assert!(!is_beyond_drift(&[1.0, 2.0], 5.0, 0.3));
    }

    #[test]
    fn waves_in_step_with_the_trigger_are_not_hum() {
        let of =
            |phases: &[f64]| phases.iter().flat_map(|phase: &f64| [2.0 * phase.sin(), 2.0 * phase.cos()]).collect();
        let amplitudes = |phases: &[f64]| -> Vec<f64> { of(phases) };
        assert!(are_in_step(&amplitudes(&[0.3, 0.5, 0.2, 0.4, 0.6, 0.1])));
        assert!(!are_in_step(&amplitudes(&[0.3, 1.5, 5.2, 2.4, 4.6, 3.1])));
        // Of a few shots nothing can be told.
        assert!(!are_in_step(&amplitudes(&[0.3, 0.3, 0.3, 0.3])) && !are_in_step(&[]) && !are_in_step(&[0.0; 8]));
    }
}

//! Where in the course of a shot the gap lies: root of the mean square of the residuals by channel and phase.
//!
//! Phases are those of the channel that the study names: before it moves, rising, up, falling, and after it has come back; shots in
//! which it stays where it is are `before` throughout.  A study that names none has thirds of the record as phases.

use hyd_system::math::square;
use serde_json::{Value, json};

use super::{AllGaps, Scene, number};
use crate::Setup;
use crate::evidence::proof::Gap;
use crate::problem::{Problem, Weighing};

const OF_CHANNEL: [&str; 5] = ["before", "rising", "up", "falling", "after"];
const OF_TIME: [&str; 3] = ["first third", "second third", "last third"];
/// Shares of its range at which a channel has begun to move and has arrived.
const MOVES: f64 = 0.05;
const ARRIVED: f64 = 0.95;
/// A channel moves if its range is this many times its noise.
const RANGE: f64 = 20.0;

/// The table: `phases`, `channels` and for every stage an array of rows by phase.  Null where a cell has no samples.
pub(super) fn phases(scene: &Scene<'_>, gaps: &AllGaps) -> Value {
    let setup = scene.setup;
    let of = setup.study.shots.phases_of.as_deref().and_then(|name| setup.data.channel(name));
    let names: &[&str] = if of.is_some() { &OF_CHANNEL } else { &OF_TIME };
    let problem = match scene.first.base.problem(setup) {
        Ok(problem) => problem,
        Err(_) => return Value::Null,
    };
    let table = |gap: Option<&Gap>, shots: &[usize]| {
        gap.map_or(Value::Null, |gap| cells((setup, &problem), (of, names.len()), gap, shots).into())
    };
    let after = gaps.after.as_ref();
    json!({
        "names": names,
        "of": of.map(|channel| setup.data.channels[channel].name.clone()),
        "channels": setup.data.channels.iter().map(|channel| channel.name.clone()).collect::<Vec<_>>(),
        "raw": table(gaps.raw.as_ref(), &setup.train),
        "before": table(Some(&gaps.before.train), &setup.train),
        "after": table(after.map(|gaps| &gaps.train), &setup.train),
        "heldout_before": table(gaps.before.held_out.as_ref(), &setup.held_out),
        "heldout_after": table(after.and_then(|gaps| gaps.held_out.as_ref()), &setup.held_out),
    })
}

/// Rows by phase, columns by channel.
fn cells(
    (setup, problem): (&Setup, &Problem<'_>),
    (of, phases): (Option<usize>, usize),
    gap: &Gap,
    shots: &[usize],
) -> Vec<Vec<Value>> {
    let channels = setup.data.channels.len();
    let (mut sums, mut counts) = (vec![vec![0.0; channels]; phases], vec![vec![0.0; channels]; phases]);
    let plain = Weighing::whole(shots, 0.0);
    let mut row = 0;
    for &shot in shots {
        let phase = phase_of(setup, of, shot);
        for channel in 0..channels {
            for (weight, &phase) in problem.weights(shot, channel, &plain).iter().zip(&phase) {
                if *weight > 0.0 {
                    sums[phase][channel] += square(gap.fit.residuals[row]);
                    counts[phase][channel] += 1.0;
                }
                row += 1;
            }
        }
    }
    let root = |(sum, count): (&f64, &f64)| number((sum / count).sqrt());
    sums.iter().zip(&counts).map(|(sums, counts)| sums.iter().zip(counts).map(root).collect()).collect()
}

/// The phase of every sample of a shot.
fn phase_of(setup: &Setup, of: Option<usize>, shot: usize) -> Vec<usize> {
    let data = &setup.data.shots[shot];
    let count = data.times.len();
    let Some(channel) = of else { return (0..count).map(|k| 3 * k / count).collect() };
    let Some(trace) = &data.traces[channel] else { return vec![0; count] };
    let values: Vec<Option<f64>> =
        trace.values.iter().zip(&trace.used).map(|(&value, &used)| used.then_some(value)).collect();
    let known = || values.iter().flatten();
    let (low, high) = (known().copied().fold(f64::MAX, f64::min), known().copied().fold(f64::MIN, f64::max));
    // A shot in which the channel hardly moves, though it does in others, has no phases.
    let info = &setup.data.channels[channel];
    if high - low < RANGE * info.noise.sigma || high - low < MOVES * info.range {
        return vec![0; count];
    }
    let at = |share: f64| low + share * (high - low);
    let above = |share: f64, from: usize| (from..count).find(|&k| values[k].is_some_and(|value| value > at(share)));
    let below = |share: f64, from: usize| (from..count).find(|&k| values[k].is_some_and(|value| value < at(share)));
    let moves = above(MOVES, 0).unwrap_or(count);
    let arrived = above(ARRIVED, moves).unwrap_or(count);
    // It may swing after it has arrived: it leaves when it is half way back.
    let back = below(0.5, arrived).unwrap_or(count);
    let leaves =
        (arrived..back).rev().find(|&k| values[k].is_some_and(|value| value > at(ARRIVED))).map_or(back, |k| k + 1);
    let home = below(MOVES, back).unwrap_or(count);
    let ends = [moves, arrived, leaves, home];
    (0..count).map(|k| ends.iter().filter(|&&end| k >= end).count()).collect()
}

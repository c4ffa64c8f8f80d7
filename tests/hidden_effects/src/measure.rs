//! Measuring a draft: every shot is run with everything that is hidden, passed through gain, offset and correlated noise, and
//! recorded to its step.  Also the raw signature: how far the hidden part moves the ideal signals, in standard deviations.

use crate::disturb;
use crate::draft::{Draft, NOISE, STEP};
use crate::integrator::Failure;
use crate::random::Stream;
use crate::shot;

/// Samples per shot.
pub const SAMPLES: usize = 1001;
/// Samples per second.
pub const RATE: f64 = 20_000.0;
/// Recorded time before the stated trigger, s.
pub const BEFORE: f64 = 0.002;

/// Times of the samples, s.
pub fn times() -> Vec<f64> {
    (0..SAMPLES).map(|sample| (sample as f64 - BEFORE * RATE) / RATE).collect()
}

/// Standard deviation of what a channel records: noise and rounding.
pub fn sigma(draft: &Draft, channel: usize) -> f64 {
    let noise = NOISE[channel] * draft.noise;
    (noise * noise + STEP[channel] * STEP[channel] / 12.0).sqrt()
}

/// True signals of a shot.
pub fn ideal(draft: &Draft, place: usize) -> Result<Vec<[f64; 6]>, Failure> {
    let (machine, conditions) = draft.actual(place);
    shot::run(&machine, &conditions, &disturb::machine_times(draft, times()), shot::TOLERANCE)
}

/// What the recorders of a shot hold, rounded to their steps; `end` is a channel and the largest value that it shows.
pub fn recorded(draft: &Draft, place: usize, ideal: &[[f64; 6]], end: Option<(usize, f64)>) -> Vec<[f64; 6]> {
    let mut stream = Stream::new(draft.request.seed, &format!("{} noise {place}", draft.request.name));
    let mut rows = vec![[0.0; 6]; ideal.len()];
    let rho = draft.correlation;
    let (times, loud) = (times(), disturb::loud(draft));
    for channel in 0..6 {
        let added = disturb::added(draft, place, channel, &times);
        let mut noise = stream.normal();
        for ((row, signal), added) in rows.iter_mut().zip(ideal).zip(added) {
            let value = draft.gain[channel] * signal[channel]
                + draft.offset[channel]
                + draft.extra_offset[channel]
                + NOISE[channel] * draft.noise * loud * noise
                + added;
            let largest = end.filter(|(own, _)| *own == channel).map_or(f64::INFINITY, |(_, end)| end);
            row[channel] = (value.min(largest) / STEP[channel]).round() * STEP[channel];
            noise = rho * noise + (1.0 - rho * rho).sqrt() * stream.normal();
        }
    }
    disturb::drop(draft, place, &mut rows);
    rows
}

/// RMS over all samples of a channel of what is hidden, in standard deviations; parameters, gains and offsets as they truly are.
pub fn signature(draft: &Draft, ideal: &[Vec<[f64; 6]>]) -> Result<[f64; 6], Failure> {
    let mut sums = [0.0; 6];
    for (place, rows) in ideal.iter().enumerate() {
        let (machine, conditions) = draft.believed_true(place);
        let bare = shot::run(&machine, &conditions, &times(), shot::TOLERANCE)?;
        for (row, base) in rows.iter().zip(&bare) {
            for channel in 0..6 {
                let moved = draft.gain[channel] * (row[channel] - base[channel]) + draft.extra_offset[channel];
                sums[channel] += (moved / sigma(draft, channel)).powi(2);
            }
        }
    }
    let samples = (ideal.len() * SAMPLES) as f64;
    Ok(sums.map(|sum| (sum / samples).sqrt()))
}

/// Ideal signals and records by shot.
pub type Measured = (Vec<Vec<[f64; 6]>>, Vec<Vec<[f64; 6]>>);

/// All shots: ideal signals and what was recorded.
pub fn all(draft: &Draft) -> Result<Measured, String> {
    let ideal: Vec<Vec<[f64; 6]>> =
        (0..draft.shots.len())
            .map(|place| ideal(draft, place))
            .collect::<Result<_, _>>()
            .map_err(|failure| format!("{}: the run fails at {} s", draft.request.name, failure.time))?;
    let end = disturb::end_of_range(draft, &ideal);
    let recorded = ideal.iter().enumerate().map(|(place, rows)| recorded(draft, place, rows, end)).collect();
    Ok((ideal, recorded))
}

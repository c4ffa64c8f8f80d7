//! What disturbs a bench as laboratories disturb it, beside the noise that is stated: hum of the mains, drift, parameters that
//! scatter from shot to shot, noise larger than stated, samples missing in bursts, heavy tails with spikes, a channel whose range is too
//! small, a recorder whose clock is wrong.
//!
//! A disturbance draws its numbers from streams of its own, so that a bench with one is the same bench as without it.

use crate::draft::{Draft, NOISE};
use crate::machine::Machine;
use crate::random::Stream;
use std::f64::consts::TAU;

/// Kinds, by the word that requests and plans use.
pub const KINDS: [&str; 8] = ["hum", "drift", "scatter", "loud", "gaps", "tails", "clipped", "clock"];
/// Of these, one at random disturbs a trial of a plan that names none.
pub const DRAWN: [&str; 6] = ["hum", "drift", "scatter", "loud", "gaps", "tails"];

/// Amplitude of the hum, in standard deviations of the stated noise, and its frequency (Hz).
const HUM: (f64, f64) = (1.0, 50.0);
/// Standard deviation of the drift from the beginning to the end of a record, in those of the noise.
const DRIFT: f64 = 3.0;
/// Parameters that may scatter from shot to shot, how many of them do, and by how much.
const SCATTERING: [&str; 8] = ["R", "k_x", "F_x0", "mu_0", "K", "k_y", "b_y", "F_y0"];
const HOW_MANY: usize = 2;
const BY: (f64, f64) = (0.01, 0.03);
/// Factor on the noise that is not stated.
const LOUD: f64 = 1.4;
/// Bursts of missing samples in a record, and samples in one.
const BURSTS: (usize, usize) = (4, 30);
/// Degrees of freedom of heavy tails; share and size of spikes in standard deviations.
const TAILS: f64 = 4.0;
const SPIKES: (f64, f64) = (0.003, 20.0);
/// Where the range of a channel ends, as a share of what it would show.
const RANGE: (f64, f64) = (0.6, 0.95);
/// By which part a clock runs fast or slow.
const CLOCK: (f64, f64) = (0.002, 0.006);

/// True if this disturbance is asked for.
fn has(draft: &Draft, kind: &str) -> bool {
    draft.request.disturbances.iter().any(|own| own == kind)
}

fn stream(draft: &Draft, words: &str) -> Stream {
    Stream::new(draft.request.seed, &format!("{} {words}", draft.request.name))
}

/// Lets parameters of a shot's machine scatter.
pub fn scatter(draft: &Draft, place: usize, machine: &mut Machine) {
    if !has(draft, "scatter") {
        return;
    }
    let mut which = stream(draft, "scattering");
    for _ in 0..HOW_MANY {
        let name = *which.pick(&SCATTERING);
        let size = which.uniform(BY.0, BY.1);
        let factor = 1.0 + size * stream(draft, &format!("scatter {name} {place}")).normal_within(2.5);
        if let Some(value) = machine.parameter(name) {
            *value *= factor;
        }
    }
}

/// What the chain of a channel adds to the samples of a shot.
pub fn added(draft: &Draft, place: usize, channel: usize, times: &[f64]) -> Vec<f64> {
    let sigma = NOISE[channel] * draft.noise;
    let mut values = vec![0.0; times.len()];
    let mut own = stream(draft, &format!("added {place} {channel}"));
    if has(draft, "hum") {
        let phase = TAU * own.unit();
        for (value, time) in values.iter_mut().zip(times) {
            *value += HUM.0 * sigma * (TAU * HUM.1 * time + phase).sin();
        }
    }
    if has(draft, "drift") {
        let by = DRIFT * sigma * own.normal_within(2.5);
        let count = times.len() as f64;
        values.iter_mut().enumerate().for_each(|(k, value)| *value += by * k as f64 / count);
    }
    if has(draft, "tails") {
        // Student's distribution as a normal variable over the root of a mean square, in place of a part of the noise.
        for value in &mut values {
            let square: f64 = (0..TAILS as usize).map(|_| own.normal().powi(2)).sum::<f64>() / TAILS;
            *value += 0.7 * sigma * own.normal() / square.sqrt();
            if own.chance(SPIKES.0) {
                *value += SPIKES.1 * sigma * own.normal();
            }
        }
    }
    values
}

/// The channel whose range ends before its signals do, and where (true signals of all shots).
pub fn end_of_range(draft: &Draft, ideal: &[Vec<[f64; 6]>]) -> Option<(usize, f64)> {
    if !has(draft, "clipped") {
        return None;
    }
    let mut own = stream(draft, "clipped");
    let channel = *own.pick(&draft.channels);
    let all = || ideal.iter().flatten().map(|row| row[channel]);
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    Some((channel, low + own.uniform(RANGE.0, RANGE.1) * (high - low)))
}

/// The times of the machine at the times that the recorder writes (s).
pub fn machine_times(draft: &Draft, mut times: Vec<f64>) -> Vec<f64> {
    if has(draft, "clock") {
        let mut own = stream(draft, "clock");
        let part = own.uniform(CLOCK.0, CLOCK.1) * if own.chance(0.5) { 1.0 } else { -1.0 };
        times.iter_mut().for_each(|time| *time *= 1.0 - part);
    }
    times
}

/// Factor on the noise of which the set says nothing.
pub fn loud(draft: &Draft) -> f64 {
    if has(draft, "loud") { LOUD } else { 1.0 }
}

/// Takes samples out.
pub fn drop(draft: &Draft, place: usize, rows: &mut [[f64; 6]]) {
    if !has(draft, "gaps") {
        return;
    }
    for channel in 0..6 {
        let mut own = stream(draft, &format!("gaps {place} {channel}"));
        for _ in 0..BURSTS.0 {
            let length = 1 + (own.unit() * BURSTS.1 as f64) as usize;
            let from = (own.unit() * (rows.len() - length) as f64) as usize;
            rows[from..from + length].iter_mut().for_each(|row| row[channel] = f64::NAN);
        }
    }
}

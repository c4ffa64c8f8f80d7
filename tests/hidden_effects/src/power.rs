//! What a perfect linear analysis would see: `d'Pd`, the squared signature of what is hidden in standard deviations
//! after everything that a lab may fit - parameters within their tolerances, supply pressure and voltage, gains,
//! offsets, a jitter of each shot's trigger - has been projected out with its prior (generalised least squares;
//! whitening of first-order correlation by (r_k - rho r_{k-1})/sqrt(1 - rho^2)).  The lift after its first return below
//! 5 %, where bounces do not repeat, is left out.  This is the expected drop of the cost, from this side alone.  It is
//! optimistic where nuisances act non-linearly.

use crate::draft::{Draft, GAIN, OFFSET, TOLERANCES};
use crate::integrator::Failure;
use crate::measure::{sigma, times};
use crate::shot;

/// Step of the differences, in standard deviations of the priors.
const STEP: f64 = 0.05;
/// Place of the lift among the channels.
const LIFT: usize = 3;
/// Standard deviation of the trigger that a study may free, s.
const JITTER: f64 = 2e-5;
/// Tolerance of the runs: the differences need no more.
const TOLERANCE: f64 = 1e-8;

/// Squared signature before and after projection.
#[derive(Clone, Copy, Debug)]
pub struct Power {
    /// d'd.
    pub raw: f64,
    /// d'Pd.
    pub projected: f64,
}

/// The power of what is hidden in a draft, from its ideal signals.
pub fn power(draft: &Draft, ideal: &[Vec<[f64; 6]>]) -> Result<Power, Failure> {
    let globals = TOLERANCES.len() + 2 * draft.channels.len();
    let count = globals + draft.shots.len();
    let mut normal = vec![vec![0.0; count]; count];
    let mut right = vec![0.0; count];
    let mut raw = 0.0;
    for (row, line) in normal.iter_mut().enumerate() {
        line[row] = 1.0;
    }
    for (place, rows) in ideal.iter().enumerate() {
        let (columns, hidden) = columns(draft, place, rows)?;
        raw += dot(&hidden, &hidden);
        let jitter = globals + place;
        let index = |column: usize| if column < globals { column } else { jitter };
        for (a, first) in columns.iter().enumerate() {
            right[index(a)] += dot(first, &hidden);
            for (b, second) in columns.iter().enumerate().take(a + 1) {
                let product = dot(first, second);
                normal[index(a)][index(b)] += product;
                if a != b {
                    normal[index(b)][index(a)] += product;
                }
            }
        }
    }
    let solution = solve(normal, right.clone());
    Ok(Power { raw, projected: raw - dot(&right, &solution) })
}

/// Whitened derivatives of a shot by globals (parameters, offsets, gains) and its jitter, and the whitened signature.
fn columns(draft: &Draft, place: usize, ideal: &[[f64; 6]]) -> Result<(Vec<Vec<f64>>, Vec<f64>), Failure> {
    let at = times();
    let (machine, conditions) = draft.believed_true(place);
    let base = shot::run(&machine, &conditions, &at, TOLERANCE)?;
    let bounce = bounce(ideal);
    let whitened = |rows: &dyn Fn(usize, usize) -> f64| {
        let mut all = Vec::with_capacity(draft.channels.len() * at.len());
        let scale = (1.0 - draft.correlation * draft.correlation).sqrt();
        for &channel in &draft.channels {
            let sigma = sigma(draft, channel);
            for sample in 0..at.len() {
                if channel == LIFT && sample >= bounce {
                    all.push(0.0);
                    continue;
                }
                let before = if sample > 0 { rows(sample - 1, channel) } else { 0.0 };
                all.push((rows(sample, channel) - draft.correlation * before) / (scale * sigma));
            }
        }
        all
    };
    let mut columns = Vec::new();
    for (name, tolerance) in TOLERANCES {
        let (mut machine, mut moved) = draft.believed_true(place);
        let factor = 1.0 + STEP * tolerance;
        match (name, machine.parameter(name)) {
            (_, Some(value)) => *value *= factor,
            ("C", None) => moved.capacity *= factor,
            ("U0", None) => moved.u_0 *= factor,
            _ => moved.p_0 *= if draft.shots[place].stated.p_0 > crate::draft::PUMP_OFF { factor } else { 1.0 },
        }
        let rows = shot::run(&machine, &moved, &at, TOLERANCE)?;
        columns.push(whitened(&|sample, channel| (rows[sample][channel] - base[sample][channel]) / STEP));
    }
    for &which in &draft.channels {
        columns.push(whitened(&|_, channel| if channel == which { OFFSET[channel] } else { 0.0 }));
    }
    for &which in &draft.channels {
        columns.push(whitened(&|sample, channel| if channel == which { GAIN * base[sample][channel] } else { 0.0 }));
    }
    let mut moved = conditions.clone();
    moved.trigger += STEP * JITTER;
    let rows = shot::run(&machine, &moved, &at, TOLERANCE)?;
    columns.push(whitened(&|sample, channel| (rows[sample][channel] - base[sample][channel]) / STEP));
    let (plain, unmoved) = draft.without_effects(place);
    let without = shot::run(&plain, &unmoved, &at, TOLERANCE)?;
    let hidden = whitened(&|sample, channel| {
        draft.gain[channel] * (ideal[sample][channel] - without[sample][channel]) + draft.extra_offset[channel]
    });
    Ok((columns, hidden))
}

/// The sample from which the lift has come back below 5 % of its largest.
fn bounce(ideal: &[[f64; 6]]) -> usize {
    let (top, largest) =
        ideal.iter().enumerate().fold(
            (0, 0.0),
            |(place, most), (sample, row)| {
                if row[LIFT] > most { (sample, row[LIFT]) } else { (place, most) }
            },
        );
    let returned = ideal.iter().skip(top).position(|row| row[LIFT] < 0.05 * largest);
    returned.map_or(ideal.len(), |samples| top + samples)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Solves a symmetric positive definite system by Cholesky's method.
pub fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for column in 0..n {
        for row in column..n {
            let sum: f64 = (0..column).map(|k| matrix[row][k] * matrix[column][k]).sum();
            let value = matrix[row][column] - sum;
            matrix[row][column] =
                if row == column { value.max(f64::MIN_POSITIVE).sqrt() } else { value / matrix[column][column] };
        }
    }
    for row in 0..n {
        let sum: f64 = (0..row).map(|k| matrix[row][k] * right[k]).sum();
        right[row] = (right[row] - sum) / matrix[row][row];
    }
    for row in (0..n).rev() {
        let sum: f64 = (row + 1..n).map(|k| matrix[k][row] * right[k]).sum();
        right[row] = (right[row] - sum) / matrix[row][row];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_system() {
        let matrix = vec![vec![4.0, 1.0, 0.5], vec![1.0, 3.0, 0.2], vec![0.5, 0.2, 2.0]];
        let wanted = [1.0, -2.0, 0.5];
        let right: Vec<f64> = matrix.iter().map(|row| dot(row, &wanted)).collect();
        let found = solve(matrix, right);
        assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}

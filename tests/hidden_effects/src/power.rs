//! What a perfect linear analysis would see: `d'Pd`, the squared signature of what is hidden in standard deviations
//! after everything that a lab may fit - parameters within their tolerances, supply pressure and voltage, gains,
//! offsets, a jitter of each shot's trigger - has been projected out with its prior (generalised least squares;
//! whitening of first-order correlation by (r_k - rho r_{k-1})/sqrt(1 - rho^2)).  The lift after its first return below
//! 5 %, where bounces do not repeat, is left out.  This is the expected drop of the cost, from this side alone.  It is
//! optimistic where nuisances act non-linearly.

use crate::draft::{Draft, GAIN, OFFSET, TOLERANCES};
use crate::drive::Shot;
use crate::integrator::Failure;
use crate::machine::Machine;
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
    let at = times();
    let mut normal = Normal::new(draft, 0);
    for (place, rows) in ideal.iter().enumerate() {
        let (plain, unmoved) = draft.without_effects(place);
        let hidden = signature(draft, rows, &shot::run(&plain, &unmoved, &at, TOLERANCE)?, draft.extra_offset);
        let sight = Sight::of(draft, rows);
        let columns = columns(draft, place, draft.believed_true(place), &sight)?;
        normal.add(place, &columns, &sight.whitened(&hidden));
    }
    Ok(normal.power())
}

/// The power of each effect of a bench that hides several: its signature beside the others, after the sizes of these have
/// been fitted as well (known beforehand to their own amount).  What else an effect has to fit is not counted, so that
/// this is optimistic, too.
pub fn power_of_each(draft: &Draft, ideal: &[Vec<[f64; 6]>]) -> Result<Vec<Power>, String> {
    let failed = |failure: Failure| format!("{}: {failure:?}", draft.request.name);
    let at = times();
    let count = draft.request.effects.len();
    let mut powers = Vec::with_capacity(count);
    for own in 0..count {
        let without = Draft::draw_without(&draft.request, own)?;
        let mut larger = Vec::new();
        for other in (0..count).filter(|other| *other != own) {
            let mut request = draft.request.clone();
            request.effects[other].1 *= 1.0 + STEP;
            larger.push(Draft::draw_without(&request, own)?);
        }
        let offset = std::array::from_fn(|channel| draft.extra_offset[channel] - without.extra_offset[channel]);
        let mut normal = Normal::new(draft, larger.len());
        for (place, rows) in ideal.iter().enumerate() {
            let run = |(machine, shot): (Machine, Shot)| shot::run(&machine, &shot, &at, TOLERANCE).map_err(failed);
            let base = run(without.actual(place))?;
            let sight = Sight::of(draft, rows);
            let mut columns = columns(draft, place, without.actual(place), &sight).map_err(failed)?;
            for larger in &larger {
                let offset =
                    std::array::from_fn(|channel| larger.extra_offset[channel] - without.extra_offset[channel]);
                let moved = signature(draft, &run(larger.actual(place))?, &base, offset);
                columns.push(sight.whitened(&moved).iter().map(|value| value / STEP).collect());
            }
            normal.add(place, &columns, &sight.whitened(&signature(draft, rows, &base, offset)));
        }
        powers.push(normal.power());
    }
    Ok(powers)
}

/// How far the recorded channels are moved.
fn signature(draft: &Draft, with: &[[f64; 6]], without: &[[f64; 6]], offset: [f64; 6]) -> Vec<[f64; 6]> {
    let moved = |(with, without): (&[f64; 6], &[f64; 6])| {
        std::array::from_fn(|channel| draft.gain[channel] * (with[channel] - without[channel]) + offset[channel])
    };
    with.iter().zip(without).map(moved).collect()
}

/// The normal equations of what may be fitted, priors included, beside a signature: first what all shots share (parameters, offsets, gains,
/// sizes of other effects), then a trigger for each shot.
struct Normal {
    matrix: Vec<Vec<f64>>,
    right: Vec<f64>,
    raw: f64,
    own: usize,
    others: usize,
}

impl Normal {
    fn new(draft: &Draft, others: usize) -> Normal {
        let own = TOLERANCES.len() + 2 * draft.channels.len();
        let count = own + others + draft.shots.len();
        let mut matrix = vec![vec![0.0; count]; count];
        for (row, line) in matrix.iter_mut().enumerate() {
            line[row] = 1.0;
        }
        Normal { matrix, right: vec![0.0; count], raw: 0.0, own, others }
    }

    /// A shot: columns of what is shared, of its trigger, of the others' sizes; and the signature.
    fn add(&mut self, place: usize, columns: &[Vec<f64>], hidden: &[f64]) {
        self.raw += dot(hidden, hidden);
        let index = |column: usize| match column {
            own if own < self.own => own,
            jitter if jitter == self.own => self.own + self.others + place,
            other => other - 1,
        };
        for (a, first) in columns.iter().enumerate() {
            self.right[index(a)] += dot(first, hidden);
            for (b, second) in columns.iter().enumerate().take(a + 1) {
                let product = dot(first, second);
                self.matrix[index(a)][index(b)] += product;
                if a != b {
                    self.matrix[index(b)][index(a)] += product;
                }
            }
        }
    }

    fn power(self) -> Power {
        let solution = solve(self.matrix, self.right.clone());
        Power { raw: self.raw, projected: self.raw - dot(&self.right, &solution) }
    }
}

/// What is compared of a shot, and in which units.
struct Sight<'a> {
    draft: &'a Draft,
    /// The sample from which the lift is left out.
    bounce: usize,
}

impl Sight<'_> {
    fn of<'a>(draft: &'a Draft, ideal: &[[f64; 6]]) -> Sight<'a> {
        Sight { draft, bounce: bounce(ideal) }
    }

    /// Moved signals in standard deviations of white noise, channel after channel.
    fn whitened(&self, moved: &[[f64; 6]]) -> Vec<f64> {
        let rho = self.draft.correlation;
        let scale = (1.0 - rho * rho).sqrt();
        let mut all = Vec::with_capacity(self.draft.channels.len() * moved.len());
        for &channel in &self.draft.channels {
            let sigma = sigma(self.draft, channel);
            for sample in 0..moved.len() {
                if channel == LIFT && sample >= self.bounce {
                    all.push(0.0);
                    continue;
                }
                let before = if sample > 0 { moved[sample - 1][channel] } else { 0.0 };
                all.push((moved[sample][channel] - rho * before) / (scale * sigma));
            }
        }
        all
    }
}

/// Whitened derivatives of a shot by what may be fitted - parameters, offsets, gains, its trigger - around a machine.
fn columns(
    draft: &Draft,
    place: usize,
    (machine, conditions): (Machine, Shot),
    sight: &Sight,
) -> Result<Vec<Vec<f64>>, Failure> {
    let at = times();
    let base = shot::run(&machine, &conditions, &at, TOLERANCE)?;
    let scaled = |rows: &[[f64; 6]]| -> Vec<f64> {
        let moved: Vec<[f64; 6]> = rows
            .iter()
            .zip(&base)
            .map(|(row, base)| std::array::from_fn(|channel| (row[channel] - base[channel]) / STEP))
            .collect();
        sight.whitened(&moved)
    };
    let mut columns = Vec::new();
    for (name, tolerance) in TOLERANCES {
        let (mut machine, mut moved) = (machine.clone(), conditions.clone());
        let factor = 1.0 + STEP * tolerance;
        match (name, machine.parameter(name)) {
            (_, Some(value)) => *value *= factor,
            ("C", None) => moved.capacity *= factor,
            ("U0", None) => moved.u_0 *= factor,
            _ => moved.p_0 *= if draft.shots[place].stated.p_0 > crate::draft::PUMP_OFF { factor } else { 1.0 },
        }
        columns.push(scaled(&shot::run(&machine, &moved, &at, TOLERANCE)?));
    }
    let alone = |which: usize, value: &dyn Fn(usize) -> f64| {
        let mut rows = vec![[0.0; 6]; at.len()];
        rows.iter_mut().enumerate().for_each(|(sample, row)| row[which] = value(sample));
        sight.whitened(&rows)
    };
    columns.extend(draft.channels.iter().map(|&which| alone(which, &|_| OFFSET[which])));
    columns.extend(draft.channels.iter().map(|&which| alone(which, &|sample| GAIN * base[sample][which])));
    let mut moved = conditions.clone();
    moved.trigger += STEP * JITTER;
    columns.push(scaled(&shot::run(&machine, &moved, &at, TOLERANCE)?));
    Ok(columns)
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

    /// The bench without one effect is the bench in everything else, and a lone effect is seen as well by itself as beside none.
    #[test]
    fn each_of_several_effects_is_seen_beside_the_others() {
        let request = |effects: &[(&str, f64)]| crate::draft::Request {
            name: "pair".into(),
            seed: 11,
            effects: effects.iter().map(|(id, size)| (id.to_string(), *size)).collect(),
            disturbances: Vec::new(),
            points: crate::draft::Points { first: Some(2), more: Vec::new() },
        };
        let both = request(&[("chamber_leakage", 1.0), ("sensor_offset", 1.0)]);
        let without = Draft::draw_without(&both, 0).expect("a bench");
        let whole = Draft::draw(&both).expect("a bench");
        assert_eq!((without.offset, &without.factors), (whole.offset, &whole.factors));
        assert!(without.extra_offset == whole.extra_offset && without.truth.len() == 1);
        let ideal = |draft: &Draft| -> Vec<Vec<[f64; 6]>> {
            (0..draft.shots.len()).map(|place| crate::measure::ideal(draft, place).expect("a run")).collect()
        };
        let each = power_of_each(&whole, &ideal(&whole)).expect("powers");
        // A leak moves the pressure; an offset is what a lab may fit.
        assert!(each[0].projected > 1000.0 && each[1].projected < 400.0, "{each:?}");
        let alone = Draft::draw(&request(&[("chamber_leakage", 1.0)])).expect("a bench");
        let alone = power_of_each(&alone, &ideal(&alone)).expect("powers")[0];
        assert!((each[0].projected / alone.projected - 1.0).abs() < 0.05, "{each:?} {alone:?}");
    }
}

//! How much of a root function is rounding.
//!
//! Where a fast motion has settled, a rate is the small difference of large terms divided by a small number (`tau*der(i) = u - i` with `tau` of
//! picoseconds): the last bit of a state moves it, and a relation such as `der(i) > 0` switches with each step while nothing happens.
//! What a bit does is measured: states and time are moved by their rounding, some up and some down, the rest is made consistent, and the
//! root functions are looked at again (a random perturbation of the last bits, as Vignes 1993, *A stochastic arithmetic for reliable
//! scientific computation*, Math. Comput. Simul. 35).

use crate::initial::consistent::Consistency;
use crate::problem::Problem;
use crate::weights::Weights;

/// Perturbed points that are looked at.
const TRIALS: u32 = 4;
/// What no trial has exceeded may be larger by this factor: few of many bits moved the same way.
const SAFETY: f64 = 4.0;

/// Sizes below which the root functions at `t` (s), which are `values` there, are nothing but rounding of the states of `y`.
pub(crate) fn rounding_of_roots(
    problem: &mut Problem<'_>,
    consistency: &mut Consistency,
    weights: &Weights,
    (t, h): (f64, f64),
    (y, yp): (&[f64], &[f64]),
    values: &[f64],
) -> Vec<f64> {
    let states = consistency.states().to_vec();
    let mut sizes = vec![0.0_f64; values.len()];
    let mut moved = vec![0.0; values.len()];
    let (mut trial_y, mut trial_yp) = (y.to_vec(), yp.to_vec());
    for trial in 0..TRIALS {
        for k in 0..y.len() {
            trial_y[k] = if states[k] { nudged(y[k], trial, k) } else { y[k] };
        }
        trial_yp.copy_from_slice(yp);
        let time = nudged(t, trial, y.len());
        if !consistency.refine(problem, (time, h), weights, &mut trial_y, &mut trial_yp) {
            continue;
        }
        problem.system.roots(time, &trial_y, &trial_yp, &mut moved);
        for ((size, moved), value) in sizes.iter_mut().zip(&moved).zip(values) {
            let difference = SAFETY * (moved - value).abs();
            *size = if difference.is_finite() { size.max(difference) } else { *size };
        }
    }
    sizes
}

/// A number moved by its rounding, up or down: the same way in every run (multiplicative hashing, Knuth 1998, section 6.4).
fn nudged(x: f64, trial: u32, k: usize) -> f64 {
    let hash = (k as u32).wrapping_mul(TRIALS).wrapping_add(trial + 1).wrapping_mul(2_654_435_769);
    if hash >> 31 == 0 { x + f64::EPSILON * x } else { x - f64::EPSILON * x }
}

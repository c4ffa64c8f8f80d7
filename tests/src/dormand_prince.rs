//! The explicit Runge-Kutta pair 5(4) of Dormand and Prince for `y' = f(t, y)` with N components.
//!
//! Coefficients: Dormand, Prince, "A family of embedded Runge-Kutta formulae", J. Comput. Appl. Math. 6 (1980), table 2; step
//! control after Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I" (2nd ed. 1993), section II.4.  Steps end
//! on the output points, so that nothing is interpolated.  No dense output and no detection of stiffness.

/// Nodes.
pub const C: [f64; 7] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
/// Weights of the stages; the last row is the formula of order 5.
pub const A: [[f64; 6]; 7] = [
    [0.0; 6],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Difference of the formulas of order 5 and 4.
pub const E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Accuracy of a run.
pub struct Accuracy<const N: usize> {
    /// Relative tolerance.
    pub rtol: f64,
    /// Absolute tolerance of each component.
    pub atol: [f64; N],
}

/// Integrates over ascending `times` (s) from `y` at the first of them and returns the values at all of them.  The right-hand
/// side must be smooth in time between the first and the last; panics if the step becomes too small.
pub fn integrate<const N: usize>(
    f: impl Fn(f64, &[f64; N]) -> [f64; N],
    times: &[f64],
    mut y: [f64; N],
    accuracy: &Accuracy<N>,
) -> Vec<[f64; N]> {
    let mut values = vec![y];
    let mut t = times[0];
    let mut h = 1e-9;
    let mut k = [[0.0; N]; 7];
    k[0] = f(t, &y);
    for &end in &times[1..] {
        while t < end {
            let last = t + 1.0001 * h >= end;
            let step = if last { end - t } else { h };
            let next = try_step(&f, t, step, &y, &mut k);
            let error = error_norm(&k, step, &y, &next, accuracy);
            let factor = (0.9 * error.powf(-0.2)).clamp(0.2, 5.0);
            if error <= 1.0 {
                t = if last { end } else { t + step };
                y = next;
                k[0] = k[6];
                // A step cut short by an output point says nothing against the longer one.
                h = if last { h.max(step * factor) } else { step * factor };
            } else {
                h = step * factor.min(1.0);
                assert!(h > 1e-15 * t.abs().max(1e-3), "the step has become too small at {t} s");
            }
        }
        values.push(y);
    }
    values
}

/// Values after a step; fills the stages `k[1..]` from `k[0]`.
fn try_step<const N: usize>(
    f: &impl Fn(f64, &[f64; N]) -> [f64; N],
    t: f64,
    h: f64,
    y: &[f64; N],
    k: &mut [[f64; N]; 7],
) -> [f64; N] {
    let mut next = *y;
    for stage in 1..7 {
        next = std::array::from_fn(|i| y[i] + h * (0..stage).map(|j| A[stage][j] * k[j][i]).sum::<f64>());
        k[stage] = f(t + C[stage] * h, &next);
    }
    next
}

/// Root of the mean square of the weighed local errors; infinite if not a number.
fn error_norm<const N: usize>(k: &[[f64; N]; 7], h: f64, y: &[f64; N], next: &[f64; N], accuracy: &Accuracy<N>) -> f64 {
    let part = |i: usize| {
        let error = h * (0..7).map(|j| E[j] * k[j][i]).sum::<f64>();
        error / (accuracy.atol[i] + accuracy.rtol * y[i].abs().max(next[i].abs()))
    };
    let mean = (0..N).map(|i| part(i).powi(2)).sum::<f64>() / N as f64;
    if mean.is_finite() { mean.sqrt().max(1e-10) } else { f64::INFINITY }
}

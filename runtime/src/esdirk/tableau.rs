//! Coefficients of the one-step method: ESDIRK4(3)6L[2]SA.
//!
//! Six stages, the first explicit, the others implicit with one diagonal entry 1/4; order 4, embedded order 3, stage
//! order 2, L-stable, the last stage is the result.  Source: Kennedy, Carpenter, "Additive Runge-Kutta schemes for
//! convection-diffusion-reaction equations", Appl. Numer. Math. 44 (2003) 139, the implicit part of ARK4(3)6L[2]SA. The
//! dense output is derived here: polynomials `b_i(theta)` of degree 4 that satisfy the conditions of order 4 for every
//! theta and join with continuous derivative, `b'(0) = e_1`, `b'(1) = e_6`; the one free number makes the factor by
//! which a stiff component enters between the ends least.  The combination that sees kinks is the only one that
//! vanishes for cubic rates with the stages' own errors of order 3; its scale is that of the largest error a kink
//! makes.  Predictors are least-norm combinations of earlier stages exact for quadratics.

/// Number of stages.
pub(crate) const STAGES: usize = 6;

/// Diagonal entry.
pub(crate) const GAMMA: f64 = 0.25;

/// Order of the result, and of the dense output.
pub(crate) const ORDER: usize = 4;

/// Places of the stages within the step.
pub(crate) const C: [f64; STAGES] = [0.0, 0.5, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0];

/// Rows of the tableau left of the diagonal.
pub(crate) const A: [[f64; STAGES - 1]; STAGES] = [
    [0.0; STAGES - 1],
    [0.25, 0.0, 0.0, 0.0, 0.0],
    [8611.0 / 62500.0, -1743.0 / 31250.0, 0.0, 0.0, 0.0],
    [5012029.0 / 34652500.0, -654441.0 / 2922500.0, 174375.0 / 388108.0, 0.0, 0.0],
    [15267082809.0 / 155376265600.0, -71443401.0 / 120774400.0, 730878875.0 / 902184768.0, 2285395.0 / 8070912.0, 0.0],
    [82889.0 / 524892.0, 0.0, 15625.0 / 83664.0, 69875.0 / 102672.0, -2260.0 / 8211.0],
];

/// Weights of the embedded method of order 3.
const EMBEDDED: [f64; STAGES] = [
    4586570599.0 / 29645900160.0,
    0.0,
    178811875.0 / 945068544.0,
    814220225.0 / 1159782912.0,
    -3700637.0 / 11593932.0,
    61727.0 / 225920.0,
];

/// Weight of stage `i` in the result.
fn weight(i: usize) -> f64 {
    if i + 1 == STAGES { GAMMA } else { A[STAGES - 1][i] }
}

/// Weight of stage `i` in the difference of the two results.
pub(crate) fn difference(i: usize) -> f64 {
    weight(i) - EMBEDDED[i]
}

/// Weight of stage `i` in the measure of kinks, exact up to the common factor.
pub(crate) fn kink(i: usize) -> f64 {
    KINK[i]
}

const KINK: [f64; STAGES] = [
    0.05930268940077737,
    0.4934902353441119,
    -0.4175992073169061,
    0.08845847753712523,
    -0.4047050536616511,
    0.18105285869654267,
];

/// Coefficients of theta^1 to theta^4 in `b_i(theta)`.
const DENSE: [[f64; 4]; STAGES] = [
    [1.0, -75792230501.0 / 14463399060.0, 58665144701.0 / 7231699530.0, -26858725783.0 / 7231699530.0],
    [0.0, -20237659.0 / 1041579.0, 40475318.0 / 1041579.0, -20237659.0 / 1041579.0],
    [0.0, 12915315625.0 / 592807248.0, -88857240625.0 / 2074825368.0, 44041128125.0 / 2074825368.0],
    [0.0, -35499769675.0 / 5092428528.0, 42431229925.0 / 2546214264.0, -22948480025.0 / 2546214264.0],
    [0.0, 769465364.0 / 45250821.0, -1588750168.0 / 45250821.0, 806829944.0 / 45250821.0],
    [0.0, -143.0 / 20.0, 143.0 / 10.0, -69.0 / 10.0],
];

/// `b_i(theta)` and its derivative.
pub(crate) fn dense(i: usize, theta: f64) -> (f64, f64) {
    let [a, b, c, d] = DENSE[i];
    let value = theta * (a + theta * (b + theta * (c + theta * d)));
    let slope = a + theta * (2.0 * b + theta * (3.0 * c + theta * 4.0 * d));
    (value, slope)
}

/// Combination of earlier rates that predicts the rate of stage `i` from the third on.
pub(super) const PREDICTOR: [[f64; STAGES - 1]; STAGES] = [
    [0.0; STAGES - 1],
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [0.336, 0.664, 0.0, 0.0, 0.0],
    [0.20819277108433734, 2.125714285714286, -1.333907056798623, 0.0, 0.0],
    [0.5679653512962615, -0.11061567902666354, -1.975224431668342, 2.517874759398744, 0.0],
    [0.29999088540959246, -0.35439604629369703, -0.5778807557547722, 0.07995041341570605, 1.5523355032231707],
];

/// Combinations of all rates of a step that give slope and curvature of the rates at its end (quadratic fit).
pub(super) const END_SLOPE: [f64; STAGES] = [
    1.2826647626635923,
    -1.7031879766608775,
    -1.5215954998002004,
    -1.3237825071571543,
    0.5892824816873267,
    2.676618739267313,
];
pub(super) const END_CURVATURE: [f64; STAGES] = [
    4.301107511067967,
    -3.2837383277541528,
    -2.3948386659879035,
    -2.8903377859381796,
    0.258948268970248,
    4.008858999642021,
];

#[cfg(test)]
mod tests {
    use super::*;

    fn full(i: usize) -> [f64; STAGES] {
        std::array::from_fn(|j| if i > 0 && j == i { GAMMA } else { A[i].get(j).copied().unwrap_or(0.0) })
    }

    fn sum(weights: &[f64], values: impl Fn(usize) -> f64) -> f64 {
        weights.iter().enumerate().map(|(i, w)| w * values(i)).sum()
    }

    fn holds(value: f64, expected: f64) {
        assert!((value - expected).abs() < 1e-12, "{value} instead of {expected}");
    }

    /// Conditions up to order `p` (Hairer, Norsett, Wanner 1993, table II.2.2) for weights of a result at `theta`, given that
    /// the stages are of order 2.
    fn order_conditions(weights: &[f64], theta: f64, p: i32) {
        for q in 1..=p {
            holds(sum(weights, |i| C[i].powi(q - 1)), theta.powi(q) / f64::from(q));
        }
        if p >= 4 {
            holds(sum(weights, |i| sum(&full(i), |j| C[j] * C[j])), theta.powi(4) / 12.0);
        }
    }

    #[test]
    fn orders_are_as_stated() {
        for (i, c) in C.into_iter().enumerate() {
            holds(sum(&full(i), |_| 1.0), c);
            holds(sum(&full(i), |j| C[j]), c * c / 2.0);
        }
        order_conditions(&full(5), 1.0, 4);
        order_conditions(&EMBEDDED, 1.0, 3);
        // The pair differs in order 4, or there would be no error estimate.
        assert!((sum(&EMBEDDED, |i| C[i].powi(3)) - 0.25).abs() > 1e-4);
    }

    /// A rate with slope 1 from `theta` on: what the weights make of it, and the error of the result, in `h^2`.
    fn at_kink(theta: f64) -> (f64, f64, f64) {
        let bent = |weights: &[f64]| sum(weights, |i| (C[i] - theta).max(0.0));
        let embedded: Vec<f64> = (0..STAGES).map(difference).collect();
        (bent(&KINK), bent(&embedded), bent(&full(5)) - 0.5 * (1.0 - theta).powi(2))
    }

    #[test]
    fn kinks_are_seen_at_their_size_and_smooth_rates_not_at_all() {
        for q in 0..4 {
            holds(sum(&KINK, |i| C[i].powi(q)), 0.0);
        }
        holds(sum(&KINK, |i| sum(&full(i), |j| C[j] * C[j])), 0.0);
        let kinks: Vec<_> = (0..=1000).map(|k| at_kink(k as f64 / 1000.0)).collect();
        let largest = |value: fn(&(f64, f64, f64)) -> f64| kinks.iter().map(|k| value(k).abs()).fold(0.0, f64::max);
        let (seen, embedded, error) = (largest(|k| k.0), largest(|k| k.1), largest(|k| k.2));
        assert!((seen / error - 1.0).abs() < 1e-3, "{seen} of {error}");
        // What it is for: the embedded result sees a tenth at most.
        assert!(embedded < 0.1 * error, "{embedded} of {error}");
    }

    #[test]
    fn dense_output_has_order_four_and_joins_smoothly() {
        for theta in [0.0, 0.1, 0.35, 0.5, 0.8, 1.0] {
            let weights: Vec<f64> = (0..STAGES).map(|i| dense(i, theta).0).collect();
            order_conditions(&weights, theta, 4);
        }
        for i in 0..STAGES {
            holds(dense(i, 1.0).0, weight(i));
            holds(dense(i, 0.0).1, if i == 0 { 1.0 } else { 0.0 });
            holds(dense(i, 1.0).1, if i == 5 { 1.0 } else { 0.0 });
        }
    }

    /// `R(infinity) = 0`: with `y' = lambda y` and lambda without bound the stages solve `A k = 0` for the implicit ones.
    #[test]
    fn the_method_is_damped_at_infinity() {
        let mut rates = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for i in 1..STAGES {
            rates[i] = -sum(&A[i][..i], |j| rates[j]) / GAMMA;
        }
        holds(rates[5], 0.0);
    }

    #[test]
    fn predictors_are_exact_for_quadratics() {
        for i in 2..STAGES {
            for q in 0..if i == 2 { 2 } else { 3 } {
                holds(sum(&PREDICTOR[i], |j| C[j].powi(q)), C[i].powi(q));
            }
        }
        for (q, slope, curvature) in [(0, 0.0, 0.0), (1, 1.0, 0.0), (2, 2.0, 2.0)] {
            holds(sum(&END_SLOPE, |j| C[j].powi(q)), slope);
            holds(sum(&END_CURVATURE, |j| C[j].powi(q)), curvature);
        }
    }
}

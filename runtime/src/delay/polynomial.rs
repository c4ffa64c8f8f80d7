//! Polynomials through values: of degree 4 through five equally spaced ones, and of any degree through given points.
//!
//! The first is the form in which the past is kept; the others serve where only scattered points are known.  Source: Newton's
//! divided differences and Neville's scheme, for instance Stoer, Bulirsch, "Introduction to Numerical Analysis"
//! (Springer 2002), section 2.1.

/// Values per piece.
pub(super) const NODES: usize = 5;

/// Differences of five values `f_k` at `s = k`, so that `f(s) = sum d_j binomial(s, j)`.
fn differences(nodes: &[f64; NODES]) -> [f64; NODES] {
    let mut d = *nodes;
    for order in 1..NODES {
        for k in (order..NODES).rev() {
            d[k] -= d[k - 1];
        }
    }
    d
}

/// The polynomial at `part` of the interval, 0 at its beginning and 1 at its end.
pub(super) fn value(nodes: &[f64; NODES], part: f64) -> f64 {
    let d = differences(nodes);
    let s = part * (NODES - 1) as f64;
    let mut sum = d[4];
    for j in (0..4).rev() {
        sum = d[j] + sum * (s - j as f64) / (j + 1) as f64;
    }
    sum
}

/// Its second derivative with respect to `part`.
pub(super) fn curvature(nodes: &[f64; NODES], part: f64) -> f64 {
    let d = differences(nodes);
    let s = part * (NODES - 1) as f64;
    let (mut sum, mut slope, mut bend) = (d[4], 0.0, 0.0);
    for j in (0..4).rev() {
        let (below, x) = ((j + 1) as f64, s - j as f64);
        bend = (bend * x + 2.0 * slope) / below;
        slope = (slope * x + sum) / below;
        sum = d[j] + sum * x / below;
    }
    bend * ((NODES - 1) * (NODES - 1)) as f64
}

/// How the values at the four later nodes count for the value at `part`, each less the first one, and for the rate
/// there.  One set of weights serves all values of a piece, and values that are all alike give no rate at all.
pub(super) fn weights(part: f64) -> ([f64; NODES - 1], [f64; NODES - 1]) {
    let s = part * (NODES - 1) as f64;
    // Products of the factors s - k below and above each node, and their derivatives.
    let x: [f64; NODES] = std::array::from_fn(|k| s - k as f64);
    let (mut below, mut below_slope) = ([1.0; NODES], [0.0; NODES]);
    let (mut above, mut above_slope) = ([1.0; NODES], [0.0; NODES]);
    for k in 1..NODES {
        below[k] = below[k - 1] * x[k - 1];
        below_slope[k] = below_slope[k - 1] * x[k - 1] + below[k - 1];
        let j = NODES - 1 - k;
        above[j] = above[j + 1] * x[j + 1];
        above_slope[j] = above_slope[j + 1] * x[j + 1] + above[j + 1];
    }
    // Inverse products of the distances of a node to the others.
    const SCALES: [f64; NODES - 1] = [-1.0 / 6.0, 0.25, -1.0 / 6.0, 1.0 / 24.0];
    let value = std::array::from_fn(|j| SCALES[j] * below[j + 1] * above[j + 1]);
    let slope = |j: usize| below_slope[j + 1] * above[j + 1] + below[j + 1] * above_slope[j + 1];
    (value, std::array::from_fn(|j| (NODES - 1) as f64 * SCALES[j] * slope(j)))
}

/// The fourth difference: the size of the highest term.
pub(super) fn highest(nodes: &[f64; NODES]) -> f64 {
    differences(nodes)[4]
}

/// The derivative at the first of five points with distance `step`, backwards if that is negative.
pub(super) fn end_slope(nodes: &[f64; NODES], step: f64) -> f64 {
    let [a, b, c, d, e] = *nodes;
    (-25.0 * a + 48.0 * b - 36.0 * c + 16.0 * d - 3.0 * e) / (12.0 * step)
}

/// Value and derivative at `x` of the polynomial through `(xs[k], ys[k])`; `ys` is overwritten.
pub(super) fn through(xs: &[f64], ys: &mut [f64], x: f64) -> (f64, f64) {
    let n = xs.len();
    for order in 1..n {
        for k in (order..n).rev() {
            ys[k] = (ys[k] - ys[k - 1]) / (xs[k] - xs[k - order]);
        }
    }
    let (mut sum, mut slope) = (ys[n - 1], 0.0);
    for k in (0..n - 1).rev() {
        slope = slope * (x - xs[k]) + sum;
        sum = ys[k] + sum * (x - xs[k]);
    }
    (sum, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn f(x: f64) -> f64 {
        x.powi(4) - 2.0 * x.powi(3) + x - 5.0
    }

    fn slope(x: f64) -> f64 {
        4.0 * x.powi(3) - 6.0 * x * x + 1.0
    }

    #[test]
    fn quartics_are_exact() {
        let nodes: [f64; NODES] = std::array::from_fn(|k| f(2.0 + 3.0 * k as f64 / 4.0));
        for part in [0.0, 0.1, 0.5, 0.77, 1.0, 1.2] {
            let x = 2.0 + 3.0 * part;
            assert!((value(&nodes, part) - f(x)).abs() < 1e-11, "{part}");
            let (of_value, of_rate) = weights(part);
            let sum =
                |weights: &[f64; NODES - 1]| -> f64 { (0..4).map(|k| weights[k] * (nodes[k + 1] - nodes[0])).sum() };
            assert!((nodes[0] + sum(&of_value) - f(x)).abs() < 1e-11, "{part}");
            assert!((sum(&of_rate) / 3.0 - slope(x)).abs() < 1e-11, "{part}");
            assert!((curvature(&nodes, part) / 9.0 - (12.0 * x * x - 12.0 * x)).abs() < 1e-10, "{part}");
        }
        assert!((end_slope(&nodes, 0.75) - slope(2.0)).abs() < 1e-12);
        assert!((highest(&nodes) - 24.0 * 0.75f64.powi(4)).abs() < 1e-10);
        let xs = [0.0, 1.0, 1.5, -1.0, 3.0];
        let (v, s) = through(&xs, &mut xs.map(f), 2.2);
        assert!((v - f(2.2)).abs() < 1e-12 && (s - slope(2.2)).abs() < 1e-12);
    }
}

//! Slopes at the points of a table from which cubic pieces follow.
//!
//! Akima 1970, "A new method of interpolation and smooth curve fitting based on local procedures", J. ACM 17(4); its modified weights
//! as MATLAB's `makima` has them; Fritsch and Butland 1984, "A method for constructing local monotone piecewise cubic interpolants", SIAM
//! J. Sci. Stat. Comput. 5(2); Steffen 1990, "A simple method for monotonic interpolation in one dimension", Astron. Astrophys. 239.

use crate::external::table_data::Smoothness;

/// The slopes at all points; there are three at least.
pub(crate) fn slopes(x: &[f64], y: &[f64], smoothness: Smoothness) -> Vec<f64> {
    let d: Vec<f64> = (1..x.len()).map(|k| (y[k] - y[k - 1]) / (x[k] - x[k - 1])).collect();
    match smoothness {
        Smoothness::Akima => akima(&d, 0.0),
        Smoothness::ModifiedAkima => akima(&d, 0.5),
        Smoothness::FritschButland => {
            monotone(x, &d, |h, k, a, b| 3.0 * (h + k) / ((h + 2.0 * k) / a + (k + 2.0 * h) / b))
        }
        _ => monotone(x, &d, |h, k, a, b| {
            let slope = (a * k + b * h) / (h + k);
            let least = a.abs().min(b.abs());
            if 0.5 * slope.abs() > least { 2.0 * least * a.signum() } else { slope }
        }),
    }
}

/// Weighted means of the slopes on both sides; `modified` adds that part of the slopes' sizes to the weights.
fn akima(d: &[f64], modified: f64) -> Vec<f64> {
    let n = d.len();
    // Two slopes more on either side, on straight lines.
    let mut all = vec![3.0 * d[0] - 2.0 * d[1], 2.0 * d[0] - d[1]];
    all.extend_from_slice(d);
    all.extend([2.0 * d[n - 1] - d[n - 2], 3.0 * d[n - 1] - 2.0 * d[n - 2]]);
    let weight = |a: f64, b: f64| (a - b).abs() + modified * (a + b).abs();
    let at = |k: usize| {
        let (left, right) = (weight(all[k + 1], all[k]), weight(all[k + 3], all[k + 2]));
        match left + right {
            sum if sum > 0.0 => all[k + 1] + (all[k + 2] - all[k + 1]) * (left / sum),
            _ if modified > 0.0 => 0.0,
            _ => 0.5 * (all[k + 1] + all[k + 2]),
        }
    };
    (0..=n).map(at).collect()
}

/// Zero where the slopes on both sides differ in sign, else their `mean` by widths and slopes; the outer ones at the ends.
fn monotone(x: &[f64], d: &[f64], mean: impl Fn(f64, f64, f64, f64) -> f64) -> Vec<f64> {
    let n = d.len();
    let at = |k: usize| {
        if k == 0 || k == n {
            return d[k.min(n - 1)];
        }
        let (a, b) = (d[k - 1], d[k]);
        if a * b <= 0.0 { 0.0 } else { mean(x[k] - x[k - 1], x[k + 1] - x[k], a, b) }
    };
    (0..=n).map(at).collect()
}

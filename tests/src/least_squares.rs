//! Least squares by the method of Gauss and Newton with a damped step, for fits of few parameters.
//!
//! Minimises the sum of squares of `residuals(p)`; derivatives by central differences, normal equations by elimination with
//! pivoting, steps halved until the sum falls (Nocedal, Wright, "Numerical Optimization", 2nd ed. 2006, section 10.3).

/// The parameters that minimise the sum of squares, from a first guess; panics if the normal equations are singular.
pub fn fit<const N: usize>(residuals: impl Fn(&[f64; N]) -> Vec<f64>, guess: [f64; N]) -> [f64; N] {
    let mut p = guess;
    for _ in 0..100 {
        let r = residuals(&p);
        let step = solve_normal(&jacobian(&residuals, &p), &r);
        let (before, mut scale) = (sum_of_squares(&r), 1.0);
        let mut next = moved(&p, &step, scale);
        while sum_of_squares(&residuals(&next)) > before && scale > 1e-6 {
            scale /= 2.0;
            next = moved(&p, &step, scale);
        }
        let change = (0..N).map(|k| ((next[k] - p[k]) / p[k]).abs()).fold(0.0, f64::max);
        p = next;
        if change < 1e-13 {
            break;
        }
    }
    p
}

fn moved<const N: usize>(p: &[f64; N], step: &[f64; N], scale: f64) -> [f64; N] {
    std::array::from_fn(|k| p[k] - scale * step[k])
}

fn sum_of_squares(r: &[f64]) -> f64 {
    r.iter().map(|r| r * r).sum()
}

/// Columns of the derivatives, one per parameter.
fn jacobian<const N: usize>(residuals: &impl Fn(&[f64; N]) -> Vec<f64>, p: &[f64; N]) -> [Vec<f64>; N] {
    std::array::from_fn(|k| {
        let h = 1e-5 * p[k].abs();
        let at = |sign: f64| {
            let mut q = *p;
            q[k] += sign * h;
            residuals(&q)
        };
        at(1.0).iter().zip(at(-1.0)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
    })
}

/// Solves J'J s = J'r with columns scaled to unit length.
fn solve_normal<const N: usize>(columns: &[Vec<f64>; N], r: &[f64]) -> [f64; N] {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let length: [f64; N] = std::array::from_fn(|k| dot(&columns[k], &columns[k]).sqrt());
    let mut a: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| dot(&columns[i], &columns[j]) / (length[i] * length[j])));
    let mut b: [f64; N] = std::array::from_fn(|i| dot(&columns[i], r) / length[i]);
    for k in 0..N {
        let pivot = (k..N).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        b.swap(k, pivot);
        assert!(a[k][k].abs() > 1e-14, "the parameters cannot be told apart");
        for i in k + 1..N {
            let factor = a[i][k] / a[k][k];
            let row = a[k];
            a[i].iter_mut().zip(row).for_each(|(x, y)| *x -= factor * y);
            b[i] -= factor * b[k];
        }
    }
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    std::array::from_fn(|k| b[k] / length[k])
}

//! What is missing over time, where nobody can say what it is: a free course at the likeliest equation.
//!
//! The course is a polygon over the time of each shot, whose corners the channels answer to ([`crate::evidence::response`]); the corners that bring
//! the model to the measurement are found together with what may be off, and as smooth as the record allows: second differences are penalised (Phillips, Journal of the ACM 9 (1962) 84; Tikhonov
//! 1963) with the largest weight that leaves no more than noise (Morozov 1966).  The equations are linear in it, so a large course is an
//! estimate.

use nalgebra::{Cholesky, DMatrix};

use crate::Fault;
use crate::Setup;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::response::{Corners, corners};
use crate::evidence::thresholds::adequate;
use crate::fit::{Fit, Jacobian};
use crate::problem::Weighing;
use crate::terms::dictionary::Term;
use crate::variant::Workshop;

/// Corners of a course, at most and at least, and samples of a shot for each.
const CORNERS: (usize, usize, usize) = (40, 8, 5);
/// Weights of smoothness that are tried, relative to what the record says of the corners: the exponents of ten of the first and last, and
/// how many to a decade.
const WEIGHTS: (i32, i32, i32) = (6, -6, 2);
/// Errors are those of a course with a weight lower by so many powers of ten: that it is smooth is a preference.
const DOUBT: f64 = 2.0;
/// Where no weight leaves noise alone, the misfit may exceed the least one by this factor.
const ABOVE_LEAST: f64 = 1.05;

/// The missing quantity in one shot.
pub(crate) struct Course {
    /// The shot.
    pub shot: usize,
    /// Times of the corners (s).
    pub times: Vec<f64>,
    /// What is to be added to the right side of the equation.
    pub values: Vec<f64>,
    /// Standard errors, of a course that may be rougher.
    pub errors: Vec<f64>,
    /// Misfit per expected one, without and with the course.
    pub misfit: (f64, f64),
}

/// The courses at the equation of a term, whatever its shape, one for each shot that was fitted.
///
/// # Errors
/// A model that cannot be translated or run.
pub(crate) fn missing(
    setup: &Setup,
    workshop: &Workshop<'_>,
    (hypothesis, fit): (&Hypothesis, &Fit),
    term: &Term,
    weighing: &Weighing,
) -> Result<Vec<Course>, Fault> {
    let count = |samples: usize| (samples / CORNERS.2).clamp(CORNERS.1, CORNERS.0);
    let corners = corners(setup, workshop, (hypothesis, fit), term, (weighing, &count))?;
    let problem = hypothesis.problem(setup)?;
    let mut courses = Vec::new();
    for Corners { shot, times, fit, columns } in corners {
        let Some(jacobian) = &fit.jacobian else { continue };
        let expected = problem.expected(&Weighing { shots: vec![shot], ..weighing.clone() });
        if let Some((values, errors, misfit)) = smoothest(&fit, jacobian, &columns, expected) {
            let misfit = (fit.residuals.norm_squared() / expected, misfit / expected);
            courses.push(Course { shot, times, values, errors, misfit });
        }
    }
    Ok(courses)
}

/// The smoothest corners that leave no more than noise, with their errors, and the misfit left.
fn smoothest(
    fit: &Fit,
    jacobian: &Jacobian,
    corners: &DMatrix<f64>,
    expected: f64,
) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    let (known, count) = (jacobian.matrix.ncols(), corners.ncols());
    let mut whole = DMatrix::zeros(corners.nrows(), known + count);
    whole.columns_mut(0, known).copy_from(&jacobian.matrix);
    whole.columns_mut(known, count).copy_from(corners);
    let mut normal = whole.tr_mul(&whole);
    let mut right = -whole.tr_mul(&fit.residuals);
    for (k, &unknown) in jacobian.unknowns.iter().enumerate() {
        normal[(k, k)] += 1.0;
        right[k] -= fit.xi[unknown];
    }
    let rough = roughness(count);
    let told: f64 = (known..known + count).map(|k| normal[(k, k)]).sum::<f64>() / count as f64;
    if told <= 0.0 || !told.is_finite() {
        return None;
    }
    let solved = |exponent: f64| {
        let mut own = normal.clone();
        let weight = told * hyd_system::math::pow(10.0, exponent);
        for i in 0..count {
            for k in 0..count {
                own[(known + i, known + k)] += weight * rough[(i, k)];
            }
            // Where the record says nothing and a straight line costs nothing, nothing is missing.
            own[(known + i, known + i)] += 1e-9 * weight;
        }
        let factor = Cholesky::new(own)?;
        let found = factor.solve(&right);
        let misfit = (&fit.residuals + &whole * &found).norm_squared();
        Some((factor, found, misfit))
    };
    let steps = (WEIGHTS.0 - WEIGHTS.1) * WEIGHTS.2;
    let exponent = |k: i32| f64::from(WEIGHTS.0) - f64::from(k) / f64::from(WEIGHTS.2);
    let tried = || (0..=steps).filter_map(|k| Some((exponent(k), solved(exponent(k))?)));
    let least = tried().map(|(_, (.., misfit))| misfit).fold(f64::INFINITY, f64::min);
    let enough = adequate(expected).max(ABOVE_LEAST * least);
    let (exponent, (_, found, misfit)) = tried().find(|(_, (.., misfit))| *misfit <= enough)?;
    // A smooth course leaves to what may be off what a rougher one could be as well.
    let covariance = solved(exponent - DOUBT)?.0.inverse();
    let errors = (known..known + count).map(|k| covariance[(k, k)].max(0.0).sqrt()).collect();
    Some((found.rows(known, count).iter().copied().collect(), errors, misfit))
}

/// The sum of squared second differences as a quadratic form.
fn roughness(count: usize) -> DMatrix<f64> {
    let differences = DMatrix::from_fn(count.saturating_sub(2), count, |i, k| match k.wrapping_sub(i) {
        0 | 2 => 1.0,
        1 => -2.0,
        _ => 0.0,
    });
    differences.transpose() * differences
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{roughness, smoothest};
    use crate::fit::{Fit, Jacobian};

    /// A channel that is the integral of a course, an offset beside it, and noise: the course is found within its errors.
    #[test]
    fn a_course_is_found_as_smooth_as_the_record_allows() {
        let (rows, count) = (400, 24);
        let truth = |t: f64| (6.0 * t).sin() * t;
        let hat = |k: usize, t: f64| (1.0 - (t * (count - 1) as f64 - k as f64).abs()).max(0.0);
        let time = |row: usize| row as f64 / (rows - 1) as f64;
        let integral = |f: &dyn Fn(f64) -> f64, row: usize| (0..row).map(|k| f(time(k))).sum::<f64>() / rows as f64;
        let sigma = 2e-3;
        let corners = DMatrix::from_fn(rows, count, |row, k| integral(&|t| hat(k, t), row) / sigma);
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut noise = || {
            let mut uniform = || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                (state >> 11) as f64 / (1_u64 << 53) as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        };
        // What a run leaves that lacks the course: simulated less measured.
        let residuals = DVector::from_fn(rows, |row, _| -integral(&truth, row) / sigma + noise());
        let misfit = residuals.norm_squared();
        let jacobian = Jacobian::new(DMatrix::from_element(rows, 1, 0.5), vec![0]);
        let fit = Fit {
            xi: vec![0.0],
            runs: Vec::new(),
            residuals,
            cost: misfit,
            misfit,
            converged: true,
            steps: 0,
            jacobian: None,
            fresh: true,
            wall: None,
        };
        let (values, errors, left) = smoothest(&fit, &jacobian, &corners, rows as f64).unwrap();
        assert!(misfit > 10.0 * rows as f64 && left < 1.2 * rows as f64, "{misfit} {left}");
        for k in 2..count - 2 {
            let t = k as f64 / (count - 1) as f64;
            assert!((values[k] - truth(t)).abs() < 0.12, "{t}: {} instead of {}", values[k], truth(t));
            assert!(errors[k] > 0.0 && errors[k] < 0.5);
        }
        // A straight line is as smooth as can be.
        let line = DVector::from_fn(count, |k, _| 3.0 - 0.5 * k as f64);
        assert!(line.dot(&(roughness(count) * &line)).abs() < 1e-12);
    }
}

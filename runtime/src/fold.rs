//! The way from a solution that is about to vanish to another one of the same equations.
//!
//! Where a loop has several roots, two of them can meet and vanish (a fold).  There the matrix of the equations is
//! almost singular: its null vector says which unknowns the loop consists of.  One equation of the loop is relaxed,
//! `G(x) = lambda e_k`, and this curve is followed from the last values until `lambda` is zero again; `lambda` turns
//! back at folds, so the curve passes over the unstable branch to the next one.  It is followed by its length in `x`
//! (pseudo-arclength), measured in `max(|x_k|, nominal_k)`. Sources: Keller, "Numerical solution of bifurcation and
//! nonlinear eigenvalue problems" (1977); Allgower, Georg 2003, *Introduction to Numerical Continuation Methods*,
//! chapters 2 and 6.  Finds the first root on the curve, which need not be the nearest in space.

use crate::corrector::damped::Target;
use hyd_system::math::square;

/// First, smallest and largest step along the curve.
const FIRST: f64 = 1e-3;
const SMALLEST: f64 = 1e-9;
const LARGEST: f64 = 0.25;
/// Most steps along the curve.
const MOST_STEPS: usize = 400;
/// Most corrections of a step.
const MOST_CORRECTIONS: usize = 6;
/// Accepted size of a correction, relative to the step.
const ON_CURVE: f64 = 1e-4;
/// The curve may turn by about 25 degrees in a step.
const LEAST_COSINE: f64 = 0.9;

/// Unknowns that take part in the null vector, relative to the largest of them.
const PARTAKES: f64 = 0.01;

/// A point of the curve with the direction in which it goes on.
#[derive(Clone)]
struct Point {
    x: Vec<f64>,
    lambda: f64,
    along: Vec<f64>,
    /// Change of `lambda` per length.
    climb: f64,
}

struct Curve<'a> {
    target: &'a mut dyn Target,
    /// The relaxed equation.
    row: usize,
    scale: Vec<f64>,
    back: Vec<f64>,
    across: Vec<f64>,
}

/// Follows the curve from `x`; true and the first point with `lambda = 0`, to be refined by Newton's method, if there is one.
///
/// Unknowns and equations must stand in the order of blocks, those of a block at the same positions.
pub(crate) fn follow(target: &mut dyn Target, x: &mut [f64], nominals: &[f64]) -> bool {
    let n = x.len();
    let scale = x.iter().zip(nominals).map(|(x, nominal)| x.abs().max(*nominal)).collect();
    let mut curve = Curve { target, row: 0, scale, back: vec![0.0; n], across: vec![0.0; n] };
    let Some(start) = curve.begin(x) else { return false };
    // The curve leads away from the start in two directions; the one towards the lost root is the first to try.
    let towards = -start.lambda.signum() * start.climb.signum();
    for sense in [towards, -towards] {
        let mut start = start.clone();
        start.along.iter_mut().for_each(|a| *a *= sense);
        start.climb *= sense;
        if let Some(found) = curve.walk(start) {
            x.copy_from_slice(&found);
            return true;
        }
    }
    false
}

impl Curve<'_> {
    /// The point of the curve next to `x`.
    fn begin(&mut self, x: &[f64]) -> Option<Point> {
        if !self.target.residual(x, &mut self.back) {
            return None;
        }
        self.target.factor(x).ok()?;
        self.target.solve(&mut self.back);
        let share = |k: usize| (self.back[k] / self.scale[k]).abs();
        let most = (0..x.len()).map(share).fold(0.0, f64::max);
        self.row = (0..x.len()).find(|&k| share(k) > PARTAKES * most)?;
        let length = self.product(&self.back, &self.back).sqrt();
        let along: Vec<f64> = self.back.iter().map(|v| v / length).collect();
        let mut start = Point { x: x.to_vec(), lambda: 0.0, along, climb: 0.0 };
        self.settle(&mut start, FIRST)?;
        (start.along, start.climb) = self.direction(&start)?;
        Some(start)
    }

    fn walk(&mut self, mut at: Point) -> Option<Vec<f64>> {
        let (side, first_climb) = (at.lambda.signum(), at.climb);
        let mut turned = false;
        let mut step = FIRST;
        for _ in 0..MOST_STEPS {
            let Some((next, corrections)) = self.advance(&at, step) else {
                step *= 0.3;
                if step < SMALLEST {
                    return None;
                }
                continue;
            };
            turned |= next.climb * first_climb < 0.0;
            if side * next.lambda <= 0.0 {
                // Without a turn this is the solution from which the curve came, thrown far off where a factor passes through zero.
                if !turned {
                    return None;
                }
                let share = at.lambda / (at.lambda - next.lambda);
                return Some(at.x.iter().zip(&next.x).map(|(a, b)| a + share * (b - a)).collect());
            }
            if corrections <= 3 {
                step = (2.0 * step).min(LARGEST);
            }
            at = next;
        }
        None
    }

    /// The next point of the curve and the corrections that it took.
    fn advance(&mut self, at: &Point, step: f64) -> Option<(Point, usize)> {
        let mut next = at.clone();
        for (x, along) in next.x.iter_mut().zip(&at.along) {
            *x += step * along;
        }
        next.lambda += step * at.climb;
        let corrections = self.settle(&mut next, step)?;
        (next.along, next.climb) = self.direction(&next)?;
        let cosine = self.product(&next.along, &at.along);
        (cosine >= LEAST_COSINE).then_some((next, corrections))
    }

    /// Newton steps across the direction of a point until it is on the curve; their number.
    fn settle(&mut self, point: &mut Point, step: f64) -> Option<usize> {
        let mut last = f64::INFINITY;
        for correction in 1..=MOST_CORRECTIONS {
            let size = self.correct(point)?;
            if size <= ON_CURVE * step {
                return Some(correction);
            }
            if size > 0.5 * last {
                return None;
            }
            last = size;
        }
        None
    }

    /// One Newton step; its size.
    fn correct(&mut self, point: &mut Point) -> Option<f64> {
        if !self.target.residual(&point.x, &mut self.back) {
            return None;
        }
        self.target.factor(&point.x).ok()?;
        self.back[self.row] -= point.lambda;
        self.target.solve(&mut self.back);
        self.respond();
        // x changes by `d across - back`, which has no part along the curve.
        let d = self.product(&point.along, &self.back) / self.product(&point.along, &self.across);
        let mut sum = 0.0;
        for k in 0..self.back.len() {
            let change = d * self.across[k] - self.back[k];
            point.x[k] += change;
            sum += square(change / self.scale[k]);
        }
        point.lambda += d;
        (sum.is_finite() && point.lambda.is_finite()).then_some(sum.sqrt())
    }

    /// What a change of `lambda` by one does to `x`, into `across`.
    fn respond(&mut self) {
        self.across.fill(0.0);
        self.across[self.row] = 1.0;
        self.target.solve(&mut self.across);
    }

    /// Direction of unit length and change of `lambda` along it, on from the direction that the point came with.
    fn direction(&mut self, point: &Point) -> Option<(Vec<f64>, f64)> {
        self.target.factor(&point.x).ok()?;
        self.respond();
        let sense = self.product(&self.across, &point.along).signum();
        let climb = sense / self.product(&self.across, &self.across).sqrt();
        let along = self.across.iter().map(|a| climb * a).collect();
        (climb.is_finite() && climb != 0.0).then_some((along, climb))
    }

    fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).zip(&self.scale).map(|((a, b), scale)| a * b / (scale * scale)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::FactorError;

    /// Two equations: a cubic, and a variable that follows from it.
    struct Cubic {
        level: f64,
        at: f64,
    }

    impl Target for Cubic {
        fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool {
            out[0] = x[0].powi(3) - 3.0 * x[0] - self.level;
            out[1] = x[1] - 10.0 * x[0];
            true
        }
        fn factor(&mut self, x: &[f64]) -> Result<(), FactorError> {
            self.at = 3.0 * x[0] * x[0] - 3.0;
            if self.at == 0.0 { Err(FactorError::Singular { row: 0, column: 0 }) } else { Ok(()) }
        }
        fn factor_deficient(&mut self, _: &[f64]) -> bool {
            false
        }
        fn solve(&mut self, b: &mut [f64]) {
            b[0] /= self.at;
            b[1] += 10.0 * b[0];
        }
        fn contradicts(&self, _: &[f64], _: f64) -> bool {
            false
        }
    }

    #[test]
    fn the_other_root_of_a_cubic_is_found_behind_the_fold() {
        // x^3 - 3x = c loses the root near 1 below c = -2; the one left is -2 cosh(acosh(-c/2)/3).
        for beyond in [1e-12_f64, 1e-6, 0.1] {
            let level = -2.0 - beyond;
            let mut x = [1.0 + 1e-9, 10.0];
            assert!(follow(&mut Cubic { level, at: 0.0 }, &mut x, &[1.0, 1.0]));
            let root = -2.0 * ((-0.5 * level).acosh() / 3.0).cosh();
            assert!((x[0] - root).abs() < 0.05, "{} {root}", x[0]);
        }
    }

    /// x^2 + c has no root for c > 0.
    struct Square(f64);

    impl Target for Square {
        fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool {
            out[0] = x[0] * x[0] + 1e-6;
            true
        }
        fn factor(&mut self, x: &[f64]) -> Result<(), FactorError> {
            self.0 = 2.0 * x[0];
            if self.0 == 0.0 { Err(FactorError::Singular { row: 0, column: 0 }) } else { Ok(()) }
        }
        fn factor_deficient(&mut self, _: &[f64]) -> bool {
            false
        }
        fn solve(&mut self, b: &mut [f64]) {
            b[0] /= self.0;
        }
        fn contradicts(&self, _: &[f64], _: f64) -> bool {
            false
        }
    }

    /// (1 - t) x = 1 at t > 1: the solution came from infinity on the other side.
    struct Pole(f64);

    impl Target for Pole {
        fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool {
            out[0] = self.0 * x[0] - 1.0;
            true
        }
        fn factor(&mut self, _x: &[f64]) -> Result<(), FactorError> {
            Ok(())
        }
        fn factor_deficient(&mut self, _: &[f64]) -> bool {
            false
        }
        fn solve(&mut self, b: &mut [f64]) {
            b[0] /= self.0;
        }
        fn contradicts(&self, _: &[f64], _: f64) -> bool {
            false
        }
    }

    #[test]
    fn a_pole_is_no_fold() {
        for beyond in [1e-12, 1e-8, 1e-3] {
            let mut x = [1.0 / beyond];
            assert!(!follow(&mut Pole(-beyond), &mut x, &[1.0]));
        }
    }

    #[test]
    fn where_no_root_is_left_none_is_found() {
        assert!(!follow(&mut Square(0.0), &mut [1e-7], &[1.0]));
    }
}

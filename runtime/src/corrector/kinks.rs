//! The way through the pieces of a piecewise system to its solution.
//!
//! Newton's method goes by the slopes of one piece, and where these differ by decades it is thrown from one side of the solution to the
//! other: a brake that slips hardly resists and one that is held does not move, an amplifier answers millivolts and no more at its limit.
//! Damping does not help, because in the piece between the residual is larger than on either side.  So the way in each piece ends where the
//! next one begins, and goes on with the slopes of that: the residual stays on one line, `g(x(s)) = (1 - s) g(x(0))`.  Where the
//! determinants of two pieces have different signs, `s` turns back at their border, as at a fold.  A piece ends where the correction that
//! is left over, `J^-1 (g(x(s)) - (1 - s) g)`, becomes large, which is found by halving; so nothing need be known of the pieces.
//! Finite for systems that are continuous and linear in pieces.  Sources: Katzenelson, "An algorithm for solving
//! nonlinear resistor networks", Bell System Technical Journal 44 (1965) 1605; Chua, Ushida, "A switching-parameter algorithm for finding
//! multiple solutions of nonlinear resistive circuits", International Journal of Circuit Theory and Applications 4 (1976) 215.

use super::damped::{Newton, Target};
use crate::linear::FactorError;

/// Most pieces that are passed.
const MOST_PIECES: usize = 200;
/// A piece goes on as long as what is left over is at most this part of the way.
const STRAIGHT: f64 = 0.1;
/// Halvings by which its end is found, and how far behind them what is left over is looked at once more, to see where it began.
const HALVINGS: u32 = 20;
const ONCE_MORE: f64 = 1e-2;
/// The next piece begins so far behind the end, as a part of the way; and so far at least, in the sizes of the unknowns.
const BEHIND: f64 = 1e-9;
const APART: f64 = 1e-12;
/// Multiple of that distance at which both sides are probed, to see on which of them the piece goes on.
const AROUND: f64 = 4.0;
/// Going back, a piece is followed for at most this multiple of the step.
const FARTHEST: f64 = 1e9;

/// Leads `newton.x` to a solution, forwards, with a residual that shrinks, and where that leads nowhere, backwards first; false where none is
/// reached.
pub(crate) fn pass_pieces(newton: &mut Newton, target: &mut dyn Target, tolerance: f64) -> bool {
    let first = newton.x.clone();
    follow(newton, target, tolerance, 1.0) || {
        newton.x.copy_from_slice(&first);
        follow(newton, target, tolerance, -1.0)
    }
}

fn follow(newton: &mut Newton, target: &mut dyn Target, tolerance: f64, mut sense: f64) -> bool {
    let mut way = Way { newton, target };
    // How far the point is behind the border.
    let mut beyond = None;
    for _ in 0..MOST_PIECES {
        let Some(size) = way.begin() else { return false };
        // A step as small as that may still lead into a piece that has no solution.
        if size <= tolerance && (size <= APART || way.is_straight(1.0)) {
            return true;
        }
        // The side on which the piece just entered goes on.
        if let Some(beyond) = beyond {
            let around = AROUND * sense * beyond / size;
            if !way.is_straight(around) && way.is_straight(-around) {
                sense = -sense;
            }
        }
        let apart = BEHIND.max(APART / size);
        beyond = Some(apart * size);
        let Some(end) = way.end(sense, apart) else { return false };
        way.advance(end);
        if end == 1.0 {
            sense = 1.0;
        }
    }
    false
}

/// One piece: `newton.residual` and `newton.correction` at its beginning, in `newton.x`.
struct Way<'a, 'b> {
    newton: &'a mut Newton,
    target: &'a mut (dyn Target + 'b),
}

impl Way<'_, '_> {
    /// Step and slopes at the current point; the size of the step, `None` where there is none.
    fn begin(&mut self) -> Option<f64> {
        let newton = &mut *self.newton;
        if !self.target.residual(&newton.x, &mut newton.residual) {
            return None;
        }
        match self.target.factor(&newton.x) {
            Ok(()) => {}
            Err(FactorError::Singular { .. }) if self.target.factor_deficient(&newton.x) => {}
            Err(_) => return None,
        }
        newton.correction.iter_mut().zip(&newton.residual).for_each(|(step, value)| *step = -value);
        self.target.solve(&mut newton.correction);
        let size = newton.norm(&newton.correction);
        size.is_finite().then_some(size)
    }

    /// What is left over so far along the step, as a part of the way.
    fn left_over(&mut self, part: f64) -> f64 {
        let newton = &mut *self.newton;
        let along = newton.x.iter().zip(&newton.correction);
        newton.trial.iter_mut().zip(along).for_each(|(trial, (x, step))| *trial = x + part * step);
        if !self.target.residual(&newton.trial, &mut newton.trial_residual) {
            return f64::INFINITY;
        }
        for ((rest, at), first) in newton.simplified.iter_mut().zip(&newton.trial_residual).zip(&newton.residual) {
            *rest = at - (1.0 - part) * first;
        }
        self.target.solve(&mut newton.simplified);
        newton.norm(&newton.simplified) / (part.abs() * newton.norm(&newton.correction))
    }

    fn is_straight(&mut self, part: f64) -> bool {
        self.left_over(part) <= STRAIGHT
    }

    /// Where the way leaves the piece, as a part of the step: 1 where the step ends in it, `None` where it does not end.
    fn end(&mut self, sense: f64, apart: f64) -> Option<f64> {
        let (mut inside, mut outside) = (0.0, 1.0);
        if sense > 0.0 {
            if self.is_straight(1.0) {
                return Some(1.0);
            }
        } else {
            while self.is_straight(-outside) {
                (inside, outside) = (outside, 4.0 * outside);
                if outside > FARTHEST {
                    return None;
                }
            }
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if self.is_straight(sense * middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        // Beyond the border what is left over grows in proportion to the distance from it.
        let farther = outside * (1.0 + ONCE_MORE);
        let (near, far) = (self.left_over(sense * outside) * outside, self.left_over(sense * farther) * farther);
        let border = outside - near * (farther - outside) / (far - near);
        let is_sound = (0.0..=outside).contains(&border);
        Some(sense * (if is_sound { border } else { outside } + apart))
    }

    fn advance(&mut self, part: f64) {
        self.newton.x.iter_mut().zip(&self.newton.correction).for_each(|(x, step)| *x += part * step);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Equations `force_k(x_k) = drive_k`, where what equation k answers drives the next one by a factor, and the last one the first.
    struct Ring {
        load: f64,
        back: f64,
        force: fn(f64) -> (f64, f64),
        slopes: Vec<f64>,
    }

    impl Ring {
        fn solved(load: f64, back: f64, force: fn(f64) -> (f64, f64), start: &[f64]) -> Option<Vec<f64>> {
            let mut newton = Newton::new(start.len());
            newton.x.copy_from_slice(start);
            let mut ring = Self { load, back, force, slopes: vec![1.0; start.len()] };
            pass_pieces(&mut newton, &mut ring, 1e-12).then_some(newton.x)
        }
    }

    impl Target for Ring {
        fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool {
            let mut drive = self.load + self.back * x[x.len() - 1];
            for k in 0..x.len() {
                out[k] = (self.force)(x[k]).0 - drive;
                drive = 0.5 * (self.force)(x[k]).0;
            }
            true
        }
        fn factor(&mut self, x: &[f64]) -> Result<(), FactorError> {
            self.slopes = x.iter().map(|&x| (self.force)(x).1).collect();
            Ok(())
        }
        fn factor_deficient(&mut self, _: &[f64]) -> bool {
            false
        }
        fn solve(&mut self, b: &mut [f64]) {
            // The last unknown enters the first equation: x = u + x_n w.
            let own = |mut drive: f64, b: Option<&[f64]>| {
                let mut x = Vec::new();
                for (k, slope) in self.slopes.iter().enumerate() {
                    let value = (b.map_or(0.0, |b| b[k]) + drive) / slope;
                    drive = 0.5 * slope * value;
                    x.push(value);
                }
                x
            };
            let (u, w) = (own(0.0, Some(b)), own(self.back, None));
            let last = u[u.len() - 1] / (1.0 - w[w.len() - 1]);
            b.iter_mut().zip(u.iter().zip(&w)).for_each(|(b, (u, w))| *b = u + last * w);
        }
        fn contradicts(&self, _: &[f64], _: f64) -> bool {
            false
        }
    }

    /// Slips on either side of a limit of 0.5, and is held in between.
    fn brake(x: f64) -> (f64, f64) {
        match x {
            x if x > 0.5 => (0.5 + 1e-3 * (x - 0.5), 1e-3),
            x if x < -0.5 => (-0.5 + 1e-3 * (x + 0.5), 1e-3),
            x => (x, 1.0),
        }
    }

    /// Newton's method is thrown to and fro between slips; the held brakes are found from either side.
    #[test]
    fn pieces_between_very_different_slopes_are_found() {
        for start in [767.7, -0.5013, 0.5001, -3.0] {
            for load in [0.4987, 0.5 - 1e-7, -0.3] {
                for count in 1..4 {
                    let x = Ring::solved(load, 0.0, brake, &vec![start; count]).unwrap();
                    for (k, x) in x.iter().enumerate() {
                        assert!((x - load * 0.5_f64.powi(k as i32)).abs() < 1e-9, "{start} {load}: {x}");
                    }
                }
            }
        }
        let x = Ring::solved(0.6, 0.0, brake, &[0.1]).unwrap();
        assert!((x[0] - 100.5).abs() < 1e-6, "0.5 + 0.001 (x - 0.5) = 0.6");
    }

    /// An amplifier with positive feedback, `limit(10 x) = load + 2 x`: between the limits the slope has the other sign, and the way turns back
    /// at both of them.
    #[test]
    fn the_way_leads_over_a_piece_with_a_determinant_of_the_other_sign() {
        let limit: fn(f64) -> (f64, f64) = |x| match x {
            x if x > 1.0 => (10.0 + 1e-3 * (x - 1.0), 1e-3),
            x if x < -1.0 => (-10.0 + 1e-3 * (x + 1.0), 1e-3),
            x => (10.0 * x, 10.0),
        };
        // On the upper branch x = (10 - load)/2 or so, as long as that is above 1; beyond, only the lower one is left.
        for (load, start, right) in [(9.0, 1.2, -9.5), (9.0, 0.99, -9.5), (-9.0, -1.2, 9.5), (4.0, 30.0, 3.0)] {
            let x = Ring::solved(load, 2.0, limit, &[start]).unwrap()[0];
            assert!((limit(x).0 - load - 2.0 * x).abs() < 1e-9, "{load} from {start}: {x}");
            assert!((x - right).abs() < 0.02, "{load} from {start}: {x}");
        }
    }
}

//! Which start values decide whether Newton's method succeeds, and which equation bends most on its first step.
//!
//! With the step `d = -J(x0)^-1 G(x0)` an equation that is linear holds at `x0 + d`; what is left of the others are their second
//! derivatives along the step, `1/2 sum_jk d2G_i/dx_j dx_k d_j d_k`.  Beside the linear terms of the same equation this says how far the
//! step can be trusted, and its parts by `k` which unknowns are to blame: start values of unknowns that occur linearly do not
//! matter at all.  After Casella, Bachmann, "On the choice of initial guesses for the Newton-Raphson algorithm", Applied
//! Mathematics and Computation 398 (2021) 125991; the second derivatives along the step are a quotient of exact Jacobians, which is
//! two evaluations for any number of unknowns.

use super::{InitialSystem, View};
use crate::corrector::damped::Target;
use crate::problem::{Problem, all_finite};

/// Parts of the step over which Jacobians are compared, the next where a value is not finite.
const PARTS: [f64; 3] = [1e-3, 1e-6, -1e-3];

/// Second derivatives along the first step of Newton's method, relative to the linear terms.
pub(crate) struct Curvature {
    /// The equation that bends most, and how much: above 1 it decides where the step leads.
    pub(crate) row: usize,
    /// What each unknown contributes to that at most, in any equation.
    pub(crate) of_unknown: Vec<f64>,
}

impl InitialSystem {
    /// The curvature at a guess; `None` where it has no finite step.
    pub(super) fn curvature(&mut self, problem: &mut Problem<'_>, t: f64, guess: &[f64]) -> Option<Curvature> {
        let n = guess.len();
        let mut step = vec![0.0; n];
        let mut view = View { core: &mut self.core, problem, t };
        if n == 0 || !view.residual(guess, &mut step) {
            return None;
        }
        view.factor(guess).ok()?;
        step.iter_mut().for_each(|value| *value = -*value);
        view.solve(&mut step);
        if !all_finite(&step) {
            return None;
        }
        let pattern = self.core.pattern.clone();
        let mut jacobian = |x: &[f64]| {
            let mut values = vec![0.0; pattern.entries()];
            let is_known = problem.system.initial_jacobian(t, x, &mut values).is_ok();
            (is_known && all_finite(&values)).then_some(values)
        };
        let here = jacobian(guess)?;
        let (part, there) = PARTS.iter().find_map(|&part| {
            let x: Vec<f64> = guess.iter().zip(&step).map(|(x, d)| x + part * d).collect();
            Some((part, jacobian(&x)?))
        })?;
        let mut linear = vec![0.0_f64; n];
        for (column, along) in step.iter().enumerate() {
            for entry in pattern.column(column) {
                let row = pattern.row_indices[entry] as usize;
                linear[row] = linear[row].max((here[entry] * along).abs());
            }
        }
        let (mut of_row, mut of_unknown) = (vec![0.0_f64; n], vec![0.0_f64; n]);
        for (column, along) in step.iter().enumerate() {
            for entry in pattern.column(column) {
                let row = pattern.row_indices[entry] as usize;
                let bend = 0.5 * ((there[entry] - here[entry]) / part * along).abs();
                if linear[row] > 0.0 {
                    of_row[row] += bend / linear[row];
                    of_unknown[column] = of_unknown[column].max(bend / linear[row]);
                }
            }
        }
        let row = (0..n).max_by(|&a, &b| of_row[a].total_cmp(&of_row[b]))?;
        (of_row[row] > 0.0).then_some(Curvature { row, of_unknown })
    }
}

//! Whether loops that are computed one variable after the other hold as well as numbers allow.
//!
//! The translation keeps the growth of rounding errors along such a loop small for the parameters as they are declared; others may let
//! them grow.  So solutions are judged by the equations that close the loops: at the start, after events, and at rows of results (of a
//! unit: at points that the integrator outside has accepted), the first, second, fourth and so on, which costs next to nothing and sees
//! coefficients that change during the run.

use hyd_system::LoopError;

use crate::error::{SolveError, Stage};
use crate::problem::Problem;

/// Largest error of an equation beside its terms, found as its residual and explained by rounding.
const LARGEST: f64 = 1e-7;

/// Judges values that solve the system.
pub(crate) fn judge(
    problem: &mut Problem<'_>,
    (stage, t): (Stage, f64),
    (y, yp): (&[f64], &[f64]),
) -> Result<(), SolveError> {
    match problem.system.loop_error(t, y, yp) {
        Some(found) if found.smaller() > LARGEST => Err(refusal(problem, (stage, t), found, false)),
        _ => Ok(()),
    }
}

/// Judges a solution of the initial system.
pub(crate) fn judge_initial(problem: &mut Problem<'_>, t: f64, z: &[f64]) -> Result<(), SolveError> {
    match problem.system.initial_loop_error(t, z) {
        Some(found) if found.smaller() > LARGEST => Err(refusal(problem, (Stage::Start, t), found, true)),
        _ => Ok(()),
    }
}

fn refusal(problem: &Problem<'_>, (stage, time): (Stage, f64), found: LoopError, initial: bool) -> SolveError {
    let tables = problem.system.tables();
    let equation = match initial {
        true => tables.initial_rows.get(found.row).and_then(|&e| tables.equations.get(e as usize)),
        false => tables.row_equation(found.row),
    };
    SolveError::Rounding { stage, time, error: found.residual, equation: equation.cloned().map(Box::new) }
}

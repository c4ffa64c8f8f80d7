//! Profile likelihoods: the interval of an unknown from what the fit loses when it is held elsewhere.
//!
//! The unknown is moved outwards step by step, all others are fitted anew, and the interval ends where the cost has risen by the
//! 95 % point of chi-square with one degree of freedom (Raue et al. 2009, "Structural and practical identifiability
//! analysis of partially observed dynamical models by exploiting the profile likelihood").  Unlike the standard error it sees
//! that the cost is not a parabola; a side on which it never rises so far stays open.

use crate::Fault;
use crate::fit::schedule::lower;
use crate::fit::{Effort, Fit, minimise, minimise_over};
use crate::problem::{Problem, Weighing};

/// 95 % point of chi-square with one degree of freedom.
pub(crate) const RISE: f64 = 3.841;
/// Step outwards, in standard errors, and most steps to a side.
const STEP: f64 = 0.7;
const STEPS: usize = 8;
/// A refit that takes its start from the neighbour needs little.
const EFFORT: Effort = Effort { steps: 8, gain: 0.02, ..Effort::FULL };

/// A profile.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Values of the unknown, and by how much the cost is above that of the fit, ascending.
    pub points: Vec<(f64, f64)>,
    /// Ends of the 95 % interval; none where the cost does not rise so far.
    pub interval: (Option<f64>, Option<f64>),
    /// The fit that was started from was not a minimum: a point lies below it by more than the fit's tolerance.
    pub lower_found: bool,
}

impl Profile {
    /// The profiles of the unknowns `which` around a fit, and that fit taken to the very minimum.  Values are those of
    /// [`crate::unknowns::Unknown::value`].
    ///
    /// # Errors
    /// When no derivatives can be had.
    pub fn of(
        problem: &Problem<'_>,
        fit: Fit,
        weighing: &Weighing,
        which: &[usize],
        progress: &dyn Fn(&str),
    ) -> Result<(Fit, Vec<Self>), Fault> {
        if which.is_empty() {
            return Ok((fit, Vec::new()));
        }
        let sharp = minimise(problem, &fit.xi, weighing, Effort { gain: 2e-3, ..Effort::FULL }, None)?;
        let fit = lower(fit, sharp);
        let one = |&k: &usize| {
            progress(&format!("the profile of {}", problem.unknowns[k].name));
            profile(problem, &fit, weighing, k)
        };
        let all = which.iter().map(one).collect::<Result<_, _>>()?;
        Ok((fit, all))
    }
}

fn profile(problem: &Problem<'_>, fit: &Fit, weighing: &Weighing, which: usize) -> Result<Profile, Fault> {
    let free: Vec<usize> = (0..problem.unknowns.len()).filter(|&k| k != which).collect();
    let error = fit.standard_error(which).filter(|error| error.is_finite() && *error > 0.0).unwrap_or(1.0);
    let value = |xi: f64| problem.unknowns[which].value(xi);
    let mut points = vec![(fit.xi[which], 0.0)];
    let mut side = |direction: f64| -> Result<Option<f64>, Fault> {
        let (mut xi, mut last) = (fit.xi.clone(), 0.0_f64);
        for _ in 0..STEPS {
            let before = xi[which];
            xi[which] = problem.unknowns[which].within(before + direction * STEP * error);
            if xi[which] == before {
                break;
            }
            let Ok(next) = minimise_over(problem, &xi, weighing, &free, EFFORT, None) else { break };
            let rise = next.cost - fit.cost;
            points.push((xi[which], rise));
            if rise >= RISE {
                // The root of the rise is about a straight line.
                let (a, b) = (last.max(0.0).sqrt(), rise.sqrt());
                let share = (RISE.sqrt() - a) / (b - a);
                return Ok(Some(before + share * (xi[which] - before)));
            }
            (xi, last) = (next.xi, rise);
        }
        Ok(None)
    };
    let (low, high) = (side(-1.0)?, side(1.0)?);
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let lower_found = points.iter().any(|(_, rise)| *rise < -2.0 * Effort::FULL.gain);
    let points = points.into_iter().map(|(xi, rise)| (value(xi), rise)).collect();
    Ok(Profile { points, interval: (low.map(value), high.map(value)), lower_found })
}

//! The gap before and after: residuals of shots, seen and unseen, under the true noise.
//!
//! In a gap the deviation is that of the noise alone, without any tolerance of time, and 1.0 means noise; [`unseen`]
//! grants the tolerance of the fits.  On shots that were held out everything that holds for all shots stays as it was
//! fitted; only what belongs to the shot itself is fitted again.

use hyd_system::math;

use crate::Fault;
use crate::fit::{Effort, Fit, minimise_over};
use crate::problem::{Problem, Weighing};

/// Root of the mean square of the residuals of some shots.
#[derive(Clone, Debug)]
pub struct Gap {
    /// Over all channels.
    pub all: f64,
    /// Mean square per independent sample, in what counts as noise beside model error.
    pub left: f64,
    /// By channel, in their order; not a number where there is nothing.
    pub channels: Vec<f64>,
    /// Unknowns under which it was computed.
    pub xi: Vec<f64>,
    /// Channels of the shots.
    pub fit: Fit,
}

/// The sum of squares that shots leave which were not fitted, with a tolerance of time (in sample periods); what
/// belongs to them alone is fitted.
///
/// # Errors
/// A run that failed.
pub(crate) fn unseen(problem: &Problem<'_>, xi: &[f64], shots: &[usize], tau: f64) -> Result<f64, Fault> {
    let whole = Weighing::whole(shots, tau);
    let own = of_shots(problem, shots);
    let fit = match own.is_empty() {
        true => Fit::at(problem, xi, &whole)?,
        false => minimise_over(problem, xi, &whole, &own, Effort::FULL, None)?,
    };
    Ok(fit.misfit)
}

/// What belongs to these shots alone.
fn of_shots(problem: &Problem<'_>, shots: &[usize]) -> Vec<usize> {
    let is_own = |k: &usize| problem.unknowns[*k].shot.is_some_and(|shot| shots.contains(&shot));
    (0..problem.unknowns.len()).filter(is_own).collect()
}

impl Gap {
    /// The gap of `shots` under the unknowns `xi`; with `refit` what belongs to these shots alone is fitted again.
    ///
    /// # Errors
    /// A run that failed, a gap that is too wide to be a number that shows anything.
    pub fn of(problem: &Problem<'_>, xi: &[f64], shots: &[usize], refit: bool) -> Result<Self, Fault> {
        let plain = Weighing::whole(shots, 0.0);
        let own = of_shots(problem, shots);
        let fit = match refit && !own.is_empty() {
            true => minimise_over(problem, xi, &plain, &own, Effort::FULL, None)?,
            false => Fit::at(problem, xi, &plain)?,
        };
        problem.check_misfit(&fit, &plain)?;
        let channels = problem.data.channels.len();
        let (mut squares, mut counts) = (vec![0.0; channels], vec![0.0; channels]);
        let (mut counted, mut expected) = (0.0, 0.0);
        let mut row = 0;
        for &shot in shots {
            for channel in 0..channels {
                for weight in problem.weights(shot, channel, &plain) {
                    let level = &problem.data.channels[channel].level;
                    if weight > 0.0 {
                        let square = math::square(fit.residuals[row]);
                        squares[channel] += square * math::square(level.factor);
                        counts[channel] += 1.0;
                        counted += square;
                        expected += 1.0 / level.samples();
                    }
                    row += 1;
                }
            }
        }
        let all = (squares.iter().sum::<f64>() / counts.iter().sum::<f64>()).sqrt();
        let channels = squares.iter().zip(&counts).map(|(square, count): (&f64, &f64)| (square / count).sqrt());
        Ok(Self { all, left: counted / expected, channels: channels.collect(), xi: fit.xi.clone(), fit })
    }
}

//! The way to the minimum: a growing horizon, then restarts where the first way ended too high.
//!
//! A stop or a seat met a little too late makes the objective many-valued; fitting the first third of the record, then half,
//! three quarters, and all, with inflated deviations and a wide tolerance of time, keeps the fit in the right local minimum (Michalik,
//! Hannemann, Marquardt 2009: incremental single shooting).  What was tried and how far apart the ends lie is kept.

use hyd_system::random::SplitMix;
use nalgebra::DMatrix;

use crate::Fault;
use crate::fit::{Effort, Fit, minimise, minimise_over};
use crate::problem::{Problem, Weighing};

/// Inflation of deviations and of the tolerance of time on the way, and by how much the latter is raised at first.
const WIDE: (f64, f64, f64) = (3.5, 2.5, 5.0);
/// A fit is good when its misfit per expected one is below this.
pub(crate) const GOOD: f64 = 1.08;

/// Up to which misfit per expected one an end with something far off is doubted, and how often another start is drawn.
const ALL_BUT_NOISE: f64 = 1.3;
const UNPULLED: usize = 2;

/// How often more is held back, from how many standard deviations on, and at how many.
const HELD_BACK: usize = 4;
const DOUBTED: f64 = 2.5;
const MAY_BE: f64 = 2.0;

/// How often a fit that ran out of steps is followed further.
const FOLLOWED: usize = 8;

/// One attempt.
#[derive(Clone, Debug)]
pub struct Attempt {
    /// How it began.
    pub start: String,
    /// Misfit over expected misfit at its end.
    pub misfit: f64,
    /// Cost at its end.
    pub cost: f64,
    /// Steps in the last stage.
    pub steps: usize,
    /// Converged.
    pub converged: bool,
}

/// All attempts at one fit.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// In their order.
    pub attempts: Vec<Attempt>,
}

impl Record {
    /// Notes the end of an attempt.
    pub fn note(&mut self, start: impl Into<String>, fit: &Fit, expected: f64) {
        self.attempts.push(Attempt {
            start: start.into(),
            misfit: fit.misfit / expected,
            cost: fit.cost,
            steps: fit.steps,
            converged: fit.converged,
        });
    }
}

impl Fit {
    /// Fits all unknowns to `shots` from what is expected: on a growing horizon, again where that is not good, and on to its end.
    ///
    /// # Errors
    /// When the model does not run at the start; a misfit that shows nothing.
    pub fn of(
        problem: &Problem<'_>,
        shots: &[usize],
        (tau, seed): (f64, u64),
        progress: &dyn Fn(&str),
    ) -> Result<(Self, Record), Fault> {
        let whole = Weighing::whole(shots, tau);
        let ended = |fit: &Self| format!("{:.3} times noise", fit.misfit / problem.expected(&whole));
        let on = |horizon: f64| progress(&format!("fitting {:.0} % of the records", 100.0 * horizon));
        let expected = problem.expected(&whole);
        let mut record = Record::default();
        let mut found = along_told(problem, &vec![0.0; problem.unknowns.len()], (shots, tau), &THIRDS, &on)?;
        record.note("growing horizon", &found, expected);
        if found.misfit / expected > GOOD {
            progress(&format!("misfit {}: fitting again from there and from random starts", ended(&found)));
            found = retry(problem, found, shots, (tau, seed), &mut record);
        }
        if !found.converged {
            progress(&format!("misfit {}: following the fit to its end", ended(&found)));
            found = follow(problem, found, shots, tau, &mut record);
        }
        progress(&format!("misfit {}", ended(&found)));
        problem.check_misfit(&found, &whole)?;
        Ok((found, record))
    }
}

/// Horizons of a first way.
const THIRDS: [f64; 4] = [1.0 / 3.0, 0.5, 0.75, 1.0];
/// Horizons of a second way, from where the first one ended.
const FROM_THERE: [f64; 5] = [0.25, 0.4, 0.6, 0.8, 1.0];

/// Fits all unknowns to `shots` from `start` on a growing horizon.
///
/// # Errors
/// When the model does not run at the start.
pub(crate) fn fit(problem: &Problem<'_>, start: &[f64], shots: &[usize], tau: f64) -> Result<(Fit, Record), Fault> {
    let expected = problem.expected(&Weighing::whole(shots, tau));
    let mut record = Record::default();
    let best = along(problem, start, (shots, tau), &THIRDS)?;
    record.note("growing horizon", &best, expected);
    Ok((best, record))
}

/// Tries again: on another growing horizon from where the fit ended, then from random starts.  Returns the lowest of all.
pub(crate) fn retry(
    problem: &Problem<'_>,
    fit: Fit,
    shots: &[usize],
    (tau, seed): (f64, u64),
    record: &mut Record,
) -> Fit {
    let expected = problem.expected(&Weighing::whole(shots, tau));
    let mut best = from_there(problem, fit, shots, tau, record);
    let mut draws = SplitMix(seed | 1);
    for k in 0..2 {
        if best.misfit / expected <= GOOD {
            break;
        }
        let xi: Vec<f64> = best.xi.iter().map(|_| 0.7 * draws.normal()).collect();
        if let Ok(next) = along(problem, &xi, (shots, tau), &THIRDS) {
            record.note(format!("random start {}", k + 1), &next, expected);
            best = lower(best, next);
        }
    }
    best
}

/// Tries on another growing horizon from where a fit ended.  Returns the lower one.
pub(crate) fn from_there(problem: &Problem<'_>, fit: Fit, shots: &[usize], tau: f64, record: &mut Record) -> Fit {
    let expected = problem.expected(&Weighing::whole(shots, tau));
    let Ok(next) = along(problem, &fit.xi, (shots, tau), &FROM_THERE) else { return fit };
    record.note("growing horizon from there", &next, expected);
    lower(fit, next)
}

/// Tries once more where an unknown ended far from what is expected although the misfit is all but noise: it may be the
/// end of another local minimum.
pub(crate) fn unpull(
    problem: &Problem<'_>,
    fit: Fit,
    shots: &[usize],
    (tau, seed): (f64, u64),
    record: &mut Record,
) -> Fit {
    let expected = problem.expected(&Weighing::whole(shots, tau));
    let mut best = fit;
    let mut draws = SplitMix(seed | 1);
    for k in 0..=UNPULLED {
        if !problem.is_pulled(&best.xi) || best.misfit / expected > ALL_BUT_NOISE {
            break;
        }
        let (start, horizons, words) = match k {
            0 => (vec![0.0; best.xi.len()], &[0.6, 1.0][..], "two horizons".to_string()),
            _ => {
                let xi = best.xi.iter().map(|_| 0.7 * draws.normal()).collect();
                (xi, &THIRDS[..], format!("random start {k}"))
            }
        };
        if let Ok(next) = along(problem, &start, (shots, tau), horizons) {
            record.note(words, &next, expected);
            best = lower(best, next);
        }
    }
    best
}

/// The fit with all that is far off held at what may be; none where nothing is pulled.  What only unlikely numbers explain is left.
pub(crate) fn held_back(problem: &Problem<'_>, fit: &Fit, whole: &Weighing) -> Option<Fit> {
    if !problem.is_pulled(&fit.xi) {
        return None;
    }
    let mut held = problem.beyond(&fit.xi, DOUBTED);
    let mut best = fit.clone();
    for _ in 0..HELD_BACK {
        for &k in &held {
            best.xi[k] = MAY_BE.copysign(best.xi[k]);
        }
        let free: Vec<usize> = (0..best.xi.len()).filter(|k| !held.contains(k)).collect();
        best = minimise_over(problem, &best.xi, whole, &free, Effort::FULL, None).ok()?;
        let more = problem.beyond(&best.xi, DOUBTED);
        if more.is_empty() {
            break;
        }
        held.extend(more);
    }
    Some(best)
}

/// Goes on from a fit that ended above noise: once more from there, then on a growing horizon.  Returns the lowest.
pub(crate) fn go_on(
    problem: &Problem<'_>,
    fit: Fit,
    shots: &[usize],
    tau: f64,
    is_enough: &dyn Fn(&Fit) -> bool,
) -> Fit {
    let whole = Weighing::whole(shots, tau);
    let mut best = fit;
    if let Ok(next) = minimise(problem, &best.xi, &whole, Effort::LONG, None) {
        best = lower(best, next);
    }
    if !is_enough(&best)
        && let Ok(next) = along(problem, &best.xi, (shots, tau), &THIRDS)
    {
        best = lower(best, next);
    }
    best
}

/// Follows a fit that ran out of steps to its end, as far as a few hundred steps lead.
pub(crate) fn follow(problem: &Problem<'_>, fit: Fit, shots: &[usize], tau: f64, record: &mut Record) -> Fit {
    let whole = Weighing::whole(shots, tau);
    let expected = problem.expected(&whole);
    let mut best = fit;
    for _ in 0..FOLLOWED {
        if best.converged {
            break;
        }
        let Ok(next) = minimise(problem, &best.xi, &whole, Effort::LONG, None) else { break };
        record.note("followed to its end", &next, expected);
        let is_over = next.steps < Effort::LONG.steps;
        best = if next.cost <= best.cost { next } else { best };
        if is_over {
            break;
        }
    }
    best
}

/// The one with the lower cost.
pub(crate) fn lower(a: Fit, b: Fit) -> Fit {
    if b.cost < a.cost { b } else { a }
}

fn along(problem: &Problem<'_>, start: &[f64], on: (&[usize], f64), horizons: &[f64]) -> Result<Fit, Fault> {
    along_told(problem, start, on, horizons, &|_| ())
}

/// The same; each horizon is told before it is fitted.
fn along_told(
    problem: &Problem<'_>,
    start: &[f64],
    (shots, tau): (&[usize], f64),
    horizons: &[f64],
    tell: &dyn Fn(f64),
) -> Result<Fit, Fault> {
    let mut xi = start.to_vec();
    let mut jacobian: Option<(DMatrix<f64>, Weighing)> = None;
    for &horizon in horizons {
        tell(horizon);
        let weighing = Weighing { shots: shots.to_vec(), horizon, inflation: WIDE.0, tau: widened(tau) };
        let fit = minimise(problem, &xi, &weighing, Effort::SHORT, None)?;
        xi = fit.xi;
        jacobian = fit.jacobian.map(|jacobian| (jacobian.matrix, weighing));
    }
    let known = jacobian.as_ref().map(|(jacobian, weighing)| (jacobian, weighing));
    minimise(problem, &xi, &Weighing::whole(shots, tau), Effort::FULL, known)
}

/// The tolerance of time on the way: half a sample period and more, but where a clock is much better than that no more than some times
/// what counts in the end.
pub(crate) fn widened(tau: f64) -> f64 {
    WIDE.1 * tau.max((WIDE.2 * tau).min(0.5))
}

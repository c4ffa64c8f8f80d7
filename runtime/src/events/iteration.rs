//! Settling the system at one instant.
//!
//! Discrete equations run once with `pre` as before the event; while a relation or a discrete variable changes, the continuous
//! part is made consistent and they run again, first with the same `pre` where they read what was found there.  What still changes
//! after many passes ends the run, with the values that repeat themselves.

use hyd_system::{EventChange, EventPhase};

use super::cycle::Cycle;
use super::effect::{Before, zero_what_is_rounding};
use super::held_changes;
use crate::error::{SolveError, Stage};
use crate::initial::consistent::Consistency;
use crate::loops::judge;
use crate::problem::Problem;
use crate::sensitivity::Sensitivity;
use crate::weights::Weights;

/// Most passes at one instant.
const MOST_PASSES: usize = 100;
/// After so many it is looked whether they change anything.
const MANY_PASSES: usize = 10;

/// What an event did.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct EventOutcome {
    /// The equations or values are no longer what they were: the past is worthless.
    pub(crate) changed: bool,
    /// It is nothing but recorded inputs that have jumped.
    pub(crate) by_inputs: bool,
    /// `reinit` wrote into `y`.
    pub(crate) reinitialised: bool,
    /// Message of `terminate`.
    pub(crate) terminated: Option<String>,
}

/// Where and how an event begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instant {
    /// Its first pass.
    pub(crate) first: EventPhase,
    /// Its time (s).
    pub(crate) t: f64,
    /// A typical step (s), for the size of rates.
    pub(crate) time_scale: f64,
    /// Length of the run (s), over which what an event does to rates may tell; infinite where it is not known.
    pub(crate) span: f64,
}

/// Runs an event on the values `y`, `yp` in place.  Sensitivities are carried along as total derivatives.
pub(crate) fn settle(
    problem: &mut Problem<'_>,
    consistency: &mut Consistency,
    weights: &Weights,
    Instant { first, t, time_scale, span }: Instant,
    (y, yp): (&mut [f64], &mut [f64]),
    mut sensitivity: Option<&mut Sensitivity>,
) -> Result<EventOutcome, SolveError> {
    let mut outcome = EventOutcome::default();
    let mut phase = first;
    let mut before = Vec::new();
    let mut cycle = Cycle::default();
    let mut by_rounding = false;
    let mut earlier: Option<Before> = None;
    for pass in 0..MOST_PASSES {
        if pass + 1 == MOST_PASSES {
            before.resize(problem.system.structure().roots, false);
            problem.system.held(&mut before);
        }
        let before_pass = (pass >= MANY_PASSES).then(|| Before::new(problem, t, (y, yp)));
        if let Some(sensitivity) = sensitivity.as_deref_mut() {
            sensitivity.before_pass(problem, phase, t, y, yp);
        }
        let change: EventChange = match problem.system.event_pass(phase, t, y, yp) {
            Ok(change) => change,
            Err(failure) => return Err(SolveError::evaluation(Stage::Event, t, failure, problem)),
        };
        if let Some(sensitivity) = sensitivity.as_deref_mut() {
            sensitivity.after_pass(problem, phase, t, yp);
        }
        outcome.terminated = change.terminated.or(outcome.terminated);
        if !change.changed && !change.reinitialised {
            if phase == EventPhase::Repeat && !by_rounding {
                phase = EventPhase::Iterate;
                continue;
            }
            return Ok(outcome);
        }
        outcome.by_inputs = change.by_inputs && !change.reinitialised && !outcome.changed;
        outcome.changed = true;
        outcome.reinitialised |= change.reinitialised;
        let solved = consistency.solve(problem, (t, time_scale), weights, y, yp);
        // What a new value of a state switches comes after it.
        let may_switch = phase != EventPhase::Initial && !change.reinitialised;
        let together =
            may_switch && solve_together(problem, consistency, weights, (t, time_scale), (y, yp, solved.is_ok()));
        if let Err(fault) = solved
            && !together
        {
            return Err(SolveError::inconsistent(Stage::Event, t, fault, consistency.last_attempt(), problem));
        }
        if pass >= MANY_PASSES && !change.reinitialised {
            zero_what_is_rounding(weights, y, yp);
        }
        judge(problem, (Stage::Event, t), (y, yp))?;
        if let Some(sensitivity) = sensitivity.as_deref_mut() {
            sensitivity.consistent(problem, (Stage::Event, t), y, yp)?;
        }
        // Only relations whose sides are equal but for rounding have switched; where `reinit` or `terminate` have not had their turn, one
        // more pass with the same relations gives it to them.
        by_rounding = !change.reinitialised
            && before_pass.as_ref().is_some_and(|own| own.differs_by_rounding(problem, weights, (t, span), (y, yp)));
        if by_rounding && !change.unsettled {
            return Ok(outcome);
        }
        if let (Some(before), Some(earlier)) = (&before_pass, &earlier)
            && !change.reinitialised
            && before.alternates(earlier, problem, weights, (t, span), (y, yp))
        {
            return Ok(outcome);
        }
        earlier = before_pass;
        cycle.note(problem, (pass, MOST_PASSES), (t, &*y, &*yp));
        phase = if change.unsettled || together { EventPhase::Repeat } else { EventPhase::Iterate };
    }
    let (relations, repeats) = (held_changes(problem, &before), Box::new(cycle.repeats(problem)));
    Err(SolveError::EventLoop { time: t, passes: MOST_PASSES, relations, repeats })
}

/// Where the solution for the truths of a pass has changed relations (or there is none for them, `is_solved`): unknowns, relations and
/// discrete variables at the same `pre` all at once.  A brake that stops is held, and the force that holds it says that it need not
/// slip, before `pre` hears of it.  False if relations agree, or if that is not found: then all is as it was.
fn solve_together(
    problem: &mut Problem<'_>,
    consistency: &mut Consistency,
    weights: &Weights,
    place: (f64, f64),
    (y, yp, is_solved): (&mut [f64], &mut [f64], bool),
) -> bool {
    let Some(kept) = problem.system.switched() else { return false };
    if !problem.system.switch(place.0, y, yp) && is_solved {
        return false;
    }
    let before = (y.to_vec(), yp.to_vec());
    let found = consistency.solve_switching(problem, place, weights, y, yp).is_ok();
    if found && !problem.system.switch(place.0, y, yp) {
        return true;
    }
    y.copy_from_slice(&before.0);
    yp.copy_from_slice(&before.1);
    problem.system.switch_back(&kept);
    false
}

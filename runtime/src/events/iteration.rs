//! Settling the system at one instant, and noticing when instants pile up.
//!
//! Discrete equations run once with `pre` as before the event; while a relation or a discrete variable changes, the continuous
//! part is made consistent and they run again, first with the same `pre` where they read what was found there.  Many events without progress in time are chattering and end
//! the run with the relation's text, because integration would take forever.  So are events at ever shorter distance: beyond
//! the point where they accumulate the model says nothing, and rounding would let a ball fall through its floor.

use hyd_system::{EventChange, EventPhase};

use super::{held_changes, relations};
use crate::error::{SolveError, Stage};
use crate::initial::consistent::Consistency;
use crate::loops::judge;
use crate::problem::Problem;
use crate::sensitivity::Sensitivity;
use crate::weights::Weights;

/// Most passes at one instant.
const MOST_PASSES: usize = 100;
/// Events in a row, each closer to the last than `CLOSE` of the run, that count as chattering.
const MOST_CLOSE_EVENTS: u32 = 200;
const CLOSE: f64 = 1e-9;
/// Close events in a row, each nearer to the last than that was to the one before, that count as accumulating.
const MOST_SHRINKING_GAPS: u32 = 5;
const CLOSE_SHRINKING: f64 = 1e-8;

/// What an event did.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct EventOutcome {
    /// The equations or values are no longer what they were: the past is worthless.
    pub(crate) changed: bool,
    /// `reinit` wrote into `y`.
    pub(crate) reinitialised: bool,
    /// Message of `terminate`.
    pub(crate) terminated: Option<String>,
}

/// Runs the event at time `t` on the values `y`, `yp` in place.  `time_scale` (s): typical step, for the size of
/// rates.  Sensitivities are carried along as total derivatives.
pub(crate) fn settle(
    problem: &mut Problem<'_>,
    consistency: &mut Consistency,
    weights: &Weights,
    (first, t, time_scale): (EventPhase, f64, f64),
    (y, yp): (&mut [f64], &mut [f64]),
    mut sensitivity: Option<&mut Sensitivity>,
) -> Result<EventOutcome, SolveError> {
    let mut outcome = EventOutcome::default();
    let mut phase = first;
    let mut before = Vec::new();
    for pass in 0..MOST_PASSES {
        if pass + 1 == MOST_PASSES {
            before.resize(problem.system.structure().roots, false);
            problem.system.held(&mut before);
        }
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
            if phase == EventPhase::Repeat {
                phase = EventPhase::Iterate;
                continue;
            }
            return Ok(outcome);
        }
        outcome.changed = true;
        outcome.reinitialised |= change.reinitialised;
        if let Err(fault) = consistency.solve(problem, (t, time_scale), weights, y, yp) {
            return Err(SolveError::inconsistent(Stage::Event, t, fault, consistency.last_attempt(), problem));
        }
        judge(problem, (Stage::Event, t), (y, yp))?;
        if let Some(sensitivity) = sensitivity.as_deref_mut() {
            sensitivity.consistent(problem, (Stage::Event, t), y, yp)?;
        }
        phase = if change.unsettled { EventPhase::Repeat } else { EventPhase::Iterate };
    }
    Err(SolveError::EventLoop { time: t, passes: MOST_PASSES, relations: held_changes(problem, &before) })
}

/// Counts events that follow each other closely, and those at ever shorter distance.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Chatter {
    last: Option<f64>,
    gap: f64,
    close: u32,
    shrinking: u32,
}

impl Chatter {
    /// Notes an event at `t` of a run of length `span` (s); an error if there were too many close by, or if their distances shrink
    /// towards a point in time that no number of events will reach (a bouncing ball).
    pub(crate) fn note(&mut self, t: f64, span: f64, fired: &[bool], problem: &Problem<'_>) -> Result<(), SolveError> {
        let gap = self.last.map_or(f64::INFINITY, |last| t - last);
        let close = gap <= CLOSE * span;
        self.close = if close { self.close + 1 } else { 0 };
        self.shrinking = if gap <= CLOSE_SHRINKING * span && gap < self.gap { self.shrinking + 1 } else { 0 };
        (self.last, self.gap) = (Some(t), gap);
        let accumulating = self.shrinking >= MOST_SHRINKING_GAPS;
        if self.close < MOST_CLOSE_EVENTS && !accumulating {
            return Ok(());
        }
        let relations = relations(problem, fired);
        Err(SolveError::Chattering { time: t, events: self.close, accumulating, relations })
    }
}

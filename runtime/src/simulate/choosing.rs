//! When the choice of states is judged again: as often as it may have become a bad one, not after every step.
//!
//! Judging costs as much as a step of a small mechanism.  What it finds, the logarithm of the factor by which another
//! choice may still become better, moves as smoothly as the solution; the next judgement is due after a third of the
//! time in which it would be used up at its present pace, and after a number of steps in any case.

use hyd_system::StateChoice;

/// Part of the time foretold after which the choice is judged again.
const SAFETY: f64 = 1.0 / 3.0;
/// The pace falls at most by this factor from one judgement to the next.
const SLOWING: f64 = 0.5;
/// Most steps between two judgements.
const MOST_STEPS: u32 = 20;

/// The judgements of a stretch between two events.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Choosing {
    /// There is nothing to choose, here or ever.
    nothing: bool,
    /// Time (s) and room of the last judgement.
    last: Option<(f64, f64)>,
    /// How fast the room was used up or won [1/s].
    pace: f64,
    /// Not before this time (s), unless steps run out.
    due: f64,
    steps: u32,
}

impl Choosing {
    /// After an event: judged after the next step.
    pub(super) fn new() -> Self {
        Self { nothing: false, last: None, pace: 0.0, due: f64::NEG_INFINITY, steps: 0 }
    }

    /// True if the choice is to be judged after the step to `t` (s); `failed`: the step was done only at another
    /// attempt, as where the equations of the choice become singular.
    #[inline]
    pub(super) fn is_due(&mut self, t: f64, failed: bool) -> bool {
        if self.nothing {
            return false;
        }
        self.steps += 1;
        t >= self.due || failed || self.steps >= MOST_STEPS
    }

    /// Takes note of a judgement at `t` (s).
    pub(super) fn note(&mut self, t: f64, judged: StateChoice) {
        let StateChoice { changed, room } = judged;
        self.steps = 0;
        self.nothing = room == f64::INFINITY;
        self.due = match self.last {
            Some((before, room_before)) if !changed && t > before => {
                // Two judgements on both sides of the best point find the same room: the pace before counts, too.
                self.pace = ((room_before - room).abs() / (t - before)).max(SLOWING * self.pace);
                if self.pace > 0.0 { t + SAFETY * room / self.pace } else { f64::INFINITY }
            }
            _ => t,
        };
        self.last = if changed { None } else { Some((t, room)) };
    }
}

#[cfg(test)]
mod tests {
    use super::{Choosing, MOST_STEPS};
    use hyd_system::StateChoice;

    /// A pendulum that turns steadily, with small steps and with large ones: no judgement comes later than an eighth of the factor
    /// after the choice should have been another one, and most steps have none.
    #[test]
    fn a_turning_pendulum_is_judged_in_time() {
        for (step, most) in [(1e-3, 0.2), (1e-2, 0.4), (0.1, 1.0)] {
            let mut choosing = Choosing::new();
            let (mut t, mut dependent, mut judgements, mut steps) = (0.3f64, true, 0, 0);
            while t < 20.0 {
                t += step;
                steps += 1;
                let ratio = if dependent { t.tan().abs() } else { t.tan().recip().abs() };
                assert!(ratio < 2.5 * (1.125 + 8.0 * step), "step {step}: {ratio} at {t}");
                if choosing.is_due(t, false) {
                    judgements += 1;
                    let changed = ratio > 2.5;
                    dependent ^= changed;
                    choosing.note(t, StateChoice { changed, room: if changed { 0.0 } else { (2.5 / ratio).ln() } });
                }
            }
            assert!(judgements as f64 <= most * steps as f64, "step {step}: {judgements} of {steps}");
        }
    }

    #[test]
    fn without_candidates_one_judgement_is_enough_and_a_standing_choice_is_judged_now_and_then() {
        let mut none = Choosing::new();
        assert!(none.is_due(0.0, false));
        none.note(0.0, StateChoice::default());
        assert!((0..100).all(|k| !none.is_due(f64::from(k), true)));
        let mut standing = Choosing::new();
        let mut judgements = 0;
        for k in 0..1000 {
            if standing.is_due(f64::from(k), false) {
                judgements += 1;
                standing.note(f64::from(k), StateChoice { changed: false, room: 0.5 });
            }
        }
        assert!((1000 / MOST_STEPS..1000 / MOST_STEPS + 4).contains(&judgements), "{judgements}");
        assert!(standing.is_due(1000.0, true));
    }
}

//! Delays that are shorter than the steps: when BDF, whose steps may be longer than a delay, takes over from the one-step method.
//!
//! The one-step method must not step over what it is about to write.  Where a solution is slow against its shortest
//! delay BDF needs fewer steps; where waves run in the delays the kinks of the recorded past keep it at order one.
//! Which of both is the case is not known before it is tried, so BDF is left again when its steps turn out to be short,
//! and taken up less readily the next time.

/// BDF is tried after so many steps in a row that could be so many times as long as the shortest delay.
const STEPS: u32 = 8;
const LONGER: f64 = 4.0;
/// It is left after so many more steps shorter than this part of the delay than longer ones: a step of the one-step
/// method costs as much as two or three of its own.
const LOST: u32 = 60;
const SHORT: f64 = 0.5;
/// The next time so many times as many steps must be too short.
const BACKOFF: u32 = 8;

/// What was seen of steps and delays.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Crowding {
    /// BDF has taken over.
    on: bool,
    /// Steps in a row that could be longer; while BDF is on, how many more were short than long.
    count: u32,
    needed: u32,
}

impl Crowding {
    /// Nothing was seen.
    pub(super) fn new() -> Self {
        Self { on: false, count: 0, needed: STEPS }
    }

    /// BDF is to be used.
    pub(super) fn is_on(&self) -> bool {
        self.on
    }

    /// Takes in a step, the next one of the one-step method or the last one of BDF, beside the shortest delay; true if the method
    /// changes.
    pub(super) fn note(&mut self, step: f64, shortest: f64) -> bool {
        if self.on {
            self.count = if step < SHORT * shortest { self.count + 1 } else { self.count.saturating_sub(1) };
            if self.count < LOST {
                return false;
            }
            self.needed = self.needed.saturating_mul(BACKOFF);
        } else {
            self.count = if step > LONGER * shortest { self.count + 1 } else { 0 };
            if self.count < self.needed {
                return false;
            }
        }
        (self.on, self.count) = (!self.on, 0);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::Crowding;

    #[test]
    fn bdf_is_left_where_its_steps_are_short_and_tried_more_rarely() {
        let mut crowding = Crowding::new();
        let steps = |crowding: &mut Crowding, step: f64| (1..10_000).find(|_| crowding.note(step, 1.0));
        assert_eq!(steps(&mut crowding, 5.0), Some(8));
        assert!(crowding.is_on());
        assert_eq!(steps(&mut crowding, 0.1), Some(60));
        assert!(!crowding.is_on());
        assert_eq!(steps(&mut crowding, 5.0), Some(64));
        assert_eq!(steps(&mut crowding, 20.0), None, "long steps keep BDF");
    }
}

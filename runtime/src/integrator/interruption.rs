//! Recorded inputs whose samples come so close to each other that BDF hardly gets beyond low order: when the one-step method takes over.
//!
//! A straight line between samples has a corner at each of them and a held value jumps.  Behind both BDF has to find its order and step
//! again, which takes it ten to twenty steps; the one-step method needs one or two.  Where samples are far apart, or
//! the input is smooth against the tolerance, BDF leads further for its work.  Which of both is the case is measured: after some
//! samples the other method does the next ones, and the better one of the two stays.  A trial is real steps; trials that fail are repeated
//! ever more rarely.  All that counts is the number of samples, steps and iterations, so that a run repeats itself to the bit.

/// A stretch that is judged has at least so many samples and steps.
const SAMPLES: u64 = 8;
const STEPS: u64 = 16;
/// With more steps to a sample than this an interruption is soon overcome.
const MOST_STEPS: u64 = 40;
/// The one-step method is taken up where it leads so many times as far for its work, and BDF is taken back.
const BETTER: f64 = 1.15;
/// Stretches until a trial is repeated that has failed for the first time, and how many times as many the next time.
const WAIT: u64 = 16;
const BACKOFF: u64 = 4;
const MOST_WAIT: u64 = 1 << 24;

/// Time gained (s) and work done since a stretch began.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
struct Stretch {
    /// Number of the sample at its begin.
    first: Option<u64>,
    steps: u64,
    time: f64,
    work: f64,
}

impl Stretch {
    fn gain(&self) -> f64 {
        if self.work > 0.0 { self.time / self.work } else { 0.0 }
    }
}

/// What was seen of samples and steps.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Interruption {
    /// The one-step method is in use because of samples.
    on: bool,
    /// The method in use is on trial against the other, which gained this much (s per iteration).
    against: Option<f64>,
    stretch: Stretch,
    /// Stretches until the next trial, and how many the one after a failure will wait.
    wait: u64,
    next_wait: u64,
}

impl Interruption {
    /// Nothing was seen.
    pub(super) fn new() -> Self {
        Self { on: false, against: None, stretch: Stretch::default(), wait: 1, next_wait: WAIT }
    }

    /// The one-step method is to be used.
    pub(super) fn is_on(&self) -> bool {
        self.on
    }

    /// Takes in a step: its size (s) and iterations, at least 1.
    pub(super) fn step(&mut self, h: f64, work: f64) {
        self.stretch.steps += 1;
        self.stretch.time += h;
        self.stretch.work += work;
    }

    /// Before a step: `sample` is the number of samples that have passed.  The advantage of the method in use over the other if it is
    /// taken up for good.
    pub(super) fn samples(&mut self, sample: u64) -> Option<f64> {
        let first = *self.stretch.first.get_or_insert(sample);
        let passed = sample.saturating_sub(first);
        if passed < SAMPLES || self.stretch.steps < STEPS {
            return None;
        }
        let stretch = std::mem::take(&mut self.stretch);
        self.stretch.first = Some(sample);
        let gain = stretch.gain();
        if let Some(other) = self.against.take() {
            let advantage = if other > 0.0 { gain / other } else { f64::INFINITY };
            if advantage >= BETTER {
                (self.wait, self.next_wait) = (WAIT, WAIT);
                return Some(advantage);
            }
            self.on = !self.on;
            self.wait = self.next_wait;
            self.next_wait = (BACKOFF * self.next_wait).min(MOST_WAIT);
            return None;
        }
        if !self.on && stretch.steps > MOST_STEPS * passed {
            return None;
        }
        self.wait = self.wait.saturating_sub(1);
        if self.wait == 0 {
            self.against = Some(gain);
            self.on = !self.on;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::Interruption;

    /// Steps of both methods over `samples` samples, where they take so many steps of one unit of work to a sample.
    fn steps(samples: u64, of_bdf: u64, of_one_step: u64) -> (u64, u64) {
        let mut interruption = Interruption::new();
        let (mut bdf, mut one_step) = (0, 0);
        for sample in 0..samples {
            let count = if interruption.is_on() { of_one_step } else { of_bdf };
            for _ in 0..count {
                interruption.samples(sample);
                *(if interruption.is_on() { &mut one_step } else { &mut bdf }) += 1;
                interruption.step(1.0 / count as f64, 1.0);
            }
        }
        (bdf, one_step)
    }

    #[test]
    fn the_better_method_does_nearly_all_steps() {
        let (bdf, one_step) = steps(10_000, 17, 10);
        assert!(bdf < one_step / 20, "{bdf} steps of BDF, {one_step} of the one-step method");
        let (bdf, one_step) = steps(10_000, 8, 10);
        assert!(one_step < bdf / 20, "{bdf} steps of BDF, {one_step} of the one-step method");
    }

    #[test]
    fn samples_that_are_far_apart_change_nothing() {
        assert_eq!(steps(1000, 60, 1), (60_000, 0));
    }
}

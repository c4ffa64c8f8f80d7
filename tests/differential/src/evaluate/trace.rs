//! What relations and rounding functions have said, in the order in which they were evaluated.
//!
//! Between events the recorded answers are given again, so that the same branches are taken, and the order stays the same.

/// One answer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    /// What holds until the next event.
    pub held: f64,
    /// What would be answered now.
    pub now: f64,
    /// Distance to the instant of change; the sign means nothing for rounding functions.
    pub gap: f64,
    /// Only time decides.
    pub timed: bool,
}

/// The answers of one evaluation.
#[derive(Clone, Default)]
pub(super) struct Trace {
    /// The answers.
    pub answers: Vec<Answer>,
    /// Recorded answers are given again.
    pub frozen: bool,
    /// The next answer.
    pub position: usize,
}

impl Trace {
    /// A new evaluation.
    pub(super) fn rewind(&mut self, position: usize) {
        self.position = position;
        if !self.frozen {
            self.answers.truncate(position);
        }
    }

    /// The answer that counts.
    pub(super) fn answer(&mut self, now: f64, gap: f64, timed: bool) -> Result<f64, String> {
        let position = self.position;
        self.position += 1;
        if !self.frozen {
            self.answers.push(Answer { held: now, now, gap, timed });
            return Ok(now);
        }
        let answer = self.answers.get_mut(position).ok_or("more relations than at the event")?;
        (answer.now, answer.gap) = (now, gap);
        Ok(answer.held)
    }

    /// Whether an answer is another one now.
    pub(super) fn changed(&self) -> bool {
        self.answers.iter().any(|answer| answer.held != answer.now)
    }
}

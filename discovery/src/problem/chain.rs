//! What a measuring chain makes of a channel of the model: gain, offset, what it adds, delay, a clock that runs fast, and the end of its range.

use super::Problem;
use crate::disturbance::Course;
use crate::unknowns::Meaning;

/// A measuring chain with its numbers, in one shot.
pub(crate) struct Chain {
    /// Factor on the model's variable.
    pub gain: f64,
    /// What is shown where that is zero (units of the model).
    pub offset: f64,
    /// How far the record is shifted (s).
    pub late: f64,
    /// How much faster than true the clock runs, as a part.
    pub clock: f64,
    /// What is added, with its amplitudes (units of the model).
    courses: Vec<(Course, f64)>,
    /// Smallest and largest number that it shows (units of the model).
    limits: (f64, f64),
}

impl Chain {
    /// The time of the run that is shown at a time of the record (s).
    pub(crate) fn machine_time(&self, time: f64) -> f64 {
        time - self.late - self.clock * time
    }

    /// What is shown of a value of the model at a time of the record.
    pub(crate) fn shown(&self, model: f64, time: f64) -> f64 {
        self.whole(model, time).clamp(self.limits.0, self.limits.1)
    }

    /// True if the value is beyond what the chain shows, so that a small change of it changes nothing.
    pub(crate) fn is_clipped(&self, model: f64, time: f64) -> bool {
        let whole = self.whole(model, time);
        whole < self.limits.0 || whole > self.limits.1
    }

    fn whole(&self, model: f64, time: f64) -> f64 {
        let added = self.courses.iter().map(|(course, amplitude)| amplitude * course.value(time)).sum::<f64>();
        self.gain * model + self.offset + added
    }
}

impl Problem<'_> {
    /// The measuring chain of a channel in a shot.
    pub(crate) fn chain(&self, xi: &[f64], shot: usize, channel: usize) -> Chain {
        let limits = self.data.channels[channel].limits;
        let mut chain = Chain { gain: 1.0, offset: 0.0, late: 0.0, clock: 0.0, courses: Vec::new(), limits };
        for (unknown, &xi) in self.unknowns.iter().zip(xi).filter(|(unknown, _)| unknown.touches(shot)) {
            let value = || unknown.value(xi);
            match &unknown.meaning {
                Meaning::Gain { channel: own, .. } if *own == channel => chain.gain = value(),
                Meaning::Offset { channel: own, .. } if *own == channel => chain.offset = value(),
                Meaning::Course { channel: own, course, .. } if *own == channel => {
                    chain.courses.push((*course, value()));
                }
                Meaning::Late { places, .. } if places.is_empty() => chain.late += value(),
                Meaning::Lag { channel: own, .. } if *own == channel => chain.late += value(),
                Meaning::Clock { .. } => chain.clock += value(),
                _ => {}
            }
        }
        chain
    }
}

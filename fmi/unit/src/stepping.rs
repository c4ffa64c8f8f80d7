//! Co-simulation: the solver of the model's own side, from one communication point to the next.

use hyd_runtime::Reached;

use crate::core::{Core, Engine, Mode};
use crate::exchange::Updated;
use crate::fault::Fault;

/// Two communication points closer than this part of the time are one.
const SAME_POINT: f64 = 1e-9;

/// How a step towards a communication point stands.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Progress {
    /// It has come there.
    Done,
    /// It has come to this time (s), and goes on.
    Further(f64),
    /// An event waits for the importer at this time (s).
    Event(f64),
    /// The model has ended the run at this time (s).
    Ended(f64),
}

impl Core {
    /// Checks a step from `from` (s) over `length` (s); returns where it leads.
    pub(crate) fn begin_step(&mut self, from: f64, length: f64) -> Result<f64, Fault> {
        self.allow("a step", &[Mode::Running])?;
        let width = SAME_POINT * from.abs().max(self.at.abs()).max(length.abs());
        let distance = (from - self.at).abs();
        if distance.is_nan() || distance > width {
            return Err(Fault::usage(format!("the step begins at {from} s, but the unit stands at {} s", self.at)));
        }
        if !(length >= 0.0 && length.is_finite()) {
            return Err(Fault::usage(format!("a step of {length} s is not possible")));
        }
        if let Some(stop) = self.setup.stop
            && from + length > stop + SAME_POINT * stop.abs().max(length)
        {
            return Err(Fault::usage(format!("the step leads beyond the stop time {stop} s")));
        }
        if let Some(message) = &self.ended {
            return Err(Fault::usage(format!("the model has ended the run: {message}")));
        }
        self.take_inputs()?;
        // A step of no length leaves the point as it was.
        if length > 0.0 {
            self.unsettled = None;
            self.sloped.fill(false);
        }
        Ok(from + length)
    }

    /// Lets inputs that have changed act.
    pub(crate) fn take_inputs(&mut self) -> Result<(), Fault> {
        if std::mem::take(&mut self.disturbed)
            && let Engine::Stepping(steps) = &mut self.engine
        {
            steps.disturb(&mut self.system, self.at).map_err(|error| Fault::end(&error))?;
            self.fresh = false;
        }
        Ok(())
    }

    /// One internal step towards `to` (s).
    pub(crate) fn advance(&mut self, to: f64) -> Result<Progress, Fault> {
        // Inputs are known up to the communication point only.
        let beyond = self.structure().inputs.is_empty();
        let told = self.manners.event_mode && self.manners.early_return;
        let Engine::Stepping(steps) = &mut self.engine else {
            return Err(Fault::usage("the unit was not made for co-simulation"));
        };
        self.fresh = false;
        let reached = steps.advance(&mut self.system, to, beyond).map_err(|error| Fault::end(&error))?;
        match reached {
            Reached::Point => {
                self.at = to;
                Ok(Progress::Done)
            }
            Reached::Step(t) => {
                self.at = t;
                Ok(Progress::Further(t))
            }
            Reached::Event(t) => {
                self.at = t;
                if told {
                    self.waiting = true;
                    return Ok(Progress::Event(t));
                }
                steps.event(&mut self.system).map_err(|error| Fault::end(&error))?;
                Ok(Progress::Further(t))
            }
            Reached::Terminated(message) => {
                self.ended = Some(message);
                self.at = steps.time();
                Ok(Progress::Ended(self.at))
            }
        }
    }

    /// The event that waits, or what inputs have changed.
    pub(crate) fn update_stepping(&mut self) -> Result<Updated, Fault> {
        let Engine::Stepping(steps) = &mut self.engine else {
            return Err(Fault::usage("the unit was not made for co-simulation"));
        };
        // An importer that updates means what inputs are now.
        self.unsettled = None;
        if std::mem::take(&mut self.waiting) {
            steps.event(&mut self.system).map_err(|error| Fault::end(&error))?;
        }
        if std::mem::take(&mut self.disturbed) {
            steps.disturb(&mut self.system, self.at).map_err(|error| Fault::end(&error))?;
        }
        let next = steps.next_time_event();
        Ok(Updated {
            terminate: self.ended.is_some(),
            nominals_changed: false,
            values_changed: true,
            next_event: next.is_finite().then_some(next),
        })
    }
}

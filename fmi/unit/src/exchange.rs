//! Model exchange: time and states from outside, rates, indicators and events to outside.

use hyd_runtime::Exchange;

use crate::core::{Core, Engine, Mode};
use crate::fault::Fault;

/// Rates that differ by less than this part are the same, found from elsewhere.
const SAME_RATE: f64 = 1e-9;

/// What an update at an event has led to.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Updated {
    pub(crate) terminate: bool,
    pub(crate) nominals_changed: bool,
    pub(crate) values_changed: bool,
    pub(crate) next_event: Option<f64>,
}

impl Core {
    /// The engine of a model exchange that has begun.
    fn exchange(&mut self) -> Result<(&mut Exchange, &mut hyd_payload::Instance), Fault> {
        match &mut self.engine {
            Engine::Exchange(exchange) => Ok((&mut **exchange, &mut self.system)),
            _ => Err(Fault::usage("the unit was not made for model exchange, or its start has not been found")),
        }
    }

    fn begun(&mut self) -> Result<(), Fault> {
        if self.mode == Mode::Initialization { self.start() } else { Ok(()) }
    }

    pub(crate) fn enter_event_mode(&mut self) -> Result<(), Fault> {
        self.allow("entering event mode", &[Mode::Running, Mode::Event])?;
        self.mode = Mode::Event;
        Ok(())
    }

    /// Leaves event mode.
    pub(crate) fn run_on(&mut self) -> Result<(), Fault> {
        self.allow("leaving event mode", &[Mode::Event])?;
        self.mode = Mode::Running;
        Ok(())
    }

    /// The events of this instant.
    pub(crate) fn update(&mut self) -> Result<Updated, Fault> {
        self.allow("updating discrete states", &[Mode::Event])?;
        self.fresh = false;
        if matches!(self.engine, Engine::Stepping(_)) {
            return self.update_stepping();
        }
        let mut before = vec![0.0; self.state_count()];
        let mut after = before.clone();
        let (exchange, system) = self.exchange()?;
        exchange.derivatives(system, &mut before).map_err(|error| Fault::end(&error))?;
        let settled = exchange.event(system).map_err(|error| Fault::end(&error))?;
        exchange.derivatives(system, &mut after).map_err(|error| Fault::end(&error))?;
        let jumped =
            before.iter().zip(&after).any(|(old, new)| (new - old).abs() > SAME_RATE * old.abs().max(new.abs()));
        let next = exchange.next_event(system);
        self.ended = settled.terminated.or(self.ended.take());
        Ok(Updated {
            terminate: self.ended.is_some(),
            nominals_changed: settled.states_changed,
            // Integrators that restart only where states have changed would go on with the old rates.
            values_changed: settled.values_changed || jumped,
            next_event: next.is_finite().then_some(next),
        })
    }

    /// The integrator has accepted the point; true if an event is due all the same.
    pub(crate) fn complete_step(&mut self) -> Result<bool, Fault> {
        self.allow("completing a step", &[Mode::Running])?;
        let varies = !self.known.loaded.model.candidates.is_empty();
        let mut trial = varies.then(|| self.system.clone());
        let (exchange, system) = self.exchange()?;
        exchange.accept(system).map_err(|error| Fault::end(&error))?;
        Ok(trial.as_mut().is_some_and(|trial| exchange.wants_other_states(trial)))
    }

    pub(crate) fn set_time(&mut self, t: f64) -> Result<(), Fault> {
        self.allow("setting the time", &[Mode::Running, Mode::Event])?;
        if !t.is_finite() {
            return Err(Fault::usage(format!("the time {t} is not a number")));
        }
        // The stop time is no bound here: integrators in use try points beyond it on their last step, and have no answer to an error.
        self.exchange()?.0.set_time(t);
        self.fresh = false;
        Ok(())
    }

    pub(crate) fn set_states(&mut self, states: &[f64]) -> Result<(), Fault> {
        self.allow("setting states", &[Mode::Running, Mode::Event])?;
        let exchange = self.exchange()?.0;
        check(states.len(), exchange.states(), "states")?;
        if !states.iter().all(|value| value.is_finite()) {
            return Err(Fault { status: crate::fault::Status::Discard, ..Fault::usage("a state is not a number") });
        }
        exchange.set_states(states);
        self.fresh = false;
        Ok(())
    }

    pub(crate) fn states(&mut self, out: &mut [f64]) -> Result<(), Fault> {
        self.begun()?;
        let exchange = self.exchange()?.0;
        check(out.len(), exchange.states(), "states")?;
        exchange.get_states(out);
        Ok(())
    }

    pub(crate) fn nominals(&mut self, out: &mut [f64]) -> Result<(), Fault> {
        self.begun()?;
        let exchange = self.exchange()?.0;
        check(out.len(), exchange.states(), "states")?;
        exchange.get_nominals(out);
        Ok(())
    }

    pub(crate) fn derivatives(&mut self, out: &mut [f64]) -> Result<(), Fault> {
        self.begun()?;
        let (exchange, system) = self.exchange()?;
        check(out.len(), exchange.states(), "states")?;
        exchange.derivatives(system, out).map_err(|error| Fault::discard(&error))
    }

    pub(crate) fn indicators(&mut self, out: &mut [f64]) -> Result<(), Fault> {
        self.begun()?;
        check(out.len(), self.structure().roots, "event indicators")?;
        let (exchange, system) = self.exchange()?;
        exchange.indicators(system, out).map_err(|error| Fault::discard(&error))
    }

    /// Number of continuous states, which never changes.
    pub(crate) fn state_count(&self) -> usize {
        let structure = self.structure();
        let all = structure.differential.iter().filter(|&&state| state).count();
        self.known.catalogue.varying_states().unwrap_or(all)
    }
}

fn check(given: usize, wanted: usize, what: &str) -> Result<(), Fault> {
    match given == wanted {
        true => Ok(()),
        false => Err(Fault::usage(format!("there are {wanted} {what}, not {given}"))),
    }
}

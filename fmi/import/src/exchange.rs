//! A unit for model exchange as a system for the solver: `F(t, x, x') = x' - f(t, u(t), x)`.
//!
//! All unknowns are states.  The start is explicit: the unit finds its initial values by itself, and its first event iteration belongs to
//! it.  Relations are the signs of event indicators as they stand after the last event.  An event is handled by the unit as a whole, so
//! the passes that the solver asks for after the first change nothing.  Whether an event changed what rates will be cannot be known, so
//! every one is a new beginning.  Source: Functional Mock-up Interface 3.0.2, section 3; 2.0.4, section 3.
//!
//! The Jacobian comes of directional derivatives where the unit has them, else of differences, both for whole colours of columns at a time,
//! and is made in the process of the unit by one question.

use std::collections::BTreeMap;
use std::sync::Arc;

use hyd_system::{
    AssertionReport, DaeSystem, Delays, EvalFailure, EventChange, EventPhase, Excerpt, Homotopy, InitialStructure,
    InputError, Inputs, Instants, LearnedSize, ParameterError, Pattern, Series, StateChoices, Steps, Structure,
    Switches, Tables, Tangents, TimeEvent, TornLoops,
};

use crate::archive::Unit;
use crate::channel::Writer;
use crate::description::Description;
use crate::driver::{Driver, tool};
use crate::fault::Fault;
use crate::followers::{Follower, next_jump, reach, samples_passed};
use crate::host::{Counts, Host, Refusal};
use crate::layout::Watched;
use crate::protocol::{Operation, Update, values_of};
use crate::twins::{LIKENESS, TwinHost};

/// A unit for model exchange.
pub struct Exchange {
    pub(crate) driver: Driver,
    pub(crate) twins: TwinHost,
    structure: Structure,
    instants: Instants,
    held: Vec<bool>,
    nominals: Vec<f64>,
    rates: Vec<f64>,
    start: Vec<f64>,
    indicators: Vec<f64>,
    pub(crate) next: f64,
    ended: bool,
    completed: bool,
}

impl Exchange {
    /// Begins the process of a unit.  `driven`: names of inputs that follow recorded samples.
    ///
    /// # Errors
    /// A sentence: the unit is not for model exchange, or cannot be loaded.
    pub fn new(unit: &Unit, host: &Host, driven: &[String]) -> Result<Self, Fault> {
        Self::with(unit, host, driven, None)
    }

    /// The same as a part of a larger system, which gives the inputs with these names their values and reads what is watched at every point.
    ///
    /// # Errors
    /// As [`Exchange::new`].
    pub(crate) fn part(unit: &Unit, host: &Host, inputs: &[String], watched: &Watched) -> Result<Self, Fault> {
        Self::with(unit, host, inputs, Some(watched))
    }

    fn with(unit: &Unit, host: &Host, driven: &[String], watched: Option<&Watched>) -> Result<Self, Fault> {
        let description = &unit.description;
        let none = || Fault::of(&unit.file, "the unit is not for model exchange");
        let interface = description.exchange.as_ref().ok_or_else(none)?;
        if interface.needs_tool {
            return Err(Fault::of(
                &unit.file,
                format!("the unit needs the program that made it, {}", tool(description)),
            ));
        }
        let n = description.state_count();
        let state_pattern = pattern(description, n);
        let driver = Driver::new(unit, host, driven, (interface, true), (&state_pattern, watched))?;
        let structure = Structure {
            unknowns: n,
            differential: vec![true; n],
            sizes: learned_sizes(description),
            state_pattern,
            rate_pattern: diagonal(n),
            roots: description.indicators,
            outputs: values_of(&driver.layout.outputs),
            initial: InitialStructure { unknowns: 0, pattern: Pattern::dense(0, 0) },
            delays: Vec::new(),
            inputs: driver.layout.sites.clone(),
        };
        Ok(Self {
            structure,
            instants: Instants::default(),
            held: vec![false; description.indicators],
            nominals: vec![1.0; n],
            rates: vec![0.0; n],
            start: vec![0.0; n],
            indicators: vec![0.0; description.indicators],
            next: f64::INFINITY,
            ended: false,
            completed: interface.needs_completed_steps,
            twins: TwinHost::new(!interface.once),
            driver,
        })
    }

    /// Tells the unit what tolerance the run has, and where it stops (s), from the next start on.
    pub fn expect(&mut self, tolerance: f64, stop: f64) {
        (self.driver.tolerance, self.driver.stop) = (tolerance, stop);
    }

    /// Sets a parameter of type String; none where the unit has none of that name.
    pub fn set_text(&mut self, name: &str, text: &str) -> Option<()> {
        self.driver.set_text(name, text)
    }

    /// See [`Driver::start_of`].
    pub(crate) fn start_of(&mut self, name: &str) -> Option<usize> {
        self.driver.start_of(name)
    }

    /// See [`Driver::hand_parameter`].
    pub(crate) fn hand_parameter(&mut self, index: usize, value: f64, is_set: bool) {
        self.driver.hand_parameter(index, value, is_set);
    }

    /// See [`Driver::set_start`].
    pub(crate) fn set_start(&mut self, position: usize, value: f64) {
        self.driver.set_start(position, value);
    }

    /// Lets the following runs begin with this value of a state; none where the unit has no state of that name, or finds its start by itself.
    pub fn begin_with(&mut self, name: &str, value: f64) -> Option<()> {
        self.driver.start_of(name).map(|position| self.driver.set_start(position, value))
    }

    /// The first parameter that was set to a value outside its limits, as a sentence.
    pub fn outside(&self) -> Option<String> {
        self.driver.outside()
    }

    /// Why the unit cannot be used any more, if that is so.
    pub fn fault(&self) -> Option<&Fault> {
        self.driver.remote.fault.as_ref()
    }

    /// What the unit has been asked.
    pub fn counts(&self) -> Counts {
        self.driver.remote.counts()
    }

    /// True if it runs in a process of its own.
    pub fn is_apart(&self) -> bool {
        self.driver.remote.is_far()
    }

    /// Sentences on what no use is made of.
    pub fn notes(&self) -> &[String] {
        &self.driver.layout.notes
    }

    /// Rates and what is watched, of a unit that is a part of a larger system.
    pub(crate) fn watch(&mut self, t: f64, x: &[f64], rates: &mut [f64], watched: &mut [f64]) {
        match self.ask(Operation::Watch, (t, x), false) {
            Ok(mut reader) => {
                reader.reals(rates);
                reader.reals(watched);
            }
            Err(_) => {
                rates.fill(f64::NAN);
                watched.fill(f64::NAN);
            }
        }
    }

    /// Entries of the Jacobian of rates and of what is watched by states and continuous inputs, on [`Exchange::whole`].
    pub(crate) fn derivatives(&mut self, t: f64, x: &[f64], entries: &mut [f64]) {
        self.slopes(Operation::Jacobian, (t, x), entries);
    }

    /// The same where entries of what is watched may have any value.
    pub(crate) fn rate_derivatives(&mut self, t: f64, x: &[f64], entries: &mut [f64]) {
        self.slopes(Operation::Slopes, (t, x), entries);
    }

    fn slopes(&mut self, operation: Operation, at: (f64, &[f64]), entries: &mut [f64]) {
        match self.ask(operation, at, false) {
            Ok(mut reader) => reader.reals(entries),
            Err(_) => entries.fill(f64::NAN),
        }
    }

    /// The same at the states after the last start.
    pub(crate) fn start_derivatives(&mut self, t0: f64, entries: &mut [f64]) {
        let start = std::mem::take(&mut self.start);
        self.derivatives(t0, &start, entries);
        self.start = start;
    }

    /// Columns of that Jacobian: where the rows of each begin, and the rows.
    pub(crate) fn whole(&self) -> (&[u32], &[u32]) {
        self.driver.columns()
    }

    /// Inputs in the order of the columns of that Jacobian, and how many of them change always.
    pub(crate) fn input_sites(&self) -> (&[hyd_system::InputSite], usize) {
        (&self.driver.layout.sites, self.driver.continuous)
    }

    /// The states after the last start or event.
    pub(crate) fn start(&self) -> &[f64] {
        &self.start
    }

    /// Asks at a point.
    #[inline]
    fn ask(
        &mut self,
        operation: Operation,
        (t, y): (f64, &[f64]),
        all_inputs: bool,
    ) -> Result<crate::channel::Reader<'_>, Refusal> {
        self.driver.move_inputs(t);
        let (continuous, inputs) = (self.driver.continuous, &self.driver.input_values);
        // What is asked of a time that the unit has left behind is asked of its likeness, which comes behind.
        let is_behind = self.twins.answers(operation, t);
        let asked = if is_behind { Operation::Twin } else { operation };
        self.driver.remote.ask(asked, |writer: &mut Writer<'_>| {
            if is_behind {
                writer.number(u64::from(LIKENESS));
                writer.number(operation as u64);
            }
            writer.real(t);
            writer.reals(&inputs[..continuous]);
            writer.reals(y);
            if all_inputs {
                writer.reals(&inputs[continuous..]);
            }
        })
    }

    fn failure(&self) -> EvalFailure {
        foreign(self.driver.remote.why().to_string())
    }

    /// Takes over what an update gives; the states stand in `start` then.
    fn read_update(&mut self, operation: Operation, at: (f64, &[f64])) -> Result<Update, EvalFailure> {
        let mut update = Update::default();
        let (mut start, mut nominals) = (std::mem::take(&mut self.start), std::mem::take(&mut self.nominals));
        let mut indicators = std::mem::take(&mut self.indicators);
        let answered = match self.ask(operation, at, true) {
            Ok(mut reader) => {
                update.states_changed = reader.number() != 0;
                update.terminate = reader.number() != 0;
                update.next = reader.real();
                reader.reals(&mut start);
                reader.reals(&mut nominals);
                reader.reals(&mut indicators);
                Ok(())
            }
            Err(refusal) => Err(refusal),
        };
        (self.start, self.nominals, self.indicators) = (start, nominals, indicators);
        answered.map_err(|_| self.failure())?;
        self.take(update);
        Ok(update)
    }

    fn take(&mut self, update: Update) {
        for (held, value) in self.held.iter_mut().zip(&self.indicators) {
            *held = *value > 0.0;
        }
        self.next = if update.next.is_nan() { f64::INFINITY } else { update.next };
        self.ended |= update.terminate;
    }

    fn terminated(&self) -> Option<String> {
        self.ended.then(|| "the unit ends the run".to_string())
    }
}

/// Which rates depend on which states, by what the unit says.
fn pattern(description: &Description, n: usize) -> Pattern {
    let mut first = Vec::with_capacity(description.states.len());
    let mut at = 0u32;
    for state in &description.states {
        first.push(at);
        at += description.variables[state.state].count() as u32;
    }
    let count = |k: usize| description.variables[description.states[k].state].count() as u32;
    let by_reference: std::collections::HashMap<u32, usize> =
        description.states.iter().enumerate().map(|(k, own)| (description.variables[own.state].reference, k)).collect();
    let mut pairs: Vec<(u32, u32)> = (0..n as u32).map(|k| (k, k)).collect();
    for (k, own) in description.states.iter().enumerate() {
        let states: Vec<usize> = match &own.depends {
            None => (0..description.states.len()).collect(),
            Some(list) => {
                let state = |&variable: &usize| by_reference.get(&description.variables[variable].reference).copied();
                list.iter().filter_map(state).collect()
            }
        };
        for of in states {
            for row in first[k]..first[k] + count(k) {
                pairs.extend((first[of]..first[of] + count(of)).map(|column| (row, column)));
            }
        }
    }
    Pattern::from_pairs(n, n, &pairs)
}

/// States of which the unit states no nominal value.  Those whose names differ in subscripts only are of one kind.
fn learned_sizes(description: &Description) -> Vec<LearnedSize> {
    let mut groups: BTreeMap<String, u32> = BTreeMap::new();
    let (mut sizes, mut unknown) = (Vec::new(), 0);
    for state in &description.states {
        let variable = &description.variables[state.state];
        let count = variable.count() as u32;
        if variable.nominal.is_none() {
            let next = groups.len() as u32;
            let group = *groups.entry(without_subscripts(&variable.name)).or_insert(next);
            sizes.extend((unknown..unknown + count).map(|unknown| LearnedSize { unknown, group }));
        }
        unknown += count;
    }
    sizes
}

/// `a[2].b[1,3]` as `a[].b[]`.
fn without_subscripts(name: &str) -> String {
    let mut inside = false;
    let kept = name.chars().filter(|&c| {
        inside = (inside || c == '[') && c != ']';
        !inside || c == '['
    });
    kept.collect()
}

fn diagonal(n: usize) -> Pattern {
    Pattern { rows: n, column_starts: (0..=n as u32).collect(), row_indices: (0..n as u32).collect() }
}

impl DaeSystem for Exchange {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn tables(&self) -> &Arc<Tables> {
        &self.driver.layout.tables
    }

    fn parameters(&self) -> &[f64] {
        &self.driver.parameters
    }

    fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        self.driver.set_parameter(index, value)
    }

    fn bind(&mut self, t0: f64) -> Result<(), EvalFailure> {
        self.instants = Instants::of_run(t0);
        self.ended = false;
        self.driver.revive().map_err(|fault| foreign(fault.to_string()))?;
        let beginning = self.driver.beginning(t0).map_err(foreign)?;
        self.twins.begin(&beginning);
        let mut update = Update::default();
        let started = self.driver.remote.ask(Operation::Start, |writer| beginning.write(writer)).map(|mut reader| {
            update.states_changed = reader.number() != 0;
            update.terminate = reader.number() != 0;
            update.next = reader.real();
            reader.reals(&mut self.start);
            reader.reals(&mut self.nominals);
            reader.reals(&mut self.indicators);
        });
        started.map_err(|_| self.failure())?;
        self.take(update);
        let wrong = |value: &f64| !(value.is_finite() && *value != 0.0);
        self.nominals.iter_mut().for_each(|value| *value = if wrong(value) { 1.0 } else { value.abs() });
        self.driver.read_parameters().map_err(|_| self.failure())
    }

    fn nominals(&self, out: &mut [f64]) {
        out.copy_from_slice(&self.nominals);
    }

    fn tested(&self, out: &mut [bool]) {
        out.fill(true);
    }

    fn initial_nominals(&self, _out: &mut [f64]) {}

    fn initial_guess(&mut self, _t0: f64, _z: &mut [f64]) -> Result<(), EvalFailure> {
        Ok(())
    }

    fn initial_residual(&mut self, _t0: f64, _z: &[f64], _out: &mut [f64]) -> Result<(), EvalFailure> {
        Ok(())
    }

    fn initial_jacobian(&mut self, _t0: f64, _z: &[f64], _values: &mut [f64]) -> Result<(), EvalFailure> {
        Ok(())
    }

    fn initial_store(&mut self, t0: f64, _z: &[f64], y: &mut [f64], yp: &mut [f64]) -> Result<(), EvalFailure> {
        y.copy_from_slice(&self.start);
        if y.is_empty() {
            return Ok(());
        }
        let found = self.ask(Operation::Rates, (t0, &*y), false).map(|mut reader| reader.reals(yp));
        found.map_err(|_| self.failure())
    }

    fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        if y.is_empty() {
            return;
        }
        match self.ask(Operation::Rates, (t, y), false) {
            Ok(mut reader) => {
                for (out, rate) in out.iter_mut().zip(yp) {
                    *out = rate - reader.real();
                }
            }
            Err(_) => out.fill(f64::NAN),
        }
    }

    fn jacobian(&mut self, t: f64, y: &[f64], _yp: &[f64], state_values: &mut [f64], rate_values: &mut [f64]) {
        rate_values.fill(1.0);
        match self.ask(Operation::Jacobian, (t, y), false) {
            Ok(mut reader) => state_values.iter_mut().for_each(|value| *value = -reader.real()),
            Err(_) => state_values.fill(f64::NAN),
        }
    }

    fn roots(&mut self, t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        if out.is_empty() {
            return;
        }
        match self.ask(Operation::Indicators, (t, y), false) {
            Ok(mut reader) => reader.reals(out),
            // Nothing is known there, so nothing is said to have changed.
            Err(_) => {
                for (value, held) in out.iter_mut().zip(&self.held) {
                    *value = if *held { 1.0 } else { -1.0 };
                }
            }
        }
    }

    fn held(&self, out: &mut [bool]) {
        out.copy_from_slice(&self.held);
    }

    fn next_time_event(&mut self, t: f64) -> TimeEvent {
        next_jump(&self.driver.layout.followers, TimeEvent::at(self.next), t, self.instants)
    }

    fn unchanged_until(&mut self, _t: f64, until: f64) -> f64 {
        until
    }

    fn event_pass(
        &mut self,
        phase: EventPhase,
        t: f64,
        y: &mut [f64],
        _yp: &[f64],
    ) -> Result<EventChange, EvalFailure> {
        match phase {
            EventPhase::Initial => Ok(EventChange { terminated: self.terminated(), ..EventChange::default() }),
            EventPhase::Started | EventPhase::Iterate | EventPhase::Repeat => Ok(EventChange::default()),
            EventPhase::First => {
                let instants = self.instants;
                for follower in &mut self.driver.layout.followers {
                    Follower::pass(follower, t, instants);
                }
                let update = self.read_update(Operation::Event, (t, &*y))?;
                if update.states_changed {
                    y.copy_from_slice(&self.start);
                }
                let terminated = self.terminated();
                Ok(EventChange {
                    changed: true,
                    reinitialised: update.states_changed,
                    terminated,
                    unsettled: false,
                    by_inputs: false,
                })
            }
        }
    }

    fn outputs(&mut self, t: f64, y: &[f64], _yp: &[f64], out: &mut [f64]) {
        if out.is_empty() {
            return;
        }
        match self.ask(Operation::Outputs, (t, y), false) {
            Ok(mut reader) => reader.reals(out),
            Err(_) => out.fill(f64::NAN),
        }
    }

    fn find_excerpt(&mut self, _wanted: &[u32]) -> Option<Excerpt> {
        None
    }

    fn excerpt(&mut self, _number: usize, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.outputs(t, y, yp, out);
    }

    fn assertions(&mut self, _t: f64, _y: &[f64], _yp: &[f64], out: &mut Vec<AssertionReport>) {
        out.extend(self.driver.reports());
    }

    fn diagnose(&mut self, t: f64, y: &[f64], _yp: &[f64]) -> Option<EvalFailure> {
        let mut rates = std::mem::take(&mut self.rates);
        let asked = self.ask(Operation::Rates, (t, y), false).map(|mut reader| reader.reals(&mut rates));
        self.rates = rates;
        if asked.is_err() {
            return Some(self.failure());
        }
        let k = self.rates.iter().position(|rate| !rate.is_finite())?;
        let name = self.tables().unknown_name(k);
        let reason = "the unit gives a rate that is not a number".to_string();
        Some(EvalFailure { variable: Some(format!("der({name})")), reason, ..EvalFailure::default() })
    }

    fn diagnose_initial(&mut self, _t0: f64, _z: &[f64]) -> Option<EvalFailure> {
        let remote = &self.driver.remote;
        (remote.fault.is_some() || remote.discarded.is_some()).then(|| self.failure())
    }

    fn homotopy(&mut self) -> Option<&mut dyn Homotopy> {
        None
    }

    fn torn_loops(&mut self) -> Option<&mut dyn TornLoops> {
        None
    }

    fn state_choices(&mut self) -> Option<&mut dyn StateChoices> {
        None
    }

    fn delays(&mut self) -> Option<&mut dyn Delays> {
        None
    }

    fn inputs(&mut self) -> Option<&mut dyn Inputs> {
        if self.structure.inputs.is_empty() { None } else { Some(self) }
    }

    fn switches(&mut self) -> Option<&mut dyn Switches> {
        None
    }

    fn steps(&mut self) -> Option<&mut dyn Steps> {
        if self.completed { Some(self) } else { None }
    }

    fn tangents(&mut self) -> Option<&mut dyn Tangents> {
        None
    }
}

impl Inputs for Exchange {
    fn set_input(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        self.driver.follow(input, series)
    }

    fn give_input(&mut self, input: usize, value: f64) -> Result<(), InputError> {
        self.driver.layout.followers.get_mut(input).ok_or(InputError::Unknown)?.give(value);
        Ok(())
    }

    fn input_reach(&mut self, t: f64) -> f64 {
        reach(&self.driver.layout.followers, t)
    }

    fn samples_passed(&mut self, t: f64) -> u64 {
        samples_passed(&self.driver.layout.followers, t)
    }
}

impl Exchange {
    /// The unit asks to hear of steps, and may remember them.
    pub(crate) fn hears_of_steps(&self) -> bool {
        self.completed
    }
}

impl Steps for Exchange {
    fn completed(&mut self, t: f64, y: &[f64]) -> Result<bool, EvalFailure> {
        self.twins.completed_to = t;
        let told = self.ask(Operation::Completed, (t, y), false);
        let (event, terminate) = match told {
            Ok(mut reader) => (reader.number() != 0, reader.number() != 0),
            Err(_) => return Err(self.failure()),
        };
        self.ended |= terminate;
        // Ending is an event, too: its pass says so.
        Ok(event || terminate)
    }
}

/// A failure of equations that are those of another tool.
pub(crate) fn foreign(reason: String) -> EvalFailure {
    EvalFailure { reason, is_foreign: true, ..EvalFailure::default() }
}

#[cfg(test)]
mod tests {
    use super::without_subscripts;

    #[test]
    fn names_of_one_kind_differ_in_subscripts_only() {
        for (name, kind) in [("a[2].b[1,3]", "a[].b[]"), ("a.b", "a.b"), ("der(x[12])", "der(x[])")] {
            assert_eq!(without_subscripts(name), kind, "{name}");
        }
    }
}

//! A unit for model exchange as a system for the solver: `F(t, x, x') = x' - f(t, u(t), x)`.
//!
//! All unknowns are states.  The start is explicit: the unit finds its initial values by itself, and its first event iteration belongs to
//! it.  Relations are the signs of event indicators as they stand after the last event.  An event is handled by the unit as a whole, so
//! the passes that the solver asks for after the first change nothing.  Whether an event changed what rates will be cannot be known, so
//! every one is a new beginning.  Source: Functional Mock-up Interface 3.0.2, section 3; 2.0.4, section 3.
//!
//! The Jacobian comes of directional derivatives where the unit has them, else of differences, both for whole colours of columns at a time,
//! and is made in the process of the unit by one question.

use std::ffi::CString;
use std::sync::Arc;

use hyd_system::given;
use hyd_system::{
    AssertionReport, DaeSystem, Delays, EvalFailure, EventChange, EventPhase, Homotopy, InitialStructure, InputError,
    Inputs, Instants, ParameterError, Pattern, Series, StateChoices, Steps, Structure, Tables, Tangents, TimeEvent,
    TornLoops,
};

use crate::archive::Unit;
use crate::channel::Writer;
use crate::colours::Colours;
use crate::description::{Description, Interface, Kind};
use crate::fault::Fault;
use crate::folder::Folder;
use crate::followers::{Follower, next_jump, reach};
use crate::host::{Counts, Host, Refusal, Remote};
use crate::layout::Layout;
use crate::protocol::{Group, Operation, Setup, Update, values_of};
use crate::session::Beginning;

/// Words for texts that are set before a start.
const TEXTS: usize = 1 << 15;

/// Parameters, inputs and the process: what both kinds of use have in common.
pub(crate) struct Driver {
    pub(crate) layout: Layout,
    pub(crate) description: Arc<Description>,
    pub(crate) remote: Remote,
    begin: Begin,
    pub(crate) parameters: Vec<f64>,
    pub(crate) texts: Vec<(u32, CString)>,
    /// Number of followers that change always; the others follow them.
    pub(crate) continuous: usize,
    pub(crate) input_values: Vec<f64>,
    pub(crate) tolerance: f64,
    pub(crate) stop: f64,
}

/// What a process is begun with.
struct Begin {
    host: Host,
    file: String,
    folder: Arc<Folder>,
    setup: Setup,
    room: usize,
}

impl Begin {
    fn remote(&self) -> Result<Remote, Fault> {
        Remote::begin(&self.host, (&self.file, &self.folder), &self.setup, self.room)
    }
}

impl Driver {
    pub(crate) fn new(
        unit: &Unit,
        host: &Host,
        driven: &[String],
        (interface, exchange): (&Interface, bool),
        pattern: &Pattern,
    ) -> Result<Self, Fault> {
        let description = Arc::clone(&unit.description);
        let layout = Layout::new(&description, &unit.file, driven)?;
        let references = |wanted: fn(&crate::description::State) -> usize| -> Vec<u32> {
            description.states.iter().map(|state| description.variables[wanted(state)].reference).collect()
        };
        let setup = Setup {
            version: description.version,
            exchange,
            library: unit.library(interface).display().to_string(),
            resources: unit.resources(),
            token: description.token.clone(),
            name: description.model.to_string(),
            states: if exchange { description.state_count() } else { 0 },
            indicators: if exchange { description.indicators } else { 0 },
            completed: interface.needs_completed_steps,
            slopes: interface.interpolates && layout.inputs.iter().all(|group| group.number == crate::Number::Float64),
            directional: interface.directional,
            state_references: references(|state| state.state),
            rate_references: references(|state| state.rate),
            outputs: layout.outputs.clone(),
            parameters: layout.parameters.clone(),
            inputs: layout.inputs.clone(),
            discrete: layout.discrete.clone(),
            colours: Colours::new(pattern),
        };
        let room = TEXTS + 2 * layout.values.len() + 8 * layout.settings.len() + layout.followers.len();
        let (file, folder) = (unit.file.clone(), Arc::clone(&unit.folder));
        let begin = Begin { host: host.clone(), file, folder, setup, room };
        let remote = begin.remote()?;
        Ok(Self {
            begin,
            parameters: layout.values.clone(),
            texts: Vec::new(),
            continuous: values_of(&layout.inputs),
            input_values: vec![0.0; layout.followers.len()],
            layout,
            description,
            remote,
            tolerance: 1e-6,
            stop: f64::INFINITY,
        })
    }

    /// See [`DaeSystem::set_parameter`].
    pub(crate) fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        let setting = self.layout.setting_of.get(index).copied().flatten();
        let setting = setting.ok_or(ParameterError::NotSettable)?;
        if !value.is_finite() {
            return Err(ParameterError::BadValue);
        }
        self.layout.settings[setting].is_set = true;
        self.parameters[index] = value;
        Ok(())
    }

    /// Sets a parameter of type String; none where there is no such one.
    pub(crate) fn set_text(&mut self, name: &str, text: &str) -> Option<()> {
        let found = self.description.variables.iter().find(|variable| *variable.name == *name)?;
        if found.kind != Kind::Text || !found.sizes.is_empty() {
            return None;
        }
        self.texts.push((found.reference, crate::foreign::c_text(text)));
        Some(())
    }

    /// The first parameter that was set to a value outside its limits, as a sentence.
    pub(crate) fn outside(&self) -> Option<String> {
        let set = self.layout.settings.iter().filter(|setting| setting.is_set);
        set.flat_map(|setting| (0..setting.count).map(move |element| (setting, element))).find_map(
            |(setting, element)| {
                let variable = &self.description.variables[setting.variable];
                let info = self.layout.tables.variables.iter().find(|info| *info.name.parts[0].0 == *variable.name)?;
                let (name, value) = (info.name.element(element), self.parameters[setting.first + element]);
                given::outside(&name, &info.kind, value, (variable.min, variable.max)).map(|outside| outside.message)
            },
        )
    }

    /// A new process where the old one is lost, so that one run that fails is not the end of all others.
    fn revive(&mut self) -> Result<(), Fault> {
        if self.remote.fault.is_some() {
            self.remote = self.begin.remote()?;
        }
        Ok(())
    }

    /// What is set before a run from `t0` (s).
    pub(crate) fn beginning(&mut self, t0: f64) -> Result<Beginning, String> {
        let mut values = Vec::new();
        for setting in self.layout.settings.iter().filter(|setting| setting.is_set) {
            let variable = &self.description.variables[setting.variable];
            let own = self.parameters[setting.first..setting.first + setting.count].to_vec();
            if own.iter().any(|value| value.is_nan()) {
                return Err(format!("`{}` has no start values, so all of its elements must be set", variable.name));
            }
            let group = Group { number: setting.number, references: vec![variable.reference], values: setting.count };
            values.push((group, own));
        }
        for follower in &mut self.layout.followers {
            follower.start(t0)?;
        }
        self.move_inputs(t0);
        let inputs = self.input_values.clone();
        let texts = self.texts.clone();
        Ok(Beginning { start: t0, stop: self.stop, tolerance: self.tolerance, values, texts, inputs })
    }

    /// Values of all inputs at a time.
    pub(crate) fn move_inputs(&mut self, t: f64) {
        for (value, follower) in self.input_values.iter_mut().zip(&mut self.layout.followers) {
            *value = follower.at(t).value;
        }
    }

    /// Reads the values of all parameters after a start.
    pub(crate) fn read_parameters(&mut self) -> Result<(), Refusal> {
        if self.parameters.is_empty() {
            return Ok(());
        }
        let mut reader = self.remote.ask(Operation::Parameters, |_| {})?;
        reader.reals(&mut self.parameters);
        Ok(())
    }

    /// Lets an input follow samples.
    pub(crate) fn follow(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        self.layout.followers.get_mut(input).ok_or(InputError::Unknown)?.follow(series)
    }
}

/// A unit for model exchange.
pub struct Exchange {
    driver: Driver,
    structure: Structure,
    instants: Instants,
    held: Vec<bool>,
    nominals: Vec<f64>,
    rates: Vec<f64>,
    start: Vec<f64>,
    indicators: Vec<f64>,
    next: f64,
    ended: bool,
    completed: bool,
}

impl Exchange {
    /// Begins the process of a unit.  `driven`: names of inputs that follow recorded samples.
    ///
    /// # Errors
    /// A sentence: the unit is not for model exchange, or cannot be loaded.
    pub fn new(unit: &Unit, host: &Host, driven: &[String]) -> Result<Self, Fault> {
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
        let driver = Driver::new(unit, host, driven, (interface, true), &state_pattern)?;
        let structure = Structure {
            unknowns: n,
            differential: vec![true; n],
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
            driver,
        })
    }

    /// Tells the unit what tolerance the run has, and where it stops (s), from the next start on.
    pub fn expect(&mut self, tolerance: f64, stop: f64) {
        (self.driver.tolerance, self.driver.stop) = (tolerance, stop);
    }

    /// Sets a parameter of type String; none where there is no such one.
    pub fn set_text(&mut self, name: &str, text: &str) -> Option<()> {
        self.driver.set_text(name, text)
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

    /// Sentences on what no use is made of.
    pub fn notes(&self) -> &[String] {
        &self.driver.layout.notes
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
        self.driver.remote.ask(operation, |writer: &mut Writer<'_>| {
            writer.real(t);
            writer.reals(&inputs[..continuous]);
            writer.reals(y);
            if all_inputs {
                writer.reals(&inputs[continuous..]);
            }
        })
    }

    fn failure(&self) -> EvalFailure {
        EvalFailure { equation: None, variable: None, reason: self.driver.remote.why().to_string() }
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

/// Who made a unit.
pub(crate) fn tool(description: &Description) -> &str {
    if description.tool.is_empty() { "which it does not name" } else { &description.tool }
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
        let reason = |reason: String| EvalFailure { equation: None, variable: None, reason };
        self.driver.revive().map_err(|fault| reason(fault.to_string()))?;
        let beginning = self.driver.beginning(t0).map_err(reason)?;
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
                Ok(EventChange { changed: true, reinitialised: update.states_changed, terminated, unsettled: false })
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

    fn assertions(&mut self, _t: f64, _y: &[f64], _yp: &[f64], _out: &mut Vec<AssertionReport>) {}

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
        Some(EvalFailure { equation: None, variable: Some(format!("der({name})")), reason })
    }

    fn diagnose_initial(&mut self, _t0: f64, _z: &[f64]) -> Option<EvalFailure> {
        None
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

    fn input_reach(&mut self, t: f64) -> f64 {
        reach(&self.driver.layout.followers, t)
    }
}

impl Steps for Exchange {
    fn completed(&mut self, t: f64, y: &[f64]) -> Result<bool, EvalFailure> {
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

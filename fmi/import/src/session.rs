//! One unit in the process of its own: what each operation asks of it.
//!
//! Numbers are read from the request before any of the answer is written, because both stand in the same place.  No operation but the
//! first two allocates.  Differences step by the square root of rounding, beside the size of the state.

use std::ffi::CString;
use std::path::Path;

use libloading::Library;

use crate::channel::{Reader, Writer};
use crate::description::Version;
use crate::fmi2::Two;
use crate::fmi3::Three;
use crate::foreign::{Foreign, Halt, c_text, messages};
use crate::protocol::{Group, Operation, Setup, Update, values_of};
use crate::twins::Twins;

/// Updates of discrete states at one instant.
const MOST_UPDATES: usize = 1000;
/// Square root of the rounding of numbers of eight bytes.
const STEP: f64 = 1.490_116_119_384_765_6e-8;

/// A unit that was loaded.
pub(crate) struct Session {
    pub(crate) setup: Setup,
    pub(crate) unit: Box<dyn Foreign>,
    /// There is an instance, and it has been used.
    is_instantiated: bool,
    /// The unit can be asked to end.
    pub(crate) is_running: bool,
    /// Time, continuous inputs and states as the unit has them.
    point: Vec<f64>,
    pub(crate) wanted: Vec<f64>,
    has_point: bool,
    /// The unit knows that a step has come to its point.
    pub(crate) knows_step: bool,
    discrete: Vec<f64>,
    slopes: Vec<f64>,
    nominals: Vec<f64>,
    pub(crate) rates: Vec<f64>,
    other: Vec<f64>,
    seed: Vec<f64>,
    entries: Vec<f64>,
    indicators: Vec<f64>,
    outputs: Vec<f64>,
    parameters: Vec<f64>,
    pub(crate) watched: Vec<f64>,
    /// Where each column of the Jacobian stands in a point, and the size its steps are measured by.
    columns: Vec<(usize, f64)>,
    known: Vec<u32>,
    unknown: Vec<u32>,
    pub(crate) twins: Twins,
}

impl Session {
    /// Loads the library.
    pub(crate) fn load(setup: Setup) -> Result<Self, Halt> {
        let failed = |error: libloading::Error| {
            Halt::Failed(format!("its library cannot be loaded: {}", said_by_loader(&error)))
        };
        // SAFETY: what the library does when it is loaded happens in this process, which is there for nothing else.
        #[allow(unsafe_code)]
        let library = unsafe { Library::new(Path::new(&setup.library)) }.map_err(failed)?;
        let unit: Box<dyn Foreign> = match setup.version {
            Version::Two => Box::new(Two::new(library)),
            Version::Three => Box::new(Three::new(library)),
        };
        let inputs = values_of(&setup.inputs);
        let states = setup.states;
        let by_inputs = setup.colours.of_column.len() > states;
        Ok(Self {
            unit,
            is_instantiated: false,
            is_running: false,
            point: vec![f64::NAN; 1 + inputs + states],
            wanted: vec![0.0; 1 + inputs + states],
            has_point: false,
            knows_step: false,
            discrete: vec![0.0; values_of(&setup.discrete)],
            slopes: vec![0.0; inputs],
            nominals: vec![1.0; states],
            rates: vec![0.0; states],
            other: vec![0.0; states + values_of(&setup.watched)],
            seed: vec![0.0; setup.colours.of_column.len()],
            entries: vec![0.0; setup.colours.entries()],
            indicators: vec![0.0; setup.indicators],
            outputs: vec![0.0; values_of(&setup.outputs)],
            parameters: vec![0.0; values_of(&setup.parameters)],
            watched: vec![0.0; values_of(&setup.watched)],
            columns: columns(&setup),
            known: references(&setup.state_references, if by_inputs { &setup.inputs } else { &[] }),
            unknown: references(&setup.rate_references, &setup.watched),
            twins: Twins::default(),
            setup,
        })
    }

    /// Does an operation.
    pub(crate) fn perform(
        &mut self,
        operation: Operation,
        request: &mut Reader<'_>,
        answer: &mut Writer<'_>,
    ) -> Result<(), Halt> {
        match operation {
            Operation::Load | Operation::End | Operation::Said => {}
            Operation::Start => {
                let beginning = Beginning::read(request).ok_or_else(nonsense)?;
                let update = self.start(&beginning)?;
                self.answer_update(update, answer)?;
            }
            Operation::Rates => {
                self.go_to_requested(request)?;
                self.unit.rates(&mut self.rates)?;
                answer.reals(&self.rates);
            }
            Operation::Jacobian | Operation::Slopes => {
                self.read_point(request);
                self.jacobian(operation == Operation::Jacobian)?;
                answer.reals(&self.entries);
            }
            Operation::Watch => {
                self.go_to_requested(request)?;
                self.watch(true)?;
                answer.reals(&self.rates);
                answer.reals(&self.watched);
            }
            Operation::Indicators => {
                self.go_to_requested(request)?;
                self.unit.indicators(&mut self.indicators)?;
                answer.reals(&self.indicators);
            }
            Operation::Outputs => {
                if self.setup.exchange {
                    self.go_to_requested(request)?;
                }
                get(&mut *self.unit, &self.setup.outputs, &mut self.outputs)?;
                answer.reals(&self.outputs);
            }
            Operation::Parameters => {
                get(&mut *self.unit, &self.setup.parameters, &mut self.parameters)?;
                answer.reals(&self.parameters);
            }
            Operation::Event => {
                self.go_to_requested(request)?;
                request.reals(&mut self.discrete);
                let update = self.event()?;
                self.answer_update(update, answer)?;
            }
            Operation::Completed => {
                self.go_to_requested(request)?;
                let (event, terminate) = self.unit.completed()?;
                self.knows_step = true;
                answer.number(u64::from(event));
                answer.number(u64::from(terminate));
            }
            Operation::Step => {
                let (t, h) = (request.real(), request.real());
                let inputs = self.slopes.len();
                request.reals(&mut self.wanted[1..1 + inputs]);
                request.reals(&mut self.discrete);
                request.reals(&mut self.slopes);
                set(&mut *self.unit, &self.setup.inputs, &self.wanted[1..1 + inputs])?;
                set(&mut *self.unit, &self.setup.discrete, &self.discrete)?;
                if self.setup.slopes {
                    let mut begin = 0;
                    for group in &self.setup.inputs {
                        self.unit.set_slopes(&group.references, &self.slopes[begin..begin + group.values])?;
                        begin += group.values;
                    }
                }
                let end = self.unit.step(t, h)?;
                answer.real(end.reached);
                answer.number(u64::from(end.terminate));
            }
            Operation::Twin => self.ask_twin(request, answer)?,
            Operation::Twins => self.ask_twins(request, answer)?,
        }
        Ok(())
    }

    /// A new instance, with what is set before the start, brought to its start.
    fn start(&mut self, beginning: &Beginning) -> Result<Update, Halt> {
        self.end_instance();
        self.unit.instantiate(&self.setup)?;
        self.is_instantiated = true;
        if self.setup.warns {
            self.unit.ask_for_warnings();
        }
        for (group, values) in &beginning.values {
            self.unit.set(group.number, &group.references, values)?;
        }
        for (reference, text) in &beginning.texts {
            self.unit.set_text(*reference, text)?;
        }
        let inputs = self.slopes.len();
        let (continuous, discrete) = beginning.inputs.split_at(inputs.min(beginning.inputs.len()));
        if continuous.len() != inputs || discrete.len() != self.discrete.len() {
            return Err(nonsense());
        }
        let stop = beginning.stop.is_finite().then_some(beginning.stop);
        self.unit.enter_initialization(beginning.start, stop, beginning.tolerance)?;
        set(&mut *self.unit, &self.setup.inputs, continuous)?;
        set(&mut *self.unit, &self.setup.discrete, discrete)?;
        self.unit.exit_initialization()?;
        self.is_running = true;
        if !self.setup.exchange {
            return Ok(Update { next: f64::INFINITY, ..Update::default() });
        }
        self.settle().map(|update| Update { states_changed: true, ..update })
    }

    /// The event mode to its end.
    fn settle(&mut self) -> Result<Update, Halt> {
        let mut update = Update { next: f64::INFINITY, ..Update::default() };
        let mut count = 0;
        while self.unit.update(&mut update)? {
            count += 1;
            if count == MOST_UPDATES {
                let sentence = format!("its discrete states do not settle: {MOST_UPDATES} updates at one instant");
                return Err(Halt::Failed(sentence));
            }
            if update.terminate {
                break;
            }
        }
        self.unit.enter_continuous()?;
        self.has_point = false;
        Ok(update)
    }

    fn event(&mut self) -> Result<Update, Halt> {
        let mut ended = false;
        if self.setup.completed && !self.knows_step {
            ended = self.unit.completed()?.1;
        }
        self.unit.enter_events()?;
        set(&mut *self.unit, &self.setup.discrete, &self.discrete)?;
        let update = self.settle()?;
        Ok(Update { terminate: update.terminate || ended, ..update })
    }

    /// What has become of the update: it, states, nominal values, event indicators.
    fn answer_update(&mut self, update: Update, answer: &mut Writer<'_>) -> Result<(), Halt> {
        if self.setup.states > 0 {
            self.unit.states(&mut self.other[..self.setup.states])?;
            self.unit.nominals(&mut self.nominals)?;
        }
        // A unit without event indicators need not have the function.
        if !self.indicators.is_empty() {
            self.unit.indicators(&mut self.indicators)?;
        }
        answer.number(u64::from(update.states_changed));
        answer.number(u64::from(update.terminate));
        answer.real(update.next);
        answer.reals(&self.other[..self.setup.states]);
        answer.reals(&self.nominals);
        answer.reals(&self.indicators);
        Ok(())
    }

    fn read_point(&mut self, request: &mut Reader<'_>) {
        request.reals(&mut self.wanted);
    }

    fn go_to_requested(&mut self, request: &mut Reader<'_>) -> Result<(), Halt> {
        self.read_point(request);
        self.go_to_wanted()
    }

    /// Tells the unit what has changed since the last point; units keep what they have computed where nothing has.
    pub(crate) fn go_to_wanted(&mut self) -> Result<(), Halt> {
        let inputs = self.slopes.len();
        let fresh = !std::mem::replace(&mut self.has_point, false);
        self.knows_step &= !fresh;
        let differs = |range: std::ops::Range<usize>, own: &Self| {
            fresh || own.point[range.clone()].iter().zip(&own.wanted[range]).any(|(a, b)| a.to_bits() != b.to_bits())
        };
        if differs(0..1, self) {
            self.knows_step = false;
            self.unit.set_time(self.wanted[0])?;
        }
        if inputs > 0 && differs(1..1 + inputs, self) {
            set(&mut *self.unit, &self.setup.inputs, &self.wanted[1..1 + inputs])?;
        }
        if self.setup.states > 0 && differs(1 + inputs..self.wanted.len(), self) {
            self.knows_step = false;
            self.unit.set_states(&self.wanted[1 + inputs..])?;
        }
        self.point.copy_from_slice(&self.wanted);
        self.has_point = true;
        Ok(())
    }

    /// Rates and, where `all` is wanted, what is watched, at the point where the unit stands.
    pub(crate) fn watch(&mut self, all: bool) -> Result<(), Halt> {
        if !self.rates.is_empty() {
            self.unit.rates(&mut self.rates)?;
        }
        match all {
            true => get(&mut *self.unit, &self.setup.watched, &mut self.watched),
            false => Ok(()),
        }
    }

    /// Entries of the Jacobian, some columns at a time; `all`: those of what is watched, too.
    fn jacobian(&mut self, all: bool) -> Result<(), Halt> {
        self.go_to_wanted()?;
        let colours = self.setup.colours.count() as u32;
        if self.setup.directional {
            for colour in 0..colours {
                for (seed, own) in self.seed.iter_mut().zip(&self.setup.colours.of_column) {
                    *seed = f64::from(u8::from(*own == colour));
                }
                self.unit.directional((&self.unknown, &self.known), &self.seed, &mut self.other)?;
                self.keep_column_of(colour, |other, row, _| other[row]);
            }
            return Ok(());
        }
        self.watch(all)?;
        let (rates, watched) = (std::mem::take(&mut self.rates), std::mem::take(&mut self.watched));
        let at = [rates.as_slice(), &watched].concat();
        (self.rates, self.watched) = (rates, watched);
        for colour in 0..colours {
            for (column, own) in self.setup.colours.of_column.iter().enumerate() {
                let (place, size) = self.columns[column];
                let size = self.nominals.get(column).copied().unwrap_or(size);
                let value = self.wanted[place];
                // What is added in truth, after rounding.
                let away = STEP * value.abs().max(size);
                self.seed[column] = if *own == colour { (value + away) - value } else { 0.0 };
            }
            for (&(place, _), step) in self.columns.iter().zip(&self.seed) {
                self.wanted[place] += step;
            }
            let found = self.go_to_wanted().and_then(|()| self.watch(all));
            for (&(place, _), step) in self.columns.iter().zip(&self.seed) {
                self.wanted[place] -= step;
            }
            found?;
            let (rates, watched) = self.other.split_at_mut(self.rates.len());
            rates.copy_from_slice(&self.rates);
            watched.copy_from_slice(&self.watched);
            self.keep_column_of(colour, |other, row, step| (other[row] - at[row]) / step);
        }
        Ok(())
    }

    /// Entries of the columns of one colour.
    fn keep_column_of(&mut self, colour: u32, value: impl Fn(&[f64], usize, f64) -> f64) {
        let columns = self.setup.colours.of_column.iter().enumerate().filter(|(_, own)| **own == colour);
        for (column, _) in columns {
            for k in self.setup.colours.column(column) {
                self.entries[k] = value(&self.other, self.setup.colours.rows[k] as usize, self.seed[column]);
            }
        }
    }

    /// Ends and frees all instances.
    pub(crate) fn end(&mut self) {
        self.end_twins();
        self.end_instance();
    }

    /// Ends and frees the instance, if there is one.
    fn end_instance(&mut self) {
        if std::mem::replace(&mut self.is_running, false) {
            // What a unit says to this changes nothing any more.
            let _ = self.unit.terminate();
        }
        if std::mem::replace(&mut self.is_instantiated, false) {
            self.unit.free();
        }
        self.has_point = false;
        let _ = messages();
    }
}

fn get(unit: &mut dyn Foreign, groups: &[Group], values: &mut [f64]) -> Result<(), Halt> {
    let mut begin = 0;
    for group in groups {
        unit.get(group.number, &group.references, &mut values[begin..begin + group.values])?;
        begin += group.values;
    }
    Ok(())
}

fn set(unit: &mut dyn Foreign, groups: &[Group], values: &[f64]) -> Result<(), Halt> {
    let mut begin = 0;
    for group in groups {
        unit.set(group.number, &group.references, &values[begin..begin + group.values])?;
        begin += group.values;
    }
    Ok(())
}

/// Where the columns of the Jacobian stand in a point, states first.
fn columns(setup: &Setup) -> Vec<(usize, f64)> {
    let inputs = values_of(&setup.inputs);
    let states = (0..setup.states).map(|k| (1 + inputs + k, 1.0));
    let inputs = (0..inputs).map(|k| (1 + k, 1.0));
    states.chain(inputs).take(setup.colours.of_column.len()).collect()
}

fn references(first: &[u32], groups: &[Group]) -> Vec<u32> {
    first.iter().chain(groups.iter().flat_map(|group| &group.references)).copied().collect()
}

pub(crate) fn nonsense() -> Halt {
    Halt::Failed("the request makes no sense".to_string())
}

/// The reason without the path, which is that of a folder nobody knows.
fn said_by_loader(error: &libloading::Error) -> String {
    let text = match std::error::Error::source(error) {
        Some(source) => source.to_string(),
        None => error.to_string(),
    };
    text.split_once(": ").map_or(text.clone(), |(path, reason)| match path.starts_with('/') {
        true => reason.to_string(),
        false => text.clone(),
    })
}

/// How a run begins.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Beginning {
    /// Start (s).
    pub(crate) start: f64,
    /// Stop (s), infinite where it is not known.
    pub(crate) stop: f64,
    /// Relative tolerance.
    pub(crate) tolerance: f64,
    /// What is set before.
    pub(crate) values: Vec<(Group, Vec<f64>)>,
    /// Texts that are set before.
    pub(crate) texts: Vec<(u32, CString)>,
    /// Values of the continuous, then of the discrete inputs.
    pub(crate) inputs: Vec<f64>,
}

impl Beginning {
    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        writer.reals(&[self.start, self.stop, self.tolerance]);
        writer.number(self.values.len() as u64);
        for (group, values) in &self.values {
            group.write(writer);
            writer.reals(values);
        }
        writer.number(self.texts.len() as u64);
        for (reference, text) in &self.texts {
            writer.number(u64::from(*reference));
            writer.text(&text.to_string_lossy());
        }
        writer.number(self.inputs.len() as u64);
        writer.reals(&self.inputs);
    }

    fn read(reader: &mut Reader<'_>) -> Option<Self> {
        let [start, stop, tolerance] = std::array::from_fn(|_| reader.real());
        let mut values = Vec::new();
        for _ in 0..reader.count() {
            let group = Group::read(reader)?;
            let mut own = vec![0.0; group.values];
            reader.reals(&mut own);
            values.push((group, own));
        }
        let mut texts = Vec::new();
        for _ in 0..reader.count() {
            let reference = u32::try_from(reader.number()).ok()?;
            texts.push((reference, c_text(&reader.text())));
        }
        let mut inputs = vec![0.0; reader.count()];
        reader.reals(&mut inputs);
        reader.fits().then_some(Self { start, stop, tolerance, values, texts, inputs })
    }
}

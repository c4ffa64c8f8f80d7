//! Further instances of a unit in the process of its first one, each started with a parameter a small step away.
//!
//! They are evaluated where the first one is, or where a derivative says that the solution of their parameters is, and go through the same
//! events; differences between their answers and those of a *likeness*, which is a further instance with the parameters of the first one, are
//! derivatives.  The likeness and its twins come behind the first one: they are asked about times which that has left, and hear of a step
//! where nobody asks for anything before it any more.

use crate::channel::{Reader, Writer};
use crate::exchange::Exchange;
use crate::foreign::Halt;
use crate::host::Refusal;
use crate::protocol::{Group, Operation, Setup, Update};
use crate::session::{Beginning, Session, nonsense};

/// The number of the twin that has the parameters of the first instance.
pub(crate) const LIKENESS: u32 = 0;
/// Instances that a process may hold.
const MOST: usize = 4096;
/// Words of an answer or a request for several twins beside their points and values.
const HEAD: usize = 8;

/// The twins in the process of a unit.
#[derive(Default)]
pub(crate) struct Twins {
    list: Vec<Session>,
    /// Calls that have been read: twin, and whether a step has come to its point; their points.
    calls: Vec<(usize, bool)>,
    points: Vec<f64>,
}

impl Session {
    /// One operation of one twin, which is made where there is none yet.
    pub(crate) fn ask_twin(&mut self, request: &mut Reader<'_>, answer: &mut Writer<'_>) -> Result<(), Halt> {
        use Operation::{Event, Indicators, Jacobian, Outputs, Rates, Slopes, Start, Watch};
        let number = usize::try_from(request.number()).unwrap_or(MOST);
        let operation = Operation::of(request.number()).ok_or_else(nonsense)?;
        let is_known = matches!(operation, Start | Rates | Jacobian | Slopes | Indicators | Outputs | Event | Watch);
        if number >= MOST || !is_known {
            return Err(nonsense());
        }
        while operation == Start && self.twins.list.len() <= number {
            let name = format!("{} {}", self.setup.name, self.twins.list.len() + 2);
            self.twins.list.push(Session::load(Setup { name, warns: false, ..self.setup.clone() })?);
        }
        let twin = self.twins.list.get_mut(number).ok_or_else(nonsense)?;
        if operation != Start && !twin.is_running {
            return Err(nonsense());
        }
        twin.perform(operation, request, answer)
    }

    /// Rates and what is watched of several twins, each at a point of its own.
    pub(crate) fn ask_twins(&mut self, request: &mut Reader<'_>, answer: &mut Writer<'_>) -> Result<(), Halt> {
        let Twins { list, calls, points } = &mut self.twins;
        let (rates_will_do, count, length) = (request.number() != 0, request.count(), self.wanted.len());
        calls.clear();
        points.resize(count * length, 0.0);
        for point in points.chunks_exact_mut(length) {
            let (twin, completed) = (usize::try_from(request.number()).unwrap_or(MOST), request.number() != 0);
            request.reals(point);
            calls.push((twin, completed));
        }
        for (&(twin, completed), point) in calls.iter().zip(points.chunks_exact(length)) {
            let twin = list.get_mut(twin).filter(|twin| twin.is_running).ok_or_else(nonsense)?;
            twin.wanted.copy_from_slice(point);
            twin.go_to_wanted()?;
            twin.watch(!rates_will_do)?;
            let mut asked = (false, false);
            if completed && twin.setup.completed && !twin.knows_step {
                asked = twin.unit.completed()?;
                twin.knows_step = true;
            }
            answer.reals(&twin.rates);
            if !rates_will_do {
                answer.reals(&twin.watched);
            }
            answer.number(u64::from(asked.0));
            answer.number(u64::from(asked.1));
        }
        Ok(())
    }

    /// Ends and frees all twins.
    pub(crate) fn end_twins(&mut self) {
        self.twins.list.iter_mut().for_each(Session::end);
    }
}

/// What the side of the solver keeps of twins.
pub(crate) struct TwinHost {
    /// The unit may have several instances in a process, and none of them has cost it.
    are_possible: bool,
    /// The likeness has been started in this run.
    is_alike: bool,
    /// All questions about points go to the likeness.
    are_asked: bool,
    /// Up to here (s) the unit has been told of steps.
    pub(crate) completed_to: f64,
    /// How the run of the first one began.
    beginning: Beginning,
}

impl TwinHost {
    pub(crate) fn new(are_possible: bool) -> Self {
        Self {
            are_possible,
            is_alike: false,
            are_asked: false,
            completed_to: f64::NEG_INFINITY,
            beginning: Beginning::default(),
        }
    }

    /// A run of the first one begins.
    pub(crate) fn begin(&mut self, beginning: &Beginning) {
        self.beginning.clone_from(beginning);
        (self.is_alike, self.are_asked, self.completed_to) = (false, false, f64::NEG_INFINITY);
    }

    /// No twins from now on where they have cost the process.
    fn judge(&mut self, refusal: &Refusal) {
        self.are_possible &= *refusal != Refusal::Lost;
    }

    /// The likeness answers a question about a time (s).
    pub(crate) fn answers(&self, operation: Operation, t: f64) -> bool {
        use Operation::{Indicators, Jacobian, Outputs, Rates, Slopes, Watch};
        let is_point = matches!(operation, Rates | Jacobian | Slopes | Indicators | Outputs | Watch);
        self.is_alike && is_point && (self.are_asked || t < self.completed_to)
    }
}

/// What a twin begins with that the first one does not: parameters and start values, by their positions.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Apart {
    pub(crate) parameters: Vec<(usize, f64)>,
    pub(crate) starts: Vec<(usize, f64)>,
}

/// A question to a twin at a time (s).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Call {
    pub(crate) twin: u32,
    /// A step has come there, and nobody asks for anything before it any more.
    pub(crate) completed: bool,
    pub(crate) t: f64,
}

/// Values of all inputs, and states.
pub(crate) type Values<'a> = (&'a [f64], &'a [f64]);

impl Exchange {
    /// The unit may have twins.
    pub(crate) fn may_have_twins(&self) -> bool {
        self.twins.are_possible
    }

    /// Asks the likeness about all points from now on, or again about those that the unit has left behind.
    pub(crate) fn ask_likeness(&mut self, always: bool) {
        self.twins.are_asked = always;
    }

    /// Asks the first one, whatever the time.
    pub(crate) fn first_one<T>(&mut self, ask: impl FnOnce(&mut Self) -> T) -> T {
        let is_alike = std::mem::replace(&mut self.twins.is_alike, false);
        let answer = ask(self);
        self.twins.is_alike = is_alike;
        answer
    }

    /// The value of a parameter of the unit after its start, and its limits and nominal value; none for anything but a real number of
    /// eight bytes.
    pub(crate) fn parameter_of(&self, index: usize) -> Option<(f64, (f64, f64), f64)> {
        let setting = &self.driver.layout.settings[self.driver.layout.setting_of.get(index).copied().flatten()?];
        let variable = &self.driver.description.variables[setting.variable];
        let is_wide = setting.number == crate::description::Number::Float64;
        is_wide.then_some((
            self.driver.parameters[index],
            (variable.min, variable.max),
            variable.nominal.unwrap_or(1.0),
        ))
    }

    /// Starts a twin as the first one was started, but for what is apart, with these values of all inputs.  The states after the start come
    /// into `states`, signs of event indicators into `held`.
    pub(crate) fn start_twin(
        &mut self,
        twin: u32,
        (apart, inputs): (&Apart, &[f64]),
        (states, held): (&mut [f64], &mut [bool]),
    ) -> Result<Update, Refusal> {
        let mut beginning = self.twins.beginning.clone();
        beginning.inputs.clone_from_slice(inputs);
        for &(index, value) in &apart.parameters {
            let layout = &self.driver.layout;
            let Some(setting) = layout.setting_of[index].map(|own| &layout.settings[own]) else { continue };
            let reference = self.driver.description.variables[setting.variable].reference;
            let at = index - setting.first;
            let known = beginning.values.iter_mut().find(|(group, _)| group.references == [reference]);
            if let Some((_, values)) = known {
                values[at] = value;
            } else {
                let mut values = self.driver.parameters[setting.first..setting.first + setting.count].to_vec();
                values[at] = value;
                let group = Group { number: setting.number, references: vec![reference], values: setting.count };
                beginning.values.push((group, values));
            }
        }
        for &(position, value) in &apart.starts {
            let Some(group) = self.driver.start_group(position).cloned() else { continue };
            match beginning.values.iter_mut().find(|(own, _)| own.references == group.references) {
                Some((_, values)) => values[0] = value,
                None => beginning.values.push((group, vec![value])),
            }
        }
        let asked = self.driver.remote.ask(Operation::Twin, |writer| {
            writer.number(u64::from(twin));
            writer.number(Operation::Start as u64);
            beginning.write(writer);
        });
        let update = asked.map(|mut reader| read_update(&mut reader, states, held));
        self.twins.is_alike |= update.is_ok() && twin == LIKENESS;
        update.inspect_err(|refusal| self.twins.judge(refusal))
    }

    /// Rates and what is watched of several twins, for each call one block of inputs and states, and one block of what is found, which has
    /// room for the rates alone where they will do.  True if one wants an event or the end.
    pub(crate) fn watch_twins(
        &mut self,
        calls: &[Call],
        (inputs, states): Values<'_>,
        found: &mut [f64],
    ) -> Result<bool, Refusal> {
        let count = calls.len().max(1);
        let (sites, own, values) = (inputs.len() / count, states.len() / count, found.len() / count);
        let continuous = self.driver.continuous;
        let most = (3 + continuous + own).max(values + 2);
        let fit = (self.driver.remote.room().saturating_sub(HEAD) / most).max(1);
        let mut is_asked = false;
        for first in (0..calls.len()).step_by(fit) {
            let part = first..(first + fit).min(calls.len());
            let asked = self.driver.remote.ask(Operation::Twins, |writer: &mut Writer<'_>| {
                writer.number(u64::from(values == own));
                writer.number(part.len() as u64);
                for k in part.clone() {
                    writer.number(u64::from(calls[k].twin));
                    writer.number(u64::from(calls[k].completed));
                    writer.real(calls[k].t);
                    writer.reals(&inputs[k * sites..k * sites + continuous]);
                    writer.reals(&states[k * own..(k + 1) * own]);
                }
            });
            let done = asked.map(|mut reader| {
                for k in part {
                    reader.reals(&mut found[k * values..(k + 1) * values]);
                    is_asked |= reader.number() != 0;
                    is_asked |= reader.number() != 0;
                }
            });
            done.inspect_err(|refusal| self.twins.judge(refusal))?;
        }
        Ok(is_asked)
    }

    /// An event of a twin; what has become of its states comes into `states`, signs of event indicators into `held`.
    pub(crate) fn twin_event(
        &mut self,
        call: Call,
        (inputs, at): Values<'_>,
        (states, held): (&mut [f64], &mut [bool]),
    ) -> Result<Update, Refusal> {
        let continuous = self.driver.continuous;
        let asked = self.driver.remote.ask(Operation::Twin, |writer| {
            head(writer, call, Operation::Event);
            writer.reals(&inputs[..continuous]);
            writer.reals(at);
            writer.reals(&inputs[continuous..]);
        });
        let update = asked.map(|mut reader| read_update(&mut reader, states, held));
        update.inspect_err(|refusal| self.twins.judge(refusal))
    }

    /// Event indicators of a twin.
    pub(crate) fn twin_indicators(
        &mut self,
        call: Call,
        (inputs, at): Values<'_>,
        out: &mut [f64],
    ) -> Result<(), Refusal> {
        if out.is_empty() {
            return Ok(());
        }
        let continuous = self.driver.continuous;
        let asked = self.driver.remote.ask(Operation::Twin, |writer| {
            head(writer, call, Operation::Indicators);
            writer.reals(&inputs[..continuous]);
            writer.reals(at);
        });
        let done = asked.map(|mut reader| reader.reals(out));
        done.inspect_err(|refusal| self.twins.judge(refusal))
    }
}

/// Begins an operation of a twin at a time.
fn head(writer: &mut Writer<'_>, call: Call, operation: Operation) {
    writer.number(u64::from(call.twin));
    writer.number(operation as u64);
    writer.real(call.t);
}

/// What an update gives: it, the states, and the signs of event indicators.
fn read_update(reader: &mut Reader<'_>, states: &mut [f64], held: &mut [bool]) -> Update {
    let mut update =
        Update { states_changed: reader.number() != 0, terminate: reader.number() != 0, next: reader.real() };
    if update.next.is_nan() {
        update.next = f64::INFINITY;
    }
    reader.reals(states);
    // Nominal values are those of the first one.
    for _ in 0..states.len() {
        reader.real();
    }
    held.iter_mut().for_each(|held| *held = reader.real() > 0.0);
    update
}

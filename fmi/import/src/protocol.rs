//! What the two processes say to each other: operations, and the setup that both keep.
//!
//! All later requests are numbers in an order that follows from the setup.  A point is the time, then the continuous inputs, then the
//! states.

use crate::channel::{Reader, Writer};
use crate::colours::Colours;
use crate::description::{Number, Version};

/// What is asked for; the comments say what the request and the answer hold.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Operation {
    /// Setup; nothing.
    Load = 1,
    /// Beginning; what an update gives.
    Start = 2,
    /// Point; rates.
    Rates = 3,
    /// Point; entries of the Jacobian: of the rates, then of what is watched, by the states, then by the continuous inputs.
    Jacobian = 4,
    /// Point; event indicators.
    Indicators = 5,
    /// Point; values of the outputs.
    Outputs = 6,
    /// Point and discrete inputs; what an update gives.
    Event = 7,
    /// Point; an event is wanted, the end is wanted.
    Completed = 8,
    /// Time, step, all inputs and slopes; how the step ended.
    Step = 9,
    /// Nothing; values of the parameters.
    Parameters = 10,
    /// Nothing; nothing, and the process ends.
    End = 11,
    /// Point; rates, then values of what is watched.
    Watch = 12,
    /// Number of a twin, an operation and its request; its answer.
    Twin = 13,
    /// Whether rates will do, number of calls, and for each that of a twin, whether a step has come to its point, and the point; for each
    /// rates and, if they will not do, what is watched; an event is wanted, the end is wanted.
    Twins = 14,
    /// Point; entries of the Jacobian, where those of what is watched may have any value.
    Slopes = 15,
    /// Nothing; how many messages, and each of them.
    Said = 16,
}

impl Operation {
    pub(crate) fn of(number: u64) -> Option<Self> {
        use Operation::{
            Completed, End, Event, Indicators, Jacobian, Load, Outputs, Parameters, Rates, Said, Slopes, Start, Step,
            Twin, Twins, Watch,
        };
        let all = [
            Load, Start, Rates, Jacobian, Indicators, Outputs, Event, Completed, Step, Parameters, End, Watch, Twin,
            Twins, Slopes, Said,
        ];
        all.into_iter().find(|operation| *operation as u64 == number)
    }
}

/// How an operation ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Status {
    /// The answer follows.
    Done = 0,
    /// The unit has no value there; a text follows.
    Discarded = 1,
    /// The unit cannot go on; a text follows.
    Failed = 2,
}

/// Variables of one type, read or written by one call.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Group {
    pub(crate) number: Number,
    pub(crate) references: Vec<u32>,
    /// Values in all.
    pub(crate) values: usize,
}

/// Everything that stays as it is while a unit is used.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Setup {
    pub(crate) version: Version,
    /// Model exchange; otherwise co-simulation.
    pub(crate) exchange: bool,
    pub(crate) library: String,
    pub(crate) resources: String,
    pub(crate) token: String,
    pub(crate) name: String,
    pub(crate) states: usize,
    pub(crate) indicators: usize,
    /// The unit must be told of every step.
    pub(crate) completed: bool,
    /// The unit is asked for its warnings.
    pub(crate) warns: bool,
    /// Inputs of co-simulation come with slopes.
    pub(crate) slopes: bool,
    /// The unit has directional derivatives.
    pub(crate) directional: bool,
    pub(crate) state_references: Vec<u32>,
    pub(crate) rate_references: Vec<u32>,
    pub(crate) outputs: Vec<Group>,
    pub(crate) parameters: Vec<Group>,
    pub(crate) inputs: Vec<Group>,
    pub(crate) discrete: Vec<Group>,
    /// Variables that others read at every point, where the unit is a part of a larger system.
    pub(crate) watched: Vec<Group>,
    pub(crate) colours: Colours,
}

const NUMBERS: [Number; 11] = [
    Number::Float32,
    Number::Float64,
    Number::Int8,
    Number::UInt8,
    Number::Int16,
    Number::UInt16,
    Number::Int32,
    Number::UInt32,
    Number::Int64,
    Number::UInt64,
    Number::Boolean,
];

impl Group {
    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        let number = NUMBERS.iter().position(|number| *number == self.number).unwrap_or_default();
        writer.number(number as u64);
        writer.number(self.values as u64);
        write_list(writer, &self.references);
    }

    pub(crate) fn read(reader: &mut Reader<'_>) -> Option<Self> {
        let number = *NUMBERS.get(usize::try_from(reader.number()).ok()?)?;
        let values = reader.count();
        Some(Self { number, values, references: read_list(reader)? })
    }

    fn words(&self) -> usize {
        3 + self.references.len()
    }
}

/// Number of values of several groups.
pub(crate) fn values_of(groups: &[Group]) -> usize {
    groups.iter().map(|group| group.values).sum()
}

fn write_list(writer: &mut Writer<'_>, list: &[u32]) {
    writer.number(list.len() as u64);
    list.iter().for_each(|&value| writer.number(u64::from(value)));
}

fn read_list(reader: &mut Reader<'_>) -> Option<Vec<u32>> {
    let count = reader.count();
    (0..count).map(|_| u32::try_from(reader.number()).ok()).collect()
}

impl Setup {
    /// Groups in the order in which they are written.
    fn groups(&self) -> [&Vec<Group>; 5] {
        [&self.outputs, &self.parameters, &self.inputs, &self.discrete, &self.watched]
    }

    /// Words that any request or answer of this setup needs, but for what is set at the start.
    pub(crate) fn words(&self) -> usize {
        let text = |text: &str| 1 + text.len().div_ceil(8);
        let texts = text(&self.library) + text(&self.resources) + text(&self.token) + text(&self.name);
        let lists = self.groups().map(|groups| 1 + groups.iter().map(Group::words).sum::<usize>());
        let setup = 16
            + texts
            + lists.iter().sum::<usize>()
            + self.state_references.len()
            + self.rate_references.len()
            + self.colours.words();
        let point = 3 + 3 * values_of(&self.inputs) + values_of(&self.discrete) + self.states;
        let answers = values_of(&self.outputs)
            .max(values_of(&self.parameters))
            .max(2 * self.states + self.indicators)
            .max(self.states + values_of(&self.watched))
            .max(self.colours.entries());
        setup.max(point).max(8 + answers)
    }

    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        writer.number(if self.version == Version::Two { 2 } else { 3 });
        for flag in [self.exchange, self.completed, self.warns, self.slopes, self.directional] {
            writer.number(u64::from(flag));
        }
        for text in [&self.library, &self.resources, &self.token, &self.name] {
            writer.text(text);
        }
        writer.number(self.states as u64);
        writer.number(self.indicators as u64);
        write_list(writer, &self.state_references);
        write_list(writer, &self.rate_references);
        for groups in self.groups() {
            writer.number(groups.len() as u64);
            groups.iter().for_each(|group| group.write(writer));
        }
        writer.number(self.colours.of_column.len() as u64);
        self.colours.of_column.iter().for_each(|&colour| writer.number(u64::from(colour)));
        self.colours.starts.iter().for_each(|&start| writer.number(u64::from(start)));
        write_list(writer, &self.colours.rows);
    }

    pub(crate) fn read(reader: &mut Reader<'_>) -> Option<Self> {
        let version = match reader.number() {
            2 => Version::Two,
            3 => Version::Three,
            _ => return None,
        };
        let [exchange, completed, warns, slopes, directional] = std::array::from_fn(|_| reader.number() != 0);
        let [library, resources, token, name] = std::array::from_fn(|_| reader.text());
        let (states, indicators) = (reader.count(), reader.count());
        let (state_references, rate_references) = (read_list(reader)?, read_list(reader)?);
        let mut lists = [const { Vec::new() }; 5];
        for list in &mut lists {
            for _ in 0..reader.count() {
                list.push(Group::read(reader)?);
            }
        }
        let [outputs, parameters, inputs, discrete, watched] = lists;
        let columns = reader.count();
        let small = |reader: &mut Reader<'_>| u32::try_from(reader.number()).ok();
        let of_column: Vec<u32> = (0..columns).map(|_| small(reader)).collect::<Option<_>>()?;
        let starts: Vec<u32> = (0..=columns).map(|_| small(reader)).collect::<Option<_>>()?;
        let colours = Colours { of_column, starts, rows: read_list(reader)? };
        // By the states alone where nothing is watched.
        let rows = states + values_of(&watched);
        let is_whole = columns == states || columns == states + values_of(&inputs);
        let whole = reader.fits() && is_whole && colours.is_sound(rows);
        whole.then_some(Self {
            version,
            exchange,
            library,
            resources,
            token,
            name,
            states,
            indicators,
            completed,
            warns,
            slopes,
            directional,
            state_references,
            rate_references,
            outputs,
            parameters,
            inputs,
            discrete,
            watched,
            colours,
        })
    }
}

/// What an update of discrete states brings.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Update {
    /// The unit has written into its states.
    pub(crate) states_changed: bool,
    /// The unit wants the run to end.
    pub(crate) terminate: bool,
    /// The next time event (s); infinite if there is none.
    pub(crate) next: f64,
}

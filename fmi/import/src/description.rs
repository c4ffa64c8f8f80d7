//! What a unit says of itself, as data: the same types for both versions of the interface.
//!
//! Source: Functional Mock-up Interface 2.0.4, sections 2.2, 3.3 and 4.3; 3.0.2, sections 2.4, 3.3 and 4.3.  Attributes that are not
//! there have the values that the standard gives them.

use std::sync::Arc;

use crate::fault::Fault;
use crate::xml::{self, Element};
use crate::{structure, types, variables};

/// Versions of the interface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Version {
    /// 2.0
    Two,
    /// 3.0
    Three,
}

/// What a variable is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Causality {
    /// Set from outside before the start.
    Parameter,
    /// A parameter that decides sizes.
    Structural,
    /// Follows from parameters.
    Calculated,
    /// Comes from outside during the run.
    Input,
    /// For others.
    Output,
    /// For the unit itself.
    Local,
    /// Time.
    Independent,
}

/// When a variable changes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Changes {
    /// Never.
    Constant,
    /// Not after the start.
    Fixed,
    /// Between events, from outside.
    Tunable,
    /// At events.
    Discrete,
    /// Always.
    Continuous,
}

/// What a start value is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Initial {
    /// The value at the start.
    Exact,
    /// A guess.
    Approx,
    /// There is none: the unit finds the value.
    Calculated,
}

/// Types with values that are numbers.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Number {
    /// Of 4 bytes.
    Float32,
    /// Of 8 bytes; `Real` in 2.0.
    Float64,
    /// Integers.
    Int8,
    /// Integers.
    UInt8,
    /// Integers.
    Int16,
    /// Integers.
    UInt16,
    /// Integers; `Integer` in 2.0.
    Int32,
    /// Integers.
    UInt32,
    /// Integers.
    Int64,
    /// Integers.
    UInt64,
    /// 0 or 1.
    Boolean,
}

/// The type of a variable.
#[derive(Clone, PartialEq, Debug)]
pub enum Kind {
    /// A number.
    Number(Number),
    /// A literal of an enumeration: names with their values.
    Enumeration(Arc<[(Arc<str>, i64)]>),
    /// A text.
    Text,
    /// Bytes.
    Binary,
    /// A clock.
    Clock,
}

/// A variable, or an array of them.
#[derive(Clone, PartialEq, Debug)]
pub struct Variable {
    /// Its name.
    pub name: Arc<str>,
    /// The number that the unit knows it by; aliases share it.
    pub reference: u32,
    /// What it is, in words.
    pub description: Arc<str>,
    /// What it is for.
    pub causality: Causality,
    /// When it changes.
    pub changes: Changes,
    /// What its start value is.
    pub initial: Initial,
    /// Its type.
    pub kind: Kind,
    /// Sizes of an array; none of a single value.
    pub sizes: Vec<u32>,
    /// Unit, `""` if there is none.
    pub unit: Arc<str>,
    /// Unit for display, `""` if there is none.
    pub display_unit: Arc<str>,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Size that errors are measured against, if it is stated.
    pub nominal: Option<f64>,
    /// Start values, one per element; empty if there are none.
    pub start: Vec<f64>,
    /// Start value of a text.
    pub text: Option<String>,
    /// The variable that it is the derivative of: position in the list.
    pub derivative_of: Option<usize>,
    /// Line of the description.
    pub line: u32,
}

impl Variable {
    /// Number of elements.
    pub fn count(&self) -> usize {
        self.sizes.iter().map(|&size| size as usize).product()
    }

    /// The type of its numbers as the unit hands them over; none where they are not numbers.
    pub fn number(&self, version: Version) -> Option<Number> {
        match (&self.kind, version) {
            (Kind::Number(number), _) => Some(*number),
            (Kind::Enumeration(_), Version::Two) => Some(Number::Int32),
            (Kind::Enumeration(_), Version::Three) => Some(Number::Int64),
            _ => None,
        }
    }
}

/// What a unit can do in one of the two kinds of use.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Interface {
    /// The name of its library.
    pub identifier: String,
    /// It only drives another program, which must be there.
    pub needs_tool: bool,
    /// It has directional derivatives.
    pub directional: bool,
    /// It must be told of every step.
    pub needs_completed_steps: bool,
    /// One process can hold one instance of it only.
    pub once: bool,
    /// Steps of co-simulation may differ in length.
    pub variable_step: bool,
    /// It interpolates inputs by their slopes.
    pub interpolates: bool,
}

/// Times and tolerance of a run as the unit proposes them.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Experiment {
    /// Start (s).
    pub start: Option<f64>,
    /// Stop (s).
    pub stop: Option<f64>,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
    /// Step of co-simulation, or interval of output (s).
    pub step: Option<f64>,
}

/// A state with its derivative: positions in the list of variables.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct State {
    /// The state.
    pub state: usize,
    /// Its derivative.
    pub rate: usize,
    /// Variables that the derivative depends on; none: perhaps on all.
    pub depends: Option<Vec<usize>>,
}

/// A connector that the unit describes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Terminal {
    /// Its name.
    pub name: String,
    /// What kind of connector it is, by the words of the tool that made it.
    pub kind: String,
    /// How it is to be matched with others: `plug`, `bus`, `sequence`, or `none` where that is not intended.
    pub rule: String,
    /// Its variables.
    pub members: Vec<Member>,
}

/// A variable of a connector.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Member {
    /// Name of the variable.
    pub variable: String,
    /// Its name in the connector; empty where the connector is nothing else.
    pub name: String,
    /// What it is there: `signal`, `inflow`, `outflow`, or a word of the tool that made the unit.
    pub kind: String,
}

/// What a unit says of itself.
#[derive(Clone, PartialEq, Debug)]
pub struct Description {
    /// Version of the interface.
    pub version: Version,
    /// Name of the model.
    pub model: Arc<str>,
    /// What it is, in words.
    pub description: String,
    /// The program that made it.
    pub tool: String,
    /// What the library knows the unit by.
    pub token: String,
    /// Model exchange.
    pub exchange: Option<Interface>,
    /// Co-simulation.
    pub stepping: Option<Interface>,
    /// Proposed times and tolerance.
    pub experiment: Experiment,
    /// All variables; an alias is one of its own.
    pub variables: Vec<Variable>,
    /// Continuous states in the order of the unit; an array is one of them.
    pub states: Vec<State>,
    /// Outputs: positions in the list of variables.
    pub outputs: Vec<usize>,
    /// Number of event indicators.
    pub indicators: usize,
    /// Its messages have a category for warnings.
    pub warns: bool,
    /// Connectors.
    pub terminals: Vec<Terminal>,
}

impl Description {
    /// Number of continuous states.
    pub fn state_count(&self) -> usize {
        self.states.iter().map(|state| self.variables[state.state].count()).sum()
    }

    /// True for a state whose start value can be set before a run.
    pub fn is_start_free(&self, variable: &Variable) -> bool {
        let is_state = self.states.iter().any(|own| self.variables[own.state].name == variable.name);
        let is_open = matches!(variable.causality, Causality::Local | Causality::Output);
        let is_stated = variable.initial == Initial::Exact && variable.start.len() == 1 && variable.sizes.is_empty();
        is_state && is_open && is_stated
    }

    /// Reads `modelDescription.xml`.
    ///
    /// # Errors
    /// What is wrong, with its line.
    pub fn read(bytes: &[u8]) -> Result<Self, Fault> {
        const PLACE: &str = "modelDescription.xml";
        let document = xml::read(xml::text(bytes, PLACE)?, PLACE)?;
        let root = Element::root(&document, PLACE);
        if root.name() != "fmiModelDescription" {
            return Err(root.fault(format!("it begins with `{}` and not with `fmiModelDescription`", root.name())));
        }
        let version = version(root)?;
        let token = root.required(if version == Version::Two { "guid" } else { "instantiationToken" })?;
        let types = types::read(root, version)?;
        let variables = variables::read(root, version, &types)?;
        let structure = structure::read(root, version, &variables)?;
        let (exchange, stepping) =
            (interface(root, version, "ModelExchange")?, interface(root, version, "CoSimulation")?);
        if exchange.is_none() && stepping.is_none() {
            let only = root.child("ScheduledExecution").map_or("", |_| " but only scheduled execution");
            return Err(root.fault(format!("the unit offers neither model exchange nor co-simulation{only}")));
        }
        Ok(Self {
            version,
            model: root.required("modelName")?.into(),
            description: root.attribute("description").unwrap_or_default().to_string(),
            tool: root.attribute("generationTool").unwrap_or_default().to_string(),
            token: token.to_string(),
            exchange,
            stepping,
            experiment: experiment(root)?,
            variables,
            states: structure.states,
            outputs: structure.outputs,
            indicators: structure.indicators,
            warns: root.child("LogCategories").is_some_and(|own| own.children().any(is_of_warnings)),
            terminals: Vec::new(),
        })
    }
}

/// Category of warnings, by its name in both versions.
pub(crate) const WARNINGS: &str = "logStatusWarning";

fn is_of_warnings(category: Element<'_>) -> bool {
    category.attribute("name") == Some(WARNINGS)
}

fn version(root: Element<'_>) -> Result<Version, Fault> {
    let text = root.required("fmiVersion")?;
    match text.trim() {
        "2.0" => Ok(Version::Two),
        // Versions with the same leading numbers are compatible; 3.0-beta is not one of them.
        three if three == "3.0" || three.starts_with("3.0.") => Ok(Version::Three),
        other => Err(root.fault(format!(
            "the unit is of version {} of the interface; versions 2.0 and 3.0 are read",
            xml::shortened(other)
        ))),
    }
}

fn interface(root: Element<'_>, version: Version, name: &str) -> Result<Option<Interface>, Fault> {
    let Some(own) = root.child(name) else { return Ok(None) };
    let identifier = own.required("modelIdentifier")?;
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if identifier.is_empty() || !identifier.chars().all(is_name) {
        return Err(
            own.fault(format!("`modelIdentifier` is `{}`, which is not a name in C", xml::shortened(identifier)))
        );
    }
    let two = version == Version::Two;
    let completed = match two {
        true => name == "ModelExchange" && !own.flag("completedIntegratorStepNotNeeded")?,
        false => own.flag("needsCompletedIntegratorStep")?,
    };
    Ok(Some(Interface {
        identifier: identifier.to_string(),
        needs_tool: own.flag("needsExecutionTool")?,
        directional: own.flag(if two { "providesDirectionalDerivative" } else { "providesDirectionalDerivatives" })?,
        needs_completed_steps: completed,
        once: own.flag("canBeInstantiatedOnlyOncePerProcess")?,
        variable_step: own.flag("canHandleVariableCommunicationStepSize")?,
        interpolates: two && own.flag("canInterpolateInputs")?,
    }))
}

fn experiment(root: Element<'_>) -> Result<Experiment, Fault> {
    let Some(own) = root.child("DefaultExperiment") else { return Ok(Experiment::default()) };
    let positive = |name: &str| Ok(own.number::<f64>(name)?.filter(|value| *value > 0.0 && value.is_finite()));
    let time = |name: &str| Ok(own.number::<f64>(name)?.filter(|value| value.is_finite()));
    Ok(Experiment {
        start: time("startTime")?,
        stop: time("stopTime")?,
        tolerance: positive("tolerance")?,
        step: positive("stepSize")?,
    })
}

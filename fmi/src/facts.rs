//! What the maker of a unit knows beside the payload.

use std::collections::BTreeMap;

use hyd_system::MemberKind;

/// Version of the interface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Version {
    /// 2.0
    Two,
    /// 3.0
    Three,
}

impl Version {
    /// As users write it.
    pub fn text(self) -> &'static str {
        match self {
            Version::Two => "2.0",
            Version::Three => "3.0",
        }
    }
}

/// An input or output of the model.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// Given from outside.
    Input,
    /// Meant for outside.
    Output,
}

/// Attributes of one element of a variable.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Bounds {
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// Usual size.
    pub nominal: Option<f64>,
    /// Start value of an input.
    pub start: Option<f64>,
}

/// What a unit string means: `SI value = factor * value + offset`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KnownUnit {
    /// Powers of kg, m, s, A, K, mol, cd; none where one is not whole.
    pub powers: Option<[i32; 7]>,
    /// Power of the plane angle.
    pub angle: i32,
    /// SI value of one.
    pub factor: f64,
    /// SI value of zero.
    pub offset: f64,
}

/// The type of a variable as its declaration names it.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct DeclaredType {
    /// Full name of the class; empty for the predefined types.
    pub name: String,
    /// What is measured; may be empty.
    pub quantity: String,
    /// Descriptions of the literals of an enumeration, empty where there are none.
    pub literals: Vec<String>,
}

/// A String, whose value was fixed when the unit was made.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Text {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: String,
    /// Description; may be empty.
    pub description: String,
}

/// A connector.
#[derive(Clone, PartialEq, Debug)]
pub struct Terminal {
    /// Its name.
    pub name: String,
    /// The class of connectors that it is of.
    pub class: String,
    /// Description; may be empty.
    pub description: String,
    /// It lies outside, and is not one of a component within.
    pub outside: bool,
    /// Its variables: variable and element of the tables, and what it is in the connector.
    pub members: Vec<((usize, usize), MemberKind)>,
}

/// What the payload does not say.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Which variables (indices into the tables) are inputs and outputs.
    pub ends: BTreeMap<usize, End>,
    /// Attributes by variable and element; what is not listed has none.
    pub bounds: BTreeMap<(usize, usize), Bounds>,
    /// Declared types of variables (indices into the tables); what is not listed has a predefined type.
    pub types: BTreeMap<usize, DeclaredType>,
    /// Unit strings of the tables that have a meaning.
    pub units: BTreeMap<String, KnownUnit>,
    /// Values of all parameters, as the tables address them.
    pub parameters: Vec<f64>,
    /// Strings, in the order of their numbers.
    pub texts: Vec<Text>,
    /// Connectors in the order of the text.
    pub terminals: Vec<Terminal>,
    /// The program that makes the unit.
    pub tool: String,
}

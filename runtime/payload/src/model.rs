//! A compiled model: code, places and tables, shared by all its instances.

use std::sync::Arc;

use hyd_system::{AssertionReport, CheckKind, DaeSystem, Structure, Tables, TextFormat, ValueKind, given};

use crate::mapping::Code;
use crate::names::{Name, Names, RowNames};
use crate::program::{Place, Program};
use crate::routines::{DataArea, Given, Routines, SitePlaces};
use crate::selection::CandidateSet;
use crate::tangent::TangentModel;

/// Everything that is needed to run a model; plain data.
#[derive(Clone, Debug)]
pub struct Model {
    /// Where it comes from.
    pub identity: Identity,
    /// When and how it runs if nobody says otherwise.
    pub experiment: Experiment,
    /// Machine code of the program, none where it is only interpreted.
    pub code: Option<Arc<Code>>,
    /// What the code was made from: for the interpreter, and to find what went wrong.
    pub program: Arc<Program>,
    /// What the routines do.
    pub routines: Arc<Routines>,
    /// The data area.
    pub area: DataArea,
    /// Sizes and patterns.
    pub structure: Structure,
    /// Names, units, places in the text.
    pub tables: Arc<Tables>,
    /// Order of the row of outputs.
    pub row: OutputRow,
    /// Nominal values of the unknowns.
    pub nominals: Vec<f64>,
    /// Unknowns whose errors decide about steps: all but derivatives of dependent variables.
    pub tested: Vec<bool>,
    /// Nominal values of the unknowns of the initial system.
    pub initial_nominals: Vec<f64>,
    /// Parameters as they can be set.
    pub parameters: Parameters,
    /// Assertions and terminations.
    pub checks: Vec<Check>,
    /// What the solution of the initial system becomes.
    pub initial: InitialTransfer,
    /// Names for messages.
    pub names: Names,
    /// Rows of the simulation and of the initial system.
    pub rows: [RowNames; 2],
    /// Candidates for states.
    pub candidates: Vec<CandidateSet>,
    /// Delay sites.
    pub delays: Vec<SitePlaces>,
    /// Derivatives along directions, if it was stored with them.
    pub tangents: Option<Arc<TangentModel>>,
}

impl Model {
    /// True if variables of a loop are computed one after the other, so that rounding errors could grow from one to the next.
    pub fn has_torn_loops(&self) -> bool {
        !(self.routines.simulation.closing_rows.is_empty() && self.routines.initial.closing_rows.is_empty())
    }

    /// True if start values of discrete variables wait for what is found at the start.
    pub fn has_late_starts(&self) -> bool {
        !self.program.routines[self.routines.late_starts].kernels.is_empty()
    }
}

/// Where a model comes from.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Identity {
    /// Version of the compiler.
    pub compiler: Arc<str>,
    /// A number that is another one, all but surely, when a text of the model is.
    pub sources: u64,
    /// What the model says of itself.
    pub description: Arc<str>,
    /// Different expressions among its equations.
    pub templates: u32,
}

/// When a model runs if nobody says otherwise.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Experiment {
    /// Start time in s.
    pub start: Option<f64>,
    /// Stop time in s.
    pub stop: Option<f64>,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
    /// Output interval in s.
    pub interval: Option<f64>,
}

/// Order of the row of outputs: assigned variables, unknowns, rates of states, discrete variables.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct OutputRow {
    /// Assigned variables come first, then the unknowns.
    pub assigned: u32,
    /// Number of unknowns.
    pub unknowns: u32,
    /// Unknowns whose rates follow.
    pub states: Vec<u32>,
    /// Number of discrete variables at the end.
    pub discrete: u32,
}

impl OutputRow {
    /// Length of the row.
    pub fn len(&self) -> usize {
        (self.assigned + self.unknowns + self.discrete) as usize + self.states.len()
    }

    /// Unknowns and rates in a row; rates of algebraic unknowns are 0.
    pub fn point(&self, row: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (assigned, n) = (self.assigned as usize, self.unknowns as usize);
        let y = row[assigned..assigned + n].to_vec();
        let mut yp = vec![0.0; n];
        for (&state, &rate) in self.states.iter().zip(&row[assigned + n..]) {
            yp[state as usize] = rate;
        }
        (y, yp)
    }

    /// True without outputs.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Parameters as they can be set.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Parameters {
    /// Type of each.
    pub kinds: Vec<ValueKind>,
    /// Those that no binding computes although they can be set: position in the data area.
    pub unbound: Vec<(u32, Given)>,
    /// Values that every instance begins with, by position among the parameters.
    pub preset: Vec<(u32, f64)>,
    /// Bounds of parameters and constants.
    pub limits: Vec<Limit>,
}

/// Bounds of a scalar.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limit {
    /// Index into `Tables::variables`.
    pub variable: u32,
    /// Element.
    pub element: u32,
    /// `min`, minus infinity if there is none.
    pub min: f64,
    /// `max`, infinity if there is none.
    pub max: f64,
}

/// The first parameter or constant whose value is outside its limits, as a sentence; the system has been bound.
pub fn outside_limits(limits: &[Limit], system: &dyn DaeSystem) -> Option<String> {
    let tables = system.tables();
    limits.iter().find_map(|limit| {
        let variable = tables.variables.get(limit.variable as usize)?;
        let source = variable.sources.get(limit.element as usize)?;
        let value = match source.place {
            hyd_system::Place::Parameter(k) => *system.parameters().get(k as usize)?,
            hyd_system::Place::Constant(value) => value,
            hyd_system::Place::Output(_) => return None,
        };
        let value = if source.negated { -value } else { value };
        let name = || variable.name.element(limit.element as usize);
        given::outside(name, &variable.kind, value, (limit.min, limit.max)).map(|outside| outside.message)
    })
}

/// An assertion or termination.
#[derive(Clone, PartialEq, Debug)]
pub struct Check {
    /// The message if it shows no values.
    pub message: Arc<str>,
    /// Pieces of the message if it shows values.
    pub pieces: Vec<MessagePiece>,
    /// Where the values that it shows begin in the results of `checks`, and their number.
    pub values: (u32, u32),
    /// Level error; else level warning.
    pub error: bool,
    /// What it is.
    pub kind: CheckKind,
    /// File name.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
}

/// A piece of a message.
#[derive(Clone, PartialEq, Debug)]
pub enum MessagePiece {
    /// Fixed text.
    Text(Arc<str>),
    /// A value of the run, written in this way.
    Value(TextFormat, ValueKind),
}

impl Check {
    /// The report of an assertion that fails.
    pub(crate) fn report(&self, out: &[f64]) -> AssertionReport {
        AssertionReport { message: self.text(out), error: self.error, file: self.file.clone(), line: self.line }
    }

    /// The message with the values that it shows; `out` holds the results of the routine `checks`.
    pub(crate) fn text(&self, out: &[f64]) -> String {
        if self.pieces.is_empty() {
            return self.message.to_string();
        }
        let mut values = out[self.values.0 as usize..].iter();
        let piece = |piece: &MessagePiece| match piece {
            MessagePiece::Text(text) => text.to_string(),
            MessagePiece::Value(format, kind) => {
                values.next().map_or_else(String::new, |&value| format.text(value, kind))
            }
        };
        self.pieces.iter().map(piece).collect()
    }
}

/// What the solution of the initial system becomes.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct InitialTransfer {
    /// Start value of each unknown of the initial system, none for derivatives (0).
    pub guess: Vec<Option<u32>>,
    /// Where each unknown `y` is found.
    pub states: Vec<Option<Place>>,
    /// Where each rate is found; algebraic unknowns have none.
    pub rates: Vec<Option<Place>>,
    /// Parameters and discrete variables that the initial system determines: from, to.
    pub values: Vec<(Place, u32)>,
    /// Discrete variables (positions among them) that follow from what is known before the initial system is solved.
    pub decided: Vec<u32>,
    /// The start value of a discrete Real waits for this solution.
    pub late_reals: bool,
    /// Conditions that follow from others, checked at the start.
    pub checked: Vec<Checked>,
    /// `homotopy` occurs in the initial system.
    pub homotopy: bool,
}

/// An initial condition whose sides must agree.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Checked {
    /// Index into `Tables::equations`.
    pub equation: u32,
    /// The equation as it is written.
    pub text: Arc<str>,
    /// The variable whose fixed start value this is.
    pub start_of: Option<Name>,
    /// The conditions that it follows from, in words; empty where it follows from the equations of the model alone, and none where that is not known.
    pub others: Option<Vec<Arc<str>>>,
}

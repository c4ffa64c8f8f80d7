//! Units as blocks of a model that is written as text: one system of both.
//!
//! The text is a [`DaeSystem`] in which what a unit computes stands as inputs that somebody gives values, and the unit's inputs as variables.
//! Unknowns are those of the text, `z`, then the states of the units, `x`, what the text reads of them, `y`, and what it gives them, `w`:
//!
//!     F(t, z, z'; y) = 0,   x' = f(t, x, w),   y = g(t, x, w),   w = h(t, z, z'; y)
//!
//! So neither side knows of the other, and a loop through both is solved like any other loop of equations.  Derivatives of `f` and `g` are
//! those of the unit (directional, or differences made in its process), those by `y` and of `h` are differences, because the text is
//! cheap to evaluate.  Relations of a unit are its event indicators; it has an event wherever the text has one, and again where what
//! it is given has jumped in that event.  A unit starts with what the text gives it at the start.  Derivatives by parameters stand in
//! `tangents`.

mod jacobian;
mod start;
mod system;
mod tangents;
mod twinned;
mod wiring;

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use hyd_system::{DaeSystem, Instants, Place, Source, Structure, Tables, TimeEvent};

use crate::archive::Unit;
use crate::exchange::Exchange;
use crate::fault::Fault;
use crate::host::Host;
use jacobian::Positions;
use tangents::Carried;
pub use wiring::Wiring;

/// One of the units.
struct Part {
    unit: Exchange,
    /// Its states, what is read of it and what it is given, among the unknowns.
    x: Range<usize>,
    y: Range<usize>,
    w: Range<usize>,
    /// Per value that is read: the input of the text, and the place among what is watched.
    reads: Vec<(usize, usize)>,
    /// Per value that is given: where the text has it, the input of the unit, and its column in the unit's Jacobian behind the states.
    gives: Vec<(Source, usize, Option<usize>)>,
    /// Parameters: where the text has the value, the parameter of the unit, and whether the value stands in the declaration of the block.
    parameters: Vec<(Source, usize, bool)>,
    /// Start values: where the text has the value, and the position among those of the unit.
    starts: Vec<(Source, usize)>,
    /// What it is given before anything is known of the text.
    defaults: Vec<f64>,
    nominals: (Vec<f64>, Vec<f64>),
    /// What it had been given when it last started or had an event.
    settled: Vec<f64>,
    rates: Vec<f64>,
    watched: Vec<f64>,
    entries: Vec<f64>,
    /// It had an event in the last pass; true if it wrote into its states there.
    passed: Option<bool>,
}

/// Lengths of what the text and the units have together.
#[derive(Clone, Copy, Default)]
struct Sizes {
    /// Unknowns of the text, of its initial system, its row of results, its root functions.
    unknowns: usize,
    initial: usize,
    row: usize,
    /// Root functions of the units, which stand before those of the text.
    indicators: usize,
    /// Where what is read begins among all unknowns, and how much is read and given.
    first: usize,
    coupled: usize,
}

/// A text and its units as one system.
pub struct Whole {
    text: Box<dyn DaeSystem>,
    parts: Vec<Part>,
    sizes: Sizes,
    structure: Structure,
    tables: Arc<Tables>,
    positions: Positions,
    /// Parameters of the text that were set since it was translated.
    set: BTreeSet<usize>,
    /// Inputs of the text that nobody else gives values, by position.
    open: Vec<usize>,
    instants: Instants,
    /// All unknowns as far as they are known before the initial system is solved; what is read and given as it was asked for last.
    started: Vec<f64>,
    /// Per value that is read: the input of the text, its place among all unknowns, its size.
    reads: Vec<(usize, usize, f64)>,
    text_nominals: Vec<f64>,
    row: Vec<f64>,
    other_row: Vec<f64>,
    residual: Vec<f64>,
    other_residual: Vec<f64>,
    z: Vec<f64>,
    zp: Vec<f64>,
    state_values: Vec<f64>,
    rate_values: Vec<f64>,
    carried: Option<Box<Carried>>,
}

impl Whole {
    /// Joins a text with the units that it names, each with a process of its own.
    ///
    /// # Errors
    /// A unit that cannot be loaded, is not for model exchange, or lacks what the text names.
    pub fn new(text: Box<dyn DaeSystem>, units: &[(Unit, Wiring)], host: &Host) -> Result<Self, Fault> {
        wiring::join(text, units, host)
    }

    /// Tells the units what tolerance the run has, and where it stops (s), from the next start on.
    pub fn expect(&mut self, tolerance: f64, stop: f64) {
        self.parts.iter_mut().for_each(|part| part.unit.expect(tolerance, stop));
    }

    /// Why a unit cannot be used any more, if that is so.
    pub fn fault(&self) -> Option<&Fault> {
        self.parts.iter().find_map(|part| part.unit.fault())
    }

    /// Calls of all units so far.
    pub fn calls(&self) -> u64 {
        self.parts.iter().map(|part| part.unit.counts().calls).sum()
    }

    /// Tells the text what the units compute, as the unknowns have it.
    fn tell_text(&mut self, unknowns: &[f64]) {
        let Some(inputs) = self.text.inputs() else { return };
        for part in &self.parts {
            for (&(input, _), &value) in part.reads.iter().zip(&unknowns[part.y.clone()]) {
                // The position was found in the list of the inputs.
                let _ = inputs.give_input(input, value);
            }
        }
    }

    /// The row of results of the text.
    fn text_row(&mut self, t: f64, z: &[f64], zp: &[f64]) {
        let mut row = std::mem::take(&mut self.row);
        self.text.outputs(t, z, zp, &mut row);
        self.row = row;
    }

    /// What a source of the text is, by a row of results.
    fn given(&self, source: Source, row: &[f64]) -> f64 {
        let value = match source.place {
            Place::Output(at) => row[at as usize],
            Place::Parameter(at) => self.text.parameters()[at as usize],
            Place::Constant(value) => value,
        };
        if source.negated { -value } else { value }
    }
}

impl Part {
    /// Tells the unit what it is given, as the unknowns have it.
    fn tell(&mut self, unknowns: &[f64]) {
        let values = &unknowns[self.w.clone()];
        give(&mut self.unit, &self.gives, values);
    }

    /// Rates and what is watched, at a point.
    fn watch(&mut self, t: f64, unknowns: &[f64]) {
        self.tell(unknowns);
        let (rates, watched) = (&mut self.rates, &mut self.watched);
        self.unit.watch(t, &unknowns[self.x.clone()], rates, watched);
    }
}

fn give(unit: &mut Exchange, gives: &[(Source, usize, Option<usize>)], values: &[f64]) {
    let Some(inputs) = unit.inputs() else { return };
    for (&(_, input, _), &value) in gives.iter().zip(values) {
        // The position was found in the list of the inputs.
        let _ = inputs.give_input(input, value);
    }
}

/// The earlier of two time events; what coincides happens at the instant of the first one.
fn earlier(first: TimeEvent, second: TimeEvent, t: f64, instants: Instants) -> TimeEvent {
    let is_before = instants.lies_ahead(second.t, t) && instants.lies_ahead(first.t, second.t);
    if is_before { second } else { first }
}

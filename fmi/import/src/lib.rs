//! Units of other tools, by the Functional Mock-up Interface 2.0 and 3.0: read, checked, and run.
//!
//! [`Unit::open`] reads an archive: its description becomes a [`Description`], its files go to a folder of their own that is gone with the
//! unit.  [`Exchange`] is a unit for model exchange as a [`hyd_system::DaeSystem`], which any solver takes; [`Stepping`] is one for
//! co-simulation, which brings its own.  Foreign code never runs in this process: `host` starts another one, whose only task is
//! [`serve`], and speaks with it over memory that both see (`area`, `channel`).  A crash or a hang there is a message here.
//!
//! [`Whole`] is a model that is written as text with units as blocks in it.  It knows derivatives by parameters: further instances of a unit
//! have one a small step away (`twins`).
//!
//! What the interface has and this crate does not: clocks, scheduled execution, variables of type Binary, structural parameters other
//! than as the unit has them.  A unit that needs them is refused with a sentence.

mod archive;
mod area;
mod channel;
mod colours;
mod description;
mod driver;
mod exchange;
mod fault;
mod fmi2;
mod fmi3;
mod folder;
mod followers;
mod foreign;
mod host;
mod layout;
mod protocol;
mod session;
mod stepping;
mod structure;
mod terminals;
mod twins;
mod types;
mod variables;
mod whole;
mod worker;
mod xml;

#[cfg(test)]
mod tests;

pub use archive::Unit;
pub use description::{
    Causality, Changes, Description, Experiment, Initial, Interface, Kind, Member, Number, Terminal, Variable, Version,
};
pub use exchange::Exchange;
pub use fault::Fault;
pub use host::{Counts, Host};
pub use stepping::{StepOptions, StepRun, Stepping};
pub use whole::{Whole, Wiring};
pub use worker::serve;

//! Forward-mode tangents of a model along chosen directions.
//!
//! Code computes the local partial derivatives of each row by what it reads; the chain rule along the rows is a list of
//! multiply-adds over blocks that hold all directions next to each other (vector forward mode, Griewank and Walther 2008,
//! "Evaluating Derivatives", section 3.2).  So one evaluation of the partials serves any number of directions, and both backends
//! run the same code.  [`model`] is the data that the compiler makes, [`rows`] are the lists, [`source`] gives it when it is first
//! asked for, [`code`] runs it, [`memory`] is what an instance keeps, [`sweep`] what steps of sensitivities ask for all the time, [`system`] the contract of
//! [`hyd_system::Tangents`].

mod code;
pub(crate) mod memory;
mod model;
mod rows;
mod source;
mod sweep;
mod system;

pub use model::{Branch, PARTS, Part, Stage, SweepModel, TangentModel};
pub use rows::{MINUS, Rows, Spaces, Term};
pub use source::{Derivatives, TangentSource};

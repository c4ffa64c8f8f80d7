//! Tests of the whole way from a flat model to a sorted system.
//!
//! Models are written as short texts (see `model.rs`); sorted systems are executed by an interpreter (`execute.rs`) and held
//! against the original equations at random points, which share no code with the sorting.

mod execute;
mod model;

mod events;
mod faults;
mod initial;
mod large;
mod plans;
mod prints;
mod random;
mod reduction;

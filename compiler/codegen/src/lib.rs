//! Sorted system to native code.
//!
//! [`generate`] turns a sorted system into a [`program::Program`] (kernels of expressions over addresses), the program
//! into machine code by Cranelift ([`native`]; interpreted by [`vm`] where that is refused), both with places and names
//! into a [`hyd_payload::Model`], and returns a [`CompiledModel`] whose instances solve as [`hyd_system::DaeSystem`].
//! Small models become straight-line code with subexpressions shared over all equations and Jacobian entries; large
//! ones loops over slot tables whose number does not grow with the number of equations.  Knows nothing of syntax, of
//! solvers or of results.

mod c;
mod candidates;
mod delay;
mod engine;
mod known;
mod layout;
mod lower;
mod model;
pub mod native;
mod nominals;
mod shared;
mod spans;
mod tables;
mod tangent;
mod tested;

#[cfg(test)]
mod tests;

pub use hyd_payload::{Backend, Instance, memory, program, vm};
pub use lower::{Jacobians, Options};
pub use model::{CompiledModel, generate};
pub use shared::CodeStatistics;

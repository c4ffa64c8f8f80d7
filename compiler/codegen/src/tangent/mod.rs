//! Forward-mode tangents of a compiled model, made on request.
//!
//! Code computes the local partial derivatives of each row by what it reads (symbolic, loops as everywhere); the chain
//! rule along the rows is a list of multiply-adds over blocks that hold all directions next to each other (vector forward
//! mode, Griewank and Walther 2008, "Evaluating Derivatives", section 3.2).  So one evaluation of the partials
//! serves any number of directions, and both backends run the same code.  [`code`] makes the routines, [`rows`] are the
//! lists, [`memory`] what an instance keeps, [`sweep`] what steps of
//! sensitivities ask for all the time, [`system`] the contract of [`hyd_system::Tangents`].

mod code;
mod memory;
mod rows;
mod sweep;
mod system;

pub(crate) use code::TangentCode;
pub(crate) use memory::{TangentMemory, output_variables};

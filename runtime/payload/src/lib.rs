//! A compiled model as plain data: what the compiler makes, what executables carry, what the solver runs.
//!
//! A [`Model`] holds a program twice, as machine code without relocations ([`Code`]) and as expressions over addresses
//! ([`program::Program`]), beside places, names and tables.  [`Loaded`] maps the code, or interprets the program where that is
//! refused; an [`Instance`] of it solves as [`hyd_system::DaeSystem`].  [`format`] turns a model into bytes and back and refuses
//! what is damaged or foreign; [`executable`] appends the bytes to a launcher and finds them again.  So simulation in the process
//! of the compiler and executables run the same bytes.  Knows no text of models, no code generator and no solver.

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod accumulation;
mod affine;
mod ahead;
mod backward_error;
mod clock;
mod codec;
mod codec_program;
mod codec_tables;
mod delay;
mod diagnose;
mod enclose;
mod engine;
mod events;
mod excerpt;
pub mod executable;
mod follower;
pub mod format;
mod functions;
mod input;
mod instance;
mod interval;
mod loaded;
mod mapping;
pub mod memory;
mod model;
mod names;
pub mod program;
mod reach;
mod routines;
mod saved;
mod search;
mod selection;
mod start;
mod system;
pub mod tangent;
pub mod target;
mod timed;
pub mod vm;

pub use codec::Damage;
pub use engine::{Backend, Engine};
pub use excerpt::CodeSource;
pub use functions::{POWERS, SINES_AND_COSINES, position as function_position};
pub use instance::{Instance, Point};
pub use loaded::Loaded;
pub use mapping::{Code, NativeCode};
pub use model::{
    Check, Checked, Experiment, Identity, InitialTransfer, Limit, MessagePiece, Model, OutputRow, Parameters,
    outside_limits,
};
pub use names::{Name, Names, RowNames, Wrap};
pub use program::Place;
pub use reach::{Reach, Reached};
pub use routines::{
    DataArea, EventRoutines, Given, JacobianForm, PlanRoutines, Routines, Signed, SitePlaces, TimedRelation,
};
pub use selection::CandidateSet;

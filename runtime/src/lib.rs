//! The integrator: from a system `F(t, y, y') = 0` with events to rows of results.
//!
//! [`simulate`] runs a [`hyd_system::DaeSystem`] once, a [`Simulator`] keeps its work space for many runs, and a
//! [`ModelFunction`] maps parameter values to outputs and their derivatives.  The parts: `initial`
//! finds consistent values, `bdf` and `esdirk` step with one `corrector`, `integrator` chooses between them, `events` finds and settles
//! events, `sensitivity` carries derivatives along, `output` writes rows, `linear` factors matrices.  Every outcome comes
//! with [`Statistics`]; every failure is a [`SolveError`] that says when, where and in which variable.  The crate knows no
//! compiler and no file format.
//!
//! ```
//! # use hyd_runtime::{Options, simulate};
//! # fn run(system: &mut dyn hyd_system::DaeSystem) -> Result<(), hyd_runtime::SolveError> {
//! let mut trajectory = hyd_results::Trajectory::new();
//! let options = Options::new(0.0, 0.03).with_tolerance(1e-8);
//! let summary = simulate(system, &options, &mut trajectory, &|| false)?;
//! println!("{} rows, {}", trajectory.len(), summary.statistics);
//! # Ok(())
//! # }
//! ```

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod bdf;
mod corrector;
mod course;
mod delay;
mod error;
mod esdirk;
mod events;
mod exchange;
mod first_step;
mod fold;
mod function;
mod initial;
mod integrator;
mod linear;
mod linearize;
mod local_mode;
mod loops;
mod message;
mod options;
mod output;
mod problem;
mod profile;
mod sensitivity;
mod simulate;
mod sizes;
mod statistics;
mod tiled;
mod undetermined;
mod vanishing;
mod weights;

#[cfg(test)]
mod tests;

pub use course::Course;
pub use error::{Cause, Near, Place, SolveError, Stage, StartAdvice, StepReport};
pub use events::chatter::{Chattering, Pile};
pub use events::cycle::{Changing, Repeats};
pub use exchange::{Exchange, Settled};
pub use function::{EvaluationError, Functional, ModelFunction, Response};
pub use initial::rescue::{OtherStart, Rescue, RescueStage};
pub use integrator::{Method, MethodPhase, Reason};
pub use linearize::{LinearModel, LinearizeError, OperatingPoint, linearize};
pub use local_mode::LocalMode;
pub use message::JUMPS;
pub use options::{OptionError, Options, Solver};
pub use profile::{Profile, Seconds};
pub use simulate::{Jump, Onward, Reached, Simulator, Summary, Warning, simulate};
pub use statistics::Statistics;
pub use undetermined::Undetermined;
pub use vanishing::Vanishing;

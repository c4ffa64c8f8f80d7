//! Tasks that many machines work off, started by an engine that exists: HyperQueue, Slurm or Dask; or, without one, by this machine.
//!
//! A [`Work`] is a program that is called once for each number; an [`Engine`] hands the numbers out and says which of them it still has to
//! do.  Whether a task is done is asked of the files that it should leave, never of the engine: [`carry_out`] submits what is missing, waits,
//! submits again what ended without its files, and gives up on what does so several times.  So it does not matter which process dies
//! when, or how often a task runs.  The crate knows nothing of models and results; engines are programs of their own, called by name.

mod dask;
mod engine;
mod here;
mod hyperqueue;
mod numbers;
mod slurm;
mod watch;
mod work;

pub use engine::{Engine, Place, PlaceError};
pub use watch::{Done, Ended, Given, Patience, Seen, carry_out};
pub use work::Work;

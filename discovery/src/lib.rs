//! Discovery: where do a model and a bench disagree, and what is missing?
//!
//! A [`Study`] ties a model to a bench, a [`Bench`] is one set of shots, a [`Setup`] both together.  `problem` compares runs with shots,
//! `fit` takes up what may be off, `catalogue` knows the effects that libraries declare and the places where they fit, and `variant`
//! writes models with effects in them as text.  Findings are plain data.  The crate knows no command line and opens no file.

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod bench;
pub mod calibration;
pub mod catalogue;
mod clock;
mod composed;
pub mod considered;
pub mod data;
pub mod data_files;
pub mod dictionary;
pub mod disturbance;
pub mod door;
mod fault;
pub mod fit;
mod formula;
pub mod further;
pub mod hypothesis;
pub mod import;
pub mod initial;
mod leftover;
mod limits;
pub mod location;
pub mod machine;
mod magnitude;
mod modifications;
pub mod natural;
pub mod noise;
mod operating_points;
pub mod places;
pub mod power;
pub mod prior;
pub mod problem;
pub mod projection;
pub mod proof;
pub mod record;
mod recorded;
pub mod report;
pub mod same_ids;
pub mod search;
mod set_check;
pub mod setup;
pub mod sheet;
mod shot_table;
pub mod study;
mod study_check;
pub mod text_bundle;
mod threads;
pub mod translated;
pub mod unknowns;
pub mod variant;
mod windows;

pub use bench::Bench;
pub use fault::Fault;
pub use set_check::{KEYS as SET_KEYS, REMARKS as SET_REMARKS};
pub use setup::Setup;
pub use study::Study;

//! Discovery: where do a model and a bench disagree, and what is missing?
//!
//! A [`Study`] ties a model to a bench, a [`Bench`] is one set of shots, a [`Setup`] both together.  `problem` compares runs with shots,
//! `fit` takes up what may be off, `catalogue` knows the effects that libraries declare and the places where they fit, and `variant`
//! writes models with effects in them as text.  Findings are plain data.  The crate knows no command line and opens no file.

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod bench;
mod calibration;
mod catalogue;
mod data;
mod design;
mod disturbance;
mod elements;
mod evidence;
mod fault;
mod fit;
mod import;
mod leftover;
mod machine;
mod magnitude;
mod problem;
mod record;
mod report;
mod search;
mod setup;
mod study;
mod tasks;
mod terms;
mod threads;
mod unknowns;
mod variant;
mod watch;

pub use bench::{Bench, Shot};
pub use calibration::Calibration;
pub use catalogue::Candidate;
pub use design::{NextShots, PredictedCurves, Wish, next_shots};
pub use evidence::proof::Gap;
pub use fault::Fault;
pub use fit::Fit;
pub use fit::profile::Profile;
pub use fit::schedule::{Attempt, Record};
pub use import::{Asked, Assumptions, Content, Imported, Plan, RawFile};
pub use machine::Machine;
pub use machine::foreign::{Foreign, Joiner};
pub use problem::{Problem, Weighing};
pub use report::{ChannelCurves, FittedReport, Folder, Report, ShotCurves, quoted};
pub use search::{Ends, Forgetful, Memory, Search};
pub use setup::Setup;
pub use study::{Nuisance, Study};
pub use tasks::{Crew, Tasks};
pub use terms::law::{Law, LawMemory, LawTerm, MemoryNumber, Rival};
pub use unknowns::{Meaning, Unknown};
pub use variant::data_files::{DataFiles, is_below};
pub use variant::other_files::{OtherFiles, Owner};
pub use variant::translated::Translated;
pub use variant::{Opaque, Workshop};
pub use watch::Watch;

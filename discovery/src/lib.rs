//! Discovery: where do a model and a bench disagree, and what is missing?
//!
//! A [`Study`] ties a model to a bench, a [`Bench`] is one set of shots, a [`Setup`] both together.  `problem` compares runs with shots,
//! `fit` takes up what may be off, `catalogue` knows the effects that libraries declare and the places where they fit, and `variant`
//! writes models with effects in them as text.  Findings are plain data.  The crate knows no command line and opens no file.

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod averaged;
mod bench;
mod bench_limits;
mod calibration;
mod catalogue;
mod clock;
mod composed;
mod considered;
mod data;
mod data_files;
mod design;
mod dictionary;
mod disturbance;
mod door;
mod dynamics;
mod fault;
mod fit;
mod foreign;
mod formula;
mod further;
mod grid;
mod hypothesis;
mod import;
mod initial;
mod input_table;
mod law;
mod leftover;
mod limits;
mod location;
mod machine;
mod magnitude;
mod missing;
mod modifications;
mod natural;
mod noise;
mod operating_points;
mod places;
mod power;
mod prior;
mod problem;
mod projection;
mod proof;
mod record;
mod recorded;
mod report;
mod response;
mod same_ids;
mod search;
mod set_check;
mod setup;
mod sheet;
mod shot_table;
mod span;
mod study;
mod study_check;
mod tasks;
mod text_bundle;
mod threads;
mod thresholds;
mod translated;
mod unit_quotient;
mod unknowns;
mod variant;
mod watch;
mod windows;

pub use bench::{Bench, Shot};
pub use calibration::Calibration;
pub use catalogue::Candidate;
pub use data_files::{DataFiles, is_below};
pub use design::{NextShots, PredictedCurves, Wish, next_shots};
pub use fault::Fault;
pub use fit::Fit;
pub use fit::profile::Profile;
pub use fit::schedule::Record;
pub use foreign::{Foreign, Joiner};
pub use import::{Asked, Assumptions, Content, Imported, Plan, RawFile};
pub use law::{Law, LawMemory, LawTerm, MemoryNumber, Rival};
pub use machine::Machine;
pub use problem::{Problem, Weighing};
pub use proof::Gap;
pub use report::{ChannelCurves, FittedReport, Folder, Report, ShotCurves, quoted};
pub use search::{Ends, Forgetful, Memory, Search};
pub use setup::Setup;
pub use study::{Nuisance, Study};
pub use tasks::{Crew, Tasks};
pub use translated::Translated;
pub use unknowns::{Meaning, Unknown};
pub use variant::{Opaque, Workshop};
pub use watch::Watch;

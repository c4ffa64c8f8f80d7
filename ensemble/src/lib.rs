//! Many runs of one model: which parameter values, on which cores, into which files.
//!
//! A [`Plan`] says what varies; [`Members`] are its parameter values, number by number, the same on every machine; [`run`] works
//! a share of them off in chunks, each of which becomes a whole file, so that a killed sweep goes on where it was; [`merge`]
//! joins the files.  A [`Submission`] is what other machines need to work off a share.  A member that fails is a row that says so, and a [`Measure`] is a
//! column.  The crate knows no compiler and no command line.

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod chunk;
mod failures;
mod folder;
mod measure;
mod members;
mod merge;
mod normal;
mod plan;
mod run;
mod submission;
mod variation;

pub use failures::Failure;
pub use folder::{Folder, FolderError};
pub use measure::{Measure, MeasureError, Resolved};
pub use members::Members;
pub use merge::{MergeError, merge};
pub use plan::{Method, Plan, PlanError, Shard, Vary};
pub use run::{Job, Kept, Places, Report, WholeLoops, run};
pub use submission::{Manifest, Shipped, Submission, SubmissionError, hash};
pub use variation::{Variation, VariationError};

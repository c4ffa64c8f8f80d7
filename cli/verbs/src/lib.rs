//! What the verbs of `hyd` do with files and models, apart from arguments and terminals: the command and the Python package stand on it.
//!
//! [`Libraries`] and [`LibraryPath`] say where texts come from, [`compile_file`] and [`compile_text`] translate, [`Run`] runs a model
//! once, [`sweep`](sweep::sweep) many times, [`share_out`](share_out::share_out) does so on other machines, [`linearize`](linear::linearize) gives the linear model at a point, `study`, `fit` and `discover` hold a model
//! against a bench, `check` counts what a model has. Results are data; what is to be said on the way goes to a [`Listener`]. No clap, no standard output, no mathematics.

pub mod check;
pub mod discover;
mod discovered_files;
mod discovery_calibration;
pub mod discovery_crew;
mod discovery_memory;
mod discovery_page;
mod discovery_picture;
pub mod discovery_shared;
pub mod discovery_trials;
pub mod fit;
mod fit_report;
pub mod inside;
mod joined;
mod judged;
pub mod library;
pub mod linear;
mod listener;
pub mod next;
mod next_page;
pub mod page;
mod parameters;
pub mod picture;
mod profile_page;
pub mod result_table;
mod run;
mod run_failure;
pub mod share_out;
pub mod shots;
mod start_trial;
mod start_values;
pub mod study;
mod study_unit;
pub mod sweep;
mod translate;
mod trials;
pub mod unit;
pub mod unit_model;
pub mod unit_text;

pub use discovery_memory::hash;
pub use hyd_fmi_import::Host;
pub(crate) use hyd_run::Failure;
pub(crate) use hyd_run::clock;
pub use joined::Joined;
pub use library::LibraryPath;
pub use listener::Listener;
pub use parameters::refuse_unknown;
pub use profile_page::page as profile_page;
pub use run::Run;
pub use run_failure::diagnostic as run_diagnostic;
pub use start_trial::whole_loops_for_the_start;
pub use start_values::{rescue_diagnostic, start_warning};
pub use translate::{Libraries, Request, compile_file, compile_text, first_name, with_whole_loops};
pub use trials::{Healing, Trials, edited};

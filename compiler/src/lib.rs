//! The compiler: texts in, a model that can be run out.
//!
//! `compile` runs the stages in order (`pipeline`): text -> syntax tree -> instance tree -> flat model -> equation system
//! -> sorted system with Jacobian -> native code.  Texts come through the trait [`Sources`]; nothing here opens a file,
//! reads a clock or knows of measured data.  Diagnostics are data until `render` makes text of them.

mod back_end;
mod balance;
mod changes;
mod choice;
mod compilation;
mod injection;
pub mod inquiry;
mod json;
mod limits;
mod opening;
mod page;
mod pipeline;
pub mod render;
mod stand_in;
mod suspects;
mod unused;
mod variation;

pub use balance::{Balance, Element, Factor, Scaled, balances};
pub use changes::{Change, Rank, Trouble, changes};
pub use compilation::{Compilation, Goal, Options, Stage, StageTime};
pub use hyd_codegen::{CodeStatistics, CompiledModel, Instance};
pub use hyd_equations::{Approach, Cost, Loops, approaches, costs, held_conditions, judged_courses};
pub use hyd_flat::{FlatModel, ForeignBlock, Injection, TermShape};
pub use hyd_instance::{SourceText, Sources, Trees};
pub use hyd_source::{Code, Diagnostic, Edit, FileId, Files, Proposal, Severity, did_you_mean, dotted};
pub use hyd_syntax::{Head, compare_versions, head, is_keyword, print_string, uses, version};
pub use injection::{InjectionSite, MOST_ELEMENTS, injection_sites};
pub use opening::{Act, Command, Course, Elements, Opening, commands, course, opened};
pub use pipeline::{
    Extras, compile, compile_extended, compile_over, compile_whole_loops, compile_with, with_whole_loops,
};
pub use stand_in::{ReadInput, read_inputs};
pub use suspects::{Suspect, suspects};
pub use unused::unused_parameters;
pub use variation::{Variation, varied};

/// True for a text that is a unit of SI, such as `N.s/m`.
pub fn is_unit(text: &str) -> bool {
    hyd_units::parse_unit(text).is_ok()
}

//! Flat model to sorted system: what is computed in which order, and what is left for the solver.
//!
//! One pass per file, each a function from one representation to the next: [`assign_roles`] gives every scalar variable
//! and equation its place, [`eliminate_aliases`] removes what merely renames, [`reduce_index`] differentiates constraints,
//! [`sort_system`] orders everything computed into plans ([`Plan`]), [`differentiate`] makes the Jacobian of a plan.
//! [`sort`] runs them all.  Symbolic work is done once per template, structural work on integers, so that the cost grows
//! about linearly with the number of equations.  Nothing is evaluated here, and no code is made.

mod algebra;
mod alias;
mod balance;
mod bindings;
mod classes;
mod contradiction;
mod dependent;
mod dependent_start;
mod discrete;
mod discrete_start;
mod explain;
mod explain_variable;
mod fixed_numbers;
mod growth;
mod higher;
mod homotopy;
mod incidence;
mod initial;
pub mod jacobian;
mod linearity;
mod matrix;
mod parameter_values;
mod plan;
mod print;
mod print_plan;
mod reduce_index;
mod redundant;
mod relations;
mod representative;
mod reverse;
mod roles;
mod selection;
mod sort;
pub mod sorted;
mod specialize;
mod start_point;
mod state_select;
mod structure;
mod support;
pub mod system;
mod time_derivative;
mod unseen_events;
mod vanishing;
mod verify;
mod verify_system;

#[cfg(test)]
mod tests;

pub use alias::eliminate_aliases;
pub use explain::equation_text;
pub use explain_variable::explain_variable;
pub use jacobian::{Lists, Places, PlanJacobian, PlanPlace, differentiate};
pub use matrix::{Matrix, matrix};
pub use parameter_values::parameter_values;
pub use plan::{LARGE, LONGEST_CHAIN, Loops, WIDE, WIDEST_SUPPORT};
pub use print::print_system;
pub use print_plan::{print_jacobian, print_sorted};
pub use reduce_index::reduce_index;
pub use relations::extract_relations;
pub use roles::assign_roles;
pub use sort::sort_system;
pub use sorted::{
    Assignment, Block, Blocks, Check, EqId, EventRelation, OperandRange, Plan, Redundant, Residual, SortedSystem,
    Trigger, Unknown,
};
pub use system::{Candidate, Equation, EquationSystem, Reduction, Resolution, Role, Selection};
pub use verify::verify;
pub use verify_system::verify_system;

use hyd_flat::FlatModel;
use hyd_source::Outcome;

/// The equation system of a flat model: roles assigned, aliases eliminated.
pub fn build_system(flat: FlatModel) -> EquationSystem {
    eliminate_aliases(assign_roles(flat))
}

/// The sorted system of a flat model; none if the model is structurally at fault.
pub fn sort(flat: FlatModel) -> Outcome<Option<SortedSystem>> {
    let Outcome { value, mut diagnostics } = reduce_index(build_system(flat));
    let Some(system) = value else { return Outcome { value: None, diagnostics } };
    let sorted = sort_system(system, Loops::Torn);
    diagnostics.extend(sorted.diagnostics);
    Outcome { value: sorted.value, diagnostics }
}

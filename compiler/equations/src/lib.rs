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
mod combined;
mod decided;
mod explain;
mod fixed_starts;
mod incidence;
mod index_reduction;
mod initial;
pub mod jacobian;
mod lists;
mod parameter_values;
mod plan;
mod real_equality;
mod relations;
mod roles;
mod semi_linear;
mod sort;
pub mod sorted;
mod start_point;
pub mod system;
mod unseen_events;
mod verify;
mod verify_system;

#[cfg(test)]
mod tests;

pub use alias::eliminate_aliases;
pub use combined::until_regular;
pub use explain::cost::{Cost, costs};
pub use explain::faults::equation_text;
pub use explain::held_conditions::held_conditions;
pub use explain::judged_courses::judged_courses;
pub use explain::matrix::{Matrix, matrix};
pub use explain::print::print_system;
pub use explain::print_plan::{print_jacobian, print_sorted};
pub use explain::singularity::{Approach, approaches};
pub use explain::variable::explain_variable;
pub use index_reduction::reduce_index;
pub use jacobian::{Places, PlanJacobian, PlanPlace, differentiate};
pub use lists::Lists;
pub use parameter_values::parameter_values;
pub use plan::{LARGE, LONGEST_CHAIN, Loops, WIDE, WIDEST_SUPPORT};
pub use relations::extract_relations;
pub use roles::assign_roles;
pub use sort::sort_system;
pub use sorted::{
    Assignment, Block, Blocks, Check, EventRelation, Plan, Redundant, Residual, SortedSystem, Trigger, Unknown,
};
pub use system::{
    Candidate, Combination, EqId, Equation, EquationSystem, OperandRange, Reduction, Resolution, Role, Selection,
};
pub use verify::verify;
pub use verify_system::verify_system;

use hyd_flat::FlatModel;
use hyd_source::Outcome;

/// The equation system of a flat model: roles assigned, aliases eliminated.
pub fn build_system(flat: FlatModel) -> EquationSystem {
    let mut system = assign_roles(flat);
    decided::take_zeros(&mut system);
    let mut system = eliminate_aliases(system);
    semi_linear::join_chains(&mut system);
    system
}

/// The same with sums in the place of some equations, one after the other; none if those are not there.
pub fn build_combined(flat: FlatModel, combinations: &[Combination]) -> Option<EquationSystem> {
    let mut system = build_system(flat);
    combined::combine(&mut system, combinations).then_some(system)
}

/// The sorted system of a flat model; none if the model is structurally at fault.
pub fn sort(flat: FlatModel) -> Outcome<Option<SortedSystem>> {
    until_regular(|combinations| {
        let Some(system) = build_combined(flat.clone(), combinations) else {
            return Err(Box::new((Outcome { value: None, diagnostics: Vec::new() }, None)));
        };
        let Outcome { value, mut diagnostics } = reduce_index(system);
        let Some(system) = value else { return Err(Box::new((Outcome { value: None, diagnostics }, None))) };
        let sorted = sort_system(system, Loops::Torn);
        diagnostics.extend(sorted.diagnostics);
        match sorted.value {
            Ok(sorted) => Ok(Outcome { value: Some(sorted), diagnostics }),
            Err(next) => Err(Box::new((Outcome { value: None, diagnostics }, next))),
        }
    })
}

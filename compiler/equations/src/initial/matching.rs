//! The matching from which the initial system starts.

use hyd_flat::Target;
use hyd_structure::{Column, Matching, maximum_matching};

use crate::incidence::{Pattern, Unknowns};
use crate::system::EquationSystem;

/// A matching that leaves states open rather than derivatives and algebraic variables, free parameters used last.
pub(crate) fn first_matching(system: &EquationSystem, pattern: &Pattern, unknowns: &Unknowns) -> Matching {
    let class = |column: Column| match unknowns.targets[column] {
        Target::Var(v) if !system.roles[v].is_continuous() => 2,
        Target::Var(v) if system.roles[v].may_be_state() => 1,
        _ => 0,
    };
    let classes = pattern.incidence.entry_table(|_, column| class(column));
    maximum_matching(&pattern.incidence, Some(&classes))
}

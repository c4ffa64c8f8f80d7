//! What a user sees of the systems: faults in the user's words, the history of one variable, printed stages, the matrix.

pub(crate) mod cost;
pub(crate) mod faults;
pub(crate) mod floating;
pub(crate) mod held_conditions;
pub(crate) mod held_states;
pub(crate) mod judged_courses;
pub(crate) mod matrix;
pub(crate) mod own_equations;
pub(crate) mod prescribed;
pub(crate) mod print;
pub(crate) mod print_plan;
mod references;
pub(crate) mod singularity;
pub(crate) mod variable;

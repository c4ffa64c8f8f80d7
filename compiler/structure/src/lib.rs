//! Structural analysis of equation systems: graph algorithms on integers, no expressions.
//!
//! An equation is a [`Row`], an unknown a [`Column`]; the [`Incidence`] says which occurs where.  Everything else is a
//! function from it to a *plan*, plain data that a later stage applies to the equations themselves:
//!
//! 1. [`maximum_matching`]: which equation determines which unknown, with preferences.
//! 2. [`decompose`]: if the matching is not perfect, where equations are too many or too few;
//!    [`minimal_overdetermined`], [`minimal_underdetermined`] and [`smallest_overdetermined`] name the set to report.
//! 3. [`block_order`]: which equations must be solved together, and in which order (BLT form).
//! 4. [`Tearing`]: inside a block, explicit assignments around a few iteration variables.
//! 5. [`pantelides`]: which equations to differentiate, so that all highest derivatives are determined;
//!    [`choose_dummies`]: which derivatives become algebraic unknowns then, with a [`CandidateSet`] where that may change
//!    during the run.
//!
//! [`verify`] checks each plan against its definition.  All algorithms are near linear in the number of entries (the
//! matching in the worst case times the square root of the rows), use explicit stacks, and give the same result for
//! the same input.
//!
//! ```
//! use hyd_structure::{Incidence, Tearing, TearingOptions, block_order, maximum_matching};
//!
//! // eq0: v0 = 1;  eq1 and eq2: two equations in v1 and v2;  eq3: v3 from v2.
//! let text = "4 rows, 4 columns\neq0: v0\neq1: v0 v1 v2\neq2: v1 v2\neq3: v2 v3\n";
//! let incidence: Incidence = text.parse()?;
//!
//! let matching = maximum_matching(&incidence, None);
//! assert!(matching.is_perfect());
//! let plan = block_order(&incidence, &matching)?;
//! assert_eq!(plan.to_string(), "block0: eq0=v0\nblock1: eq1=v1 eq2=v2\nblock2: eq3=v3\n");
//!
//! // Suppose every equation can be solved for every unknown in it except eq2 for v1.
//! let solvable = incidence.entry_table(|row, column| (row.0, column.0) != (2, 1));
//! let options = TearingOptions { solvable: &solvable, wish: None, max_depth: None };
//! let mut tearing = Tearing::new(&incidence, options);
//! let loops: Vec<String> = plan
//!     .blocks()
//!     .filter(|&block| plan.block(block).0.len() > 1)
//!     .map(|block| tearing.tear(plan.block(block).0, plan.block(block).1).to_string())
//!     .collect();
//! assert_eq!(loops, ["tearing: v1\nassign: eq1=v2\nresiduals: eq2\n"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Words
//!
//! The literature uses some terms in several senses; here:
//! - *matching*: pairs of equation and unknown, none used twice (also: assignment, transversal, output set).
//!   *Maximum*: no larger one exists; *perfect*: nothing is left unmatched.
//! - *block*: a strongly connected component of the dependencies between matched equations (also: algebraic loop,
//!   if it has more than one equation); an irreducible diagonal block of the *block lower triangular* form.
//! - *over-determined* / *under-determined part*: rows / columns in surplus, as in [`decomposition`].
//! - *tearing column*: an iteration variable of a torn block; *residual row*: an equation the iteration makes zero;
//!   *assignment*: an equation of a torn block solved explicitly.
//! - *solvable* entry: the equation can be solved explicitly for the unknown; decided by the caller.

pub mod augment;
pub mod blocks;
pub mod candidates;
mod cheap;
pub mod components;
pub mod decomposition;
mod differentiation;
pub mod dummy_derivatives;
mod elimination;
pub mod graph;
mod independent;
mod matching;
mod maximum_matching;
pub mod pantelides;
mod parts;
pub mod smallest;
pub mod tearing;
mod tearing_plan;
pub mod verify;

#[cfg(test)]
mod brute_force;
#[cfg(test)]
mod signature;

pub use augment::{Augmentation, Augmenter};
pub use blocks::{Block, BlockPlan};
pub use candidates::CandidateSet;
pub use components::{UnmatchedRow, block_order};
pub use decomposition::{NotMaximum, decompose, minimal_overdetermined, minimal_underdetermined};
pub use differentiation::DifferentiationPlan;
pub use dummy_derivatives::{DummyPlan, DummyProblem, NoChoice, choose_dummies};
pub use graph::{Column, Entry, Incidence, IncidenceError, Row, Transpose};
pub use independent::independent;
pub use matching::Matching;
pub use maximum_matching::maximum_matching;
pub use pantelides::{NotReducible, pantelides};
pub use parts::{Decomposition, Part};
pub use smallest::{smallest_overdetermined, smallest_underdetermined};
pub use tearing::{Tearing, TearingOptions};
pub use tearing_plan::TearingPlan;

//! Text to syntax tree, for the Modelica 3.6 profile.
//!
//! [`parse`] turns a file into a [`tree::StoredDefinition`] plus messages; it never fails and never panics.  The work goes
//! through three steps: a linear scan (comments, foreign characters, limits), the pest grammar, and the building of the
//! tree with its nesting and operator precedence.  [`print_expr`] and its companions turn trees back into text.  No type
//! of the parser generator leaves this crate, and no name is looked up here.

mod build;
mod build_code;
mod build_element;
mod build_equation;
mod build_expr;
mod build_file;
mod build_modification;
mod grammar;
mod head;
mod lone;
pub mod names;
mod printer;
mod recovery;
mod scan;
mod slips;
pub mod tokens;
pub mod tree;
mod versions;
pub mod visit;
pub mod visit_mut;

#[cfg(test)]
mod tests;

pub use build_file::parse;
pub use head::{Head, head};
pub use lone::{one_line, parse_expression};
pub use printer::{print_expr, print_path, print_reference, print_string};
pub use recovery::is_keyword;
pub use versions::{compare_versions, uses, version};

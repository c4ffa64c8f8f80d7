//! Texts of instances with every name resolved and every expression typed: what stands between the instance tree and the flat model.
//!
//! [`Elaborator`] makes expressions, statements, equations and functions of a scope from their syntax.  Types are an element and a
//! number of dimensions ([`Type`]); sizes are values and are found by whoever lowers an expression.  It is asked for one text at a time and
//! holds no model: functions and records that were typed before are remembered in [`Typing`].

mod calls;
mod elaborate;
mod expression;
mod function;
mod functions;
mod names;
mod operators;
mod print;
mod statement;
mod statements;
mod types;
mod walk;

pub use calls::is_clocked_sample;
pub use elaborate::{Elaborator, FieldDims, Typing};
pub use expression::{Call, Callee, Construction, Expr, Iterator, Kind, Local, Variable};
pub use function::{Declaration, External, Function, HandedOn, Signature};
pub use statement::{Assertion, Equation, EquationKind, Overdetermined, Statement, StatementKind};
pub use types::{Base, RecordType, Type, scalar_of};
pub use walk::{any, any_local, any_variable, mentions, reads_run, walk_statements};

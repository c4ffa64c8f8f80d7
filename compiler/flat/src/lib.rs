//! Instance tree to flat model: variables and equations without components.
//!
//! `flatten` declares variables (`variables`) and drives the rest.  Texts come typed (`hyd_typed`); `expressions` turns them into nodes over
//! slots, `functions` runs or compiles what they call, `sections` does equations and algorithms, `connections` the equations of
//! connections.  All of them write through `state`: loops and arrays are lowered once with symbolic counters, so equations of a
//! loop share one template and cost a few words each, and an attempt owns what it makes.
//! The flat model ([`model`]) keeps the user's equations as they are: nothing is solved or eliminated here.

mod connections;
mod expressions;
mod flatten;
mod functions;
pub mod model;
mod operand;
mod print;
mod sections;
mod state;
mod variables;
mod verify;

pub use flatten::flatten;
pub use model::{
    BlockId, ClockKind, ClockOperator, ConstId, DeclaredType, DelayBlock, DrivenBlock, EquationBlock, Experiment,
    FlatModel, ForeignBlock, Gaps, Imbalance, Message, MessagePart, Operand, PerElement, Potential, Quantity, Section,
    StateSelect, Target, Terminal, TextBlock, UnitClaim, VarId, VariableBlock,
};
pub use sections::inject::{Injection, TermShape};
pub use state::flattener::EVERY_INPUT;
pub use state::made::{Made, derivative_block, rate_unit};
pub use verify::verify;

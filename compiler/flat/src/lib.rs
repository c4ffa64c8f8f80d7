//! Instance tree to flat model: variables and equations without components.
//!
//! `flatten` declares variables and drives the rest; `lower`, `reference`, `range`, `call` and `function` turn expressions into nodes
//! over slots; `section` and `when` do the equation sections; `connect` makes the equations of connections.  Loops and arrays
//! are lowered once with symbolic counters (`index`), so equations of a loop share one template and cost a few words each.
//! The flat model ([`model`]) keeps the user's equations as they are: nothing is solved or eliminated here.

mod algorithm;
mod array;
mod assignment;
mod body;
mod body_statement;
mod body_store;
mod branch;
mod call;
mod call_memory;
mod callee;
mod callee_names;
mod component_balance;
mod connect;
mod connect_sets;
mod connector_match;
mod context;
mod delay;
mod discrete_time;
mod draft;
mod element_names;
mod emit;
mod exact;
mod flatten;
mod fold;
mod form;
mod function;
mod given_derivative;
mod given_value;
mod homotopy;
mod if_equation;
mod index;
mod inject;
mod jump;
mod known;
mod large_result;
mod lower;
mod made;
pub mod model;
mod model_ends;
mod open_ends;
mod operand;
mod operator;
mod piecewise;
mod print;
mod range;
mod record;
mod record_array;
mod record_made;
mod reduction;
mod reference;
mod rename;
mod run_decided;
mod sample;
mod section;
mod shape;
mod sides;
mod statement;
mod text;
mod unit_claim;
mod variable;
mod verify;
mod walk;
mod when;
mod when_body;

pub use flatten::{flatten, flatten_driven, flatten_with};
pub use inject::{Injection, TermShape};
pub use made::{Made, derivative_block, rate_unit};
pub use model::{
    BlockId, ConstId, DelayBlock, DrivenBlock, EquationBlock, Experiment, FlatModel, Imbalance, Message, MessagePart,
    Operand, PerElement, Quantity, Section, StateSelect, Target, UnitClaim, VarId, VariableBlock,
};
pub use verify::verify;

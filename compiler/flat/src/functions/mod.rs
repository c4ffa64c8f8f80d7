//! The user's functions and the statements of algorithms: run symbolically, or compiled.

pub(crate) mod arguments;
pub(crate) mod assignment;
pub(crate) mod body;
pub(crate) mod body_statement;
pub(crate) mod body_store;
pub(crate) mod call_memory;
pub(crate) mod callee;
pub(crate) mod declare;
pub(crate) mod draw;
pub(crate) mod external;
pub(crate) mod function;
pub(crate) mod given_derivative;
pub(crate) mod large_result;
pub(crate) mod rename;
pub(crate) mod run_decided;
pub(crate) mod section_statement;
pub(crate) mod statement;
pub(crate) mod table_body;
mod text_call;

//! Typed expressions to nodes, one element at a time.

pub(crate) mod array;
pub(crate) mod assertion;
pub(crate) mod branch;
pub(crate) mod builtin_call;
pub(crate) mod clocked;
pub(crate) mod closure;
pub(crate) mod computed;
pub(crate) mod delay;
pub(crate) mod exact;
pub(crate) mod fold;
pub(crate) mod homotopy;
pub(crate) mod jump;
pub(crate) mod known;
pub(crate) mod lower;
pub(crate) mod operator;
pub(crate) mod piecewise;
pub(crate) mod range;
pub(crate) mod record;
pub(crate) mod record_made;
pub(crate) mod reduction;
pub(crate) mod reference;
pub(crate) mod sample;
pub(crate) mod scalar;
pub(crate) mod shape;
pub(crate) mod text;
pub(crate) mod value;

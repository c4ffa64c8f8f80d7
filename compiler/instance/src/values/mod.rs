//! Values at translation: expressions, functions and records of constants and parameters.

pub(crate) mod arithmetic;
pub mod constructor;
pub(crate) mod data_file;
pub(crate) mod evaluate;
mod evaluate_reference;
pub(crate) mod expression_shape;
mod external_call;
mod function_call;
pub(crate) mod function_components;
mod function_value;
pub(crate) mod interpret;
mod of_instances;
mod operate;
pub mod operators;
mod overloads;
pub(crate) mod override_value;
pub(crate) mod parameter_value;
pub(crate) mod parts;
pub mod range;
pub(crate) mod record;
pub(crate) mod record_value;
pub(crate) mod substitute;
pub mod value;
mod written_function;

//! Classes: where they are found, what they inherit, what modifications say of them.

pub mod class;
pub(crate) mod class_lookup;
pub(crate) mod class_rules;
pub(crate) mod heir;
pub(crate) mod import;
pub mod meaning;
pub mod modifier;
pub mod shape;
pub(crate) mod sources;
pub(crate) mod subtype;
pub(crate) mod suggest;
pub(crate) mod trees;

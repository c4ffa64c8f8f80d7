//! Syntax tree to instance tree: names, inheritance, modification, redeclaration, inner/outer, sizes.
//!
//! `class` finds class definitions, `shape` merges a class with its bases, `modifier` gathers what is said about an element,
//! `build` makes the instances, `lookup` resolves names from a scope and `evaluate` computes what must be known at
//! translation.  Rules are those of the Modelica specification 3.6, chapters 4, 5 and 7.  Connections are not looked at here
//! and nothing is expanded: an array of components is one instance.

mod advice;
mod assign;
mod build;
mod builtins;
pub mod class;
mod class_rules;
mod component;
pub mod connection_rules;
pub mod constructor;
mod data_file;
mod declared_unit;
mod demand;
mod evaluate;
mod expression_shape;
mod free_parameter;
mod heir;
mod import;
pub mod instance;
mod interpret;
mod lookup;
pub mod modifier;
mod outer;
mod override_value;
mod parameter_value;
mod part_text;
mod parts;
mod predefined;
mod primitive;
mod print;
pub mod record;
mod record_value;
mod redeclare;
pub mod shape;
mod size;
mod sources;
pub mod substitute;
mod subtype;
mod suggest;
mod target;
mod text;
pub mod value;
mod work;

pub use build::{InstanceTree, Override, instantiate, instantiate_apart};
pub use builtins::{Builtin, SizeFault, SizesOf, sizes_text};
pub use class::{ClassId, ClassTable};
pub use evaluate::Env;
pub use instance::{InstId, Instance, Instances, Known, LocalClass, Primitive, ScalarType, Scope};
pub use lookup::Resolved;
pub use sources::{SourceText, Sources};
pub use value::{EnumType, Value};

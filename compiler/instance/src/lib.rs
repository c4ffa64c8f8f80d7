//! Syntax tree to instance tree: names, inheritance, modification, redeclaration, inner/outer, sizes.
//!
//! `classes` finds class definitions, merges a class with its bases and gathers what is said about an element, `instantiation`
//! makes the instances and resolves names from a scope, `values` computes what must be known at translation, `external` knows functions of
//! other languages, `advice` tells what is unused or hidden.  Rules are those of the Modelica specification 3.6, chapters 4, 5 and 7.  Connections are not looked at here
//! and nothing is expanded: an array of components is one instance.

mod advice;
mod builtins;
mod classes;
pub mod external;
mod instantiation;
mod print;
mod values;

pub use classes::{class, meaning, modifier, shape};
pub use instantiation::{connection_rules, instance};
pub use values::{constructor, operators, range, value};

pub use builtins::{Builtin, Element, Place, SizeFault, SizesOf, sizes_text, speaks_of_connections};
pub use classes::class::{ClassId, ClassTable};
pub use classes::sources::{SourceText, Sources};
pub use classes::trees::Trees;
pub use instantiation::build::{Instantiated, instantiate, instantiate_apart};
pub use instantiation::instance::{InstId, Instance, LocalClass, Primitive, ScalarType, Scope};
pub use instantiation::lookup::Resolved;
pub use instantiation::scopes::{Found, Override, Rooting, Scopes};
pub use instantiation::size::names_boolean;
pub use instantiation::tree::{InstanceTree, Instances};
pub use values::evaluate::Env;
pub use values::function_components::{FunctionComponent, in_order_of_values};
pub use values::value::{EnumType, Value};

//! From a class and its modifications to instances, and names looked up among them.

pub(crate) mod around;
pub(crate) mod build;
pub(crate) mod component;
pub mod connection_rules;
pub(crate) mod declared_unit;
pub(crate) mod demand;
pub(crate) mod expandable;
pub mod instance;
pub(crate) mod lookup;
pub(crate) mod missing_inner;
pub(crate) mod outer;
pub(crate) mod part_text;
pub(crate) mod parts_made;
pub(crate) mod predefined;
pub(crate) mod primitive;
pub(crate) mod rebased;
pub(crate) mod redeclare;
pub(crate) mod scopes;
pub(crate) mod size;
pub(crate) mod target;
pub(crate) mod tree;
pub(crate) mod type_of;
pub(crate) mod work;

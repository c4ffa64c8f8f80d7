//! Connections: what is joined, the equations of it, what is left open.

mod buses;
pub(crate) mod component_balance;
pub(crate) mod connect;
pub(crate) mod connect_sets;
pub(crate) mod connector_match;
pub(crate) mod equality_constraints;
pub(crate) mod foreign_blocks;
pub(crate) mod free_ends;
pub(crate) mod model_ends;
pub(crate) mod open_ends;
pub(crate) mod other_ends;
mod own_input;
pub(crate) mod potentials;
mod short_circuits;
mod streams;
mod terminals;
pub(crate) mod virtual_graph;

//! Equation and algorithm sections.

pub(crate) mod algorithm;
pub(crate) mod discrete_time;
pub(crate) mod followed;
pub(crate) mod hidden_state;
pub(crate) mod if_equation;
pub(crate) mod inject;
pub(crate) mod loops;
pub(crate) mod section;
pub(crate) mod sides;
pub(crate) mod when;
pub(crate) mod when_body;
pub(crate) mod when_condition;
pub(crate) mod when_elements;
pub(crate) mod when_parts;
pub(crate) mod when_values;

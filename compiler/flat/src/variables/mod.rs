//! Variables of instances with their attributes, bindings and start values.

pub(crate) mod element_names;
pub(crate) mod given_value;
pub(crate) mod open_start;
pub(crate) mod texts;
pub(crate) mod variable;

//! Terms of equations: forms that physics knows, built from the quantities at a place, and laws made of them.

pub(crate) mod dictionary;
pub(crate) mod dynamics;
pub(crate) mod law;
pub(crate) mod unit_quotient;

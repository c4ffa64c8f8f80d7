//! The crate as its users see it: unit strings, the rules of checking, and models in other base units.

mod rules;
mod scaling;
mod support;
mod units;

//! Unit checking: a flat model in, mistakes in units and the units of undeclared variables out.
//!
//! [`parse_unit`] reads unit strings; [`check_units`] gives every expression a unit, asks for agreement in sums, relations,
//! equations, branches and arguments, solves for the units of variables that declare none, and reports what does not
//! fit in the user's names.  In sums and equations a literal adopts the unit of the other side; as a factor integers,
//! simple fractions and multiples of pi have no unit, other literals may have any; what would fit if the former had one is a
//! warning.  A variable without `unit` is
//! unknown, not dimensionless; what stays unknown is listed.  A contradiction that rests only on the seconds of `der` and
//! `time`, without any declared unit, is not a mistake: such a model says nothing about units.
//! Equations are looked at once per template and tuple of units.  The flat model holds functions already put in; what their inputs and
//! outputs declare comes along as claims about the expressions in their place ([`hyd_flat::FlatModel::claims`]).

mod check;
mod class;
mod form;
mod infer;
mod parse;
mod place;
mod print;
mod rational;
mod report;
mod solve;
mod symbols;
mod unit;

// What the tests share with an example names the crate as users do.
#[cfg(test)]
extern crate self as hyd_units;
#[cfg(test)]
mod tests;

pub use check::{Inferred, Undecided, UnitReport, check_units, check_units_strictly};
pub use parse::{UnitError, parse_unit, plane_angle};
pub use print::to_text;
pub use rational::Rational;
pub use unit::{BASE_SYMBOLS, Dimension, Unit};

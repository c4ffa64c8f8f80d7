//! The parts that bodies of `when` are taken apart into, and what they set.

use hyd_instance::Scope;
use hyd_source::Span;
use hyd_typed::{Equation, Expr, Iterator, Variable};

use crate::sections::loops::Loops;
use crate::sections::when_condition::WhenCondition;

/// A condition around a part: the condition of its branch holds and none before it.
#[derive(Clone)]
pub(super) struct Guard<'e> {
    pub(super) earlier: Vec<&'e Expr>,
    pub(super) own: Option<&'e Expr>,
}

/// An equation inside a `when` and what is around it there.
#[derive(Clone)]
pub(super) struct Part<'e> {
    pub(super) equation: &'e Equation,
    pub(super) branch: usize,
    pub(super) loops: Vec<&'e Iterator>,
    pub(super) guards: Vec<Guard<'e>>,
}

/// What a part gives a variable: an expression, or one of several outputs of a call.
pub(super) struct Given<'e> {
    pub(super) branch: usize,
    pub(super) guards: Vec<Guard<'e>>,
    pub(super) value: (&'e Expr, Option<usize>),
}

/// A variable set in one or several parts.
pub(super) struct Target<'e> {
    pub(super) left: &'e Expr,
    pub(super) variable: &'e Variable,
    pub(super) loops: Vec<&'e Iterator>,
    pub(super) values: Vec<Given<'e>>,
    pub(super) span: Span,
}

/// The `when` that parts belong to.
#[derive(Clone, Copy)]
pub(super) struct Whole<'w> {
    pub(super) conditions: &'w [Vec<WhenCondition>],
    pub(super) scope: Scope,
    pub(super) loops: &'w Loops<'w>,
}

//! Where variables and equations stand in the text.

use hyd_equations::{EqId, SortedSystem};
use hyd_flat::VarId;
use hyd_source::Span;

/// The text a variable comes from.
pub(crate) fn span_of_variable(sorted: &SortedSystem, v: VarId) -> Span {
    let flat = &sorted.system.flat;
    flat.variables[flat.locate(v).0].origin.span
}

/// The text an equation stands in.
pub(crate) fn span_of(sorted: &SortedSystem, equation: EqId) -> Span {
    sorted.system.flat.equations[sorted.system.equations[equation].block as usize].origin.span
}

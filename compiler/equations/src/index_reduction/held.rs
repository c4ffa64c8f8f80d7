//! Derivatives of what has none: numbers that only events change.

use hyd_flat::Target;
use hyd_source::{Code, Diagnostic};

use crate::explain::faults::{mark_equations, mark_variables};
use crate::system::{EquationSystem, Role};

/// The message about the first discrete variable whose derivative is asked for.
pub(super) fn derivative_of_held(system: &EquationSystem) -> Option<Diagnostic> {
    let found = system.equations.indices().find_map(|eq| {
        let operands = system.operands_of(system.equations[eq].operands);
        let held = operands.iter().find_map(|operand| match operand.target() {
            Target::Der(v) if system.roles[v] == Role::Discrete => Some(v),
            _ => None,
        });
        Some((eq, held?))
    });
    let (eq, v) = found?;
    let name = system.flat.var_name(v);
    let message = format!("`der({name})`: `{name}` changes at events only and has no derivative");
    let help = format!(
        "form the difference where it is set, as `({name} - pre({name}))/interval` in the same `when`, or take the derivative of what it is set from"
    );
    let said = mark_equations(Diagnostic::error(Code::DiscreteTime, message).help(help), system, &[eq]);
    Some(mark_variables(said, system, &[v]))
}

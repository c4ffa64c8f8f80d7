//! `stateSelect = StateSelect.always` is kept or refused.
//!
//! A variable of that kind must be a state (Modelica 3.6, section 4.8.8.1).  It cannot be one if its derivative occurs nowhere,
//! or if equations determine it or make it depend on others of that kind; the message says which.  Weaker wishes weigh when
//! states are chosen and need no check.

use hyd_flat::{StateSelect, VarId};
use hyd_source::{Code, Diagnostic};

use crate::explain::{list_names, mark_variables};
use crate::representative::block_of_variable;
use crate::system::{EquationSystem, Role};

/// An error if a variable that must be a state is none after index reduction.
pub(crate) fn check_always(system: &EquationSystem) -> Option<Diagnostic> {
    let blocks = block_of_variable(&system.flat);
    let refused: Vec<VarId> = system
        .roles
        .iter_enumerated()
        .filter(|&(v, role)| system.is_own(v) && *role == Role::Algebraic)
        .filter(|&(v, _)| system.flat.variables.raw[blocks[v] as usize].state_select == StateSelect::Always)
        .map(|(v, _)| v)
        .collect();
    let &first = refused.first()?;
    let names = list_names(refused.iter().map(|&v| system.flat.var_name(v)));
    let (message, help) = if system.reduction.demoted.contains(&first) {
        let message = format!("{names} cannot be chosen as a state: it depends on other variables through constraints");
        (message, "`StateSelect.prefer` leaves the choice where it cannot be kept")
    } else {
        let message = format!("{names} cannot be a state: its derivative occurs in no equation");
        (message, "leave `stateSelect` out, or write an equation with `der(...)` of it")
    };
    Some(mark_variables(Diagnostic::error(Code::HighIndex, message).help(help), system, &refused))
}

//! `stateSelect`: variables that want to be states although nobody differentiates them; `always` is kept or refused.
//!
//! A variable with `prefer` or `always` may be a state even if its derivative occurs in no equation (Modelica 3.6, section 4.8.8.1):
//! then it gets one, so that what determines the variable is a constraint between states, of which index reduction chooses.
//! `always` cannot be kept if equations determine the variable or make it depend on others of that kind; the message says which.
//! Weaker wishes weigh when states are chosen and need no check.

use hyd_flat::{EquationBlock, Operand, PerElement, Section, StateSelect, Target, VarId, derivative_block};
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::{SlotId, Template};

use crate::alias::representative::{block_of_variable, fixed_as_written};
use crate::explain::faults::{list_names, mark_variables};
use crate::system::{EquationSystem, Role};

/// The system with derivatives of the variables that want to be states and are not differentiated; none if there are no such
/// variables.
pub(crate) fn with_wished_states(system: &EquationSystem) -> Option<EquationSystem> {
    let mut wished: Vec<VarId> = Vec::new();
    for block in system.flat.variables.iter() {
        if block.state_select == PerElement::All(StateSelect::Default) {
            continue;
        }
        let scalars = (0..block.count).map(|k| VarId(block.first.0 + k));
        let wants = |&v: &VarId| {
            block.state_select_of(v) >= StateSelect::Prefer && system.is_own(v) && system.roles[v] == Role::Algebraic
        };
        wished.extend(scalars.filter(wants));
    }
    let &first = wished.first()?;
    let mut flat = fixed_as_written(system);
    let mut operands = Vec::with_capacity(2 * wished.len());
    for &v in &wished {
        let block = flat.locate(v).0;
        let element = (v.0 - flat.variables[block].first.0) as usize;
        let rate = VarId(flat.scalars);
        let made = derivative_block(&flat.variables[block], (element, 1), 1, rate);
        flat.variables.push(made);
        flat.scalars += 1;
        operands.extend([Operand::new(Target::Var(rate)), Operand::new(Target::Der(v))]);
    }
    let arena = &mut flat.templates.arena;
    let (left, right) = (arena.slot(SlotId(0)), arena.slot(SlotId(1)));
    let template = flat.templates.intern(Template { left, right, arity: 2 });
    let origin = flat.variables[flat.locate(first).0].origin.clone();
    let (section, count) = (Section::Continuous, wished.len() as u32);
    flat.equations.push(EquationBlock { section, made: true, template, count, operands, origin });
    crate::build_combined(flat, &system.reduction.combined)
}

/// An error if a variable that must be a state is not one after index reduction.
pub(crate) fn check_always(system: &EquationSystem) -> Option<Diagnostic> {
    let blocks = block_of_variable(&system.flat);
    let refused: Vec<VarId> = system
        .roles
        .iter_enumerated()
        .filter(|&(v, role)| system.is_own(v) && *role == Role::Algebraic)
        .filter(|&(v, _)| system.flat.variables.raw[blocks[v] as usize].state_select_of(v) == StateSelect::Always)
        .map(|(v, _)| v)
        .collect();
    let &first = refused.first()?;
    let names = list_names(refused.iter().map(|&v| system.flat.var_name(v)));
    let (message, help) = if system.reduction.demoted.contains(&first) {
        let message = match refused.len() {
            1 => format!("{names} cannot be chosen as a state: constraints make it depend on other variables"),
            _ => format!("{names} cannot be chosen as states: constraints make them depend on other variables"),
        };
        (message, "use `StateSelect.prefer`, which gives way where it cannot be satisfied")
    } else {
        let message = match refused.len() {
            1 => format!("{names} cannot be a state: its derivative occurs in no equation"),
            _ => format!("{names} cannot be states: their derivatives occur in no equation"),
        };
        (message, "leave out `stateSelect`, or write an equation that contains the derivative")
    };
    Some(mark_variables(Diagnostic::error(Code::HighIndex, message).help(help), system, &refused))
}

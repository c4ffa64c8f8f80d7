//! Equation system to reduced system: constraints between states are differentiated until the index is 1.
//!
//! Pantelides 1988 says which equations, Mattsson and Söderlind 1993 which derivatives become algebraic unknowns (`structure`).
//! Constraints and all their derivatives stay in the system, so that every solution of it satisfies them; drift cannot
//! arise.  Dummy derivatives are variables of their own; many of them rename what the user has declared (`der(y) = vy`),
//! so aliases are eliminated again.  Where the coefficients of the constraints are constant, states are chosen once; where they
//! vary, the choice is left to the run (`selection`), because it may have to change (a pendulum that turns over).
//! Should the variables left open turn out to be equal or further constrained, all is chosen once, at the start values.

mod held;
mod higher;
mod jumps;
pub(crate) mod selection;
mod state_select;
mod structure;
mod time_derivative;
mod vanishing;

use hyd_flat::{EquationBlock, Operand, Section, Target, VarId};
use hyd_source::{Code, Diagnostic, Outcome};
use hyd_symbolic::{SlotId, Template};

use crate::algebra::Algebra;
use crate::alias::eliminate_aliases;
use crate::balance::{check_balance, high_index};
use crate::explain::faults::{list_names, mark_equations, mark_variables};
use crate::explain::floating::with_floating;
use crate::index_reduction::held::derivative_of_held;
use crate::index_reduction::higher::Derivatives;
use crate::index_reduction::jumps::jumps;
use crate::index_reduction::selection::{append_selections, candidates_are_distinct};
use crate::index_reduction::state_select::{check_always, with_wished_states};
use crate::index_reduction::structure::{ReductionPlan, plan_reduction};
use crate::index_reduction::time_derivative::{append_derivatives, replace_rates};
use crate::index_reduction::vanishing::{fix_at_zero, vanishing_parameters};
use crate::system::{EqId, Equation, EquationSystem};

/// Alias elimination between rounds may uncover further constraints; more rounds than this mean a fault.
const MOST_ROUNDS: usize = 8;

/// The system with index 1 or less; none if it is structurally at fault.
pub fn reduce_index(mut system: EquationSystem) -> Outcome<Option<EquationSystem>> {
    if let Some(fault) = derivative_of_held(&system) {
        return Outcome { value: None, diagnostics: vec![fault] };
    }
    // Wishes are kept where they can be; where they cannot, the model is what it is without them.
    if let Some(mut wished) = with_wished_states(&system) {
        let mut diagnostics = Vec::new();
        if reduce(&mut wished, &mut diagnostics).is_ok() && check_always(&wished).is_none() {
            return Outcome { value: Some(wished), diagnostics };
        }
    }
    let mut diagnostics = Vec::new();
    let reduced = reduce(&mut system, &mut diagnostics);
    let value = match reduced.and_then(|()| check_always(&system).map_or(Ok(()), Err)) {
        Ok(()) => Some(system),
        Err(fault) => {
            diagnostics.extend(with_floating(&system, fault));
            None
        }
    };
    Outcome { value, diagnostics }
}

fn reduce(system: &mut EquationSystem, notes: &mut Vec<Diagnostic>) -> Result<(), Diagnostic> {
    let zeros = vanishing_parameters(system);
    if zeros.is_empty() {
        return reduce_as_it_is(system, notes);
    }
    let names = list_names(zeros.iter().map(|&v| system.flat.var_name(v)));
    let (are, they) = if zeros.len() == 1 { ("is", "it is") } else { ("are", "they are") };
    let mut fixed = system.clone();
    fix_at_zero(&mut fixed, &zeros);
    fixed = eliminate_aliases(fixed);
    let mut fixed_notes = Vec::new();
    if reduce_as_it_is(&mut fixed, &mut fixed_notes).is_ok() {
        let message =
            format!("{names} {are} 0, which changes what the equations determine: {they} fixed at translation");
        notes.push(mark_variables(Diagnostic::note(Code::Chosen, message), system, &zeros));
        notes.extend(fixed_notes);
        *system = fixed;
        return Ok(());
    }
    let message = format!("as long as {names} {are} 0, the equations do not determine all unknowns");
    reduce_as_it_is(system, notes)?;
    notes.push(mark_variables(Diagnostic::warning(Code::Singular, message), system, &zeros));
    Ok(())
}

fn reduce_as_it_is(system: &mut EquationSystem, notes: &mut Vec<Diagnostic>) -> Result<(), Diagnostic> {
    if check_balance(system, &mut Algebra::default())?.equations.is_empty() {
        return Ok(());
    }
    let mut open = system.clone();
    let mut open_notes = Vec::new();
    if reduce_rounds(&mut open, &mut open_notes, true).is_ok() {
        *system = open;
        notes.extend(open_notes);
        return Ok(());
    }
    reduce_rounds(system, notes, false)
}

/// With `open`, sets of candidates are made where the choice of states may change; an error if they do not last.
fn reduce_rounds(system: &mut EquationSystem, notes: &mut Vec<Diagnostic>, open: bool) -> Result<(), Diagnostic> {
    for _ in 0..MOST_ROUNDS {
        let mut algebra = Algebra::default();
        let constraints = check_balance(system, &mut algebra)?;
        if constraints.equations.is_empty() {
            return Ok(());
        }
        if !system.reduction.selections.is_empty() {
            return Err(high_index(system, &constraints));
        }
        let plan = plan_reduction(system, &mut algebra, open)?;
        notes.extend(doubt(system, &plan.uncertain));
        notes.extend(jumps(system, &plan.equations));
        apply(system, &plan)?;
        *system = eliminate_aliases(std::mem::take(system));
        if !candidates_are_distinct(system) {
            return Err(high_index(system, &constraints));
        }
    }
    let constraints = check_balance(system, &mut Algebra::default())?;
    if constraints.equations.is_empty() { Ok(()) } else { Err(high_index(system, &constraints)) }
}

/// The start values are singular for some constraints; their states are chosen by structure.
fn doubt(system: &EquationSystem, equations: &[EqId]) -> Option<Diagnostic> {
    let singular = match equations.len() {
        1 => "a constraint between states is".to_string(),
        n => format!("{n} constraints between states are"),
    };
    let message = format!("the choice of states is uncertain: {singular} singular at the start values");
    let note = Diagnostic::note(Code::Chosen, message)
        .help("give better start values, or set `stateSelect` of the variables that should be states");
    (!equations.is_empty()).then(|| mark_equations(note, system, equations))
}

fn apply(system: &mut EquationSystem, plan: &ReductionPlan) -> Result<(), Diagnostic> {
    let variables: Vec<(VarId, u32, u32)> = plan.variables.iter().copied().filter(|entry| entry.1 > 0).collect();
    let open = plan.sets.iter().flat_map(|set| set.candidates.iter().map(|&(_, v, order)| (v, order)));
    let derivatives = Derivatives::make(system, &variables, &open.collect::<Vec<_>>());
    let written = system.operands.len();
    append_derivatives(system, &plan.equations, &derivatives).map_err(|fault| fault.diagnostic(system))?;
    replace_rates(system, written, &derivatives);
    append_chains(system, &derivatives.chains);
    append_selections(system, &plan.sets, &derivatives);
    system.reduction.demoted.sort_unstable();
    Ok(())
}

/// The equations `der(x) = v` of states that are derivatives themselves.
fn append_chains(system: &mut EquationSystem, chains: &[(VarId, VarId)]) {
    let arena = &mut system.flat.templates.arena;
    let (left, right) = (arena.slot(SlotId(0)), arena.slot(SlotId(1)));
    let template = system.flat.templates.intern(Template { left, right, arity: 2 });
    for &(state, rate) in chains {
        let operands = vec![Operand::new(Target::Der(state)), Operand::new(Target::Var(rate))];
        let origin = system.flat.variables[system.flat.locate(state).0].origin.clone();
        let block = system.flat.equations.len() as u32;
        let range = crate::relations::append(system, &operands);
        system.equations.push(Equation { template, operands: range, block, element: 0, order: 0 });
        system.flat.equations.push(EquationBlock {
            section: Section::Continuous,
            made: true,
            template,
            count: 1,
            operands,
            origin,
        });
    }
}

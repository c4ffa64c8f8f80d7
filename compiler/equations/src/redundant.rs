//! Fixed starts that constraints make superfluous.
//!
//! After index reduction the start of a former state may follow from others: a pendulum whose `x` and `y` are both fixed.
//! Such starts become no equations; they stay guesses, and whether they fit is checked when the values at the start are known,
//! because that may depend on parameters that are set later.  An equation between fixed variables and numbers alone is judged
//! here, and refused with the names of the variables if it does not hold.

use hyd_flat::{Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Code, Diagnostic};
use hyd_structure::{Augmentation, Augmenter};

use crate::algebra::Algebra;
use crate::explain::{list_names, mark_equations, mark_variables};
use crate::incidence::{Pattern, Unknowns};
use crate::initial::first_matching;
use crate::start_point::StartPoint;
use crate::system::{EquationSystem, Resolution};

/// An equation holds if it is violated by at most this, relative to its sides or to 1.
const TOLERANCE: f64 = 1e-6;

/// Those of the fixed variables that must not become equations; `pattern` holds the initial system without former states.
pub(crate) fn redundant_starts(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    pattern: &Pattern,
    unknowns: &Unknowns,
    fixed: &[VarId],
) -> Result<Vec<VarId>, Box<Diagnostic>> {
    let former = former_states(system);
    let mut matching = first_matching(system, pattern, unknowns);
    let mut incidence = pattern.incidence.clone();
    let mut augmenter = Augmenter::new();
    let mut redundant = Vec::new();
    let ordered = fixed.iter().filter(|&&v| !former[v]).chain(fixed.iter().filter(|&&v| former[v]));
    for &v in ordered {
        let Some(column) = unknowns.column(Target::Var(v)) else { continue };
        let row = incidence.push_row([column]).expect("invariant: one known column");
        if augmenter.augment(&incidence, &mut matching, row, |_| true) != Augmentation::Matched && former[v] {
            redundant.push(v);
        }
    }
    if !redundant.is_empty() {
        judge(system, algebra, fixed)?;
    }
    Ok(redundant)
}

/// Variables that were states before index reduction, or are equal to one.
fn former_states(system: &EquationSystem) -> IndexVec<VarId, bool> {
    let mut former = IndexVec::filled(false, system.roles.len());
    for &v in &system.reduction.demoted {
        match system.resolution[v] {
            Resolution::Alias { of, .. } => former[of] = true,
            _ => former[v] = true,
        }
    }
    former
}

/// True if a start value is more than a number: it may be set for a run.
fn starts_are_open(system: &EquationSystem, variables: &[VarId]) -> bool {
    let arena = &system.flat.templates.arena;
    system.equations_in(Section::Start).into_iter().any(|eq| {
        let right = system.flat.templates.get(system.equations[eq].template).right;
        let target = system.left_operand(eq).map(|operand| operand.target());
        let ours = matches!(target, Some(Target::Start(v)) if variables.contains(&v));
        ours && arena.as_constant(right).is_none()
    })
}

/// An error if a continuous equation between fixed variables and numbers does not hold.
fn judge(system: &mut EquationSystem, algebra: &mut Algebra, fixed: &[VarId]) -> Result<(), Box<Diagnostic>> {
    let point = StartPoint::new(system, algebra)?;
    let mut is_fixed = IndexVec::filled(false, system.roles.len());
    for &v in fixed {
        is_fixed[v] = true;
    }
    for eq in system.equations_in(Section::Continuous) {
        let equation = system.equations[eq];
        let facts = algebra.facts(&mut system.flat.templates, equation.template).clone();
        let operands: Vec<_> = facts.slots.iter().map(|s| system.operands_of(equation.operands)[s.index()]).collect();
        let variables: Vec<VarId> = operands
            .iter()
            .filter_map(|operand| match operand.target() {
                Target::Var(v) if system.is_continuous(v) => Some(v),
                _ => None,
            })
            .collect();
        let known = |&v: &VarId| is_fixed[v];
        let others = operands.iter().filter(|operand| !matches!(operand.target(), Target::Const(_))).count();
        if others > variables.len()
            || starts_are_open(system, &variables)
            || variables.is_empty()
            || !variables.iter().all(known)
        {
            continue;
        }
        let template = system.flat.templates.get(equation.template);
        let [left, right] = [template.left, template.right].map(|side| point.evaluate(system, side, equation.operands));
        let size = left.abs().max(right.abs()).max(1.0);
        let holds = (left - right).abs() <= TOLERANCE * size;
        if !holds {
            let names = list_names(variables.iter().map(|&v| system.flat.var_name(v)));
            let message = format!("the fixed start values of {names} contradict an equation between them");
            let fault = mark_equations(Diagnostic::error(Code::InitialUnbalanced, message), system, &[eq]);
            return Err(Box::new(mark_variables(fault, system, &variables)));
        }
    }
    Ok(())
}

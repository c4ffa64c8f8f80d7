//! Checks an equation system against what each pass promises; used by tests and by debug builds.
//!
//! Operands lie within their table and name existing variables and numbers; no equation that counts reads a variable that was
//! eliminated; aliases lead to a variable that stands for itself and has the same role; only states and candidates have
//! derivatives.

use hyd_flat::{Section, Target, VarId};

use crate::explain::faults::equation_text;
use crate::system::{EquationSystem, Resolution, Role};

/// What is wrong, if anything is.
pub fn verify_system(system: &EquationSystem) -> Result<(), String> {
    let scalars = system.flat.scalars as usize;
    if (system.roles.len(), system.resolution.len()) != (scalars, scalars) {
        return Err(format!(
            "{scalars} variables, {} roles, {} resolutions",
            system.roles.len(),
            system.resolution.len()
        ));
    }
    for v in system.roles.indices() {
        check_resolution(system, v)?;
    }
    for eq in system.equations.indices() {
        let equation = system.equations[eq];
        let arity = system.flat.templates.get(equation.template).arity;
        if equation.operands.len != arity {
            return Err(format!("{eq}: {} operands for {arity} slots", equation.operands.len));
        }
        if (equation.operands.first + arity) as usize > system.operands.len() {
            return Err(format!("{eq}: operands beyond the table"));
        }
        let text = || equation_text(system, eq);
        for operand in system.operands_of(equation.operands) {
            match operand.target() {
                Target::Var(v) | Target::Pre(v) | Target::Start(v) | Target::Der(v) if v.0 as usize >= scalars => {
                    return Err(format!("{eq}: no variable {v} ({})", text()));
                }
                Target::Der(v) if !matches!(system.roles[v], Role::State | Role::Candidate) => {
                    return Err(format!(
                        "the derivative of `{}`, which is not a state ({})",
                        system.flat.var_name(v),
                        text()
                    ));
                }
                Target::Var(v) | Target::Der(v)
                    if system.section(eq) == Section::Continuous
                        && matches!(system.resolution[v], Resolution::Alias { .. }) =>
                {
                    return Err(format!("`{}` was eliminated, but {} reads it", system.flat.var_name(v), text()));
                }
                Target::Const(c) if c.0 as usize >= system.flat.constants.len() => {
                    return Err(format!("{eq}: no number {c} ({})", text()));
                }
                _ => {}
            }
        }
    }
    Ok(())
}

fn check_resolution(system: &EquationSystem, v: VarId) -> Result<(), String> {
    let Resolution::Alias { of, .. } = system.resolution[v] else { return Ok(()) };
    let (name, other) = (system.flat.var_name(v), system.flat.var_name(of));
    if matches!(system.resolution[of], Resolution::Alias { .. }) {
        return Err(format!("`{name}` is an alias of `{other}`, which is one itself"));
    }
    if system.roles[v] != system.roles[of] {
        return Err(format!("`{name}` is {:?}, its alias `{other}` {:?}", system.roles[v], system.roles[of]));
    }
    Ok(())
}

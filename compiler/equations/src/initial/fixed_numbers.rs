//! Fixed starts of variables that turned out to be numbers, whose start equations went with them.

use hyd_flat::{EquationBlock, Operand, Section, Target, VarId};
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::{Node, NodeId};
use hyd_system::{Variability, told_apart};

use crate::explain::faults::mark_variables;
use crate::initial::contradiction::TOLERANCE;
use crate::system::{EqId, Equation, EquationSystem, Resolution};

/// Where the start is a number, too, it is compared here; the others become conditions `number = start` without an unknown, and are
/// checked when the run starts.
///
/// # Errors
/// A start that is another number.
pub(crate) fn fixed_numbers(system: &mut EquationSystem) -> Result<Vec<(VarId, EqId)>, Box<Diagnostic>> {
    default_starts(system)?;
    let mut undecided = Vec::new();
    for index in 0..system.flat.equations.len() {
        let block = &system.flat.equations[index];
        if block.section != Section::Start {
            continue;
        }
        let template = system.flat.templates.get(block.template);
        let Node::Slot(left) = system.flat.templates.arena.node(template.left) else { continue };
        for element in 0..block.count {
            let mut operands = block.operands_of(element as usize, template.arity as usize).to_vec();
            let place = &mut operands[left.0 as usize];
            let Target::Start(v) = place.target() else { continue };
            let Some(value) = fixed_number(system, v) else { continue };
            *place = Operand::new(Target::Const(value)).signed(place.negated());
            match start_number(system, template.right, &operands) {
                None => undecided.push((v, index, operands)),
                Some(start) => compare(system, v, start, system.flat.constants[value])?,
            }
        }
    }
    Ok(undecided.into_iter().map(|(v, index, operands)| (v, condition(system, index, operands))).collect())
}

/// Starts that nobody wrote are zero.
fn default_starts(system: &EquationSystem) -> Result<(), Box<Diagnostic>> {
    for block in system.flat.variables.iter().filter(|block| !block.has_start && block.made.is_none()) {
        for v in (0..block.count).map(|k| VarId(block.first.0 + k)) {
            if let Some(value) = fixed_number(system, v) {
                compare(system, v, 0.0, system.flat.constants[value])?;
            }
        }
    }
    Ok(())
}

/// The number that a continuous variable with a fixed start turned out to be.
fn fixed_number(system: &EquationSystem, v: VarId) -> Option<hyd_flat::ConstId> {
    let Resolution::Value(value) = system.resolution[v] else { return None };
    let (block, element) = system.flat.locate(v);
    let block = &system.flat.variables[block];
    (block.fixed.get(element) && block.variability == Variability::Continuous).then_some(value)
}

fn compare(system: &EquationSystem, v: VarId, start: f64, known: f64) -> Result<(), Box<Diagnostic>> {
    if (start - known).abs() <= TOLERANCE * start.abs().max(known.abs()).max(1.0) {
        return Ok(());
    }
    let name = system.flat.var_name(v);
    let [start, known] = told_apart(start, known);
    let message = format!("`{name}` is fixed to start at {start}, but the equations make it {known}");
    let help = "leave out `fixed = true`, or set the start value that follows from the equations";
    let diagnostic = Diagnostic::error(Code::InitialUnbalanced, message).help(help);
    Err(Box::new(mark_variables(diagnostic, system, &[v])))
}

/// Appends an initial equation with these operands in place of those of a start equation.
pub(crate) fn condition(system: &mut EquationSystem, start: usize, mut operands: Vec<Operand>) -> EqId {
    for operand in &mut operands {
        *operand = resolved(system, *operand);
    }
    let written = &system.flat.equations[start];
    let (template, origin, block) = (written.template, written.origin.clone(), system.flat.equations.len() as u32);
    let range = crate::relations::append(system, &operands);
    let section = Section::Initial;
    system.flat.equations.push(EquationBlock { section, made: false, template, count: 1, operands, origin });
    system.equations.push(Equation { template, operands: range, block, element: 0, order: 0 })
}

/// What stands for an operand after elimination.
fn resolved(system: &EquationSystem, operand: Operand) -> Operand {
    let Target::Var(v) = operand.target() else { return operand };
    match system.resolution[v] {
        Resolution::Own => operand,
        Resolution::Alias { of, negated } => Operand::new(Target::Var(of)).signed(negated ^ operand.negated()),
        Resolution::Value(value) => Operand::new(Target::Const(value)).signed(operand.negated()),
    }
}

/// The right side of a start equation, if it is a number.
fn start_number(system: &EquationSystem, right: NodeId, operands: &[Operand]) -> Option<f64> {
    let arena = &system.flat.templates.arena;
    if let Some(number) = arena.as_constant(right) {
        return Some(number);
    }
    let Node::Slot(slot) = arena.node(right) else { return None };
    let operand = operands[slot.0 as usize];
    match operand.target() {
        Target::Const(c) => Some(if operand.negated() { -system.flat.constants[c] } else { system.flat.constants[c] }),
        _ => None,
    }
}

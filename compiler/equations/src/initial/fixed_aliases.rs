//! Fixed starts of variables that are equal or opposite to others.
//!
//! Of variables that are equal one stands for all, and takes the start of one of them ([`crate::alias`]).  What the others say of their start
//! must agree with it: where both are numbers they are compared here; the others become conditions that are checked when the run starts, because
//! a parameter may be set until then.

use hyd_flat::{EquationBlock, Operand, Section, Target, VarId};
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::{Node, SlotId, Template};
use hyd_system::{Variability, told_apart};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::alias::representative::block_of_variable;
use crate::explain::faults::mark_variables;
use crate::initial::contradiction::TOLERANCE;
use crate::initial::fixed_numbers::condition;
use crate::system::{EqId, Equation, EquationSystem, Resolution};

/// What a variable says of its start.
struct Said {
    v: VarId,
    /// True if it is the opposite of the one that stands for it.
    negated: bool,
    start: Start,
}

#[derive(Clone, Copy)]
enum Start {
    Number(f64),
    /// An element of a block of start equations.
    Written(usize, usize),
}

/// Conditions for the fixed starts that went with their variables and are not numbers that agree.
///
/// # Errors
/// Equal variables that are fixed at different numbers.
pub(crate) fn fixed_aliases(system: &mut EquationSystem) -> Result<Vec<(VarId, EqId)>, Box<Diagnostic>> {
    let classes = fixed_of_classes(system);
    let counting = counting(system, &classes);
    let mut conditions = Vec::new();
    for (kept, all) in classes {
        check_numbers(system, &all)?;
        if all.iter().all(|own| matches!(own.start, Start::Number(_))) {
            continue;
        }
        // The start that counts is said already; where it is a number, so are all numbers, which agree.
        let counts = counting.get(&kept).map(|&(block, _)| system.flat.equations[block].template);
        let is_number = counts.is_none_or(|template| {
            let right = system.flat.templates.get(template).right;
            system.flat.templates.arena.as_constant(right).is_some()
        });
        for own in all.iter().filter(|own| !is_number || !matches!(own.start, Start::Number(_))) {
            let is_counted = |start: &Start| matches!(start, Start::Written(block, element) if counting.get(&kept) == Some(&(*block, *element)));
            if !is_counted(&own.start) {
                conditions.push((own.v, said_of_kept(system, kept, own)));
            }
        }
    }
    Ok(conditions)
}

/// What is said of the start of each variable that stands for others, in the order of declaration, where at least two of them are fixed.
fn fixed_of_classes(system: &EquationSystem) -> Vec<(VarId, Vec<Said>)> {
    let flat = &system.flat;
    let is_alias = |v: VarId| matches!(system.resolution[v], Resolution::Alias { .. });
    let by_others: FxHashSet<VarId> = system.fixed_by_others.iter().copied().collect();
    let blocks = block_of_variable(flat);
    let is_fixed = |v: VarId| {
        let block = &flat.variables.raw[blocks[v] as usize];
        block.variability == Variability::Continuous
            && block.fixed.get((v.0 - block.first.0) as usize)
            && !by_others.contains(&v)
    };
    let fixed: Vec<VarId> = system.roles.indices().filter(|&v| is_fixed(v)).collect();
    if !fixed.iter().any(|&v| is_alias(v)) {
        return Vec::new();
    }
    let mut written = written_starts(system, &fixed);
    let mut places: FxHashMap<VarId, usize> = FxHashMap::default();
    let mut classes: Vec<(VarId, Vec<Said>)> = Vec::new();
    for v in fixed {
        let (kept, negated) = match system.resolution[v] {
            Resolution::Own => (v, false),
            Resolution::Alias { of, negated } => (of, negated),
            Resolution::Value(_) => continue,
        };
        // What nobody wrote is zero.
        let is_made = flat.variables.raw[blocks[v] as usize].made.is_some();
        let Some(start) = written.remove(&v).or((!is_made).then_some(Start::Number(0.0))) else { continue };
        let place = *places.entry(kept).or_insert_with(|| {
            classes.push((kept, Vec::new()));
            classes.len() - 1
        });
        classes[place].1.push(Said { v, negated, start });
    }
    classes.retain(|(_, all)| all.len() > 1);
    classes
}

/// The start equations of variables, those that no longer count included.
fn written_starts(system: &EquationSystem, variables: &[VarId]) -> FxHashMap<VarId, Start> {
    let wanted: FxHashSet<VarId> = variables.iter().copied().collect();
    let (flat, arena) = (&system.flat, &system.flat.templates.arena);
    let mut found = FxHashMap::default();
    for (number, block) in flat.equations.iter().enumerate().filter(|(_, block)| block.section == Section::Start) {
        let template = flat.templates.get(block.template);
        let Node::Slot(left) = arena.node(template.left) else { continue };
        for element in 0..block.count as usize {
            let operand = block.operands_of(element, template.arity as usize)[left.0 as usize];
            let Target::Start(v) = operand.target() else { continue };
            if wanted.contains(&v) {
                let start = match arena.as_constant(template.right) {
                    Some(value) => Start::Number(if operand.negated() { -value } else { value }),
                    None => Start::Written(number, element),
                };
                found.insert(v, start);
            }
        }
    }
    found
}

/// The start equations that count, of the variables that stand for others: block and element.
fn counting(system: &EquationSystem, classes: &[(VarId, Vec<Said>)]) -> FxHashMap<VarId, (usize, usize)> {
    if classes.is_empty() {
        return FxHashMap::default();
    }
    let wanted: FxHashSet<VarId> = classes.iter().map(|(kept, _)| *kept).collect();
    let own = |eq: EqId| match system.left_operand(eq)?.target() {
        Target::Start(v) if wanted.contains(&v) => {
            let equation = system.equations[eq];
            Some((v, (equation.block as usize, equation.element as usize)))
        }
        _ => None,
    };
    system.equations_in(Section::Start).into_iter().filter_map(own).collect()
}

/// Compares those that are numbers.
fn check_numbers(system: &EquationSystem, all: &[Said]) -> Result<(), Box<Diagnostic>> {
    let number = |own: &Said| match own.start {
        Start::Number(value) => Some((own.v, value, if own.negated { -value } else { value })),
        Start::Written(..) => None,
    };
    let mut numbers = all.iter().filter_map(number);
    let Some((other, said_before, before)) = numbers.next() else { return Ok(()) };
    for (v, said, value) in numbers {
        if (before - value).abs() > TOLERANCE * before.abs().max(value.abs()).max(1.0) {
            let (one, two) = (system.flat.var_name(other), system.flat.var_name(v));
            let [first, second] = told_apart(said_before, said);
            let message = format!(
                "the start values of `{one}` and `{two}` contradict each other: they are equal or opposite, but fixed at {first} and \
                 {second}"
            );
            let diagnostic = Diagnostic::error(Code::InitialUnbalanced, message);
            let diagnostic =
                diagnostic.help(format!("remove `fixed = true` from `{one}` or `{two}`, or give both the same start"));
            return Err(Box::new(mark_variables(diagnostic, system, &[other, v])));
        }
    }
    Ok(())
}

/// What a variable says of its start as an initial equation of the one that stands for it.
fn said_of_kept(system: &mut EquationSystem, kept: VarId, own: &Said) -> EqId {
    match own.start {
        Start::Written(block, element) => {
            let written = &system.flat.equations[block];
            let arity = system.flat.templates.get(written.template).arity as usize;
            let of_kept = |operand: &Operand| match operand.target() {
                Target::Start(v) if v == own.v => {
                    Operand::new(Target::Var(kept)).signed(operand.negated() ^ own.negated)
                }
                _ => *operand,
            };
            let operands = written.operands_of(element, arity).iter().map(of_kept).collect();
            condition(system, block, operands)
        }
        Start::Number(value) => {
            let value = system.flat.constants.push(value);
            let arena = &mut system.flat.templates.arena;
            let (left, right) = (arena.slot(SlotId(0)), arena.slot(SlotId(1)));
            let template = system.flat.templates.intern(Template { left, right, arity: 2 });
            let origin = system.flat.variables[system.flat.locate(own.v).0].origin.clone();
            let operands =
                vec![Operand::new(Target::Var(kept)).signed(own.negated), Operand::new(Target::Const(value))];
            let range = crate::relations::append(system, &operands);
            let (section, block) = (Section::Initial, system.flat.equations.len() as u32);
            system.flat.equations.push(EquationBlock { section, made: false, template, count: 1, operands, origin });
            system.equations.push(Equation { template, operands: range, block, element: 0, order: 0 })
        }
    }
}

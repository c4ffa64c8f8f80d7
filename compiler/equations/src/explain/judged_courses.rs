//! How the variables that a failed assertion compares came to where they are: from which values to which, and by what.
//!
//! An assertion says what must not be and nothing of why it came about.  The nearest answer is the equation that says what the variable is: of what
//! it is made, and which of that has changed.

use hyd_flat::{EquationBlock, FlatModel, Operand, Section, Target, VarId};
use hyd_index::TypedIndex;
use hyd_source::Span;
use hyd_symbolic::{Node, Template};
use hyd_system::{Variability, significant};

/// Variables that are told, and of each what it is made of.
const MOST: usize = 3;
/// Changes below this part of the larger value are none.
const CHANGE: f64 = 1e-3;

/// Sentences about the variables of the assertion that begins in this place.  `value`: that of a variable at the start and at the end, by its name.
pub fn judged_courses(flat: &FlatModel, assertion: Span, value: &dyn Fn(&str) -> Option<(f64, f64)>) -> Vec<String> {
    let is_it = |block: &&EquationBlock| {
        let own = block.origin.span;
        matches!(block.section, Section::Assert(_) | Section::AssertOnce(_))
            && own.file == assertion.file
            && (assertion.start..assertion.end).contains(&own.start)
    };
    let mut judged: Vec<VarId> = Vec::new();
    for operand in flat.equations.iter().filter(is_it).flat_map(|block| &block.operands) {
        if let Some(v) = continuous(flat, *operand)
            && !judged.contains(&v)
        {
            judged.push(v);
        }
    }
    if judged.len() > MOST {
        return Vec::new();
    }
    judged.into_iter().filter_map(|v| course_of(flat, v, value)).collect()
}

fn course_of(flat: &FlatModel, v: VarId, value: &dyn Fn(&str) -> Option<(f64, f64)>) -> Option<String> {
    let own = course(flat, v, value)?;
    let made = definitions(flat, v).next().map(|(block, template, k)| {
        let operands = block.operands_of(k, template.arity as usize);
        let mut parts: Vec<VarId> = Vec::new();
        for part in operands.iter().filter_map(|operand| continuous(flat, *operand)) {
            if part != v && !parts.contains(&part) {
                parts.push(part);
            }
        }
        let told: Vec<String> = parts.into_iter().filter_map(|part| course(flat, part, value)).take(MOST).collect();
        let (left, right) = flat.written_sides(&template, operands);
        (format!("{left} = {right}"), told)
    });
    match made {
        Some((equation, parts)) if !parts.is_empty() => Some(format!("{own}; in `{equation}` {}", parts.join(", "))),
        _ => Some(own),
    }
}

/// Equations that say what a variable is.
fn definitions(flat: &FlatModel, v: VarId) -> impl Iterator<Item = (&EquationBlock, Template, usize)> {
    let blocks = flat.equations.iter().filter(|block| block.section == Section::Continuous && !block.made);
    blocks.flat_map(move |block| {
        let template = flat.templates.get(block.template);
        let slot = match flat.templates.arena.node(template.left) {
            Node::Slot(slot) => Some(slot.index()),
            _ => None,
        };
        let is_own = move |k: &usize| {
            let operands = block.operands_of(*k, template.arity as usize);
            slot.is_some_and(|slot| operands[slot].target() == Target::Var(v)) && operands.len() > 1
        };
        (0..block.count as usize).filter(is_own).map(move |k| (block, template, k))
    })
}

fn continuous(flat: &FlatModel, operand: Operand) -> Option<VarId> {
    let Target::Var(v) = operand.target() else { return None };
    let block = &flat.variables[flat.locate(v).0];
    (block.variability == Variability::Continuous && block.made.is_none()).then_some(v)
}

/// From where to where a variable has gone; none where it stands still.
fn course(flat: &FlatModel, v: VarId, value: &dyn Fn(&str) -> Option<(f64, f64)>) -> Option<String> {
    let name = flat.var_name(v);
    let (from, to) = value(&name)?;
    if (to - from).abs() <= CHANGE * from.abs().max(to.abs()) {
        return None;
    }
    let (block, k) = flat.locate(v);
    let block = &flat.variables[block];
    let unit = block.element_units.get(k).or(block.unit.as_ref()).filter(|unit| &***unit != "1");
    let unit = unit.map(|unit| format!(" {unit}")).unwrap_or_default();
    Some(format!("`{name}` goes from {} to {}{unit}", significant(from), significant(to)))
}

//! Conditions of `when` that hold all through a run, so that nothing in them was ever done.
//!
//! A `when` acts at the moment at which its condition becomes true; one that is true at the start does not become so.  Nobody sees that in the
//! text, and what fails for it is something else.

use hyd_flat::{EquationBlock, FlatModel, Made, Section, Target};
use hyd_index::TypedIndex;
use hyd_source::Span;
use hyd_symbolic::{Evaluator, Node, SlotId, Template, post_order};

/// The comparisons that are true in all rows, as they are written, and where.  `value` gives the value of a variable in a row by its name, `times` the
/// time of each row (s).
pub fn held_conditions(
    flat: &FlatModel,
    times: &[f64],
    value: &dyn Fn(usize, &str) -> Option<f64>,
) -> Vec<(String, Span)> {
    let mut found = Vec::new();
    for block in flat.equations.iter().filter(|block| block.section == Section::Discrete) {
        let template = flat.templates.get(block.template);
        let arena = &flat.templates.arena;
        let is_comparison = post_order(arena, &[template.right])
            .into_iter()
            .any(|node| matches!(arena.node(node), Node::Compare(..) | Node::Event(..)));
        if !is_comparison {
            continue;
        }
        let elements = (0..block.count as usize).filter(|&k| is_condition(flat, block, &template, k));
        for k in elements {
            if holds(flat, (block, &template, k), times, value) {
                let operands = block.operands_of(k, template.arity as usize);
                found.push((flat.written_sides(&template, operands).1, block.origin.span));
            }
        }
    }
    found
}

/// True for the condition of a `when`, which the translation names.
fn is_condition(flat: &FlatModel, block: &EquationBlock, template: &Template, k: usize) -> bool {
    let Node::Slot(left) = flat.templates.arena.node(template.left) else { return false };
    let Target::Var(v) = block.operands_of(k, template.arity as usize)[left.index()].target() else { return false };
    flat.variables[flat.locate(v).0].made == Some(Made::Event) && flat.var_name(v).starts_with("$when")
}

fn holds(
    flat: &FlatModel,
    (block, template, k): (&EquationBlock, &Template, usize),
    times: &[f64],
    value: &dyn Fn(usize, &str) -> Option<f64>,
) -> bool {
    let operands = block.operands_of(k, template.arity as usize);
    let roots = [template.right];
    let mut evaluator = Evaluator::new(&flat.templates.arena, &roots);
    let mut is_true = |(row, &time): (usize, &f64)| {
        let read = |slot: SlotId| {
            let operand = operands[slot.index()];
            let value = match operand.target() {
                Target::Const(c) => flat.constants[c],
                Target::Var(v) => value(row, &flat.var_name(v)).unwrap_or(f64::NAN),
                _ => f64::NAN,
            };
            if operand.negated() { -value } else { value }
        };
        evaluator.evaluate(read, time, row == 0)[0] == 1.0
    };
    !times.is_empty() && times.iter().enumerate().all(&mut is_true)
}

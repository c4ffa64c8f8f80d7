//! Conditions of `when` that hold all through a run, so that nothing in them was ever done.
//!
//! A `when` acts at the moment at which its condition becomes true; one that is true at the start does not become so.  Nobody sees that in the
//! text, and what fails for it is something else.

use hyd_flat::{EquationBlock, FlatModel, Made, Operand, Section, Target};
use hyd_index::TypedIndex;
use hyd_source::Span;
use hyd_symbolic::{Evaluator, Node, SlotId, Template, post_order};
use rustc_hash::FxHashSet;

/// The comparisons that are true in all rows, as they are written, and where.  `value` gives the value of a variable in a row by its name, `times` the
/// time of each row (s).
pub fn held_conditions(
    flat: &FlatModel,
    times: &[f64],
    value: &dyn Fn(usize, &str) -> Option<f64>,
) -> Vec<(String, Span)> {
    let mut found = Vec::new();
    let asked_at_the_start = asked_at_the_start(flat);
    for block in flat.equations.iter().filter(|block| block.section == Section::Discrete) {
        let template = flat.templates.get(block.template);
        let arena = &flat.templates.arena;
        let is_comparison = post_order(arena, &[template.right])
            .into_iter()
            .any(|node| matches!(arena.node(node), Node::Compare(..) | Node::Event(..)));
        if !is_comparison {
            continue;
        }
        let arity = template.arity as usize;
        for k in 0..block.count as usize {
            let Some(name) = condition(flat, block, &template, k) else { continue };
            if asked_at_the_start.contains(of_when(&name)) {
                continue;
            }
            if holds(flat, (block, &template, k), times, value) {
                let operands = block.operands_of(k, arity);
                found.push((flat.written_sides(&template, operands).1, block.origin.span));
            }
        }
    }
    found
}

/// The name that the translation has given to the condition of a `when`; none for another variable.
fn condition(flat: &FlatModel, block: &EquationBlock, template: &Template, k: usize) -> Option<String> {
    let Node::Slot(left) = flat.templates.arena.node(template.left) else { return None };
    let Target::Var(v) = block.operands_of(k, template.arity as usize)[left.index()].target() else { return None };
    let is_made = flat.variables[flat.locate(v).0].made == Some(Made::Event);
    Some(flat.var_name(v)).filter(|name| is_made && name.starts_with("$when"))
}

/// The `when` of a condition by its number: `$when2` of `$when2.1.3`.
fn of_when(name: &str) -> &str {
    name.split('.').next().unwrap_or(name)
}

/// The `when` of which one condition is `initial()`: they act at the start, whatever else they ask.
fn asked_at_the_start(flat: &FlatModel) -> FxHashSet<String> {
    let mut found = FxHashSet::default();
    let arena = &flat.templates.arena;
    let is_initial = |node| matches!(arena.node(node), Node::Initial);
    for block in &flat.equations {
        let template = flat.templates.get(block.template);
        let nodes = post_order(arena, &[template.right]);
        // As a part of a condition (`when initial() or h > 1`) ...
        if block.section == Section::Discrete && nodes.iter().any(|&node| is_initial(node)) {
            for k in 0..block.count as usize {
                found.extend(condition(flat, block, &template, k).map(|name| of_when(&name).to_string()));
            }
        }
        // ... and as one of several (`when {initial(), h > 1}`), in what they set.
        let beside = nodes
            .iter()
            .filter(|&&node| matches!(arena.node(node), Node::Or(one, other) if is_initial(one) || is_initial(other)));
        for &node in beside {
            let slots = post_order(arena, &[node]).into_iter().filter_map(|node| match arena.node(node) {
                Node::Slot(slot) => Some(slot.index()),
                _ => None,
            });
            for slot in slots {
                for k in 0..block.count as usize {
                    let operands = block.operands_of(k, template.arity as usize);
                    if let Target::Var(v) = operands[slot].target() {
                        found.insert(of_when(&flat.var_name(v)).to_string());
                    }
                }
            }
        }
    }
    found
}

fn holds(
    flat: &FlatModel,
    (block, template, k): (&EquationBlock, &Template, usize),
    times: &[f64],
    value: &dyn Fn(usize, &str) -> Option<f64>,
) -> bool {
    let operands = block.operands_of(k, template.arity as usize);
    // Of what cannot be read, such as a value from before an event, nothing is known.
    let is_read = |operand: &Operand| match operand.target() {
        Target::Const(_) => true,
        Target::Var(v) => flat.variables[flat.locate(v).0].made.is_some() || value(0, &flat.var_name(v)).is_some(),
        _ => false,
    };
    if !operands.iter().all(is_read) {
        return false;
    }
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

//! The sorted system and the Jacobian as text.
//!
//! Blocks are numbered in the order of solution; an assignment reads `p := ...`, what is left to the solver
//! `solve: 0 = ... for x`.  Line-based and stable, for snapshots and `hyd equations`.

use std::fmt;
use std::fmt::Write;

use hyd_flat::{Operand, Target};
use hyd_index::TypedIndex;

use crate::jacobian::PlanJacobian;
use crate::print::{expression, section};
use crate::sorted::{Assignment, Block, Plan, SortedSystem, Trigger};
use crate::system::{EquationSystem, Role};

/// The sorted system as text.
pub fn print_sorted(sorted: &SortedSystem) -> String {
    let system = &sorted.system;
    let mut text = String::new();
    let by_value = |a: &Assignment| a.value;
    let line = |a: &Assignment| assignment(system, a);
    section(&mut text, "before the run", &sorted.bindings, by_value, line);
    section(&mut text, "starts", &sorted.starts, by_value, line);
    print_blocks(&mut text, "initial", system, &sorted.initial);
    print_blocks(&mut text, "simulation", system, &sorted.simulation);
    section(&mut text, "at events", &sorted.discrete, by_value, line);
    section(&mut text, "reinit", &sorted.reinits, by_value, line);
    let numbered: Vec<usize> = (0..sorted.relations.len()).collect();
    section(&mut text, "relations", &numbered, |&k| sorted.relations[k].truth, |&k| relation(sorted, k));
    section(
        &mut text,
        "checks",
        &sorted.checks,
        |c| c.condition.value,
        |c| {
            let kind = if c.terminate { "terminate when" } else { "assert" };
            format!("{kind} {}", expression(system, c.condition.value, c.condition.operands))
        },
    );
    text
}

impl fmt::Display for SortedSystem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&print_sorted(self))
    }
}

fn target_name(system: &EquationSystem, target: Target) -> String {
    system.flat.operand_name(Operand::new(target))
}

fn assignment(system: &EquationSystem, a: &Assignment) -> String {
    format!("{} := {}", target_name(system, a.target), expression(system, a.value, a.operands))
}

fn relation(sorted: &SortedSystem, k: usize) -> String {
    let relation = sorted.relations[k];
    let text = expression(&sorted.system, relation.truth, relation.operands);
    let text = text.strip_prefix("noEvent(").and_then(|t| t.strip_suffix(')')).unwrap_or(&text);
    match relation.trigger {
        Trigger::State => format!("{}: {text}", k + 1),
        Trigger::Time(at) => {
            format!("{}: {text}, at time {}", k + 1, expression(&sorted.system, at, relation.operands))
        }
    }
}

fn print_blocks(text: &mut String, title: &str, system: &EquationSystem, plan: &Plan) {
    let unknowns = plan.unknowns.len();
    let _ = writeln!(text, "{title}: {} assignments, {unknowns} unknowns for the solver", plan.assignments.len());
    let numbered: Vec<usize> = (0..plan.blocks.len()).collect();
    section(
        text,
        &format!("{title} blocks"),
        &numbered,
        |&k| block_key(plan, k),
        |&k| format!("{}: {}", k + 1, block(system, plan, &plan.blocks[k])),
    );
}

/// Blocks of one equation of the same expression are neighbours of one kind; others stand alone.
fn block_key(plan: &Plan, k: usize) -> (u32, usize) {
    let block = &plan.blocks[k];
    match (block.assignments.as_slice(), block.residuals.as_slice()) {
        (&[a], []) => (plan.assignments[a as usize].value.0, usize::MAX),
        ([], &[r]) => (plan.residuals[r as usize].value.0, usize::MAX - 1),
        _ => (u32::MAX, k),
    }
}

fn block(system: &EquationSystem, plan: &Plan, block: &Block) -> String {
    let mut lines: Vec<String> =
        block.assignments.iter().map(|&a| assignment(system, &plan.assignments[a as usize])).collect();
    if !block.residuals.is_empty() {
        let rows = block.residuals.iter().map(|&r| plan.residuals[r as usize]);
        let rows: Vec<String> = rows.map(|r| format!("0 = {}", expression(system, r.value, r.operands))).collect();
        let names = block.unknowns.iter().map(|&u| plan.unknowns[u as usize]);
        let names: Vec<String> = names
            .map(|u| match (u.differential, u.target) {
                (true, Target::Var(v)) if system.roles[v] == Role::State => target_name(system, Target::Der(v)),
                (_, target) => target_name(system, target),
            })
            .collect();
        lines.push(format!("solve: {}  for {}", rows.join(", "), names.join(", ")));
    }
    lines.join("\n     ")
}

/// The partial derivatives of a plan and its pattern as text.
pub fn print_jacobian(system: &EquationSystem, plan: &Plan, jacobian: &PlanJacobian) -> String {
    let mut text = String::new();
    let count = plan.assignments.len();
    let rows: Vec<usize> = (0..jacobian.form_of_row.len()).collect();
    section(
        &mut text,
        "partial derivatives",
        &rows,
        |&r| jacobian.form_of_row[r],
        |&r| {
            let (name, operands) = match r < count {
                true => (target_name(system, plan.assignments[r].target), plan.assignments[r].operands),
                false => (format!("residual {}", r - count + 1), plan.residuals[r - count].operands),
            };
            let reads = system.operands_of(operands);
            let partials = jacobian.partials(r).iter().map(|&(slot, partial)| {
                let value = system.flat.print_partial(partial, reads, slot);
                format!("d({name})/d({}) = {value}", system.flat.target_name(reads[slot.index()]))
            });
            let list: Vec<String> = partials.collect();
            if list.is_empty() { format!("d({name}) = 0") } else { list.join("\n  ") }
        },
    );
    let unknowns: Vec<usize> = (0..plan.residuals.len()).collect();
    section(
        &mut text,
        "pattern",
        &unknowns,
        |&k| jacobian.form_of_row[count + k],
        |&k| {
            let names = jacobian.support.row(count + k).iter().map(|&column| column_name(system, plan, column));
            format!("residual {}: {}", k + 1, names.collect::<Vec<_>>().join(", "))
        },
    );
    text
}

fn column_name(system: &EquationSystem, plan: &Plan, column: u32) -> String {
    let count = plan.unknowns.len();
    match (plan.unknowns.get(column as usize), plan.unknowns.get((column as usize).wrapping_sub(count))) {
        (Some(unknown), _) => target_name(system, unknown.target),
        (None, Some(unknown)) => match unknown.target {
            Target::Var(v) => target_name(system, Target::Der(v)),
            target => target_name(system, target),
        },
        (None, None) => format!("column {column}"),
    }
}

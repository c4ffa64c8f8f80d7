//! The sorted system and the Jacobian as text.
//!
//! Blocks are numbered in the order of solution; an assignment reads `p := ...`, what is left to the solver
//! `solve: 0 = ... for x`.  Line-based and stable, for snapshots and `hyd equations`.

use std::fmt;
use std::fmt::Write;

use hyd_flat::{BlockId, Operand, Target};
use hyd_index::TypedIndex;
use hyd_system::CheckKind;
use rustc_hash::FxHashMap;

use crate::alias::representative::block_of_variable;
use crate::explain::faults::variable_of;
use crate::explain::print::{LONGEST_RUN, expression, section};
use crate::jacobian::PlanJacobian;
use crate::plan::linearity::is_linear;
use crate::sorted::{Assignment, Block, Plan, SortedSystem, Trigger};
use crate::system::{EquationSystem, Role};

/// The sorted system as text.
pub fn print_sorted(sorted: &SortedSystem) -> String {
    let system = &sorted.system;
    let mut text = String::new();
    let blocks = block_of_variable(&system.flat);
    let by_value = |a: &Assignment| (a.value, variable_of(a.target).map(|v| blocks[v]));
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
            let kind = match c.kind {
                CheckKind::Assert => "assert",
                CheckKind::AssertOnce => "fail when",
                CheckKind::Terminate => "terminate when",
            };
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
    let operands = system.operands_of(a.operands);
    let value = system.flat.print_as(system.flat.kind_of(a.target), a.value, operands);
    format!("{} := {value}", target_name(system, a.target))
}

fn relation(sorted: &SortedSystem, k: usize) -> String {
    let relation = sorted.relations[k];
    let text = expression(&sorted.system, relation.truth, relation.operands);
    let text = text.strip_prefix("noEvent(").and_then(|t| t.strip_suffix(')')).unwrap_or(&text);
    match relation.trigger {
        Trigger::State => format!("{}: {text}", k + 1),
        Trigger::Time { instant, right_after, .. } => {
            let when = if right_after { "right after time" } else { "at time" };
            format!("{}: {text}, {when} {}", k + 1, expression(&sorted.system, instant, relation.operands))
        }
    }
}

fn print_blocks(text: &mut String, title: &str, system: &EquationSystem, plan: &Plan) {
    let unknowns = plan.unknowns.len();
    let _ = writeln!(text, "{title}: {} assignments, {unknowns} unknowns for the solver", plan.assignments.len());
    section(
        text,
        &format!("{title} blocks"),
        &loops_together(system, plan),
        |&k| block_key(system, plan, k),
        |&k| format!("{}: {}", k + 1, block(system, plan, plan.blocks.get(k))),
    );
}

/// Expression and array of a block of one equation, or the block's own number.
type BlockKey = (u32, Option<BlockId>, usize);

/// The numbers of the blocks; long loops, whose blocks alternate with others, stand together where the first of them is.
fn loops_together(system: &EquationSystem, plan: &Plan) -> Vec<usize> {
    let mut members: FxHashMap<BlockKey, Vec<usize>> = FxHashMap::default();
    for k in 0..plan.blocks.len() {
        members.entry(block_key(system, plan, k)).or_default().push(k);
    }
    let mut order = Vec::with_capacity(plan.blocks.len());
    for k in 0..plan.blocks.len() {
        let own = &members[&block_key(system, plan, k)];
        match own.len() > LONGEST_RUN {
            true if own[0] == k => order.extend_from_slice(own),
            true => {}
            false => order.push(k),
        }
    }
    order
}

/// Blocks of one equation of the same expression are neighbours of one kind; others stand alone.
fn block_key(system: &EquationSystem, plan: &Plan, k: usize) -> BlockKey {
    let block = plan.blocks.get(k);
    let array = |target: Target| variable_of(target).map(|v| system.flat.locate(v).0);
    match (block.assignments, block.residuals) {
        (&[a], []) => (plan.assignments[a as usize].value.0, array(plan.assignments[a as usize].target), usize::MAX),
        ([], &[r]) => (
            plan.residuals[r as usize].value.0,
            array(plan.unknowns[block.unknowns[0] as usize].target),
            usize::MAX - 1,
        ),
        _ => (u32::MAX, None, k),
    }
}

fn block(system: &EquationSystem, plan: &Plan, block: Block<'_>) -> String {
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
        // What one unknown alone is determined by is not a system.
        let kind = match block.assignments.len() + block.residuals.len() {
            1 => "solve",
            _ if is_linear(system, plan, block) => "solve linear",
            _ => "solve nonlinear",
        };
        lines.push(format!("{kind}: {}  for {}", rows.join(", "), names.join(", ")));
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

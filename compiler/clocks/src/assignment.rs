//! Clocked equations to discrete ones: which equation determines which variable, and what it makes of it at a tick.

use hyd_flat::{ClockKind, EquationBlock, FlatModel, Operand, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Code, Diagnostic, Origin};
use hyd_structure::{Column, Entry, Incidence, Matching, block_order, maximum_matching};
use hyd_symbolic::{Node, NodeId, SlotId, TemplateId, canonical, solve_for, substitute, substitute_one};
use hyd_system::Variability;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::partition::{PartitionId, Partitions, is_running};
use crate::ticks::Ticks;

/// A clocked equation, scalar.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    template: TemplateId,
    pub operands: Vec<Operand>,
    /// The block that its text is of.
    pub block: u32,
    pub partition: PartitionId,
    made: bool,
}

impl Row {
    /// `left = right` over slots that read `operands`, in the place of another row.
    pub(crate) fn made(flat: &mut FlatModel, left: NodeId, right: NodeId, operands: &[Operand], of: &Self) -> Self {
        let (template, order) = canonical(&mut flat.templates.arena, left, right);
        let template = flat.templates.intern(template);
        let operands = order.iter().map(|slot| operands[slot.index()]).collect();
        Self { template, operands, block: of.block, partition: of.partition, made: true }
    }
}

/// Turns clocked equations, which also determine these rates, into discrete equations that hold at ticks.
pub(crate) fn assign(
    flat: &mut FlatModel,
    partitions: &Partitions,
    ticks: &Ticks,
    (rows, rates): (&[Row], &[VarId]),
    diagnostics: &mut Vec<Diagnostic>,
) {
    let (unknowns, columns) = unknowns(flat, partitions, rates);
    for &v in &unknowns {
        let (block, _) = flat.locate(v);
        flat.variables[block].variability = Variability::Discrete;
    }
    // What one template is, solved for one of its slots, is worked out once.
    let mut solved: FxHashMap<(TemplateId, SlotId), Option<NodeId>> = FxHashMap::default();
    let mut value = |flat: &mut FlatModel, template: TemplateId, slot: SlotId| {
        *solved.entry((template, slot)).or_insert_with(|| {
            let sides = flat.templates.get(template);
            solve_for(&mut flat.templates.arena, sides.left, sides.right, slot).map(|solution| solution.value)
        })
    };
    let mut incidence = Incidence::new(unknowns.len());
    let mut classes: IndexVec<Entry, u8> = IndexVec::new();
    let mut slots: Vec<FxHashMap<Column, SlotId>> = Vec::with_capacity(rows.len());
    for row in rows {
        let mut own: FxHashMap<Column, SlotId> = FxHashMap::default();
        for (k, operand) in row.operands.iter().enumerate() {
            if let Target::Var(v) = operand.target()
                && let Some(&column) = columns.get(&v)
            {
                own.entry(column).or_insert(SlotId::new(k));
            }
        }
        let mut sorted: Vec<Column> = own.keys().copied().collect();
        sorted.sort_unstable();
        let left = match flat.templates.arena.node(flat.templates.get(row.template).left) {
            Node::Slot(slot) => Some(slot),
            _ => None,
        };
        for column in &sorted {
            let slot = own[column];
            let class = match value(flat, row.template, slot) {
                _ if left == Some(slot) => 0,
                Some(_) => 1,
                None => 2,
            };
            classes.push(class);
        }
        incidence.push_row(sorted).expect("invariant: columns are numbered below their count");
        slots.push(own);
    }
    let matching = maximum_matching(&incidence, Some(&classes));
    if !matching.is_perfect() {
        diagnostics.push(unbalanced(flat, rows, &unknowns, &matching));
        return;
    }
    let blocks = block_order(&incidence, &matching).expect("invariant: the matching is perfect, checked above");
    let mut finished: Vec<Option<(VarId, EquationBlock)>> = vec![None; rows.len()];
    for block in blocks.blocks() {
        let (members, _) = blocks.block(block);
        let pairs: Vec<(usize, VarId, SlotId)> = members
            .iter()
            .map(|&row| {
                let column = matching.column_of_row[row].expect("invariant: the matching is perfect");
                (row.index(), unknowns[column.index()], slots[row.index()][&column])
            })
            .collect();
        if let [(row, v, slot)] = pairs.as_slice() {
            let own = &rows[*row];
            let Some(tick) = ticks.of(own.partition) else { continue };
            match value(flat, own.template, *slot) {
                Some(solution) => finished[*row] = Some((*v, block_of(flat, own, (*v, *slot), tick.tick, solution))),
                None => diagnostics.push(not_linear(flat, own, *v)),
            }
            continue;
        }
        let members: Vec<(&Row, VarId)> = pairs.iter().map(|&(row, v, _)| (&rows[row], v)).collect();
        for ((row, v, _), solved) in pairs.iter().zip(eliminate(flat, &members)) {
            let Some(tick) = ticks.of(rows[*row].partition) else { continue };
            match solved {
                Some(solved) => finished[*row] = Some((*v, at_tick(flat, &rows[*row], *v, tick.tick, solved))),
                // The cycle is told where discrete equations are put into their order.
                None => {
                    let own = &rows[*row];
                    let slot = pairs.iter().find(|(other, ..)| other == row).map(|&(_, _, slot)| slot);
                    match slot.and_then(|slot| value(flat, own.template, slot).map(|solution| (slot, solution))) {
                        Some((slot, solution)) => {
                            finished[*row] = Some((*v, block_of(flat, own, (*v, slot), tick.tick, solution)));
                        }
                        None => diagnostics.push(not_linear(flat, own, *v)),
                    }
                }
            }
        }
    }
    let mut groups: Vec<EquationBlock> = Vec::new();
    for (_, block) in finished.into_iter().flatten() {
        match groups.last_mut() {
            Some(last) if joins(last, &block) => {
                last.count += 1;
                last.operands.extend(block.operands);
            }
            _ => groups.push(block),
        }
    }
    flat.equations.extend(groups);
}

fn not_linear(flat: &FlatModel, row: &Row, v: VarId) -> Diagnostic {
    let message = format!("this does not say what `{}` is at a tick: it is not linear in it", flat.var_name(v));
    Diagnostic::error(Code::Clock, message).at(flat.equations[row.block as usize].origin.span, "")
}

fn joins(last: &EquationBlock, next: &EquationBlock) -> bool {
    (last.template, last.made, &last.origin) == (next.template, next.made, &next.origin)
}

/// `v = if tick then value else pre(v)`, the value that of a slot which reads `v`.
fn block_of(flat: &mut FlatModel, row: &Row, (v, slot): (VarId, SlotId), tick: VarId, value: NodeId) -> EquationBlock {
    let negated = row.operands[slot.index()].negated();
    let value = if negated { flat.templates.arena.neg(value) } else { value };
    at_tick(flat, row, v, tick, (value, row.operands.clone()))
}

/// `v = if tick then value else pre(v)`, the value over slots that read `operands`.
fn at_tick(
    flat: &mut FlatModel,
    row: &Row,
    v: VarId,
    tick: VarId,
    (value, mut operands): (NodeId, Vec<Operand>),
) -> EquationBlock {
    let arena = &mut flat.templates.arena;
    let mut read = |arena: &mut hyd_symbolic::Arena, target: Target| {
        operands.push(Operand::new(target));
        arena.slot(SlotId::new(operands.len() - 1))
    };
    let (left, ticks) = (read(arena, Target::Var(v)), read(arena, Target::Var(tick)));
    let before = read(arena, Target::Pre(v));
    let right = arena.select(ticks, value, before);
    let (template, order) = canonical(arena, left, right);
    let template = flat.templates.intern(template);
    let operands = order.iter().map(|slot| operands[slot.index()]).collect();
    let origin: Origin = flat.equations[row.block as usize].origin.clone();
    EquationBlock { section: Section::Discrete, made: row.made, template, count: 1, operands, origin }
}

/// Most equations that are solved for each other.
const MOST_ELIMINATED: usize = 16;

/// Equations that depend on each other in a cycle, one after the other solved for its variable and put into those behind it: the value
/// of each, over slots that read the operands beside it, reads none of the variables before.  None for all where one is not linear.
fn eliminate(flat: &mut FlatModel, members: &[(&Row, VarId)]) -> Vec<Option<(NodeId, Vec<Operand>)>> {
    let nothing = vec![None; members.len()];
    if members.len() > MOST_ELIMINATED {
        return nothing;
    }
    // One list of what is read for all, without signs.
    let mut operands: Vec<Operand> = Vec::new();
    let mut residuals: Vec<(NodeId, NodeId)> = Vec::new();
    for (row, _) in members {
        let sides = flat.templates.get(row.template);
        let nodes: Vec<NodeId> = row
            .operands
            .iter()
            .map(|operand| {
                let plain = operand.signed(operand.negated());
                let at = operands.iter().position(|&known| known == plain).unwrap_or_else(|| {
                    operands.push(plain);
                    operands.len() - 1
                });
                let slot = flat.templates.arena.slot(SlotId::new(at));
                if operand.negated() { flat.templates.arena.neg(slot) } else { slot }
            })
            .collect();
        let arena = &mut flat.templates.arena;
        let value = |slot: SlotId| nodes[slot.index()];
        residuals.push((substitute(arena, sides.left, &value), substitute(arena, sides.right, &value)));
    }
    let slot_of = |v: VarId| operands.iter().position(|&known| known == Operand::new(Target::Var(v))).map(SlotId::new);
    let mut values = Vec::with_capacity(members.len());
    for (k, (_, v)) in members.iter().enumerate() {
        let Some(slot) = slot_of(*v) else { return nothing };
        let arena = &mut flat.templates.arena;
        let (left, right) = residuals[k];
        let Some(solution) = solve_for(arena, left, right, slot) else { return nothing };
        for (left, right) in &mut residuals[k + 1..] {
            *left = substitute_one(arena, *left, slot, solution.value);
            *right = substitute_one(arena, *right, slot, solution.value);
        }
        values.push(solution.value);
    }
    values.into_iter().map(|value| Some((value, operands.clone()))).collect()
}

/// Takes the clocked equations out of the model.  Those between clocks have said all they say.
pub(crate) fn take_out(flat: &mut FlatModel, partitions: &Partitions) -> Vec<Row> {
    let mut rows = Vec::new();
    for at in 0..flat.equations.len() {
        let block = &flat.equations[at];
        if !is_running(block.section) {
            continue;
        }
        let (template, made) = (block.template, block.made);
        let arity = flat.templates.get(template).arity as usize;
        let between_clocks = |operands: &[Operand]| {
            operands.iter().all(|operand| matches!(operand.target(), Target::Var(v) if partitions.is_clock(v)))
        };
        let mut kept = Vec::new();
        let mut taken = Vec::new();
        for k in 0..block.count as usize {
            let operands = block.operands_of(k, arity);
            match partitions.of_equation(operands) {
                Some(_) if between_clocks(operands) => {}
                Some(partition) => {
                    taken.push(Row { template, operands: operands.to_vec(), block: at as u32, partition, made })
                }
                None => kept.extend_from_slice(operands),
            }
        }
        if kept.len() < block.operands.len() {
            rows.extend(taken);
            let block = &mut flat.equations[at];
            block.count = (kept.len() / arity.max(1)) as u32;
            block.operands = kept;
        }
    }
    rows
}

/// Clocked variables that equations determine, and their columns.
fn unknowns(flat: &FlatModel, partitions: &Partitions, rates: &[VarId]) -> (Vec<VarId>, FxHashMap<VarId, Column>) {
    let given = flat.clocks.iter().filter(|operator| operator.kind != ClockKind::Previous);
    let given = given.flat_map(|operator| (0..operator.count).map(|k| VarId(operator.value.0 + k)));
    let given: FxHashSet<VarId> = given.collect();
    let mut unknowns: Vec<VarId> = partitions.of.indices().filter(|&v| partitions.clocked_of(v).is_some()).collect();
    unknowns.retain(|v| !given.contains(v));
    unknowns.extend_from_slice(rates);
    let columns = unknowns.iter().enumerate().map(|(k, &v)| (v, Column::new(k))).collect();
    (unknowns, columns)
}

/// What is said where equations and variables of clocks do not go together.
fn unbalanced(flat: &FlatModel, rows: &[Row], unknowns: &[VarId], matching: &Matching) -> Diagnostic {
    let is_made = |v: VarId| flat.variables[flat.locate(v).0].made.is_some();
    let mut open: Vec<VarId> = matching.unmatched_columns().map(|column| unknowns[column.index()]).collect();
    open.sort_by_key(|&v| (is_made(v), v));
    if let Some(&v) = open.first() {
        let message = match open.len() {
            1 => format!("no equation says what the clocked variable `{}` is at a tick", flat.var_name(v)),
            more => format!(
                "no equations say what the clocked variables `{}` and {} more are at a tick",
                flat.var_name(v),
                more - 1
            ),
        };
        let (block, _) = flat.locate(v);
        return Diagnostic::error(Code::Unbalanced, message).at(flat.variables[block].origin.span, "");
    }
    let row = matching.unmatched_rows().next().map(|row| &rows[row.index()]);
    let message = "an equation too many of this clock: all its variables follow from others";
    let fault = Diagnostic::error(Code::Unbalanced, message);
    match row {
        Some(row) => fault.at(flat.equations[row.block as usize].origin.span, ""),
        None => fault,
    }
}

//! One routine for a step of sensitivities: both Jacobians, and the derivatives of the residuals by the data that directions reach.
//!
//! Where the Jacobian is straight-line code, the derivatives by data join it in one routine, so that common subexpressions are
//! computed once.  Only the data that are asked for have code.

use std::sync::Arc;

use hyd_payload::tangent::{Branch, SweepModel};
use hyd_payload::{Backend, JacobianForm};
use hyd_symbolic::{Arena, Function, Node, NodeId, gradient, post_order};
use rustc_hash::FxHashMap;

use crate::lower::Lowered;
use crate::program::{Address, Area, Kernel, Program, Routine, Store};

/// Code for the data marked in `active`; none where the Jacobian is not straight-line code or no code can be made.
pub(super) fn sweep(lowered: &Lowered, active: &[bool], backend: Backend) -> Option<SweepModel> {
    let base = &lowered.program;
    let JacobianForm::Entries(jacobian) = lowered.routines.simulation.jacobian else { return None };
    let ([jacobian], [residual]) = (
        base.routines[jacobian].kernels.as_slice(),
        base.routines[lowered.routines.simulation.residual].kernels.as_slice(),
    ) else {
        return None;
    };
    // Both come from one composition, the slots of the residual being the first ones of the Jacobian.
    if jacobian.count != 1 || residual.count != 1 || !jacobian.slots.starts_with(&residual.slots) {
        return None;
    }
    let mut program = Program { arena: base.arena.clone(), tables: base.tables.clone(), ..Program::default() };
    let state_entries = lowered.routines.simulation.state_pattern.entries();
    let layout = &lowered.layout;
    let flows = |index: &u32| layout.delayed.contains(index) || layout.delayed_rates.contains(index);
    let mut found: Vec<(u32, u32, NodeId)> = Vec::new();
    for store in &residual.stores {
        let Address::Fixed { area: Area::Out, index: row, .. } = store.to else { return None };
        for (slot, derivative) in gradient(&mut program.arena, store.value) {
            let Address::Fixed { area, index, negated } = jacobian.slots[slot.0 as usize] else { return None };
            let wanted = area == Area::Data && active.get(index as usize).copied().unwrap_or(false);
            if !wanted || program.arena.is(derivative, 0.0) {
                continue;
            }
            let value = if negated { program.arena.neg(derivative) } else { derivative };
            found.push((row, index, value));
        }
    }
    found.sort_by_key(|(_, index, _)| flows(index));
    let still = found.partition_point(|(_, index, _)| !flows(index));
    let mut kernel = jacobian.clone();
    kernel.stores.extend((0u32..).zip(&found).map(|(k, &(.., value))| {
        let index = state_entries as u32 + k;
        Store { value, to: Address::Fixed { area: Area::Out, index, negated: false } }
    }));
    let entries: Vec<(u32, u32)> = found.into_iter().map(|(row, index, _)| (row, index)).collect();
    let (arguments, branches) = branches(&mut program.arena, &kernel.stores, entries.len());
    let stores = (0u32..)
        .zip(arguments)
        .map(|(index, value)| Store { value, to: Address::Fixed { area: Area::Out, index, negated: false } });
    let arguments = Kernel { count: 1, slots: kernel.slots.clone(), stores: stores.collect() };
    let routine = program.routines.push(Routine { name: "sweep", kernels: vec![kernel] });
    let arguments = program.routines.push(Routine { name: "branches", kernels: vec![arguments] });
    let code = crate::engine::code(&program, backend).ok()?;
    let (program, state_entries, still) = (Arc::new(program), state_entries as u32, still as u32);
    Some(SweepModel { code, program, routine, state_entries, arguments, branches, entries, still })
}

/// What decides the branches among the stored values, and where each stands.
fn branches(arena: &mut Arena, stores: &[Store], further: usize) -> (Vec<NodeId>, Vec<Branch>) {
    let roots: Vec<NodeId> = stores.iter().map(|store| store.value).collect();
    let mut arguments: Vec<NodeId> = Vec::new();
    // Which branch a node decides.
    let mut decided: FxHashMap<NodeId, u32> = FxHashMap::default();
    for node in post_order(arena, &roots) {
        let Some(argument) = branch_argument(arena, node) else { continue };
        let negative = arena.neg(argument);
        if arena.as_constant(argument).is_some() {
            continue;
        }
        let known = arguments.iter().position(|&known| known == argument || known == negative);
        let branch = known.unwrap_or_else(|| {
            arguments.push(argument);
            arguments.len() - 1
        });
        decided.insert(node, branch as u32);
    }
    let mut branches = vec![Branch::default(); arguments.len()];
    if branches.is_empty() {
        return (arguments, branches);
    }
    // The stores of the Jacobians come first, those of the further entries last.
    let first = stores.len() - further;
    for node in post_order(arena, &roots[..first]) {
        if let Some(&branch) = decided.get(&node) {
            branches[branch as usize].always = true;
        }
    }
    for (entry, &root) in (0u32..).zip(&roots[first..]) {
        for node in post_order(arena, &[root]) {
            if let Some(&branch) = decided.get(&node)
                && !branches[branch as usize].always
                && branches[branch as usize].entries.last() != Some(&entry)
            {
                branches[branch as usize].entries.push(entry);
            }
        }
    }
    (arguments, branches)
}

/// The quantity whose sign decides a node.
fn branch_argument(arena: &mut Arena, node: NodeId) -> Option<NodeId> {
    match arena.node(node) {
        Node::Compare(_, a, b) => Some(arena.sub(a, b)),
        Node::Call1(Function::Sign, a) => Some(a),
        _ => None,
    }
}

//! Whether rates of states and algebraic unknowns enter the equations linearly, with factors that only events change.
//!
//! Read off the code of the Jacobian: an entry that reads no unknown, no rate, no assigned variable, no input and not the time is a number between
//! events.  Where all entries of those columns are, one evaluation and one solution give what an iteration would: if what is sought does not
//! decide, either, at which branch of a piecewise constant function the equations are, which no slope shows.

use std::collections::HashSet;

use hyd_symbolic::{Node, NodeId, post_order};

use crate::instance::Instance;
use crate::model::Model;
use crate::program::{Address, Area, Kernel, TIME};
use crate::routines::JacobianForm;

impl Instance {
    /// True if it is known that rates of states and algebraic unknowns enter the residual linearly, with factors that only events change.
    pub fn is_affine(&self) -> bool {
        let model = &self.loaded.model;
        let JacobianForm::Entries(routine) = &model.routines.simulation.jacobian else { return false };
        let kernels = &model.program.routines[*routine].kernels;
        let residual = &model.program.routines[model.routines.simulation.residual].kernels;
        model.candidates.is_empty()
            && kernels.iter().all(|kernel| factors_are_fixed(model, kernel))
            && residual.iter().all(|kernel| sought_decides_nothing(model, kernel))
    }
}

/// True if rates of states and algebraic unknowns pass through sums, products and branches only, not into conditions, functions and
/// divisors.  What is read of assigned variables counts as if they came of them.
fn sought_decides_nothing(model: &Model, kernel: &Kernel) -> bool {
    let arena = &model.program.arena;
    let is_sought = |address: &Address| match *address {
        Address::Fixed { area: Area::Data, .. } => false,
        Address::Fixed { area: Area::Unknown, index, .. } => !model.structure.differential[index as usize],
        _ => true,
    };
    let roots: Vec<NodeId> = kernel.stores.iter().map(|store| store.value).collect();
    let mut sought: HashSet<NodeId> = HashSet::new();
    for id in post_order(arena, &roots) {
        let node = arena.node(id);
        let comes_in = match node {
            Node::Slot(slot) => kernel.slots.get(hyd_index::TypedIndex::index(slot)).is_none_or(is_sought),
            _ => node.operands().any(|operand| sought.contains(&operand)),
        };
        if !comes_in {
            continue;
        }
        let passes = match node {
            Node::Slot(_) | Node::Neg(_) | Node::Add(..) | Node::Sub(..) | Node::Mul(..) => true,
            Node::Div(_, by) => !sought.contains(&by),
            Node::If(condition, ..) => !sought.contains(&condition),
            _ => false,
        };
        if !passes {
            return false;
        }
        sought.insert(id);
    }
    true
}

fn factors_are_fixed(model: &Model, kernel: &Kernel) -> bool {
    let structure = &model.structure;
    let column = |starts: &[u32], entry: u32| starts.partition_point(|&start| start <= entry).saturating_sub(1);
    kernel.stores.iter().all(|store| {
        let Address::Fixed { area, index, .. } = store.to else { return false };
        let sought = match area {
            Area::Out => !structure.differential[column(&structure.state_pattern.column_starts, index)],
            Area::Out2 => structure.differential[column(&structure.rate_pattern.column_starts, index)],
            _ => return false,
        };
        !sought || is_fixed(model, store.value, kernel)
    })
}

/// True if an expression reads nothing but data that only events change.
fn is_fixed(model: &Model, value: NodeId, kernel: &Kernel) -> bool {
    let (arena, area) = (&model.program.arena, &model.area);
    let moves = |index: u32| {
        index == TIME
            || area.inputs.contains(&index)
            || area.input_rates.contains(&index)
            || area.delayed.contains(&index)
    };
    let mut open = vec![value];
    while let Some(id) = open.pop() {
        let node = arena.node(id);
        match node {
            Node::Time | Node::Event(..) => return false,
            Node::Slot(slot) => match kernel.slots.get(hyd_index::TypedIndex::index(slot)) {
                Some(Address::Fixed { area: Area::Data, index, .. }) if !moves(*index) => {}
                _ => return false,
            },
            _ => open.extend(node.operands()),
        }
    }
    true
}

//! One sweep for a step of sensitivities: both Jacobians, and the derivatives of the residuals by the data that directions reach.
//!
//! Where the Jacobian is straight-line code, the derivatives by data join it in one routine, so that common subexpressions are
//! computed once; what remains is a list of products with the derivatives of the data by the directions, which stay the
//! same between events, and those with the derivatives of delayed values, which do not.  Only the data that the chosen directions
//! reach have code.

use std::sync::Arc;

use hyd_symbolic::{Arena, Function, Node, NodeId, gradient, post_order};

use super::code::Part;
use super::memory::TangentMemory;
use crate::lower::Lowered;
use crate::program::{Address, Area, Kernel, Program, Routine, RoutineId, Store};
use crate::system::CompiledSystem;
use hyd_payload::JacobianForm;
use hyd_payload::Point;
use hyd_payload::{Backend, Engine};

/// The routine, and what it stores behind dF/dy.
#[derive(Debug)]
pub(super) struct SweepCode {
    pub(super) engine: Engine,
    routine: RoutineId,
    state_entries: usize,
    /// The arguments of branches without an event, to `Out`.
    branches: RoutineId,
    pub(super) branch_count: usize,
    /// Residual row and position in the data area of each further entry; those of delayed values come last.
    entries: Vec<(u32, u32)>,
    /// Number of those that come first.
    still: usize,
}

/// `out[to] += factor * entry`
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Product {
    entry: u32,
    to: u32,
    factor: f64,
}

impl SweepCode {
    /// Code for the data marked in `active`; none where the Jacobian is not straight-line code or no code can be made.
    pub(super) fn new(lowered: &Lowered, active: &[bool], backend: Backend) -> Option<Self> {
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
        let arguments = branch_arguments(&mut program.arena, &kernel.stores);
        let branch_count = arguments.len();
        let stores = (0u32..)
            .zip(arguments)
            .map(|(index, value)| Store { value, to: Address::Fixed { area: Area::Out, index, negated: false } });
        let arguments = Kernel { count: 1, slots: kernel.slots.clone(), stores: stores.collect() };
        let routine = program.routines.push(Routine { name: "sweep", kernels: vec![kernel] });
        let branches = program.routines.push(Routine { name: "branches", kernels: vec![arguments] });
        let engine = crate::engine::engine(Arc::new(program), backend).ok()?;
        Some(Self { engine, routine, state_entries, branches, branch_count, entries, still })
    }

    /// Length of the array that the routine writes.
    pub(super) fn length(&self) -> usize {
        self.state_entries + self.entries.len()
    }

    /// The products with the derivatives of the data as they are, but for delayed values.
    fn products(&self, blocks: &[f64], width: usize, products: &mut Vec<Product>) {
        products.clear();
        for (entry, &(row, data)) in (0u32..).zip(&self.entries[..self.still]) {
            let block = &blocks[data as usize * width..(data as usize + 1) * width];
            let reached = block.iter().enumerate().filter(|(_, factor)| **factor != 0.0);
            products.extend(reached.map(|(direction, &factor)| {
                let to = row * width as u32 + direction as u32;
                Product { entry: self.state_entries as u32 + entry, to, factor }
            }));
        }
    }

    /// Adds the products of `values`, what the routine wrote, with the derivatives of delayed values.
    fn add_delayed(&self, values: &[f64], blocks: &[f64], width: usize, out: &mut [f64]) {
        let values = &values[self.state_entries + self.still..];
        for (&value, &(row, data)) in values.iter().zip(&self.entries[self.still..]) {
            let block = &blocks[data as usize * width..(data as usize + 1) * width];
            let out = &mut out[row as usize * width..(row as usize + 1) * width];
            if value.is_finite() {
                out.iter_mut().zip(block).for_each(|(sum, derivative)| *sum += value * derivative);
            } else {
                // An infinite slope times nothing is nothing.
                let moved = out.iter_mut().zip(block).filter(|(_, derivative)| **derivative != 0.0);
                moved.for_each(|(sum, derivative)| *sum += value * derivative);
            }
        }
    }
}

/// What decides the branches among the stored values: differences of compared quantities, arguments of `sign`.
fn branch_arguments(arena: &mut Arena, stores: &[Store]) -> Vec<NodeId> {
    let roots: Vec<NodeId> = stores.iter().map(|store| store.value).collect();
    let mut list: Vec<NodeId> = Vec::new();
    for node in post_order(arena, &roots) {
        let argument = match arena.node(node) {
            Node::Compare(_, a, b) => arena.sub(a, b),
            Node::Call1(Function::Sign, a) => a,
            _ => continue,
        };
        let negative = arena.neg(argument);
        if arena.as_constant(argument).is_none() && !list.contains(&argument) && !list.contains(&negative) {
            list.push(argument);
        }
    }
    list
}

/// The sweep of an instance.
#[derive(Clone, Debug, Default)]
pub(super) struct Sweep {
    pub(super) code: Option<std::sync::Arc<SweepCode>>,
    pub(super) values: Vec<f64>,
    pub(super) registers: hyd_payload::vm::Registers,
    pub(super) products: Vec<Product>,
    /// Derivatives of data have changed since the products were listed.
    pub(super) outdated: bool,
}

impl CompiledSystem {
    /// Arguments of the branches among the Jacobians.
    pub(super) fn branch_arguments(&mut self, tangents: &mut TangentMemory, point: Point<'_>, out: &mut [f64]) {
        let Some(code) = tangents.sweep.code.clone() else { return };
        let target = (&code.engine, code.branches, &mut tangents.sweep.registers);
        self.instance.run_on(target, point, out, &mut []);
    }

    /// Jacobians, and the tangent of the residual with time and unknowns held.
    pub(super) fn sweep(
        &mut self,
        tangents: &mut TangentMemory,
        point: Point<'_>,
        (state, rate): (&mut [f64], &mut [f64]),
        out: &mut [f64],
    ) {
        let Some(code) = tangents.sweep.code.clone() else {
            self.instance.run_jacobian(false, point, state, rate);
            self.assign_partials(tangents, point);
            self.partials(tangents, Part::Residual, point);
            tangents.chain(Part::Assign, |rows| &rows.held_assign, false);
            tangents.chain(Part::Residual, |rows| &rows.held_residual, false);
            tangents.get(tangents.code.spaces.start(Area::Out, false), out);
            return;
        };
        if std::mem::take(&mut tangents.sweep.outdated) {
            let width = tangents.width;
            code.products(&tangents.blocks, width, &mut tangents.sweep.products);
        }
        let Sweep { values, registers, products, .. } = &mut tangents.sweep;
        self.instance.run_on((&code.engine, code.routine, registers), point, values, rate);
        state.copy_from_slice(&values[..state.len()]);
        out.fill(0.0);
        for product in products.iter() {
            let entry = values[product.entry as usize];
            out[product.to as usize] += product.factor * entry;
        }
        code.add_delayed(values, &tangents.blocks, tangents.width, out);
    }
}

//! One sweep for a step of sensitivities: both Jacobians, and the derivatives of the residuals by the data that directions reach.
//!
//! Where there is code for both ([`super::SweepModel`]), what remains is a list of products with the derivatives of the data by the
//! directions, which stay the same between events, and those with the derivatives of delayed values, which do not.

use std::sync::Arc;

use super::code::SweepCode;
use super::memory::TangentMemory;
use super::model::Part;
use crate::instance::{Instance, Point};
use crate::program::Area;
use crate::vm::Registers;

/// `out[to] += factor * entry`
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Product {
    entry: u32,
    to: u32,
    factor: f64,
}

impl SweepCode {
    /// The products with the derivatives of the data as they are, but for delayed values.
    fn products(&self, blocks: &[f64], width: usize, products: &mut Vec<Product>) {
        products.clear();
        for (entry, &(row, data)) in (0u32..).zip(&self.model.entries[..self.model.still as usize]) {
            let block = &blocks[data as usize * width..(data as usize + 1) * width];
            let reached = block.iter().enumerate().filter(|(_, factor)| **factor != 0.0);
            products.extend(reached.map(|(direction, &factor)| {
                let to = row * width as u32 + direction as u32;
                Product { entry: self.model.state_entries + entry, to, factor }
            }));
        }
    }

    /// Adds the products of `values`, what the routine wrote, with the derivatives of delayed values.
    fn add_delayed(&self, values: &[f64], blocks: &[f64], width: usize, out: &mut [f64]) {
        let values = &values[self.model.state_entries as usize + self.model.still as usize..];
        for (&value, &(row, data)) in values.iter().zip(&self.model.entries[self.model.still as usize..]) {
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

/// The sweep of an instance.
#[derive(Clone, Debug, Default)]
pub(super) struct Sweep {
    code: Option<Arc<SweepCode>>,
    values: Vec<f64>,
    registers: Registers,
    products: Vec<Product>,
    /// Derivatives of data have changed since the products were listed.
    pub(super) outdated: bool,
    /// The branches that directions reach.
    pub(super) branches: Vec<u32>,
    arguments: Vec<f64>,
}

impl Sweep {
    /// Working space for the code; `reached`: the data that directions reach.
    pub(super) fn new(code: Option<Arc<SweepCode>>, reached: &[bool]) -> Self {
        let Some(code) = code else { return Self { outdated: true, ..Self::default() } };
        let entry = |&entry: &u32| reached[code.model.entries[entry as usize].1 as usize];
        let branches = (0u32..).zip(&code.model.branches);
        let branches = branches.filter(|(_, branch)| branch.always || branch.entries.iter().any(entry));
        Self {
            values: vec![0.0; code.length()],
            registers: code.engine.registers(),
            products: Vec::new(),
            outdated: true,
            branches: branches.map(|(k, _)| k).collect(),
            arguments: vec![0.0; code.model.branches.len()],
            code: Some(code),
        }
    }
}

impl Instance {
    /// Arguments of the branches among the Jacobians.
    pub(super) fn branch_arguments(&mut self, tangents: &mut TangentMemory, point: Point<'_>, out: &mut [f64]) {
        let Sweep { code, registers, branches, arguments, .. } = &mut tangents.sweep;
        let Some(code) = code else { return };
        self.run_on((&code.engine, code.model.arguments, registers), point, arguments, &mut []);
        for (value, &branch) in out.iter_mut().zip(branches.iter()) {
            *value = arguments[branch as usize];
        }
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
            self.run_jacobian(false, point, state, rate);
            self.assign_partials(tangents, point);
            self.partials(tangents, Part::Residual, point);
            tangents.chain(Part::Assign, |rows| &rows.held_assign, false);
            tangents.chain(Part::Residual, |rows| &rows.held_residual, false);
            tangents.get(tangents.spaces().start(Area::Out, false), out);
            return;
        };
        if std::mem::take(&mut tangents.sweep.outdated) {
            let width = tangents.width;
            code.products(&tangents.blocks, width, &mut tangents.sweep.products);
        }
        let Sweep { values, registers, products, .. } = &mut tangents.sweep;
        self.run_on((&code.engine, code.model.routine, registers), point, values, rate);
        state.copy_from_slice(&values[..state.len()]);
        out.fill(0.0);
        for product in products.iter() {
            let entry = values[product.entry as usize];
            out[product.to as usize] += product.factor * entry;
        }
        code.add_delayed(values, &tangents.blocks, tangents.width, out);
    }
}

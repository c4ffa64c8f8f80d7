//! A small plan as straight-line code: assigned variables are replaced by their expressions.
//!
//! All expressions of a routine become one directed graph without repetitions, so that a common subexpression is
//! computed once over all equations and Jacobian entries, and only what the routine needs is computed at all.  The
//! Jacobian is accumulated forward through the assignments with the simplifying constructors (Griewank and Walther 2008,
//! "Evaluating Derivatives", chapter 9: vertex elimination in forward order).

use hyd_equations::{PlanJacobian, SortedSystem};
use hyd_flat::{Operand, Target};
use hyd_index::TypedIndex;
use hyd_symbolic::{Arena, NodeId, SlotId, slots, substitute};
use rustc_hash::FxHashMap;

use super::rows::{Column, Rows};
use crate::layout::{Layout, Place, PlanPlaces, resolve};
use crate::program::{Address, Area, Kernel, Store};

/// Composes the expressions of a plan.
pub(super) struct Composer<'a> {
    arena: &'a mut Arena,
    sorted: &'a SortedSystem,
    layout: &'a Layout,
    places: &'a PlanPlaces,
    slots: Vec<Address>,
    known: FxHashMap<Place, SlotId>,
    assigned: Vec<NodeId>,
}

/// Total derivatives of a row: column and expression, columns ascending.
type Gradient = Vec<(u32, NodeId)>;

impl<'a> Composer<'a> {
    /// Composes all assignments of the plan.
    ///
    /// # Errors
    /// A sentence, when an operand has no place.
    pub(super) fn new(
        arena: &'a mut Arena,
        sorted: &'a SortedSystem,
        layout: &'a Layout,
        places: &'a PlanPlaces,
        rows: &Rows<'_>,
    ) -> Result<Self, String> {
        let (slots, known, assigned) = (Vec::new(), FxHashMap::default(), Vec::new());
        let mut composer = Self { arena, sorted, layout, places, slots, known, assigned };
        for assignment in &rows.plan.assignments {
            let operands = sorted.system.operands_of(assignment.operands);
            let value = composer.expression(assignment.value, operands)?;
            composer.assigned.push(value);
        }
        Ok(composer)
    }

    /// The composed assignments.
    pub(super) fn assigned(&self) -> &[NodeId] {
        &self.assigned
    }

    /// An expression with everything assigned replaced.
    ///
    /// # Errors
    /// A sentence, when an operand has no place.
    pub(super) fn expression(&mut self, value: NodeId, operands: &[Operand]) -> Result<NodeId, String> {
        let mut nodes: FxHashMap<SlotId, NodeId> = FxHashMap::default();
        for slot in slots(self.arena, &[value]) {
            let operand = *operands.get(slot.index()).ok_or("a slot has no operand")?;
            nodes.insert(slot, self.operand(operand)?);
        }
        Ok(substitute(self.arena, value, &|slot| nodes[&slot]))
    }

    fn operand(&mut self, operand: Operand) -> Result<NodeId, String> {
        let (target, negated) = resolve(self.sorted, operand);
        let node = if let Target::Const(c) = target {
            self.arena.constant(self.sorted.system.flat.constants[c])
        } else {
            let (place, _) = self.layout.locate(self.sorted, self.places, operand)?;
            match place.area {
                Area::Work => *self.assigned.get(place.index as usize).ok_or_else(|| {
                    format!("`{}` is used before it is computed", self.sorted.system.flat.operand_name(operand))
                })?,
                _ => self.slot(place),
            }
        };
        Ok(if negated { self.arena.neg(node) } else { node })
    }

    fn slot(&mut self, place: Place) -> NodeId {
        let next = SlotId::new(self.slots.len());
        let slot = *self.known.entry(place).or_insert(next);
        if slot == next {
            self.slots.push(Address::Fixed { area: place.area, index: place.index, negated: false });
        }
        self.arena.slot(slot)
    }

    /// A kernel that stores values one after the other from position 0 of an area.
    pub(super) fn kernel(&self, values: &[NodeId], area: Area) -> Kernel {
        let to = |k: usize| Address::Fixed { area, index: k as u32, negated: false };
        let stores = values.iter().enumerate().map(|(k, &value)| Store { value, to: to(k) }).collect();
        Kernel { count: 1, slots: self.slots.clone(), stores }
    }

    /// The entries of the Jacobian, row by row of the residuals; entries that vanish are left out.
    ///
    /// # Errors
    /// A sentence, when an operand has no place.
    pub(super) fn jacobian(&mut self, rows: &Rows<'_>, jacobian: &PlanJacobian) -> Result<Vec<Gradient>, String> {
        let assignments = rows.plan.assignments.len();
        let mut gradients: Vec<Gradient> = Vec::new();
        for row in 0..rows.count() {
            let (_, operands) = rows.expression(self.sorted, row);
            let mut gradient: FxHashMap<u32, NodeId> = FxHashMap::default();
            for &(slot, partial) in jacobian.partials(row) {
                let operand = operands[slot.index()];
                let (column, negated) = rows.column(self.sorted, self.places, operand);
                if column == Column::None {
                    continue;
                }
                let local = self.expression(partial, operands)?;
                let local = if negated { self.arena.neg(local) } else { local };
                match column {
                    Column::Direct(c) => self.accumulate(&mut gradient, c, local),
                    Column::Assigned(a) => {
                        for &(c, inner) in &gradients[a as usize] {
                            let product = self.arena.mul(local, inner);
                            self.accumulate(&mut gradient, c, product);
                        }
                    }
                    Column::None => {}
                }
            }
            let mut gradient: Gradient = gradient.into_iter().filter(|&(_, node)| !self.arena.is(node, 0.0)).collect();
            gradient.sort_unstable_by_key(|&(c, _)| c);
            gradients.push(gradient);
        }
        Ok(gradients.split_off(assignments))
    }

    fn accumulate(&mut self, gradient: &mut FxHashMap<u32, NodeId>, column: u32, term: NodeId) {
        let sum = match gradient.get(&column) {
            Some(&sum) => self.arena.add(sum, term),
            None => term,
        };
        gradient.insert(column, sum);
    }

    /// The arena, for constants.
    pub(super) fn arena(&mut self) -> &mut Arena {
        self.arena
    }
}

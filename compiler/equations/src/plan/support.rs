//! How many unknowns an assignment depends on, through the assignments before it.
//!
//! Eliminating a variable puts its support into every row that reads it; bounding the support bounds the fill of the
//! composed Jacobian.  Supports are short sorted lists, merged as assignments are made.

use hyd_flat::{FlatModel, Made, Operand, Target, VarId};
use hyd_index::IndexVec;
use hyd_structure::Column;

use crate::incidence::Unknowns;
use crate::system::{EquationSystem, Role};

/// Most unknowns an assignment may depend on in a system of more equations than [`crate::WIDE`].
pub const WIDEST_SUPPORT: usize = 24;

/// Supports of the assigned columns.
pub(crate) struct Supports {
    /// Range in `members`, for assigned columns.
    range: IndexVec<Column, Option<(u32, u32)>>,
    /// Parts of long folds.
    parts: IndexVec<VarId, bool>,
    /// Keys of values (even) and derivatives (odd).
    members: Vec<u32>,
    scratch: Vec<u32>,
}

impl Supports {
    /// No assignments yet among `count` columns.
    pub(crate) fn new(flat: &FlatModel, count: usize) -> Self {
        let mut parts = IndexVec::filled(false, flat.scalars as usize);
        for block in flat.variables.iter().filter(|block| matches!(block.made, Some(Made::Fold(_)))) {
            for k in 0..block.count {
                parts[VarId(block.first.0 + k)] = true;
            }
        }
        Self { parts, range: IndexVec::filled(None, count), members: Vec::new(), scratch: Vec::new() }
    }

    /// Enters an assignment that reads the given targets; false if its support is too wide.
    pub(crate) fn assign(
        &mut self,
        system: &EquationSystem,
        unknowns: &Unknowns,
        column: Column,
        read: impl Iterator<Item = Target>,
    ) -> bool {
        self.scratch.clear();
        for target in read {
            let key = match target {
                Target::Var(v) => 2 * v.0,
                Target::Der(v) => 2 * v.0 + 1,
                _ => continue,
            };
            match unknowns.column(target) {
                Some(column) => match self.range[column] {
                    Some((first, end)) => self.scratch.extend_from_slice(&self.members[first as usize..end as usize]),
                    None => self.scratch.push(key),
                },
                None if is_unknown_elsewhere(system, target) => self.scratch.push(key),
                None => {}
            }
        }
        self.scratch.sort_unstable();
        self.scratch.dedup();
        let first = self.members.len() as u32;
        self.members.extend_from_slice(&self.scratch);
        self.range[column] = Some((first, self.members.len() as u32));
        self.scratch.len() <= WIDEST_SUPPORT
    }

    /// True for an equation between several parts of a long fold.  Were the levels of its tree assigned one after the other, the
    /// loops of code would grow with the number of levels; as unknowns they are one loop, and the tree factorises
    /// without fill.
    pub(crate) fn is_upper_level(&self, operands: &[Operand]) -> bool {
        let is_part = |operand: &&Operand| matches!(operand.target(), Target::Var(v) if self.parts[v]);
        operands.iter().filter(is_part).take(3).count() > 2
    }

    /// Takes an assignment back: the column is an unknown.
    pub(crate) fn release(&mut self, column: Column) {
        if let Some((first, _)) = self.range[column].take() {
            self.members.truncate(first as usize);
        }
    }
}

/// States have no column of their own in the simulation, only their derivatives do.
fn is_unknown_elsewhere(system: &EquationSystem, target: Target) -> bool {
    matches!(target, Target::Var(v) if system.roles[v] == Role::State)
}

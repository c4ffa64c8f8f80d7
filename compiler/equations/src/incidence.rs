//! Which unknown occurs in which equation: from operands to the integers that the structural algorithms work on.
//!
//! [`Unknowns`] numbers targets as columns, [`pattern`] makes the rows of a list of equations.  What a column stands for
//! is the caller's choice: a variable, its derivative, or both at once.

use hyd_flat::{Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_structure::{Column, Entry, Incidence};
use hyd_symbolic::SlotId;

use crate::algebra::Algebra;
use crate::system::{EqId, EquationSystem};

/// Unknowns by number and by target.
#[derive(Clone, Debug)]
pub(crate) struct Unknowns {
    /// What each column stands for.
    pub targets: IndexVec<Column, Target>,
    value: IndexVec<VarId, Option<Column>>,
    rate: IndexVec<VarId, Option<Column>>,
}

impl Unknowns {
    /// No unknowns among `count` variables.
    pub(crate) fn new(count: usize) -> Self {
        Self { targets: IndexVec::new(), value: IndexVec::filled(None, count), rate: IndexVec::filled(None, count) }
    }

    /// Adds the value or the derivative of a variable; other targets are never unknown.
    pub(crate) fn add(&mut self, target: Target) -> Column {
        let column = self.targets.push(target);
        self.point(target, column);
        column
    }

    /// Lets another target stand for a column too.
    pub(crate) fn point(&mut self, target: Target, column: Column) {
        match target {
            Target::Var(v) => self.value[v] = Some(column),
            Target::Der(v) => self.rate[v] = Some(column),
            _ => debug_assert!(false, "invariant: unknowns are values and derivatives"),
        }
    }

    /// The column of a target.
    pub(crate) fn column(&self, target: Target) -> Option<Column> {
        match target {
            Target::Var(v) => self.value[v],
            Target::Der(v) => self.rate[v],
            _ => None,
        }
    }
}

/// Equations and the unknowns in them.
#[derive(Clone, Debug)]
pub(crate) struct Pattern {
    /// The equations; row `k` of the incidence is `rows[k]`.
    pub rows: Vec<EqId>,
    /// Where unknowns occur.
    pub incidence: Incidence,
    /// The slot in which each occurs (the first, if several slots count as one unknown).
    pub slots: IndexVec<Entry, SlotId>,
}

/// The pattern of some equations.
pub(crate) fn pattern(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    rows: Vec<EqId>,
    unknowns: &Unknowns,
) -> Pattern {
    let mut incidence = Incidence::new(unknowns.targets.len());
    let mut slots = IndexVec::new();
    let mut found: Vec<(Column, SlotId)> = Vec::new();
    for &eq in &rows {
        let equation = system.equations[eq];
        let facts = algebra.facts(&mut system.flat.templates, equation.template);
        let operands = system.operands_of(equation.operands);
        found.clear();
        let columns = facts.slots.iter().map(|&slot| (unknowns.column(operands[slot.index()].target()), slot));
        found.extend(columns.filter_map(|(column, slot)| column.map(|column| (column, slot))));
        found.sort_unstable();
        found.dedup_by_key(|(column, _)| *column);
        let row = incidence.push_row(found.iter().map(|(column, _)| *column));
        row.expect("invariant: columns ascend, are known and their number fits, as operands are counted by u32");
        slots.raw.extend(found.iter().map(|(_, slot)| *slot));
    }
    Pattern { rows, incidence, slots }
}

//! How far rounding errors may grow along the assignments of a loop.
//!
//! Tearing looks at structure alone: a diagonally dominant chain can be torn at one end and computed from there as a recurrence that
//! multiplies every rounding error by a constant per element, which is Gaussian elimination without pivoting (Higham 2002, *Accuracy
//! and Stability of Numerical Algorithms*, section 9.3).  So the slopes of a loop are evaluated at the start, equilibrated by rows and
//! columns (Ruiz 2001, *A scaling algorithm to equilibrate both rows and columns norms in matrices*), and each assignment bounds what
//! it makes of the errors of the variables that it reads.  Where the bound is passed, the variable stays an unknown of the solver,
//! which solves with pivoting, and the errors behind it begin from one again.

use hyd_index::{IndexVec, TypedIndex};
use hyd_structure::{Column, Entry, Incidence, Row};
use hyd_symbolic::{NodeId, SlotId, TemplateId, gradient, slots};
use rustc_hash::FxHashMap;

use crate::algebra::{Algebra, Known};
use crate::start_point::StartPoint;
use crate::system::{EqId, EquationSystem};

/// Largest factor by which the assignments between two unknowns of the solver may multiply an error, relative to the size of the
/// variables: of sixteen digits thirteen stay.
const LARGEST_GROWTH: f32 = 1e3;
/// The same for an assignment that reads a variable at which the errors have just been stopped: in a recurrence over several elements
/// the others that it reads bring their errors past that variable.
const LARGEST_BESIDE_CUT: f32 = 30.0;
/// What a first assignment counts at most: by itself it is as exact as its terms, whatever their sizes (known ones, such as the
/// pressure at the other end of a pipe, are not among the slopes); growth needs one after the other.
const LARGEST_ALONE: f32 = 30.0;
/// Sweeps of the equilibration; each halves the distance of the logarithms from 0.
const SWEEPS: usize = 8;

/// Sizes of slopes and growth of errors in the loops of one system.
pub(crate) struct Growth {
    /// Per entry, for rows in loops; 0 elsewhere.
    size: IndexVec<Entry, f32>,
    /// Per column: bound of the factor between its error and one rounding error.
    factor: IndexVec<Column, f32>,
    /// Columns that stayed unknowns because their errors would have grown.
    cut: IndexVec<Column, bool>,
}

/// The derivatives of a template's left minus right side.
type Gradient = FxHashMap<SlotId, Slope>;

struct Slope {
    value: NodeId,
    /// The number, where it is one.
    number: Option<f64>,
    reads: Vec<SlotId>,
}

impl Growth {
    /// Slopes of the rows for which `in_loop` holds; `slots` says where in its equation the unknown of an entry stands.
    pub(crate) fn new(
        system: &mut EquationSystem,
        algebra: &mut Algebra,
        (known, values): (&Known, &StartPoint),
        (incidence, slots, rows): (&Incidence, &IndexVec<Entry, SlotId>, &[EqId]),
        in_loop: &IndexVec<Row, bool>,
    ) -> Self {
        let mut gradients: FxHashMap<TemplateId, Gradient> = FxHashMap::default();
        let mut size = IndexVec::filled(0.0, incidence.entry_count());
        for row in incidence.rows().filter(|&row| in_loop[row]) {
            let eq = rows[row.index()];
            let equation = system.equations[eq];
            let gradient =
                gradients.entry(equation.template).or_insert_with(|| gradient_of(system, algebra, equation.template));
            for (entry, _) in incidence.entries(row) {
                size[entry] = slope(system, (known, values), eq, gradient.get(&slots[entry]));
            }
        }
        equilibrate(incidence, in_loop, &mut size);
        let columns = incidence.column_count();
        Self { size, factor: IndexVec::filled(1.0, columns), cut: IndexVec::filled(false, columns) }
    }

    /// Enters the assignment of a column by a row; false if errors would grow too far.
    pub(crate) fn assign(&mut self, incidence: &Incidence, row: Row, own: Entry) -> bool {
        let (mut sum, mut beside_cut, mut first) = (0.0, false, true);
        for (entry, column) in incidence.entries(row).filter(|&(entry, _)| entry != own) {
            sum += self.size[entry] * self.factor[column];
            beside_cut |= self.cut[column];
            first &= self.factor[column] == 1.0;
        }
        let factor = if sum > 0.0 { f32::max(sum / self.size[own], 1.0) } else { 1.0 };
        let factor = if first && self.size[own] > 0.0 { factor.min(LARGEST_ALONE) } else { factor };
        // Infinite or not a number where the assigned variable has no slope.
        let bounded = factor <= if beside_cut { LARGEST_BESIDE_CUT } else { LARGEST_GROWTH };
        let column = incidence.column_of(own);
        match bounded {
            true => self.factor[column] = factor,
            false => self.cut[column] = true,
        }
        bounded
    }

    /// The column is an unknown of the solver after all.
    pub(crate) fn release(&mut self, column: Column) {
        self.factor[column] = 1.0;
    }
}

fn gradient_of(system: &mut EquationSystem, algebra: &mut Algebra, template: TemplateId) -> Gradient {
    let templates = &mut system.flat.templates;
    let residual = algebra.facts(templates, template).residual;
    let list = gradient(&mut templates.arena, residual);
    let arena = &templates.arena;
    let slope = |value| Slope { value, number: arena.as_constant(value), reads: slots(arena, &[value]) };
    list.into_iter().map(|(slot, value)| (slot, slope(value))).collect()
}

/// Size of a slope at the start.  One that varies counts as 1 where it has no size there: it may get one.
fn slope(system: &EquationSystem, (known, values): (&Known, &StartPoint), eq: EqId, slope: Option<&Slope>) -> f32 {
    let Some(slope) = slope else { return 1.0 };
    let operands = system.equations[eq].operands;
    let size = slope.number.unwrap_or_else(|| values.evaluate(system, slope.value, operands)).abs() as f32;
    let fixed = || slope.reads.iter().all(|slot| known.is_known(system.operands_of(operands)[slot.index()]));
    match size.is_finite() && (size > 0.0 || fixed()) {
        true => size,
        false => 1.0,
    }
}

/// Divides rows and columns by the roots of their largest entries, several times.
fn equilibrate(incidence: &Incidence, in_loop: &IndexVec<Row, bool>, size: &mut IndexVec<Entry, f32>) {
    let mut columns = IndexVec::<Column, f32>::filled(0.0, incidence.column_count());
    for _ in 0..SWEEPS {
        columns.raw.fill(0.0);
        for row in incidence.rows().filter(|&row| in_loop[row]) {
            let largest = incidence.entries(row).fold(0.0_f32, |largest, (entry, _)| largest.max(size[entry]));
            let root = if largest > 0.0 { largest.sqrt() } else { 1.0 };
            for (entry, column) in incidence.entries(row) {
                size[entry] /= root;
                columns[column] = columns[column].max(size[entry]);
            }
        }
        columns.raw.iter_mut().for_each(|largest| *largest = if *largest > 0.0 { largest.sqrt() } else { 1.0 });
        for row in incidence.rows().filter(|&row| in_loop[row]) {
            for (entry, column) in incidence.entries(row) {
                size[entry] /= columns[column];
            }
        }
    }
}

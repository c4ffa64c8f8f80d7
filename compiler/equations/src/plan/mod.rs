//! Matching, block order and tearing become assignments and residuals.
//!
//! Each equation is matched to one unknown, preferring those it can be solved for without dividing by what may vanish;
//! the blocks of the block lower triangular form (Duff and Reid 1978) are walked in order.  Explicit equations become
//! assignments, loops are torn (Elmqvist and Otter 1994), all else becomes an unknown of the solver with a residual.
//! A variable also stays an unknown when rounding errors would grow along the assignments before it (`growth`), or its assignment
//! would widen the Jacobian beyond bounds or, in large systems, lengthen a chain.  Derivatives of states in the simulation are read from `y'`, so nothing waits for them.

pub(crate) mod bindings;
pub(crate) mod dependent;
pub(crate) mod discrete;
mod growth;
mod levels;
pub(crate) mod linearity;
mod support;
pub(crate) mod wishes;

pub use support::WIDEST_SUPPORT;

use hyd_flat::{Section, Target};
use hyd_index::{IndexVec, TypedIndex};
use hyd_structure::{
    Column, Entry, Incidence, Matching, Row, Tearing, TearingOptions, TearingPlan, block_order, maximum_matching,
};
use hyd_symbolic::{SlotId, partial, slots};

use crate::algebra::{Algebra, Known, Solvability};
use crate::incidence::{Pattern, Unknowns};
use crate::plan::growth::Growth;
use crate::plan::levels::order_by_level;
use crate::plan::support::Supports;
use crate::sorted::{Assignment, Plan, Residual, Unknown};
use crate::start_point::StartPoint;
use crate::system::{EqId, EquationSystem};

/// A system with more equations is large.
pub const LARGE: usize = 1000;
/// Longest chain of assignments in a large system.
pub const LONGEST_CHAIN: u32 = 64;
/// A system with more equations bounds what an assignment depends on: the Jacobian of a star of N branches would have N*N entries.
pub const WIDE: usize = 64;

/// What is divided by must not be smaller than this beside the other factors of its equation: rounding would decide the result.
/// Divisors above `SMALL` are not compared.
const TINY: f64 = 1e-10;
const SMALL: f64 = 1e-8;

/// How a column may be determined.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// By an assignment if possible.
    Plain,
    /// By the solver: the derivative of a state, read from `y'`.
    Rate,
    /// By the solver, a candidate: it is read from `y` and its derivative from `y'`; what determines it changes.
    Selected,
}

/// What becomes of loops.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Loops {
    /// A few of their variables are unknowns of the solver, the others are computed from them.
    #[default]
    Torn,
    /// All of their variables are unknowns of the solver: slower, and as exact as elimination with pivoting is.
    Whole,
}

/// A square system to be sorted.
pub(crate) struct Request<'a> {
    /// Equations and the unknowns in them.
    pub pattern: Pattern,
    /// Unknowns.
    pub unknowns: &'a Unknowns,
    /// One per unknown.
    pub kinds: IndexVec<Column, Kind>,
    /// Wish for each unknown to be an iteration variable.
    pub wishes: IndexVec<Column, i8>,
    /// What is known.
    pub known: &'a Known,
    /// Its values as declared.
    pub values: &'a StartPoint,
    /// What becomes of loops.
    pub loops: Loops,
}

/// Why there is no plan: the equations do not match the unknowns.
pub(crate) struct Mismatch {
    /// Equations and unknowns.
    pub pattern: Pattern,
    /// A maximum matching, not perfect.
    pub matching: Matching,
}

/// Sorts a square system.
pub(crate) fn build_plan(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    request: Request<'_>,
) -> Result<Plan, Box<Mismatch>> {
    let pattern = request.pattern;
    let solvability = solvabilities(system, algebra, (request.known, request.values), &pattern);
    let classes = IndexVec::from_vec(solvability.iter().map(|&class| class as u8).collect());
    let classes = prefer(system, &pattern, &request.kinds, classes);
    let matching = maximum_matching(&pattern.incidence, Some(&classes));
    if !matching.is_perfect() {
        return Err(Box::new(Mismatch { pattern, matching }));
    }
    let cut = cut_rates(&pattern, &matching, &request.kinds, &solvability);
    let blocks = block_order(&cut.incidence, &matching).expect("invariant: the matching is perfect, checked above");
    let mut in_loop = IndexVec::filled(false, pattern.rows.len());
    for block in blocks.blocks() {
        let rows = blocks.block(block).0;
        rows.iter().for_each(|&row| in_loop[row] = rows.len() > 1);
    }
    let mut solvable = IndexVec::new();
    for row in cut.incidence.rows() {
        let eq = pattern.rows[row.index()];
        for (entry, column) in cut.incidence.entries(row) {
            let safe = cut.solvability[entry].is_safe() && request.kinds[column] == Kind::Plain;
            let at = (request.known, request.values);
            solvable.push(safe && !(in_loop[row] && is_tiny(system, algebra, at, eq, cut.slots[entry])));
        }
    }
    let options = TearingOptions { solvable: &solvable, wish: Some(&request.wishes), max_depth: None };
    let mut tearing = Tearing::new(&cut.incidence, options);
    let at = (request.known, request.values);
    let growth = Growth::new(system, algebra, at, (&cut.incidence, &cut.slots, &pattern.rows), &in_loop);
    let wide = pattern.rows.len() > WIDE;
    let supports = wide.then(|| Supports::new(&system.flat, request.unknowns.targets.len()));
    let mut builder = Builder {
        system,
        algebra,
        unknowns: request.unknowns,
        kinds: &request.kinds,
        cut: &cut,
        rows: &pattern.rows,
        level: IndexVec::filled(None, request.unknowns.targets.len()),
        supports,
        growth,
        is_large: pattern.rows.len() > LARGE,
        plan: Plan::default(),
    };
    for block in blocks.blocks() {
        let (rows, columns) = blocks.block(block);
        let before = builder.lengths();
        if let ([row], [column]) = (rows, columns) {
            builder.single(*row, *column);
        } else {
            let plan = match request.loops {
                Loops::Torn => tearing.tear(rows, columns),
                Loops::Whole => whole(rows, columns),
            };
            builder.torn(&plan);
        }
        builder.end_block(before);
    }
    Ok(finish(builder.plan))
}

/// A loop in which everything is an unknown of the solver.
fn whole(rows: &[Row], columns: &[Column]) -> TearingPlan {
    let mut plan = TearingPlan { assignments: Vec::new(), tearing: columns.to_vec(), residuals: rows.to_vec() };
    plan.tearing.sort_unstable();
    plan.residuals.sort_unstable();
    plan
}

/// Unknowns that need no assignment should take the equations that give none.
fn prefer(
    system: &EquationSystem,
    pattern: &Pattern,
    kinds: &IndexVec<Column, Kind>,
    mut classes: IndexVec<Entry, u8>,
) -> IndexVec<Entry, u8> {
    for row in pattern.incidence.rows() {
        let selects = system.section(pattern.rows[row.index()]) == Section::Selection;
        for (entry, column) in pattern.incidence.entries(row) {
            match kinds[column] {
                Kind::Selected if selects => classes[entry] = Solvability::Always as u8,
                _ if selects => classes[entry] = Solvability::Never as u8,
                Kind::Plain => {}
                Kind::Rate if classes[entry] <= Solvability::ByParameters as u8 => classes[entry] = 0,
                Kind::Rate => classes[entry] = Solvability::Sometimes as u8,
                Kind::Selected => classes[entry] = Solvability::Never as u8,
            }
        }
    }
    classes
}

fn solvabilities(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    (known, values): (&Known, &StartPoint),
    pattern: &Pattern,
) -> IndexVec<Entry, Solvability> {
    let mut table = Vec::with_capacity(pattern.incidence.entry_count());
    for row in pattern.incidence.rows() {
        let eq = pattern.rows[row.index()];
        for entry in pattern.incidence.entry_range(row) {
            let slot = pattern.slots[Entry::new(entry)];
            let class = algebra.solvability(system, known, eq, slot);
            let vanishes =
                class == Solvability::ByParameters && smallest_divisor(system, algebra, values, eq, slot) == 0.0;
            table.push(if vanishes { Solvability::Sometimes } else { class });
        }
    }
    IndexVec::from_vec(table)
}

/// Size of the smallest expression of parameters that solving would divide by, as declared: 0 in the empty places of a mass
/// matrix, and for what is not finite.
fn smallest_divisor(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    values: &StartPoint,
    eq: EqId,
    slot: SlotId,
) -> f64 {
    let equation = system.equations[eq];
    let solved = algebra.solve(&mut system.flat.templates, equation.template, slot);
    let divisors = solved.map_or(Vec::new(), |solved| solved.divisors.clone());
    let sizes = divisors.into_iter().map(|divisor| values.evaluate(system, divisor, equation.operands).abs());
    sizes.map(|size| if size.is_finite() { size } else { 0.0 }).fold(f64::INFINITY, f64::min)
}

/// Solving in a loop would divide by something tiny.
fn is_tiny(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    (known, values): (&Known, &StartPoint),
    eq: EqId,
    slot: SlotId,
) -> bool {
    let smallest = smallest_divisor(system, algebra, values, eq, slot);
    smallest < SMALL && smallest < TINY * largest_slope(system, algebra, (known, values), eq)
}

/// Size of the largest slope of an equation that only parameters decide, as declared.
fn largest_slope(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    (known, values): (&Known, &StartPoint),
    eq: EqId,
) -> f64 {
    let equation = system.equations[eq];
    let facts = algebra.facts(&mut system.flat.templates, equation.template).clone();
    let mut largest = 0.0_f64;
    for slot in facts.slots {
        let operands = system.operands_of(equation.operands);
        if known.is_known(operands[slot.index()]) {
            continue;
        }
        let slope = partial(&mut system.flat.templates.arena, facts.residual, slot);
        let operands = system.operands_of(equation.operands);
        let mut reads = slots(&system.flat.templates.arena, &[slope]).into_iter();
        if reads.all(|slot| known.is_known(operands[slot.index()])) {
            largest = largest.max(values.evaluate(system, slope, equation.operands).abs());
        }
    }
    largest
}

/// A pattern in which a rate or a candidate occurs only in the row that is matched to it.
struct Cut {
    incidence: Incidence,
    slots: IndexVec<Entry, SlotId>,
    solvability: IndexVec<Entry, Solvability>,
}

fn cut_rates(
    pattern: &Pattern,
    matching: &Matching,
    kinds: &IndexVec<Column, Kind>,
    solvability: &IndexVec<Entry, Solvability>,
) -> Cut {
    let mut cut = Cut {
        incidence: Incidence::new(pattern.incidence.column_count()),
        slots: IndexVec::new(),
        solvability: IndexVec::new(),
    };
    for row in pattern.incidence.rows() {
        let own = matching.column_of_row[row];
        let free = |column: Column| !matches!(kinds[column], Kind::Rate | Kind::Selected);
        let kept = |&(_, column): &(Entry, Column)| free(column) || own == Some(column);
        let entries: Vec<_> = pattern.incidence.entries(row).filter(kept).collect();
        let pushed = cut.incidence.push_row(entries.iter().map(|&(_, column)| column));
        pushed.expect("invariant: a part of a row that is sorted");
        cut.slots.raw.extend(entries.iter().map(|&(entry, _)| pattern.slots[entry]));
        cut.solvability.raw.extend(entries.iter().map(|&(entry, _)| solvability[entry]));
    }
    cut
}

struct Builder<'a> {
    system: &'a mut EquationSystem,
    algebra: &'a mut Algebra,
    unknowns: &'a Unknowns,
    kinds: &'a IndexVec<Column, Kind>,
    cut: &'a Cut,
    rows: &'a [EqId],
    /// Level of the columns that are assigned.
    level: IndexVec<Column, Option<u32>>,
    /// Not kept for the smallest systems.
    supports: Option<Supports>,
    growth: Growth,
    /// Chains are bounded too.
    is_large: bool,
    plan: Plan,
}

impl Builder<'_> {
    fn single(&mut self, row: Row, column: Column) {
        let entry = self.entry(row, column);
        if self.cut.solvability[entry].is_safe() && self.kinds[column] == Kind::Plain {
            self.assign(row, column);
        } else {
            self.iterate(row, column);
        }
    }

    fn torn(&mut self, plan: &TearingPlan) {
        for &(row, column) in &plan.assignments {
            self.assign(row, column);
        }
        for &column in &plan.tearing {
            self.add_unknown(column);
        }
        for &row in &plan.residuals {
            let eq = self.rows[row.index()];
            let equation = self.system.equations[eq];
            let value = self.algebra.facts(&mut self.system.flat.templates, equation.template).residual;
            self.add_residual(Residual { value, operands: equation.operands, equation: eq });
        }
    }

    fn entry(&self, row: Row, column: Column) -> Entry {
        self.cut.incidence.entry(row, column).expect("invariant: a matched column occurs in its row")
    }

    /// An assignment, unless rounding errors would grow too far, or it would be too wide or, in a large system, too deep.
    fn assign(&mut self, row: Row, column: Column) {
        if !self.growth.assign(&self.cut.incidence, row, self.entry(row, column)) {
            return self.iterate(row, column);
        }
        let others = self.cut.incidence.row(row).iter().filter(|&&other| other != column);
        let level = others.filter_map(|&other| self.level[other]).map(|level| level + 1).max().unwrap_or(0);
        let (eq, slot) = (self.rows[row.index()], self.cut.slots[self.entry(row, column)]);
        if let Some(supports) = &mut self.supports {
            let facts = self.algebra.facts(&mut self.system.flat.templates, self.system.equations[eq].template);
            let operands = self.system.operands_of(self.system.equations[eq].operands);
            let read = facts.slots.iter().filter(|&&s| s != slot).map(|s| operands[s.index()].target());
            let narrow = supports.assign(self.system, self.unknowns, column, read);
            let long = self.is_large && (level >= LONGEST_CHAIN || supports.is_upper_level(operands));
            if long || !narrow {
                supports.release(column);
                self.growth.release(column);
                return self.iterate(row, column);
            }
        }
        let operands = self.system.equations[eq].operands;
        let value = self.algebra.value(self.system, eq, slot);
        let value = value.expect("invariant: only entries that can be solved are assigned");
        let target = self.unknowns.targets[column];
        self.level[column] = Some(level);
        self.plan.assignments.push(Assignment { target, value, operands, equation: eq, level });
    }

    /// An unknown with the residual of the equation matched to it, in the form `slot - value` where there is one.
    fn iterate(&mut self, row: Row, column: Column) {
        let (eq, entry) = (self.rows[row.index()], self.entry(row, column));
        let equation = self.system.equations[eq];
        let templates = &mut self.system.flat.templates;
        let slot = self.cut.slots[entry];
        let solved = self.algebra.solve(templates, equation.template, slot);
        let explicit = match self.cut.solvability[entry].is_safe() {
            true => solved.map(|solved| solved.residual),
            false => solved.and_then(|solved| solved.cleared),
        };
        let value = explicit.unwrap_or_else(|| self.algebra.facts(templates, equation.template).residual);
        self.add_unknown(column);
        self.add_residual(Residual { value, operands: equation.operands, equation: eq });
    }

    fn add_unknown(&mut self, column: Column) {
        let differential = matches!(self.kinds[column], Kind::Rate | Kind::Selected);
        let target = match self.unknowns.targets[column] {
            Target::Der(v) if differential => Target::Var(v),
            target => target,
        };
        self.plan.unknowns.push(Unknown { target, differential });
    }

    fn add_residual(&mut self, residual: Residual) {
        self.plan.residuals.push(residual);
    }

    /// Numbers of assignments, unknowns and residuals so far.
    fn lengths(&self) -> [u32; 3] {
        let plan = &self.plan;
        [plan.assignments.len(), plan.unknowns.len(), plan.residuals.len()].map(|length| length as u32)
    }

    /// What has been added since then is a block.
    fn end_block(&mut self, before: [u32; 3]) {
        let after = self.lengths();
        self.plan.blocks.push([0, 1, 2].map(|k| before[k]..after[k]));
    }
}

/// Puts the assignments into the order of their levels and renumbers them in the blocks.
fn finish(mut plan: Plan) -> Plan {
    let position = order_by_level(&mut plan.assignments);
    plan.blocks.move_assignments(&position);
    plan
}

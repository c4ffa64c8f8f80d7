//! Initial conditions that follow from others by numbers only.
//!
//! In a closed system `der(x) = 0` for every state says one thing twice, since what is stored as a whole never changes: the initial
//! system matches all of its unknowns and is singular all the same.  The slopes of a block of the initial plan are evaluated at
//! several points, parameters as declared and unknowns scattered near their start values; a matrix that is singular at each of
//! them (complete pivoting, Golub and Van Loan 2013, *Matrix Computations*, section 3.4) is singular everywhere, up to unlucky
//! numbers (Schwartz 1980, on testing identities at random points).  The equations that depend on each other are sought
//! among the block and all blocks before it, and the last condition among them is given up: it is checked at the start like
//! others that follow.  Slopes that depend on relations, discrete variables or the past, and those with branches, count as
//! numbers of their own, so nothing is given up because a valve happens to be closed.

use hyd_flat::Target;
use hyd_index::TypedIndex;
use hyd_symbolic::{Arena, Function, Node, NodeId, SlotId, TemplateId, partial, post_order, slots};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::algebra::Algebra;
use crate::plan::bindings::Bindings;
use crate::plan::dependent::dependent_rows;
use crate::plan::linearity::block_targets;
use crate::sorted::{Block, Plan};
use crate::start_point::StartPoint;
use crate::system::{EqId, EquationSystem, Role};

/// Larger parts are left to the start.
const MOST_EQUATIONS: usize = 200;
/// A matrix that is singular at this many points is singular everywhere.
const POINTS: u32 = 3;

/// For each singular block of the plan the last of the `conditions` that depends on other equations.
pub(crate) fn dependent_conditions(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    bindings: &Bindings,
    plan: &Plan,
    conditions: &[EqId],
) -> Vec<EqId> {
    let mut dependent = Vec::new();
    let mut singular = FxHashSet::default();
    let position: FxHashMap<EqId, usize> = conditions.iter().enumerate().map(|(k, &eq)| (eq, k)).collect();
    let mut slopes = Slopes { algebra, partials: FxHashMap::default() };
    let mut points = None;
    let mut owners = None;
    for (k, block) in plan.blocks.iter().enumerate() {
        let size = block.assignments.len() + block.residuals.len();
        if block.residuals.is_empty() || size > MOST_EQUATIONS {
            continue;
        }
        let points: &Vec<StartPoint> = points.get_or_insert_with(|| {
            (0..POINTS).map(|seed| StartPoint::scattered(system, &bindings.assignments, seed)).collect()
        });
        let matrix = Matrix::new(system, &mut slopes, plan, &[block]);
        if points.iter().any(|point| matrix.dependent(system, point).is_none()) {
            continue;
        }
        let owners = owners.get_or_insert_with(|| owners_of(plan));
        let before = blocks_before(system, plan, owners, k);
        singular.insert(k);
        // One singular block at a time: what is before it may be the reason.
        if before.iter().any(|&other| other != k && singular.contains(&other)) {
            continue;
        }
        let blocks: Vec<Block<'_>> = before.iter().map(|&k| plan.blocks.get(k)).collect();
        let matrix = Matrix::new(system, &mut slopes, plan, &blocks);
        let rows = points.iter().filter_map(|point| matrix.dependent(system, point)).flatten();
        let last = rows.filter_map(|row| position.get(&matrix.equations[row])).max();
        dependent.extend(last.map(|&last| conditions[last]));
    }
    dependent
}

/// The block of each unknown.
fn owners_of(plan: &Plan) -> FxHashMap<Target, usize> {
    let targets = |(k, block)| block_targets(plan, block).map(move |target| (target, k));
    plan.blocks.iter().enumerate().flat_map(targets).collect()
}

/// A block with those it depends on, itself alone if they are too many.
fn blocks_before(system: &EquationSystem, plan: &Plan, owners: &FxHashMap<Target, usize>, block: usize) -> Vec<usize> {
    let mut found = vec![block];
    let mut seen: FxHashSet<usize> = found.iter().copied().collect();
    let (mut next, mut size) = (0, 0);
    while let Some(&k) = found.get(next) {
        next += 1;
        let equations = equations_of(plan, plan.blocks.get(k));
        size += equations.len();
        if size > MOST_EQUATIONS {
            return vec![block];
        }
        for eq in equations {
            for operand in system.operands_of(system.equations[eq].operands) {
                found.extend(owners.get(&operand.target()).copied().filter(|&owner| seen.insert(owner)));
            }
        }
    }
    found.sort_unstable();
    found
}

fn equations_of(plan: &Plan, block: Block<'_>) -> Vec<EqId> {
    let assigned = block.assignments.iter().map(|&a| plan.assignments[a as usize].equation);
    assigned.chain(block.residuals.iter().map(|&r| plan.residuals[r as usize].equation)).collect()
}

/// Partial derivatives made so far.
struct Slopes<'a> {
    algebra: &'a mut Algebra,
    partials: FxHashMap<(TemplateId, SlotId), NodeId>,
}

/// Equations and unknowns of some blocks.
struct Matrix {
    equations: Vec<EqId>,
    columns: usize,
    /// Row, column, slope (none where it may be anything), and whether it counts negative.
    entries: Vec<(usize, usize, Option<NodeId>, bool)>,
}

impl Matrix {
    fn new(system: &mut EquationSystem, slopes: &mut Slopes<'_>, plan: &Plan, blocks: &[Block<'_>]) -> Self {
        let equations: Vec<EqId> = blocks.iter().flat_map(|&block| equations_of(plan, block)).collect();
        let targets = blocks.iter().flat_map(|&block| block_targets(plan, block));
        let column: FxHashMap<Target, usize> = targets.enumerate().map(|(k, target)| (target, k)).collect();
        let mut entries = Vec::new();
        for (row, &eq) in equations.iter().enumerate() {
            let equation = system.equations[eq];
            let facts = slopes.algebra.facts(&mut system.flat.templates, equation.template).clone();
            for &slot in &facts.slots {
                let operand = system.operands_of(equation.operands)[slot.index()];
                let Some(&column) = column.get(&operand.target()) else { continue };
                let arena = &mut system.flat.templates.arena;
                let slope = slopes.partials.entry((equation.template, slot));
                let slope = *slope.or_insert_with(|| partial(arena, facts.residual, slot));
                let operands = system.operands_of(equation.operands);
                let reads = slots(&system.flat.templates.arena, &[slope]);
                let decided = |slot: SlotId| !is_switched(system, operands[slot.index()].target());
                let is_smooth = !has_branches(&system.flat.templates.arena, slope);
                let slope = (is_smooth && reads.into_iter().all(decided)).then_some(slope);
                entries.push((row, column, slope, operand.negated()));
            }
        }
        Self { equations, columns: column.len(), entries }
    }

    /// Rows that depend on each other at a point; `None` if the matrix is regular there.
    fn dependent(&self, system: &EquationSystem, point: &StartPoint) -> Option<Vec<usize>> {
        let mut matrix = vec![vec![0.0; self.columns]; self.equations.len()];
        for &(row, column, slope, negated) in &self.entries {
            let operands = system.equations[self.equations[row]].operands;
            let value = slope.map(|slope| point.evaluate(system, slope, operands)).filter(|value| value.is_finite());
            let value = value.unwrap_or_else(|| point.made_up((row * self.columns + column) as u32));
            matrix[row][column] += if negated { -value } else { value };
        }
        dependent_rows(matrix)
    }
}

/// Its value changes for reasons that the numbers before the start do not show.
fn is_switched(system: &EquationSystem, target: Target) -> bool {
    match target {
        Target::Held(_)
        | Target::Chosen(_)
        | Target::Delayed(_)
        | Target::DelayedRate(_)
        | Target::Input(_)
        | Target::InputRate(_) => true,
        Target::Var(v) | Target::Pre(v) => system.roles[v] == Role::Discrete,
        Target::Der(_) | Target::Start(_) | Target::Const(_) => false,
    }
}

/// A slope that is another one elsewhere: of an `if`, `max` or `abs`, or of a function with branches of its own.
fn has_branches(arena: &Arena, slope: NodeId) -> bool {
    post_order(arena, &[slope]).into_iter().any(|id| {
        let node = arena.node(id);
        matches!(node, Node::If(..) | Node::Compare(..) | Node::Event(..) | Node::Apply(..))
            || matches!(node, Node::Call1(Function::Sign | Function::Floor | Function::Ceil, _))
    })
}

//! Checks a sorted system against its definition; used by tests and by debug builds.
//!
//! Every continuous unknown is determined exactly once, assignments read only what comes before them, as many residuals
//! as unknowns, every equation is used exactly once, and blocks partition the plan.

use hyd_flat::{Operand, Section, Target};
use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{NodeId, contains_event, slots};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::sorted::{Assignment, Plan, SortedSystem};
use crate::system::{EqId, OperandRange};

/// What is wrong, if anything is.
pub fn verify(sorted: &SortedSystem) -> Result<(), String> {
    let mut used: IndexVec<EqId, u8> = IndexVec::filled(0, sorted.system.equations.len());
    let mut determined = FxHashSet::default();
    for binding in &sorted.bindings {
        if sorted.system.section(binding.equation) == Section::Continuous {
            used[binding.equation] += 1;
        }
        determined.insert(binding.target);
    }
    for start in sorted.starts.iter().chain(&sorted.late_starts) {
        // One that says several starts is used once.
        if sorted.system.section(start.equation) == Section::Initial {
            used[start.equation] = 1;
        }
    }
    let reads = Reads::new(sorted);
    reads.ordered("bindings", &sorted.bindings)?;
    reads.ordered("discrete", &sorted.discrete)?;
    for (name, plan) in [("simulation", &sorted.simulation), ("initial", &sorted.initial)] {
        check_plan(name, plan)?;
        reads.ordered(name, &plan.assignments)?;
        check_coverage(name, sorted, plan, used.clone(), &determined)?;
    }
    Ok(())
}

struct Reads<'a> {
    sorted: &'a SortedSystem,
    slots: std::cell::RefCell<FxHashMap<NodeId, Vec<usize>>>,
}

impl<'a> Reads<'a> {
    fn new(sorted: &'a SortedSystem) -> Self {
        Self { sorted, slots: Default::default() }
    }

    fn operands(&self, value: NodeId, range: OperandRange) -> Vec<Operand> {
        let arena = &self.sorted.system.flat.templates.arena;
        let mut cache = self.slots.borrow_mut();
        let list = cache.entry(value).or_insert_with(|| {
            debug_assert!(!contains_event(arena, value), "invariant: events are taken out");
            slots(arena, &[value]).into_iter().map(TypedIndex::index).collect()
        });
        let operands = self.sorted.system.operands_of(range);
        list.iter().map(|&slot| operands[slot]).collect()
    }

    /// Every assignment reads what an earlier level assigns, or what no assignment of the list assigns.
    fn ordered(&self, name: &str, assignments: &[Assignment]) -> Result<(), String> {
        let mut level: FxHashMap<Target, u32> = FxHashMap::default();
        for assignment in assignments {
            if level.insert(assignment.target, assignment.level).is_some() {
                return Err(format!("{name}: {:?} is assigned twice", assignment.target));
            }
        }
        let mut last = 0;
        for assignment in assignments {
            if assignment.level < last {
                return Err(format!("{name}: levels descend at {:?}", assignment.target));
            }
            last = assignment.level;
            for operand in self.operands(assignment.value, assignment.operands) {
                if level.get(&operand.target()).is_some_and(|&before| before >= assignment.level) {
                    return Err(format!("{name}: {:?} reads {operand:?} before it is known", assignment.target));
                }
            }
        }
        Ok(())
    }
}

fn check_plan(name: &str, plan: &Plan) -> Result<(), String> {
    if plan.unknowns.len() != plan.residuals.len() {
        return Err(format!("{name}: {} unknowns, {} residuals", plan.unknowns.len(), plan.residuals.len()));
    }
    let (mut assignments, mut unknowns, mut residuals) = (Vec::new(), Vec::new(), Vec::new());
    for block in plan.blocks.iter() {
        assignments.extend(block.assignments);
        unknowns.extend(block.unknowns);
        residuals.extend(block.residuals);
        if block.unknowns.len() != block.residuals.len() {
            return Err(format!("{name}: a block is not square"));
        }
    }
    assignments.sort_unstable();
    let is_range = |list: &[u32], count: usize| list.iter().copied().eq(0..count as u32);
    let whole = is_range(&assignments, plan.assignments.len())
        && is_range(&unknowns, plan.unknowns.len())
        && is_range(&residuals, plan.residuals.len());
    if whole { Ok(()) } else { Err(format!("{name}: blocks are not a partition in order")) }
}

fn check_coverage(
    name: &str,
    sorted: &SortedSystem,
    plan: &Plan,
    mut used: IndexVec<EqId, u8>,
    bound: &FxHashSet<Target>,
) -> Result<(), String> {
    let equations = plan.assignments.iter().map(|a| a.equation);
    for eq in equations.chain(plan.residuals.iter().map(|r| r.equation)) {
        used[eq] += 1;
    }
    for (eq, &count) in used.iter_enumerated() {
        let expected = match sorted.system.section(eq) {
            Section::Continuous if name == "initial" && sorted.system.is_delay(eq) => Some(0),
            Section::Continuous => Some(1),
            Section::Initial if sorted.redundant.iter().any(|r| r.left.equation == eq) => Some(0),
            Section::Initial if name == "initial" => Some(1),
            Section::Selection if name == "simulation" => Some(1),
            _ => None,
        };
        if expected.is_some_and(|expected| expected != count) {
            return Err(format!("{name}: {eq} is used {count} times"));
        }
    }
    let mut known = bound.clone();
    known.extend(plan.assignments.iter().map(|a| a.target).chain(plan.unknowns.iter().map(|u| u.target)));
    let continuous = sorted.system.roles.indices().filter(|&v| sorted.system.is_continuous(v));
    match continuous.into_iter().find(|&v| !known.contains(&Target::Var(v))) {
        Some(v) => Err(format!("{name}: {v} is not determined")),
        None => Ok(()),
    }
}

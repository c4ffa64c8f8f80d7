//! Discrete variables that are known before the initial system is solved.
//!
//! At the start all equations are one system (Modelica 3.6, section 8.6).  What follows from parameters, time, start values and from each
//! other without any unknown of the initial system comes first in it: `n = if time >= 0 then 2 else 3` has its value when `der(x) = -x/n` is
//! evaluated for the first time.  Found from below, so what stands in a loop is not among them.

use hyd_equations::{Assignment, Role, SortedSystem};
use hyd_flat::{Operand, Target, VarId};
use hyd_index::TypedIndex;
use hyd_symbolic::slots;
use rustc_hash::FxHashSet;

/// These variables, of those that discrete equations determine.
pub(crate) fn known_discrete(sorted: &SortedSystem) -> FxHashSet<VarId> {
    if sorted.discrete.is_empty() {
        return FxHashSet::default();
    }
    let mut search = Search { sorted, known: FxHashSet::default(), open: FxHashSet::default() };
    search.known.extend(sorted.bindings.iter().map(|a| a.target));
    let plan = &sorted.initial;
    search.open.extend(plan.assignments.iter().map(|a| a.target).chain(plan.unknowns.iter().map(|u| u.target)));
    search.open.extend(sorted.late_starts.iter().map(|a| a.target));
    let mut relations: Vec<u32> = (0..sorted.relations.len() as u32).collect();
    let mut assignments: Vec<&Assignment> = plan.assignments.iter().collect();
    // What the initial system determines is known with its solution.
    let mut discrete: Vec<&Assignment> = sorted.discrete.iter().filter(|a| !search.open.contains(&a.target)).collect();
    // The operands of an assignment are those of its equation, the variable on the left among them.
    let arena = &sorted.system.flat.templates.arena;
    let read = |a: &Assignment| {
        let operands = sorted.system.operands_of(a.operands);
        slots(arena, &[a.value]).into_iter().map(|slot| operands[slot.index()]).collect()
    };
    loop {
        let before = search.known.len();
        search.take(&mut assignments, |a| (a.target, read(a)));
        search.take(&mut relations, |&k| {
            (Target::Held(k), sorted.system.operands_of(sorted.relations[k as usize].operands).to_vec())
        });
        search.take(&mut discrete, |a| (a.target, read(a)));
        if search.known.len() == before {
            break;
        }
    }
    let variable = |a: &Assignment| match a.target {
        Target::Var(v) if search.known.contains(&a.target) => Some(v),
        _ => None,
    };
    sorted.discrete.iter().filter_map(variable).collect()
}

struct Search<'a> {
    sorted: &'a SortedSystem,
    known: FxHashSet<Target>,
    /// What the initial system determines, and start values that wait for it.
    open: FxHashSet<Target>,
}

impl Search<'_> {
    /// Moves what reads known values only from a list to what is known.
    fn take<T>(&mut self, list: &mut Vec<T>, what: impl Fn(&T) -> (Target, Vec<Operand>)) {
        list.retain(|item| {
            let (target, operands) = what(item);
            let follows = operands.iter().all(|operand| self.is_known(*operand));
            if follows {
                self.known.insert(target);
            }
            !follows
        });
    }

    fn is_known(&self, operand: Operand) -> bool {
        let system = &self.sorted.system;
        let target = operand.target();
        match target {
            Target::Const(_) | Target::Input(_) | Target::InputRate(_) => true,
            Target::Start(_) => !self.open.contains(&target),
            Target::Pre(v) => {
                let waits = self.open.contains(&Target::Start(v)) || self.open.contains(&Target::Var(v));
                system.roles[v] == Role::Discrete && !waits
            }
            // Parameters that the start finds have their guesses until then.
            Target::Var(v) if matches!(system.roles[v], Role::Parameter | Role::Constant) => {
                !self.open.contains(&target)
            }
            Target::Var(_) | Target::Der(_) | Target::Held(_) => self.known.contains(&target),
            _ => false,
        }
    }
}

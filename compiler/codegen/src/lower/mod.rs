//! Sorted system to program: which routines there are and what each computes.
//!
//! `bind` computes parameters and start values; each plan has `assign`, `residual` and `jacobian`
//! ([`plan`]); event routines work on the assigned variables that `assign` left in the work area: truth of
//! relations, instants of time events, discrete equations, reinitialised states, conditions of assertions.  A parameter that
//! can be set is `if given then value else binding`, so that one translated model serves all settings.

pub(crate) mod accumulate;
mod batch;
mod by_time;
mod late;
pub(crate) mod plan;
pub(crate) mod rows;
mod straight;

use std::sync::Arc;

use hyd_equations::{Assignment, Check, OperandRange, PlanJacobian, Role, SortedSystem, Trigger};
use hyd_flat::{Section, Target};
use hyd_index::TypedIndex;
use hyd_payload::{Backend, EventRoutines, Routines, TimedRelation};
use hyd_symbolic::{Arena, NodeId, SlotId};
use hyd_system::CheckKind;
use rustc_hash::FxHashSet;

use crate::layout::{Layout, Place, PlanPlaces};
use crate::program::{Area, Program, RoutineId};
use batch::{Batch, Item};
use plan::{PlainPlan, PlanLowering, push};

/// Limits and choices.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Options {
    /// Plans with at most this many expression nodes become straight-line code; 0 makes loops of all.
    pub straight_nodes: usize,
    /// What runs the code.
    pub backend: Backend,
}

impl Default for Options {
    fn default() -> Self {
        Self { straight_nodes: 4000, backend: Backend::Native }
    }
}

/// The derivatives of both plans.
#[derive(Clone, Copy, Debug)]
pub struct Jacobians<'a> {
    /// Of the simulation plan.
    pub simulation: &'a PlanJacobian,
    /// Of the initial plan.
    pub initial: &'a PlanJacobian,
}

/// A program with the meaning of its routines and memory.
#[derive(Clone, Debug)]
pub(crate) struct Lowered {
    /// The program.
    pub program: Arc<Program>,
    /// The data area.
    pub layout: Layout,
    /// Places in the simulation.
    pub places: PlanPlaces,
    /// Places in the initial system.
    pub initial_places: PlanPlaces,
    /// What the routines do.
    pub routines: Arc<Routines>,
    /// The simulation as loops, whatever code is made of it.
    pub plain: PlainPlan,
    /// The initial system likewise.
    pub initial_plain: PlainPlan,
}

/// The values that the message of each assertion or termination shows; they follow the conditions in `checks`.
pub(crate) fn message_values(sorted: &SortedSystem) -> Vec<Vec<(NodeId, OperandRange)>> {
    let flat = &sorted.system.flat;
    let values = |check: &hyd_equations::Check| {
        if flat.messages.get(check.message as usize).is_none_or(|message| message.parts.is_empty()) {
            return Vec::new();
        }
        let list = flat.templates.get(sorted.system.equations[check.condition.equation].template).right;
        flat.templates.arena.arguments(list).into_iter().map(|value| (value, check.condition.operands)).collect()
    };
    sorted.checks.iter().map(values).collect()
}

/// Lowers a system.
///
/// # Errors
/// A sentence, when the system is inconsistent (a fault of an earlier stage).
pub(crate) fn lower(sorted: &SortedSystem, jacobians: Jacobians<'_>, options: &Options) -> Result<Lowered, String> {
    let layout = Layout::new(sorted);
    let mut program = Program { arena: sorted.system.flat.templates.arena.clone(), ..Program::default() };
    let places = layout.plan(&sorted.simulation, true);
    let initial_places = layout.plan(&sorted.initial, false);
    let known = layout.bound();
    let bind = bound(&mut program, sorted, (&layout, &known), ("bind", &[&sorted.bindings, &sorted.starts]))?;
    let at_start = (&layout, &initial_places);
    let late_starts = bound(&mut program, sorted, at_start, ("late starts", &[&sorted.late_starts]))?;
    let rooted: Vec<u32> = relations(sorted, |trigger| matches!(trigger, Trigger::State));
    let root = |&r: &u32| (sorted.relations[r as usize].root, sorted.relations[r as usize].operands);
    let truths: Vec<_> = sorted.relations.iter().map(|r| (r.truth, r.operands)).collect();
    let lowering = PlanLowering {
        sorted,
        layout: &layout,
        places: &places,
        plan: &sorted.simulation,
        jacobian: jacobians.simulation,
        extra: rooted.iter().map(root).collect(),
        options,
    };
    let (simulation, plain) = lowering.lower(&mut program, ["assign", "residual", "jacobian", "roots", "closing"])?;
    let lowering = PlanLowering {
        places: &initial_places,
        plan: &sorted.initial,
        jacobian: jacobians.initial,
        extra: truths.iter().copied().chain(redundant_sides(sorted)).collect(),
        ..lowering
    };
    let names = ["initial assign", "initial residual", "initial jacobian", "initial truths", "initial closing"];
    let (initial, initial_plain) = lowering.lower(&mut program, names)?;
    let events = EventLowering { sorted, layout: &layout, places: &places }.lower(&mut program, &truths, rooted)?;
    let routines = Arc::new(Routines { bind, late_starts, simulation, initial, events });
    Ok(Lowered { program: Arc::new(program), layout, places, initial_places, routines, plain, initial_plain })
}

/// Left and right side of the initial conditions that are only checked.
fn redundant_sides(sorted: &SortedSystem) -> impl Iterator<Item = (NodeId, OperandRange)> + '_ {
    sorted.redundant.iter().flat_map(|r| [r.left, r.right]).map(|side| (side.value, side.operands))
}

fn relations(sorted: &SortedSystem, wanted: impl Fn(&Trigger) -> bool) -> Vec<u32> {
    (0u32..).zip(&sorted.relations).filter(|(_, relation)| wanted(&relation.trigger)).map(|(k, _)| k).collect()
}

/// Adds rows of one level that write to `Out` in order.
pub(crate) fn add_rows(
    batch: &mut Batch<'_>,
    arena: &Arena,
    sorted: &SortedSystem,
    rows: impl IntoIterator<Item = (NodeId, OperandRange)>,
) -> Result<(), String> {
    for (index, (value, operands)) in (0u32..).zip(rows) {
        let (operands, to) = (sorted.system.operands_of(operands), [Place { area: Area::Out, index }]);
        batch.add(arena, Item { level: 0, values: &[value], operands, extra: &[], to: &to })?;
    }
    Ok(())
}

/// Parameters and start values, list after list.
fn bound(
    program: &mut Program,
    sorted: &SortedSystem,
    (layout, places): (&Layout, &PlanPlaces),
    (name, lists): (&'static str, &[&[Assignment]]),
) -> Result<RoutineId, String> {
    let locate = |operand| layout.locate(sorted, places, operand);
    let mut kernels = Vec::new();
    for list in lists {
        let mut batch = Batch::new(&locate);
        for assignment in *list {
            add_bound(&mut batch, &mut program.arena, sorted, layout, assignment)?;
        }
        kernels.extend(batch.kernels(&mut program.tables));
    }
    Ok(push(program, name, kernels))
}

fn add_bound(
    batch: &mut Batch<'_>,
    arena: &mut Arena,
    sorted: &SortedSystem,
    layout: &Layout,
    assignment: &Assignment,
) -> Result<(), String> {
    let operands = sorted.system.operands_of(assignment.operands);
    let place = match assignment.target {
        Target::Var(v) => layout.value(v),
        Target::Start(v) => layout.start(v).map(|index| Place { area: Area::Data, index }),
        _ => None,
    };
    let to = place.ok_or("a binding has no place")?;
    let given = match assignment.target {
        Target::Var(_) => to.index.checked_sub(layout.parameters.start).and_then(|k| layout.given[k as usize]),
        _ => None,
    };
    let plain = Item { level: assignment.level, values: &[assignment.value], operands, extra: &[], to: &[to] };
    let Some(given) = given else { return batch.add(arena, plain) };
    let first = operands.len();
    let (flag, set) = (arena.slot(SlotId::new(first)), arena.slot(SlotId::new(first + 1)));
    let value = arena.select(flag, set, assignment.value);
    let extra = [given.flag, given.value].map(|index| Place { area: Area::Data, index });
    batch.add(arena, Item { values: &[value], extra: &extra, ..plain })
}

struct EventLowering<'a> {
    sorted: &'a SortedSystem,
    layout: &'a Layout,
    places: &'a PlanPlaces,
}

impl EventLowering<'_> {
    fn lower(
        &self,
        program: &mut Program,
        truths: &[(NodeId, OperandRange)],
        rooted: Vec<u32>,
    ) -> Result<EventRoutines, String> {
        let (mut timed, mut instants) = (Vec::new(), Vec::new());
        for (k, relation) in (0u32..).zip(&self.sorted.relations) {
            if let Trigger::Time { instant, rises, right_after } = relation.trigger {
                timed.push(TimedRelation { relation: k, rises, right_after });
                instants.push((instant, relation.operands));
            }
        }
        let locate = |operand| self.layout.locate(self.sorted, self.places, operand);
        let (by_time, time_roots) = by_time::lower(program, self.sorted, &locate, &rooted)?;
        let reinits: Vec<_> = self.sorted.reinits.iter().map(|a| (a.value, a.operands)).collect();
        let pivots: Vec<_> = self.sorted.pivots.iter().map(|p| (p.value, p.operands)).collect();
        let mut checks: Vec<_> = self.sorted.checks.iter().map(|c| (c.condition.value, c.condition.operands)).collect();
        checks.extend(message_values(self.sorted).into_iter().flatten());
        Ok(EventRoutines {
            truths: self.rows(program, "truths", truths)?,
            instants: self.rows(program, "instants", &instants)?,
            timed,
            late: late::late_relations(self.sorted),
            steering: self.steering(),
            rooted,
            by_time,
            time_roots: push(program, "time roots", time_roots),
            discrete: self.discrete(program)?,
            reinits: self.rows(program, "reinits", &reinits)?,
            reinit_unknowns: self.reinit_unknowns()?,
            reads_solution: self.reads_solution(),
            checks: self.rows(program, "checks", &checks)?,
            pivots: self.rows(program, "pivots", &pivots)?,
        })
    }

    fn rows(
        &self,
        program: &mut Program,
        name: &'static str,
        list: &[(NodeId, OperandRange)],
    ) -> Result<RoutineId, String> {
        let locate = |operand| self.layout.locate(self.sorted, self.places, operand);
        let mut batch = Batch::new(&locate);
        add_rows(&mut batch, &program.arena, self.sorted, list.iter().copied())?;
        let kernels = batch.kernels(&mut program.tables);
        Ok(push(program, name, kernels))
    }

    fn discrete(&self, program: &mut Program) -> Result<RoutineId, String> {
        let locate = |operand| self.layout.locate(self.sorted, self.places, operand);
        let mut batch = Batch::new(&locate);
        for a in &self.sorted.discrete {
            let Target::Var(v) = a.target else { return Err("a discrete equation has no variable".into()) };
            let to = self.layout.value(v).ok_or("a discrete variable has no place")?;
            let operands = self.sorted.system.operands_of(a.operands);
            let item = Item { level: a.level, values: &[a.value], operands, extra: &[], to: &[to] };
            batch.add(&program.arena, item)?;
        }
        let kernels = batch.kernels(&mut program.tables);
        Ok(push(program, "discrete", kernels))
    }

    /// Which relations the equations of the start or the run read, or other relations.
    fn steering(&self) -> Vec<bool> {
        let mut steering = vec![false; self.sorted.relations.len()];
        let system = &self.sorted.system;
        let solved = [Section::Continuous, Section::Initial, Section::Selection, Section::Pivot];
        let equations = solved.into_iter().flat_map(|section| system.equations_in(section));
        let ranges = equations.map(|eq| system.equations[eq].operands);
        for range in ranges.chain(self.sorted.relations.iter().map(|relation| relation.operands)) {
            for operand in system.operands_of(range) {
                if let Target::Held(k) = operand.target() {
                    steering[k as usize] = true;
                }
            }
        }
        steering
    }

    /// True if what happens at an event reads what the solver finds for the discrete variables of that event: rates, unknowns that are
    /// no states, and what is assigned from them.
    fn reads_solution(&self) -> bool {
        let plan = &self.sorted.simulation;
        let solved = |target: Target| match target {
            Target::Der(_) => true,
            Target::Var(v) => self.sorted.system.roles[v] == Role::Candidate,
            _ => false,
        };
        let mut found: FxHashSet<Target> =
            plan.unknowns.iter().filter(|unknown| !unknown.differential).map(|unknown| unknown.target).collect();
        let operands = |range: OperandRange| self.sorted.system.operands_of(range).iter().map(|o| o.target());
        let reads = |found: &FxHashSet<Target>, range: OperandRange, own: Target| {
            operands(range).any(|target| target != own && (solved(target) || found.contains(&target)))
        };
        for a in &plan.assignments {
            if reads(&found, a.operands, a.target) {
                found.insert(a.target);
            }
        }
        let at_events = self.sorted.checks.iter().filter(|check| check.kind == CheckKind::AssertOnce);
        // No target of a check is its own.
        let is_read = |check: &Check| operands(check.condition.operands).any(|own| solved(own) || found.contains(&own));
        self.sorted.discrete.iter().chain(&self.sorted.reinits).any(|a| reads(&found, a.operands, a.target))
            || at_events.clone().any(is_read)
    }

    fn reinit_unknowns(&self) -> Result<Vec<u32>, String> {
        let unknown = |a: &Assignment| match self.places.get(a.target) {
            Some(Place { area: Area::Unknown, index }) => Ok(index),
            _ => Err("`reinit` of a variable that is not a state".to_string()),
        };
        self.sorted.reinits.iter().map(unknown).collect()
    }
}

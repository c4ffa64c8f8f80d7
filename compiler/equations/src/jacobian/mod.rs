//! The Jacobian of a plan: partial derivatives of each expression and the composed sparsity pattern.
//!
//! Every assignment and residual is differentiated with respect to its own slots only, once per distinct expression
//! (forward accumulation on the extended system, Griewank and Walther 2008, "Evaluating Derivatives", chapters 9 and 10).
//! Along chains of assignments the partials are composed numerically; which unknowns an expression depends on through
//! such chains, its *support*, is computed here once.  No values are computed here.

pub(crate) mod reverse;

use hyd_flat::Target;
use hyd_index::TypedIndex;
use hyd_symbolic::{NodeId, SlotId};
use rustc_hash::FxHashMap;

use crate::jacobian::reverse::partials;
use crate::lists::Lists;
use crate::sorted::Plan;
use crate::system::{EquationSystem, OperandRange};

/// Partial derivatives and patterns of a [`Plan`] with `m` assignments, `n` unknowns and `n` residuals.
///
/// *Rows* are the assignments in their order, then the residuals: row `r` is `assignments[r]` for `r < m`, else
/// `residuals[r - m]`.  *Columns* are the unknowns and their rates: column `k < n` is `y[k]` (or `z[k]`), column `n + k`
/// is `y'[k]`, that is `Der(v)` of the unknown `Var(v)`.  The initial plan has no rate columns: there `Der(v)` is an
/// unknown or assigned like any variable.
///
/// The total derivative of row `r` by column `c` is
/// `D[r][c] = sum over (slot, partial) in partials of row r of  sign(slot) * partial * d(target of slot)/d(column c)`,
/// where `sign` is -1 if the row's operand in that slot is negated, and `d(target)/d(c)` is 1 if the target is the unknown
/// or rate of column `c`, `D[a][c]` if the target is assigned by assignment `a`, and 0 else (parameters, constants,
/// discrete variables, held relations).
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct PlanJacobian {
    /// For each row the position of its expression in `forms`; rows with the same value node have the same form.
    pub form_of_row: Vec<u32>,
    /// For each distinct value node (in order of first use) its non-zero partial derivatives by slot, slots ascending.
    /// The partial is by what the slot reads, *sign of the operand included in the value, not in the partial*; it is an
    /// expression over the same operands as the row's value.  Slots that read nothing but constants of the step
    /// (parameters, discrete variables, `pre`, `Held`) in all rows of the form are left out; in a row where such a slot
    /// reads one of these, its entry is to be skipped (its target has no column and no assignment).
    pub forms: Lists<(SlotId, NodeId)>,
    /// For each row the columns its value depends on, through assignments too; ascending.
    pub support: Lists<u32>,
    /// Pattern of dF/dy: (residual, unknown), sorted; the part of `support` of the residuals below `n`.
    pub state_pattern: Vec<(u32, u32)>,
    /// Pattern of dF/dy': (residual, unknown), sorted; empty for the initial plan.
    pub rate_pattern: Vec<(u32, u32)>,
}

impl PlanJacobian {
    /// The non-zero partial derivatives of row `r` by its slots.
    pub fn partials(&self, r: usize) -> &[(SlotId, NodeId)] {
        self.forms.row(self.form_of_row[r] as usize)
    }
}

/// Differentiates a plan of the system (either plan); adds the partial derivatives to the system's arena.
pub fn differentiate(system: &mut EquationSystem, plan: &Plan) -> PlanJacobian {
    let places = Places::new(system.roles.len(), plan);
    let rows: Vec<(NodeId, OperandRange)> = plan
        .assignments
        .iter()
        .map(|a| (a.value, a.operands))
        .chain(plan.residuals.iter().map(|r| (r.value, r.operands)))
        .collect();
    let (form_of_row, forms) = differentiate_forms(system, &places, &rows);
    let support = supports(system, &places, plan, &rows, &form_of_row, &forms);
    let mut jacobian = PlanJacobian { form_of_row, forms, support, ..PlanJacobian::default() };
    let count = plan.unknowns.len() as u32;
    for k in 0..plan.residuals.len() {
        for &column in jacobian.support.row(plan.assignments.len() + k) {
            if column < count {
                jacobian.state_pattern.push((k as u32, column));
            } else {
                jacobian.rate_pattern.push((k as u32, column - count));
            }
        }
    }
    jacobian
}

/// What a target is within a plan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PlanPlace {
    /// A column of the Jacobian.
    Column(u32),
    /// The result of an assignment.
    Assigned(u32),
    /// Neither: it does not vary with the unknowns.
    Fixed,
}

/// Where the targets of a plan are found.
#[derive(Clone, Debug)]
pub struct Places {
    value: Vec<PlanPlace>,
    rate: Vec<PlanPlace>,
}

impl Places {
    /// The places of a plan among `count` variables.
    pub fn new(count: usize, plan: &Plan) -> Self {
        let mut places = Self { value: vec![PlanPlace::Fixed; count], rate: vec![PlanPlace::Fixed; count] };
        for (k, unknown) in plan.unknowns.iter().enumerate() {
            places.set(unknown.target, PlanPlace::Column(k as u32));
            if let (true, Target::Var(v)) = (unknown.differential, unknown.target) {
                places.set(Target::Der(v), PlanPlace::Column((plan.unknowns.len() + k) as u32));
            }
        }
        for (k, assignment) in plan.assignments.iter().enumerate() {
            places.set(assignment.target, PlanPlace::Assigned(k as u32));
        }
        places
    }

    fn set(&mut self, target: Target, place: PlanPlace) {
        match target {
            Target::Var(v) => self.value[v.index()] = place,
            Target::Der(v) => self.rate[v.index()] = place,
            _ => {}
        }
    }

    /// The place of a target.
    pub fn of(&self, target: Target) -> PlanPlace {
        match target {
            Target::Var(v) => self.value[v.index()],
            Target::Der(v) => self.rate[v.index()],
            _ => PlanPlace::Fixed,
        }
    }
}

type Forms = Lists<(SlotId, NodeId)>;

/// One form per distinct value, differentiated by the slots that vary in some row of it.
fn differentiate_forms(
    system: &mut EquationSystem,
    places: &Places,
    rows: &[(NodeId, OperandRange)],
) -> (Vec<u32>, Forms) {
    let mut known: FxHashMap<NodeId, u32> = FxHashMap::default();
    let mut varying: Vec<Vec<bool>> = Vec::new();
    let mut values = Vec::new();
    let mut form_of_row = Vec::with_capacity(rows.len());
    for &(value, operands) in rows {
        let form = *known.entry(value).or_insert(values.len() as u32);
        if form as usize == values.len() {
            values.push(value);
            varying.push(Vec::new());
        }
        let varying = &mut varying[form as usize];
        varying.resize(varying.len().max(operands.len as usize), false);
        for (flag, operand) in varying.iter_mut().zip(system.operands_of(operands)) {
            *flag |= places.of(operand.target()) != PlanPlace::Fixed;
        }
        form_of_row.push(form);
    }
    let mut forms = Lists::default();
    let arena = &mut system.flat.templates.arena;
    for (value, varying) in values.into_iter().zip(varying) {
        let mut partials = partials(arena, value, varying.len());
        partials.retain(|&(slot, partial)| varying[slot.index()] && !arena.is(partial, 0.0));
        partials.sort_unstable_by_key(|&(slot, _)| slot);
        forms.push_row(partials);
    }
    (form_of_row, forms)
}

/// The columns behind each row, found in order: an assignment comes before its readers.
fn supports(
    system: &EquationSystem,
    places: &Places,
    plan: &Plan,
    rows: &[(NodeId, OperandRange)],
    form_of_row: &[u32],
    forms: &Forms,
) -> Lists<u32> {
    let mut seen = vec![u32::MAX; 2 * plan.unknowns.len()];
    let mut support: Lists<u32> = Lists::default();
    let mut columns: Vec<u32> = Vec::new();
    for (r, &(_, operands)) in rows.iter().enumerate() {
        let operands = system.operands_of(operands);
        columns.clear();
        let mut add = |column: u32, columns: &mut Vec<u32>| {
            if std::mem::replace(&mut seen[column as usize], r as u32) != r as u32 {
                columns.push(column);
            }
        };
        for &(slot, _) in forms.row(form_of_row[r] as usize) {
            match places.of(operands[slot.index()].target()) {
                PlanPlace::Column(column) => add(column, &mut columns),
                PlanPlace::Assigned(k) => support.row(k as usize).iter().for_each(|&column| add(column, &mut columns)),
                PlanPlace::Fixed => {}
            }
        }
        columns.sort_unstable();
        support.push_row(columns.iter().copied());
    }
    support
}

//! From equations to the integers and numbers of index reduction, and to its two decisions.
//!
//! How often each equation is differentiated follows from the pattern (Pantelides 1988); which derivatives become algebraic
//! follows from wishes (`stateSelect`, a fixed start, a start value, the order of declaration) and from the partial
//! derivatives at the start (Mattsson and Söderlind 1993).  Nothing is changed here.

use hyd_flat::{Section, StateSelect, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Code, Diagnostic};
use hyd_structure::{Column, DummyProblem, Entry, Incidence, Row, choose_dummies, pantelides};
use hyd_symbolic::{NodeId, SlotId, TemplateId, partial};
use rustc_hash::FxHashMap;

use crate::algebra::Algebra;
use crate::balance::simulation_unknowns;
use crate::incidence::{Unknowns, pattern};
use crate::representative::block_of_variable;
use crate::sorted::EqId;
use crate::start_point::{StartPoint, typical};
use crate::system::{EquationSystem, Role};

/// What is to be done.
pub(crate) struct ReductionPlan {
    /// The equations to differentiate, with the number of times, ascending.
    pub equations: Vec<(EqId, u32)>,
    /// For the variables in them: highest derivative, and how many of the highest are dummies; ascending.
    pub variables: Vec<(VarId, u32, u32)>,
    /// Equations whose dummy derivative was chosen by structure alone.
    pub uncertain: Vec<EqId>,
}

/// Plans the reduction of a system that is structurally regular.
pub(crate) fn plan_reduction(system: &mut EquationSystem, algebra: &mut Algebra) -> Result<ReductionPlan, Diagnostic> {
    let unknowns = all_orders(system);
    let derivative = unknowns.targets.iter().map(|&target| match target {
        Target::Var(v) => unknowns.column(Target::Der(v)),
        _ => None,
    });
    let derivative = IndexVec::from_vec(derivative.collect());
    let rows = system.equations_in(Section::Continuous);
    let pattern = pattern(system, algebra, rows, &unknowns);
    let singular = |_| Diagnostic::error(Code::Singular, "the equations cannot be differentiated to index 1");
    let plan = pantelides(&pattern.incidence, &derivative).map_err(singular)?;
    debug_assert_eq!(hyd_structure::verify::check_differentiation(&pattern.incidence, &derivative, &plan), Ok(()));
    let orders = plan.row_orders(pattern.rows.len());
    let equations: Vec<(EqId, u32)> = orders
        .iter_enumerated()
        .filter(|(_, order)| **order > 0)
        .map(|(row, &o)| (pattern.rows[row.index()], o))
        .collect();
    let values: Vec<(VarId, Column)> = unknowns
        .targets
        .iter_enumerated()
        .filter_map(|(column, &target)| match target {
            Target::Var(v) => Some((v, column)),
            _ => None,
        })
        .collect();
    let highest: Vec<u32> = values.iter().map(|&(_, column)| plan.order_above(column)).collect();
    let variables: Vec<VarId> = values.iter().map(|value| value.0).collect();
    let point = StartPoint::new(system, algebra)?;
    let leading = Leading::new(system, algebra, &equations, &variables, &highest, &point);
    let wishes = Wishes::new(system);
    let problem = DummyProblem {
        incidence: &leading.incidence,
        row_orders: &IndexVec::from_vec(equations.iter().map(|equation| equation.1).collect()),
        column_orders: &IndexVec::from_vec(highest.clone()),
        values: &leading.values,
    };
    let choice = choose_dummies(problem, |column, order| wishes.of(system, variables[column.index()], order));
    let choice = choice.map_err(|_| singular(hyd_structure::NotReducible::Malformed))?;
    let triples = variables.iter().zip(&highest).zip(choice.dummies.iter());
    Ok(ReductionPlan {
        variables: triples.map(|((&v, &highest), &dummies)| (v, highest, dummies)).collect(),
        uncertain: choice.uncertain.iter().map(|row: &Row| equations[row.index()].0).collect(),
        equations,
    })
}

/// A column for each value and each derivative.
fn all_orders(system: &EquationSystem) -> Unknowns {
    let mut all = Unknowns::new(system.roles.len());
    for &target in simulation_unknowns(system).targets.iter() {
        match target {
            Target::Der(v) => {
                all.add(Target::Var(v));
                all.add(Target::Der(v));
            }
            _ => {
                all.add(target);
            }
        }
    }
    all
}

/// Where the differentiated equations contain highest derivatives, with the partial derivatives at the start.
struct Leading {
    incidence: Incidence,
    values: IndexVec<Entry, f64>,
}

impl Leading {
    fn new(
        system: &mut EquationSystem,
        algebra: &mut Algebra,
        equations: &[(EqId, u32)],
        variables: &[VarId],
        highest: &[u32],
        point: &StartPoint,
    ) -> Self {
        let mut column_of = IndexVec::filled(None, system.roles.len());
        for (k, &v) in variables.iter().enumerate() {
            column_of[v] = Some(Column::new(k));
        }
        let mut leading = Self { incidence: Incidence::new(variables.len()), values: IndexVec::new() };
        let mut partials: FxHashMap<(TemplateId, SlotId), NodeId> = FxHashMap::default();
        for &(eq, order) in equations {
            let equation = system.equations[eq];
            let facts = algebra.facts(&mut system.flat.templates, equation.template).clone();
            let mut entries: Vec<(Column, f64)> = Vec::new();
            for &slot in &facts.slots {
                let operand = system.operands_of(equation.operands)[slot.index()];
                let (v, own) = match operand.target() {
                    Target::Var(v) => (v, 0),
                    Target::Der(v) => (v, 1),
                    _ => continue,
                };
                let Some(column) = column_of[v].filter(|column: &Column| highest[column.index()] == own + order) else {
                    continue;
                };
                let arena = &mut system.flat.templates.arena;
                let slope = partials.entry((equation.template, slot));
                let slope = *slope.or_insert_with(|| partial(arena, facts.residual, slot));
                let value = point.evaluate(system, slope, equation.operands);
                let value = if value.is_finite() { value } else { typical(eq.0 ^ slot.0) };
                entries.push((column, if operand.negated() { -value } else { value }));
            }
            leading.push(entries);
        }
        leading
    }

    fn push(&mut self, mut entries: Vec<(Column, f64)>) {
        entries.sort_by_key(|entry| entry.0);
        let mut merged: Vec<(Column, f64)> = Vec::with_capacity(entries.len());
        for (column, value) in entries {
            match merged.last_mut() {
                Some(last) if last.0 == column => last.1 += value,
                _ => merged.push((column, value)),
            }
        }
        let row = self.incidence.push_row(merged.iter().map(|entry| entry.0));
        row.expect("invariant: columns are sorted, distinct and known");
        self.values.raw.extend(merged.iter().map(|entry| entry.1));
    }
}

/// How much each variable is wanted as a state.
struct Wishes {
    block: IndexVec<VarId, u32>,
    has_start: IndexVec<VarId, bool>,
    is_reinitialised: IndexVec<VarId, bool>,
}

/// Compared in order: the variable itself rather than a derivative, `stateSelect`, target of `reinit`, fixed, a start value,
/// declared by the user, a state before, declared early.
type Wish = (bool, u8, [bool; 5], std::cmp::Reverse<VarId>);

impl Wishes {
    fn new(system: &EquationSystem) -> Self {
        let mut wishes = Self {
            block: block_of_variable(&system.flat),
            has_start: IndexVec::filled(false, system.roles.len()),
            is_reinitialised: IndexVec::filled(false, system.roles.len()),
        };
        for eq in system.equations.indices() {
            match (system.section(eq), system.left_operand(eq).map(|operand| operand.target())) {
                (Section::Start, Some(Target::Start(v))) => wishes.has_start[v] = true,
                (Section::Reinit, Some(Target::Var(v))) => wishes.is_reinitialised[v] = true,
                _ => {}
            }
        }
        wishes
    }

    fn of(&self, system: &EquationSystem, v: VarId, order: u32) -> Wish {
        let block = &system.flat.variables.raw[self.block[v] as usize];
        let fixed = block.fixed.get((v.0 - block.first.0) as usize);
        let select = block.state_select as u8;
        debug_assert!(StateSelect::Never < StateSelect::Always);
        let was_state = system.roles[v] == Role::State;
        let flags = [self.is_reinitialised[v], fixed, self.has_start[v], !block.internal, was_state];
        (order == 0, select, flags, std::cmp::Reverse(v))
    }
}

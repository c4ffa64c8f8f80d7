//! From equations to the integers and numbers of index reduction, and to its two decisions.
//!
//! How often each equation is differentiated follows from the pattern (Pantelides 1988); which derivatives become algebraic
//! follows from wishes (`stateSelect`, a fixed start, a start value, the order of declaration) and from the partial
//! derivatives at the start (Mattsson and Söderlind 1993).  Nothing is changed here.

use hyd_flat::{Section, StateSelect, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Code, Diagnostic};
use hyd_structure::{CandidateSet, Column, DummyProblem, Entry, Incidence, Row, choose_dummies, pantelides};
use hyd_symbolic::{NodeId, SlotId, TemplateId, partial, slots};
use rustc_hash::FxHashMap;

use crate::algebra::{Algebra, Known, is_clocked};
use crate::alias::representative::block_of_variable;
use crate::balance::simulation_unknowns;
use crate::incidence::{Unknowns, pattern};
use crate::index_reduction::time_derivative::NotDifferentiable;
use crate::start_point::{StartPoint, typical};
use crate::system::{EqId, EquationSystem, Role};

/// An equation is differentiated at most as often as this; no model of a real thing comes near.
const MOST_ORDER: u32 = 100;

/// What is to be done.
pub(crate) struct ReductionPlan {
    /// The equations to differentiate, with the number of times, ascending.
    pub equations: Vec<(EqId, u32)>,
    /// For the variables in them: highest derivative, and how many of the highest are dummies; ascending.
    pub variables: Vec<(VarId, u32, u32)>,
    /// Equations whose dummy derivative was chosen by structure alone.
    pub uncertain: Vec<EqId>,
    /// Where the choice is left to the run; `variables` says nothing about these orders.
    pub sets: Vec<OpenSet>,
}

/// A set of candidates with the Jacobian of its equations.
pub(crate) struct OpenSet {
    /// Number of equations and of columns.
    pub size: (u32, u32),
    /// Row, column and expression of each entry.
    pub entries: Vec<(u32, u32, Slope)>,
    /// Pivots that hold for the whole run.
    pub pivots: Vec<(u32, u32)>,
    /// Rows left after these.
    pub open: Vec<u32>,
    /// Columns left: variable and order of the derivative that may be a state.
    pub candidates: Vec<(u32, VarId, u32)>,
}

/// The partial derivative of an equation: an expression over its operands.
#[derive(Clone, Copy)]
pub(crate) struct Slope {
    /// The expression.
    pub value: NodeId,
    /// The equation.
    pub equation: EqId,
}

/// Plans the reduction of a system that is structurally regular; with `open` the choice is left to the run where it may have to
/// change.
pub(crate) fn plan_reduction(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    open: bool,
) -> Result<ReductionPlan, Diagnostic> {
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
    if let Some(&(eq, order)) = equations.iter().max_by_key(|equation| equation.1).filter(|most| most.1 > MOST_ORDER) {
        return Err(NotDifferentiable::TooOften(eq, order).diagnostic(system));
    }
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
    let always = variables.iter().map(|&v| wishes.is_always(system, v)).collect();
    let always = IndexVec::from_vec(always);
    let problem = DummyProblem {
        incidence: &leading.incidence,
        row_orders: &IndexVec::from_vec(equations.iter().map(|equation| equation.1).collect()),
        column_orders: &IndexVec::from_vec(highest.clone()),
        values: &leading.values,
        constant: open.then_some(&leading.constant),
        states: &always,
    };
    let wish = |column: Column, order| wishes.of(system, variables[column.index()], order);
    let choice = choose_dummies(problem, wish);
    // Where too little is left to choose from during the run, a choice made once may have what the start asks for.
    let choice = match choice {
        Ok(open) if open.uncertain.is_empty() => Ok(open),
        found => {
            let once = choose_dummies(DummyProblem { constant: None, ..problem }, wish);
            match (found, once) {
                (Ok(open), Ok(once)) if !once.uncertain.is_empty() => {
                    Ok(if open.sets.is_empty() { once } else { open })
                }
                (Ok(open), Err(_)) => Ok(open),
                (_, once) => once,
            }
        }
    };
    let choice = choice.map_err(|_| singular(hyd_structure::NotReducible::Malformed))?;
    let triples = variables.iter().zip(&highest).zip(choice.dummies.iter());
    let sets = choice.sets.iter().map(|set| leading.open_set(set, &variables, &highest)).collect();
    Ok(ReductionPlan {
        sets,
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
    /// The same during the whole run.
    constant: IndexVec<Entry, bool>,
    slopes: IndexVec<Entry, Slope>,
}

/// An entry of a row.
struct Leaf {
    column: Column,
    value: f64,
    constant: bool,
    slope: NodeId,
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
        let mut leading = Self {
            incidence: Incidence::new(variables.len()),
            values: IndexVec::new(),
            constant: IndexVec::new(),
            slopes: IndexVec::new(),
        };
        let known = Known::parameters(system);
        let mut partials: FxHashMap<(TemplateId, SlotId), NodeId> = FxHashMap::default();
        for &(eq, order) in equations {
            let equation = system.equations[eq];
            let facts = algebra.facts(&mut system.flat.templates, equation.template).clone();
            let mut entries: Vec<Leaf> = Vec::new();
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
                let reads = slots(&system.flat.templates.arena, &[slope]);
                let operands = system.operands_of(equation.operands);
                let constant = !is_clocked(&system.flat.templates, slope)
                    && reads.iter().all(|slot| known.is_known(operands[slot.index()]));
                let leaf = Leaf { column, value, constant, slope };
                entries.push(if operand.negated() { leaf.negative(system) } else { leaf });
            }
            leading.push(system, eq, entries);
        }
        leading
    }

    fn push(&mut self, system: &mut EquationSystem, equation: EqId, mut entries: Vec<Leaf>) {
        entries.sort_by_key(|entry| entry.column);
        let mut merged: Vec<Leaf> = Vec::with_capacity(entries.len());
        for leaf in entries {
            match merged.last_mut() {
                Some(last) if last.column == leaf.column => {
                    last.value += leaf.value;
                    last.constant &= leaf.constant;
                    last.slope = system.flat.templates.arena.add(last.slope, leaf.slope);
                }
                _ => merged.push(leaf),
            }
        }
        let row = self.incidence.push_row(merged.iter().map(|entry| entry.column));
        row.expect("invariant: columns are sorted, distinct and known");
        for leaf in merged {
            self.values.push(leaf.value);
            self.constant.push(leaf.constant);
            self.slopes.push(Slope { value: leaf.slope, equation });
        }
    }

    /// The part of the matrix that a set needs: its rows, the columns of its pivots, then its candidates.
    fn open_set(&self, set: &CandidateSet, variables: &[VarId], highest: &[u32]) -> OpenSet {
        let row_of: FxHashMap<Row, u32> = set.rows.iter().copied().zip(0..).collect();
        let columns = set.pivots.iter().map(|pivot| pivot.1).chain(set.candidates.iter().copied());
        let column_of: FxHashMap<Column, u32> = columns.zip(0..).collect();
        let mut entries = Vec::new();
        for (row, &equation) in (0..).zip(&set.rows) {
            for (entry, column) in self.incidence.entries(equation) {
                if let Some(&column) = column_of.get(&column) {
                    entries.push((row, column, self.slopes[entry]));
                }
            }
        }
        let candidate = |column: &Column| {
            let k = column.index();
            (column_of[column], variables[k], highest[k] - set.level)
        };
        OpenSet {
            size: (set.rows.len() as u32, column_of.len() as u32),
            entries,
            pivots: set.pivots.iter().map(|(row, column)| (row_of[row], column_of[column])).collect(),
            open: set.open.iter().map(|row| row_of[row]).collect(),
            candidates: set.candidates.iter().map(candidate).collect(),
        }
    }
}

impl Leaf {
    fn negative(self, system: &mut EquationSystem) -> Self {
        let slope = system.flat.templates.arena.neg(self.slope);
        Self { value: -self.value, slope, ..self }
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

    /// True for what must not become dependent: `stateSelect = always`, and what `reinit` writes (Modelica 3.6, section 8.3.5).
    fn is_always(&self, system: &EquationSystem, v: VarId) -> bool {
        let block = &system.flat.variables.raw[self.block[v] as usize];
        block.state_select_of(v) == StateSelect::Always || self.is_reinitialised[v]
    }

    fn of(&self, system: &EquationSystem, v: VarId, order: u32) -> Wish {
        let block = &system.flat.variables.raw[self.block[v] as usize];
        let fixed = block.fixed.get((v.0 - block.first.0) as usize);
        let select = block.state_select_of(v) as u8;
        debug_assert!(StateSelect::Never < StateSelect::Always);
        let was_state = system.roles[v] == Role::State;
        let flags = [self.is_reinitialised[v], fixed, self.has_start[v], block.made.is_none(), was_state];
        (order == 0, select, flags, std::cmp::Reverse(v))
    }
}

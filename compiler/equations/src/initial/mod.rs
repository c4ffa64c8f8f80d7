//! The initial system: consistent values of all variables, derivatives and free parameters at the start.
//!
//! Unknowns are states, their derivatives, algebraic variables and parameters with `fixed = false`; equations are the
//! continuous and the initial ones, `x = start` for every fixed variable, and bindings that depend on free parameters
//! (Modelica 3.6, section 8.6).  If states are left open, `x = start` is added for as many as a matching can
//! take, one at a time in order of preference; adding greedily is optimal because the sets of unknowns that can be left
//! out form a matroid (Edmonds and Fulkerson 1965, transversals).  Discrete variables and held relations are known here.  Where
//! numbers show that conditions depend on each other (`dependent_start`), one is given up and the rest is matched anew.

mod contradiction;
mod dependent_start;
pub(crate) mod discrete_start;
mod fixed_aliases;
mod fixed_numbers;
pub(crate) mod homotopy;
mod matching;
mod redundant;

use hyd_flat::{EquationBlock, Operand, Section, StateSelect, Target, VarId};
use hyd_index::IndexVec;
use hyd_source::{Code, Diagnostic};
use hyd_structure::{Augmentation, Augmenter, Matching, maximum_matching};
use hyd_symbolic::{SlotId, Template};
use hyd_system::Variability;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::algebra::Algebra;
use crate::alias::representative::block_of_variable;
use crate::explain::faults::{counted, explain_over, explain_under, list_names};
use crate::incidence::{self, Pattern, Unknowns, pattern};
use crate::index_reduction::selection::dependent_at_start;
use crate::initial::dependent_start::dependent_conditions;
use crate::initial::discrete_start::open_discrete;
use crate::initial::fixed_aliases::fixed_aliases;
use crate::initial::fixed_numbers::fixed_numbers;
use crate::initial::matching::first_matching;
use crate::initial::redundant::{Conditions, note_redundant, take_redundant};
use crate::plan::bindings::Bindings;
use crate::plan::discrete::discrete_start_slot;
use crate::plan::wishes::wishes;
use crate::plan::{Kind, Loops, Mismatch, Request, build_plan};
use crate::sorted::{Assignment, Plan, Redundant};
use crate::start_point::StartPoint;
use crate::system::{EqId, Equation, EquationSystem, Resolution, Role};

/// Variables whose start values are used that are explained one by one.
const MOST_EXPLAINED: usize = 3;

/// The initial plan, and the conditions that follow from others and are only checked; notes say which those are and which start
/// values were taken as initial values.
pub(crate) fn initial_plan(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    (bindings, loops): (&Bindings, Loops),
    (values, late_starts): (&StartPoint, &[Assignment]),
    notes: &mut Vec<Diagnostic>,
) -> Result<(Plan, Vec<Redundant>), Box<Diagnostic>> {
    let mut unknowns = initial_unknowns(system, bindings);
    let mut model = system.equations_in(Section::Continuous);
    // At the start a delayed value is its source, as an initial equation says.
    model.retain(|&eq| !bindings.used[eq] && !system.is_delay(eq));
    model.extend(&bindings.late_equations);
    let mut initial = system.equations_in(Section::Initial);
    initial.retain(|&eq| {
        let late = late_starts.iter().any(|start| start.equation == eq);
        !late && discrete_start_slot(system, algebra, &bindings.known, eq).is_none()
    });
    let fixed = fixed_variables(system);
    let starts = add_start_equations(system, bindings, &fixed);
    let mut fixed: Vec<(VarId, EqId)> = fixed.into_iter().zip(starts).collect();
    fixed.extend(fixed_numbers(system)?);
    fixed.extend(fixed_aliases(system)?);
    let conditions = Conditions { model, fixed, initial };
    if system.roles.iter().any(|&role| role == Role::Discrete) {
        let rows = pattern(system, algebra, conditions.rows(), &unknowns);
        if first_matching(system, &rows, &unknowns).unmatched_rows().next().is_some() {
            open_discrete(system, &mut unknowns, &conditions);
        }
    }
    let dependent = dependent_at_start(system, algebra)?;
    let mut start = Start { loops, unknowns, conditions, dependent, given_up: Vec::new(), passed_over: Vec::new() };
    let attempt = start.regular(system, algebra, bindings, values)?;
    notes.extend(note(system, &attempt.chosen));
    notes.extend(note_redundant(system, &attempt.redundant));
    Ok((attempt.plan, attempt.redundant))
}

/// What determines the start, and what numbers have said about it.
struct Start {
    loops: Loops,
    unknowns: Unknowns,
    conditions: Conditions,
    /// Candidates that should rather not be given.
    dependent: IndexVec<VarId, bool>,
    /// Conditions that follow from others by numbers.
    given_up: Vec<EqId>,
    /// Variables whose start values add nothing, by numbers.
    passed_over: Vec<VarId>,
}

/// A plan with what had to be left out or added for it.
struct Attempt {
    plan: Plan,
    redundant: Vec<Redundant>,
    /// Variables that take their start values, and the equations that say so.
    chosen: Vec<(VarId, EqId)>,
    /// The conditions in the plan, the last the first to be given up.
    conditions: Vec<EqId>,
}

impl Start {
    /// A plan that is not singular as far as that can be seen; where none is found, the one that structure alone suggests.
    fn regular(
        &mut self,
        system: &mut EquationSystem,
        algebra: &mut Algebra,
        bindings: &Bindings,
        values: &StartPoint,
    ) -> Result<Attempt, Box<Diagnostic>> {
        let lengths = (system.equations.len(), system.flat.equations.len(), system.operands.len());
        let reset = |system: &mut EquationSystem| {
            system.equations.raw.truncate(lengths.0);
            system.flat.equations.truncate(lengths.1);
            system.operands.truncate(lengths.2);
        };
        let first = self.attempt(system, algebra, bindings, values)?;
        let is_state = |v: VarId| match system.resolution[v] {
            Resolution::Alias { of, .. } => system.roles[of].may_be_state(),
            _ => system.roles[v].may_be_state(),
        };
        let by_states = first.chosen.iter().chain(&self.conditions.fixed).all(|&(v, _)| is_state(v));
        if by_states && self.conditions.initial.is_empty() {
            return Ok(first);
        }
        let mut attempt = first;
        loop {
            let found = dependent_conditions(system, algebra, bindings, &attempt.plan, &attempt.conditions);
            if found.is_empty() {
                return Ok(attempt);
            }
            for eq in found {
                match attempt.chosen.iter().find(|chosen| chosen.1 == eq) {
                    Some(&(v, _)) => self.passed_over.push(v),
                    None => self.given_up.push(eq),
                }
            }
            reset(system);
            let Ok(next) = self.attempt(system, algebra, bindings, values) else { break };
            attempt = next;
        }
        reset(system);
        self.given_up.clear();
        self.passed_over.clear();
        self.attempt(system, algebra, bindings, values)
    }

    fn attempt(
        &self,
        system: &mut EquationSystem,
        algebra: &mut Algebra,
        bindings: &Bindings,
        values: &StartPoint,
    ) -> Result<Attempt, Box<Diagnostic>> {
        let unknowns = &self.unknowns;
        let mut conditions = self.conditions.clone();
        let mut redundant = conditions.give_up(system, &self.given_up);
        let mut pattern = pattern(system, algebra, conditions.rows(), unknowns);
        let mut matching = first_matching(system, &pattern, unknowns);
        if matching.unmatched_rows().next().is_some() {
            redundant.extend(take_redundant(system, algebra, unknowns, &mut conditions)?);
            pattern = incidence::pattern(system, algebra, conditions.rows(), unknowns);
            matching = first_matching(system, &pattern, unknowns);
        }
        if matching.unmatched_rows().next().is_some() {
            return Err(Box::new(overdetermined(system, &pattern, unknowns, &matching)));
        }
        let chosen = self.choose_starts(system, &pattern, &mut matching);
        if matching.unmatched_columns().next().is_some() {
            let diagnostic = Diagnostic::error(Code::InitialUnbalanced, "the start is not determined");
            let matching = maximum_matching(&pattern.incidence, None);
            return Err(Box::new(explain_under(diagnostic, system, &pattern, unknowns, &matching)));
        }
        let added = add_start_equations(system, bindings, &chosen);
        if !added.is_empty() {
            let rows = [pattern.rows.as_slice(), &added].concat();
            pattern = incidence::pattern(system, algebra, rows, unknowns);
        }
        let kinds = IndexVec::filled(Kind::Plain, unknowns.targets.len());
        let wishes = wishes(system, unknowns);
        let request = Request { pattern, unknowns, kinds, wishes, known: &bindings.known, values, loops: self.loops };
        let plan = build_plan(system, algebra, request).map_err(|mismatch| {
            let Mismatch { pattern, matching } = *mismatch;
            Box::new(overdetermined(system, &pattern, unknowns, &matching))
        })?;
        let ordered = [conditions.ordered(system), added.clone()].concat();
        Ok(Attempt { plan, redundant, chosen: chosen.into_iter().zip(added).collect(), conditions: ordered })
    }

    /// The variables that take their start values as initial values, in the order of declaration.
    fn choose_starts(&self, system: &EquationSystem, pattern: &Pattern, matching: &mut Matching) -> Vec<VarId> {
        let mut open = matching.unmatched_columns().count();
        if open == 0 {
            return Vec::new();
        }
        let mut incidence = pattern.incidence.clone();
        let mut augmenter = Augmenter::new();
        let mut chosen = Vec::new();
        for v in candidates(system, self) {
            if open == 0 {
                break;
            }
            let column = self.unknowns.column(Target::Var(v)).filter(|_| !self.passed_over.contains(&v));
            let Some(column) = column else { continue };
            let row = incidence.push_row([column]).expect("invariant: one known column");
            if augmenter.augment(&incidence, matching, row, |_| true) == Augmentation::Matched {
                chosen.push(v);
                open -= 1;
            }
        }
        chosen.sort_unstable();
        chosen
    }
}

fn initial_unknowns(system: &EquationSystem, bindings: &Bindings) -> Unknowns {
    let mut unknowns = Unknowns::new(system.roles.len());
    for v in system.roles.indices().filter(|&v| system.is_continuous(v) && !bindings.known.bound[v]) {
        unknowns.add(Target::Var(v));
        if system.roles[v] == Role::State {
            unknowns.add(Target::Der(v));
        }
    }
    for &v in &bindings.late {
        unknowns.add(Target::Var(v));
    }
    unknowns
}

/// Continuous variables whose start value is an initial equation; also those that are known before the start, whose value must
/// agree.
fn fixed_variables(system: &EquationSystem) -> Vec<VarId> {
    let blocks = block_of_variable(&system.flat);
    let fixed = |v: VarId| {
        let block = &system.flat.variables.raw[blocks[v] as usize];
        block.fixed.get((v.0 - block.first.0) as usize)
    };
    system.roles.indices().filter(|&v| system.is_continuous(v) && fixed(v)).collect()
}

/// Start attributes that read parameters found at the start: their value is an unknown of the initial system, too.
fn late_starts(system: &EquationSystem, bindings: &Bindings) -> FxHashMap<VarId, EqId> {
    let mut late = FxHashMap::default();
    if bindings.late.is_empty() {
        return late;
    }
    for eq in system.equations_in(Section::Start) {
        let operands = system.operands_of(system.equations[eq].operands);
        let waits = |operand: &Operand| {
            let Target::Var(v) = operand.target() else { return false };
            system.roles[v] == Role::Parameter && !bindings.known.bound[v]
        };
        if operands.iter().any(waits)
            && let Some(Target::Start(v)) = system.left_operand(eq).map(|operand| operand.target())
        {
            late.insert(v, eq);
        }
    }
    late
}

/// The equation of a start attribute, said of the variable itself.
fn say_of_variable(system: &mut EquationSystem, v: VarId, start: EqId) -> EqId {
    let equation = system.equations[start];
    let own = |operand: &Operand| match operand.target() {
        Target::Start(of) if of == v => Operand::new(Target::Var(v)).signed(operand.negated()),
        _ => *operand,
    };
    let operands: Vec<Operand> = system.operands_of(equation.operands).iter().map(own).collect();
    let origin = system.flat.equations[equation.block as usize].origin.clone();
    let block = system.flat.equations.len() as u32;
    let range = crate::relations::append(system, &operands);
    let (section, template) = (Section::Initial, equation.template);
    system.flat.equations.push(EquationBlock { section, made: false, template, count: 1, operands, origin });
    system.equations.push(Equation { template, operands: range, block, element: 0, order: 0 })
}

/// Appends initial equations `x = x.start`, neighbours of one declaration in one block.
fn add_start_equations(system: &mut EquationSystem, bindings: &Bindings, variables: &[VarId]) -> Vec<EqId> {
    let late = late_starts(system, bindings);
    if late.is_empty() {
        return add_plain_starts(system, variables);
    }
    let said = |v: &VarId| late.contains_key(v);
    let groups = variables.chunk_by(|a, b| !said(a) && !said(b));
    let mut added = Vec::with_capacity(variables.len());
    for group in groups {
        match late.get(&group[0]) {
            Some(&eq) => added.push(say_of_variable(system, group[0], eq)),
            None => added.extend(add_plain_starts(system, group)),
        }
    }
    added
}

fn add_plain_starts(system: &mut EquationSystem, variables: &[VarId]) -> Vec<EqId> {
    let arena = &mut system.flat.templates.arena;
    let (left, right) = (arena.slot(SlotId(0)), arena.slot(SlotId(1)));
    let template = system.flat.templates.intern(Template { left, right, arity: 2 });
    let blocks = block_of_variable(&system.flat);
    let mut added = Vec::with_capacity(variables.len());
    for group in variables.chunk_by(|&a, &b| blocks[a] == blocks[b]) {
        let origin = system.flat.variables.raw[blocks[group[0]] as usize].origin.clone();
        let operands: Vec<Operand> =
            group.iter().flat_map(|&v| [Operand::new(Target::Var(v)), Operand::new(Target::Start(v))]).collect();
        let block = system.flat.equations.len() as u32;
        for element in 0..group.len() as u32 {
            let own = &operands[2 * element as usize..2 * element as usize + 2];
            let operands = crate::relations::append(system, own);
            added.push(system.equations.push(Equation { template, operands, block, element, order: 0 }));
        }
        let (section, count) = (Section::Initial, group.len() as u32);
        system.flat.equations.push(EquationBlock { section, made: false, template, count, operands, origin });
    }
    added
}

/// States and free parameters by preference: a state whose rate a given-up condition speaks of, `stateSelect`, not dependent by the
/// size of pivots, a start value, declaration.
fn candidates(system: &EquationSystem, start: &Start) -> Vec<VarId> {
    let blocks = block_of_variable(&system.flat);
    let mut keys = Vec::new();
    let given_up = start.given_up.iter().flat_map(|&eq| system.operands_of(system.equations[eq].operands));
    let at_rest: FxHashSet<Target> = given_up.map(|operand| operand.target()).collect();
    for &target in start.unknowns.targets.iter() {
        let Target::Var(v) = target else { continue };
        let block = &system.flat.variables.raw[blocks[v] as usize];
        let kind = match system.roles[v] {
            Role::State | Role::Candidate => 0,
            Role::Parameter | Role::Discrete => 1,
            _ if block.has_start => 2,
            _ => continue,
        };
        let select = StateSelect::Always as u8 - block.state_select_of(v) as u8;
        let is_named = at_rest.contains(&Target::Der(v));
        keys.push((kind, !is_named, select, start.dependent[v], !block.has_start, v));
    }
    keys.sort_unstable();
    keys.into_iter().map(|key| key.5).collect()
}

fn note(system: &EquationSystem, chosen: &[(VarId, EqId)]) -> Option<Diagnostic> {
    let names = list_names(chosen.iter().map(|&(v, _)| system.flat.var_name(v)));
    let message = format!("the start is not fully determined: the start values of {names} are used as initial values");
    (!chosen.is_empty()).then(|| {
        let mut note = Diagnostic::note(Code::Chosen, message);
        for said in chosen.iter().filter_map(|&(v, _)| said_of(system, v)).take(MOST_EXPLAINED) {
            note = note.help(said);
        }
        note
    })
}

/// True if an equation reads both variables, so that one decides the other.
fn are_in_one_equation(system: &EquationSystem, one: VarId, other: VarId) -> bool {
    system.equations_in(Section::Continuous).into_iter().any(|eq| {
        let has = |v: VarId| {
            system.operands_of(system.equations[eq].operands).iter().any(|own| own.target() == Target::Var(v))
        };
        has(one) && has(other)
    })
}

/// What a user may not have meant of a variable whose start value is used: it has none, or it is a parameter that the start was to find.
fn said_of(system: &EquationSystem, v: VarId) -> Option<String> {
    let (name, flat) = (system.flat.var_name(v), &system.flat);
    let block = &flat.variables[flat.locate(v).0];
    if block.made.is_some() {
        return None;
    }
    if system.roles[v] == Role::Parameter {
        return Some(format!(
            "`{name}` is a parameter with `fixed = false`, and no initial equation determines it: add one, or give it a value"
        ));
    }
    if block.has_start {
        return None;
    }
    // A start value beside it that is only a guess may have been meant for it.
    let beside = flat.variables.iter().find(|other| {
        other.has_start
            && other.made.is_none()
            && other.origin.path == block.origin.path
            && other.variability == Variability::Continuous
            && !other.fixed.get(0)
            && system.roles[other.first] == Role::Algebraic
            && are_in_one_equation(system, v, other.first)
    });
    let guess = beside.map(|other| other.name.element(0));
    let guess = guess.map_or_else(String::new, |other| {
        format!("; the start value of `{other}` is only a guess, unless it has `fixed = true`")
    });
    Some(format!("`{name}` has no start value and begins at 0{guess}"))
}

fn overdetermined(system: &EquationSystem, pattern: &Pattern, unknowns: &Unknowns, matching: &Matching) -> Diagnostic {
    let surplus = counted(matching.unmatched_rows().count(), "initial condition");
    let message = format!("the start is over-determined: {surplus} too many");
    // What is left open would be filled with start values; only the surplus is at fault.
    explain_over(Diagnostic::error(Code::InitialUnbalanced, message), system, pattern, unknowns, matching)
}

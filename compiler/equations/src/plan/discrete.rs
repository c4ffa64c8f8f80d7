//! What happens at events: discrete equations in the order of their dependence, `reinit`, assertions and terminations.
//!
//! A discrete equation may read continuous variables, held relations and `pre` values freely; among each other the
//! discrete variables must form no cycle (Modelica 3.6, section 8.3.5.1: a `pre` breaks it).

use hyd_flat::{Operand, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Code, Diagnostic};
use hyd_structure::{Entry, Matching, maximum_matching};
use hyd_symbolic::{Node, SlotId, alias};
use hyd_system::{CheckKind, ValueKind};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::algebra::{Algebra, Known, Solvability};
use crate::alias::representative::block_of_variable;
use crate::explain::faults::{counted, explain_parts, list_names, mark_equations, written_text};
use crate::incidence::{Pattern, Unknowns, pattern};
use crate::initial::discrete_start::keep_their_values;
use crate::plan::bindings::assignment;
use crate::plan::levels::order_by_level;
use crate::relations::append;
use crate::sorted::{Assignment, Check, Residual};
use crate::system::{EqId, EquationSystem, Role};

/// The discrete assignments, in order.
pub(crate) fn sort_discrete(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    known: &Known,
) -> Result<Vec<Assignment>, Diagnostic> {
    let mut unknowns = Unknowns::new(system.roles.len());
    for v in system.roles.indices() {
        if system.roles[v] == Role::Discrete && system.is_own(v) {
            unknowns.add(Target::Var(v));
        }
    }
    let rows = system.equations_in(Section::Discrete);
    let pattern = pattern(system, algebra, rows, &unknowns);
    let matching = match_discrete(system, algebra, known, &pattern);
    if !matching.is_perfect() {
        return Err(unbalanced(system, &pattern, &unknowns, &matching));
    }
    let blocks = hyd_structure::block_order(&pattern.incidence, &matching);
    let blocks = blocks.expect("invariant: the matching is perfect, checked above");
    let mut level = IndexVec::filled(0_u32, unknowns.targets.len());
    let mut assignments = Vec::new();
    for block in blocks.blocks() {
        let (rows, columns) = blocks.block(block);
        let equations: Vec<EqId> = rows.iter().map(|row| pattern.rows[row.index()]).collect();
        let ([row], [column]) = (rows, columns) else {
            let names = columns.iter().map(|&c| unknowns.targets[c]);
            return Err(cycle(system, names.collect(), &equations));
        };
        let entry = pattern.incidence.entry(*row, *column).expect("invariant: matched pairs occur");
        let Some(value) = algebra.value(system, equations[0], pattern.slots[entry]) else {
            return Err(cycle(system, vec![unknowns.targets[*column]], &equations));
        };
        let others = pattern.incidence.row(*row).iter().filter(|&other| other != column);
        level[*column] = others.map(|&other| level[other] + 1).max().unwrap_or(0);
        assignments.push(Assignment {
            target: unknowns.targets[*column],
            value,
            operands: system.equations[equations[0]].operands,
            equation: equations[0],
            level: level[*column],
        });
    }
    order_by_level(&mut assignments);
    Ok(assignments)
}

fn match_discrete(system: &mut EquationSystem, algebra: &mut Algebra, known: &Known, pattern: &Pattern) -> Matching {
    let mut classes: IndexVec<Entry, u8> = IndexVec::new();
    for row in pattern.incidence.rows() {
        let eq = pattern.rows[row.index()];
        let left = system.left_slot(eq);
        for entry in pattern.incidence.entry_range(row) {
            let slot = pattern.slots[Entry::new(entry)];
            let class = match algebra.solvability(system, known, eq, slot) {
                Solvability::Never => Solvability::Never as u8 + 1,
                _ if left == Some(slot) => 0,
                class => class as u8 + 1,
            };
            classes.push(class);
        }
    }
    maximum_matching(&pattern.incidence, Some(&classes))
}

fn unbalanced(system: &EquationSystem, pattern: &Pattern, unknowns: &Unknowns, matching: &Matching) -> Diagnostic {
    // Conditions of `when` count on both sides.
    let hidden = unknowns.targets.iter().filter(|&&target| crate::explain::faults::is_hidden(system, target)).count();
    let rows = counted(pattern.rows.len().saturating_sub(hidden), "discrete equation");
    let message = format!("{rows} for {}", counted(unknowns.targets.len().saturating_sub(hidden), "discrete variable"));
    explain_parts(Diagnostic::error(Code::Unbalanced, message), system, pattern, unknowns, matching)
}

fn cycle(system: &EquationSystem, targets: Vec<Target>, equations: &[EqId]) -> Diagnostic {
    let named: Vec<Target> =
        targets.iter().copied().filter(|&t| !crate::explain::faults::is_hidden(system, t)).collect();
    let targets = if named.is_empty() { targets } else { named };
    let names = list_names(targets.iter().map(|&t| system.flat.operand_name(hyd_flat::Operand::new(t))));
    let message = match targets.len() {
        1 if crate::explain::faults::is_hidden(system, targets[0]) => {
            "the condition of a `when` depends on itself".to_string()
        }
        1 => format!("the discrete variable {names} depends on itself"),
        _ => format!("the discrete variables {names} depend on each other in a cycle"),
    };
    let diagnostic =
        Diagnostic::error(Code::DiscreteLoop, message).help("use `pre(...)` to read the value from before the event");
    mark_equations(diagnostic, system, equations)
}

/// Start attributes, and initial equations that only say where a discrete variable starts (`pre(d) = 1`, `d = 1`); and those of
/// discrete variables that wait for what is found at the start, of which the first list has the guesses.
pub(crate) fn starts(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    known: &Known,
) -> (Vec<Assignment>, Vec<Assignment>) {
    let mut starts: Vec<Assignment> = Vec::new();
    for eq in system.equations_in(Section::Initial) {
        starts.extend(discrete_start(system, algebra, known, eq));
    }
    hand_on(system, &mut starts);
    let given: Vec<Target> = starts.iter().map(|a| a.target).collect();
    for eq in system.equations_in(Section::Start) {
        starts.extend(assignment(system, eq, 0).filter(|a| !given.contains(&a.target)));
    }
    let targets: FxHashSet<Target> = starts.iter().map(|a| a.target).collect();
    let is_late = |system: &EquationSystem, operand: &Operand| match operand.target() {
        Target::Var(v) => system.roles[v] == Role::Parameter && !known.bound[v],
        _ => false,
    };
    let mut late = Vec::new();
    for start in &mut starts {
        if !system.operands_of(start.operands).iter().any(|operand| is_late(system, operand)) {
            continue;
        }
        if matches!(start.target, Target::Start(v) if system.roles[v] == Role::Discrete) {
            late.push(*start);
        }
        let guess = |operand: &Operand| match operand.target() {
            Target::Var(v) if is_late(system, operand) && targets.contains(&Target::Start(v)) => {
                Operand::new(Target::Start(v)).signed(operand.negated())
            }
            _ => *operand,
        };
        let operands: Vec<Operand> = system.operands_of(start.operands).iter().map(guess).collect();
        start.operands = append(system, &operands);
        start.level = 1;
    }
    late.extend(values_before(system, algebra, known, &given));
    order_by_level(&mut starts);
    order_by_level(&mut late);
    (starts, late)
}

/// Values before the start that initial equations give by what the start finds (`pre(open) = not closed`).  A start value that is not fixed
/// is a guess, so they decide (Modelica 3.6, section 8.6).  Variables that only a `when` sets are one with their values before the start
/// (`discrete_start`), and so are Reals.
fn values_before(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    known: &Known,
    given: &[Target],
) -> Vec<Assignment> {
    let keeps = keep_their_values(system);
    let blocks = block_of_variable(&system.flat);
    let is_open = |system: &EquationSystem, v: VarId| {
        let block = &system.flat.variables.raw[blocks[v] as usize];
        let fixed = block.fixed.get((v.0 - block.first.0) as usize);
        system.roles[v] == Role::Discrete && !keeps[v] && block.kind != ValueKind::Real && !fixed
    };
    // Of each equation the side that is such a value alone.
    let candidate = |system: &EquationSystem, eq: EqId| {
        let template = system.flat.templates.get(system.equations[eq].template);
        let operands = system.operands_of(system.equations[eq].operands);
        [template.left, template.right].into_iter().find_map(|side| {
            let Node::Slot(slot) = system.flat.templates.arena.node(side) else { return None };
            match operands[slot.index()].target() {
                Target::Pre(v) if is_open(system, v) => Some((slot, v)),
                _ => None,
            }
        })
    };
    let (candidates, others): (Vec<EqId>, Vec<EqId>) =
        system.equations_in(Section::Initial).into_iter().partition(|&eq| candidate(system, eq).is_some());
    let elsewhere: FxHashSet<VarId> = others.iter().flat_map(|&eq| open_parameters(system, known, eq)).collect();
    let mut found: Vec<Assignment> = Vec::new();
    for eq in candidates {
        let Some((slot, v)) = candidate(system, eq) else { continue };
        let operands = system.equations[eq].operands;
        let target = Target::Start(v);
        let said = given.contains(&target) || found.iter().any(|a| a.target == target);
        // It may be what determines a parameter.
        if said || open_parameters(system, known, eq).iter().any(|v| !elsewhere.contains(v)) {
            continue;
        }
        if let Some(value) = algebra.value(system, eq, slot) {
            found.push(Assignment { target, value, operands, equation: eq, level: 0 });
        }
    }
    found
}

/// The parameters that the initial equations determine of those that an equation reads.  A Real has a part in values of other types through
/// relations and the like only, which leave it open.
fn open_parameters(system: &EquationSystem, known: &Known, eq: EqId) -> Vec<VarId> {
    let operands = system.operands_of(system.equations[eq].operands);
    let open = |&operand: &Operand| match operand.target() {
        Target::Var(v) => {
            let kind = &system.flat.variables[system.flat.locate(v).0].kind;
            let is_open = system.roles[v] == Role::Parameter && *kind != ValueKind::Real && !known.is_known(operand);
            is_open.then_some(v)
        }
        _ => None,
    };
    operands.iter().filter_map(open).collect()
}

/// Start values that follow from others, because an initial equation says that two values before the start are equal (`pre(a) = pre(b)`),
/// or because what an initial equation determines is a value from before (`active = true` where `active = pre(next)`).
fn hand_on(system: &mut EquationSystem, starts: &mut Vec<Assignment>) {
    let twins = twins(system);
    if twins.is_empty() {
        return;
    }
    let blocks = block_of_variable(&system.flat);
    let is_fixed = |system: &EquationSystem, v: VarId| {
        let block = &system.flat.variables.raw[blocks[v] as usize];
        block.fixed.get((v.0 - block.first.0) as usize)
    };
    let mut known: FxHashMap<VarId, Assignment> = FxHashMap::default();
    let of_variable = |a: &Assignment| match a.target {
        Target::Start(v) => Some((v, *a)),
        _ => None,
    };
    known.extend(starts.iter().filter_map(of_variable));
    // `v = 1`, not `pre(v) = 1`.
    let says = |(&v, a): (&VarId, &Assignment)| {
        let operands = system.operands_of(system.equations[a.equation].operands);
        operands.iter().any(|operand| operand.target() == Target::Var(v)).then_some(v)
    };
    let stated: FxHashSet<VarId> = known.iter().filter_map(says).collect();
    for eq in system.equations_in(Section::Start) {
        let Some(Target::Start(v)) = system.left_operand(eq).map(|operand| operand.target()) else { continue };
        if is_fixed(system, v) && !known.contains_key(&v) {
            known.extend(assignment(system, eq, 0).map(|a| (v, a)));
        }
    }
    let mut changed = true;
    while changed {
        changed = false;
        for &(from, to, of_statement) in &twins {
            let open = !known.contains_key(&to) && !is_fixed(system, to);
            let source = known.get(&from).filter(|_| !of_statement || stated.contains(&from)).copied();
            if let (true, Some(source)) = (open, source) {
                let next = Assignment { target: Target::Start(to), ..source };
                known.insert(to, next);
                starts.push(next);
                changed = true;
            }
        }
    }
}

/// Pairs of discrete variables of which the value before the start of the second is that of the first; true where it is the value that an initial
/// equation states of the first.
fn twins(system: &EquationSystem) -> Vec<(VarId, VarId, bool)> {
    let mut twins = Vec::new();
    let is_discrete = |v: VarId| system.roles[v] == Role::Discrete;
    for (eq, equation) in system.equations.iter_enumerated() {
        let section = system.section(eq);
        if !matches!(section, Section::Initial | Section::Discrete) {
            continue;
        }
        let templates = &system.flat.templates;
        let Some((a, b, false)) = alias(&templates.arena, &templates.get(equation.template)) else { continue };
        let operands = system.operands_of(equation.operands);
        let (a, b) = (operands[a.index()], operands[b.index()]);
        if a.negated() != b.negated() {
            continue;
        }
        match (a.target(), b.target()) {
            (Target::Pre(v), Target::Pre(w)) if section == Section::Initial && is_discrete(v) && is_discrete(w) => {
                twins.extend([(v, w, false), (w, v, false)]);
            }
            (Target::Var(v), Target::Pre(w)) | (Target::Pre(w), Target::Var(v)) if is_discrete(v) && is_discrete(w) => {
                twins.push((v, w, true));
            }
            _ => {}
        }
    }
    twins
}

/// The slot of the discrete variable that an initial equation gives a start value, if that is all it does.
pub(crate) fn discrete_start_slot(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    known: &Known,
    eq: EqId,
) -> Option<SlotId> {
    let equation = system.equations[eq];
    let facts = algebra.facts(&mut system.flat.templates, equation.template);
    let operands = system.operands_of(equation.operands);
    let mut open = facts.slots.iter().filter(|slot| !known.is_known(operands[slot.index()]));
    match (open.next(), open.next()) {
        (Some(&slot), None) => match operands[slot.index()].target() {
            Target::Var(v) | Target::Pre(v) if system.roles[v] == Role::Discrete => Some(slot),
            _ => None,
        },
        _ => None,
    }
}

fn discrete_start(system: &mut EquationSystem, algebra: &mut Algebra, known: &Known, eq: EqId) -> Option<Assignment> {
    let slot = discrete_start_slot(system, algebra, known, eq)?;
    let value = algebra.value(system, eq, slot)?;
    let operands = system.equations[eq].operands;
    let target = match system.operands_of(operands)[slot.index()].target() {
        Target::Var(v) | Target::Pre(v) => Target::Start(v),
        _ => return None,
    };
    Some(Assignment { target, value, operands, equation: eq, level: 0 })
}

/// The `reinit` statements; those of variables with a fixed value are gone.
pub(crate) fn reinits(system: &mut EquationSystem) -> Result<Vec<Assignment>, Diagnostic> {
    let mut reinits = Vec::new();
    for eq in system.equations_in(Section::Reinit) {
        let Some(reinit) = assignment(system, eq, 0) else { continue };
        match reinit.target {
            Target::Var(v) if system.roles[v] != Role::State => {
                let message = format!("`reinit` needs a state, but `{}` has no derivative", system.flat.var_name(v));
                let diagnostic = Diagnostic::error(Code::Misplaced, message).maybe_help(state_behind(system, v));
                return Err(mark_equations(diagnostic, system, &[eq]));
            }
            Target::Var(_) => reinits.push(reinit),
            _ => {}
        }
    }
    Ok(reinits)
}

/// Which state decides what an algebraic variable is, where one equation has both and no other state.
fn state_behind(system: &EquationSystem, v: VarId) -> Option<String> {
    let mut found = system.equations_in(Section::Continuous).into_iter().filter_map(|eq| {
        let targets = || system.operands_of(system.equations[eq].operands).iter().map(|own| own.target());
        let is_state = |target: &Target| matches!(target, Target::Var(s) if system.roles[*s] == Role::State);
        let mut states = targets().filter(is_state);
        match (targets().any(|target| target == Target::Var(v)), states.next(), states.next()) {
            (true, Some(Target::Var(state)), None) => Some((state, eq)),
            _ => None,
        }
    });
    let (state, eq) = found.next().filter(|_| found.next().is_none())?;
    let (name, state) = (system.flat.var_name(v), system.flat.var_name(state));
    Some(format!(
        "`{name}` follows from the state `{state}` by `{}`: reset that one, with the value that belongs to the new `{name}`, as in `reinit({state}, ...)`",
        written_text(system, eq)
    ))
}

/// Assertions and terminations.
pub(crate) fn checks(system: &EquationSystem) -> Vec<Check> {
    let mut checks = Vec::new();
    for (eq, equation) in system.equations.iter_enumerated() {
        let (message, kind) = match system.section(eq) {
            Section::Assert(message) => (message, CheckKind::Assert),
            Section::AssertOnce(message) => (message, CheckKind::AssertOnce),
            Section::Terminate(message) => (message, CheckKind::Terminate),
            _ => continue,
        };
        let value = system.flat.templates.get(equation.template).left;
        let condition = Residual { value, operands: equation.operands, equation: eq };
        checks.push(Check { condition, message, kind });
    }
    checks
}

//! Structural analysis: can the equations determine the unknowns at all?
//!
//! Unknowns of the simulation are the derivatives of states and the algebraic variables; they must match the continuous
//! equations perfectly.  If they do not, but would with a state counting wherever it or its derivative occurs, some
//! equations constrain states and must be differentiated first (Pantelides 1988).  Otherwise numbers differ or the model is
//! structurally singular; the message names the smallest part at fault.

use hyd_flat::{BlockId, Imbalance, Section, Target, VarId};
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic, Edit, Span};
use hyd_structure::{Matching, maximum_matching};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::algebra::Algebra;
use crate::explain::faults::{
    counted, explain_parts, is_made, list_names, made_equations, mark_equations, mark_variables, name_components,
    over_sentence, part_equations, smallest_over, variable_of, written_text,
};
use crate::explain::held_states::{held_message, held_states};
use crate::explain::own_equations::{self, odd_ones};
use crate::explain::prescribed::prescribed_twice;
use crate::incidence::{Pattern, Unknowns, pattern};
use crate::system::{EqId, EquationSystem, Reduction, Role};

/// Equations that determine no derivative and no algebraic variable: they constrain states.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Constraints {
    /// The equations, a smallest set for each constraint found.
    pub equations: Vec<EqId>,
}

/// Checks that the system is square and structurally regular; the constraints found are empty for index 1 or less.
pub(crate) fn check_balance(system: &mut EquationSystem, algebra: &mut Algebra) -> Result<Constraints, Diagnostic> {
    let rows = simulation_equations(system);
    let mut unknowns = simulation_unknowns(system);
    let rates = pattern(system, algebra, rows.clone(), &unknowns);
    let matching = maximum_matching(&rates.incidence, None);
    if matching.is_perfect() {
        return Ok(Constraints::default());
    }
    let columns: Vec<_> = unknowns.targets.iter_enumerated().map(|(column, &target)| (column, target)).collect();
    for (column, target) in columns {
        if let Target::Der(v) = target {
            unknowns.point(Target::Var(v), column);
        }
    }
    let all = pattern(system, algebra, rows, &unknowns);
    let full = maximum_matching(&all.incidence, None);
    if full.is_perfect() {
        return Ok(constraints(&rates, &matching));
    }
    if let Some(said) = held_without(system, algebra) {
        return Err(said);
    }
    Err(as_written(system).unwrap_or_else(|| imbalance(system, &all, &unknowns, &full)))
}

/// The message on equations that hold states, if there are as many as equations too many and all is regular without them.
fn held_without(system: &mut EquationSystem, algebra: &mut Algebra) -> Option<Diagnostic> {
    let mut rows = simulation_equations(system);
    let unknowns = simulation_unknowns(system);
    let held = held_states(system, rows.len().saturating_sub(unknowns.targets.len()));
    if held.is_empty() {
        return None;
    }
    rows.retain(|row| held.iter().all(|(eq, _)| eq != row));
    let rest = pattern(system, algebra, rows, &unknowns);
    maximum_matching(&rest.incidence, None).is_perfect().then(|| held_message(system, &held)).flatten()
}

/// The same check before aliases were eliminated: its message speaks of the equations as they are written.  `None` if
/// the numbers agree there, or the system is no longer the one that was written.
fn as_written(system: &EquationSystem) -> Option<Diagnostic> {
    if system.reduction != Reduction::default() || system.flat.scalars > MOST_SCALARS {
        return None;
    }
    let mut plain = crate::roles::assign_roles(system.flat.clone());
    let mut unknowns = simulation_unknowns(&plain);
    let columns: Vec<_> = unknowns.targets.iter_enumerated().map(|(column, &target)| (column, target)).collect();
    for (column, target) in columns {
        if let Target::Der(v) = target {
            unknowns.point(Target::Var(v), column);
        }
    }
    let rows = plain.equations_in(Section::Continuous);
    let pattern = pattern(&mut plain, &mut Algebra::default(), rows, &unknowns);
    let matching = maximum_matching(&pattern.incidence, None);
    (!matching.is_perfect()).then(|| imbalance(&plain, &pattern, &unknowns, &matching))
}

/// An element without a derivative is taken for a mistake where at least this many times as many others have one.
const MANY_TIMES: usize = 3;
/// So many equations that contradict each other are listed beside the one that is too many.
const FEW: usize = 4;
/// Most declarations of inputs that are marked.
const MOST_MARKED: usize = 8;
/// Larger models are explained after alias elimination only.
const MOST_SCALARS: u32 = 200_000;

/// Derivatives of states and algebraic variables, in the order of declaration.
pub(crate) fn simulation_unknowns(system: &EquationSystem) -> Unknowns {
    let mut unknowns = Unknowns::new(system.roles.len());
    for (v, role) in system.roles.iter_enumerated().filter(|&(v, _)| system.is_own(v)) {
        match role {
            Role::State => drop(unknowns.add(Target::Der(v))),
            Role::Algebraic => drop(unknowns.add(Target::Var(v))),
            Role::Candidate => add_candidate(&mut unknowns, v),
            _ => {}
        }
    }
    unknowns
}

/// The column of a candidate stands for its value where it is dependent and for its derivative where it is a state.
pub(crate) fn add_candidate(unknowns: &mut Unknowns, v: VarId) {
    let column = unknowns.add(Target::Var(v));
    unknowns.point(Target::Der(v), column);
}

/// The equations of the simulation.
pub(crate) fn simulation_equations(system: &EquationSystem) -> Vec<EqId> {
    let belongs = |&eq: &EqId| matches!(system.section(eq), Section::Continuous | Section::Selection);
    system.equations.indices().filter(belongs).collect()
}

fn imbalance(system: &EquationSystem, pattern: &Pattern, unknowns: &Unknowns, matching: &Matching) -> Diagnostic {
    let (rows, columns) = (pattern.rows.len(), unknowns.targets.len());
    // Aliases that were eliminated count on both sides, parts of long sums on none.
    let written = system.flat.count(Section::Continuous).saturating_sub(made_equations(system));
    let needed = (columns + written).saturating_sub(rows);
    let code = if rows == columns { Code::Singular } else { Code::Unbalanced };
    let message = match rows == columns {
        true => format!(
            "the model is structurally singular: {}",
            match written {
                1 => "1 equation does not determine the only unknown".to_string(),
                n => format!("{n} equations do not determine {n} unknowns"),
            }
        ),
        false => format!("{} for {}", counted(written, "equation"), counted(needed, "unknown")),
    };
    let values = unknowns.targets.iter().filter_map(|&t| variable_of(t)).map(Target::Var).collect();
    let mut by_value = unknowns.clone();
    by_value.targets = hyd_index::IndexVec::from_vec(values);
    let twice = if rows == columns { prescribed_twice(system, pattern, &by_value, matching) } else { None };
    if let Some(twice) = twice {
        return twice;
    }
    // Inputs that nothing feeds are all that is missing.
    let open = &system.flat.open_inputs;
    let missing: usize = open.iter().map(|&block| system.flat.variables[block].count as usize).sum();
    if missing > 0 && needed == written + missing && system.flat.open_ends.is_empty() {
        return inputs_without_source(system, open, message);
    }
    let message = match rate_of_one(system).filter(|_| written < needed) {
        Some(said) => format!("{message}: {said}"),
        None => message,
    };
    let only_fault = the_only_fault(system, needed.abs_diff(written), written);
    let said = only_fault.or_else(|| written_twice(system, pattern, matching));
    if said.is_none()
        && let Some(odd) = odd_ones(system, pattern, unknowns)
    {
        let said = own_equations::sentence(system, pattern, &odd);
        let mut said = own_equations::mark(Diagnostic::error(code, said).help(message), system, pattern, &odd);
        if let Some(part) = smallest_over(&pattern.incidence, matching).filter(|part| part.rows.len() <= FEW) {
            let equations = part_equations(pattern, &part);
            said = said.help(over_sentence(system, &by_value, &part, &equations));
        }
        return said;
    }
    let diagnostic = match said {
        Some(said) => Diagnostic::error(code, said).help(message),
        None => Diagnostic::error(code, message),
    };
    let diagnostic = name_components(diagnostic, system);
    explain_parts(diagnostic, system, pattern, &by_value, matching)
}

/// An equation that is left over because another one says the same, word by word.
fn written_twice(system: &EquationSystem, pattern: &Pattern, matching: &Matching) -> Option<String> {
    let is_written = |eq: &EqId| !is_made(system, *eq);
    let left_over = matching.unmatched_rows().map(|row| pattern.rows[row.index()]).find(is_written)?;
    let text = written_text(system, left_over);
    let alike = pattern.rows.iter().filter(|eq| is_written(eq) && written_text(system, **eq) == text).count();
    (alike > 1).then(|| match alike {
        2 => format!("`{text}` is written twice: one of them may be meant for other variables"),
        many => format!("`{text}` is written {many} times: all but one may be meant for other variables"),
    })
}

/// The message for inputs that nothing feeds.
fn inputs_without_source(system: &EquationSystem, open: &[BlockId], counts: String) -> Diagnostic {
    let blocks = || open.iter().map(|&block| &system.flat.variables[block]);
    let names = list_names(blocks().flat_map(|block| (0..block.count as usize).map(|k| block.name.element(k))));
    let one = blocks().map(|block| block.count).sum::<u32>() == 1;
    let (s, them) = if one { ("", "it, or give it a value") } else { ("s", "them, or give them values") };
    let message = format!("nothing is connected to the input{s} {names}");
    let mut diagnostic = Diagnostic::error(Code::Unbalanced, message).help(format!("connect {them}")).help(counts);
    let mut places: Vec<Span> = open.iter().map(|&block| system.flat.shown_span(block)).collect();
    places.dedup();
    for place in places.into_iter().take(MOST_MARKED) {
        diagnostic = diagnostic.at(place, "");
    }
    match open {
        [only] if system.flat.variables[*only].count == 1 => {
            propose_source(diagnostic, system, &system.flat.variables[*only].name.element(0))
        }
        _ => diagnostic,
    }
}

/// The only output that nothing reads is likely what an input lacks; several are named.
fn propose_source(diagnostic: Diagnostic, system: &EquationSystem, input: &str) -> Diagnostic {
    let component = |name: &str| name.split('.').next().unwrap_or_default().to_string();
    let unread = system.flat.unread_outputs.iter().filter(|own| component(own) != component(input));
    let unread: Vec<&str> = unread.map(String::as_str).collect();
    match (&unread[..], &system.flat.gaps) {
        ([only], Some(gaps)) => {
            let text = format!("connect({only}, {input})");
            let edit = Edit { span: Span { end: gaps.equation.start, ..gaps.equation }, text: format!("{text};\n  ") };
            let words = format!("nothing reads `{only}`: add `{text}`");
            diagnostic.help(words.clone()).propose(words, vec![edit])
        }
        ([_, _, ..], _) => diagnostic
            .help(format!("outputs that nothing reads: {}", list_names(unread.iter().map(|own| own.to_string())))),
        _ => diagnostic,
    }
}

/// Elements of an array whose derivative no equation has, although there is one for the others: a loop that ends too early.
fn rate_of_one(system: &EquationSystem) -> Option<String> {
    let flat = &system.flat;
    let mut rates: FxHashMap<BlockId, FxHashSet<VarId>> = FxHashMap::default();
    for block in flat.equations.iter().filter(|block| block.section == Section::Continuous) {
        for operand in &block.operands {
            if let Target::Der(v) = operand.target() {
                rates.entry(flat.locate(v).0).or_default().insert(v);
            }
        }
    }
    let given: FxHashSet<VarId> = flat
        .equations
        .iter()
        .filter(|block| block.section == Section::Continuous)
        .flat_map(|block| {
            let template = flat.templates.get(block.template);
            let left = flat.templates.arena.node(template.left);
            (0..block.count as usize).filter_map(move |k| {
                let hyd_symbolic::Node::Slot(left) = left else { return None };
                match block.operands_of(k, template.arity as usize)[left.index()].target() {
                    Target::Var(v) => Some(v),
                    _ => None,
                }
            })
        })
        .collect();
    let mut found = rates.into_iter().filter_map(|(block, known)| {
        let own = &flat.variables[block];
        let missing = (own.count as usize).checked_sub(known.len()).filter(|&missing| missing > 0)?;
        let names = (0..own.count).filter(|k| !known.contains(&VarId(own.first.0 + k)));
        // One that has an equation of its own is not a state.
        if names.clone().any(|k| given.contains(&VarId(own.first.0 + k))) {
            return None;
        }
        let names: Vec<String> = names.map(|k| format!("der({})", own.name.element(k as usize))).collect();
        (known.len() > 1 && missing * MANY_TIMES <= known.len()).then_some((own.first, names, known.len()))
    });
    let (_, names, others) = found.next().filter(|_| found.next().is_none())?;
    let has = if names.len() == 1 { "occurs" } else { "occur" };
    Some(format!("{} {has} in no equation, those of the other {others} elements do", list_names(names.into_iter())))
}

/// What is wrong with the one component at fault, if all that is missing or too many is its own.
fn the_only_fault(system: &EquationSystem, difference: usize, written: usize) -> Option<String> {
    let mut faults = system.flat.imbalances.iter().filter(|fault| !fault.component.is_empty());
    let is_all = |fault: &&Imbalance| fault.given.abs_diff(fault.needed) == difference;
    let fate = |fault: &Imbalance| if fault.given < fault.needed { "missing" } else { "too many" };
    let Some(fault) = faults.next() else {
        // All components are balanced, so it is in what the model says beside them.
        let own = system.flat.imbalances.iter().find(|fault| fault.given < written).filter(is_all)?;
        let class = own.class.rsplit('.').next().unwrap_or(&own.class);
        return Some(format!(
            "{} {} in `{class}` beside its components, which are balanced",
            counted(difference, "equation"),
            fate(own)
        ));
    };
    if faults.next().is_some() || !is_all(&fault) {
        return None;
    }
    let fate = fate(fault);
    Some(format!(
        "{} {fate} in the component `{}` of class `{}`",
        counted(difference, "equation"),
        fault.component,
        fault.class
    ))
}

fn constraints(rates: &Pattern, matching: &Matching) -> Constraints {
    let mut equations = Vec::new();
    for row in matching.unmatched_rows() {
        if let Ok(part) = hyd_structure::minimal_overdetermined(&rates.incidence, matching, row) {
            equations.extend(part.rows.iter().map(|row| rates.rows[row.0 as usize]));
        }
        if equations.len() > 64 {
            break;
        }
    }
    debug_assert!(!equations.is_empty() && smallest_over(&rates.incidence, matching).is_some());
    equations.sort_unstable();
    equations.dedup();
    Constraints { equations }
}

/// The message for constraints that are not differentiated.
pub(crate) fn high_index(system: &EquationSystem, constraints: &Constraints) -> Diagnostic {
    let mut states: Vec<_> = constraints
        .equations
        .iter()
        .flat_map(|&eq| system.operands_of(system.equations[eq].operands))
        .filter_map(|operand| match operand.target() {
            Target::Var(v) if system.roles[v] == Role::State => Some(v),
            _ => None,
        })
        .collect();
    states.sort_unstable();
    states.dedup();
    let names = list_names(states.iter().map(|&v| system.flat.var_name(v)));
    let message = match states.len() {
        1 => {
            format!("the state {names} is determined by {} that must be differentiated", constraint_count(constraints))
        }
        _ => format!("the states {names} depend on each other through {}", constraint_count(constraints)),
    };
    let diagnostic = mark_equations(Diagnostic::error(Code::HighIndex, message), system, &constraints.equations);
    mark_variables(diagnostic, system, &states)
}

fn constraint_count(constraints: &Constraints) -> String {
    match constraints.equations.len() {
        1 => "an equation without derivatives".to_string(),
        n => format!("{n} equations without derivatives"),
    }
}

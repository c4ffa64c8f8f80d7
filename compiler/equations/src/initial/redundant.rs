//! Initial conditions beyond those that determine the start.
//!
//! After index reduction the start of a former state may follow from others (a pendulum whose `x` and `y` are both fixed), and an
//! initial equation may repeat what fixed starts say.  Conditions are matched one after the other, those that a model states most
//! directly first; greedy choice is optimal because sets that can be matched form a matroid (Edmonds and Fulkerson 1965,
//! transversals).  What is left over becomes no equation: it is checked when the values at the start are known, because that may
//! depend on parameters that are set later.  Where numbers decide already, a contradiction is refused here by name.

use std::collections::BTreeSet;

use hyd_flat::{Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Code, Diagnostic};
use hyd_structure::{Augmentation, Augmenter, Part};
use hyd_system::told_apart;
use rustc_hash::FxHashSet;

use crate::algebra::Algebra;
use crate::explain::faults::{explain_part, first_of, is_made, list_names, part_names, written_text};
use crate::incidence::{Pattern, Unknowns, pattern};
use crate::initial::contradiction::{Contradiction, find_contradiction, start_numbers};
use crate::initial::matching::first_matching;
use crate::sorted::{Redundant, Residual};
use crate::system::{EqId, EquationSystem, Resolution, Role};

/// Most conditions that a message names to be dropped.
const MOST_DROPPED: usize = 6;

/// Initial conditions by kind.
#[derive(Clone)]
pub(crate) struct Conditions {
    /// The equations of the model: they are never left out.
    pub model: Vec<EqId>,
    /// `x = x.start` for variables with fixed start.
    pub fixed: Vec<(VarId, EqId)>,
    /// Initial equations.
    pub initial: Vec<EqId>,
}

/// Moves the conditions that follow from others out of `conditions`.
pub(crate) fn take_redundant(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    unknowns: &Unknowns,
    conditions: &mut Conditions,
) -> Result<Vec<Redundant>, Box<Diagnostic>> {
    let (pattern, left_over) = unmatched(system, algebra, unknowns, conditions);
    let starts = start_numbers(system, algebra)?;
    for (eq, part) in &left_over {
        if let Some(contradiction) = find_contradiction(system, algebra, &starts, &pattern, (part, *eq)) {
            let dropped = which_to_drop(system, &pattern, part, conditions);
            return Err(Box::new(refuse(system, &pattern, unknowns, part, &contradiction).maybe_help(dropped)));
        }
    }
    let others: Vec<Vec<String>> =
        left_over.iter().map(|(eq, part)| others(system, &pattern, (part, *eq), conditions)).collect();
    let equations: Vec<EqId> = left_over.iter().map(|(eq, _)| *eq).collect();
    let mut redundant = conditions.give_up(system, &equations);
    for own in &mut redundant {
        let place = equations.iter().position(|&eq| eq == own.left.equation);
        own.others = place.map(|place| others[place].clone());
    }
    Ok(redundant)
}

impl Conditions {
    /// Takes some conditions out, to be checked at the start.
    pub(crate) fn give_up(&mut self, system: &EquationSystem, equations: &[EqId]) -> Vec<Redundant> {
        let equations: FxHashSet<EqId> = equations.iter().copied().collect();
        let of_start = self.fixed.iter().filter(|(_, eq)| equations.contains(eq)).map(|&(v, eq)| (eq, Some(v)));
        let of_text = self.initial.iter().filter(|eq| equations.contains(eq)).map(|&eq| (eq, None));
        let given_up = of_start.chain(of_text).map(|(eq, start_of)| checked(system, eq, start_of)).collect();
        self.fixed.retain(|(_, eq)| !equations.contains(eq));
        self.initial.retain(|eq| !equations.contains(eq));
        given_up
    }

    /// The conditions beside the equations of the model, those that a model states most directly first.
    pub(crate) fn ordered(&self, system: &EquationSystem) -> Vec<EqId> {
        let former = former_states(system);
        let (late, early): (Vec<_>, Vec<_>) = self.fixed.iter().partition(|(v, _)| former[*v]);
        let equations = |fixed: Vec<(VarId, EqId)>| fixed.into_iter().map(|fixed| fixed.1).collect();
        [equations(early), self.initial.clone(), equations(late)].concat()
    }

    /// All equations.
    pub(crate) fn rows(&self) -> Vec<EqId> {
        let fixed = self.fixed.iter().map(|fixed| fixed.1);
        self.model.iter().copied().chain(self.initial.iter().copied()).chain(fixed).collect()
    }
}

/// The conditions that cannot be matched beside the others, each with the smallest set that it closes.
fn unmatched(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    unknowns: &Unknowns,
    conditions: &Conditions,
) -> (Pattern, Vec<(EqId, Part)>) {
    let rows: Vec<EqId> = conditions.model.iter().copied().chain(conditions.ordered(system)).collect();
    let model = pattern(system, algebra, conditions.model.clone(), unknowns);
    let mut matching = first_matching(system, &model, unknowns);
    let pattern = pattern(system, algebra, rows, unknowns);
    let mut augmenter = Augmenter::new();
    let mut left_over = Vec::new();
    for (row, eq) in pattern.incidence.rows().zip(&pattern.rows).skip(conditions.model.len()) {
        if let Augmentation::Blocked(part) = augmenter.augment(&pattern.incidence, &mut matching, row, |_| true) {
            left_over.push((*eq, part));
        }
    }
    (pattern, left_over)
}

/// Variables that were states before index reduction, or are equal to one.
fn former_states(system: &EquationSystem) -> IndexVec<VarId, bool> {
    let mut former = IndexVec::filled(false, system.roles.len());
    for &v in &system.reduction.demoted {
        match system.resolution[v] {
            Resolution::Alias { of, .. } => former[of] = true,
            _ => former[v] = true,
        }
    }
    former
}

fn checked(system: &EquationSystem, eq: EqId, start_of: Option<VarId>) -> Redundant {
    let equation = system.equations[eq];
    let template = system.flat.templates.get(equation.template);
    let side = |value| Residual { value, operands: equation.operands, equation: eq };
    Redundant { left: side(template.left), right: side(template.right), start_of, others: None }
}

/// The conditions of the smallest set that a condition closes, apart from itself.
fn others(
    system: &EquationSystem,
    pattern: &Pattern,
    (part, own): (&Part, EqId),
    conditions: &Conditions,
) -> Vec<String> {
    let rows: FxHashSet<EqId> = part.rows.iter().map(|row| pattern.rows[row.index()]).filter(|&eq| eq != own).collect();
    let fixed = conditions.fixed.iter().filter(|(_, eq)| rows.contains(eq));
    let fixed = fixed.map(|&(v, _)| format!("the fixed start value of `{}`", system.flat.var_name(v)));
    let initial = conditions.initial.iter().filter(|&&eq| rows.contains(&eq) && !is_made(system, eq));
    let initial = initial.map(|&eq| format!("the initial equation `{}`", written_text(system, eq)));
    // Discrete variables begin at their start values.
    let read = rows.iter().chain([&own]).flat_map(|&eq| system.operands_of(system.equations[eq].operands));
    let before = read.filter_map(|operand| match operand.target() {
        Target::Pre(v) | Target::Start(v) if system.roles[v] == Role::Discrete => Some(v),
        _ => None,
    });
    let before: BTreeSet<VarId> = before.collect();
    let before = before.into_iter().map(|v| format!("the start value of `{}`", system.flat.var_name(v)));
    fixed.chain(initial).chain(before).collect()
}

/// The conditions of a set that contradict each other, one of which has to go; those of the model stay.
fn which_to_drop(system: &EquationSystem, pattern: &Pattern, part: &Part, conditions: &Conditions) -> Option<String> {
    let rows: Vec<EqId> = part.rows.iter().map(|row| pattern.rows[row.0 as usize]).collect();
    let fixed = conditions.fixed.iter().filter(|(_, eq)| rows.contains(eq));
    let fixed = fixed.map(|&(v, _)| format!("`fixed = true` of `{}`", system.flat.var_name(v)));
    let initial = conditions.initial.iter().filter(|eq| rows.contains(eq));
    let initial = initial.map(|&eq| format!("the initial equation `{}`", written_text(system, eq)));
    let all: Vec<String> = fixed.chain(initial).collect();
    match all.as_slice() {
        [] => None,
        [only] => Some(format!("drop {only}")),
        _ => Some(format!("drop one of them: {}", first_of(&all, MOST_DROPPED))),
    }
}

fn refuse(
    system: &EquationSystem,
    pattern: &Pattern,
    unknowns: &Unknowns,
    part: &Part,
    contradiction: &Contradiction,
) -> Diagnostic {
    let Contradiction { equation, sides } = contradiction;
    let [left, right] = told_apart(sides[0], sides[1]);
    let text = written_text(system, *equation);
    let names = part_names(system, unknowns, part);
    // Sections of algorithms have unknowns without a name of the user's.
    let of = if names.is_empty() { String::new() } else { format!(" for {names}") };
    let message =
        format!("the initial conditions{of} contradict each other: the sides of `{text}` are {left} and {right}");
    explain_part(Diagnostic::error(Code::InitialUnbalanced, message), system, pattern, unknowns, part)
}

/// Says which conditions are only checked.
pub(crate) fn note_redundant(system: &EquationSystem, redundant: &[Redundant]) -> Vec<Diagnostic> {
    // That equal variables start alike needs no word.
    let is_alias = |v: &VarId| matches!(system.resolution[*v], Resolution::Alias { .. });
    let starts: Vec<VarId> = redundant.iter().filter_map(|r| r.start_of).filter(|v| !is_alias(v)).collect();
    let equations: Vec<EqId> = redundant.iter().filter(|r| r.start_of.is_none()).map(|r| r.left.equation).collect();
    let names = list_names(starts.iter().map(|&v| system.flat.var_name(v)));
    let texts = list_names(equations.iter().map(|&eq| written_text(system, eq)));
    let words = |count: usize| match count {
        1 => ("", "is"),
        _ => ("s", "are"),
    };
    let mut notes = Vec::new();
    if !starts.is_empty() {
        let (s, are) = words(starts.len());
        notes.push(format!(
            "the fixed start value{s} of {names} {are} not needed to determine the start, and {are} only checked"
        ));
    }
    if !equations.is_empty() {
        let (s, are) = words(equations.len());
        notes.push(format!(
            "the initial equation{s} {texts} {are} not needed to determine the start, and {are} only checked"
        ));
    }
    notes.into_iter().map(|note| Diagnostic::note(Code::Chosen, note)).collect()
}

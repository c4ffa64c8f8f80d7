//! Structural faults in the user's words: names, equations and places in the text for sets of equations and unknowns.
//!
//! The smallest over- or under-determined set is found by the Dulmage-Mendelsohn decomposition; here it becomes a
//! sentence with labels at the equations and declarations.  Long lists are cut.

use hyd_flat::{EquationBlock, FlatModel, Made, Operand, Section, Target, VarId};
use hyd_source::{Diagnostic, Span};
use hyd_structure::{
    Incidence, Matching, Part, minimal_overdetermined, minimal_underdetermined, smallest_overdetermined,
    smallest_underdetermined,
};
use hyd_symbolic::{Node, Template};
use rustc_hash::FxHashSet;

use crate::incidence::{Pattern, Unknowns};
use crate::system::{EqId, EquationSystem};

/// At most this many names or labels of a kind.
const MOST_NAMED: usize = 8;
/// At most this many sets are shown of a kind.
const MOST_PARTS: usize = 3;
/// At most this many unmatched equations or unknowns are tried to find the smallest set.
const MOST_TRIED: usize = 32;

/// The text of an equation with the operands it had in the flat model.  What stands in a `when` is shown as that, and in words
/// what makes states of the candidates chosen.
pub fn equation_text(system: &EquationSystem, eq: EqId) -> String {
    text_of(system, eq, FlatModel::print_sides)
}

/// The text of an equation for messages: without names that the translation gave.
pub(crate) fn written_text(system: &EquationSystem, eq: EqId) -> String {
    text_of(system, eq, FlatModel::written_sides)
}

fn text_of(
    system: &EquationSystem,
    eq: EqId,
    sides: impl Fn(&FlatModel, &Template, &[Operand]) -> (String, String),
) -> String {
    let equation = system.equations[eq];
    let block = &system.flat.equations[equation.block as usize];
    let template = system.flat.templates.get(block.template);
    let operands = block.operands_of(equation.element as usize, template.arity as usize);
    if operands.iter().any(|operand| matches!(operand.target(), Target::Chosen(_))) {
        return choice_text(system, operands);
    }
    let (left, right) = sides(&system.flat, &template, operands);
    let condition = |operand: &Operand| variable_of(operand.target()).is_some_and(|v| is_condition(system, v));
    match operands.iter().find(|operand| condition(operand)) {
        None => format!("{left} = {right}"),
        Some(operand) if system.flat.operand_name(*operand) == left => format!("when {right}"),
        Some(_) => format!("{left} := ... in a when"),
    }
}

/// What the equation `sum_k c_k (der(x_k) - z_k) = 0` says.
fn choice_text(system: &EquationSystem, operands: &[Operand]) -> String {
    let rates = operands.iter().filter(|operand| matches!(operand.target(), Target::Der(_)));
    let candidates = list_names(rates.filter_map(|rate| variable_of(rate.target())).map(|v| system.flat.var_name(v)));
    format!("der(state) is the derivative that the constraints give, for a state chosen among {candidates}")
}

/// True for what the translation made, such as conditions of `when`.
pub(crate) fn is_hidden(system: &EquationSystem, target: Target) -> bool {
    variable_of(target).is_some_and(|v| is_of_translation(system, v))
}

/// A variable that the translation made.
pub(crate) fn is_of_translation(system: &EquationSystem, v: VarId) -> bool {
    system.flat.variables[system.flat.locate(v).0].made.is_some()
}

/// How many continuous equations the translation made, each for a variable of its own.
pub(crate) fn made_equations(system: &EquationSystem) -> usize {
    let made = |block: &&EquationBlock| block.made && block.section == Section::Continuous;
    system.flat.equations.iter().filter(made).map(|block| block.count as usize).sum()
}

/// True for an equation that only says what a variable of the translation is, such as a part of a long sum.
pub(crate) fn is_made(system: &EquationSystem, eq: EqId) -> bool {
    system.flat.equations[system.equations[eq].block as usize].made
}

/// The equation itself, or, where it says what a variable of the translation is, the equations in which that stands.
fn written_for(system: &EquationSystem, eq: EqId) -> Vec<EqId> {
    let (mut open, mut written, mut seen) = (vec![eq], Vec::new(), FxHashSet::default());
    while let Some(eq) = open.pop() {
        // What a variable of the translation is may lead back to it through a delay.
        if !seen.insert(eq) {
            continue;
        }
        let equation = system.equations[eq];
        let template = system.flat.templates.get(equation.template);
        let left = match system.flat.templates.arena.node(template.left) {
            Node::Slot(slot) if is_made(system, eq) => system.operands_of(equation.operands)[slot.0 as usize].target(),
            _ => {
                written.push(eq);
                continue;
            }
        };
        let reads =
            |other: &EqId| system.operands_of(system.equations[*other].operands).iter().any(|o| o.target() == left);
        let lasting = system.equations.indices().filter(|&other| system.section(other) == Section::Continuous);
        open.extend(lasting.filter(|other| *other != eq && reads(other)));
    }
    written.sort_unstable();
    written
}

/// A condition of `when`, which the translation made a variable.
pub(crate) fn is_condition(system: &EquationSystem, v: VarId) -> bool {
    system.flat.variables[system.flat.locate(v).0].made == Some(Made::Event)
}

/// Where an equation stands.
pub(crate) fn equation_span(system: &EquationSystem, eq: EqId) -> Span {
    system.flat.equations[system.equations[eq].block as usize].origin.span
}

/// Where a variable is declared, or the component of a library that holds it.
pub(crate) fn variable_span(system: &EquationSystem, v: VarId) -> Span {
    system.flat.shown_span(system.flat.locate(v).0)
}

/// Names in backquotes, the first few of them.
pub(crate) fn list_names(names: impl IntoIterator<Item = String>) -> String {
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    first_of(&names, MOST_NAMED)
}

/// The first names of a list, and how many there are more.
pub(crate) fn first_of(names: &[String], most: usize) -> String {
    let more = names.len().saturating_sub(most);
    let text = names[..names.len() - more].join(", ");
    if more > 0 { format!("{text} and {more} more") } else { text }
}

/// The variable behind a target.
pub(crate) fn variable_of(target: Target) -> Option<VarId> {
    match target {
        Target::Var(v) | Target::Der(v) | Target::Pre(v) | Target::Start(v) => Some(v),
        Target::Const(_)
        | Target::Held(_)
        | Target::Chosen(_)
        | Target::Delayed(_)
        | Target::DelayedRate(_)
        | Target::Input(_)
        | Target::InputRate(_) => None,
    }
}

/// `1 equation`, `2 equations`.
pub(crate) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Labels at the equations.
pub(crate) fn mark_equations(mut diagnostic: Diagnostic, system: &EquationSystem, equations: &[EqId]) -> Diagnostic {
    let mut seen = Vec::new();
    for &eq in equations.iter().filter(|&&eq| !is_made(system, eq)) {
        let span = equation_span(system, eq);
        if !seen.contains(&span) && seen.len() < MOST_NAMED {
            seen.push(span);
            diagnostic = diagnostic.at(span, written_text(system, eq));
        }
    }
    diagnostic
}

/// Labels at the declarations.
pub(crate) fn mark_variables(mut diagnostic: Diagnostic, system: &EquationSystem, variables: &[VarId]) -> Diagnostic {
    for &v in variables.iter().filter(|&&v| !is_of_translation(system, v)).take(MOST_NAMED) {
        let name = system.flat.var_name(v);
        diagnostic = diagnostic.with(variable_span(system, v), format!("`{name}` is declared here"));
    }
    diagnostic
}

/// The smallest over-determined set found from the unmatched equations.
pub(crate) fn smallest_over(incidence: &Incidence, matching: &Matching) -> Option<Part> {
    let parts = matching.unmatched_rows().take(MOST_TRIED);
    let parts = parts.filter_map(|row| minimal_overdetermined(incidence, matching, row).ok());
    parts.min_by_key(|part| part.rows.len())
}

/// Adds to a message what is over- and what is under-determined.
pub(crate) fn explain_parts(
    diagnostic: Diagnostic,
    system: &EquationSystem,
    pattern: &Pattern,
    unknowns: &Unknowns,
    matching: &Matching,
) -> Diagnostic {
    let diagnostic = explain_over(diagnostic, system, pattern, unknowns, matching);
    explain_under(diagnostic, system, pattern, unknowns, matching)
}

/// Adds the smallest over-determined sets found, those that share nothing with one before.
pub(crate) fn explain_over(
    mut diagnostic: Diagnostic,
    system: &EquationSystem,
    pattern: &Pattern,
    unknowns: &Unknowns,
    matching: &Matching,
) -> Diagnostic {
    let rows = matching.unmatched_rows().take(MOST_TRIED);
    let parts = rows.filter_map(|row| minimal_overdetermined(&pattern.incidence, matching, row).ok());
    let mut parts: Vec<Part> = smallest_overdetermined(&pattern.incidence, matching).into_iter().chain(parts).collect();
    parts.sort_by_key(|part| part.rows.len());
    let mut seen: Vec<EqId> = Vec::new();
    let mut shown = 0;
    for part in &parts {
        let equations = part_equations(pattern, part);
        if shown == MOST_PARTS || equations.iter().any(|eq| seen.contains(eq)) {
            continue;
        }
        diagnostic = explain_part(diagnostic, system, pattern, unknowns, part);
        seen.extend(equations);
        shown += 1;
    }
    let rows = matching.unmatched_rows().map(|row| pattern.rows[hyd_index::TypedIndex::index(row)]);
    let rest = rows.filter(|eq| !seen.contains(eq)).flat_map(|eq| written_for(system, eq));
    let rest: Vec<EqId> = rest.filter(|eq| !seen.contains(eq)).collect();
    if !rest.is_empty() && shown > 0 {
        diagnostic = mark_equations(diagnostic, system, &rest);
        let texts = list_names(rest.iter().map(|&eq| written_text(system, eq)));
        diagnostic = diagnostic.help(format!("also left over: {texts}"));
    }
    diagnostic
}

/// Adds one over-determined set.
pub(crate) fn explain_part(
    diagnostic: Diagnostic,
    system: &EquationSystem,
    pattern: &Pattern,
    unknowns: &Unknowns,
    part: &Part,
) -> Diagnostic {
    let equations = part_equations(pattern, part);
    let diagnostic = mark_equations(diagnostic, system, &equations);
    let diagnostic = diagnostic.help(over_sentence(system, unknowns, part, &equations));
    mark_variables(diagnostic, system, &part_variables(unknowns, part))
}

/// Adds the unknowns that no equation is left for, then the smallest under-determined sets found.
pub(crate) fn explain_under(
    mut diagnostic: Diagnostic,
    system: &EquationSystem,
    pattern: &Pattern,
    unknowns: &Unknowns,
    matching: &Matching,
) -> Diagnostic {
    let transpose = pattern.incidence.transpose();
    let columns = matching.unmatched_columns().take(MOST_TRIED);
    let parts = columns.filter_map(|column| minimal_underdetermined(&transpose, matching, column).ok());
    let smallest = smallest_underdetermined(&pattern.incidence, matching).into_iter();
    let (mut alone, mut parts): (Vec<Part>, Vec<Part>) = smallest.chain(parts).partition(|part| part.rows.is_empty());
    if let Some(mut first) = alone.pop() {
        first.columns.extend(alone.iter().flat_map(|part| part.columns.iter().copied()));
        first.columns.sort_unstable();
        first.columns.dedup();
        diagnostic = diagnostic.help(under_sentence(system, unknowns, &first, &[]));
        diagnostic = mark_variables(diagnostic, system, &part_variables(unknowns, &first));
        diagnostic = under_component(diagnostic, system, unknowns, &first);
    }
    parts.sort_by_key(|part| part.columns.len());
    let mut seen: Vec<EqId> = Vec::new();
    let mut shown = 0;
    for part in &parts {
        let equations = part_equations(pattern, part);
        if shown == MOST_PARTS || equations.iter().any(|eq| seen.contains(eq)) {
            continue;
        }
        diagnostic = mark_equations(diagnostic, system, &equations);
        diagnostic = diagnostic.help(under_sentence(system, unknowns, part, &equations));
        diagnostic = mark_variables(diagnostic, system, &part_variables(unknowns, part));
        diagnostic = under_component(diagnostic, system, unknowns, part);
        seen.extend(equations);
        shown += 1;
    }
    diagnostic
}

/// Says what a part that is under-determined lacks: the value of an input, or else an equation of the component around it.
fn under_component(
    mut diagnostic: Diagnostic,
    system: &EquationSystem,
    unknowns: &Unknowns,
    part: &Part,
) -> Diagnostic {
    let variables = part_variables(unknowns, part);
    let open = |v: &&VarId| system.flat.open_inputs.contains(&system.flat.locate(**v).0);
    let inputs: Vec<VarId> = variables.iter().filter(open).copied().collect();
    if !inputs.is_empty() {
        let names = list_names(inputs.iter().map(|&v| system.flat.var_name(v)));
        let help = match inputs.len() {
            1 => format!("nothing is connected to the input {names}: connect it, or give it a value"),
            _ => format!("nothing is connected to the inputs {names}: connect them, or give them values"),
        };
        return diagnostic.help(help);
    }
    if system.flat.imbalances.iter().all(|fault| fault.component.is_empty()) {
        diagnostic = diagnostic.maybe_help(component_of(system, unknowns, part));
    }
    diagnostic
}

/// Names the components that bring too many or too few equations, those of one class together.
pub(crate) fn name_components(mut diagnostic: Diagnostic, system: &EquationSystem) -> Diagnostic {
    let (all, ends) = (&system.flat.imbalances, &system.flat.open_ends);
    if !ends.is_empty() {
        let (class, names) = (&system.flat.name, list_names(ends.iter().map(|name| name.to_string())));
        let (get, their) = if ends.len() == 1 { ("gets its value", "it") } else { ("get their values", "them") };
        diagnostic = diagnostic.help(format!(
            "`{class}` is balanced as a component: {names} {get} where the component is used; check a model that connects {their}"
        ));
    }
    let total = system.flat.count(Section::Continuous) - made_equations(system);
    if let Some(fault) = all.iter().find(|fault| fault.component.is_empty() && fault.given != total) {
        let fate = if fault.given < fault.needed { "missing" } else { "too many" };
        diagnostic = diagnostic.help(format!(
            "`{}` itself contributes {} but needs {}: {} {fate}",
            fault.class,
            counted(fault.given, "equation"),
            fault.needed,
            fault.given.abs_diff(fault.needed),
        ));
    }
    let mut shown: Vec<(Span, usize, usize)> = Vec::new();
    for fault in all.iter().filter(|fault| !fault.component.is_empty()) {
        let key = (fault.declared, fault.needed, fault.given);
        if shown.contains(&key) || shown.len() == MOST_PARTS {
            continue;
        }
        shown.push(key);
        let alike: Vec<String> = all
            .iter()
            .filter(|other| (other.declared, other.needed, other.given) == key && !other.component.is_empty())
            .map(|other| other.component.to_string())
            .collect();
        let given = counted(fault.given, "equation");
        let (plural, contributes) = match alike.len() {
            1 => ("", format!("contributes {given} but needs")),
            _ => ("s", format!("contribute {given} each but need")),
        };
        let (number, names) = (fault.given.abs_diff(fault.needed), list_names(alike));
        let fate = if fault.given < fault.needed { "missing" } else { "too many" };
        diagnostic = diagnostic.with(fault.declared, format!("contributes {given}, needs {}", fault.needed));
        diagnostic = diagnostic.help(format!(
            "the component{plural} {names} {contributes} {}: {number} {fate} in `{}`",
            fault.needed, fault.class,
        ));
    }
    diagnostic
}

/// The component that holds all variables of a part, if they share one below the top.
fn component_of(system: &EquationSystem, unknowns: &Unknowns, part: &Part) -> Option<String> {
    let paths = part_variables(unknowns, part).into_iter().map(|v| {
        let name = system.flat.var_name(v);
        let parts: Vec<String> = name.split('.').map(str::to_string).collect();
        parts[..parts.len() - 1].to_vec()
    });
    let common = paths.reduce(|a, b| a.iter().zip(&b).take_while(|(x, y)| x == y).map(|(x, _)| x.clone()).collect())?;
    let name = common.join(".");
    (!name.is_empty()).then(|| {
        format!("the component `{name}` lacks an equation: add one, or give it a value or a connection from outside")
    })
}

pub(crate) fn part_equations(pattern: &Pattern, part: &Part) -> Vec<EqId> {
    part.rows.iter().map(|row| pattern.rows[row.0 as usize]).collect()
}

fn part_variables(unknowns: &Unknowns, part: &Part) -> Vec<VarId> {
    let mut variables: Vec<VarId> =
        part.columns.iter().filter_map(|&column| variable_of(unknowns.targets[column])).collect();
    variables.sort_unstable();
    variables.dedup();
    variables
}

/// Names of a part's unknowns, each variable once.
pub(crate) fn part_names(system: &EquationSystem, unknowns: &Unknowns, part: &Part) -> String {
    let named = |target: &Target| variable_of(*target).is_none_or(|v| !is_of_translation(system, v));
    let targets = part.columns.iter().map(|&column| unknowns.targets[column]).filter(named);
    list_names(targets.map(|target| system.flat.operand_name(Operand::new(target))))
}

/// The equations of a part, their number and that of its unknowns, all without what the translation made.
fn in_the_text(system: &EquationSystem, part: &Part, equations: &[EqId]) -> (String, usize, usize) {
    let written: Vec<EqId> = equations.iter().copied().filter(|&eq| !is_made(system, eq)).collect();
    let made = equations.len() - written.len();
    let texts = list_names(written.iter().map(|&eq| written_text(system, eq)));
    (texts, written.len(), part.columns.len().saturating_sub(made))
}

pub(crate) fn over_sentence(system: &EquationSystem, unknowns: &Unknowns, part: &Part, equations: &[EqId]) -> String {
    let (texts, rows, columns) = in_the_text(system, part, equations);
    match (rows, columns) {
        (1, 0) => format!("{texts} contains no unknown left to determine"),
        (_, 0) => format!("{texts} contain no unknown left to determine"),
        (rows, columns) => {
            let (rows, columns) = (counted(rows, "equation"), counted(columns, "unknown"));
            let names = part_names(system, unknowns, part);
            let comma = if names.is_empty() { "" } else { ", " };
            format!("{rows} for only {columns}{comma}{names}: {texts}")
        }
    }
}

fn under_sentence(system: &EquationSystem, unknowns: &Unknowns, part: &Part, equations: &[EqId]) -> String {
    let names = part_names(system, unknowns, part);
    let (texts, rows, columns) = in_the_text(system, part, equations);
    match (rows, columns) {
        (0, 1) => format!("no equation determines {names}"),
        (0, _) => format!("no equation determines any of {names}"),
        (rows, columns) => format!(
            "{} left for {}: {names} in {texts}",
            if rows == 1 { "one equation is".to_string() } else { format!("{rows} equations are") },
            counted(columns, "unknown"),
        ),
    }
}
